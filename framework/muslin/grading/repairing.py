"""The one change of a student's own function that makes every public case right: it names the mistake, and its line.

The text is read, never run (`muslin.reading.meaning`), so this may be done where no student's code runs. Most changes
need not be tried: where the result hangs linearly on an expression, it is known what the expression would have to be.

Longer than others: one search, whose ways to try a change share what has been worked out and what it may cost.
"""

from __future__ import annotations

import ast
import itertools
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.judging.reference import TOLERANCE
from muslin.reading.meaning import Fixed, Meaning, Same, Unclear
from muslin.reading.page import used
from muslin.reading.repairs import Changes, Repair
from muslin.reading.source import Source

#: Most changes that are looked at; most that are worked out to the end, for all entries and for one of them alone.
LOOKED, TRIED, TRIED_APART = 6000, 600, 200

#: Most steps taken for one function: they bound the time, whatever the text is.
SPENT = 400_000

#: Longest text that is read, longest line, deepest brackets and indentation [characters].
LONGEST, WIDEST, DEEPEST, INDENTED = 30_000, 2_000, 40, 80

#: Most entries of the results that are wrong where several slips are looked for.
PARTS = 4

#: What a change that cannot be made raises.
IMPOSSIBLE = (Unclear, Same, ValueError, TypeError, IndexError, ArithmeticError, AttributeError, KeyError)

#: Stands for a scale of zero, where the right answer is exactly zero and so must be what came.
TINY = 1e-290

#: How closely what is known of a linear dependence must be met before a change is worked out to the end.
NEAR = 1e-5


def repair(
    text: str,
    name: str,
    inputs: Mapping[str, np.ndarray],
    got: Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
    scales: Sequence[np.ndarray],
    place: Callable[[np.ndarray], str] = lambda values: "",
) -> Repair | None:
    """The plainest change of a function's text that makes its answers right.

    Parameters
    ----------
    text : str
        The file.
    name : str
        The function.
    inputs, got, expected : arrays (b, ...)
        The public cases: what came, and what is right.
    scales : sequence of (b,) arrays
        What errors are measured against, for each result.
    place : callable
        What a quantity on the way is called, by its values; empty if it is not known.

    Returns
    -------
    Repair or None
        None if there is none, or the text is not understood.
    """
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            search = Search(text, name, inputs, expected, scales, place)
            if not search.comes_to(got):
                return None
            return search.found() or search.found_in_parts()
    except (MuslinError, RecursionError, *IMPOSSIBLE):
        return None


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
    """

    value: np.ndarray
    rows: np.ndarray


class Search:
    """Looks for the change that makes a function right.

    Parameters
    ----------
    text, name, inputs, expected, scales, place
        As for `repair`.
    """

    def __init__(
        self,
        text: str,
        name: str,
        inputs: Mapping[str, np.ndarray],
        expected: Sequence[np.ndarray],
        scales: Sequence[np.ndarray],
        place: Callable[[np.ndarray], str],
    ) -> None:
        if not _ordinary(text):
            raise Unclear
        functions = {key: function.node for key, function in Source(text).functions.items()}
        if name not in functions:
            raise Unclear
        mine = used(functions, name)
        self.meaning = Meaning({key: functions[key] for key in mine}, name, inputs)
        self.helpers = [functions[key] for key in mine[1:]]
        self.shapes = [np.shape(e) for e in expected]
        self.scales, self.place = [np.maximum(scale, TINY) for scale in scales], place
        self.right = self._flat(expected)
        self.came = self._flat(self.meaning.results)
        self.lacking = self.right - self.came
        self.wrong = ~(np.abs(self.lacking) <= TOLERANCE)
        self.usable = np.isfinite(self.came).all(axis=1) & np.isfinite(self.right).all(axis=1)
        self.asked = np.ones(self.right.shape[1], dtype=bool)
        self.smooth = np.concatenate([np.full(e[0].size, e.dtype.kind != "i") for e in expected])
        self.changes = Changes(self.meaning, self.helpers, self._called())
        self._nodes = {id(n): n for f in self.changes.scope.functions for n in ast.walk(f)}
        self._bent = _bent(self.meaning.node)
        self._slopes: dict[int, Slope | Target | bool] = {}
        self._tried = 0

    def comes_to(self, got: Sequence[np.ndarray]) -> bool:
        """Whether the text, as it is read here, comes to what came."""
        came = self._flat(got)
        same = np.abs(came - self.came) <= 1e-6 * (1 + np.abs(came))
        return bool((same | ~np.isfinite(came) & ~np.isfinite(self.came)).all())

    def found(self) -> Repair | None:
        """The plainest change that makes all results right, or those entries that are asked for."""
        changes = itertools.chain(self.changes.plain(), self.changes.larger(self._hope))
        spare: Repair | None = None
        for change in itertools.islice(changes, LOOKED):
            try:
                if self._may_be(change) and self._is(change):
                    if not self._idle(change):
                        return replace(change, place=self._place(change))
                    spare = spare or change
            except IMPOSSIBLE:
                continue
            if self._tried > (TRIED if self.asked.all() else TRIED_APART) or self.meaning.spent > SPENT:
                break
        return spare and replace(spare, place=self._place(spare))

    def _idle(self, change: Repair) -> bool:
        """Whether a change only makes what stands around it come to one: then that is too much, not a name in it."""
        outer = self.changes.scope.parent(self._nodes[next(iter(change.changes))])
        while isinstance(outer, ast.Attribute):
            outer = self.changes.scope.parent(outer)
        if change.kind not in ("name", "index") or not isinstance(outer, (ast.Call, ast.BinOp)):
            return False
        self.meaning.seen = {}
        try:
            self.meaning.otherwise(change.changes)
            value = self.meaning.seen.get(id(outer))
        finally:
            self.meaning.seen = None
        return (
            isinstance(value, np.ndarray)
            and value.ndim == 1
            and bool(np.allclose(value, 1, rtol=0, atol=1e-9))
        )

    def found_in_parts(self) -> Repair | None:
        """Two or three slips at once: a change for each group of entries that is wrong, all of them together."""
        wrong = self.wrong[self.usable].any(axis=0)
        columns = np.flatnonzero(wrong)
        if not 1 < len(columns) <= PARTS:
            return None
        made: list[Repair] = []
        for column in columns:
            if any((self._after(change, column) <= TOLERANCE).all() for change in made):
                continue
            self._slopes, self._tried = {}, 0
            self.asked = np.arange(self.right.shape[1]) == column
            change = self.found()
            if change is None:
                return None
            made.append(change)
        self.asked = np.ones(self.right.shape[1], dtype=bool)
        together = {key: new for change in made for key, new in change.changes.items()}
        both = replace(made[0], changes=together, more=tuple(made[1:]))
        return both if len(made) > 1 and self._is(both) else None

    def _after(self, change: Repair, column: int) -> np.ndarray:
        return np.abs(self._flat(self.meaning.otherwise(change.changes)) - self.right)[:, column]

    def _called(self) -> dict[str, str]:
        """What the function's own variables are, as far as it is known."""
        last = self.meaning.before[-1]
        named = {name: self._named(value) for name, value in last.items() if name not in self.meaning.inputs}
        return {name: words for name, words in named.items() if words}

    def _named(self, value: Any) -> str:
        if isinstance(value, (list, tuple)) or not np.ndim(value):
            return ""
        array = np.asarray(value, dtype=np.float64)
        return self.place(np.broadcast_to(array, (self.meaning.count, *array.shape[1:])))

    def _place(self, change: Repair) -> str:
        """What the smallest quantity is called in which something is changed."""
        self.meaning.seen = {}
        try:
            self.meaning.otherwise(change.changes)
            node: Any = self._nodes[next(iter(change.changes))]
            if isinstance(node, (ast.Name, ast.Constant, ast.Subscript)):
                node = self.changes.scope.parent(node)
            while node is not None and not isinstance(node, ast.FunctionDef):
                if words := self._named(self.meaning.seen.get(id(node), 0)):
                    return words
                outer = self.changes.scope.parent(node)
                if isinstance(outer, ast.If) and outer.test is node:
                    value = getattr(outer.body[0], "value", None)
                    words = self._named(self.meaning.seen.get(id(value), 0)) if value is not None else ""
                    return f"the condition for {words}" if words else ""
                node = outer
            return ""
        except IMPOSSIBLE:
            return ""
        finally:
            self.meaning.seen = None

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

    def _is(self, change: Repair) -> bool:
        self._tried += 1
        right = np.abs(self._flat(self.meaning.otherwise(change.changes)) - self.right) <= TOLERANCE
        return bool(right[:, self.asked].all() and not (~right & ~self.wrong).any())

    def _may_be(self, change: Repair) -> bool:
        """Whether a change can make all right, as far as that is known without working it out."""
        if len(change.changes) != 1:
            return True
        ((key, new),) = change.changes.items()
        node = self._nodes[key]
        slope = self._slope(node) if isinstance(node, ast.expr) else True
        if isinstance(slope, bool):
            return slope
        made = np.asarray(self.meaning.alone(node, new), dtype=np.float64)
        if isinstance(slope, Target):
            off = np.abs(made - slope.value) <= NEAR * (np.abs(slope.value) + 1e-9)
            return bool(off[slope.asked].all()) if off.ndim else bool(off)
        value = np.broadcast_to(made.reshape(len(made), -1) if made.ndim else made, slope.value.shape)
        reached = np.einsum("bmp,bp->bm", slope.rows, value - slope.value)
        return self._near(reached)

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
        return Slope(flat, rows) if self._near(np.einsum("bmp,bp->bm", asked, best)) else False


#: Steps of Newton's method towards the number an expression must be, and how small a step is taken to see the way.
NEWTON, STEP = 12, 1e-7


def _ordinary(text: str) -> bool:
    """Whether a text is of a size that people write: a parser may be brought down by others."""
    if len(text) > LONGEST:
        return False
    depth = deepest = 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        deepest = max(deepest, depth)
    lines = text.splitlines()
    widest = max(map(len, lines), default=0)
    indented = max((len(line) - len(line.lstrip()) for line in lines), default=0)
    return deepest <= DEEPEST and widest <= WIDEST and indented <= INDENTED


def _bent(function: ast.FunctionDef) -> set[int]:
    """Nodes on which something hangs that a small change may not show: a condition, a larger or smaller of two."""
    tests: list[ast.AST] = []
    for node in ast.walk(function):
        if isinstance(node, (ast.If, ast.IfExp)):
            tests.append(node.test)
        elif isinstance(node, (ast.Compare, ast.FloorDiv)):
            tests.append(node)
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in ("max", "min", "abs", "cast", "int", "select", "floor"):
                tests.append(node)
    names: set[str] = set()
    while True:
        before = len(names)
        names |= {n.id for test in tests for n in ast.walk(test) if isinstance(n, ast.Name)}
        for node in ast.walk(function):
            if isinstance(node, (ast.Assign, ast.AugAssign)):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                given = {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}
                if given & names and node.value not in tests:
                    tests.append(node.value)
        if len(names) == before:
            return {id(n) for test in tests for n in ast.walk(test)}
