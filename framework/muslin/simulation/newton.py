"""Newton's method with a backtracking line search, on a function with a positive semi-definite Hessian."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from muslin.base import runtime
from muslin.base.errors import SimulationError

#: Iterations at most, before a step counts as failed. A few do, but where a compressed sheet must first
#: find how to buckle (it has no bending stiffness to choose for it) there can be hundreds.
ITERATIONS = 2000

#: Share of the slope's promise that a step must keep (Armijo), and the shortest part of a step that is tried.
KEPT, SHORTEST = 1e-4, 1e-10

#: Share of its largest term below which the gradient is so small that the minimum is near.
NEAR = 0.1

#: Where kernels compute in single precision, a function and its gradient are known no better than to this share.
SINGLE = 1e-4

#: Rounding of the function itself, relative to its size: of a sum, and of what cancels near the minimum.
ROUNDING, CANCELLED = 1e-14, 1e-11


class Problem(Protocol):
    """What is minimised, a function phi of a vector (k,).

    All but `value` speak of the last place that `value` was asked for.
    """

    def value(self, v: np.ndarray) -> float:
        """phi(v); not finite, or a `SimulationError`, where there is no such value."""
        ...

    def shorter(self, v: np.ndarray) -> np.ndarray:
        """Half the way from v to where things are now: to where phi is finite, if it is not at v."""
        ...

    def gradient(self) -> tuple[np.ndarray, float]:
        """The gradient (k,), and the size of the largest of the terms that cancel in it."""
        ...

    def assemble(self, exact: bool) -> bool:
        """Write down the Hessian: `rounding` and `solve` are about it.

        Away from the minimum one that was made positive semi-definite is a safe guide; near it, where it is so by
        itself, the `exact` one is a fast one. Returns whether it is.
        """
        ...

    def rounding(self) -> np.ndarray:
        """The gradient's rounding error, (k,)."""
        ...

    def solve(self, r: np.ndarray) -> np.ndarray:
        """(k,) Hessian^-1 r."""
        ...

    def step(self, r: np.ndarray) -> np.ndarray:
        """(k,) Where to go for the gradient -r to vanish: Hessian^-1 r, or better."""
        ...

    def size(self, r: np.ndarray) -> float:
        """Norm of a gradient, or of its error, over what may vary."""
        ...

    def reach(self, v: np.ndarray, step: np.ndarray) -> float:
        """Largest share, at most 1, of a step from v that may be tried."""
        ...

    def is_nothing(self, step: np.ndarray) -> bool:
        """Whether a step would move things by no more than rounding does."""
        ...


def minimise(
    problem: Problem,
    v: np.ndarray,
    tolerance: float,
    enough: Callable[[np.ndarray], bool] | None = None,
    iterations: int = ITERATIONS,
) -> np.ndarray:
    """Where the gradient is as good as zero.

    Parameters
    ----------
    problem : Problem
    v : (k,) array
        Where to begin.
    tolerance : float
        The gradient counts as zero below this share of its largest term (in single precision no less than `SINGLE`),
        or below its own rounding error.
    enough : callable, optional
        Asked after each iteration whether v is good enough already; it must leave the problem at v.
    iterations : int
        At most.

    Raises
    ------
    SimulationError
        If that is not found.
    """
    tolerance = max(tolerance, SINGLE) if runtime.single() else tolerance
    v, phi = begun(problem, v)
    whole = False
    for _ in range(iterations):
        r, scale = problem.gradient()
        size = problem.size(r)
        if not np.isfinite(size):
            raise SimulationError("Newton's method met a NaN.", "Reduce dt, or look at your functions.")
        if size <= tolerance * scale:
            return v
        exact = problem.assemble(whole and size <= NEAR * scale)
        noise = problem.rounding()
        step = problem.step(-r)
        if exact and not float(r @ step) < 0:
            problem.assemble(False)
            step = problem.step(-r)
        if size <= problem.size(noise) or problem.is_nothing(step):
            return v
        v, phi, whole = _search(
            problem, v, phi, step, float(r @ step), float(noise @ np.abs(step)), size / scale
        )
        if enough and enough(v):
            return v
    raise SimulationError(
        f"Newton's method did not converge in {iterations} iterations: "
        f"the residual is {size / scale:.1e} of its scale.",
        _advice("Reduce dt."),
    )


def begun(problem: Problem, v: np.ndarray) -> tuple[np.ndarray, float]:
    """Where to begin, and phi there: v, or nearer to where things are where phi(v) is infinite."""
    phi, length = problem.value(v), 1.0
    while phi == np.inf and length > SHORTEST:
        length /= 2
        v = problem.shorter(v)
        phi = problem.value(v)
    return v, phi


def _search(
    problem: Problem, v: np.ndarray, phi: float, step: np.ndarray, slope: float, noise: float, left: float
) -> tuple[np.ndarray, float, bool]:
    """The first of v + step, v + step / 2, ... that goes down far enough, phi there, and whether it is the first.

    Where only a share of the step may be tried, it is the first of v + share * step, ...
    """
    allowed = noise + ROUNDING * abs(phi)
    cancelled = SINGLE if runtime.single() else CANCELLED
    if -slope < cancelled * abs(phi):  # so near the minimum that the energy's own rounding hides the way down
        allowed += cancelled * abs(phi)
    length = problem.reach(v, step)
    trial = _attempt(problem, v + length * step)
    while not trial <= phi + KEPT * length * slope + allowed:
        length /= 2
        if length < SHORTEST:
            raise SimulationError(
                f"Newton's line search found no descent (residual {left:.1e} of its scale).",
                _advice("Reduce dt, or check force and Hessian against each other."),
            )
        trial = _attempt(problem, v + length * step)
    return v + length * step, trial, length == 1.0


def _advice(usual: str) -> str:
    return "Stiff sheets need double precision: leave --precision out." if runtime.single() else usual


def _attempt(problem: Problem, v: np.ndarray) -> float:
    try:
        return problem.value(v)
    except SimulationError:  # a step so long that a cell collapsed: too long
        return np.inf
