"""The one change of a student's own function that makes every public case right: it names the mistake, and its line.

The text is read, never run (`muslin.reading.meaning`), so this may be done where no student's code runs. Most changes
need not be tried: where the result hangs linearly on an expression, it is known what the expression would have to be.

Longer than others: one search, whose ways to try a change share what has been worked out and what it may cost.
"""

from __future__ import annotations

import ast
import itertools
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.grading.composing import composed
from muslin.grading.making import Kit, made
from muslin.grading.multiples import multiples
from muslin.grading.needs import IMPOSSIBLE, Needs, Spread, Target
from muslin.grading.numbers import numbers
from muslin.grading.pairs import pairs
from muslin.grading.pointing import Place, pointed
from muslin.grading.rivals import leads_to_what_is_known, likeliest
from muslin.grading.stacking import Stack
from muslin.grading.telling import idle, told
from muslin.judging.reference import TOLERANCE
from muslin.reading.meaning import Meaning, Unclear
from muslin.reading.page import used
from muslin.reading.repairs import Changes, Repair
from muslin.reading.repairs.readable import ordinary
from muslin.reading.source import Source

#: Most changes that are looked at; most that are worked out to the end, for all entries, for one of them alone, and
#: where many passes of a loop are worked out at once.
LOOKED, TRIED, TRIED_APART, TRIED_IN_LOOPS = 6000, 2000, 250, 2200

#: Most steps taken for one function: they bound the time, whatever the text is.
SPENT = 400_000

#: Steps up to which the changes of a short function are so cheap that more may be tried, and how many times as many.
CHEAP, OFTEN = 40_000, 4

#: What a step counts for that is taken for many changes at once, and steps it takes to look at one; how many are looked
#: at together.
DEARER, GLANCE, CHUNKS = 2, 30, (40, 80, 160, 320)

#: Share of that which changes of a symbol or two may cost, before larger ones are looked at, and those before two at
#: once are.
SMALL, LARGER = 0.6, 0.85

#: Most changes that do as well as each other, and steps for which others are looked for where one is found.
RIVALS, LONGER = 12, 120_000

#: Share of the cases in which a quantity must be finite to be called by its name: elsewhere a branch is not taken.
MOST_FINITE = 0.8

#: Cases that are wrong, of which many changes make right by chance.
FEW_WRONG = 2

#: Most entries of the results that are wrong where several slips are looked for.
PARTS = 4


def repair(
    text: str,
    name: str,
    inputs: Mapping[str, np.ndarray],
    got: Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
    scales: Sequence[np.ndarray],
    place: Place = lambda values, cases=None: "",
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
    change = looked_for(text, name, inputs, got, expected, scales, place)
    return None if change is None or change.kind == "nothing" else change


def looked_for(
    text: str,
    name: str,
    inputs: Mapping[str, np.ndarray],
    got: Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
    scales: Sequence[np.ndarray],
    place: Place = lambda values, cases=None: "",
) -> Repair | None:
    """As `repair`, but of the kind "nothing" where a text is understood and no change is found."""
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if not ordinary(text):
                return None
            functions = {key: function.node for key, function in Source(text).functions.items()}
            search = Search(functions, name, inputs, expected, scales, place)
            if not search.comes_to(got):
                return None
            if not search.meaning.widened:
                return search.found() or search.found_in_parts() or search.pointed() or search.nothing()
            some = search.some
            fewer = {key: array[some] for key, array in inputs.items()}
            right, sizes = [e[some] for e in expected], [size[some] for size in scales]
            small = Search(functions, name, fewer, right, sizes, place)
            small.all = search
            change = small.found()
            return change if change is not None and search.is_right(change) else search.nothing()
    except (MuslinError, RecursionError, *IMPOSSIBLE):
        return None


class Search(Needs):
    """Looks for the change that makes a function right.

    Parameters
    ----------
    functions : dict of ast.FunctionDef
        The file's.
    name, inputs, expected, scales, place
        As for `repair`.
    """

    def __init__(
        self,
        functions: dict[str, ast.FunctionDef],
        name: str,
        inputs: Mapping[str, np.ndarray],
        expected: Sequence[np.ndarray],
        scales: Sequence[np.ndarray],
        place: Place,
    ) -> None:
        if name not in functions:
            raise Unclear
        mine = used(functions, name)
        super().__init__(Meaning({key: functions[key] for key in mine}, name, inputs), expected, scales)
        self.expected, self.right_values = expected, expected[0]
        self.place = place
        self.changes = Changes(self.meaning, [functions[key] for key in mine[1:]], self._called())
        self._nodes = {id(n): n for f in self.changes.scope.functions for n in ast.walk(f)}
        self._tried = 0
        self._stack: Stack | None = None
        self.all: Search | None = None  # the same on all cases, where this one looks at some
        self._looked = 0
        self.kits: dict[Any, Kit] = {}

    def node(self, key: int) -> ast.AST | None:
        """A node of the function, by its id."""
        return self._nodes.get(key)

    def comes_to(self, got: Sequence[np.ndarray]) -> bool:
        """Whether the text, as it is read here, comes to what came."""
        came = self._flat(got)
        same = np.abs(came - self.came) <= 1e-6 * (1 + np.abs(came))
        return bool((same | ~np.isfinite(came) & ~np.isfinite(self.came)).all())

    def found(self) -> Repair | None:
        """The plainest change that makes all results right, or those entries that are asked for."""
        spare: Repair | None = None
        by_chance: list[Repair] = []
        most = TRIED_IN_LOOPS if self.meaning.widened else TRIED if self.asked.all() else TRIED_APART
        plain = self.changes.plain()
        small = itertools.chain(self.changes.unused(), plain, numbers(self), multiples(self))
        larger, double = self.changes.larger(self.hope), pairs(self, plain)
        ways = ((small, SMALL), (larger, LARGER), (composed(self), 1.0), (double, 1.0))
        for changes, share in ways:
            found: list[Repair] = []
            since = 0
            for change, may_be in self._screened(itertools.islice(changes, LOOKED)):
                try:
                    right = may_be and self.is_right(change) and (not self.all or self.all.is_right(change))
                    if right and idle(self, change):
                        spare, right = spare or change, False
                except IMPOSSIBLE:
                    continue
                spent = self.spent
                if right:
                    since = since or spent
                    found.append(change)
                often = self._tried > share * most * (1 if spent > CHEAP else OFTEN)
                enough = found and (len(found) == RIVALS or spent - since > LONGER or not self.asked.all())
                if enough or often or spent > share * SPENT:
                    break
            if found and self._by_chance(found):
                by_chance += found
            elif found:
                return told(self, likeliest(self, found))
        if by_chance:
            return told(self, likeliest(self, by_chance))
        if spare is None and self.asked.all():
            spare = next(made(self), None)
        return spare and told(self, spare)

    def _by_chance(self, found: list[Repair]) -> bool:
        """Whether so few cases are wrong that many changes do, and none of these leads to what is known."""
        few = self.wrong.any(axis=1).sum() <= FEW_WRONG and self.asked.all() and not self.meaning.widened
        return bool(few and not any(leads_to_what_is_known(self, change) for change in found))

    def pointed(self) -> Repair | None:
        """Where it goes wrong, whatever belongs there."""
        change = pointed(self) if self.spent <= SPENT else None
        return change and told(self, change)

    def nothing(self) -> Repair:
        """That no change has been found, though the text is understood."""
        return Repair("nothing", "", self.meaning.node.lineno, "", {})

    def found_in_parts(self) -> Repair | None:
        """Two or three slips at once: a change for each group of entries that is wrong, all of them together."""
        wrong = self.wrong[self.usable].any(axis=0)
        columns = np.flatnonzero(wrong)
        if not 1 < len(columns) <= PARTS:
            return None
        made: list[Repair] = []
        known = self._slopes
        for column in columns:
            if any((self._after(change, column) <= TOLERANCE).all() for change in made):
                continue
            self._slopes, self._tried = {}, 0
            self.asked = np.arange(self.right.shape[1]) == column
            change = self.found()
            self._slopes, self.asked = known, np.ones(self.right.shape[1], dtype=bool)
            if change is None:
                return None
            made.append(change)
        together = {key: new for change in made for key, new in change.changes.items()}
        both = replace(made[0], changes=together, more=tuple(made[1:]))
        return both if len(made) > 1 and self.is_right(both) else None

    def _after(self, change: Repair, column: int) -> np.ndarray:
        return np.abs(self._flat(self.meaning.otherwise(change.changes)) - self.right)[:, column]

    def _called(self) -> dict[str, str]:
        """What the function's own variables are, as far as it is known."""
        last = self.meaning.before[-1]
        named = {name: self.named(value) for name, value in last.items() if name not in self.meaning.inputs}
        return {name: words for name, words in named.items() if words}

    def named(self, value: Any) -> str:
        """What a quantity is called that an expression comes to; empty if it is not known."""
        if isinstance(value, (list, tuple)) or not np.ndim(value):
            return ""
        array = np.asarray(value, dtype=np.float64)
        finite = np.isfinite(array.reshape(len(array), -1)).all(axis=1)
        if len(array) == 1 or finite.mean() < MOST_FINITE:
            finite = np.ones(self.meaning.count, dtype=bool)
        return self.place(np.broadcast_to(array, (self.meaning.count, *array.shape[1:])), finite)

    def is_right(self, change: Repair) -> bool:
        """Whether a change makes right what is asked for, and nothing wrong."""
        self._tried += 1
        right = np.abs(self._flat(self.meaning.otherwise(change.changes)) - self.right) <= TOLERANCE
        return bool(right[:, self.asked].all() and not (~right & ~self.wrong).any())

    def whole(self, change: Repair) -> ast.expr | None:
        """The expression that holds all that is changed; None if there is none, in one line."""
        nodes = [self._nodes.get(key) for key in change.changes]
        if not all(isinstance(node, ast.expr) for node in nodes):
            return None
        if len(nodes) > 1:
            nodes = [self.line(node) for node in nodes]
            if any(node is not nodes[0] for node in nodes):
                return None
        return nodes[0]  # type: ignore[return-value]

    def line(self, node: Any) -> ast.expr | None:
        """The value, or the condition, of the line a node stands in."""
        outer = self.changes.scope.parent(node)
        while isinstance(outer, ast.expr):
            node, outer = outer, self.changes.scope.parent(outer)
        return node if node in (getattr(outer, "value", None), getattr(outer, "test", None)) else None

    @property
    def spent(self) -> int:
        """Steps taken so far."""
        beside = self._stack.meaning.spent if self._stack else 0
        return self.meaning.spent + DEARER * beside + GLANCE * self._looked

    def _screened(self, changes: Iterator[Repair]) -> Iterator[tuple[Repair, bool]]:
        """Changes, each with whether it can make all right, as far as that is known without working it out."""
        for size in itertools.chain(CHUNKS, itertools.repeat(CHUNKS[-1])):
            some = list(itertools.islice(changes, size))
            if not some:
                return
            self._looked += len(some)
            may_be = [self._may_be(change) for change in some]
            asked = [k for k, known in enumerate(may_be) if known is None]
            if asked:
                self._stack = self._stack or Stack(self)
                for k, fits in zip(asked, self._stack.fitting([some[k] for k in asked]), strict=True):
                    may_be[k] = fits
            yield from zip(some, map(bool, may_be), strict=True)

    def _may_be(self, change: Repair) -> bool | None:
        """Whether a change can make all right, as far as that is known without working it out; None if it is not."""
        try:
            return self._known_to_be(change)
        except IMPOSSIBLE:
            return False

    def _known_to_be(self, change: Repair) -> bool | None:
        node = self.whole(change)
        if node is None:
            return True
        slope = self.slope(node)
        if isinstance(slope, bool):
            return None if slope else False
        if isinstance(slope, Target):
            return None  # another number than was found may be right, too
        if id(node) not in self.meaning.here and not isinstance(slope, Spread):
            return True
        made = np.asarray(self.meaning.alone(node, change.changes), dtype=np.float64)
        if isinstance(slope, Spread):
            return self._reaches(slope, made)
        value = np.broadcast_to(made.reshape(len(made), -1) if made.ndim else made, slope.value.shape)
        reached = np.einsum("bmp,bp->bm", slope.rows, slope.off(value))
        return self._near(reached)
