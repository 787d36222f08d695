"""Where a function goes wrong when no change of a symbol or two is found: what alone would have to differ.

Where it is known what an expression would have to come to (`muslin.grading.needs`), that may be a quantity which has a
name on the way to the right answer. Where it has none, the place alone is told, if it cannot be one by chance: a
few numbers that make many right.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.grading.needs import Slope, Target
from muslin.reading.repairs import Repair
from muslin.reading.repairs.pieces import code, text_of

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: Share of the cases in which it must be known what an expression comes to.
MOST = 0.6

#: What a quantity is called by its values, (b, ...), in some of the cases.
Place = Callable[..., str]


def pointed(search: Search) -> Repair | None:
    """The smallest expression that has to be a quantity with a name; else the one that is wrong, whatever it is."""
    places, scope = _places(search), search.changes.scope
    whole = search.place(search.right_values)
    for node in places:
        needed, asked = _needed(search, node)
        if needed is None:
            continue
        called = search.place(needed, asked)
        if called and called != whole and called != search.place(search.meaning.values[id(node)]):
            words = f"{code(node)} stands where {called} belongs"
            if _zero(node):
                words = f"{code(node)}{scope.context(node)} is never changed, where {called} belongs"
            return _repair("where" if _zero(node) else "another", node, words, called)
    for node in places:
        needed, asked = _needed(search, node)
        if needed is None or isinstance(node, ast.Name):
            continue
        slope, entries = search.slope(node), search.wrong[search.usable].any(axis=0).sum()
        if entries > (slope.value.shape[1] if isinstance(slope, Slope) else 1):
            words = (
                f"with something else in place of {code(node)}, and nothing else changed, all would be right"
            )
            if _zero(node):
                words = f"{code(node)}{scope.context(node)} is never changed, and should not stay zero"
            return _repair("where", node, words)
    return None


def _zero(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and not node.value


def _repair(kind: str, node: ast.expr, words: str, called: str = "") -> Repair:
    return Repair(kind, text_of(node), node.lineno, words, {id(node): node}, called=called)


def _places(search: Search) -> list[Any]:
    """Expressions of which it is known what they would have to be, the shortest first, names last."""
    scope = search.changes.scope
    nodes = [n for n in ast.walk(search.meaning.node) if isinstance(n, ast.expr) and scope.counts(n)]
    known = [n for n in nodes if isinstance(search.slope(n), (Slope, Target))]
    return sorted(known, key=lambda n: (isinstance(n, ast.Name), len(text_of(n))))


def _needed(search: Search, node: ast.expr) -> tuple[np.ndarray | None, np.ndarray]:
    """What an expression must come to, where there is one thing only, and in which cases that is known."""
    slope, none = search.slope(node), np.zeros(len(search.right), dtype=bool)
    if isinstance(slope, Target):
        return (slope.value, slope.asked) if slope.asked.mean() > MOST else (None, none)
    if not isinstance(slope, Slope):
        return None, none
    rows = slope.rows[:, search.asked]
    single = np.zeros(len(rows), dtype=bool)
    finite = np.isfinite(rows).all(axis=(1, 2)) & search.usable
    single[finite] = np.linalg.matrix_rank(rows[finite]) == rows.shape[2]
    if single.mean() <= MOST:
        return None, none
    form = np.shape(search.meaning.values[id(node)])[1:]
    return slope.needed.reshape(len(rows), *form), single
