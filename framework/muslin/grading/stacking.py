"""Many changes of single expressions, worked out at once: each stands in cases of its own, beside those of the others.

Where the results do not hang linearly on an expression, it is not known what belongs in its place, and every change
must be worked out. What comes after the expression is the same for all of them, so that is done once, for values of
many changes in a few cases each.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from muslin.grading.needs import IMPOSSIBLE
from muslin.judging.reference import TOLERANCE
from muslin.reading.meaning import Fixed, Meaning
from muslin.reading.repairs import Repair

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: Changes that are worked out at once; where many passes of a loop are worked out at once, too.
BESIDE, BESIDE_IN_LOOPS = 32, 12


class Stack:
    """A function worked out on the few cases of a search, many times over.

    Parameters
    ----------
    search : Search
    """

    def __init__(self, search: Search) -> None:
        meaning, self.few = search.meaning, search.few
        self.search, self.beside = search, BESIDE
        if meaning.widened:
            self.few, self.beside = self.few[:2], BESIDE_IN_LOOPS
        cases = np.tile(self.few, self.beside)
        inputs = {key: value[cases] for key, value in meaning.inputs.items()}
        self.meaning = Meaning(meaning.functions, meaning.node.name, inputs)
        self.right, self.cases = search.right[cases], cases

    def fitting(self, changes: Sequence[Repair]) -> list[bool]:
        """Which of some changes, each within one expression, make the few cases right, as far as that is known."""
        found = [True] * len(changes)
        groups: dict[tuple[int, tuple[int, ...]], list[tuple[int, np.ndarray]]] = {}
        for k, change in enumerate(changes):
            node = self._whole(change)
            if node is None or not self._real(node):
                continue
            key = id(node)
            try:
                value = self._values(node, change)
            except IMPOSSIBLE:
                found[k] = False
                continue
            groups.setdefault((key, value.shape), []).append((k, value))
        for (key, _), group in groups.items():
            for start in range(0, len(group), self.beside):
                some = group[start : start + self.beside]
                for (k, _), fits in zip(some, self._fit(key, [value for _, value in some]), strict=False):
                    found[k] = fits
        return found

    def _whole(self, change: Repair) -> ast.AST | None:
        """What comes to something else with a change; where that is a list of entries, the vector or matrix of it."""
        node: ast.AST | None = self.search.whole(change)
        while isinstance(node, (ast.List, ast.Tuple)):
            node = self.search.changes.scope.parent(node)
        return node

    def _real(self, node: ast.AST) -> bool:
        """Whether a node comes to numbers that are known."""
        meaning = self.search.meaning
        known = id(node) in meaning.values or id(node) in meaning.wide_values
        return known and isinstance(node, ast.expr)

    def _values(self, node: ast.AST, change: Repair) -> np.ndarray:
        """What a node comes to in the few cases; of a loop in all its passes."""
        meaning = self.search.meaning
        made = np.asarray(meaning.alone(node, change.changes))
        made = made if made.dtype.kind in "ib" else made.astype(np.float64)
        passes = meaning.rows(node) // meaning.count
        if not passes:
            return np.broadcast_to(made, (meaning.count, *made.shape[1:]))[self.few]
        form = made.shape[1:]
        values: np.ndarray = made.reshape(meaning.count, passes, *form)[self.few]
        return values.reshape(-1, *form)

    def _fit(self, key: int, values: list[np.ndarray]) -> Iterator[bool]:
        """Which of some values make the few cases right in place of a node."""
        missing = self.beside - len(values)
        fixed = np.concatenate([*values, *[values[-1]] * missing])
        try:
            came = self.search.in_units(self.meaning.otherwise({key: Fixed(fixed)}), self.cases)
        except IMPOSSIBLE:
            return iter([True] * len(values))
        right = (np.abs(came - self.right) <= TOLERANCE)[:, self.search.asked].all(axis=1)
        return map(bool, right.reshape(self.beside, -1).all(axis=1))
