"""Backward Euler by a student's own Newton's method.

Their function minimises over the positions y of the free vertices, as a vector: the objective is the step's, kinetic
and potential energy [J], its gradient is a force [N], its Hessian M / dt^2 + K [N/m].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
import scipy.sparse.linalg as sla

from muslin.base.errors import SimulationError, StudentCodeError
from muslin.simulation import newton
from muslin.simulation.model import SPRING
from muslin.tasks import usable
from muslin.tasks.plain import returned

#: Tasks behind each part.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType({"newton": ("newtons_method",), "spring": SPRING})

#: Steps that a student's function may take in one time step.
MOST_STEPS = 100

#: Share of its first scale below which a gradient counts as zero for a student's function: from there on rounding of
#: the objective may hide the way down from a line search, and the framework's, which allows for it, goes the rest.
HIDDEN, FOUND = 1e-6, 1e-4


class Step(newton.Problem, Protocol):
    """A problem in the velocities v of a time step."""

    dt: float
    free: np.ndarray

    def place(self, v: np.ndarray) -> np.ndarray:
        """Where velocities lead, (k,) [m]."""
        ...

    def matrix(self) -> Any:
        """What `assemble` wrote down, as a sparse matrix."""
        ...


class _Positions:
    """The same problem in the positions of what is free."""

    def __init__(self, step: Step, v: np.ndarray):
        self.step, self._v = step, v.copy()
        self._here = step.place(v)[step.free]
        self._v0, self._y0 = v[step.free], self._here
        self._scale = np.inf
        self._value: float | None = None
        self._assembled: Hessian | None = None

    def go(self, y: np.ndarray) -> float:
        """Take positions, and return the objective there; what was computed at them is kept."""
        y = np.asarray(y, dtype=np.float64)
        if y.shape != self._y0.shape:
            raise StudentCodeError(
                f"newtons_method asks for the objective at an array of shape {y.shape}; x has {self._y0.shape}."
            )
        if self._value is not None and np.array_equal(y, self._here):
            return self._value
        self._here, self._assembled = y.copy(), None
        self._v[self.step.free] = self._v0 + (y - self._y0) / self.step.dt
        try:
            self._value = float(self.step.value(self._v.copy()))
        except SimulationError:  # a cell collapsed
            self._value = np.inf
        return self._value

    def _at(self, y: np.ndarray) -> None:
        if not np.array_equal(y, self._here):
            self.go(y)

    def gradient(self, y: np.ndarray) -> np.ndarray:
        """[N]"""
        self._at(y)
        r, scale = self.step.gradient()
        self._scale = self.step.size(r) / scale
        return r[self.step.free] / self.step.dt

    def hessian(self, y: np.ndarray) -> Hessian:
        """[N/m]; near the end the exact one."""
        self._at(y)
        return Hessian(self, y)

    def assembled(self, H: Hessian, exact: bool) -> bool:
        """Write the Hessian down, unless it is there; returns whether it is the exact one."""
        self._at(H.y)
        self._assembled = H
        return self.step.assemble(exact)

    def solve(self, H: Hessian, b: np.ndarray) -> np.ndarray:
        """The d with H d = b."""
        if not isinstance(H, Hessian):
            raise StudentCodeError(
                "newtons_method gives solve something else than what hessian(x) returned.",
                "Give it solve(H, b).",
            )
        b = np.asarray(b, dtype=np.float64)
        exact = self.assembled(H, self._scale <= newton.NEAR)
        d = self._solved(b)
        if exact and not b @ d > 0:
            self.assembled(H, False)
            d = self._solved(b)
        return d

    def _solved(self, b: np.ndarray) -> np.ndarray:
        whole = np.zeros(len(self._v))
        whole[self.step.free] = b
        return self.step.dt**2 * self.step.solve(whole)[self.step.free]


class Hessian(sla.LinearOperator):
    """A Hessian as newtons_method gets it: `solve` knows what to do with it, and `H @ d` works, too."""

    def __init__(self, of: _Positions, y: np.ndarray):
        super().__init__(np.float64, (len(y), len(y)))
        self.y, self._of = np.array(y), of
        self._matrix: Any = None

    def _matvec(self, d: np.ndarray) -> np.ndarray:
        if self._matrix is None:
            self._of.assembled(self, False)
            free = np.flatnonzero(self._of.step.free)
            self._matrix = self._of.step.matrix()[free][:, free] / self._of.step.dt**2
        return np.asarray(self._matrix @ d)


def minimise(function: Callable[..., Any], step: Step, v: np.ndarray, tolerance: float) -> np.ndarray:
    """What `newton.minimise` finds, by a student's function.

    Raises
    ------
    StudentCodeError
        If it raises an exception, or returns something else than positions.
    """
    usable(function)
    v, _ = newton.begun(step, v)
    _, scale = step.gradient()
    least = max(tolerance, HIDDEN) * scale
    problem = _Positions(step, v)
    start = step.place(v)[step.free]
    given = {
        "x": start.copy(), "objective": problem.go, "gradient": problem.gradient, "hessian": problem.hessian,
        "solve": problem.solve, "tolerance": least / step.dt, "most_steps": MOST_STEPS,
    }  # fmt: skip
    found = returned(function, function.task, given)  # type: ignore[attr-defined]
    try:
        y = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        y = np.empty(0)
    if y.shape != start.shape or not np.isfinite(y).all():
        what = (
            "numbers that are not finite" if y.shape == start.shape else "something else than an array like x"
        )
        raise StudentCodeError(
            f"newtons_method returns {what}.", "Return x. Try: muslin check newtons_method"
        )
    v = v.copy()
    v[step.free] += (y - start) / step.dt
    step.value(v)
    if step.size(step.gradient()[0]) <= FOUND * scale:
        return newton.minimise(step, v, tolerance)
    return v
