"""The pieces edits are made of, and an edit made."""

from __future__ import annotations

import ast
import copy
import itertools
import re
from collections.abc import Iterator, Mapping
from typing import Any

from muslin.authoring.edits.words import Change


def call(node: ast.expr, method: str, *arguments: ast.expr) -> ast.Call:
    """A method of an expression, called."""
    return ast.Call(ast.Attribute(node, method, ast.Load()), list(arguments), [])


def numeral(value: float) -> ast.expr:
    """A number."""
    return ast.Constant(value) if value >= 0 else ast.UnaryOp(ast.USub(), ast.Constant(-value))


def minus(node: ast.expr) -> ast.expr:
    """The negative."""
    return ast.UnaryOp(ast.USub(), node)


def absolute(node: ast.expr) -> ast.Call:
    """The absolute value."""
    return ast.Call(ast.Name("abs", ast.Load()), [node], [])


def operation(node: ast.BinOp, op: ast.operator) -> ast.BinOp:
    """The same sides under another operator."""
    return ast.BinOp(node.left, op, node.right)


def others(value: float) -> Iterator[float]:
    """Numbers people write for another one."""
    found = [0, 1, 2, -value, value + 1, value - 1, 2 * value, value / 2, value * value, 3, 4, 6]
    if value and abs(value) < 0.01:
        found = [0, *(value * 10.0**k for k in (-9, -6, -3, -2, -1, 1, 2, 3, 4, 5))]
    if value >= 6:
        found += [value / 4, value / 3, value * 1.5, 8, 9, 10, 12, 18, 24, 36]
    yield from (other for other in dict.fromkeys(found) if other != value)


def shape_of(node: ast.AST) -> str:
    """The text of a node, but for its digits: of s[0] - 1 and of s[1] - 1 it is the same."""
    return re.sub(r"\d+", "#", ast.unparse(node))


def terms(node: ast.expr) -> list[ast.expr]:
    """The terms a sum is made of; nothing if it is no sum."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        return [part for side in (node.left, node.right) for part in (terms(side) or [side])]
    return []


def square_outside(n: Any) -> ast.AST:
    """(a + b)^2 for a^2 + b^2."""
    if not (isinstance(n.right, ast.BinOp) and isinstance(n.right.op, ast.Pow)):
        raise ValueError
    return ast.BinOp(ast.BinOp(n.left.left, n.op, n.right.left), ast.Pow(), n.left.right)


def square_inside(n: Any) -> ast.AST:
    """a^2 + b^2 for (a + b)^2."""
    if not isinstance(n.left, ast.BinOp):
        raise ValueError
    inner = n.left
    return ast.BinOp(ast.BinOp(inner.left, n.op, n.right), inner.op, ast.BinOp(inner.right, n.op, n.right))


def spread_right(n: Any) -> ast.AST:
    """A * b + c for a * (b + c)."""
    if not (isinstance(n.right, ast.BinOp) and isinstance(n.right.op, (ast.Add, ast.Sub))):
        raise ValueError
    return ast.BinOp(ast.BinOp(n.left, n.op, n.right.left), n.right.op, n.right.right)


def spread_left(n: Any) -> ast.AST:
    """A + b * c for (a + b) * c."""
    if not (isinstance(n.left, ast.BinOp) and isinstance(n.left.op, (ast.Add, ast.Sub))):
        raise ValueError
    return ast.BinOp(n.left.left, n.left.op, ast.BinOp(n.left.right, n.op, n.right))


def number(function: ast.FunctionDef) -> None:
    """Give every expression and statement a `number`, and as `last` one above all those inside it."""
    count = itertools.count()

    def visit(node: Any) -> None:
        numbered = isinstance(node, (ast.expr, ast.stmt))  # Python shares the other nodes between trees
        if numbered:
            node.number = next(count)
        for child in ast.iter_child_nodes(node):
            visit(child)
        if numbered:
            node.last = next(count)

    visit(function)


def applied(function: ast.FunctionDef, changes: Mapping[int, Change]) -> ast.FunctionDef:
    """A function with an edit made, inner changes first; what is not on the way to a change is shared, not copied."""
    made: ast.FunctionDef = _made(function, changes)
    return made


def _made(node: Any, changes: Mapping[int, Change]) -> Any:
    own = getattr(node, "number", None)
    if own is not None and not any(own <= k <= node.last for k in changes):
        return node
    replaced: dict[str, Any] = {}
    for field, value in ast.iter_fields(node):
        if isinstance(value, ast.AST):
            new: Any = _made(value, changes)
            same = new is value
        elif isinstance(value, list):
            new = [_made(entry, changes) if isinstance(entry, ast.AST) else entry for entry in value]
            same = all(one is other for one, other in zip(new, value, strict=True))
        else:
            continue
        if not same:
            replaced[field] = new
    if replaced:
        node = copy.copy(node)
        for field, new in replaced.items():
            setattr(node, field, new)
    change = changes.get(own) if own is not None else None
    return change(node) if change is not None else node
