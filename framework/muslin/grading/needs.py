"""What each expression of a student's function would have to be for its answers to be right, where that is known."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
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

#: Most entries of an expression of which it is asked how the results hang on them.
WIDEST = 16

#: Cases by which most of what may stand in a place is told not to fit; where many passes of a loop are worked out at
#: once, and so many numbers of each.
FEW, FEWER = 5, 3

#: Share of the cases in which a number must be met that Newton's method has found: there may be two that are right.
MOST_CASES = 0.7

#: Steps of Newton's method towards the number an expression must be, how small a step is taken to see the way, and for
#: how many expressions of a function.
NEWTON, STEP, SOLVED_FOR = 9, 1e-7, 16


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

    def off(self, values: np.ndarray, cases: Any = slice(None)) -> np.ndarray:
        """How far other values are from these, where the results hang on them."""
        with np.errstate(all="ignore"):
            return np.where(np.abs(self.rows[cases]).max(axis=-2) > 0, values - self.value[cases], 0.0)


@dataclass(frozen=True)
class Spread:
    """How the results change with a number in a loop that is worked out at once, each entry of them with one pass.

    Attributes
    ----------
    value : ndarray, (b * passes,)
    rate : ndarray, (b, m)
        Change of each entry of the results with it.
    row : ndarray of int, (b, m)
        In which row it stands.
    """

    value: np.ndarray
    rate: np.ndarray
    row: np.ndarray


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
        compared = [n for n in ast.walk(self.meaning.node) if isinstance(n, ast.Compare)]
        self._compared = {id(side) for n in compared for side in (n.left, *n.comparators)}
        self._slopes: dict[int, Slope | Target | Spread | bool] = {}
        self._solved_for = 0

    def _flat(self, results: Sequence[Any]) -> np.ndarray:
        """All results of each case in a row, in units of their scales, (b, m)."""
        return self.in_units(results, np.arange(len(self.scales[0])))

    def in_units(self, results: Sequence[Any], cases: np.ndarray) -> np.ndarray:
        """The same of some of the cases."""
        if len(results) != len(self.shapes):
            raise Unclear
        rows = []
        for one, (_, *form), scale in zip(results, self.shapes, self.scales, strict=True):
            if np.ndim(one) and np.shape(one)[1:] != tuple(form):
                raise Unclear
            array = np.broadcast_to(np.asarray(one, dtype=np.float64), (len(cases), *form))
            rows.append(array.reshape(len(array), -1) / scale[cases, None])
        return np.concatenate(rows, axis=1)

    def _solved(self, node: Any, flat: np.ndarray) -> Target | bool:
        """The number an expression must be in each case, by Newton's method; True if it is not found."""
        asked = self.asked & self.smooth
        value, changes = flat[:, 0].copy(), np.zeros(len(flat), dtype=bool)
        met, now = changes, self.came
        if not asked.any() or self._solved_for >= SOLVED_FOR:
            return True
        if (divided := self._divided(node, flat)) is not None:
            return divided
        self._solved_for += 1
        for k in range(NEWTON):
            step = STEP * (np.abs(value) + 1e-3)
            if k:
                now = self._flat(self.meaning.otherwise({id(node): Fixed(value)}))
            then = self._flat(self.meaning.otherwise({id(node): Fixed(value + step)}))
            slope, lacking = (then - now) / step[:, None], np.where(asked, self.right - now, 0.0)
            met = (np.abs(lacking) <= NEAR * 0.01).all(axis=1) & self.usable
            changes |= np.abs(slope[:, asked]).max(axis=1) > 1e-9
            if met[self.usable].all():
                return Target(value, self.usable & changes) if changes[self.usable].any() else True
            square = np.sum(np.where(asked, slope, 0.0) ** 2, axis=1)
            way = np.sum(np.where(asked, slope, 0.0) * lacking, axis=1) / np.where(square > 0, square, np.inf)
            value = value + np.where(np.isfinite(way) & ~met, way, 0.0)
        enough = met.sum() > MOST_CASES * self.usable.sum() and changes[met].any()
        return Target(value, met & changes) if enough else True

    def _divided(self, node: Any, flat: np.ndarray) -> Target | None:
        """The number an expression must be that all results are divided by; None if they are not."""
        asked, value = self.asked & self.smooth, flat[:, 0]
        with np.errstate(all="ignore"):
            inverse = 1 / value
            step = 0.37 * np.abs(inverse) + 1e-3
            one, two = (
                self._flat(self.meaning.otherwise({id(node): Fixed(1 / (inverse + k * step))})) - self.came
                for k in (1, 2)
            )
        usable = self.usable & np.isfinite(inverse)
        moved = one[np.ix_(usable, asked)]
        if (
            not usable.any()
            or not (np.abs(two[np.ix_(usable, asked)] - 2 * moved) <= 1e-7 * (1e-6 + np.abs(moved))).all()
        ):
            return None
        rows = np.where(asked, one / step[:, None], 0.0)
        square = np.sum(rows**2, axis=1)
        way = np.sum(rows * np.where(asked, self.lacking, 0.0), axis=1) / np.where(square > 0, square, np.inf)
        if not self._near(rows * way[:, None]):
            return None
        return Target(1 / (inverse + way), usable & (square > 0))

    def _spread(self, node: Any, value: Any) -> Spread | bool:
        """How the results hang on a number in a loop; False if no numbers there make them right."""
        count, rows = len(self.right), self.meaning.rows(node)
        array = np.broadcast_to(np.asarray(value, dtype=np.float64), (rows,)) if not np.ndim(value) else value
        passes = array.size // count
        if array.ndim != 1 or passes * count != array.size or passes < 2:
            return True
        step = 0.37 * np.abs(array).max() + 1e-3
        known = np.sqrt(2.0 + np.arange(passes))  # no mean of some is another one
        weights = np.tile(known, count)

        def moved(by: np.ndarray) -> np.ndarray:
            return self._flat(self.meaning.otherwise({id(node): Fixed(array + by)})) - self.came

        one, far, each = (
            moved(step * np.ones(array.size)),
            moved(2 * step * np.ones(array.size)),
            moved(step * weights),
        )
        close = 1e-7 * (1e-6 + np.abs(one))
        if not (np.abs(far - 2 * one) <= close)[self.usable].all():
            return True
        if (self.wrong & ~(np.abs(one) > 0) & ~(np.abs(each) > 0))[np.ix_(self.usable, self.asked)].any():
            return False
        with np.errstate(all="ignore"):
            ratio = np.where(np.abs(one) > 0, each / one, 1.0)
        at = np.clip(np.rint(np.where(np.isfinite(ratio), ratio, 0.0) ** 2 - 2).astype(int), 0, passes - 1)
        if not ((np.abs(ratio - known[at]) <= 1e-7) | (np.abs(one) == 0))[self.usable].all():
            return True
        row = np.arange(count)[:, None] * passes + at
        return Spread(array, one / step, row)

    def _reaches(self, spread: Spread, made: np.ndarray) -> bool:
        """Whether numbers in place of one in a loop would make the results right, as far as one can tell."""
        new = np.broadcast_to(made, spread.value.shape)
        return self._near(spread.rate * (new - spread.value)[spread.row])

    def _near(self, reached: np.ndarray) -> bool:
        """Whether changes of the results, (b, m), are those that are lacking."""
        seen = np.ix_(self.usable, self.asked)
        off = np.abs(reached - self.lacking)[seen]
        return bool((off <= NEAR * (1 + np.abs(self.lacking[seen]))).all())

    @staticmethod
    def _meets(target: Target, values: np.ndarray, cases: Any = slice(None)) -> np.ndarray:
        """Whether numbers, (..., b), are those that are needed, in most of the cases."""
        needed, asked = target.value[cases], target.asked[cases]
        off = np.abs(values - needed) <= NEAR * (np.abs(needed) + 1e-9)
        met: np.ndarray = off[..., asked].sum(axis=-1) >= MOST_CASES * asked.sum()
        return met

    @property
    def some(self) -> np.ndarray:
        """Some cases for a search that is dear: a few wrong ones, and one that is right."""
        right = np.flatnonzero(~self.wrong.any(axis=1))
        return np.concatenate([self.few[:FEWER], right[-1:]])

    @cached_property
    def few(self) -> np.ndarray:
        """A few cases, by which most can be told not to fit: wrong ones."""
        wrong = self.wrong.any(axis=1)
        cases = np.flatnonzero(self.usable & wrong if (self.usable & wrong).any() else wrong)
        return cases[:: -(-len(cases) // FEW) or 1]

    def fits(self, node: ast.AST, values: np.ndarray) -> np.ndarray:
        """Which of many values in a few cases, (n, few, ...), would make them right in place of a node."""
        slope = self.slope(node)
        if isinstance(slope, (bool, Spread)) or (
            isinstance(slope, Target) and not slope.asked[self.few].any()
        ):
            return np.zeros(len(values), dtype=bool)
        if isinstance(slope, Target):
            return self._meets(slope, values, self.few)
        # First one number of one case: it tells nearly all that do not fit.
        first, weights = self.few[0], 1 + np.arange(self.asked.sum()) % 7 * 0.37
        way, far = weights @ slope.rows[first][self.asked], self.lacking[first, self.asked]
        off = slope.off(values[:, 0].reshape(len(values), -1), first) @ way - weights @ far
        found: np.ndarray = np.abs(off) <= 10 * NEAR * (1 + weights @ np.abs(far))
        if not found.any():
            return found
        moved = slope.off(values[found].reshape(-1, len(self.few), slope.value.shape[1]), self.few)
        rows, lacking = slope.rows[self.few][:, self.asked], self.lacking[self.few][:, self.asked]
        near = np.abs(np.einsum("bmp,nbp->nbm", rows, moved) - lacking) <= NEAR * (1 + np.abs(lacking))
        found[found] = near.all(axis=(1, 2))
        return found

    def hope(self, node: ast.AST) -> int:
        """0 if no value in place of a node makes all right, 1 if that is not known, 2 if some does."""
        slope = self.slope(node)
        return int(slope) if isinstance(slope, bool) else 2

    def slope(self, node: Any) -> Slope | Target | Spread | bool:
        """How the results hang on an expression; True if that is not known, False if no value makes them right."""
        key = id(node)
        if key not in self._slopes:
            try:
                self._slopes[key] = self._measured(node)
            except IMPOSSIBLE:
                self._slopes[key] = True
        return self._slopes[key]

    def _measured(self, node: Any) -> Slope | Target | Spread | bool:
        value = self.meaning.values.get(id(node))
        if value is None and id(node) in self.meaning.wide_values and id(node) not in self._bent:
            return self._spread(node, self.meaning.wide_values[id(node)])
        if value is None or isinstance(value, (list, tuple)):
            return True
        value = np.asarray(value)
        if value.dtype.kind == "b":
            return True
        count, form = len(self.right), value.shape[1:]
        if np.prod(form) > WIDEST:
            return True
        value = np.broadcast_to(value.astype(np.float64), (count, *form))
        flat = value.reshape(count, -1)
        if id(node) in self._compared:
            return True  # it is on one side or on the other: there is no way towards a number
        if id(node) in self._bent:
            return self._solved(node, flat) if not form else True
        size = np.abs(np.where(np.isfinite(flat), flat, 0.0))  # a branch not taken may divide by zero
        step = 0.37 * size.max(axis=1) + (size.max() or 1.0) * 1e-3

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
