"""What is said of a change that makes a function right: what it is called there, and how it should read."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.grading.needs import IMPOSSIBLE
from muslin.reading.repairs import Repair
from muslin.reading.repairs.pieces import with_changes

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: Longest expression that is shown as it should be, where it is the smallest that can be, and where it shows what
#: stands around [characters].
LONGEST, WHOLE = 80, 52

#: Kinds of changes of which it is not known what belongs there.
SAID = ("where", "nothing")

#: Kinds of changes of a part so small that it is shown in what stands around.
PART = ("name", "index", "number")

#: What is so much smaller than what stands in its place does nothing there.
NEARLY = 1e-2


def told(search: Search, change: Repair) -> Repair:
    """A change with where it is, and what belongs there."""
    words = change.words
    if change.kind not in SAID:
        small, large = _as_it_should_be(search, change)
        if small and f"`{small}`" not in words and not words.endswith("` belongs there"):
            words += f", where `{small}` belongs"
        if large and large != small and f"`{large}`" not in words:
            words += f": `{large}`"
    return replace(change, words=words, place=_place(search, change))


def _as_it_should_be(search: Search, change: Repair) -> tuple[str, str]:
    """What is changed as it should read, the smallest whole and one that shows what stands around; or nothing."""
    scope = search.changes.scope
    nodes = [search.node(key) for key in change.changes]
    node: Any = nodes[0]
    if any(new is node for new, node in zip(change.changes.values(), nodes, strict=True)):
        return "", ""
    if isinstance(node, ast.stmt):
        new = change.changes[id(node)]
        short = len(nodes) == 1 and isinstance(new, (ast.Assign, ast.AugAssign))
        text = ast.unparse(ast.fix_missing_locations(with_changes(new, {}))) if short else ""
        return (text, "") if len(text) <= LONGEST else ("", "")
    while node is not None and any(n is not None and not _holds(node, n) for n in nodes):
        node = scope.parent(node)
    if change.kind in PART and len(nodes) == 1:
        node = scope.parent(node)
        while isinstance(node, (ast.Attribute, ast.Tuple, ast.UnaryOp)):
            node = scope.parent(node)
    found: list[str] = []
    while isinstance(node, ast.expr):
        if not isinstance(node, (ast.Tuple, ast.Slice)):
            text = re.sub(r"-0(?![\d.])", "0", ast.unparse(with_changes(node, change.changes)))
            if len(text) > (WHOLE if found else LONGEST):
                break
            found.append(text)
        node = scope.parent(node)
    return (found[0], found[-1]) if found else ("", "")


def _holds(outer: ast.AST, inner: ast.AST) -> bool:
    return any(node is inner for node in ast.walk(outer))


def idle(search: Search, change: Repair) -> bool:
    """Whether a change only makes what stands around it come to one: then that is too much, not a name in it."""
    scope = search.changes.scope
    outer = scope.parent(search.node(next(iter(change.changes))))  # type: ignore[arg-type]
    while isinstance(outer, ast.Attribute):
        outer = scope.parent(outer)
    if change.kind not in ("name", "index"):
        return False
    if _vanishes(search, change):
        return True
    if not isinstance(outer, (ast.Call, ast.BinOp)):
        return False
    search.meaning.seen = {}
    try:
        search.meaning.otherwise(change.changes)
        value = search.meaning.seen.get(id(outer))
    finally:
        search.meaning.seen = None
    return (
        isinstance(value, np.ndarray) and value.ndim == 1 and bool(np.allclose(value, 1, rtol=0, atol=1e-9))
    )


def _vanishes(search: Search, change: Repair) -> bool:
    """Whether what is put in place is nearly zero in the wrong cases: then what stands there is too much."""
    node: Any = search.whole(change)
    scope, meaning = search.changes.scope, search.meaning
    while isinstance(scope.parent(node), (ast.Tuple, ast.Subscript)):
        node = scope.parent(node)
    if len(change.changes) > 1 or id(node) not in meaning.here or isinstance(node, ast.Tuple):
        return False
    shape = (meaning.count, *(scope.form(node) or ()))
    made, stands = (
        np.abs(np.broadcast_to(value, shape))[search.wrong.any(axis=1)]
        for value in (meaning.alone(node, change.changes), meaning.values.get(id(node), 0))
    )
    return bool((made <= NEARLY * stands).all() and stands.any())


def _place(search: Search, change: Repair) -> str:
    """What the smallest quantity is called in which something is changed."""
    search.meaning.seen = {}
    scope = search.changes.scope
    try:
        search.meaning.otherwise(change.changes)
        node: Any = search.node(next(iter(change.changes)))
        if isinstance(node, (ast.Name, ast.Constant, ast.Subscript)):
            node = scope.parent(node)
        while node is not None and not isinstance(node, ast.FunctionDef):
            if words := search.named(search.meaning.seen.get(id(node), 0)):
                return words
            outer = scope.parent(node)
            if isinstance(outer, ast.If) and outer.test is node:
                value = getattr(outer.body[0], "value", None)
                words = search.named(search.meaning.seen.get(id(value), 0)) if value is not None else ""
                return f"the condition for {words}" if words else ""
            node = outer
        return ""
    except IMPOSSIBLE:
        return ""
    finally:
        search.meaning.seen = None
