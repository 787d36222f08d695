"""Time integration: an integrator moves the `State` of a `Model` on by dt.

Linearly implicit Euler is one Newton step of backward Euler, from the current velocity::

    (M + dt^2 K) v+ = M v + dt f(q),    q+ = q + dt v+,    K = d2V/dq2 (projected)

Both detect contacts at q and filter v+ at them (S10). With `contact="solve"` they know of them when they solve:
(M + dt^2 K) v+ = M v + dt f(q) + sum_i lambda_i n_i, with impulses lambda_i that keep vertices in contact from moving
inwards (see `touching`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError, SimulationError, choices
from muslin.physics.colliders import Contacts, respond
from muslin.physics.selfcontact import SelfContact
from muslin.simulation import by_student, newton, second_order
from muslin.simulation.model import NOBODY, Model, Spring, State
from muslin.simulation.touching import Touching

__all__ = [
    "INTEGRATORS",
    "Exploded",
    "Model",
    "Spring",
    "State",
    "backward_euler",
    "integrator",
    "linearly_implicit_euler",
    "steps",
]


def linearly_implicit_euler(model: Model, state: State, dt: float) -> State:
    """One step of linearly implicit Euler.  The body must have been updated to `state.x`."""
    contacts = model.contacts(state, dt)
    model.prepare()
    force = model.conservative_force(state.x)
    if model.drag:
        force += model.wind_force(state.x, state.v)
    b = model.impulse(state, force, dt)
    model.assemble(dt)
    known = model.known_velocity(state.time, dt)
    coupling = model.coupling(known, dt)
    touching = [contact for contact in contacts if len(contact.vertices)]
    if model.contact == "solve" and touching:
        v, active = _solve_touching(model, state, b, known, coupling, touching)
    else:
        v, active = model.system.solve(b, known, coupling, guess=state.v), NOBODY
    return _finish(model, state, v, contacts, dt, active)


#: How much harder a contact is than the hardest spring of the cloth.
CONTACT_STIFFNESS = 1e6


def _solve_touching(
    model: Model,
    state: State,
    b: np.ndarray,
    known: np.ndarray | None,
    coupling: np.ndarray | None,
    contacts: list[Contacts],
) -> tuple[np.ndarray, np.ndarray]:
    """Solve the system just assembled, with stiff springs along the normals of contacts that press.

    Which do is corrected from step to step instead of in every step again and again: those that were active before, and
    those that move inwards. One that would rather leave stays active in this step, and is let go in the next.

    Returns
    -------
    v : (n, 3) array
    active : int array
        Vertices that press now.
    """
    vertices = np.concatenate([contact.vertices for contact in contacts])
    n = np.concatenate([contact.normals for contact in contacts])
    least = np.einsum("ij,ij->i", n, np.concatenate([contact.velocities for contact in contacts]))
    presses = np.isin(vertices, state.active) | (np.einsum("ij,ij->i", n, state.v[vertices]) < least)
    stiffness = CONTACT_STIFFNESS * float(np.abs(model.system.data).max())
    along = n[presses]
    blocks = np.zeros((len(b), 3, 3))
    np.add.at(blocks, vertices[presses], stiffness * along[:, :, None] * along[:, None, :])
    pushed = b.copy()
    np.add.at(pushed, vertices[presses], stiffness * least[presses, None] * along)
    active = np.unique(vertices[presses])
    model.add_to_diagonal(active, blocks[active])
    v = model.system.solve(pushed, known, coupling, guess=state.v)
    return v, vertices[np.einsum("ij,ij->i", n, v[vertices]) < least]


def backward_euler(model: Model, state: State, dt: float) -> State:
    """One step of backward Euler, by Newton's method with a backtracking line search.

    It ends as `muslin.simulation.newton.minimise` says, with `model.tolerance`. Wind is taken at the start of the step.

    Raises
    ------
    SimulationError
        If Newton does not converge.
    """
    contacts = model.contacts(state, dt)
    touching = [contact for contact in contacts if len(contact.vertices)]
    step = _BackwardEuler(model, state, dt, Touching.of(model, touching, dt))
    if functions := model.body.roles.calling(by_student.NEEDS["newton"]):
        v = by_student.minimise(functions.newtons_method, step, step.start(), model.tolerance)
    else:
        v = newton.minimise(step, step.start(), model.tolerance)
    return _finish(model, state, v.reshape(-1, 3), contacts, dt)


class _BackwardEuler:
    """What a step of backward Euler from a state minimises.

    Phi(v) = 1/2 (v - v_n)^T M (v - v_n) + V(q + dt v), whose gradient is the backward Euler equation: momenta and
    impulses. Its rounding error is that of the forces, 32 eps |K| |x|. Damping adds dt/2 v^T C v, with C = beta K at q.
    """

    def __init__(self, model: Model, state: State, dt: float, touching: Touching | None = None):
        self.model, self.state, self.dt, self.touching = model, state, dt, touching
        self.air = model.wind_force(state.x, state.v)
        self.damper = model.damper(state.x)
        self.free = np.repeat(~model.system.pinned, 3)
        self._v, self._x = state.v.ravel(), state.x
        self._project = model.project

    def start(self) -> np.ndarray:
        """The velocity before the step, with that of the pinned vertices in it, (3n,)."""
        start, pinned = self.state.v.copy(), self.model.system.pinned
        known = self.model.known_velocity(self.state.time, self.dt)
        start[pinned] = 0.0 if known is None else known[pinned]
        return start.ravel()

    def shorter(self, v: np.ndarray) -> np.ndarray:
        """Half this velocity, but for the pinned vertices."""
        return np.where(self.free, v / 2, v)

    def value(self, v: np.ndarray) -> float:
        """Phi(v) [J]."""
        model, state = self.model, self.state
        self._v, self._x = v, state.x + self.dt * v.reshape(-1, 3)
        model.body.update(self._x)
        dv = v - state.v.ravel()
        work = float(np.sum(self.air * (self._x - state.x)))
        kinetic = 0.5 * float(dv @ (model.body.mass @ dv))
        phi = kinetic + model.body.energy_here() + model.potential(self._x) - work
        if self.damper is not None:
            phi += self.dt / 2 * float(v @ (self.damper @ v))
        return phi + self.touching.value(v) if self.touching else phi

    def gradient(self) -> tuple[np.ndarray, float]:
        """dPhi/dv, (3n,) [N s]."""
        body = self.model.body
        momentum = body.mass @ (self._v - self.state.v.ravel())
        elastic = self.dt * body.gradient_here().ravel()
        external = self.dt * (self.model.conservative_force(self._x) + self.air).ravel()
        terms = [momentum, elastic, external, body.mass @ self._v]
        r = momentum + elastic - external
        if self.damper is not None:
            terms.append(self.dt * (self.damper @ self._v))
            r = r + terms[-1]
        if self.touching:
            terms.append(self.touching.gradient(self._v))
            r = r + terms[-1]
        return r, max(self.size(term) for term in terms)

    def assemble(self, exact: bool) -> bool:
        """Write M + dt^2 K down, with the exact K only where the body wants it."""
        self._project = self.model.project and not (exact and self.model.body.exact_near_rest)
        self.model.assemble(self.dt, self._project)
        if self.touching:
            self.model.add_to_diagonal(*self.touching.blocks(self._v))
        return not self._project

    def rounding(self) -> np.ndarray:
        """Error of the impulses dt f that rounding alone makes, (3n,) [N s]."""
        body, spring = self.model.body, self.model.spring
        K = body.stiffness_here(self._project)
        if spring:
            K[body.pattern.diagonal[spring.vertex]] += spring.stiffness
        impulses = self.dt * np.abs(body.pattern.matrix(K)) @ np.abs(self._x).ravel()
        return 32 * np.finfo(float).eps * impulses

    def solve(self, r: np.ndarray) -> np.ndarray:
        """(M + dt^2 K)^-1 r."""
        return self.model.system.solve(r.reshape(-1, 3)).ravel()

    def size(self, r: np.ndarray) -> float:
        """Norm over the free vertices."""
        return float(np.linalg.norm(r[self.free]))

    def place(self, v: np.ndarray) -> np.ndarray:
        """Positions that velocities lead to, (3n,) [m]."""
        return self.state.x.ravel() + self.dt * v

    def matrix(self) -> Any:
        """M + dt^2 K as it was assembled."""
        body = self.model.body
        scale = self.dt * (self.dt + self.model.damping) if self.damper is not None else self.dt**2
        return body.pattern.matrix(body.mass_data + scale * body.stiffness_here(self._project))

    def is_nothing(self, step: np.ndarray) -> bool:
        """Whether dt step is no more than rounding of the positions."""
        moved, place = self.dt * float(np.abs(step).max()), float(np.abs(self.state.x).max())
        return moved <= 4 * float(np.finfo(float).eps) * place


def _finish(
    model: Model,
    state: State,
    v: np.ndarray,
    contacts: list[Contacts],
    dt: float,
    active: np.ndarray = NOBODY,
) -> State:
    v = respond(v, contacts, model.filter)
    if model.limit and (limited := model.limit(state.x, v, dt)) is not v:
        v = respond(limited, contacts, model.filter)
    return State(state.x + dt * v, v, state.time + dt, contacts, active)


INTEGRATORS: dict[str, Callable[[Model, State, float], State]] = {
    "linearly-implicit": linearly_implicit_euler,
    "backward-euler": backward_euler,
    "midpoint": second_order.implicit_midpoint,
    "bdf2": second_order.bdf2,
    "symplectic-euler": second_order.symplectic_euler,
}


def integrator(name: str) -> Callable[[Model, State, float], State]:
    """Integrator by name.

    Raises
    ------
    MuslinError
        If there is none of that name.
    """
    name = name.replace("_", "-")
    if name not in INTEGRATORS:
        raise MuslinError(f"There is no integrator {name!r}.", choices(name, INTEGRATORS))
    return INTEGRATORS[name]


def by_integrator(model: Model, name: str) -> frozenset[str]:
    """Tasks whose functions an integrator itself calls, and the drag spring's."""
    parts = ["newton"] if integrator(name) is backward_euler else []
    parts += ["spring"] if model.spring is not None else []
    return frozenset().union(*(model.body.roles.called(by_student.NEEDS[part]) for part in parts))


#: Positions beyond this [m] mean that a body has exploded.
EXPLODED = 1e8


class Exploded(SimulationError):
    """A step after which positions are no longer numbers, or absurdly large; `how` says which."""

    def __init__(self, how: str):
        self.how = how
        super().__init__(
            f"The cloth exploded: {how}.",
            "Often the sign of a force or a wrong Hessian (muslin check), or too large a dt.",
        )


def steps(model: Model, state: State, dt: float, name: str, count: int | None = None) -> Iterator[State]:
    """A state and then those after 1, 2, ... steps; the body has been updated to each when it is given.

    What belongs to the model alone (its spring, its colliders) may be exchanged between two of them.

    Parameters
    ----------
    model : Model
    state : State
        Where to begin.
    dt : float
        [s]
    name : str
        Of an integrator.
    count : int, optional
        Number of steps; default without end.

    Raises
    ------
    MuslinError
        If there is no such integrator.
    Exploded
        Instead of a state that makes no sense.
    """
    advance = integrator(name)
    model.body.update(state.x)
    yield state
    for step in itertools.count(1) if count is None else range(1, count + 1):
        if model.pull is not None:
            model.spring = model.pull(state.time)
        following = advance(model, state, dt)
        _require_sound(following)
        if model.self_contact is not None:
            _uncross(model.self_contact, state, following, dt)
        model.body.update(following.x)
        state = following
        if step != count:
            model.prepare()  # the energies that somebody may ask for between, and what the next step needs
        yield state


def _uncross(contact: SelfContact, state: State, following: State, dt: float) -> None:
    """End a step where the body does not cross itself; the velocity is that of the way really gone."""
    reached, apart = contact.reached(state.x, following.x)
    if reached is not following.x:
        following.v += (reached - apart - following.x) / dt
        following.x = reached


def _require_sound(state: State) -> None:
    if not (np.abs(state.x) < EXPLODED).all() or not np.isfinite(state.v).all():
        far = float(np.nan_to_num(np.abs(state.x), nan=np.inf).max())
        raise Exploded(
            f"it is {far:.0e} m wide" if np.isfinite(far) else "its positions are not numbers any more"
        )
