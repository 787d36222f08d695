"""What a step of backward Euler minimises: the incremental potential, as a function of the velocities."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.simulation.model import Model, State
from muslin.simulation.touching import Touching
from muslin.solve.superlu import Indefinite

#: How often the contacts at the end of a step of Newton's method are looked for at most.
ROUNDS = 20


class IncrementalPotential:
    """What a step of dt from a state minimises.

    Phi(v) = 1/2 (v - v_n)^T M (v - v_n) + V(q + dt v), whose gradient is the backward Euler equation: momenta and
    impulses. Its rounding error is that of the forces, 32 eps |K| |x|. Damping adds dt/2 v^T C v, with C = beta K at q.
    Where a barrier keeps the body from crossing itself, its energy is in V, and friction with itself adds dt D(v).

    Parameters
    ----------
    touching : Touching, optional
        Contacts that are part of the step.
    whole : bool
        Whether the minimum itself is wanted, and not only a place with less energy: near it the exact Hessian is the
        guide (the projected one is so much harder where a sheet buckles that thousands of steps would be needed), and
        the contacts are those that press at the end of a step of Newton's method. (A solid's Hessian is exact there
        anyway, and it does not buckle.)
    """

    def __init__(
        self, model: Model, state: State, dt: float, touching: Touching | None = None, whole: bool = False
    ):
        self.model, self.state, self.dt, self.touching = model, state, dt, touching
        self._whole = whole
        self._ahead = (whole and not model.body.exact_near_rest) or model.barrier is not None
        self._exact = self._ahead or model.body.exact_near_rest
        self.air = model.air(state, dt)
        self.damper = model.damper(state.x)
        self._damper = model.damper_here() if self.damper is not None else None
        self.free = np.repeat(~model.system.pinned, 3)
        self.barrier = model.barrier
        self.rubbing = model.barrier.rubbing(state.x) if model.barrier else None
        self._v, self._x = state.v.ravel(), state.x
        self._project, self._momentum = model.project, np.zeros_like(self._v)

    def start(self) -> np.ndarray:
        """The velocity before the step, with that of the pinned vertices in it, (3n,)."""
        start, pinned = self.state.v.copy(), self.model.system.pinned
        known = self.model.known_velocity(self.state.time, self.dt)
        start[pinned] = 0.0 if known is None else known[pinned]
        return start.ravel()

    def base(self) -> np.ndarray:
        """A velocity at which everything moves on as one, (3n,): on that way nothing is met."""
        if self.free.all():
            momentum = (self.model.body.mass @ self.state.v.ravel()).reshape(-1, 3).sum(axis=0)
            return np.tile(momentum / self.model.lumped.sum(), len(self._x))
        return np.zeros_like(self._v)

    def shorter(self, v: np.ndarray) -> np.ndarray:
        """Half this velocity, but for the pinned vertices."""
        half = np.where(self.free, v / 2, v)
        return half if self.barrier is None else v + self.reach(v, half - v) * (half - v)

    def reach(self, v: np.ndarray, step: np.ndarray) -> float:
        """Share of a step from v on which the body does not meet itself, at most 1."""
        if self.barrier is None:
            return 1.0
        here, there = self.place(v), self.place(v + step)
        return self.barrier.reach(here.reshape(-1, 3), there.reshape(-1, 3))

    def value(self, v: np.ndarray) -> float:
        """Phi(v) [J]."""
        model, state = self.model, self.state
        self._v, self._x = v, state.x + self.dt * v.reshape(-1, 3)
        model.body.update(self._x)
        dv = v - state.v.ravel()
        self._momentum = model.body.mass @ dv
        kinetic = 0.5 * float(dv @ self._momentum)
        phi = kinetic + model.body.energy_here() + model.potential(self._x)
        if self.air:
            phi += self.air.value(v.reshape(-1, 3))
        if self.damper is not None:
            phi += self.dt / 2 * float(v @ (self.damper @ v))
        if self.barrier:
            phi += self.barrier.energy(self._x)
        if self.rubbing:
            phi += self.dt * self.rubbing.value(v.reshape(-1, 3))
        return phi + self.touching.value(v) if self.touching else phi

    def gradient(self) -> tuple[np.ndarray, float]:
        """dPhi/dv, (3n,) [N s]."""
        body = self.model.body
        momentum = self._momentum
        elastic = self.dt * body.gradient_here().ravel()
        external = self.dt * self.model.conservative_force(self._x).ravel()
        if self.air:
            external += self.air.impulse(self._v.reshape(-1, 3)).ravel()
        terms = [momentum, elastic, external, body.mass @ self._v]
        r = momentum + elastic - external
        if self.damper is not None:
            terms.append(self.dt * (self.damper @ self._v))
            r = r + terms[-1]
        if self.touching:
            terms.append(self.touching.gradient(self._v))
            r = r + terms[-1]
        if self.barrier:
            terms.append(self.dt * self.barrier.gradient(self._x).ravel())
            r = r + terms[-1]
        if self.rubbing:
            terms.append(self.dt * self.rubbing.gradient(self._v.reshape(-1, 3)).ravel())
            r = r + terms[-1]
        return r, max(self.size(term) for term in terms)

    def assemble(self, exact: bool) -> bool:
        """Write M + dt^2 K down, with the exact K only where the body wants it."""
        exact = exact and self._exact
        self._project = self.model.project and not exact
        self._write(self.touching.pressing(self._v) if self.touching else None)
        if self.barrier:
            self._repulsion = self.barrier.hessian(self._x, self._project)
            more = self.dt**2 * self._repulsion
            if self.rubbing:
                more = more + self.dt * self.rubbing.hessian(self._v.reshape(-1, 3), self._project)
            self.model.system.more = more
        return not self._project

    def _write(self, presses: np.ndarray | None) -> None:
        """Write down all that has its place in the system, with the contacts that press."""
        self.model.assemble(self.dt, self._project, self._damper)
        self.model.add(self.touching, presses, self.air)

    def rounding(self) -> np.ndarray:
        """Error of the impulses dt f that rounding alone makes, (3n,) [N s]."""
        body, spring = self.model.body, self.model.spring
        more = (spring.vertex, spring.stiffness) if spring else None
        forces = body.summands_here(self._x, self._project, more)
        if self.barrier:
            forces = forces + np.abs(self._repulsion) @ np.abs(self._x).ravel()
        noise = 32 * np.finfo(float).eps * self.dt * forces
        if self.touching and (self._whole or self._ahead):
            noise += self.touching.rounding(self._v)
        return noise

    def solve(self, r: np.ndarray) -> np.ndarray:
        """(M + dt^2 K)^-1 r."""
        return self.model.system.solve(r.reshape(-1, 3)).ravel()

    def step(self, r: np.ndarray) -> np.ndarray:
        """(M + dt^2 K)^-1 r, for a `whole` step with the contacts that press at the end of Newton's.

        Newton's own step knows of those at its beginning alone. What it drives into a collider holds it up there: in a
        pile it would be halved a hundred times.
        """
        if self._project or not self._ahead:
            return self._aimed(r)
        self.model.system.require_definite(True)
        try:
            return self._aimed(r)
        except Indefinite:  # not near enough yet: going on with it would lead to no minimum
            self.assemble(False)
            return self._aimed(r)
        finally:
            self.model.system.require_definite(False)

    def _aimed(self, r: np.ndarray) -> np.ndarray:
        step, touching = self.solve(r), self.touching
        if touching is None or not self._ahead:
            return step
        first, now = step, touching.pressing(self._v)
        presses = now
        for _ in range(ROUNDS):
            pressing = touching.pressing(self._v + step)
            if np.array_equal(pressing, presses):
                return step
            presses = pressing
            self._write(presses)
            step = self.solve(r + touching.push(self._v, now) - touching.push(self._v, presses))
        return first

    def size(self, r: np.ndarray) -> float:
        """Norm over the free vertices."""
        return float(np.linalg.norm(r[self.free]))

    def place(self, v: np.ndarray) -> np.ndarray:
        """Positions that velocities lead to, (3n,) [m]."""
        return self.state.x.ravel() + self.dt * v

    def matrix(self) -> Any:
        """M + dt^2 K as it was assembled."""
        body = self.model.body
        matrix = body.pattern.matrix(body.mass_data + self.dt**2 * body.stiffness_here(self._project))
        return matrix if self.damper is None else matrix + self.dt * self.damper

    def is_nothing(self, step: np.ndarray) -> bool:
        """Whether dt step is no more than rounding of the positions."""
        moved, place = self.dt * float(np.abs(step).max()), float(np.abs(self.state.x).max())
        return moved <= 4 * float(np.finfo(float).eps) * place
