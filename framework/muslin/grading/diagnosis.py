"""Which mistake does a wrong answer look like?

The arrays that came are compared with what known mistakes make of the right ones, the plainest first: the
whole answer transformed (`TRANSFORMS`), mistakes known from students (`KNOWN`), a factor made of the sizes of
the inputs (`_sized`), the right answer to changed inputs (`changes`); then the same in some of the cases
(`conditions`) or in a part of the answer (`parts`). No solution is needed: right answers come from the
reference data and, for changed inputs, from `muslin.authoring.truth`.

Runs in the grader's parent process, on plain arrays. To add a mistake, add a line to `KNOWN`; to say a known
one better for one task, add a line to `SAID`.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from muslin.authoring import truth as tr
from muslin.reference import TOLERANCE, natural_scale
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
        Which assignment; mistakes of single tasks are known for "cloth" only.

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
    if len(got) != len(expected) or any(
        np.shape(a) != np.shape(b) for a, b in zip(got, expected, strict=True)
    ):
        return None
    # Integers last: so few values agree by chance with almost anything.
    order = sorted(range(len(expected)), key=lambda k: expected[k].dtype.kind == "i")
    for k in order:
        question = Question(
            task=task,
            index=k,
            got=np.asarray(got[k], dtype=np.float64),
            right=np.asarray(expected[k], dtype=np.float64),
            inputs=inputs,
            scale=natural_scale(task.name, expected[k], inputs, k),
            entries=np.ones(expected[k].shape[1:], dtype=bool),
            known=KNOWN.get(task.name, ()) if assignment == "cloth" else (),
        )
        if question.wrong.any():
            for search in SEARCHES:
                if (found := search(question)) is not None:
                    return _said(task, found)
    return None


# --- one array that came, and the right one ----------------------------------------------------------------


def _norm(array: np.ndarray) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    return np.sqrt(np.sum(np.reshape(array, (len(array), -1)) ** 2, axis=1))


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
    known : tuple of Mistake
        Mistakes known from students.
    """

    task: Task
    index: int
    got: np.ndarray
    right: np.ndarray
    inputs: Arrays
    scale: np.ndarray
    entries: np.ndarray
    known: tuple[Mistake, ...]

    @property
    def name(self) -> str:
        """Of the result."""
        return self.task.results[self.index].name

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one answer."""
        return self.right.shape[1:]

    @property
    def wrong(self) -> np.ndarray:
        """Which cases are wrong, (b,)."""
        return ~(_norm(self.seen(self.got - self.right)) <= TOLERANCE * self.scale)

    def seen(self, array: np.ndarray) -> np.ndarray:
        """The entries that are asked about, (b, n)."""
        return array[:, self.entries]

    def at(self, cases: np.ndarray) -> Question:
        """The same question about some of the cases."""
        picked = {name: array[cases] for name, array in self.inputs.items()}
        got, right, scale = (array[cases] for array in (self.got, self.right, self.scale))
        return replace(self, got=got, right=right, inputs=picked, scale=scale)

    def truth(self, **changed: np.ndarray) -> np.ndarray:
        """The right answer to changed inputs."""
        return tr.truth(self.task.name, {**self.inputs, **changed})[self.index].astype(np.float64)

    def explained(self, candidate: Any) -> bool:
        """Whether a candidate is what came, in nearly all cases and in nearly all of the wrong ones."""
        wrong, came = self.wrong, self.seen(self.got)
        candidate = self.seen(np.broadcast_to(np.asarray(candidate, dtype=np.float64), self.got.shape))
        broken = ~np.isfinite(came)
        alike = (broken == ~np.isfinite(candidate)).all(axis=1)
        came, candidate = (np.where(broken, 0.0, array) for array in (came, candidate))
        bound = 1e-6 * _norm(candidate) + 1e-10 * self.scale
        same = alike & (_norm(came - candidate) <= bound)
        right = (
            _norm(candidate - self.seen(self.right)) <= bound
        )  # a mistake that changes nothing explains nothing
        mistaken = same & wrong & (~right | broken.any(axis=1))
        return bool(mistaken.sum() >= 0.9 * wrong.sum() and same.mean() >= 0.9)

    def factor(self) -> np.ndarray | None:
        """Number of each case by which the right answer must be multiplied, NaN where it is zero, (b,)."""
        came, right = self.seen(self.got), self.seen(self.right)
        squares = np.sum(right * right, axis=1)
        number = np.where(squares > 0, np.sum(came * right, axis=1) / squares, 0.0)
        bound = 1e-6 * _norm(came) + 1e-10 * self.scale
        if not (_norm(came - number[:, None] * right) <= bound).all():
            return None
        vanishing = _norm(right) <= 1e-9 * self.scale
        return np.where(vanishing, np.nan, number)


# --- words -------------------------------------------------------------------------------------------------

#: What a cause is called, by its first word: (mistake, advice). {name} is the result, {of} what follows ":".
WORDS: Mapping[str, tuple[str, str]] = {
    "zeros": (
        "Your {name} is zero in every case.",
        "Look for a variable that is born as zero and never changed, or a product with zero.",
    ),
    "constant": (
        "Your {name} is the same for all inputs.",
        "Look which of the arguments your formula uses: the right answer changes with them.",
    ),
    "nan": (
        "Your {name} is not a finite number.",
        "Find the division by zero, or the root of a negative number, and say what should happen there.",
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
        "Your {name} is {of} times the right one, in every case.",
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
        "Compare with the formula: where does {of} come in?",
    ),
    "extra": (
        "Your {name} has {of} as a factor once too often.",
        "Check the unit of your result: with this factor it cannot be right.",
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
        "Look where {of} comes in: is it asked for as it is, or transposed?",
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


def _said(task: Task, found: Diagnosis) -> Diagnosis:
    """A diagnosis in this task's own words, if there are any."""
    mistake, advice = SAID.get(task.name, {}).get(found.cause, ("", ""))
    return replace(found, mistake=mistake or found.mistake, advice=advice or found.advice)


# --- the whole answer, transformed -------------------------------------------------------------------------

Transform = Callable[[np.ndarray], np.ndarray]


def _t(matrix: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrix, 1, 2)


def _inverse(matrix: np.ndarray) -> np.ndarray:
    try:
        return np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.sqrt(np.sum(vectors**2, axis=-1, keepdims=True))


def _permutations(n: int) -> list[tuple[int, ...]]:
    return [p for p in itertools.permutations(range(n)) if p != tuple(range(n))]


def _reordered(n: int, axis: int) -> Iterator[tuple[str, Transform]]:
    for p in _permutations(n):
        yield ",".join(map(str, p)), lambda a, p=p: np.take(a, p, axis=axis)  # type: ignore[misc]


#: Whole-answer mistakes by number of axes: (cause, transform). Permutations are added by `_transforms`.
TRANSFORMS: Mapping[str, tuple[tuple[int, ...], Transform]] = {
    "zeros": ((0, 1, 2), np.zeros_like),
    "negated": ((0, 1, 2), np.negative),
    "transposed": ((2,), _t),
    "negated and transposed": ((2,), lambda a: -_t(a)),
    "absolute": ((0, 1, 2), np.abs),
    "clamped": ((0, 1, 2), lambda a: np.maximum(a, 0)),
    "whole numbers": ((0, 1, 2), np.trunc),
    "normalised": ((1,), _unit),
    "rows normalised": ((2,), _unit),
    "squared": ((0, 1, 2), np.square),
    "root": ((0, 1, 2), np.sqrt),
    "inverse": ((0, 2), lambda a: _inverse(a) if a.ndim == 3 else 1 / a),
    "symmetrised": ((2,), lambda a: (a + _t(a)) / 2),
    "diagonal only": ((2,), lambda a: a * np.eye(a.shape[-1])),
}


def _transformed(question: Question) -> Diagnosis | None:
    for cause, (axes, transform) in TRANSFORMS.items():
        if len(question.shape) in axes and question.explained(transform(question.right)):
            return _about(question, cause)
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
    factor = question.factor()
    if factor is None:
        return None
    factor = factor[np.isfinite(factor)]
    if not len(factor) or np.ptp(factor) > 1e-6 * np.abs(factor).max():
        return None
    value = float(np.median(factor))
    number = _number(value)
    if number is None and len(factor) < 6:  # any one number is some multiple of another
        return None
    shown = number or f"{value:.6g}"
    return _about(question, f"scaled:{shown}", shown)


def _sizes(question: Question) -> dict[str, np.ndarray]:
    """Positive numbers the inputs have: scalars, lengths, distances, areas, by name."""
    arguments, inputs = question.task.arguments, question.inputs
    sizes = {v.name: inputs[v.name] for v in arguments if v.kind == "scalar"}
    vectors = {v.name: inputs[v.name] for v in arguments if v.kind == "vec3"}
    points = {v.name: inputs[v.name] for v in arguments if v.kind == "vec3" and v.unit == "m"}
    for three in itertools.combinations(points, 3):
        if three[0][0] == three[1][0] == three[2][0] and three[0][1:] == "0":
            a, b, c = (points[name] for name in three)
            double = _norm(np.cross(b - a, c - a))
            sizes["twice the triangle's area"], sizes["the triangle's area"] = double, double / 2
    sizes |= {f"|{a} - {b}|": _norm(points[a] - points[b]) for a, b in itertools.combinations(points, 2)}
    sizes |= {f"|{name}|": _norm(array) for name, array in vectors.items()}
    return {name: size for name, size in sizes.items() if np.ptp(size) > 1e-3 * np.abs(size).max()}


#: Powers of one quantity that a forgetful or generous student multiplies with, and what that is called.
POWERS: Mapping[float, str] = {
    -1: "missing",
    1: "extra",
    -2: "missing",
    2: "extra",
    -0.5: "powers",
    0.5: "powers",
}


def _sized(question: Question) -> Diagnosis | None:
    factor = question.factor()
    if factor is None:
        return None
    sizes = _sizes(question)
    usable = np.isfinite(factor) & (factor != 0)
    for size in sizes.values():
        usable &= size > 0
    if usable.sum() < 6:
        return None
    logs = {name: np.log(size[usable]) for name, size in sizes.items()}
    sign, log = np.sign(factor[usable]), np.log(np.abs(factor[usable]))
    if np.ptp(sign):
        return None
    singles = [((name, p),) for p in POWERS for name in sizes]
    pairs = [
        ((a, p), (b, q))
        for p, q in ((-1, -1), (1, 1), (-1, 1), (1, -1))
        for a, b in itertools.combinations(sizes, 2)
    ]
    found: list[tuple[str, str, str]] = []
    for powers in [*singles, *pairs]:
        rest = log - sum(p * logs[name] for name, p in powers)
        if np.ptp(rest) <= 1e-6 and (number := _number(float(sign[0] * np.exp(np.median(rest))))):
            names = ",".join(name if abs(p) <= 1 else f"{name}^2" for name, p in powers)
            kinds = {POWERS[p] for _, p in powers}
            head = kinds.pop() if len(kinds) == 1 else "powers"
            shown = " ".join(f"{name}^{Fraction(p)}" for name, p in powers)
            cause = f"{head}:{shown if head == 'powers' else names}" + (
                f", scaled:{number}" if number != "1" else ""
            )
            found.append((number, cause, shown if head == "powers" else names.replace(",", " and ")))
    for number, cause, of in sorted(found, key=lambda f: f[0] != "1"):
        told = _about(question, cause, of)
        also = f" What remains is a factor of {number}." if number != "1" else ""
        return replace(told, mistake=told.mistake + also)
    return None


def _factor(question: Question) -> Diagnosis | None:
    """The direction is right: the last thing to say of a vector or a matrix."""
    factor = question.factor() if question.shape else None
    return _about(question, "factor") if factor is not None and question.wrong.sum() > 5 else None


# --- changed inputs ----------------------------------------------------------------------------------------


def changes(task: Task, inputs: Arrays) -> Iterator[tuple[str, str, str, dict[str, np.ndarray]]]:
    """Inputs a student may have used for the right ones: (cause, head of its words, of what, changed inputs)."""
    kinds: dict[str, list[str]] = {}
    for value in task.arguments:
        kinds.setdefault(value.kind, []).append(value.name)
    scalars, integers = kinds.get("scalar", []), kinds.get("int", [])
    vectors = kinds.get("vec3", [])
    matrices = kinds.get("mat3", [])
    points = [v.name for v in task.arguments if v.kind == "vec3" and v.unit == "m"]

    for names in kinds.values():
        for a, b in itertools.combinations(names, 2):
            yield f"swapped:{a},{b}", "swapped", f"{a} and {b}", {a: inputs[b], b: inputs[a]}
    for name in matrices:
        yield f"transposed:{name}", "transposed argument", name, {name: _t(inputs[name])}
    for name in [*vectors, *matrices, *scalars]:
        yield f"missing:{name}", "missing", name, {name: np.zeros_like(inputs[name])}
    for name in matrices:
        yield f"missing:{name}", "missing", name, {name: np.broadcast_to(np.eye(3), inputs[name].shape)}
    for name in [*vectors, *matrices, *scalars]:
        yield f"negated:{name}", "negated argument", name, {name: -inputs[name]}
    for a, b in itertools.combinations([*vectors, *matrices], 2):
        zeros = {name: np.zeros_like(inputs[name]) for name in (a, b)}
        yield f"missing:{a},{b}", "missing", f"{a} and {b}", zeros
    for a, b in itertools.combinations(matrices, 2):
        both = {name: _t(inputs[name]) for name in (a, b)}
        yield f"transposed:{a},{b}", "transposed argument", f"{a} and {b}", both
    for name in scalars:
        yield f"doubled:{name}", "doubled", name, {name: inputs[name] * 2}
        yield f"halved:{name}", "halved", name, {name: inputs[name] / 2}
    for name in [*scalars, *vectors]:
        yield f"squared:{name}", "squared argument", name, {name: inputs[name] ** 2}
    for name in vectors:
        yield f"normalised:{name}", "normalised argument", name, {name: _unit(inputs[name])}
    for name in integers:
        for k in (1, 2):
            yield f"shifted:{name}", "shifted", name, {name: (inputs[name] + k) % 3}
        for k in range(3):
            yield f"ignored:{name}", "ignored", name, {name: np.full_like(inputs[name], k)}
    for name in matrices:
        yield f"diagonal:{name}", "diagonal argument", name, {name: inputs[name] * np.eye(3)}
    if len(points) > 2:
        flat = {name: inputs[name] * np.array([1.0, 1.0, 0.0]) for name in points}
        yield "in a plane", "in a plane", "", flat
    for names in (vectors, points):
        if len(names) > 2:
            rolled = dict(zip(names, [inputs[n] for n in (*names[1:], names[0])], strict=True))
            yield f"rolled:{','.join(names)}", "rolled", ", ".join(names), rolled
    for name in vectors:
        for p in _permutations(3):
            yield f"permuted:{name}", "permuted argument", name, {name: inputs[name][:, p]}


def _changed(question: Question) -> Diagnosis | None:
    wrong = np.flatnonzero(question.wrong)
    probe = question.at(wrong[[0, len(wrong) // 2]] if len(wrong) > 1 else wrong)  # most changes fail here
    tries = zip(changes(question.task, probe.inputs), changes(question.task, question.inputs), strict=True)
    for (_, _, _, few), (cause, head, of, everywhere) in tries:
        try:
            if probe.explained(probe.truth(**few)) and question.explained(question.truth(**everywhere)):
                return _about(question, cause, of, head)
        except (ArithmeticError, ValueError):  # no right answer to these inputs
            continue
    return None


# --- some of the cases, part of the answer -----------------------------------------------------------------


def conditions(question: Question) -> Iterator[tuple[str, np.ndarray]]:
    """Natural conditions on a case, by which right and wrong ones may be told apart: (words, (b,) of bool)."""
    a = question.inputs
    kinds: dict[str, list[str]] = {}
    for value in question.task.arguments:
        kinds.setdefault(value.kind, []).append(value.name)
    for p, q in itertools.combinations(kinds.get("int", []), 2):
        yield f"{p} = {q}", a[p] == a[q]
    for name in kinds.get("int", []):
        for k in range(3):
            yield f"{name} = {k}", a[name] == k
    if "s" in a:
        s0, s1, s2 = a["s"].T
        yield "s_0 = s_1", s0 == s1
        yield "s_2 is not 1", s2 != 1
        yield "the cloth is at rest", (s0 == 1) & (s1 == 1)
        yield "s_0 or s_1 is 1", (s0 == 1) | (s1 == 1)
        yield "s_0 = 1", s0 == 1
        yield "s_1 = 1", s1 == 1
        yield "s_0 < 1", s0 < 1
        yield "s_1 < 1", s1 < 1
        yield "s_0 + s_1 < 2", s0 + s1 < 2
        yield "s_0 s_1 < 1", s0 * s1 < 1
        yield "s_1 <= 1", s1 <= 1
    vectors = kinds.get("vec3", [])
    for name in vectors:
        yield f"{name} = 0", ~a[name].any(axis=1)
    if len(vectors) == 2:
        p, q = vectors
        product, distance = np.sum(a[p] * a[q], axis=1), _norm(a[p] - a[q])
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
    if {"X", "X0", "X1", "X2"} <= set(a):
        m = np.cross(a["X1"] - a["X0"], a["X2"] - a["X0"])
        offset = np.abs(np.sum(m * (a["X"] - a["X0"]), axis=1)) / np.sum(m * m, axis=1) ** 0.75
        yield "X lies off the triangle's plane", offset > 1e-6
    if "phi" in a:
        yield "phi is negative somewhere", (a["phi"] < 0).any(axis=1)
        yield "the point is a vertex", (a["phi"] == 1).any(axis=1)
    for name in kinds.get("mat3", []):
        yield f"{name} is not symmetric", _norm(a[name] - _t(a[name])) > 1e-9 * _norm(a[name])
        yield f"{name} is not a rotation", _norm(a[name] @ _t(a[name]) - np.eye(3)) > 1e-9
        yield f"det {name} < 0", np.linalg.det(a[name]) < 0
    if "dpsi_ds" in a:
        yield "dpsi_ds is negative somewhere", (a["dpsi_ds"] < 0).any(axis=1)
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
    told = wrong | (_norm(question.right) > 0)  # where the answer is zero anyway, being right means little
    if wrong[told].all():
        return None
    for words, holds in conditions(question):
        for phrase, where in ((words, holds), (_opposite(words), ~holds)):
            if (where[told] == wrong[told]).all():
                inner = _first(question.at(wrong), WITHIN)
                found = _about(question, f"where {phrase}", phrase, "where")
                return _within(found, inner, f"where {phrase}")
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
            return _within(_about(question, cause, which, head), inner, cause)
    return None


def _within(outer: Diagnosis, inner: Diagnosis | None, place: str) -> Diagnosis:
    """What is wrong in a part, joined with which part it is."""
    if inner is None:
        return outer
    return Diagnosis(f"{place}: {inner.cause}", f"{outer.mistake} There: {inner.mistake}", inner.advice)


# --- other signs -------------------------------------------------------------------------------------------


def _nan(question: Question) -> Diagnosis | None:
    wrong = question.wrong
    broken = ~np.isfinite(question.seen(question.got)).all(axis=1)
    return _about(question, "nan") if broken[wrong].all() else None


def _nan_somewhere(question: Question) -> Diagnosis | None:
    """Not finite in some cases: those first, whatever else is wrong."""
    broken = ~np.isfinite(question.seen(question.got)).all(axis=1)
    if not broken.any():
        return None
    for words, holds in conditions(question):
        if (holds == broken).all():
            inner = _about(question, "nan")
            return _within(_about(question, f"where {words}", words, "where"), inner, f"where {words}")
    return _about(question, "nan")


def _digits(question: Question) -> Diagnosis | None:
    error = _norm(question.seen(question.got - question.right))
    return _about(question, "digits") if (error <= 1e-4 * question.scale).all() else None


def _known(question: Question) -> Diagnosis | None:
    for mistake in question.known:
        if mistake.result == question.index:
            try:
                made = mistake.makes(Case(question))
            except (ArithmeticError, ValueError):  # no right answer to the inputs it needs
                continue
            for candidate in made if isinstance(made, tuple) else (made,):
                if question.explained(candidate):
                    return Diagnosis(mistake.cause, mistake.mistake, mistake.advice)
    return None


def _first(
    question: Question, searches: tuple[Callable[[Question], Diagnosis | None], ...]
) -> Diagnosis | None:
    return next((found for search in searches if (found := search(question)) is not None), None)


# --- mistakes known from students --------------------------------------------------------------------------


class Case:
    """What a known mistake is made of: the arguments as attributes, the right answer, and the truth elsewhere."""

    def __init__(self, question: Question):
        self.right = question.right
        self.truth = question.truth
        self.shape = question.shape
        self.__dict__.update(question.inputs)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


@dataclass(frozen=True)
class Mistake:
    """One mistake: its words, and what it makes of the right answer (one array, or several to try)."""

    cause: str
    mistake: str
    advice: str
    makes: Callable[[Case], Any]
    result: int = 0


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product of each pair of vectors, as a column (b, 1)."""
    return np.sum(a * b, axis=1, keepdims=True)


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, None] * b[:, None, :]


def _diag(p: np.ndarray) -> np.ndarray:
    return p[:, :, None] * np.eye(p.shape[1])


def _long(array: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """A number per case, (b,), ready to be multiplied with vectors or matrices."""
    return array.reshape(-1, *[1] * (vectors.ndim - 1))


def _edges(a: Case) -> tuple[np.ndarray, np.ndarray]:
    return a.X1 - a.X0, a.X2 - a.X0


def _completed(first: np.ndarray, second: np.ndarray, total: Any) -> np.ndarray:
    """Entries or rows 1 and 2, and a zeroth that makes the sum right."""
    return np.stack([total - first - second, first, second], axis=1)


def _replaced(array: np.ndarray, component: int, values: np.ndarray) -> np.ndarray:
    array = array.copy()
    array[:, component] = values
    return array


def _unsigned_areas(a: Case) -> np.ndarray:
    corners = (a.X0, a.X1, a.X2)
    shares = [_norm(np.cross(corners[k - 2] - a.X, corners[k - 1] - a.X)) for k in range(3)]
    return np.stack(shares, axis=1) / _norm(np.cross(*_edges(a)))[:, None]


def _phi_unit_edges(a: Case) -> np.ndarray:
    e, f = _edges(a)
    return _completed(_norm(e) * a.right[:, 1], _norm(f) * a.right[:, 2], 1)


def _phi_apart(a: Case) -> tuple[np.ndarray, ...]:
    d, (e, f) = a.X - a.X0, _edges(a)
    along = [(_dot(d, e)[:, 0] / _norm(e) ** p, _dot(d, f)[:, 0] / _norm(f) ** p) for p in (2, 1, 0)]
    return tuple(_completed(first, second, 1) for first, second in along)


def _gradients_apart(a: Case) -> tuple[np.ndarray, ...]:
    e, f = _edges(a)
    along = [(e / _norm(e)[:, None] ** p, f / _norm(f)[:, None] ** p) for p in (2, 1, 0)]
    return tuple(_completed(first, second, 0) for first, second in along)


def _opposite_edges(a: Case) -> np.ndarray:
    return (
        np.stack([a.X2 - a.X1, a.X0 - a.X2, a.X1 - a.X0], axis=1) / _norm(np.cross(*_edges(a)))[:, None, None]
    )


def _gradients_unit_edges(a: Case) -> np.ndarray:
    e, f = _edges(a)
    return _completed(_norm(e)[:, None] * a.right[:, 1], _norm(f)[:, None] * a.right[:, 2], 0)


def _heights(a: Case) -> np.ndarray:
    """Gradients as long as the heights, not one over them."""
    return a.right / np.sum(a.right**2, axis=2, keepdims=True)


def _normal_part(a: Case) -> tuple[np.ndarray, np.ndarray]:
    """F without what carries N to n, and that part."""
    flat = a.truth(N=np.zeros_like(a.N))
    return flat, a.right - flat


def _m(a: Case) -> np.ndarray:
    """The deformed triangle's normal, twice as long as its area."""
    return np.cross(a.x1 - a.x0, a.x2 - a.x0)


def _carried(change: Callable[[Case, np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """F with what carries N to n changed."""

    def makes(a: Case) -> np.ndarray:
        flat, part = _normal_part(a)
        return flat + change(a, part)

    return makes


def _vertices_as_rows(a: Case) -> np.ndarray:
    _, part = _normal_part(a)
    return np.stack([a.x0, a.x1, a.x2], axis=1) @ a.dphi_dX + part


def _dm(a: Case) -> np.ndarray:
    """How the triangle's long normal changes with vertex i: it is linear in it, so differences are exact."""
    x = [a.x0 - a.x0, a.x1 - a.x0, a.x2 - a.x0]

    def m(k: int, step: int) -> np.ndarray:
        y = [p + np.where(a.i == v, step, 0)[:, None] * np.eye(3)[k] for v, p in enumerate(x)]
        return np.cross(y[1] - y[0], y[2] - y[0])

    return np.stack([(m(k, 1) - m(k, -1)) / 2 for k in range(3)], axis=2)


def _turned(project: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """The normal's derivative, projected in another way: project(dm, n n^T) / |m|."""

    def makes(a: Case) -> np.ndarray:
        n = _unit(_m(a))
        return project(_dm(a), _outer(n, n)) / _norm(_m(a))[:, None, None]

    return makes


def _mass(a: Case) -> np.ndarray:
    return a.area * a.rho * a.h


def _squares(a: Case) -> np.ndarray:
    """What the three vertices would have if they moved one at a time."""
    still = np.zeros_like(a.v0)
    alone = ({"v1": still, "v2": still}, {"v0": still, "v2": still}, {"v0": still, "v1": still})
    return sum(a.truth(**others) for others in alone)  # type: ignore[return-value]


def _mixed(count: float, times: float = 1) -> Callable[[Case], np.ndarray]:
    return lambda a: times * _squares(a) + count * (a.right - _squares(a))


def _principal_root(a: Case) -> np.ndarray:
    squares, V = np.linalg.eigh(a.right)
    return V @ _diag(np.sqrt(squares)) @ _t(V)


def _apart(a: Case) -> np.ndarray:
    """The lam term of each stretch alone: then lam only adds to mu."""
    return a.truth(mu=a.mu + a.lam / 2, lam=np.zeros_like(a.lam))


def _without_lam(a: Case) -> np.ndarray:
    return a.truth(lam=np.zeros_like(a.lam))


def _psi_third(a: Case) -> tuple[np.ndarray, ...]:
    t, plane = a.s[:, 2] - 1, a.s[:, 0] + a.s[:, 1] - 2
    more = a.lam / 2 * (2 * plane * t + t * t)
    return a.right + a.mu * t**2, a.right + more, a.right + a.mu * t**2 + more


def _dpsi_third(a: Case) -> tuple[np.ndarray, ...]:
    t = (a.s[:, 2] - 1)[:, None]
    total = np.sum(a.s, axis=1, keepdims=True) - 3
    third, mu, lam = np.array([0.0, 0.0, 1.0]), a.mu[:, None], a.lam[:, None]
    alone = a.right + 2 * mu * t * third
    return (
        alone,
        alone + lam * (t * (1 - third) + total * third),
        a.right + lam * total * third,
        alone + lam * t * third,
    )


def _area_psi(a: Case, power: int = 2) -> np.ndarray:
    return _without_lam(a) + a.lam / 2 * (a.s[:, 0] * a.s[:, 1] - 1) ** power


def _area_gradient(a: Case) -> np.ndarray:
    change = a.lam * (a.s[:, 0] * a.s[:, 1] - 1)
    return _without_lam(a) + change[:, None] * a.s[:, [1, 0, 2]] * np.array([1.0, 1.0, 0.0])


def _area_hessian(a: Case) -> np.ndarray:
    s0, s1, _ = a.s.T
    block = np.zeros((len(s0), 3, 3))
    block[:, 0, 0], block[:, 1, 1] = s1**2, s0**2
    block[:, 0, 1] = block[:, 1, 0] = 2 * s0 * s1 - 1
    return _without_lam(a) + a.lam[:, None, None] * block


def _third_row(a: Case) -> tuple[np.ndarray, ...]:
    corner = np.diag([0.0, 0.0, 1.0])
    border = 1 - np.diag([1.0, 1.0, 0.0]) - np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 0]])
    mu, lam = a.mu[:, None, None], a.lam[:, None, None]
    alone = a.right + 2 * mu * corner
    return alone, alone + lam * border, alone + lam * corner, a.right + corner


def _times_s(a: Case) -> tuple[np.ndarray, ...]:
    S = _diag(a.s)
    return S @ a.right, a.right @ S, S @ a.right @ S, a.right * S, a.right + a.right * (S - np.eye(3))


def _entrywise_chain(a: Case) -> tuple[np.ndarray, ...]:
    rest = a.truth(ds=np.zeros_like(a.ds))
    middles = (a.d2psi_ds2 * a.ds[:, None, :], a.d2psi_ds2 * a.ds[:, :, None])
    return tuple(rest + a.U @ middle @ _t(a.V) for middle in middles)


def _without_limit(a: Case) -> tuple[np.ndarray, ...]:
    met = a.s[:, 0] == a.s[:, 1]
    return tuple(_replaced(a.right, 0, np.where(met, value, a.right[:, 0])) for value in (np.nan, 0.0))


def _flip_limit(combine: Callable[[np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """Another limit where the stretches meet."""

    def makes(a: Case) -> np.ndarray:
        met = a.s[:, 0] == a.s[:, 1]
        return _replaced(a.right, 0, np.where(met, combine(a.d2psi_ds2), a.right[:, 0]))

    return makes


def _limit_always(a: Case) -> tuple[np.ndarray, ...]:
    H = a.d2psi_ds2
    limits = ((H[:, 0, 0] + H[:, 1, 1]) / 2 - H[:, 0, 1], H[:, 0, 0] - H[:, 0, 1], H[:, 1, 1] - H[:, 0, 1])
    return tuple(_replaced(a.right, 0, limit) for limit in limits)


def _outs(values: Callable[[Case, int], np.ndarray]) -> Callable[[Case], np.ndarray]:
    def makes(a: Case) -> np.ndarray:
        return _replaced(_replaced(a.right, 2, values(a, 0)), 3, values(a, 1))

    return makes


def _distance(a: Case) -> np.ndarray:
    return _norm(a.x - a.c)


def _projected_always(a: Case) -> np.ndarray:
    return np.where(_dot(a.v, a.n) < 0, a.right, -a.truth(v=-a.v))


def _along_v(a: Case) -> tuple[np.ndarray, ...]:
    d = np.minimum(_dot(a.v, a.n), 0)
    speed = _norm(a.v)[:, None]
    unit = np.where(speed > 0, a.v / np.where(speed > 0, speed, 1), 0)
    return a.v - d * a.v, a.v + d * a.v, a.v - d * unit, a.v + d * unit


_LEAD = "Write the derivation down once more; the handout takes it in small steps."

#: Mistakes of single tasks, the likelier first.
KNOWN: Mapping[str, tuple[Mistake, ...]] = {
    "phi": (
        Mistake(
            "missing:X0",
            "X0 is not subtracted from X: your phi is right only if vertex 0 is the origin.",
            "A triangle that is moved must keep its barycentric coordinates. Measure from a vertex.",
            lambda a: a.truth(X=a.X + a.X0),
        ),
        Mistake(
            "unsigned areas",
            "Your phi are shares of area without a sign: outside the triangle none of them is negative.",
            "Give each area a sign, positive if it turns the same way round as the triangle.",
            _unsigned_areas,
        ),
        Mistake(
            "edges apart",
            "The edges are treated one at a time, as if they were perpendicular.",
            "Two unknowns need both equations at once: a 2x2 system.",
            _phi_apart,
        ),
        Mistake(
            "unit edges",
            "Your phi count metres along the edges: the edges have been made of length one.",
            "phi_1 must be 1 at vertex 1, however long the edge is.",
            _phi_unit_edges,
        ),
    ),
    "dphi_dX": (
        Mistake(
            "edges apart",
            "The edges are treated one at a time, as if they were perpendicular.",
            "Each gradient must be perpendicular to the edge opposite its vertex. Is yours?",
            _gradients_apart,
        ),
        Mistake(
            "unit edges",
            "The edges have been made of length one, so your gradients do not know the size of the triangle.",
            "Doubling the triangle must halve the gradients.",
            _gradients_unit_edges,
        ),
        Mistake(
            "not turned",
            "Row i points along the edge opposite vertex i, not across it.",
            "A gradient points where phi_i grows: from the opposite edge towards the vertex.",
            _opposite_edges,
        ),
        Mistake(
            "heights",
            "Your gradients point the right way, but are as long as the heights of the triangle.",
            "phi_i grows by one over the whole height: how much per metre?",
            _heights,
        ),
    ),
    "interpolate": (
        Mistake(
            "average",
            "Your point is the centre of the triangle, whatever phi is.",
            "Weight each vertex with its own shape function.",
            lambda a: (a.x0 + a.x1 + a.x2) / 3,
        ),
        Mistake(
            "missing:phi",
            "Your point is the sum of the vertices, without the shape functions.",
            "Weight each vertex with its own shape function.",
            lambda a: a.x0 + a.x1 + a.x2,
        ),
        Mistake(
            "entry by entry",
            "Component k of your point comes from one vertex, or is weighted by phi_k.",
            "A shape function multiplies a whole vertex, all three components of it.",
            lambda a: (
                np.stack([a.phi[:, k] * (a.x0, a.x1, a.x2)[k][:, k] for k in range(3)], axis=1),
                a.phi * (a.x0 + a.x1 + a.x2),
            ),
        ),
        Mistake(
            "transposed vertices",
            "The vertices stand in the rows of your matrix, where they should be columns.",
            "phi_0 must multiply vertex 0: look what it multiplies in your product.",
            lambda a: np.stack([_dot(x, a.phi)[:, 0] for x in (a.x0, a.x1, a.x2)], axis=1),
        ),
    ),
    "deformation_gradient": (
        Mistake(
            "normal not normalised",
            "The deformed normal has not been made of length one.",
            "A normal has length one, whatever the size of the triangle: then F N = n keeps the thickness.",
            _carried(lambda a, part: part * _norm(_m(a))[:, None, None]),
        ),
        Mistake(
            "outer product transposed",
            "The outer product of the normals is the wrong way round.",
            "The matrix must send N to n. Multiply yours by N and see what comes out.",
            _carried(lambda a, part: _t(part)),
        ),
        Mistake(
            "undeformed normal",
            "The undeformed normal stands where the deformed one should.",
            "A cloth that turns takes its normal along: compute n from the deformed vertices.",
            _carried(lambda a, part: _outer(a.N, a.N)),
        ),
        Mistake(
            "deformed normal twice",
            "The deformed normal stands where the undeformed one should, too.",
            "F starts from the undeformed cloth: which normal does it multiply?",
            _carried(lambda a, part: _outer(_unit(_m(a)), _unit(_m(a)))),
        ),
        Mistake(
            "vertices as rows",
            "The vertices stand in the rows of your matrix, where they should be columns.",
            "Each term is a vertex (column) times the gradient of its shape function (row).",
            _vertices_as_rows,
        ),
    ),
    "dn_dx": (
        Mistake(
            "not projected",
            "Your derivative has a part along n: the change of length has not been taken away.",
            "A unit vector keeps its length, so n^T dn must be zero. Check yours.",
            _turned(lambda dm, nn: dm),
        ),
        Mistake(
            "not divided",
            "You project, but do not divide by the length of the unnormalised normal.",
            "Check the unit: the result is in 1/m.",
            lambda a: a.right * _norm(_m(a))[:, None, None],
        ),
        Mistake(
            "not normalised",
            "This is the derivative of the unnormalised normal.",
            "Differentiate m/|m|: both the direction and the length of m depend on the vertex.",
            _dm,
        ),
        Mistake(
            "divided twice",
            "You divide by the length of the unnormalised normal once too often.",
            "Check the unit: the result is in 1/m.",
            lambda a: a.right / _norm(_m(a))[:, None, None],
        ),
        Mistake(
            "projected on the other side",
            "The projection stands on the wrong side of the product.",
            "It acts on a change of the normal, after that change has been computed.",
            lambda a: (
                _turned(lambda dm, nn: dm - dm @ nn)(a),
                _turned(lambda dm, nn: nn @ dm)(a),
                _turned(lambda dm, nn: dm + nn @ dm)(a),
            ),
        ),
        Mistake(
            "only in a plane",
            "The normal in your projection is fixed: it fits triangles in a coordinate plane only.",
            "Take the triangle's own normal.",
            lambda a: tuple(
                (np.eye(3) - np.outer(z, z)) @ _dm(a) / _norm(_m(a))[:, None, None] for z in np.eye(3)[::-1]
            ),
        ),
        Mistake(
            "wrong edge",
            "This belongs to another vertex, walked the other way round.",
            "Which edge lies opposite vertex i? Walk the triangle always in the same sense.",
            lambda a: (-a.truth(i=(a.i + 1) % 3), -a.truth(i=(a.i + 2) % 3)),
        ),
    ),
    "mass_block": (
        Mistake(
            "lumped",
            "This is the lumped mass: a third of the triangle at each vertex, nothing between them.",
            "The consistent mass couples the vertices: integrate phi_i phi_j for i != j, too.",
            lambda a: np.where(a.i == a.j, _mass(a) / 3, 0),
        ),
        Mistake(
            "one point",
            "The product of the shape functions is taken at the centre of the triangle only.",
            "The integrand is quadratic: one sample at the centre is not exact.",
            lambda a: _mass(a) / 9,
        ),
        Mistake(
            "linear",
            "The integral of one shape function stands in place of that of a product of two.",
            "Two shape functions meet under the integral, also for i = j.",
            lambda a: _mass(a) / 3,
        ),
    ),
    "kinetic_energy": (
        Mistake(
            "lumped",
            "This is the energy of lumped masses: a third of the triangle at each vertex.",
            "Between the vertices the velocity is interpolated, so they are coupled: v_i . v_j for i != j, too.",
            _mixed(0, 2),
        ),
        Mistake(
            "missing coupling",
            "Only the terms v_i . v_i are there: the coupling between the vertices is missing.",
            "The double sum has nine terms. Which ones are left out?",
            _mixed(0),
        ),
        Mistake(
            "mixed terms once",
            "Each mixed term is counted once: v_0 . v_1, but not v_1 . v_0.",
            "The double sum has nine terms, and the mixed ones come in pairs.",
            _mixed(0.5),
        ),
        Mistake(
            "mixed terms doubled",
            "The mixed terms count twice as much as they should.",
            "Write the nine terms out: how often does each mixed pair come, and with which fraction?",
            _mixed(2),
        ),
        Mistake(
            "one point",
            "The velocity is taken at the centre of the triangle only.",
            "The energy is quadratic in the velocity: one sample at the centre is not exact.",
            lambda a: _mass(a) / 2 * _norm((a.v0 + a.v1 + a.v2) / 3) ** 2,
        ),
        Mistake(
            "sum of velocities",
            "The velocities are added first, and their sum squared.",
            "Then i = j and i != j count alike. In the mass matrix they do not.",
            lambda a: tuple(_mass(a) / k * _norm(a.v0 + a.v1 + a.v2) ** 2 for k in (12, 24, 6, 2)),
        ),
    ),
    "right_cauchy_green": (
        Mistake(
            "strain",
            "This is a strain: the identity has been subtracted.",
            "C itself is asked: for a rotation it is the identity, not zero.",
            lambda a: ((a.right - np.eye(3)) / 2, a.right - np.eye(3)),
        ),
        Mistake(
            "entry by entry",
            "The matrices are multiplied entry by entry.",
            "In Taichi * is entry by entry. The matrix product has another sign.",
            lambda a: (a.F * a.F, _t(a.F) * a.F),
        ),
        Mistake(
            "F F",
            "F is multiplied with itself, and nothing is transposed.",
            "Put dx = F dX into dx^T dx: what happens to the first factor?",
            lambda a: a.F @ a.F,
        ),
        Mistake(
            "stretch",
            "This is the root of C: its eigenvalues are the stretches, not their squares.",
            "C holds the squares. Do not take the root.",
            _principal_root,
        ),
        Mistake(
            "small strain",
            "This is the symmetric part of F (or what remains without the identity), right for tiny changes only.",
            "Lengths are squared: C is a product, not a sum.",
            lambda a: (
                (a.F + _t(a.F)) / 2,
                (a.F + _t(a.F)) / 2 - np.eye(3),
                a.F + _t(a.F) - np.eye(3),
                a.F + _t(a.F),
            ),
        ),
    ),
    "psi": (
        Mistake(
            "third stretch",
            "The sum runs over three stretches.",
            "Only the two stretches in the plane store energy; do not count on the third being 1.",
            _psi_third,
        ),
        Mistake(
            "area energy",
            "This is the area energy, with the product of the stretches.",
            "The task asks for the linearised one: what is the product, to first order around (1, 1)?",
            lambda a: (_area_psi(a), _area_psi(a, 1)),
        ),
        Mistake(
            "each stretch alone",
            "The lam term squares the change of each stretch alone.",
            "Add the changes of both stretches first, then square.",
            lambda a: (_apart(a), a.truth(mu=a.mu + a.lam, lam=0 * a.lam)),
        ),
        Mistake(
            "missing square",
            "The square of the lam term is missing.",
            "Without a square, compressing the cloth would win energy without end.",
            lambda a: _without_lam(a) + a.lam / 2 * (a.s[:, 0] + a.s[:, 1] - 2),
        ),
        Mistake(
            "rest at one",
            "The lam term does not vanish at rest.",
            "At s_0 = s_1 = 1 nothing is stored: what must be subtracted from the sum of the stretches?",
            lambda a: tuple(
                _without_lam(a) + a.lam / 2 * (a.s[:, 0] + a.s[:, 1] - k) ** 2 for k in (1, 0, 3)
            ),
        ),
    ),
    "dpsi_ds": (
        Mistake(
            "third stretch",
            "The third stretch takes part.",
            "psi does not contain s_2: what is its derivative by it?",
            _dpsi_third,
        ),
        Mistake(
            "each stretch alone",
            "The lam term of each component holds its own stretch only.",
            "Differentiate the square of a sum: the whole sum stays inside.",
            lambda a: _apart(a),
        ),
        Mistake(
            "area energy",
            "This is the gradient of the area energy, the handout's example.",
            "Differentiate the linearised energy in the same way. It is easier.",
            _area_gradient,
        ),
        Mistake(
            "stretches",
            "These are the stretches themselves, not the derivative of psi.",
            "Differentiate psi by s_0 with s_1 fixed.",
            lambda a: (a.s, a.s * np.array([1.0, 1.0, 0.0]), a.s - 1),
        ),
        Mistake(
            "rest at one",
            "The lam term does not vanish at rest.",
            "At s_0 = s_1 = 1 there is no stress: what must be subtracted from the sum of the stretches?",
            lambda a: tuple(
                a.right + k * a.lam[:, None] * np.array([1.0, 1.0, 0.0]) for k in (1.0, 2.0, -1.0)
            ),
        ),
    ),
    "d2psi_ds2": (
        Mistake(
            "third row and column",
            "There is something in the third row and column.",
            "psi does not contain s_2: what are its second derivatives by it?",
            _third_row,
        ),
        Mistake(
            "multiplied by s",
            "The Hessian has been multiplied by the stretches.",
            "psi is quadratic in s: its second derivative does not contain s any more.",
            _times_s,
        ),
        Mistake(
            "area energy",
            "This is the Hessian of the area energy, the handout's example.",
            "Differentiate the linearised energy in the same way: the result is constant.",
            _area_hessian,
        ),
    ),
    "dpsi_dF": (
        Mistake(
            "diagonal outside",
            "The diagonal matrix stands outside of the product of the two rotations.",
            "The stress in the principal directions is diagonal: U and V turn it from both sides.",
            lambda a: (_diag(a.dpsi_ds) @ a.U @ _t(a.V), a.U @ _t(a.V) @ _diag(a.dpsi_ds)),
        ),
        Mistake(
            "entry by entry",
            "The matrices are multiplied entry by entry.",
            "In Taichi * is entry by entry. The matrix product has another sign.",
            lambda a: (a.U * _diag(a.dpsi_ds) * _t(a.V), a.U * _diag(a.dpsi_ds) @ _t(a.V)),
        ),
    ),
    "nodal_force": (
        Mistake(
            "entry by entry",
            "P and the gradient are multiplied entry by entry somewhere.",
            "The force is a matrix times a vector.",
            lambda a: -_long(a.area * a.h, a.right) * np.einsum("bii->bi", a.P) * a.grad_phi,
        ),
    ),
    "d2psi_dFij": (
        Mistake(
            "entry by entry",
            "The Hessian of psi and ds are multiplied entry by entry.",
            "How psi_s changes is a vector: a matrix times a vector. Its diagonal matrix stands in the middle.",
            _entrywise_chain,
        ),
    ),
    "eigensystem": (
        Mistake(
            "3x3 mode",
            "out_i is divided by s_i - 1: that is the mode of the 3x3 matrix, singular at rest.",
            "The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.",
            _outs(lambda a, i: a.dpsi_ds[:, i] / (a.s[:, i] - 1)),
        ),
        Mistake(
            "missing limit",
            "Flip has no limit: where the stretches meet it is zero divided by zero.",
            "Where the gap is tiny, take the limit of the quotient in place of the quotient.",
            _without_limit,
        ),
        Mistake(
            "out not divided",
            "out_0 and out_1 are stresses: they have not been divided by a stretch.",
            "How far does the normal lean when the tangent is lifted? The stretch decides it.",
            _outs(lambda a, i: a.dpsi_ds[:, i]),
        ),
        Mistake(
            "other stretch",
            "out_i is divided by the wrong stretch.",
            "out_i belongs to the axis i: stress and stretch along the same axis.",
            _outs(lambda a, i: a.dpsi_ds[:, i] / a.s[:, 1 - i]),
        ),
        Mistake(
            "wrong limit",
            "The limit of flip, where the stretches meet, is not the right combination of second derivatives.",
            "Step apart by a small gap, one stretch up, the other down: what does that do to the two stresses?",
            lambda a: (
                _flip_limit(lambda H: H[:, 0, 0] + H[:, 0, 1])(a),
                _flip_limit(lambda H: H[:, 0, 0])(a),
                _flip_limit(lambda H: H[:, 0, 1])(a),
                _flip_limit(lambda H: H[:, 0, 1] - H[:, 0, 0])(a),
                _flip_limit(lambda H: (H[:, 0, 0] - H[:, 0, 1]) / 2)(a),
                _flip_limit(lambda H: H[:, 0, 0] + H[:, 1, 1] - H[:, 0, 1])(a),
            ),
        ),
        Mistake(
            "limit always",
            "The limit of flip is taken everywhere, or where the gap is large.",
            "The limit holds where the stretches meet; elsewhere the quotient does. It depends on the energy.",
            _limit_always,
        ),
        Mistake(
            "difference in twist",
            "Twist has the difference of the stresses above, where flip has it.",
            "Plus over plus, minus over minus.",
            lambda a: _replaced(a.right, 1, (a.dpsi_ds[:, 0] - a.dpsi_ds[:, 1]) / (a.s[:, 0] + a.s[:, 1])),
        ),
        Mistake(
            "difference below twist",
            "Twist is divided by the difference of the stretches.",
            "Plus over plus, minus over minus.",
            lambda a: _replaced(a.right, 1, (a.dpsi_ds[:, 0] + a.dpsi_ds[:, 1]) / (a.s[:, 0] - a.s[:, 1])),
        ),
    ),
    "sphere_contact": (
        Mistake(
            "squared distance",
            "The squared distance is compared with r.",
            "Metres squared against metres: for r = 1 it works. Compare like with like.",
            lambda a: _distance(a) ** 2 < a.r,
        ),
        Mistake(
            "surface counts",
            "A point exactly on the surface counts as a hit.",
            "A hit is strictly inside: look at < and <=.",
            lambda a: _distance(a) <= a.r,
        ),
        Mistake(
            "inverted",
            "Outside counts as a hit, and inside as none.",
            "Inside means nearer to the centre than r.",
            lambda a: (_distance(a) >= a.r, _distance(a) > a.r),
        ),
        Mistake(
            "missing:c",
            "The distance is measured from the origin, not from the centre c.",
            "Where is x, seen from the centre of the sphere?",
            lambda a: _norm(a.x) < a.r,
        ),
        Mistake(
            "scaled by distance",
            "The normal is as long as the distance from the centre.",
            "A normal has length one: how do you make a vector of length one?",
            lambda a: (a.x - a.c, np.where(_distance(a)[:, None] > 0, a.x - a.c, a.right)),
            result=1,
        ),
        Mistake(
            "divided by the radius",
            "The normal is divided by the radius: it has length one on the surface only.",
            "Inside the sphere the vertex is nearer than r. Divide by its own distance.",
            lambda a: tuple(
                np.where(_distance(a)[:, None] > 0, (a.x - a.c) / a.r[:, None], there)
                for there in (0.0, a.right)
            ),
            result=1,
        ),
        Mistake(
            "divided by the squared distance",
            "The normal is divided by the squared distance.",
            "A vector divided by its length has length one. Is yours divided by its length?",
            lambda a: np.where(_distance(a)[:, None] > 0, a.right / _distance(a)[:, None], a.right),
            result=1,
        ),
        Mistake(
            "no normal without a hit",
            "Your normal is set only where there is a hit.",
            "The normal is asked for whether or not there is a hit.",
            lambda a: tuple(
                np.where((_distance(a) < a.r)[:, None], a.right, there)
                for there in (0.0, np.eye(3)[1], a.x - a.c)
            ),
            result=1,
        ),
    ),
    "filter_velocity": (
        Mistake(
            "always",
            "The filter is applied always, also to a velocity that leaves the obstacle.",
            "A vertex that moves away keeps its velocity: look at the sign of n^T v first.",
            _projected_always,
        ),
        Mistake(
            "reflected",
            "The velocity is reflected: the cloth bounces.",
            "Take the part that goes in away once, not twice.",
            lambda a: (2 * a.right - a.v, 2 * _projected_always(a) - a.v),
        ),
        Mistake(
            "wrong sign",
            "The part that goes in is added, not taken away: the vertex goes in twice as fast.",
            "Afterwards n^T v must be zero. Try it with one number.",
            lambda a: (2 * a.v - a.right, 2 * a.v - _projected_always(a)),
        ),
        Mistake(
            "reversed",
            "The filter acts on velocities that leave, and lets those pass that go in.",
            "n points out of the obstacle: which sign of n^T v means going in?",
            lambda a: np.where(_dot(a.v, a.n) < 0, a.v, -a.truth(v=-a.v)),
        ),
        Mistake(
            "stopped",
            "A velocity that goes in is set to zero: the vertex sticks.",
            "Take away the part along n only; what slides along the surface stays.",
            lambda a: np.where(_dot(a.v, a.n) < 0, 0.0, a.v),
        ),
        Mistake(
            "along the velocity",
            "The velocity is made smaller along itself, not along the normal.",
            "Take away the part along n only; what slides along the surface stays.",
            _along_v,
        ),
        Mistake(
            "the part that goes in",
            "You return the part along the normal, not what is left without it.",
            "Split v into two parts. Which one may the vertex keep?",
            lambda a: (
                a.v - a.right,
                np.where(_dot(a.v, a.n) < 0, a.v - a.right, a.v),
                a.v - _projected_always(a),
            ),
        ),
        Mistake(
            "missing:n",
            "The number n^T v is taken away from every component, without the direction n.",
            "The part of v along n is a vector: a number times n.",
            lambda a: a.v - np.minimum(_dot(a.v, a.n), 0),
        ),
    ),
}

#: A cause in the words of one task: (mistake, advice); empty where those of `WORDS` say it best.
SAID: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "phi": {
        "permuted:1,2,0": (
            "The components are in another order: phi_0 comes last in yours.",
            "The first component belongs to vertex 0: at X0 it is 1.",
        ),
        "absolute": (
            "Your phi are never negative, also outside the triangle.",
            "Give each area a sign, positive if it turns the same way round as the triangle.",
        ),
        "component 0": ("", "The three shape functions sum to one, everywhere."),
        "component 0: zeros": ("", "The three shape functions sum to one, everywhere."),
    },
    "dphi_dX": {
        "transposed": (
            "Rows and columns are exchanged: your columns are the gradients.",
            "Row i of the result is the gradient of phi_i.",
        ),
        "row 0: zeros": (
            "Row 0 is zero: the gradient of phi_0 has been forgotten.",
            "The shape functions sum to one everywhere. What do their gradients sum to?",
        ),
        "row 0: negated": (
            "Row 0 has the opposite sign.",
            "The shape functions sum to one everywhere. What do their gradients sum to?",
        ),
        "row 0": (
            "Row 0 is wrong: the three rows do not sum to zero.",
            "The shape functions sum to one everywhere. What do their gradients sum to?",
        ),
        "rows normalised": (
            "",
            "phi_i grows from 0 to 1 over one height of the triangle. How much is that per metre?",
        ),
    },
    "interpolate": {
        "lacks:x0": (
            "The edges are weighted, and vertex 0 is not added.",
            "Either weight the three vertices, or begin at vertex 0.",
        ),
    },
    "deformation_gradient": {
        "missing:N": (
            "The normal is missing: your F flattens everything along N.",
            "Multiply your F by N: it must give the deformed normal, not zero.",
        ),
        "negated:N": (
            "The deformed normal points to the other side.",
            "Look at the order of the edges in the cross product: an undeformed triangle must give the identity.",
        ),
        "transposed": (
            "This is F transposed.",
            "dx = F dX: the vertices are columns, the gradients of the shape functions rows.",
        ),
        "transposed:dphi_dX": (
            "The gradients of the shape functions are used as columns.",
            "Row i of dphi_dX is the gradient of phi_i: which product takes column x_i times that row?",
        ),
    },
    "dn_dx": {
        "negated": (
            "Your derivative has the opposite sign: the edge, or its cross-product matrix, is turned round.",
            "Lift one vertex: the normal leans away from it.",
        ),
        "transposed": (
            "Rows and columns are exchanged.",
            "Column k says how n changes when component k of x_i grows.",
        ),
        "shifted:i": (
            "The edges are in the wrong order: this is the derivative by another vertex.",
            "The edge that counts lies opposite vertex i.",
        ),
    },
    "mass_block": {
        "scaled:2": ("", "Is the area doubled? `area` is that of the triangle, not of the parallelogram."),
        "scaled:1/2": ("", "The 1/2 of the kinetic energy does not belong into the mass."),
        "where i != j: zeros": (
            "The blocks off the diagonal are zero: the vertices are not coupled.",
            "Integrate phi_i phi_j for i != j, too: all nine blocks weigh as much as the triangle.",
        ),
    },
    "kinetic_energy": {
        "scaled:2": ("", "Where is the 1/2 in front of qdot^T M qdot?"),
        "scaled:1/2": ("", "The 1/2 in front of qdot^T M qdot is there once, not twice."),
    },
    "right_cauchy_green": {
        "transposed:F": (
            "This is the left Cauchy-Green tensor: the factors are in the other order.",
            "Turn the cloth after deforming it, F -> R F: your result must not change.",
        ),
    },
    "psi": {
        "swapped:mu,lam": (
            "mu and lam are exchanged.",
            "mu weighs the stretches one by one, lam their common change.",
        ),
        "doubled:lam": (
            "The lam term is twice too large.",
            "Look at the number in front of lam in the formula.",
        ),
        "halved:mu": (
            "The mu term is half of the right one.",
            "Look at the number in front of mu in the formula.",
        ),
        "squared:s": (
            "The stretches are squared before one is subtracted.",
            "The energy counts s - 1. With squares it is another material.",
        ),
        "missing:lam": ("The lam term is missing.", "The second term resists a change of area."),
        "missing:mu": ("The mu term is missing.", "The first term resists each stretch."),
    },
    "dpsi_ds": {
        "swapped:mu,lam": (
            "mu and lam are exchanged.",
            "mu weighs the stretches one by one, lam their common change.",
        ),
        "halved:mu": ("The 2 in the mu term is missing.", "Differentiate the square once more."),
        "halved:lam": (
            "The lam term is half of the right one.",
            "The square brings a factor of two: what becomes of lam/2?",
        ),
        "negated": (
            "This is minus the gradient.",
            "The gradient of psi points uphill; the sign of a force comes later.",
        ),
        "missing:lam": (
            "The lam term is missing.",
            "The square of the sum depends on both stretches: differentiate it, too.",
        ),
    },
    "d2psi_ds2": {
        "swapped:mu,lam": (
            "mu and lam are exchanged.",
            "mu weighs the stretches one by one, lam their common change.",
        ),
        "diagonal only": (
            "The matrix is diagonal: the coupling of the stretches is missing.",
            "Differentiate the first component of the gradient by the other stretch.",
        ),
        "halved:mu": (
            "The 2 at mu is missing.",
            "Differentiate the gradient: which factor does mu carry there?",
        ),
        "missing:lam": ("The lam term is missing.", "lam comes in on the diagonal and off it."),
    },
    "dpsi_dF": {
        "transposed": (
            "This is P transposed: U and V have changed places.",
            "P belongs to F: U turns in the deformed cloth and stands on the same side as in F.",
        ),
        "transposed:V": (
            "V is used where its transpose is asked, or the other way round.",
            "Compare with F = U diag(s) V^T.",
        ),
        "transposed:U": ("U is transposed.", "Compare with F = U diag(s) V^T."),
        "transposed:U,V": (
            "Both rotations are transposed.",
            "Columns of U and V are the principal directions, not rows.",
        ),
        "missing:V": (
            "V is missing.",
            "The result belongs to F, not to the principal directions: turn it back on both sides.",
        ),
        "missing:U": (
            "U is missing.",
            "The result belongs to F, not to the principal directions: turn it back on both sides.",
        ),
    },
    "nodal_force": {
        "negated": (
            "This is the gradient of the energy: the force has the opposite sign.",
            "The gradient points uphill, a force pulls downhill.",
        ),
        "missing:area": (
            "The area is missing.",
            "psi is energy per volume: how large is the volume of a triangle of cloth?",
        ),
        "missing:h": (
            "The thickness is missing.",
            "psi is energy per volume: how large is the volume of a triangle of cloth?",
        ),
        "missing:area,h": (
            "Area and thickness are missing.",
            "psi is energy per volume: how large is the volume of a triangle of cloth?",
        ),
        "transposed:P": ("P is transposed.", "P : (w g^T) = w^T P g. Which index of P meets the gradient?"),
        "normalised:grad_phi": (
            "",
            "The length of the gradient knows the size of the triangle: use it as it comes.",
        ),
    },
    "d2psi_dFij": {
        "missing:dU": (
            "The term with dU is missing.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "missing:dV": (
            "The term with dV is missing.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "missing:ds": (
            "The middle term is missing.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "missing:dU,dV": (
            "Only the middle term is there: the principal directions never turn.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "transposed:dV": (
            "dV is not transposed.",
            "The last factor of the stress is V transposed: so is its derivative.",
        ),
        "transposed:V": (
            "V is not transposed.",
            "The last factor of the stress is V transposed, in every term.",
        ),
        "missing:d2psi_ds2": (
            "ds stands in the middle as it is, without the Hessian of psi.",
            "How does psi_s change when s changes by ds? That is the chain rule.",
        ),
        "diagonal:d2psi_ds2": (
            "Only the diagonal of the Hessian of psi is used.",
            "A change of one stretch changes both stresses: multiply with the whole matrix.",
        ),
    },
    "eigensystem": {
        "permuted:1,0,2,3": (
            "Flip and twist are exchanged.",
            "Minus over minus is flip, plus over plus is twist; flip comes first.",
        ),
        "permuted:0,1,3,2": ("out_0 and out_1 are exchanged.", "out_i belongs to stretch i."),
        "clamped": (
            "Negative eigenvalues are replaced by zero.",
            "The projection is done later, and not by you: return the true eigenvalues.",
        ),
        "where s_0 = s_1: nan": (
            "Where the stretches meet, your result is zero divided by zero.",
            "Where the gap is tiny, take the limit of the quotient in place of the quotient.",
        ),
    },
    "sphere_contact": {
        "negated": (
            "The normal points into the sphere.",
            "The way out leads from the centre to the vertex: which minus which?",
        ),
        "missing:c": (
            "The normal points away from the origin, not from the centre c.",
            "Where is x, seen from the centre of the sphere?",
        ),
        "where x = c: nan": (
            "At the centre of the sphere your normal is zero divided by zero.",
            "Every way out is equally good there: the docstring says which one to take.",
        ),
        "where x = c": (
            "At the centre of the sphere your normal is not the one agreed on.",
            "The docstring says which way is out there.",
        ),
        "where x = c: zeros": (
            "At the centre of the sphere your normal is zero.",
            "The docstring says which way is out there.",
        ),
    },
    "filter_velocity": {
        "echo:v": (
            "The velocity comes back as it is.",
            "Where it goes into the obstacle, something must be taken away.",
        ),
        "negated:n": (
            "The normal is used as if it pointed into the obstacle.",
            "n points out of the obstacle: which sign of n^T v means going in?",
        ),
    },
}

#: The searches, in order: the plainest explanation wins.
WITHIN = (_transformed, _scaled, _known, _sized, _nan)
SEARCHES = (
    _transformed,
    _scaled,
    _known,
    _constant,
    _nan_somewhere,
    _sized,
    _changed,
    _digits,
    _somewhere,
    _partly,
    _factor,
)
