"""What each expression of a student's function would have to be for its answers to be right, where that is known."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from muslin.judging.reference import TOLERANCE
from muslin.reading.meaning import Fixed, Meaning, Same, Unclear
from muslin.reading.repairs.readable import bent

#: What a change that cannot be made raises.
IMPOSSIBLE = (Unclear, Same, ValueError, TypeError, IndexError, ArithmeticError, AttributeError, KeyError)

#: Stands for a scale of zero, where the right answer is exactly zero and so must be what came.
TINY = 1e-290

#: How closely what is known of a linear dependence must be met before a change is worked out to the end.
NEAR = 1e-5

#: Steps of Newton's method towards the number an expression must be, and how small a step is taken to see the way.
NEWTON, STEP = 12, 1e-7


@dataclass(frozen=True)
class Target:
    """What an expression that is a number must come to.

    Attributes
    ----------
    value : ndarray, (b,)
    asked : ndarray of bool, (b,)
        In which cases.
    """

    value: np.ndarray
    asked: np.ndarray


@dataclass(frozen=True)
class Slope:
    """How all results change with one expression, where they do so linearly.

    Attributes
    ----------
    value : ndarray, (b, p)
        The expression's entries.
    rows : ndarray, (b, m, p)
        Change of each entry of the results with each of them.
    needed : ndarray, (b, p)
        The entries that make all right; the nearest ones, where there is a choice.
    """

    value: np.ndarray
    rows: np.ndarray
    needed: np.ndarray


class Needs:
    """How the answers of a function hang on its expressions.

    Parameters
    ----------
    meaning : Meaning
    expected, scales
        As for `muslin.grading.repairing.repair`.
    """

    def __init__(
        self, meaning: Meaning, expected: Sequence[np.ndarray], scales: Sequence[np.ndarray]
    ) -> None:
        self.meaning = meaning
        self.shapes = [np.shape(e) for e in expected]
        self.scales = [np.maximum(scale, TINY) for scale in scales]
        self.right = self._flat(expected)
        self.came = self._flat(self.meaning.results)
        self.lacking = self.right - self.came
        self.wrong = ~(np.abs(self.lacking) <= TOLERANCE)
        self.usable = np.isfinite(self.came).all(axis=1) & np.isfinite(self.right).all(axis=1)
        self.asked = np.ones(self.right.shape[1], dtype=bool)
        self.smooth = np.concatenate([np.full(e[0].size, e.dtype.kind != "i") for e in expected])
        self._bent = bent(self.meaning.node)
        self._slopes: dict[int, Slope | Target | bool] = {}

    def _flat(self, results: Sequence[Any]) -> np.ndarray:
        """All results of each case in a row, in units of their scales, (b, m)."""
        if len(results) != len(self.shapes):
            raise Unclear
        rows = []
        for one, shape, scale in zip(results, self.shapes, self.scales, strict=True):
            if np.ndim(one) and np.shape(one)[1:] != shape[1:]:
                raise Unclear
            array = np.broadcast_to(np.asarray(one, dtype=np.float64), shape)
            rows.append(array.reshape(len(array), -1) / scale[:, None])
        return np.concatenate(rows, axis=1)

    def _solved(self, node: Any, flat: np.ndarray) -> Target | bool:
        """The number an expression must be in each case, by Newton's method; True if it is not found."""
        asked = self.asked & self.smooth
        value, seen = flat[:, 0].copy(), np.ix_(self.usable, asked)
        if not asked.any():
            return True
        for _ in range(NEWTON):
            step = STEP * (np.abs(value) + 1e-3)
            now, then = (
                self._flat(self.meaning.otherwise({id(node): Fixed(one)})) for one in (value, value + step)
            )
            slope, lacking = (then - now) / step[:, None], np.where(asked, self.right - now, 0.0)
            if (np.abs(lacking[seen]) <= NEAR * 0.01).all():
                changes = np.abs(slope[:, asked]).max(axis=1) > 1e-9
                return Target(value, self.usable & changes)
            square = np.sum(np.where(asked, slope, 0.0) ** 2, axis=1)
            way = np.sum(np.where(asked, slope, 0.0) * lacking, axis=1) / np.where(square > 0, square, np.inf)
            value = value + np.where(np.isfinite(way), way, 0.0)
        return True

    def _near(self, reached: np.ndarray) -> bool:
        """Whether changes of the results, (b, m), are those that are lacking."""
        seen = np.ix_(self.usable, self.asked)
        off = np.abs(reached - self.lacking)[seen]
        return bool((off <= NEAR * (1 + np.abs(self.lacking[seen]))).all())

    def _hope(self, node: ast.AST) -> int:
        """0 if no value in place of a node makes all right, 1 if that is not known, 2 if some does."""
        slope = self._slope(node)
        return int(slope) if isinstance(slope, bool) else 2

    def _slope(self, node: Any) -> Slope | Target | bool:
        """How the results hang on an expression; True if that is not known, False if no value makes them right."""
        key = id(node)
        if key not in self._slopes:
            try:
                self._slopes[key] = self._measured(node)
            except IMPOSSIBLE:
                self._slopes[key] = True
        return self._slopes[key]

    def _measured(self, node: Any) -> Slope | Target | bool:
        value = self.meaning.values.get(id(node))
        if value is None or isinstance(value, (list, tuple)):
            return True
        value = np.asarray(value)
        if value.dtype.kind == "b":
            return True
        count, form = len(self.right), value.shape[1:]
        value = np.broadcast_to(value.astype(np.float64), (count, *form))
        flat = value.reshape(count, -1)
        if id(node) in self._bent:
            return self._solved(node, flat) if not form else True
        step = 0.37 * np.abs(flat).max(axis=1) + (np.abs(flat).max() or 1.0) * 1e-3

        def moved(by: np.ndarray) -> np.ndarray:
            new = Fixed((flat + by).reshape(value.shape))
            return self._flat(self.meaning.otherwise({id(node): new})) - self.came

        units = np.eye(flat.shape[1])
        moves = [moved(step[:, None] * unit) for unit in units]
        rows = np.stack(moves, axis=2) / step[:, None, None]
        touched = np.any([np.abs(m) > 0 for m in moves], axis=0)
        if (self.wrong & ~touched)[np.ix_(self.usable, self.asked)].any():
            return False  # nothing that stands there can make all right
        mixed = step[:, None] * (1 + units.cumsum(axis=0)[-1] * np.arange(1, flat.shape[1] + 1))
        straight = np.einsum("bmp,bp->bm", rows, mixed)
        if not (np.abs(moved(mixed) - straight) <= 1e-7 * (1e-6 + np.abs(straight)))[self.usable].all():
            return self._solved(node, flat) if not form else True
        asked = np.where(self.usable[:, None, None] & self.asked[:, None], rows, 0.0)
        needed = np.where(self.usable[:, None] & self.asked, self.lacking, 0.0)
        best = np.einsum("bpm,bm->bp", np.linalg.pinv(asked, rcond=1e-9), needed)
        if not self._near(np.einsum("bmp,bp->bm", asked, best)):
            return False
        return Slope(flat, rows, flat + best)
