"""Many changes of single expressions, worked out at once: each stands in cases of its own, beside those of the others.

Where the results do not hang linearly on an expression, it is not known what belongs in its place, and every change
must be worked out. What comes after the expression is the same for all of them, so that is done once, for values of
many changes in a few cases each.
"""

from __future__ import annotations

import ast
import copy
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
BESIDE, BESIDE_IN_LOOPS = 32, 4


class Stack:
    """A function worked out on the few cases of a search, many times over.

    Parameters
    ----------
    search : Search
    """

    def __init__(self, search: Search) -> None:
        meaning, self.few = search.meaning, search.few
        self.search, self.beside = search, BESIDE_IN_LOOPS if meaning.widened else BESIDE
        cases = np.tile(self.few, self.beside)
        inputs = {key: value[cases] for key, value in meaning.inputs.items()}
        self.meaning = Meaning(meaning.functions, meaning.node.name, inputs)
        self.right, self.cases = search.right[cases], cases

    def fitting(self, changes: Sequence[Repair]) -> list[bool]:
        """Which of some changes, each of a single expression, make the few cases right, as far as that is known."""
        found = [True] * len(changes)
        groups: dict[tuple[int, tuple[int, ...]], list[tuple[int, np.ndarray]]] = {}
        for k, change in enumerate(changes):
            node, new = self._whole(change)
            if node is None or not self._real(node):
                continue
            key = id(node)
            try:
                value = self._values(node, new)
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

    def _whole(self, change: Repair) -> tuple[ast.AST | None, ast.AST]:
        """What is changed, and what stands there then; of a list of entries the vector or matrix it becomes."""
        ((key, new),) = change.changes.items()
        node = self.search.node(key)
        while isinstance(node, (ast.List, ast.Tuple)):
            outer = self.search.changes.scope.parent(node)
            if not isinstance(outer, (ast.List, ast.Tuple, ast.Call)):
                return None, new
            made = copy.copy(outer)
            entries = outer.args if isinstance(outer, ast.Call) else outer.elts
            replaced = [new if entry is node else entry for entry in entries]
            made.__dict__["args" if isinstance(outer, ast.Call) else "elts"] = replaced
            for kept in ("_text", "_alike", "_inside"):
                made.__dict__.pop(kept, None)
            node, new = outer, made
        return node, new

    def _real(self, node: ast.AST) -> bool:
        """Whether a node comes to numbers that are not counted with."""
        scope, meaning = self.search.changes.scope, self.search.meaning
        outer = scope.parent(node)
        counts = isinstance(outer, (ast.Subscript, ast.Slice, ast.Tuple)) or (
            isinstance(node, ast.Name) and node.id in scope.loops
        )
        known = id(node) in meaning.values or id(node) in meaning.wide_values
        return known and not counts and isinstance(node, ast.expr)

    def _values(self, node: ast.AST, new: ast.AST) -> np.ndarray:
        """What would stand in place of a node in the few cases; of a loop in all its passes."""
        meaning = self.search.meaning
        made = np.asarray(meaning.alone(node, new), dtype=np.float64)
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
