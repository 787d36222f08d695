"""What a reader notices in a student's function: the commonest Taichi mistakes, found in the text alone.

Some of them compile and only make the answer wrong (a variable born as a whole number, a changed argument,
NumPy's `dot`), so no compiler will ever complain.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from muslin.errors import MuslinError
from muslin.source import Source


@dataclass(frozen=True)
class Note:
    """Something noticed: the line, the expression, and what to write instead."""

    line: int
    code: str
    words: str

    def __str__(self) -> str:
        return f"line {self.line}, {self.code}: {self.words}"


@dataclass(frozen=True)
class Page:
    """A function under the eyes: its syntax tree, its arguments, and the file's other functions."""

    node: ast.FunctionDef
    arguments: frozenset[str]
    functions: dict[str, ast.FunctionDef]
    foreign: frozenset[str]

    def note(self, node: ast.AST, words: str) -> Note:
        """A note about a node."""
        code = " ".join(ast.unparse(node).split())
        return Note(node.lineno, code if len(code) <= 60 else code[:57] + "...", words)  # type: ignore[attr-defined]


def notes(text: str, name: str) -> list[Note]:
    """What is noticed in a function and in the functions of the file it uses, in order; [] if it is no Python."""
    try:
        source = Source(text)
    except MuslinError:
        return []
    functions = {key: function.node for key, function in source.functions.items()}
    foreign = {"np", "numpy", "math"}
    for node in source.tree.body:
        if isinstance(node, ast.Import):
            foreign |= {a.asname or a.name for a in node.names if a.name.split(".")[0] in ("numpy", "math")}
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in (
            "numpy",
            "math",
            "scipy",
        ):
            foreign |= {a.asname or a.name for a in node.names}
    found = []
    for used in _used(functions, name):
        arguments = frozenset(a.arg for a in functions[used].args.args)
        page = Page(functions[used], arguments, functions, frozenset(foreign) - arguments)
        found += [note for notice in NOTICED for note in notice(page)]
    return sorted(dict.fromkeys(found), key=lambda note: note.line)


def _used(functions: dict[str, ast.FunctionDef], name: str) -> list[str]:
    found: list[str] = []
    todo = [name]
    while todo:
        this = todo.pop()
        if this in functions and this not in found:
            found.append(this)
            todo += [n.id for n in ast.walk(functions[this]) if isinstance(n, ast.Name)]
    return found


def _assignments(node: ast.AST) -> Iterator[tuple[ast.stmt, ast.expr, ast.expr]]:
    """Statements that give something a value: (statement, target, value)."""
    for statement in ast.walk(node):
        if isinstance(statement, ast.Assign):
            for target in statement.targets:
                yield statement, target, statement.value
        elif isinstance(statement, (ast.AugAssign, ast.AnnAssign)) and statement.value is not None:
            yield statement, statement.target, statement.value


def _name(target: ast.expr) -> str:
    """Variable behind `v`, `v[0]`, `v[0, :]`, `v.x`."""
    while isinstance(target, (ast.Subscript, ast.Attribute)):
        target = target.value
    return target.id if isinstance(target, ast.Name) else ""


def _is_taichi(node: ast.expr, *names: str) -> bool:
    """Whether a call is `ti.NAME(...)`."""
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id in ("ti", "taichi")
        and (not names or node.func.attr in names)
    )


def _whole(node: ast.expr) -> bool:
    """Whether an expression is made of whole numbers only."""
    if isinstance(node, ast.Constant):
        return type(node.value) is int
    if isinstance(node, ast.UnaryOp):
        return _whole(node.operand)
    if isinstance(node, ast.BinOp):
        return not isinstance(node.op, ast.Div) and _whole(node.left) and _whole(node.right)
    if isinstance(node, (ast.List, ast.Tuple)):
        return bool(node.elts) and all(map(_whole, node.elts))
    if _is_taichi(node, "Vector", "Matrix"):
        assert isinstance(node, ast.Call)
        return len(node.args) == 1 and _whole(node.args[0])
    return False


def _lists(page: Page) -> Iterator[Note]:
    born = {
        target.id: statement
        for statement, target, value in _assignments(page.node)
        if isinstance(target, ast.Name) and isinstance(value, (ast.List, ast.ListComp))
    }
    for node in ast.walk(page.node):
        sides = [node.left, node.right] if isinstance(node, ast.BinOp) else []
        sides += [node.value] if isinstance(node, ast.Return) and node.value is not None else []
        sides += (
            [node.func.value] if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) else []
        )
        for side in sides:
            if isinstance(side, ast.Name) and side.id in born:
                yield page.note(
                    born[side.id], f"a Python list is not a vector; write {side.id} = ti.Vector([...])."
                )
            elif isinstance(side, ast.List):
                yield page.note(side, "a Python list is not a vector; write ti.Vector([...]).")


def _whole_numbers(page: Page) -> Iterator[Note]:
    first: dict[str, tuple[ast.stmt, ast.expr]] = {}
    seen: set[str] = set()
    for statement, target, value in sorted(_assignments(page.node), key=lambda found: found[0].lineno):
        name = _name(target)
        if isinstance(target, ast.Name) and name not in seen and not isinstance(statement, ast.AugAssign):
            first[name] = statement, value
            seen.add(name)
        elif name in first and _whole(first[name][1]) and not _whole(value):
            statement_born, _ = first.pop(name)
            yield page.note(
                statement_born,
                f"{name} is born as a whole number, so what it gets in line {statement.lineno} is cut off; "
                "write 0.0 for 0.",
            )


def _integer_division(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
            yield page.note(node, "// cuts off the fraction (1 // 2 is 0); write /.")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "int":
            yield page.note(node, "int cuts off the fraction; leave it out.")
        elif isinstance(node, ast.Call) and _is_taichi(node, "cast") and len(node.args) > 1:
            truth = isinstance(node.args[0], (ast.Compare, ast.BoolOp))
            if not truth and ast.unparse(node.args[1]) in ("int", "ti.i32", "ti.i64"):
                yield page.note(node, "this cuts off the fraction; leave the cast out.")


def _single_precision(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        if isinstance(node, ast.Attribute) and node.attr in ("f32", "f16", "float32", "float16"):
            yield page.note(node, "keeps seven digits where sixteen are asked; leave it out, or write float.")


def _returns(page: Page) -> Iterator[Note]:
    for branch in ast.walk(page.node):
        if isinstance(branch, (ast.If, ast.For, ast.While)):
            if isinstance(branch, ast.If) and _is_taichi(branch.test, "static"):
                continue
            if isinstance(branch, ast.For) and _is_taichi(branch.iter, "static"):
                continue
            for node in ast.walk(branch):
                if isinstance(node, ast.Return):
                    yield page.note(
                        node,
                        "no return inside an if or a loop; give y a value before, change it inside, and end "
                        "with return y.",
                    )


def _undecorated(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            helper = page.functions.get(node.func.id)
            if helper is not None and not helper.decorator_list:
                yield page.note(
                    node, f"write @ti.func on the line above def {helper.name} (line {helper.lineno})."
                )


#: What to write for what people take from NumPy and math.
INSTEAD = {
    "dot": "a.dot(b) for vectors, A @ B for matrices", "matmul": "A @ B", "transpose": "A.transpose()",
    "cross": "a.cross(b)", "outer": "a.outer_product(b)", "norm": "a.norm()", "inv": "A.inverse()",
    "det": "A.determinant()", "trace": "A.trace()", "eye": "ti.Matrix.identity(float, 3)",
    "identity": "ti.Matrix.identity(float, 3)", "zeros": "ti.Matrix.zero(float, 3, 3), or ti.Vector([0.0, 0.0, 0.0])",
    "array": "ti.Vector([...]) or ti.Matrix([...])", "diag": "diag(v), from muslin.given", "svd": "the given svd",
    "column_stack": "ti.Matrix.cols([a, b])", "stack": "ti.Matrix.rows([a, b])", "sum": "v.sum()",
}  # fmt: skip


def _numpy(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        called = node.func if isinstance(node, ast.Call) else None
        if called is None or _name(called) not in page.foreign:
            continue
        name = called.attr if isinstance(called, ast.Attribute) else _name(called)
        yield page.note(
            node,
            f"NumPy and math do not run inside a Taichi function; write {INSTEAD.get(name, f'ti.{name}')}.",
        )


def _changed_arguments(page: Page) -> Iterator[Note]:
    for statement, target, _ in _assignments(page.node):
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        for one in targets:
            if (name := _name(one)) in page.arguments:
                yield page.note(
                    statement,
                    f"from here on {name} is not the argument {name} any more; make a new variable.",
                )


def _recursion(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
        if page.node.name in _used(page.functions, called):
            yield page.note(node, f"{page.node.name} calls itself, and Taichi cannot; write a loop.")


def _loops(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        if not isinstance(node, ast.For):
            continue
        over = node.iter
        if isinstance(over, ast.Call) and _is_taichi(over, "static") and len(over.args) == 1:
            over = over.args[0]
        plain = isinstance(over, ast.Call) and isinstance(over.func, ast.Name) and over.func.id == "range"
        if plain or (_is_taichi(over, "ndrange", "grouped", "range")):
            continue
        if over is not node.iter and isinstance(over, (ast.List, ast.Tuple, ast.Call)):
            continue  # ti.static over a list of numbers, enumerate, zip
        yield Note(
            node.lineno,
            f"for {ast.unparse(node.target)} in {ast.unparse(node.iter)}",
            "Taichi loops over numbers, not over vectors, matrices or lists; write for k in ti.static(range(3)) "
            "and take v[k] or A[k, :].",
        )


def _double_index(page: Page) -> Iterator[Note]:
    for node in ast.walk(page.node):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Subscript):
            yield page.note(node, "an entry of a matrix is A[i, j], a row A[i, :].")


#: What is looked for, the ten commonest mistakes among them.
NOTICED: tuple[Callable[[Page], Iterator[Note]], ...] = (
    _lists,
    _whole_numbers,
    _integer_division,
    _single_precision,
    _returns,
    _undecorated,
    _numpy,
    _changed_arguments,
    _recursion,
    _loops,
    _double_index,
)
