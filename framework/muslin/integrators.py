"""Time integration: a `Model` says what the forces are, an integrator moves a `State` on by dt.

Linearly implicit Euler is one Newton step of backward Euler, from the current velocity::

    (M + dt^2 K) v+ = M v + dt f(q),    q+ = q + dt v+,    K = d2V/dq2 (projected)

Both detect contacts at q and filter v+ at them (S10). With `contact="solve"` linearly implicit Euler knows of them
when it solves: (M + dt^2 K) v+ = M v + dt f(q) + sum_i lambda_i n_i, with impulses lambda_i that keep vertices in
contact from moving inwards.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from muslin import newton
from muslin.body import Body
from muslin.colliders import (
    CONTACT,
    NEEDS,
    Collider,
    Contacts,
    Detect,
    Filter,
    detect,
    native_contact,
    native_filter,
    respond,
)
from muslin.errors import MuslinError, SimulationError, choices
from muslin.solvers import System


@dataclass(frozen=True)
class Spring:
    """The mouse: pulls one vertex towards a target [m] with a stiffness [N/m]."""

    vertex: int
    target: tuple[float, float, float]
    stiffness: float = 1e3


_NOBODY = np.empty(0, dtype=np.int64)


@dataclass
class State:
    """Positions [m] and velocities [m/s], (n, 3) each, at a time [s], and the contacts v was filtered at.

    `pressed` are the vertices a contact pushed in the last step, where contacts are part of the system.
    """

    x: np.ndarray
    v: np.ndarray
    time: float = 0.0
    contacts: list[Contacts] = field(default_factory=list)
    pressed: np.ndarray = field(default_factory=lambda: _NOBODY)


@dataclass
class Model:
    """Everything that acts on a body.

    Parameters
    ----------
    body : Body
    gravity : (3,)
        Acceleration [m/s^2]; its force is M g, from the mass matrix.
    held : (k,) int array
        Pinned vertices.
    held_velocity : callable, optional
        (time, dt) -> (k, 3), the velocity that carries pinned vertices through the next step; default: rest.
    colliders : callable
        time -> colliders there are at that time.
    wind : (3,)
        Air velocity [m/s], felt with `drag` [kg/m^3] across each triangle of the surface.
    spring : Spring, optional
        Drag spring; may be exchanged between steps.
    project : bool
        Make element Hessians positive semi-definite (leave it on).
    solver : str
        "auto" or a name in `muslin.solvers.SOLVERS`.
    tolerance : float
        Of Newton's method: see `backward_euler`. Of iterative solvers: the residual of a linear system, relative
        to its right-hand side.
    contact : {"filter", "solve"}
        Whether contacts change the velocity after the system is solved, or are part of the system.
    stretch_limit : float
        Largest principal stretch that a step may end with, above 1 (see `muslin.elements.limit`); 0: any.
    """

    body: Body
    gravity: np.ndarray
    held: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))
    held_velocity: Callable[[float, float], np.ndarray] | None = None
    colliders: Callable[[float], tuple[Collider, ...]] = lambda time: ()
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drag: float = 0.0
    spring: Spring | None = None
    project: bool = True
    solver: str = "auto"
    tolerance: float = 1e-8
    contact: str = CONTACT[0]
    stretch_limit: float = 0.0

    def __post_init__(self) -> None:
        from muslin.elements.contact import Detection, Response

        body, n = self.body, len(self.body.X)
        held = np.zeros(n, dtype=bool)
        held[self.held] = True
        blocks = body.pattern.layout
        self.system = System(blocks.row, blocks.col, held, self.solver, self.project, body.X, self.tolerance)
        self._assemble = body.assembly(self.system.layout, self.system.data)
        self._couple = body.assembly(self.system.coupling)
        self._impulse = body.impulse()
        touchable = np.zeros(n, dtype=bool)
        touchable[body.surface.ravel()] = True
        touchable &= ~held
        self._free = None if touchable.all() else touchable
        self._detect: Detect = native_contact
        self.filter: Filter = native_filter
        if functions := body.roles.calling(NEEDS["detection"]):
            self._detect = Detection(functions.sphere_contact, n)
        if functions := body.roles.calling(NEEDS["response"]):
            self.filter = Response(functions.filter_velocity, n)
        self.limit: Callable[[np.ndarray, np.ndarray, float], np.ndarray] | None = None
        if self.stretch_limit:
            self.limit = body.limiter(self.stretch_limit, held)
        self._there: tuple[float, tuple[Collider, ...]] | None = None
        self.weight = (self.body.mass @ np.tile(np.asarray(self.gravity, float), n)).reshape(n, 3)

    def conservative_force(self, x: np.ndarray) -> np.ndarray:
        """Gravity and drag spring, minus the gradient of `potential`, (n, 3) [N]."""
        f = self.weight.copy()
        if self.spring:
            f[self.spring.vertex] += self.spring.stiffness * (
                np.asarray(self.spring.target) - x[self.spring.vertex]
            )
        return f

    def wind_force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Pressure drag along each triangle's normal, a third to each corner, (n, 3) [N]."""
        if not self.drag:
            return np.zeros_like(x)
        t = self.body.surface
        doubled = np.cross(x[t[:, 1]] - x[t[:, 0]], x[t[:, 2]] - x[t[:, 0]])
        relative = np.asarray(self.wind) - v[t].mean(axis=1)
        length = np.maximum(np.linalg.norm(doubled, axis=1), 1e-300)
        through = np.einsum("ij,ij->i", relative, doubled) / length
        force = (self.drag / 2 * np.abs(through) * through / 3)[:, None] * doubled / 2
        return self.body.on_surface(np.repeat(force, 3, axis=0))

    def potential(self, x: np.ndarray) -> float:
        """Energy of gravity and of the drag spring [J]."""
        energy = -float((self.weight * x).sum())
        if self.spring:
            pull = np.asarray(self.spring.target) - x[self.spring.vertex]
            energy += self.spring.stiffness / 2 * float(pull @ pull)
        return energy

    def prepare(self) -> None:
        """Compute all that a step needs of the elements at the body's positions, in one go."""
        self.body.prepare("energy", "gradient", "hessian", project=self.project)

    def assemble(self, dt: float) -> None:
        """Write M + dt^2 K at the body's current positions into `system`."""
        self.body.prepare("hessian", project=self.project)
        self._assemble(dt**2)
        if self.spring:
            self.add_to_diagonal(
                np.array([self.spring.vertex]), dt**2 * self.spring.stiffness * np.eye(3)[None]
            )

    def add_to_diagonal(self, vertices: np.ndarray, blocks: np.ndarray) -> None:
        """Add (k, 3, 3) blocks to those of distinct vertices (k,) in the matrix just assembled."""
        self._assemble.add_to_diagonal(vertices, blocks)

    def coupling(self, known: np.ndarray | None, dt: float) -> np.ndarray | None:
        """Data of `system.coupling` for the matrix just assembled, where the held vertices move."""
        return self._couple(dt**2) if known is not None and known.any() else None

    def impulse(self, state: State, force: np.ndarray, dt: float) -> np.ndarray:
        """M v + dt (force - elastic gradient), (n, 3) [kg m/s]."""
        self.body.prepare("gradient")
        return self._impulse(state.v, force, dt)

    def known_velocity(self, time: float, dt: float) -> np.ndarray | None:
        """Velocities (n, 3) with the pinned vertices' filled in, for the step from `time` by dt; None at rest."""
        if self.held_velocity is None or not len(self.held):
            return None
        known = np.zeros((len(self.body.X), 3))
        known[self.held] = self.held_velocity(time, dt)
        return known

    def colliders_at(self, time: float) -> tuple[Collider, ...]:
        """Colliders at a time; those of the last time asked for are kept."""
        if self._there is None or self._there[0] != time:
            self._there = time, self.colliders(time)
        return self._there[1]

    def contacts(self, state: State, dt: float) -> list[Contacts]:
        """Contacts of the free vertices, for a step of dt [s]."""
        colliders = self.colliders_at(state.time)
        return [detect(c, state.x, state.v, dt, self._detect, self._free) for c in colliders]


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
        v, pressed = _solve_touching(model, state, b, known, coupling, touching)
    else:
        v, pressed = model.system.solve(b, known, coupling, guess=state.v), _NOBODY
    return _finish(model, state, v, contacts, dt, pressed)


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

    Which do is corrected from step to step instead of in every step again and again: those that pressed before, and
    those that move inwards. One that would rather leave is held in this step, and let go in the next.

    Returns
    -------
    v : (n, 3) array
    pressed : int array
        Vertices that press now.
    """
    vertices = np.concatenate([contact.vertices for contact in contacts])
    n = np.concatenate([contact.normals for contact in contacts])
    least = np.einsum("ij,ij->i", n, np.concatenate([contact.velocities for contact in contacts]))
    presses = np.isin(vertices, state.pressed) | (np.einsum("ij,ij->i", n, state.v[vertices]) < least)
    stiffness = CONTACT_STIFFNESS * float(np.abs(model.system.data).max())
    along = n[presses]
    blocks = np.zeros((len(b), 3, 3))
    np.add.at(blocks, vertices[presses], stiffness * along[:, :, None] * along[:, None, :])
    pushed = b.copy()
    np.add.at(pushed, vertices[presses], stiffness * least[presses, None] * along)
    held = np.unique(vertices[presses])
    model.add_to_diagonal(held, blocks[held])
    v = model.system.solve(pushed, known, coupling, guess=state.v)
    return v, vertices[np.einsum("ij,ij->i", n, v[vertices]) < least]


def backward_euler(model: Model, state: State, dt: float) -> State:
    """One step of backward Euler, by Newton's method with a backtracking line search.

    It ends as `muslin.newton.minimise` says, with `model.tolerance`. Wind is taken at the start of the step.

    Raises
    ------
    SimulationError
        If Newton does not converge.
    """
    contacts = model.contacts(state, dt)
    step = _BackwardEuler(model, state, dt)
    v = newton.minimise(step, step.start(), model.tolerance)
    return _finish(model, state, v.reshape(-1, 3), contacts, dt)


class _BackwardEuler:
    """What a step of backward Euler from a state minimises.

    Phi(v) = 1/2 (v - v_n)^T M (v - v_n) + V(q + dt v), whose gradient is the backward Euler equation: momenta and
    impulses. Its rounding error is that of the forces, 32 eps |K| |x|.
    """

    def __init__(self, model: Model, state: State, dt: float):
        self.model, self.state, self.dt = model, state, dt
        self.air = model.wind_force(state.x, state.v)
        self.free = np.repeat(~model.system.held, 3)
        self._v, self._x = state.v.ravel(), state.x

    def start(self) -> np.ndarray:
        """The velocity before the step, with that of the held vertices in it, (3n,)."""
        start, held = self.state.v.copy(), self.model.system.held
        known = self.model.known_velocity(self.state.time, self.dt)
        start[held] = 0.0 if known is None else known[held]
        return start.ravel()

    def value(self, v: np.ndarray) -> float:
        """Phi(v) [J]."""
        model, state = self.model, self.state
        self._v, self._x = v, state.x + self.dt * v.reshape(-1, 3)
        model.body.update(self._x)
        dv = v - state.v.ravel()
        work = float(np.sum(self.air * (self._x - state.x)))
        kinetic = 0.5 * float(dv @ (model.body.mass @ dv))
        return kinetic + model.body.energy_here() + model.potential(self._x) - work

    def gradient(self) -> tuple[np.ndarray, float]:
        """dPhi/dv, (3n,) [N s]."""
        body = self.model.body
        momentum = body.mass @ (self._v - self.state.v.ravel())
        elastic = self.dt * body.gradient_here().ravel()
        external = self.dt * (self.model.conservative_force(self._x) + self.air).ravel()
        terms = (momentum, elastic, external, body.mass @ self._v)
        return momentum + elastic - external, max(self.size(term) for term in terms)

    def assemble(self) -> None:
        """Write M + dt^2 K down."""
        self.model.assemble(self.dt)

    def rounding(self) -> np.ndarray:
        """Error of the impulses dt f that rounding alone makes, (3n,) [N s]."""
        body, spring = self.model.body, self.model.spring
        K = body.stiffness_here(self.model.project)
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
    pressed: np.ndarray = _NOBODY,
) -> State:
    v = respond(v, contacts, model.filter)
    if model.limit and (limited := model.limit(state.x, v, dt)) is not v:
        v = respond(limited, contacts, model.filter)
    return State(state.x + dt * v, v, state.time + dt, contacts, pressed)


INTEGRATORS: dict[str, Callable[[Model, State, float], State]] = {
    "linearly-implicit": linearly_implicit_euler,
    "backward-euler": backward_euler,
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
        following = advance(model, state, dt)
        _require_sound(following)
        model.body.update(following.x)
        state = following
        if step != count:
            model.prepare()  # the energies that somebody may ask for between, and what the next step needs
        yield state


def _require_sound(state: State) -> None:
    if not (np.abs(state.x) < EXPLODED).all() or not np.isfinite(state.v).all():
        far = float(np.nan_to_num(np.abs(state.x), nan=np.inf).max())
        raise Exploded(
            f"it is {far:.0e} m wide" if np.isfinite(far) else "its positions are not numbers any more"
        )
