"""Two slips in one line: changes of a symbol each, which only together make a function right."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from muslin.reading.repairs import Repair

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: Kinds of changes of which two may come together; most of them in a line of which all pairs are looked at.
KINDS, MOST = ("sign", "name", "index", "order", "operation", "transposed", "turned", "number", "power"), 48


def pairs(search: Search, singles: Sequence[Repair]) -> Iterator[Repair]:
    """Two of the single changes of a function at once, in one line."""
    lines: dict[int, tuple[ast.expr, list[Repair]]] = {}
    for change in singles:
        node = search.whole(change) if len(change.changes) == 1 and change.kind in KINDS else None
        line = search.line(node) if node is not None else None
        if line is not None and node is not line:
            found = lines.setdefault(id(line), (line, []))[1]
            if len(found) < MOST:
                found.append(change)
    for line, found in sorted(lines.values(), key=lambda pair: -search.hope(pair[0])):
        if search.hope(line):
            for one, two in itertools.combinations(found, 2):
                if not _within(search, one, two):
                    made = {**one.changes, **two.changes}
                    yield replace(one, changes=made, more=(two,), detail=f"{one.detail} and {two.detail}")


def _within(search: Search, one: Repair, two: Repair) -> bool:
    """Whether what one change replaces holds what the other does."""
    a, b = (search.node(next(iter(change.changes))) for change in (one, two))
    return a is b or any(n is b for n in ast.walk(a)) or any(n is a for n in ast.walk(b))  # type: ignore[arg-type]
