"""What there is in a function that has been worked out: its variables, its parts, what stands where."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TypeVar

from muslin.reading.meaning import Meaning
from muslin.reading.repairs.pieces import Form, code, name, replaced, text_of

Node = TypeVar("Node", bound=ast.AST)

#: Nodes of an expression that may be put somewhere else.
SMALL = 20

#: Longest row or column of which every index is tried.
MOST = 4


class Scope:
    """A function, and the functions of the file that it uses.

    Parameters
    ----------
    meaning : Meaning
    helpers : list of ast.FunctionDef
        Functions of the file that it uses.
    called : dict
        What its own variables are, where that is known.

    Attributes
    ----------
    variables : dict
        Shape of each variable.
    loops : set of str
        Variables that count.
    """

    def __init__(self, meaning: Meaning, helpers: list[ast.FunctionDef], called: Mapping[str, str]) -> None:
        self.meaning, self.called = meaning, called
        self.functions = [meaning.node, *helpers]
        self.variables: Mapping[str, Form] = meaning.variables
        self._parent = {
            id(child): node
            for f in self.functions
            for node in ast.walk(f)
            for child in ast.iter_child_nodes(node)
        }
        loops = [n for f in self.functions for n in ast.walk(f) if isinstance(n, ast.For)]
        self.loops = {n.id for loop in loops for n in ast.walk(loop.target) if isinstance(n, ast.Name)}
        self._limits = {id(n) for loop in loops for n in ast.walk(loop.iter)}

    def parent(self, node: ast.AST) -> ast.AST | None:
        """What a node stands in."""
        return self._parent.get(id(node))

    def form(self, node: ast.AST) -> Form | None:
        """Shape of a node's value, where it has one."""
        return self.meaning.forms.get(id(node))

    def length(self, node: ast.AST) -> int:
        """How many numbers an index may be that stands in square brackets; of a large array, no more than three."""
        place, outer = 0, self.parent(node)
        if isinstance(outer, ast.Tuple):
            place, outer = outer.elts.index(node), self.parent(outer)  # type: ignore[arg-type]
        form = self.form(outer.value) if isinstance(outer, ast.Subscript) else None
        return form[place] if form is not None and place < len(form) and form[place] <= MOST else 3

    @cached_property
    def idle(self) -> list[str]:
        """Variables whose values are used nowhere."""
        inside = (n for n in ast.walk(self.meaning.node) if isinstance(n, ast.Name))
        read = {n.id for n in inside if isinstance(n.ctx, ast.Load)}
        return [key for key in self.variables if key not in read and key not in self.loops]

    @cached_property
    def whole(self) -> list[str]:
        """Arguments that are whole numbers."""
        return [key for key, value in self.meaning.inputs.items() if value.dtype.kind == "i"]

    def counted(self, node: ast.AST) -> bool:
        """Whether an expression is made of whole numbers that count."""
        inside = [n for n in ast.walk(node) if isinstance(n, ast.expr)]
        if any(isinstance(n, (ast.Call, ast.Subscript, ast.Compare)) for n in inside):
            return False
        names = {n.id for n in inside if isinstance(n, ast.Name)}
        return bool(names) and names <= self.meaning.integers

    def has_value(self, key: str, node: ast.AST) -> bool:
        """Whether a variable has a value before a line."""
        stored = (n for n in ast.walk(self.meaning.node) if isinstance(n, ast.Name) and n.id == key)
        first = min((n.lineno for n in stored if isinstance(n.ctx, ast.Store)), default=0)
        return key in self.meaning.inputs or 0 < first < node.lineno  # type: ignore[attr-defined]

    def never_read(self, key: str, node: ast.stmt) -> bool:
        """Whether a variable got a value before a line, in the same block, that is read nowhere in between."""
        outer = self.parent(node)
        blocks = (getattr(outer, field, None) for field in ("body", "orelse"))
        block = next((b for b in blocks if isinstance(b, list) and node in b), [node])
        lines = [*block[: block.index(node)][::-1]]
        read = {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        for line in lines:
            if key in read:
                return False
            target = line.targets[0] if isinstance(line, ast.Assign) else getattr(line, "target", None)
            if (
                isinstance(line, (ast.Assign, ast.AugAssign))
                and isinstance(target, ast.Name)
                and target.id == key
            ):
                return not isinstance(line.value, ast.Constant)
            read |= {n.id for n in ast.walk(line) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        return False

    def in_brackets(self, node: ast.AST) -> bool:
        """Whether an expression is an index of an entry."""
        outer = self.parent(node)
        while isinstance(outer, (ast.Tuple, ast.BinOp)):
            outer = self.parent(outer)
        return isinstance(outer, ast.Subscript)

    def counting(self, node: ast.AST) -> list[str]:
        """Variables that count in the loops a node stands in."""
        return [n.id for loop in self.around(node) for n in ast.walk(loop.target) if isinstance(n, ast.Name)]

    def around(self, node: ast.AST) -> list[ast.For]:
        """The loops a node stands in, the innermost first."""
        found, outer = [], self.parent(node)
        while outer is not None:
            if isinstance(outer, ast.For):
                found.append(outer)
            outer = self.parent(outer)
        return found

    def alias(self, node: Node) -> Node:
        """The node itself, to stand inside of what replaces it."""
        made: Node = self.meaning.alias(node)
        return made

    def counts(self, node: ast.AST) -> bool:
        """Whether a node is an expression whose value is used, and no limit of a loop."""
        if not isinstance(node, ast.expr) or id(node) in self._limits:
            return False
        if not isinstance(getattr(node, "ctx", ast.Load()), ast.Load):
            return False
        return id(node) in self.meaning.forms or isinstance(node, (ast.List, ast.Tuple, ast.Compare))

    def named(self, form: Form) -> list[str]:
        """Variables of a shape, but for those that count."""
        return [key for key, shape in self.variables.items() if shape == form and key not in self.loops]

    @cached_property
    def vectors(self) -> list[str]:
        """Variables that are vectors."""
        return [key for key, shape in self.variables.items() if len(shape) == 1]

    @cached_property
    def matrices(self) -> list[str]:
        """Variables that are matrices."""
        return [key for key, shape in self.variables.items() if len(shape) == 2]

    @cached_property
    def defined(self) -> dict[str, ast.expr]:
        """What those variables are that get a value once."""
        found: dict[str, list[ast.expr]] = {}
        for node in ast.walk(self.meaning.node):
            if isinstance(node, (ast.Assign, ast.AugAssign)):
                for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                    if isinstance(target, ast.Name):
                        found.setdefault(target.id, []).append(node.value)
        return {key: values[0] for key, values in found.items() if len(values) == 1}

    @cached_property
    def parts(self) -> dict[str, tuple[ast.expr, Form]]:
        """Small expressions of the function, by text, with their shapes."""
        found: dict[str, tuple[ast.expr, Form]] = {}
        for node in ast.walk(self.meaning.node):
            shape = self.form(node)
            if shape is None or not isinstance(node, (ast.BinOp, ast.Call, ast.Subscript)):
                continue
            if self.counts(node) and sum(1 for _ in ast.walk(node)) <= SMALL:
                found.setdefault(text_of(node), (node, shape))
        return found

    def added(self, target: str) -> list[ast.expr]:
        """What is added to a variable, line by line."""
        return self._added.get(target, [])

    @cached_property
    def written(self) -> list[str]:
        """Variables that get a value, by name."""
        stored = (n for n in ast.walk(self.meaning.node) if isinstance(n, ast.Name))
        return sorted({n.id for n in stored if isinstance(n.ctx, ast.Store)})

    @cached_property
    def _added(self) -> dict[str, list[ast.expr]]:
        found: dict[str, list[ast.expr]] = {}
        for node in ast.walk(self.meaning.node):
            if isinstance(node, ast.AugAssign) and isinstance(node.op, (ast.Add, ast.Sub)):
                found.setdefault(text_of(node.target), []).append(node.value)
        return found

    def variants(self, node: ast.expr) -> Iterator[ast.expr]:
        """The expression with one variable, or one index, exchanged for another throughout."""
        inside = list(ast.walk(node))
        names = {n.id for n in inside if isinstance(n, ast.Name) and n.id in self.variables}
        for key in sorted(names):
            for other in self.named(self.variables[key]):
                if other != key:
                    yield replaced(node, lambda n, a=key, b=other: name(b) if _is(n, a) else None)  # type: ignore[misc]
        indices = {index for n in inside if (index := _index(n)) is not None}
        for index in sorted(indices):
            for k in {0, 1, 2} - {index}:
                yield replaced(
                    node,
                    lambda n, a=index, k=k: (  # type: ignore[misc]
                        ast.Subscript(n.value, ast.Constant(k), ast.Load()) if _index(n) == a else None
                    ),
                )

    # -- words

    def said(self, key: str) -> str:
        """A variable, and what it is: as the student defined it, and in words."""
        given = self.defined.get(key)
        short = given is not None and not isinstance(given, ast.Constant) and len(text_of(given)) <= 24
        own = f" = {text_of(given)}" if given is not None and short else ""
        words = f" ({self.called[key]})" if key in self.called else ""
        return f"{key}{own}{words}"

    def context(self, node: ast.AST) -> str:
        """Words for what a small part stands in."""
        outer = self.parent(node)
        while isinstance(outer, (ast.Attribute, ast.Tuple, ast.UnaryOp)):
            outer = self.parent(outer)
        if isinstance(outer, ast.Compare):
            return f" in the condition {code(outer)}"
        if isinstance(outer, ast.Assign):
            return f" that {code(outer.targets[0])} gets"
        return f" in {code(outer)}" if isinstance(outer, ast.expr) else ""


def _is(node: ast.AST, key: str) -> bool:
    return isinstance(node, ast.Name) and node.id == key


def _index(node: ast.AST) -> int | None:
    """The number by which an entry of a vector is taken."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        value = node.slice.value
        return value if type(value) is int else None
    return None
