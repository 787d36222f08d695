"""What moves and what acts on it: a `Model` says what the forces are, a `State` where things are and how fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from muslin.physics.body import Body
from muslin.physics.colliders import (
    CONTACT,
    NEEDS,
    Collider,
    Contacts,
    Detect,
    Filter,
    detect,
    native_contact,
    native_filter,
)
from muslin.physics.selfcontact import SelfContact
from muslin.solve.solvers import System


@dataclass(frozen=True)
class Spring:
    """The mouse: pulls one vertex towards a target [m] with a stiffness [N/m]."""

    vertex: int
    target: tuple[float, float, float]
    stiffness: float = 1e3


#: The task behind the drag spring, in assignments that have one.
SPRING = ("spring_force",)

#: No vertices.
NOBODY = np.empty(0, dtype=np.int64)


@dataclass
class State:
    """Positions [m] and velocities [m/s], (n, 3) each, at a time [s], and the contacts v was filtered at.

    `before` is the state before the last step, where an integrator needs it.
    `active` is the active set of the last step: the vertices a contact pushed, where contacts are part of the system.
    """

    x: np.ndarray
    v: np.ndarray
    time: float = 0.0
    contacts: list[Contacts] = field(default_factory=list)
    active: np.ndarray = field(default_factory=lambda: NOBODY)
    before: State | None = None


@dataclass
class Model:
    """Everything that acts on a body.

    Parameters
    ----------
    body : Body
    gravity : (3,)
        Acceleration [m/s^2]; its force is M g, from the mass matrix.
    pinned : (k,) int array
        Pinned vertices.
    pinned_velocity : callable, optional
        (time, dt) -> (k, 3), the velocity that carries pinned vertices through the next step; default: rest.
    colliders : callable
        time -> colliders there are at that time.
    wind : (3,)
        Air velocity [m/s], felt with `drag` [kg/m^3] across each triangle of the surface.
    spring : Spring, optional
        Drag spring; may be exchanged between steps.
    pull : callable, optional
        time -> the drag spring of the step that begins then, or None; without it, `spring` stays.
    project : bool
        Make element Hessians positive semi-definite (leave it on).
    solver : str
        "auto" or a name in `muslin.solve.solvers.SOLVERS`.
    tolerance : float
        Of Newton's method: see `backward_euler`. Of iterative solvers: the residual of a linear system, relative
        to its right-hand side.
    contact : {"filter", "solve"}
        Whether contacts change the velocity after the system is solved, or are part of the system.
    stretch_limit : float
        Largest principal stretch that a step may end with, above 1 (see `muslin.physics.elements.limit`); 0: any.
    self_contact : SelfContact, optional
        Keeps the body from crossing itself; without it, nothing does.
    damping : float
        beta [s] of Rayleigh's damping force -beta K v, with the stiffness K = d2V/dq2, projected, before the step.
    """

    body: Body
    gravity: np.ndarray
    pinned: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))
    pinned_velocity: Callable[[float, float], np.ndarray] | None = None
    colliders: Callable[[float], tuple[Collider, ...]] = lambda time: ()
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drag: float = 0.0
    spring: Spring | None = None
    pull: Callable[[float], Spring | None] | None = None
    project: bool = True
    solver: str = "auto"
    tolerance: float = 1e-8
    contact: str = CONTACT[0]
    stretch_limit: float = 0.0
    self_contact: SelfContact | None = None
    damping: float = 0.0

    def __post_init__(self) -> None:
        from muslin.physics.elements.contact import Detection, Response

        body, n = self.body, len(self.body.X)
        pinned = np.zeros(n, dtype=bool)
        pinned[self.pinned] = True
        blocks = body.pattern.layout
        self.system = System(
            blocks.row, blocks.col, pinned, self.solver, self.project, body.X, self.tolerance
        )
        self._assemble = body.assembly(self.system.layout, self.system.data)
        self._couple = body.assembly(self.system.coupling)
        self._impulse = body.impulse(self.damping)
        touchable = np.zeros(n, dtype=bool)
        touchable[body.surface.ravel()] = True
        touchable &= ~pinned
        self._free = None if touchable.all() else touchable
        self._detect: Detect = native_contact
        self.filter: Filter = native_filter
        if functions := body.roles.calling(NEEDS["detection"]):
            self._detect = Detection(functions.sphere_contact, n)
        if functions := body.roles.calling(NEEDS["response"]):
            self.filter = Response(functions.filter_velocity, n)
        self.limit: Callable[[np.ndarray, np.ndarray, float], np.ndarray] | None = None
        if self.stretch_limit:
            self.limit = body.limiter(self.stretch_limit, pinned)
        self._there: tuple[float, tuple[Collider, ...]] | None = None
        self.weight = (self.body.mass @ np.tile(np.asarray(self.gravity, float), n)).reshape(n, 3)

    def damper(self, x: np.ndarray) -> sp.csr_matrix | None:
        """C = beta K at positions x, (3n, 3n) [kg/s]; None if nothing is damped."""
        return self.damping * self.body.hessian(x, project=True) if self.damping else None

    def conservative_force(self, x: np.ndarray) -> np.ndarray:
        """Gravity and drag spring, minus the gradient of `potential`, (n, 3) [N]."""
        f = self.weight.copy()
        if self.spring:
            f[self.spring.vertex] += self._spring_force(self.spring, x[self.spring.vertex])
        return f

    def _spring_force(self, spring: Spring, x: np.ndarray) -> np.ndarray:
        """Force of the drag spring on its vertex at x, (3,) [N]: by the student's function, where there is one."""
        if functions := self.body.roles.calling(SPRING):
            from muslin.tasks.batch import evaluate

            pulled, target, none = x[None], np.asarray(spring.target, float), np.zeros(1)
            found = evaluate(functions.spring_force, x0=pulled, x1=target, l0=none, k=spring.stiffness)
            return np.asarray(found[0])
        return spring.stiffness * (np.asarray(spring.target) - x)

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

    def assemble(self, dt: float, project: bool | None = None) -> None:
        """Write M + dt (dt + damping) K at the body's current positions into `system`.

        `project` if not the model's own.
        """
        self.body.prepare("hessian", project=self.project if project is None else project)
        self._assemble(dt * (dt + self.damping) if self.damping else dt**2)
        if self.spring:
            self.add_to_diagonal(
                np.array([self.spring.vertex]), dt**2 * self.spring.stiffness * np.eye(3)[None]
            )

    def add_to_diagonal(self, vertices: np.ndarray, blocks: np.ndarray) -> None:
        """Add (k, 3, 3) blocks to those of distinct vertices (k,) in the matrix just assembled."""
        self._assemble.add_to_diagonal(vertices, blocks)

    def coupling(self, known: np.ndarray | None, dt: float) -> np.ndarray | None:
        """Data of `system.coupling` for the matrix just assembled, where the pinned vertices move."""
        scale = dt * (dt + self.damping) if self.damping else dt**2
        return self._couple(scale) if known is not None and known.any() else None

    def impulse(self, state: State, force: np.ndarray, dt: float) -> np.ndarray:
        """M v + dt (force - elastic gradient), (n, 3) [kg m/s]."""
        self.body.prepare("gradient")
        return self._impulse(state.v, force, dt)

    def known_velocity(self, time: float, dt: float) -> np.ndarray | None:
        """Velocities (n, 3) with the pinned vertices' filled in, for the step from `time` by dt; None at rest."""
        if self.pinned_velocity is None or not len(self.pinned):
            return None
        known = np.zeros((len(self.body.X), 3))
        known[self.pinned] = self.pinned_velocity(time, dt)
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
