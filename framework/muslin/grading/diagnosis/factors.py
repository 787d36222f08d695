"""The right answer times a factor: a number, or powers of the sizes of the inputs."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from muslin.grading.diagnosis.question import Diagnosis, Question, about
from muslin.judging.arrays import lengths as norm


def _number(value: float) -> str | None:
    """A factor as people write it: 2, 1/3, -1; None if it is no simple fraction."""
    fraction = Fraction(value).limit_denominator(36)
    simple = abs(fraction.numerator) <= 36 and abs(float(fraction) - value) <= 1e-6 * abs(value)
    return str(fraction) if simple and fraction else None


def scaled(question: Question) -> Diagnosis | None:
    """One number times the right answer."""
    shown = _common(question.factor())
    return about(question, f"scaled:{shown}", shown) if shown else None


def change_scaled(question: Question) -> Diagnosis | None:
    """What is added to an argument, or taken away from it, comes with a wrong factor."""
    for array in question.inputs.values():
        if question.shape and array.shape == question.got.shape:
            change = replace(question, got=question.got - array, right=question.right - array)
            if shown := _common(change.factor()):
                return about(question, f"change scaled:{shown}", shown)
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


def sized(question: Question) -> Diagnosis | None:
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
    told = about(question, f"{fit.head}:{','.join(fit.names)}{also}", " and ".join(fit.names), words)
    return (
        replace(told, mistake=f"{told.mistake} What remains is a factor of {fit.number}.") if also else told
    )


def factor_of_each_case(question: Question) -> Diagnosis | None:
    """The direction is right: the last thing to say of a vector or a matrix."""
    factor = question.factor() if question.shape else None
    return about(question, "factor") if factor is not None and question.wrong.sum() > 5 else None
