"""What is made as others are: terms of a sum, entries of a list, lines that differ in a number or a name only."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator, Mapping
from typing import Any

from muslin.reading.repairs.pieces import Form, Found, code, name, replaced, terms, text_of
from muslin.reading.repairs.scope import Scope

#: Nodes of what is made as another is; most ways to make it so.
LARGEST, MOST = 40, 60


def changes(scope: Scope, node: ast.expr, form: Form) -> Found:
    """A term, an entry or a line's value made as one beside it is, with another number or name."""
    mine = text_of(node)
    for other in _beside(scope, node):
        if scope.form(other) != form or text_of(other) == mine:
            continue
        for made in counterparts(scope, other):
            if text_of(made) != mine:
                words = f"{code(node)} stands where {code(made)} belongs, made as its counterpart {code(other)} is"
                yield "another", f"{mine}->{text_of(made)}", words, made


def _beside(scope: Scope, node: ast.expr) -> list[ast.expr]:
    """What stands beside an expression, as it does."""
    outer = scope.parent(node)
    if isinstance(outer, (ast.List, ast.Tuple)):
        return [other for other in outer.elts if other is not node]
    if isinstance(outer, ast.AugAssign):
        return [value for value in scope.added(text_of(outer.target)) if value is not node]
    top: Any = node
    while isinstance(scope.parent(top), ast.BinOp) and isinstance(
        getattr(scope.parent(top), "op", None), (ast.Add, ast.Sub)
    ):
        top = scope.parent(top)
    beside = [term for _, term in terms(top)] if top is not node else []
    return [term for term in beside if term is not node] if node in beside else []


def counterparts(scope: Scope, node: ast.expr) -> Iterator[ast.expr]:
    """An expression with its numbers exchanged for others, one name exchanged, or both."""
    if sum(1 for _ in ast.walk(node)) > LARGEST:
        return
    seen: set[str] = set()

    def made() -> Iterator[ast.expr]:
        digits = sorted(set(re.findall(r"\d", text_of(node))) & set("0123"))
        for a, b in itertools.product(digits, "0123"):
            if a != b:
                yield renumbered(node, {a: b}, scope.variables)
        for a, b in itertools.combinations(digits, 2):
            yield renumbered(node, {a: b, b: a}, scope.variables)

    def all_of_them() -> Iterator[ast.expr]:
        for key in scope.idle:  # what is used nowhere may be what is missing
            for old in sorted(_names(node) & set(scope.named(scope.variables[key]))):
                other = replaced(node, lambda n, a=old, b=key: name(b) if _is(n, a) else None)  # type: ignore[misc]
                yield other
                yield from scope.variants(other)
        one = list(made())
        yield from one
        yield from scope.variants(node)
        for other in one:
            yield from scope.variants(other)

    for other in itertools.islice(all_of_them(), 4 * MOST):
        text = text_of(other)
        if text not in seen:
            seen.add(text)
            yield other
        if len(seen) >= MOST:
            return


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def _is(node: ast.AST, key: str) -> bool:
    return isinstance(node, ast.Name) and node.id == key


def renumbered(node: ast.expr, turn: Mapping[str, str], variables: Mapping[str, Any]) -> ast.expr:
    """An expression with digits exchanged in names and indices, where there are such names."""

    def change(inner: ast.AST) -> ast.AST | None:
        if isinstance(inner, ast.Name):
            other = "".join(turn.get(c, c) for c in inner.id)
            return name(other) if other in variables else None
        if isinstance(inner, ast.Constant) and type(inner.value) is int and str(inner.value) in turn:
            return ast.Constant(int(turn[str(inner.value)]))
        return None

    return replaced(node, change)
