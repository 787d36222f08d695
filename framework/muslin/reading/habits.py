"""Habits of other languages, of the blackboard and of the debugger."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator

from muslin.reading import vocabulary
from muslin.reading.page import Note, Page, assignments, is_taichi, name_of, nodes, shown
from muslin.reading.syntax import CONTINUED


def _power(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor):
            plain = isinstance(node.left, (ast.Name, ast.Subscript, ast.Constant))
            short = f"{shown(node.left)} ** {shown(node.right)}" if plain else "** for ^"
            yield page.note(node, f"^ is something else; a power is **: write {short}.")


def _called(page: Page) -> Iterator[Note]:
    """What is no function and has brackets after it: a missing * or square brackets."""
    computed = {
        name_of(target) for _, target, value in assignments(page.node) if not isinstance(value, ast.Lambda)
    }
    computed |= {
        name.id
        for _, target, _ in assignments(page.node)
        if isinstance(target, ast.Tuple)
        for name in target.elts
        if isinstance(name, ast.Name)
    }
    for node in nodes(page.node):
        if not isinstance(node, ast.Call):
            continue
        called, inside = node.func, ", ".join(shown(argument) for argument in node.args)
        value = isinstance(called, ast.Name) and called.id in page.arguments | computed
        if value and inside and all(isinstance(a, ast.Constant) and type(a.value) is int for a in node.args):
            yield page.note(node, f"an entry has square brackets; write {shown(called)}[{inside}].")
        elif value and len(node.args) > 1:
            words = (
                f"{shown(called)} is a value here, and no function; its entries are {shown(called)}[0], ..."
            )
            yield page.note(node, words)
        elif value or isinstance(called, (ast.Constant, ast.BinOp, ast.Subscript)):
            front = f"({shown(called)})" if isinstance(called, ast.BinOp) else shown(called)
            yield page.note(node, f"a * is missing in front of the bracket; write {front} * ({inside}).")


def _thrown_away(page: Page) -> Iterator[Note]:
    """Statements that compute something and do nothing with it."""
    for node in nodes(page.node):
        if not isinstance(node, ast.Expr):
            continue
        value = node.value
        if isinstance(value, ast.Constant):
            continue  # a docstring, ...
        left = value
        while isinstance(left, ast.BinOp):
            left = left.left
        if isinstance(left, ast.UnaryOp) and isinstance(left.op, (ast.UAdd, ast.USub)):
            yield page.note(
                node, f"this line computes something and nothing gets it. {CONTINUED}", compiles=True
            )
        elif isinstance(value, ast.Compare) and isinstance(value.ops[0], ast.Eq):
            yield page.note(node, "== compares, and changes nothing; write = to give a value.", compiles=True)
        elif isinstance(value, ast.Call):
            called = value.func
            if isinstance(called, ast.Attribute) and name_of(called) not in page.modules:
                base = shown(called.value)
                if called.attr in vocabulary.methods() and called.attr != "fill":
                    name = base if base.isidentifier() and base not in page.arguments else "y"
                    yield page.note(
                        node, f"the result is thrown away; write {name} = {shown(value)}.", compiles=True
                    )
        elif isinstance(value, ast.Attribute):
            yield page.note(
                node, f"nothing is called without brackets; write y = {shown(value)}().", compiles=True
            )
        elif not isinstance(value, (ast.Await, ast.Yield, ast.YieldFrom, ast.NamedExpr)):
            yield page.note(
                node,
                "this line computes something and nothing gets it; write y = ... or delete it.",
                compiles=True,
            )


STOP = "a compiled function cannot stop or ask; take it out. muslin explain {} shows your variables line by line."

#: Calls that stop a program, or ask someone.
STOPS = {"breakpoint", "input", "exit", "quit", "set_trace", "post_mortem", "embed"}


def _debugging(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if isinstance(node, ast.Call):
            called = node.func
            name = called.attr if isinstance(called, ast.Attribute) else name_of(called)
            direct = isinstance(called, ast.Name) and called.id not in page.arguments | page.known
            if name in STOPS and (direct or name_of(called) in ("pdb", "ipdb", "IPython", "sys", "code")):
                yield page.note(node, STOP.format(page.node.name), fatal=True)
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            words = "imports stand at the top of the file, not in a function."
            if {alias.name for alias in node.names} & {"pdb", "ipdb"}:
                words = STOP.format(page.node.name)
            yield page.note(node, words, fatal=True)


def _results(page: Page) -> Iterator[Note]:
    """How many values a return gives, where that can be seen."""
    asked = page.asked
    if not asked:
        return
    want = f"{_count(len(asked))} asked ({', '.join(asked)})"
    for node in nodes(page.node):
        if not isinstance(node, ast.Return):
            continue
        value = node.value
        if value is None or (isinstance(value, ast.Constant) and value.value is None):
            yield page.note(
                node, f"this returns nothing, and {want}; write return and the result.", fatal=True
            )
        elif isinstance(value, ast.Tuple) and len(value.elts) != len(asked):
            given = _count(len(value.elts))
            more = "; one vector is ti.Vector([a, b, c])" if len(asked) == 1 else ""
            if re.search(r"\d,\d", ast.get_source_segment(page.text, node) or ""):
                more = "; a decimal number has a point, as 0.5"
            yield page.note(node, f"{given} returned, and {want}{more}.", fatal=True)
        elif len(asked) > 1 and (_single(value) or _one(value, page)):
            yield page.note(node, f"one value is returned, and {want}; put commas between them.", fatal=True)


def _one(value: ast.expr, page: Page) -> bool:
    """Whether a variable is one value: an argument, or what only gets such."""
    if not isinstance(value, ast.Name):
        return False
    given = [got for _, target, got in assignments(page.node) if name_of(target) == value.id]
    calls = [n for got in given for n in ast.walk(got) if isinstance(n, ast.Call)]
    helped = any(
        name_of(call.func) in page.known for call in calls
    )  # also by a method of a class of one's own
    born = bool(given) or value.id in page.arguments
    unpacked = any(
        isinstance(target, ast.Tuple) and value.id in {name_of(t) for t in target.elts}
        for _, target, _ in assignments(page.node)
    )
    return (born or unpacked) and not helped and not any(isinstance(got, ast.Tuple) for got in given)


def _single(value: ast.expr) -> bool:
    """Whether an expression is one value, and surely not several."""
    if isinstance(value, ast.Call):
        return is_taichi(value, "cast", "Vector", "Matrix", "select", "sqrt", "max", "min", "abs")
    return isinstance(value, (ast.BinOp, ast.UnaryOp, ast.Compare, ast.BoolOp, ast.Subscript, ast.Constant))


def _count(number: int) -> str:
    words = {1: "one value is", 2: "two are", 3: "three are", 4: "four are"}
    return words.get(number, f"{number} are")


def _born_number(page: Page) -> Iterator[Note]:
    """A number that gets a vector: the result of a sum of vectors, begun with 0.0."""
    first: dict[str, tuple[ast.stmt, ast.expr]] = {}
    for statement, target, value in sorted(assignments(page.node), key=lambda found: found[0].lineno):
        if not isinstance(target, ast.Name):
            continue
        if target.id not in first:
            first[target.id] = statement, value
            continue
        born, number = first[target.id]
        plain = isinstance(number, ast.Constant) and type(number.value) in (int, float)
        if plain and _is_vector(value, page):
            yield page.note(
                born,
                f"{target.id} is born as a number, and gets a vector or matrix in line {statement.lineno}; begin with "
                "ti.Vector([0.0, 0.0, 0.0]) or ti.Matrix.zero(float, 3, 3).",
            )
            del first[target.id]


def _is_vector(node: ast.expr, page: Page) -> bool:
    """Whether an expression surely is a vector or a matrix, whatever the arguments are."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        return node.func.attr in (
            "cross",
            "normalized",
            "outer_product",
            "transpose",
            "inverse",
            "Vector",
            "Matrix",
        )
    if isinstance(node, ast.BinOp) and not isinstance(node.op, ast.MatMult):
        return _is_vector(node.left, page) or _is_vector(node.right, page)
    return False


#: Parts of Python that Taichi does not compile -> what to do instead.
NOT_COMPILED: dict[type[ast.AST], str] = {
    ast.Try: "try does not run inside a Taichi function; test with an if before you divide.",
    ast.With: "with does not run inside a Taichi function; take it out.",
    ast.Global: "a function computes from its arguments; take the global out.",
    ast.Lambda: "lambda does not run inside a Taichi function; write the formula itself, or a helper with @ti.func.",
    ast.GeneratorExp: "add the terms up one by one, or in a loop: y = 0.0, then y += ...",
    ast.JoinedStr: "strings do not run inside a Taichi function; take it out.",
    ast.Raise: "raise does not run inside a Taichi function; take it out.",
    ast.ClassDef: "classes do not run inside a Taichi function; take it out.",
    ast.Delete: "del does not run inside a Taichi function; take it out.",
    ast.Is: "is compares objects; write ==.",
    ast.IsNot: "is not compares objects; write !=.",
}


def _not_compiled(page: Page) -> Iterator[Note]:
    printed = {
        inner
        for node in nodes(page.node)
        if isinstance(node, ast.Assert) or (isinstance(node, ast.Call) and name_of(node.func) == "print")
        for inner in ast.walk(node)
    }  # strings there do compile
    for node in nodes(page.node):
        if isinstance(node, ast.Compare):
            for operator in node.ops:
                if type(operator) in NOT_COMPILED:
                    yield page.note(node, NOT_COMPILED[type(operator)])
        elif isinstance(node, ast.FunctionDef) and node is not page.node:
            yield Note(
                node.lineno,
                f"def {node.name}",
                "a function inside a function does not compile; move it above, with @ti.func of its own.",
            )
        elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.MatMult):
            name = shown(node.target)
            yield page.note(node, f"@= does not compile; write {name} = {name} @ {shown(node.value)}.")
        elif type(node) in NOT_COMPILED and hasattr(node, "lineno") and node not in printed:
            yield page.note(node, NOT_COMPILED[type(node)])


HABITS: tuple[Callable[[Page], Iterator[Note]], ...] = (
    _debugging,
    _results,
    _power,
    _called,
    _thrown_away,
    _born_number,
    _not_compiled,
)
