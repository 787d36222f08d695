"""A change, how it is told, and the pieces of a syntax tree it is made of."""

from __future__ import annotations

import ast
import copy
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from muslin.reading.page import shorter

#: Kinds of slips, the plainest first.
KINDS = (
    "sign", "name", "index", "operation", "order", "turned", "transposed", "number", "length", "power", "brackets",
    "condition", "loop", "extra", "lacks factor", "lacks term", "entries", "another", "odd",
    "where", "nothing",
)  # fmt: skip

#: Detail of the plainest change: a number that is born with fractions.
BORN = "born"

#: Shape of a value: () of a number, (3,) of a vector.
Form = tuple[int, ...]

#: Changes of one expression: kind, what makes two changes the same slip, words, and what stands there instead.
Found = Iterator[tuple[str, str, str, ast.AST]]


@dataclass(frozen=True)
class Repair:
    """A change of a function, and what is wrong if it makes the function right.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    detail : str
        Changes of one kind and one detail are one slip when made together.
    line : int
    words : str
        What is wrong in that line.
    changes : dict
        What stands in place of a node, by its id.
    place : str
        What is computed there, where that is known.
    called : str
        What belongs there, where that has a name.
    more : tuple of Repair
        Other slips that come beside it.
    instead : Repair, optional
        Another change, which does as well in its place.
    """

    kind: str
    detail: str
    line: int
    words: str
    changes: Mapping[int, ast.AST] = field(repr=False)
    place: str = ""
    called: str = ""
    more: tuple[Repair, ...] = ()
    instead: Repair | None = None

    @property
    def sentence(self) -> str:
        """All of it."""
        where = f", in {self.place}" if self.place else ""
        own = f"Line {self.line}{where}: {self.words}."
        if self.instead is not None:
            own += f" Or instead, line {self.instead.line}: {self.instead.words}."
        return " And: ".join([own, *(other.sentence for other in self.more)])


# --- how it is told ------------------------------------------------------------------------------------------

#: What a method is called.
CALLED: Mapping[str, str] = {
    "dot": "a dot product",
    "cross": "a cross product",
    "outer_product": "an outer product",
    "norm": "the length",
    "norm_sqr": "the squared length",
    "normalized": "a vector of length one (normalised)",
    "transpose": "a transpose",
    "inverse": "an inverse",
    "determinant": "a determinant",
    "trace": "a trace",
    "sum": "a sum of entries",
    "rows": "a matrix with the vectors in its rows",
    "cols": "a matrix with the vectors in its columns (transposed)",
    "max": "max",
    "min": "min",
}

OPERATORS: Mapping[type[ast.AST], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.MatMult: "@",
    ast.Div: "/",
    ast.FloorDiv: "//",
    ast.Pow: "**",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}


def text_of(node: ast.AST) -> str:
    """A node's text, which is asked for many times."""
    found: str | None = getattr(node, "_text", None)
    if found is None:
        found = ast.unparse(node)
        node._text = found  # type: ignore[attr-defined]
    return found


def code(node: ast.AST) -> str:
    """A piece of the student's own text."""
    return f"`{shorter(text_of(node))}`"


def like(node: ast.AST) -> str:
    """The text of a node, but for its digits."""
    found: str | None = getattr(node, "_alike", None)
    if found is None:
        found = re.sub(r"\d+", "#", text_of(node))
        node._alike = found  # type: ignore[attr-defined]
    return found


def ratio(stands: float, belongs: float) -> str:
    """How a number compares with the one that belongs there."""
    if not belongs or not stands:
        return ""
    fraction = Fraction(stands / belongs).limit_denominator(24)
    if not fraction or abs(float(fraction) - stands / belongs) > 1e-9:
        return ""
    if fraction == -1:
        return ", it has the wrong sign"
    plain = f"{fraction}" if fraction.denominator <= 6 else f"{stands / belongs:g}"
    shown = {Fraction(2): "twice", Fraction(1, 2): "half of"}.get(fraction, f"{plain} times")
    return f", it is {shown} what belongs there"


def names_in(node: ast.AST, variables: Mapping[str, Any]) -> str:
    """The variables in an expression, in words."""
    names = dict.fromkeys(n.id for n in ast.walk(node) if isinstance(n, ast.Name) and n.id in variables)
    return " and ".join(names) if names else "a number"


def function_of(node: ast.Call) -> str:
    """Name of the function or method that is called."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


# --- pieces --------------------------------------------------------------------------------------------------


def name(text: str) -> ast.Name:
    """A variable."""
    return ast.Name(text, ast.Load())


def number(value: float) -> ast.expr:
    """A number as people write it: 1 / 3 for what has no end."""
    if value < 0:
        whole = number(-value)
        if isinstance(whole, ast.BinOp):
            return ast.BinOp(minus(whole.left), whole.op, whole.right)
        return minus(whole)
    fraction = Fraction(value).limit_denominator(360)
    if len(repr(value)) > 8 and abs(float(fraction) - value) <= 1e-15 * value:
        return ast.BinOp(ast.Constant(fraction.numerator), ast.Div(), ast.Constant(fraction.denominator))
    return ast.Constant(value)


def method(node: ast.expr, called: str, *arguments: ast.expr) -> ast.Call:
    """A method of an expression, called."""
    return ast.Call(ast.Attribute(node, called, ast.Load()), list(arguments), [])


def function(called: str, *arguments: ast.expr) -> ast.Call:
    """A function, called."""
    return ast.Call(name(called), list(arguments), [])


def identity(size: int) -> ast.Call:
    """The identity matrix."""
    return method(
        ast.Attribute(name("ti"), "Matrix", ast.Load()), "identity", name("float"), ast.Constant(size)
    )


def minus(node: ast.expr) -> ast.expr:
    """The negative."""
    return ast.UnaryOp(ast.USub(), node)


def times(a: ast.expr, b: ast.expr) -> ast.expr:
    """A product."""
    return ast.BinOp(a, ast.Mult(), b)


def replaced(node: ast.expr, change: Callable[[Any], ast.AST | None]) -> ast.expr:
    """A copy of an expression in which some nodes are exchanged."""

    class Changer(ast.NodeTransformer):
        def visit(self, inner: ast.AST) -> Any:
            new = change(inner)
            return new if new is not None else self.generic_visit(inner)

    bare = copy.deepcopy(node)
    for inner in ast.walk(bare):
        for kept in ("_text", "_alike", "_inside"):
            inner.__dict__.pop(kept, None)
    made: ast.expr = Changer().visit(bare)
    return made


def with_changes(whole: ast.AST, changes: Mapping[int, ast.AST]) -> ast.AST:
    """An expression or a statement in which some nodes, by id, are others."""
    made: ast.AST = copy.deepcopy(whole, dict(changes))
    return made


def terms(node: ast.expr, sign: int = 1) -> list[tuple[int, ast.expr]]:
    """The terms a sum is made of, with their signs."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        turned = sign if isinstance(node.op, ast.Add) else -sign
        return [*terms(node.left, sign), *terms(node.right, turned)]
    return [(sign, node)]


def total(parts: list[tuple[int, ast.expr]]) -> ast.expr:
    """A sum of terms with signs."""
    (sign, made), *rest = parts
    made = made if sign > 0 else minus(made)
    for sign, term in rest:
        made = ast.BinOp(made, ast.Add() if sign > 0 else ast.Sub(), term)
    return made


def factors(node: ast.expr, op: type[ast.operator]) -> list[ast.expr]:
    """The factors of a product."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, op):
        return [*factors(node.left, op), *factors(node.right, op)]
    return [node]


def product(parts: list[ast.expr], op: type[ast.operator]) -> ast.expr:
    """A product of factors."""
    made, *rest = parts
    for part in rest:
        made = ast.BinOp(made, op(), part)
    return made
