"""What properties are made of: inputs that belong together, and what must hold between what a function makes of them.

Most properties are *relations between runs*: a function is evaluated on inputs, and again on the same inputs turned,
moved, scaled or exchanged; the runs lie one after another in one batch. An error is measured against the size of the
terms an answer is a sum of, so that rounding stays near 1e-13, however a right answer is written; a mistake makes 1e-3
and more.

Inputs are drawn with `Generator.random` of a PCG64 and worked out with `+ - * /` and `sqrt` alone: every machine draws
the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging.parts import Arrays, Change, Given, Inputs, Outputs, Rng, Terms, Tested
from muslin.judging.vectors import apply, rotation
from muslin.tasks.comparing import natural_scale

#: What inputs are turned by, spun about, scaled by, deformed by: the same always, so that the judge knows.
Q = rotation(np.array([2.0, 1.0, -3.0, 5.0]))


OMEGA = np.array([0.5, -1.25, 0.75])


FACTOR = 1.75


STRAIN = np.array([[1.25, 0.5, -0.75], [-0.25, 0.875, 0.375], [0.625, -1.0, 1.5]])


def in_turn(*runs: Given) -> Arrays:
    """Several runs one after another, in one batch."""
    return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}


def split_runs(array: np.ndarray, runs: int) -> np.ndarray:
    """The batch of several runs apart again, (runs, b, ...)."""
    return array.reshape(runs, -1, *array.shape[1:])


def run_of(inputs: Given, k: int, runs: int) -> Arrays:
    """Inputs of run k."""
    return {name: split_runs(array, runs)[k] for name, array in inputs.items()}


def again(base: Inputs, *changes: Change) -> Inputs:
    """Inputs, and runs with some arguments changed."""

    def inputs(rng: Rng) -> Arrays:
        a = base(rng)
        return in_turn(a, *({**a, **change(rng, a)} for change in changes))

    return inputs


def summed(base: Inputs, *names: str) -> Inputs:
    """Three runs that differ in some arguments; those of the third are the sums of the others'."""

    def inputs(rng: Rng) -> Arrays:
        a, b = base(rng), base(rng)
        return in_turn(
            a,
            {**a, **{name: b[name] for name in names}},
            {**a, **{name: a[name] + b[name] for name in names}},
        )

    return inputs


def times(*names: str, factor: float = FACTOR) -> Change:
    """Change: some arguments times a factor."""
    return lambda rng, a: {name: factor * a[name] for name in names}


def turned(*names: str) -> Change:
    """Change: some vectors turned by Q."""
    return lambda rng, a: {name: apply(Q, a[name]) for name in names}


def norms(array: Any) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    flat = np.asarray(array, dtype=np.float64).reshape(len(array), -1)
    return np.sqrt(np.sum(flat * flat, axis=1))


def relative(difference: np.ndarray, scale: Any) -> np.ndarray:
    """Size of a difference relative to a scale (one number, or one per sample)."""
    size = norms(difference)
    return np.where(size > 0, size / np.where(scale > 0, scale, np.finfo(float).tiny), 0.0)


def follows(terms: Terms | None, expected: Callable[..., np.ndarray], runs: int = 2) -> Tested:
    """The last run gives what the results of the earlier ones say it must."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        *given, last = split_runs(out[0], runs)
        right = expected(*given)
        scale = sum(natural_scale(terms, right, run_of(a, k, runs)) for k in range(runs))
        return relative(last - right, scale)

    return error


def vanishes(
    terms: Terms | None,
    rest: Callable[..., np.ndarray],
    scale: Callable[[Given], Any] = lambda a: 1.0,
) -> Tested:
    """`rest(inputs, *outputs)` is zero, measured against the natural scale of the result times `scale`."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        return relative(rest(a, *out), natural_scale(terms, out[0], a) * scale(a))

    return error


def sweep(
    slope: np.ndarray, f: Callable[[float], np.ndarray], scale: Any, steps: tuple[float, ...]
) -> np.ndarray:
    """Error of a derivative: the least along a Taylor sweep, step by step down to where rounding ends it.

    Differences are central, of sixth order. A wrong slope is wrong at every step.
    """
    errors = []
    for h in steps:
        d1, d2, d3 = (f(k * h) - f(-k * h) for k in (1, 2, 3))
        errors.append(relative(slope - (45 * d1 - 9 * d2 + d3) / (60 * h), scale))
    return np.min(errors, axis=0)


def between(rng: Rng, low: float, high: float, *shape: int) -> np.ndarray:
    """Numbers between two others."""
    return low + (high - low) * rng.random(shape)


def binades(rng: Rng, low: int, high: int, count: int) -> np.ndarray:
    """Numbers between 2^low and 2^high, spread over the powers of two."""
    exponent = np.floor(between(rng, low, high, count)).astype(np.int32)
    return np.ldexp(1 + rng.random(count), exponent)


def integers(rng: Rng, low: int, high: int, count: int) -> np.ndarray:
    """Whole numbers from low to high - 1, as float64."""
    return np.floor(between(rng, low, high, count))


def vectors(rng: Rng, count: int, size: float = 1.0) -> np.ndarray:
    """Vectors with entries between -size and size, (b, 3)."""
    return between(rng, -size, size, count, 3)


def matrices(rng: Rng, count: int) -> np.ndarray:
    """Matrices with entries between -1 and 1, (b, 3, 3)."""
    return between(rng, -1, 1, count, 3, 3)


def rotations(rng: Rng, count: int) -> np.ndarray:
    """Rotations, (b, 3, 3)."""
    return rotation(between(rng, -1, 1, count, 4))


def directions(rng: Rng, count: int) -> np.ndarray:
    """Unit vectors, (b, 3)."""
    return rotations(rng, count)[:, :, 0]
