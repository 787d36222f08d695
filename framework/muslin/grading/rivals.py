"""Of several changes that each make a function right, the one that leaves the rest of it as it is in a right one.

A sign may be mended where it is lost or where it is used. What stands between the two tells which: after the right
change it comes to quantities that are known by name, after the other to their negatives.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.grading.needs import IMPOSSIBLE
from muslin.reading.repairs import KINDS, Repair

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: Share of the cases in which an expression must come to a result.
MOST = 0.8

#: Share of the best in known quantities from which a plainer change is told beside it.
CLOSE = 0.5

#: Kinds from which on a change is not told beside another one that does as well.
LESS_PLAIN = KINDS.index("lacks term")


def likeliest(search: Search, found: Sequence[Repair]) -> Repair:
    """The change after which most expressions are known quantities; another one in its place, if it does as well."""
    single = min(
        (KINDS.index(change.kind) for change in found if len(change.changes) == 1), default=len(KINDS)
    )
    found = [change for change in found if len(change.changes) == 1 or KINDS.index(change.kind) < single]
    if len(found) < 2 or found[0].detail.startswith("once, never read"):
        return found[0]
    seen = [_seen(search, change) for change in found]
    touched = set().union(*seen)
    scores = [sum(_is_known(search, values, key) for key in touched) for values in seen]
    best = max(scores)
    alike = [change for change, score in zip(found, scores, strict=True) if score == best]
    alike.sort(key=_taken_for_another)
    same = [change for change in alike if change.kind == alike[0].kind]
    if alike[0].kind in ("lacks factor", "lacks term"):  # where all comes together, but not at a name alone
        first = min(same, key=lambda change: (_of_a_name(search, change), -change.line))
    else:
        first = min(same, key=lambda change: (_taken_for_another(change), change.line))
    if scores[0] >= CLOSE * best and KINDS.index(found[0].kind) <= KINDS.index(first.kind):
        alike = [found[0], *alike]
    others = alike
    if _turns(first):  # a sign may be lost in many a line: the next best is told, too
        others = [*alike, *(change for change in found if _turns(change))]
    other = next((change for change in others if _as_plain(change, first)), None)
    return first if other is None else replace(first, instead=other)


def _taken_for_another(change: Repair) -> bool:
    """Whether a change is made when another one is meant: a length of one takes a factor away, -= a minus elsewhere."""
    less = change.detail == "augmented" and "in place of -=" in change.words
    return less or change.detail == "normalized"


def _turns(change: Repair) -> bool:
    """Whether a change turns a sign."""
    return change.kind in ("sign", "turned") or "sign is wrong" in change.words


def leads_to_what_is_known(search: Search, change: Repair) -> bool:
    """Whether the line that is changed comes to a quantity with a name, or to the result; so of other changes."""
    node = search.whole(change)
    line = search.line(node) if node is not None else None
    if node is None or line is None or isinstance(search.changes.scope.parent(line), ast.If):
        return True
    try:
        return _is_known(search, _seen(search, change), id(line))
    except IMPOSSIBLE:
        return True


def _of_a_name(search: Search, change: Repair) -> bool:
    return isinstance(search.node(next(iter(change.changes))), ast.Name)


def _seen(search: Search, change: Repair) -> Mapping[int, Any]:
    """What expressions come to that a change makes others of, by their id."""
    meaning = search.meaning
    meaning.seen = {}
    try:
        meaning.otherwise(change.changes)
        return {
            key: value
            for key, value in meaning.seen.items()
            if key in meaning.values and not isinstance(search.node(key), ast.Name)
        }
    finally:
        meaning.seen = None


def _is_known(search: Search, values: Mapping[int, Any], key: int) -> bool:
    value = values.get(key, search.meaning.values.get(key))
    if value is None or isinstance(value, (list, tuple)) or not np.ndim(value):
        return False
    return bool(search.named(value)) or any(_agree(np.asarray(value), right) for right in search.expected)


def _agree(values: np.ndarray, right: np.ndarray) -> bool:
    """Whether an expression comes to a result, in most of the cases."""
    if values.shape != right.shape:
        return False
    met = np.isclose(values, right, rtol=1e-6, atol=0.0).reshape(len(right), -1).all(axis=1)
    return bool(met.mean() > MOST)


def _as_plain(change: Repair, first: Repair) -> bool:
    """Whether a change may as well be the one that is meant."""
    kind = KINDS.index(change.kind)
    return change.line != first.line and len(change.changes) == 1 and kind < LESS_PLAIN
