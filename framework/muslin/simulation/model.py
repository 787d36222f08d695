"""What moves and what acts on it: a `Model` says what the forces are, a `State` where things are and how fast."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from muslin.physics.barrier import Barrier
from muslin.physics.body import Body
from muslin.physics.colliders import (
    CONTACT,
    NEEDS,
    Collider,
    Contacts,
    Detect,
    Filter,
    detect,
)
from muslin.physics.elements.layout import Layout
from muslin.physics.meeting import Pairs, meet
from muslin.physics.selfcontact import SelfContact
from muslin.simulation.air import Air
from muslin.simulation.touching import HARDER, Pressed, Touching
from muslin.solve.solvers import System

if TYPE_CHECKING:
    from muslin.physics.elements.pattern import Assembly

#: What iterative solvers leave over where contacts are part of the system: which vertices press hangs on it. With 1e-8
#: a `drape` of 16 x 16 vertices lies centimetres from where direct solvers let it fall, with this 0.01 mm.
CONTACT_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Spring:
    """The mouse: pulls one vertex towards a target [m] with a stiffness [N/m]."""

    vertex: int
    target: tuple[float, float, float]
    stiffness: float = 1e3


#: The task behind the drag spring, in assignments that have one.
SPRING = ("spring_force",)


@dataclass
class State:
    """Positions [m] and velocities [m/s], (n, 3) each, at a time [s], and the contacts v was filtered at.

    `before` is the state before the last step, where an integrator needs it.
    Where contacts are part of the system, `pressed` is what pressed in the last step. `work` is what moving colliders,
    moving pins, the wind, the hand and taking back penetration have put into the body since the start [J].
    """

    x: np.ndarray
    v: np.ndarray
    time: float = 0.0
    contacts: list[Contacts] = field(default_factory=list)
    pressed: Pressed = field(default_factory=Pressed)
    work: float = 0.0
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
        to its right-hand side, no more than `CONTACT_TOLERANCE` where contacts are part of it.
    contact : {"filter", "solve"}
        Whether contacts change the velocity after the system is solved, or are part of the system.
    friction : float
        Coulomb's coefficient between the body and colliders, where contacts are part of the system; 0: none.
    stretch_limit : float
        Largest principal stretch that a step may end with, above 1 (see `muslin.physics.elements.limit`); 0: any.
    self_contact : SelfContact, optional
        Keeps the body from crossing itself, after each step.
    barrier : Barrier, optional
        Keeps the body from crossing itself, in each step of backward Euler.
    damping : float
        beta [s] of Rayleigh's damping force -beta K v, with the stiffness K = d2V/dq2, projected, before the step.
    lasting : bool
        Whether the mesh stays for long, so that much may be done to find a good order for its systems.
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
    friction: float = 0.0
    stretch_limit: float = 0.0
    self_contact: SelfContact | None = None
    barrier: Barrier | None = None
    damping: float = 0.0
    lasting: bool = True

    def __post_init__(self) -> None:
        from muslin.physics.elements.contact import Detection, Response

        body, n = self.body, len(self.body.X)
        pinned = np.zeros(n, dtype=bool)
        pinned[self.pinned] = True
        tolerance = min(self.tolerance, CONTACT_TOLERANCE) if self.contact == "solve" else self.tolerance
        system = (body.pattern.row, body.pattern.col, pinned, self.solver, self.project, body.X, tolerance)
        said = {"solid": body.pattern.corners == 4, "lasting": self.lasting, "ptr": body.pattern.ptr}
        make = functools.partial(System, *system, **said)
        self.system = make(varying=self.barrier is not None)
        self._make = make
        self._assemble = body.assembly(self.system.layout, self.system.data, self.lasting)
        self._impulse = body.impulse(self.damping)
        self._diagonal: Assembly | None = None
        touchable = body.of_surface & ~pinned
        self._free = None if touchable.all() else touchable
        self._detect: Detect | None = None
        self.filter: Filter | None = None
        if functions := body.roles.calling(NEEDS["detection"]):
            self._detect = Detection(functions.sphere_contact, n)
        if functions := body.roles.calling(NEEDS["response"]):
            self.filter = Response(functions.filter_velocity, n)
        #: of each vertex [kg]
        self.lumped = np.bincount(body.pattern.row, body.mass_factor, n)
        #: the state that the body has been updated to, and all prepared for
        self.here: State | None = None
        #: whether a step's first matrix is that of where the body is; Newton's method begins elsewhere
        self.hessian_here = True
        self.limit: Callable[[np.ndarray, np.ndarray, float], np.ndarray] | None = None
        if self.stretch_limit:
            self.limit = body.limiter(self.stretch_limit, pinned)
        self._there: tuple[float, tuple[Collider, ...]] | None = None
        self.weight = np.zeros((n, 3))
        for k, g in enumerate(self.gravity):
            if g:
                self.weight[:, k] = np.bincount(body.pattern.row, g * body.mass_factor, n)

    @functools.cached_property
    def _longest(self) -> np.ndarray:
        """Longest edge of each triangle of the surface, undeformed [m]."""
        x = np.ascontiguousarray(self.body.X.T)
        a, b, c = (x.take(corner, axis=1) for corner in np.ascontiguousarray(self.body.surface.T))
        squares = [((x - y) ** 2).sum(axis=0) for x, y in ((a, c), (b, a), (c, b))]
        return np.asarray(np.sqrt(np.maximum.reduce(squares)))

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

    def air(self, state: State, dt: float) -> Air | None:
        """The wind in a step of dt [s]; None if there is no drag."""
        return Air(self.body, self.wind, self.drag, state.x, state.v, dt) if self.drag else None

    def wind_force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """What the wind does at positions and velocities (n, 3), (n, 3) [N]."""
        return Air(self.body, self.wind, self.drag, x, v, 1.0).impulse(v) if self.drag else np.zeros_like(x)

    def potential(self, x: np.ndarray) -> float:
        """Energy of gravity and of the drag spring [J]."""
        energy = -float((self.weight * x).sum())
        if self.spring:
            pull = np.asarray(self.spring.target) - x[self.spring.vertex]
            energy += self.spring.stiffness / 2 * float(pull @ pull)
        return energy

    def prepare(self) -> None:
        """Compute all that a step needs of the elements at the body's positions, in one go."""
        parts = ("energy", "gradient", "hessian") if self.hessian_here else ("energy", "gradient")
        self.body.prepare(*parts, project=self.project)

    def damper_here(self) -> np.ndarray:
        """C = beta K at the body's current positions, as data of `system` [kg/s]; `system` is written over."""
        self.body.prepare("hessian", project=True)
        self._assemble(self.damping)
        both = self.system.data.copy()
        self._assemble(0.0)
        return np.asarray(both - self.system.data)

    def assemble(self, dt: float, project: bool | None = None, damper: np.ndarray | None = None) -> None:
        """Write M + dt (dt + damping) K at the body's current positions into `system`.

        `project` if not the model's own; `damper` if damping is not by the K of where the body is (see `damper_here`).
        """
        self.body.prepare("hessian", project=self.project if project is None else project)
        self._assemble(dt * (dt + self.damping) if self.damping and damper is None else dt**2)
        if damper is not None:
            self.system.data += dt * damper
        if self.spring:
            self.add_to_diagonal(
                np.array([self.spring.vertex]), dt**2 * self.spring.stiffness * np.eye(3)[None]
            )

    @functools.cached_property
    def _couple(self) -> Assembly:
        return self.body.assembly(self.system.coupling)

    @functools.cached_property
    def varying(self) -> System:
        """A system like `system`, with the same pins, to which any `more` may be added."""
        return self._make(varying=True)

    @functools.cached_property
    def _assemble_varying(self) -> Assembly:
        return self.body.assembly(self.varying.layout, self.varying.data)

    def assemble_varying(self, dt: float) -> None:
        """Write M + dt (dt + damping) K at the body's current positions into `varying`, without spring or contacts."""
        self.body.prepare("hessian", project=self.project)
        self._assemble_varying(dt * (dt + self.damping) if self.damping else dt**2)

    def add_to_diagonal(self, vertices: np.ndarray, blocks: np.ndarray) -> None:
        """Add (k, 3, 3) blocks to those of distinct vertices (k,) in the matrix just assembled."""
        self._assemble.add_to_diagonal(vertices, blocks)

    def add(self, touching: Touching | None, presses: np.ndarray | None, air: Air | None) -> None:
        """Add contacts, where these press, and wind to the matrix just assembled."""
        if air:
            self.add_to_diagonal(np.arange(len(air.blocks)), air.blocks)
        if touching is None or presses is None:
            return
        which = np.flatnonzero(presses | (touching.grip > 0))
        corners, weights = touching.pairs.corners[which], touching.pairs.weights[which]
        blocks = touching.blocks(presses)[which]
        summed = np.zeros((len(self.body.X), 3, 3))
        for i, j in itertools.product(range(corners.shape[1]), repeat=2):
            pair = weights[:, i] * weights[:, j]
            there = np.flatnonzero(pair)
            added = pair[there, None, None] * blocks[there]
            if i == j:
                np.add.at(summed, corners[there, i], added)
            elif len(there):
                self._assemble.add(corners[there, i], corners[there, j], added)
        touched = np.unique(corners)
        self.add_to_diagonal(touched, summed[touched])

    def coupling(self, known: np.ndarray | None, dt: float) -> np.ndarray | None:
        """Data of `system.coupling` for the matrix just assembled, where the pinned vertices move."""
        scale = dt * (dt + self.damping) if self.damping else dt**2
        return self._couple(scale) if known is not None and known.any() else None

    def impulse(self, state: State, force: np.ndarray, dt: float) -> np.ndarray:
        """M v + dt (force - elastic gradient), (n, 3) [kg m/s]."""
        self.body.prepare("gradient")
        return self._impulse(state.v, force, dt)

    def pulled(self, state: State, x: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Impulses (n, 3) that a step to x and v needs beside the elastic and conservative ones [N s].

        The body has been updated to x.
        """
        change = (self.body.mass @ (v - state.v).ravel()).reshape(-1, 3)
        return change + dt * (self.body.gradient_here() - self.conservative_force(x))

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
        """What the filter is to look at after a step of dt [s]: the free vertices inside, and those near a plane."""
        colliders = self.colliders_at(state.time)
        return [detect(c, state.x, state.v, dt, self._detect, self._free) for c in colliders]

    def touching(self, state: State, dt: float) -> Touching | None:
        """What may touch during a step of dt [s], where that is part of the system; None if nothing is near."""
        pairs = self.pairs(state, dt)
        if not len(pairs):
            return None
        return Touching(pairs, state.pressed, dt, HARDER * float(self.diagonal(dt).max()), self.friction)

    def diagonal(self, dt: float) -> np.ndarray:
        """Diagonal of M + dt^2 K where the body has been updated to, (n, 3) [kg]; nothing else is assembled."""
        if self._diagonal is None:
            every = np.arange(len(self.body.X))
            self._diagonal = self.body.assembly(Layout.csr(every, every, len(every)))
        self.body.prepare("hessian", project=self.project)
        return self._diagonal(dt**2).reshape(-1, 9)[:, ::4]

    def pairs(self, state: State, dt: float) -> Pairs:
        """Pairs of colliders, where they are at the end of a step of dt [s], and what may meet them."""
        colliders = self.colliders_at(state.time + dt)
        free, triangles = self._free, self.body.surface
        return meet(colliders, state.x, state.v, dt, free, self._detect, triangles, self._longest)

    def energy(self, state: State) -> float:
        """Kinetic, elastic and potential energy where the body has been updated to [J]."""
        return self.body.kinetic_energy(state.v) + self.elastic(state.x) + self.potential(state.x)

    def elastic(self, x: np.ndarray) -> float:
        """What the body stores at positions (n, 3) that it has been updated to, and between what nearly touches [J]."""
        stored = self.body.energy_here()
        return stored + self.barrier.energy(x) if self.barrier else stored
