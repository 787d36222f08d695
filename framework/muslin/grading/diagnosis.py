"""Which mistake does a wrong answer look like?

The arrays that came are compared with what mistakes make of the right ones, the plainest first: the whole
answer transformed (`TRANSFORMS`), mistakes known from students (`muslin.grading.known`), a factor made of
the sizes of the inputs (`_sized`), the right answer to changed inputs; then the same in a part of the answer (`parts`)
or in some of the cases (`conditions`); at last what one slip in a right formula makes of the public cases
(`muslin.grading.slips`). Neither a solution nor the truth is needed: what mistakes make of the cases is data.

Runs in the grader's parent process, on plain arrays.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from muslin.grading import slips
from muslin.grading.known import CHANGE, MISTAKE, Known, load
from muslin.grading.slips import Slips
from muslin.judging import judge
from muslin.judging.arrays import lengths as norm
from muslin.judging.arrays import transposed, unit
from muslin.judging.reference import TOLERANCE, natural_scale
from muslin.tasks import Task

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Diagnosis:
    """The most likely mistake.

    Attributes
    ----------
    cause : str
        Stable key: what, then which: "negated", "scaled:2", "missing:area", "transposed:dV", "row 0: zeros",
        "where i = j: scaled:1/2".
    mistake : str
        The mistake in words.
    advice : str
        One next step.
    """

    cause: str
    mistake: str
    advice: str


def diagnose(
    task: Task,
    got: tuple[np.ndarray, ...],
    expected: tuple[np.ndarray, ...],
    inputs: Mapping[str, np.ndarray],
    assignment: str = "cloth",
) -> Diagnosis | None:
    """Name the mistake behind a wrong answer.

    Parameters
    ----------
    task : Task
        Its entry in the task table.
    got, expected : tuple of ndarray, (b, ...)
        What came and what is right, one array per result of the task.
    inputs : dict of ndarray, (b, ...)
        The public cases.
    assignment : str
        Which assignment.

    Returns
    -------
    Diagnosis or None
        None if nothing is wrong, shapes differ, or no known mistake looks like it.
    """
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _diagnose(task, got, expected, inputs, assignment)
    except Exception:  # a grade must never be lost for want of an explanation
        return None


def _diagnose(
    task: Task,
    got: tuple[np.ndarray, ...],
    expected: tuple[np.ndarray, ...],
    inputs: Arrays,
    assignment: str,
) -> Diagnosis | None:
    if [np.shape(a) for a in got] != [np.shape(b) for b in expected]:
        return None
    # Integers last: so few values agree by chance with almost anything.
    known = _of(assignment, task.name, len(expected), len(expected[0]))
    order = sorted(range(len(expected)), key=lambda k: expected[k].dtype.kind == "i")
    found: list[Diagnosis] = []
    for k in order:
        question = Question(
            task=task,
            index=k,
            got=np.asarray(got[k], dtype=np.float64),
            right=np.asarray(expected[k], dtype=np.float64),
            inputs=inputs,
            scale=natural_scale(judge(assignment, task.name).terms, expected[k], inputs, k),
            entries=np.ones(expected[k].shape[1:], dtype=bool),
            known=known,
            slips=_slips(assignment, task.name, len(expected[k])),
        )
        found += [_said(known, d) for d in _all(question)]
    return _joined(found)


def _slips(assignment: str, task: str, cases: int) -> Slips | None:
    """The slips of a task, if they were made of these cases."""
    found = slips.load(assignment, task)
    return found if found is not None and found.prints.shape[2] == cases else None


def _of(assignment: str, task: str, results: int, cases: int) -> Known:
    """What is known of a task's mistakes, if these are its public cases."""
    found = load(assignment, task, results)
    counts = {len(e.made) for entries in found.entries for e in entries}
    counts |= {len(holds) for _, holds in found.conditions}
    return found if counts <= {cases} else replace(found, entries=(), conditions=())


def _all(question: Question) -> Iterator[Diagnosis]:
    """What there is to say of one result: of what is not finite, and of wrong numbers beside it."""
    if not question.wrong.any():
        return
    first = _first(question, SEARCHES)
    if first is not None:
        yield first
    finite = np.isfinite(question.seen(question.got)).all(axis=1)
    if first is not None and _not_finite(first) and (finite & question.wrong).any():
        beside = _first(question.at(finite), SEARCHES)
        if beside is not None:
            yield beside


def _not_finite(found: Diagnosis) -> bool:
    return found.cause.split(": ")[-1] == "nan"


def _joined(found: list[Diagnosis]) -> Diagnosis | None:
    """The first thing to say; a division by zero hides no other mistake."""
    numbers = [d for d in found if not _not_finite(d)]
    broken = [d for d in found if _not_finite(d)]
    if numbers and broken:
        return replace(numbers[0], mistake=f"{numbers[0].mistake} Besides: {broken[0].mistake}")
    return found[0] if found else None


# --- one array that came, and the right one ----------------------------------------------------------------


@dataclass(frozen=True)
class Question:
    """One result of a task: what came, what is right, and for which inputs. What mistake makes it so?

    Attributes
    ----------
    index : int
        Which result of the task.
    got, right : ndarray, (b, ...)
    inputs : dict of ndarray, (b, ...)
    scale : ndarray, (b,)
        What errors are measured against.
    entries : ndarray of bool, (...)
        Which entries of the answer are asked about.
    known : Known
        What mistakes known from students make of the cases.
    slips : Slips, optional
        What one slip in a right formula makes of the public cases.
    """

    task: Task
    index: int
    got: np.ndarray
    right: np.ndarray
    inputs: Arrays
    scale: np.ndarray
    entries: np.ndarray
    known: Known
    slips: Slips | None = None

    @property
    def name(self) -> str:
        """What the answer is called: by its name only if there are several."""
        return self.task.results[self.index].name if len(self.task.results) > 1 else "result"

    @property
    def whole(self) -> bool:
        """Whether the result is an integer."""
        return self.task.results[self.index].kind == "int"

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one answer."""
        return self.right.shape[1:]

    @property
    def wrong(self) -> np.ndarray:
        """Which cases are wrong, (b,)."""
        return ~(norm(self.seen(self.got - self.right)) <= TOLERANCE * self.scale)

    def seen(self, array: np.ndarray) -> np.ndarray:
        """The entries that are asked about, (b, n)."""
        return array[:, self.entries]

    def at(self, cases: np.ndarray) -> Question:
        """The same question about some of the cases."""
        picked = {name: array[cases] for name, array in self.inputs.items()}
        got, right, scale = (array[cases] for array in (self.got, self.right, self.scale))
        slipped = self.slips.at(cases) if self.slips is not None else None
        known = self.known.at(cases)
        return replace(self, got=got, right=right, inputs=picked, scale=scale, slips=slipped, known=known)

    def explained(self, candidate: Any, share: float = 0.9) -> bool:
        """Whether a candidate is what came, in nearly all cases and in nearly all of the wrong ones."""
        wrong, came = self.wrong, self.seen(self.got)
        candidate = self.seen(np.broadcast_to(np.asarray(candidate, dtype=np.float64), self.got.shape))
        broken = ~np.isfinite(came)
        if broken.all(axis=1).mean() > 0.5:
            return False  # nothing in common with anything
        alike = (broken == ~np.isfinite(candidate)).all(axis=1)
        came, candidate = (np.where(broken, 0.0, array) for array in (came, candidate))
        bound = 1e-6 * norm(candidate) + 1e-10 * self.scale
        same = alike & (norm(came - candidate) <= bound)
        # A mistake that changes nothing explains nothing.
        changed = ~(norm(candidate - self.seen(self.right)) <= bound) | broken.any(axis=1)
        mistaken = same & wrong & changed
        return bool(mistaken.sum() >= share * wrong.sum() and same.mean() >= share)

    def factor(self) -> np.ndarray | None:
        """Number of each case by which the right answer must be multiplied, NaN where it is zero, (b,)."""
        came, right = self.seen(self.got), self.seen(self.right)
        squares = np.sum(right * right, axis=1)
        number = np.where(squares > 0, np.sum(came * right, axis=1) / squares, 0.0)
        bound = 1e-6 * norm(came) + 1e-10 * self.scale
        if not (norm(came - number[:, None] * right) <= bound).all():
            return None
        vanishing = norm(right) <= 1e-9 * self.scale
        return np.where(vanishing, np.nan, number)


# --- words -------------------------------------------------------------------------------------------------

#: What a cause is called, by its first word: (mistake, advice). {name} is the result, {of} what follows ":".
WORDS: Mapping[str, tuple[str, str]] = {
    "zeros": (
        "Your {name} is zero.",
        "Look for a variable that is born as a whole number, or as zero and never changed.",
    ),
    "constant": (
        "Your {name} is the same for all inputs.",
        "Look which of the arguments your formula uses: the right answer changes with them.",
    ),
    "nan": (
        "Your {name} is not a finite number.",
        "Find the division by zero, or the root of a negative number, and say what should happen there.",
    ),
    "singular": (
        "Your {name} is huge or not finite nearly everywhere: a singular matrix has been inverted, or zero divided by.",
        "Look at what you invert or divide by: on paper it must not be zero.",
    ),
    "negated": (
        "Your {name} is the right one with the opposite sign.",
        "Look at the signs, and at the order in differences and cross products.",
    ),
    "transposed": (
        "Your {name} is the right one transposed: rows and columns are exchanged.",
        "Write down what one row of the result means, and what one column does. Then compare.",
    ),
    "negated and transposed": (
        "Your {name} is the right one transposed, with the opposite sign.",
        "Write down what one row and one column of the result mean, then look at the signs.",
    ),
    "permuted": (
        "Your {name} has the right numbers in another order ({of}).",
        "Read in the docstring which component comes first.",
    ),
    "rows permuted": (
        "Your {name} has the right rows in another order ({of}).",
        "Read in the docstring which row is which.",
    ),
    "columns permuted": (
        "Your {name} has the right columns in another order ({of}).",
        "Read in the docstring which column is which.",
    ),
    "scaled": (
        "Your {name} is {of} times the right one.",
        "Look for a constant factor: one that is missing, or one too many.",
    ),
    "absolute": (
        "Your {name} is the absolute value of the right one: it is never negative.",
        "Find where the sign is lost: a length, a square, an absolute value.",
    ),
    "clamped": (
        "Your {name} is right, but negative values are replaced by zero.",
        "Return the true values, negative ones too.",
    ),
    "whole numbers": (
        "Your {name} is the right one cut to whole numbers.",
        "A variable keeps the type it is born with: write 0.0 where you wrote 0.",
    ),
    "normalised": (
        "Your {name} points the right way, but has been made of length one.",
        "Its length means something here: do not normalise it.",
    ),
    "rows normalised": (
        "The rows of your {name} point the right way, but have been made of length one.",
        "Their lengths mean something here: do not normalise them.",
    ),
    "squared": (
        "Your {name} is the square of the right one, entry by entry.",
        "Take out the square, or put in the root.",
    ),
    "root": (
        "Your {name} is the square root of the right one, entry by entry.",
        "Take out the root: look at the powers in the formula.",
    ),
    "inverse": (
        "Your {name} is the inverse of the right one.",
        "Ask what goes in and what comes out of this matrix: you have the way back.",
    ),
    "symmetrised": (
        "Your {name} is the symmetric part of the right one.",
        "The right answer need not be symmetric: do not add its transpose.",
    ),
    "diagonal only": (
        "Your {name} has the right diagonal, and zeros elsewhere.",
        "Work out an entry off the diagonal by hand.",
    ),
    "upper triangle only": (
        "Your {name} is right on and above the diagonal, and zero below.",
        "Fill the other half, too.",
    ),
    "lower triangle only": (
        "Your {name} is right on and below the diagonal, and zero above.",
        "Fill the other half, too.",
    ),
    "change scaled": (
        "What your formula changes is {of} times what it should change.",
        "Look at the factor of the term you add or take away.",
    ),
    "echo": (
        "Your {name} is just the argument {of}.",
        "Check that what you return is the result, and not the argument you began with.",
    ),
    "lacks": (
        "Your {name} lacks exactly {of}: add it, and it is right.",
        "Look where {of} should come in, with factor one.",
    ),
    "plus": (
        "Your {name} is the right one plus {of}.",
        "Look where {of} comes in once too often.",
    ),
    "digits": (
        "Your {name} is nearly right, but only to some digits.",
        "Write the formula itself instead of a numerical derivative, and do not round or convert to f32.",
    ),
    "missing": (
        "It looks as if {of} were missing in your {name}.",
        "Compare with the formula, and find the place of {of}.",
    ),
    "missing factor": (
        "Your {name} is right when it is multiplied by {of}: that is missing, or has been divided by once too often.",
        "Check the unit of your result against the one in the docstring.",
    ),
    "extra": (
        "Your {name} is right when it is divided by {of}: that comes in once too often, or has not been divided by.",
        "Check the unit of your result against the one in the docstring.",
    ),
    "copy": (
        "Your {name} repeats {of}.",
        "Look at the indices: one of them says the same twice.",
    ),
    "between 0 and 1": (
        "Your {name} is right, but kept between 0 and 1.",
        "Return the true values, those below 0 and above 1 too.",
    ),
    "powers": (
        "Your {name} is right up to a factor that grows like {of}.",
        "Check the unit of your result: which powers of these quantities should be in it?",
    ),
    "swapped": (
        "Your {name} is what one gets with {of} exchanged.",
        "Follow both through your formula, and mind the order of the arguments.",
    ),
    "rolled": (
        "Your {name} is what one gets with {of} moved on by one place.",
        "Check the numbers of the vertices, one by one.",
    ),
    "transposed argument": (
        "Your {name} is what one gets with {of} transposed.",
        "Compare with the formula: what is transposed there, and what is not?",
    ),
    "negated argument": (
        "Your {name} is what one gets with {of} turned round.",
        "Look at the sign of the term with {of}.",
    ),
    "doubled": (
        "Your {name} is what one gets with twice {of}.",
        "Look at the constant factor of the term with {of}.",
    ),
    "halved": (
        "Your {name} is what one gets with half of {of}.",
        "Look at the constant factor of the term with {of}.",
    ),
    "squared argument": (
        "Your {name} is what one gets with the square of {of}.",
        "Look at the powers of {of} in the formula.",
    ),
    "normalised argument": (
        "Your {name} is what one gets with {of} made of length one.",
        "The length of {of} means something here: use it as it comes.",
    ),
    "diagonal argument": (
        "Your {name} uses no more than the diagonal of {of}.",
        "Multiply with the whole matrix {of}, not entry by entry.",
    ),
    "permuted argument": (
        "Your {name} is what one gets with the components of {of} in another order.",
        "Check which component of {of} belongs where.",
    ),
    "ignored": (
        "Your {name} does not depend on {of}.",
        "Work the same example by hand for two values of {of}: what changes?",
    ),
    "shifted": (
        "Your {name} is the one that belongs to another {of}.",
        "Draw the triangle and number it: which {of} does your formula belong to?",
    ),
    "in a plane": (
        "Your {name} is right only for triangles in the plane z = 0: the third coordinate is not used.",
        "Try a triangle that stands upright: the cloth lives in space.",
    ),
    "factor": (
        "Your {name} is right up to a factor that differs from case to case: the direction is right, not the size.",
        "Look at what your formula is divided by or multiplied with: a length, an area.",
    ),
    "row": ("Only row {of} of your {name} is wrong.", "Look at how row {of} is made; leave the others."),
    "column": (
        "Only column {of} of your {name} is wrong.",
        "Look at how column {of} is made; leave the others.",
    ),
    "component": (
        "Only component {of} of your {name} is wrong.",
        "Look at how component {of} is made; leave the others.",
    ),
    "components": (
        "Only the components {of} of your {name} are wrong.",
        "Look at how the components {of} are made; leave the others.",
    ),
    "entry": ("Only entry {of} of your {name} is wrong.", "Look at how this one entry is made."),
    "diagonal": (
        "Only the diagonal of your {name} is wrong.",
        "Look at the entries on the diagonal; the others are right.",
    ),
    "off the diagonal": (
        "Only the entries off the diagonal of your {name} are wrong.",
        "Look at the entries off the diagonal; the diagonal is right.",
    ),
    "third row and column": (
        "Only the third row and column of your {name} are wrong.",
        "Read in the docstring what belongs there.",
    ),
    "where": (
        "Your {name} is wrong where {of}, and right everywhere else.",
        "Work one such case by hand: what is different there?",
    ),
}


def _about(question: Question, cause: str, of: str = "", words: str = "") -> Diagnosis:
    """A diagnosis in the words of `WORDS`."""
    head = words or cause.split(":")[0]
    mistake, advice = WORDS[head]
    return Diagnosis(
        cause, mistake.format(name=question.name, of=of), advice.format(name=question.name, of=of)
    )


def _said(known: Known, found: Diagnosis) -> Diagnosis:
    """A diagnosis in this task's own words, if there are any."""
    mistake, advice = known.said.get(found.cause, ("", ""))
    return replace(found, mistake=mistake or found.mistake, advice=advice or found.advice)


# --- the whole answer, transformed -------------------------------------------------------------------------

Transform = Callable[[np.ndarray], np.ndarray]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    try:
        return np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


#: As many rows are tried in every order; of more, those orders that people make.
MOST_ORDERS = 5


def _permutations(n: int) -> Iterator[tuple[int, ...]]:
    """Other orders of n things: all, or where these are too many, exchanged, moved on, reversed, column by column."""
    as_is = tuple(range(n))
    if n <= MOST_ORDERS:
        yield from (p for p in itertools.permutations(as_is) if p != as_is)
        return
    yield from (tuple({a: b, b: a}.get(k, k) for k in as_is) for a, b in itertools.combinations(as_is, 2))
    yield from (as_is[k:] + as_is[:k] for k in range(1, n))
    yield as_is[::-1]
    side = math.isqrt(n)
    if side * side == n:
        yield tuple(np.arange(n).reshape(side, side).T.ravel().tolist())


def _reordered(n: int, axis: int) -> Iterator[tuple[str, Transform]]:
    for p in _permutations(n):
        yield ",".join(map(str, p)), lambda a, p=p: np.take(a, p, axis=axis)  # type: ignore[misc]


#: Whole-answer mistakes by number of axes: (cause, transform). `_transformed` adds permutations.
TRANSFORMS: Mapping[str, tuple[tuple[int, ...], Transform]] = {
    "zeros": ((0, 1, 2), np.zeros_like),
    "whole numbers": ((0, 1, 2), np.trunc),
    "negated": ((0, 1, 2), np.negative),
    "transposed": ((2,), transposed),
    "negated and transposed": ((2,), lambda a: -transposed(a)),
    "absolute": ((0, 1, 2), np.abs),
    "clamped": ((0, 1, 2), lambda a: np.maximum(a, 0)),
    "between 0 and 1": ((0, 1, 2), lambda a: np.where(((a > 0) & (a < 1)).any(), np.clip(a, 0, 1), np.nan)),
    "normalised": ((1,), unit),
    "rows normalised": ((2,), unit),
    "squared": ((0, 1, 2), np.square),
    "root": ((0, 1, 2), np.sqrt),
    "inverse": ((0, 2), lambda a: _inverse(a) if a.ndim == 3 else 1 / a),
    "symmetrised": ((2,), lambda a: (a + transposed(a)) / 2),
    "diagonal only": ((2,), lambda a: a * np.eye(a.shape[-1])),
    "upper triangle only": ((2,), np.triu),
    "lower triangle only": ((2,), np.tril),
}


def _made(transform: Transform, array: np.ndarray) -> np.ndarray | None:
    """Answers transformed; None where they cannot be: a 4x3 matrix transposed is no answer."""
    try:
        made = transform(array)
    except ValueError:
        return None
    return made if made.shape == array.shape else None


def _transformed(question: Question) -> Diagnosis | None:
    for share, (cause, (axes, transform)) in itertools.product((1.0, 0.9), TRANSFORMS.items()):
        made = _made(transform, question.right) if len(question.shape) in axes else None
        if made is not None and question.explained(made, share):
            return _about(question, cause)
    if not question.entries.all():
        return _copied(question)
    heads = {1: ("permuted",), 2: ("rows permuted", "columns permuted")}.get(len(question.shape), ())
    for axis, head in enumerate(heads, start=1):
        for order, transform in _reordered(question.shape[axis - 1], axis):
            if question.explained(transform(question.right)):
                return _about(question, f"{head}:{order}", order)
    for name, array in question.inputs.items():
        if array.shape == question.got.shape and array.dtype.kind == "f":
            for cause, candidate in (
                ("echo", array),
                ("lacks", question.right - array),
                ("plus", question.right + array),
            ):
                if question.explained(candidate):
                    return _about(question, f"{cause}:{name}", name)
    return None


def _copied(question: Question) -> Diagnosis | None:
    """A row, column or component that repeats another one."""
    for axis, size in enumerate(question.shape, start=1):
        place = {(1, 1): "component", (1, 2): "row", (2, 2): "column"}[axis, len(question.shape)]
        for k in range(size):
            if question.explained(np.take(question.right, [k] * size, axis=axis)):
                return _about(question, f"copy:{k}", f"{place} {k}")
    return None


def _constant(question: Question) -> Diagnosis | None:
    same = len(question.got) > 5 and question.explained(question.got[question.wrong][0])
    return _about(question, "constant") if same and np.ptp(question.right, axis=0).any() else None


# --- a factor ----------------------------------------------------------------------------------------------


def _number(value: float) -> str | None:
    """A factor as people write it: 2, 1/3, -1; None if it is no simple fraction."""
    fraction = Fraction(value).limit_denominator(36)
    simple = abs(fraction.numerator) <= 36 and abs(float(fraction) - value) <= 1e-6 * abs(value)
    return str(fraction) if simple and fraction else None


def _scaled(question: Question) -> Diagnosis | None:
    shown = _common(question.factor())
    return _about(question, f"scaled:{shown}", shown) if shown else None


def _change_scaled(question: Question) -> Diagnosis | None:
    """What is added to an argument, or taken away from it, comes with a wrong factor."""
    for array in question.inputs.values():
        if question.shape and array.shape == question.got.shape:
            change = replace(question, got=question.got - array, right=question.right - array)
            if shown := _common(change.factor()):
                return _about(question, f"change scaled:{shown}", shown)
    return None


def _common(factor: np.ndarray | None) -> str | None:
    """The one number that is the factor of all cases, as people write it; None if there is none, or it is 1."""
    factor = factor[np.isfinite(factor)] if factor is not None else np.array([])
    if not len(factor) or np.ptp(factor) > 1e-6 * np.abs(factor).max():
        return None
    value = float(np.median(factor))
    number = _number(value)
    if number == "1" or (number is None and len(factor) < 6):  # any one number is some multiple of another
        return None
    return number or f"{value:.6g}"


def _sizes(question: Question) -> dict[str, np.ndarray]:
    """Positive numbers the inputs have: scalars, lengths, distances, areas, by name."""
    arguments, inputs = question.task.inputs, question.inputs
    sizes = {v.name: inputs[v.name] for v in arguments if v.kind == "scalar"}
    vectors = {v.name: inputs[v.name] for v in arguments if v.kind == "vec3"}
    points = {v.name: inputs[v.name] for v in arguments if v.kind == "vec3" and v.unit == "m"}
    for three in itertools.combinations(points, 3):
        if three[0][0] == three[1][0] == three[2][0] and three[0][1:] == "0":
            a, b, c = (points[name] for name in three)
            double = norm(np.cross(b - a, c - a))
            sizes["twice the triangle's area"], sizes["the triangle's area"] = double, double / 2
    sizes |= {f"|{a} - {b}|": norm(points[a] - points[b]) for a, b in itertools.combinations(points, 2)}
    sizes |= {f"|{name}|": norm(array) for name, array in vectors.items()}
    return {name: size for name, size in sizes.items() if np.ptp(size) > 1e-3 * np.abs(size).max()}


#: What a power of one quantity too many is called; of two quantities those in `PAIRS` are tried.
POWERS: Mapping[float, str] = {
    -1: "missing",
    1: "extra",
    -2: "missing",
    2: "extra",
    -0.5: "powers",
    0.5: "powers",
}
PAIRS = ((-1, -1), (1, 1), (-1, 1), (1, -1))


@dataclass(frozen=True)
class Fit:
    """A factor as a number times powers of sizes."""

    number: str
    powers: tuple[tuple[str, float], ...]

    @property
    def head(self) -> str:
        """What the powers are called: "missing", "extra", or "powers" where they disagree."""
        heads = {POWERS[p] for _, p in self.powers}
        return heads.pop() if len(heads) == 1 else "powers"

    @property
    def names(self) -> list[str]:
        """The quantities, as people write their powers."""
        if self.head == "powers":
            return [f"{name}^({Fraction(p)})" for name, p in self.powers]
        return [name if abs(p) == 1 else f"{name}^2" for name, p in self.powers]


def _candidates(logs: Mapping[str, np.ndarray]) -> Iterator[tuple[tuple[str, float], ...]]:
    """Powers of one size, then of two that are not proportional."""
    yield from (((name, p),) for p in POWERS for name in logs)
    two = [(a, b) for a, b in itertools.combinations(logs, 2) if np.ptp(logs[a] - logs[b]) > 1e-6]
    yield from (((a, p), (b, q)) for p, q in PAIRS for a, b in two)


def _fit(factor: np.ndarray, logs: Mapping[str, np.ndarray]) -> Fit | None:
    """The factor as one number times powers of sizes; the number 1 is the plainest."""
    fits = []
    for powers in _candidates(logs):
        rest = factor / np.exp(sum(p * logs[name] for name, p in powers))
        if np.ptp(rest) <= 1e-6 * abs(rest[0]) and (number := _number(float(np.median(rest)))):
            fits.append(Fit(number, powers))
    return min(fits, key=lambda fit: fit.number != "1", default=None)


def _sized(question: Question) -> Diagnosis | None:
    """A factor made of the sizes of the inputs, and of one number."""
    factor = question.factor()
    if factor is None:
        return None
    sizes = _sizes(question)
    usable = np.isfinite(factor) & np.all([size > 0 for size in sizes.values()], axis=0)
    factor = factor[usable]
    if len(factor) < 6 or not ((factor > 0).all() or (factor < 0).all()):
        return None
    fit = _fit(factor, {name: np.log(size[usable]) for name, size in sizes.items()})
    return _told_fit(question, fit) if fit is not None else None


def _told_fit(question: Question, fit: Fit) -> Diagnosis:
    """A fit in words: what is missing or comes in too often, and the number that remains."""
    also = f", scaled:{fit.number}" if fit.number != "1" else ""
    scalars = {value.name for value in question.task.inputs if value.kind == "scalar"}
    plain = all(name in scalars and p == -1 for name, p in fit.powers)
    words = "missing factor" if fit.head == "missing" and not plain else fit.head
    told = _about(question, f"{fit.head}:{','.join(fit.names)}{also}", " and ".join(fit.names), words)
    return (
        replace(told, mistake=f"{told.mistake} What remains is a factor of {fit.number}.") if also else told
    )


def _factor(question: Question) -> Diagnosis | None:
    """The direction is right: the last thing to say of a vector or a matrix."""
    factor = question.factor() if question.shape else None
    return _about(question, "factor") if factor is not None and question.wrong.sum() > 5 else None


# --- changed inputs ----------------------------------------------------------------------------------------


def _changed(question: Question) -> Diagnosis | None:
    """The right answer to changed inputs."""
    for entry in question.known.of(question.index, CHANGE):
        if question.explained(entry.made):
            return _about(question, entry.cause, entry.of, entry.head)
    return None


# --- some of the cases, part of the answer -----------------------------------------------------------------


def conditions(question: Question) -> Iterator[tuple[str, Any]]:
    """Natural conditions on a case, by which right and wrong ones may be told apart: (words, (b,) of bool)."""
    yield from question.known.conditions
    a = question.inputs
    kinds: dict[str, list[str]] = {}
    for value in question.task.inputs:
        kinds.setdefault(value.kind, []).append(value.name)
    for p, q in itertools.combinations(kinds.get("int", []), 2):
        yield f"{p} = {q}", a[p] == a[q]
    for name in kinds.get("int", []):
        for k in range(3):
            yield f"{name} = {k}", a[name] == k
    vectors = kinds.get("vec3", [])
    for name in vectors:
        yield f"{name} = 0", ~a[name].any(axis=1)
    if len(vectors) == 2:
        p, q = vectors
        product, distance = np.sum(a[p] * a[q], axis=1), norm(a[p] - a[q])
        yield f"{p} = {q}", distance == 0
        yield f"{p} . {q} < 0", product < 0
        yield f"{p} . {q} <= 0", product <= 0
        yield f"{p} . {q} = 0", product == 0
        for name in kinds.get("scalar", []):
            yield f"|{p} - {q}| = {name}", distance == a[name]
            yield f"|{p} - {q}| < {name}", distance < a[name]
            yield f"|{p} - {q}| <= {name}", distance <= a[name]
    for name in kinds.get("scalar", []):
        yield f"{name} < 1", a[name] < 1
    for name in kinds.get("mat3", []):
        yield f"{name} is not symmetric", norm(a[name] - transposed(a[name])) > 1e-9 * norm(a[name])
        yield f"{name} is not a rotation", norm(a[name] @ transposed(a[name]) - np.eye(3)) > 1e-9
        yield f"det {name} < 0", np.linalg.det(a[name]) < 0
    flat = question.right.reshape(len(question.right), -1)
    yield "the right answer is negative somewhere", (flat < 0).any(axis=1)


#: Turns a condition round: the first phrase found is replaced.
OPPOSITES = (
    (" <= ", " > "),
    (" < ", " >= "),
    (" = ", " != "),
    (" is not ", " is "),
    (" lies off ", " lies in "),
    (" somewhere", " nowhere"),
    (" is ", " is not "),
)


def _opposite(words: str) -> str:
    phrase, turned = next(pair for pair in OPPOSITES if pair[0] in words)
    return words.replace(phrase, turned)


def _somewhere(question: Question) -> Diagnosis | None:
    """Wrong in some cases only, which a condition tells apart."""
    wrong = question.wrong
    entries = ~np.isclose(question.got, question.right, rtol=1e-9, atol=0).all(axis=0) & question.entries
    told = wrong | question.whole  # where the answer is zero anyway, being right means little
    told |= norm(question.right[:, entries]) > 0
    if wrong[told].all():
        return None
    for words, holds in conditions(question):
        for phrase, where in ((words, holds), (_opposite(words), ~holds)):
            if (where[told] == wrong[told]).all():
                inner = None if question.whole else _first(question.at(wrong), (*WITHIN, _partly))
                found = _about(question, f"where {phrase}", phrase, "where")
                return _within(found, inner, f"where {phrase}", question.name)
    return None


def parts(shape: tuple[int, ...]) -> Iterator[tuple[str, str, str, np.ndarray]]:
    """Natural parts of an answer, the smaller first: (cause, head of its words, which, mask of entries)."""
    index = np.indices(shape)
    if len(shape) == 1:
        for count in range(1, shape[0]):
            for chosen in itertools.combinations(range(shape[0]), count):
                which = ",".join(map(str, chosen))
                head = "component" if count == 1 else "components"
                yield f"{head} {which}", head, which, np.isin(index[0], chosen)
    if len(shape) == 2:
        i, j = index
        for k, m in np.ndindex(*shape):
            yield f"entry {k},{m}", "entry", f"[{k}, {m}]", (i == k) & (j == m)
        for axis, head in enumerate(("row", "column")):
            for k in range(shape[axis]):
                yield f"{head} {k}", head, str(k), index[axis] == k
        yield "diagonal", "diagonal", "", i == j
        yield "third row and column", "third row and column", "", (i == 2) | (j == 2)
        yield "off the diagonal", "off the diagonal", "", i != j


def _partly(question: Question) -> Diagnosis | None:
    """One row, column or component is wrong and the rest is right."""
    error = np.abs(question.got - question.right)
    reach = question.scale.reshape(-1, *[1] * len(question.shape))
    wrong = (~(error <= TOLERANCE * reach)).any(axis=0) & question.entries
    for cause, head, which, mask in parts(question.shape):
        if not (wrong & ~mask).any() and (question.entries & ~mask).any():
            inner = _first(replace(question, entries=mask & question.entries), WITHIN)
            return _within(_about(question, cause, which, head), inner, cause, question.name)
    return None


def _some(question: Question) -> Diagnosis | None:
    """Some of the entries or some of the cases: whichever says more, the entries first."""
    found = [d for d in (_partly(question), _somewhere(question)) if d is not None]
    return next((d for d in found if ": " in d.cause), found[-1] if found else None)


#: Causes that say where an answer is wrong, and not what makes it so: by their first word.
PLACES = ("component", "components", "entry", "row", "column", "where", "diagonal", "off")


def _some_alike(question: Question) -> Diagnosis | None:
    """Some of the entries or cases, where it is known what is wrong with them, too."""
    found = _some(question)
    if found is None or ": " not in found.cause:
        return None
    return None if found.cause.split(": ")[-1].split(" ")[0] in PLACES else found


def _within(outer: Diagnosis, inner: Diagnosis | None, place: str, name: str) -> Diagnosis:
    """What is wrong in a part, joined with which part it is."""
    if inner is None:
        return outer
    start = f"Your {name} "
    then = (
        f" it {inner.mistake.removeprefix(start)}"
        if inner.mistake.startswith(start)
        else f": {inner.mistake}"
    )
    return Diagnosis(f"{place}: {inner.cause}", f"{outer.mistake} There{then}", inner.advice)


# --- other signs -------------------------------------------------------------------------------------------


def _nan(question: Question) -> Diagnosis | None:
    """Not finite: everywhere, or where."""
    broken = ~np.isfinite(question.seen(question.got)).all(axis=1)
    if not broken.any():
        return None
    found = _about(question, "nan")
    if broken[question.wrong].mean() >= 0.9 and question.wrong.mean() >= 0.9:
        return found
    for words, holds in conditions(question):
        for phrase, where in ((words, holds), (_opposite(words), ~holds)):
            if (where == broken).all():
                outer = _about(question, f"where {phrase}", phrase, "where")
                return _within(outer, found, f"where {phrase}", question.name)
    return found


def _singular(question: Question) -> Diagnosis | None:
    """Huge or not finite nearly everywhere: something singular has been inverted."""
    came = np.abs(question.seen(question.got)).max(axis=1)
    huge = came > 1e7 * question.scale
    lost = ~np.isfinite(came)
    return _about(question, "singular") if (huge & ~lost).any() and (huge | lost).mean() > 0.6 else None


def _digits(question: Question) -> Diagnosis | None:
    error = norm(question.seen(question.got - question.right))
    return _about(question, "digits") if (error <= 1e-4 * question.scale).all() else None


def _known(question: Question) -> Diagnosis | None:
    for entry in question.known.of(question.index, MISTAKE):
        if question.explained(entry.made):
            return Diagnosis(entry.cause, entry.mistake, entry.advice)
    return None


def _slipped(question: Question) -> Diagnosis | None:
    """One slip in a right formula: of those that come to the same, the plainest."""
    wrong = question.wrong
    if question.slips is None:
        return None
    alike = question.slips.like(question.index, question.got, question.scale, wrong)
    return next((Diagnosis(*words) for words in alike), None)


def _first(
    question: Question, searches: tuple[Callable[[Question], Diagnosis | None], ...]
) -> Diagnosis | None:
    return next((found for search in searches if (found := search(question)) is not None), None)


#: The searches, in order: the plainest explanation wins. Those of `WITHIN` serve for a part, too.
WITHIN = (_transformed, _scaled, _sized)
SEARCHES = (
    _transformed,
    _scaled,
    _known,
    _change_scaled,
    _constant,
    _singular,
    _nan,
    _digits,
    _sized,
    _changed,
    _some_alike,
    _slipped,
    _some,
    _factor,
)
