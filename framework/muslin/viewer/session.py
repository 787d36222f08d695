"""A session: a scene that goes on stepping while somebody pulls at it.  No window is needed to have one.

Both faces (`window`, `browser`) call what is here and draw what `scenery` makes of it. Everything a person may
do has one name, one key and one home: `actions.ACTIONS`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError, NotImplementedYet
from muslin.mesh import area_and_normal
from muslin.physics.colliders import Capsule, Collider, Plane, Sphere
from muslin.physics.stand_ins import needs
from muslin.simulation import scenes
from muslin.simulation.adapting import Adapter
from muslin.simulation.integrators import steps
from muslin.simulation.model import Model, Spring, State
from muslin.simulation.scenes import Scene
from muslin.simulation.simulating import adapter_for, build
from muslin.tasks import Functions, failure_of, taken
from muslin.viewer.pace import Pace

#: Parts of a simulation (keys of `muslin.physics.stand_ins.needs`) that a session computes, and what to call them.
PARTS: Mapping[str, str] = {
    "gradient": "elastic force",
    "hessian": "Hessian",
    "mass": "mass",
    "detection": "contact detection",
    "response": "contact response",
}


@dataclass
class Session:
    """A scene under somebody's hands.  `begin` makes one.

    Positions that are *shown* differ from the simulation's by `origin`, which follows cloth that walks away.

    Attributes
    ----------
    scene : Scene
    model : Model
        Its `spring`, what says it (`pull`), and its `colliders` belong to the session.
    start, state : State
        Where it began and where it is.
    faults : mapping
        Task -> why its function is not called: native code computes the parts that need it.
    steps : int
        Steps taken since the start.
    playing, sphere, strain, wireframe : bool
        Whether time passes; whether there are bodies to bump into; what is drawn.
    camera_resets : int
        How often the camera was asked back; the faces compare.
    message : str
        What went wrong, until the next reset.
    adapter : Adapter, optional
        What adapts the mesh; `model` and `state` are then of the mesh as it is.
    """

    scene: Scene
    model: Model
    start: State
    faults: Mapping[str, str] = field(default_factory=dict)
    steps: int = 0
    playing: bool = True
    sphere: bool = True
    strain: bool = False
    wireframe: bool = False
    camera_resets: int = 0
    message: str = ""
    adapter: Adapter | None = None

    def __post_init__(self) -> None:
        self.state = self.start
        own, pull = self.model.spring, self.model.pull
        self._own_spring = pull or (lambda time: own)
        self._held = self.model.pinned if len(self.model.pinned) else slice(len(self.start.x))
        self._take(self.model)
        if self.adapter:
            self.adapter.changed = self._changed
        self.sphere = any(not isinstance(c, Plane) for c in self.scene.colliders(self.scene, 0.0))
        self.grabbed: int | None = None
        self._pull: np.ndarray = np.zeros(3)
        self.pace = Pace()
        self._return()

    # What there is -----------------------------------------------------------------------------------------

    @property
    def x(self) -> np.ndarray:
        """Positions as shown, (n, 3) [m]."""
        return self.state.x - self.origin

    @property
    def triangles(self) -> np.ndarray:
        """The surface's triangles, (t, 3)."""
        return self.model.body.surface

    @property
    def origin(self) -> np.ndarray:
        """What is subtracted from every position to show it, (3,) [m]: the way that followed cloth has gone."""
        if self.scene.camera != "follow":
            return np.zeros(3)
        chosen = self._held  # vertices of the first mesh keep their numbers
        way = self.state.x[chosen].mean(axis=0) - self.start.x[chosen].mean(axis=0)
        return way * (1.0, 0.0, 1.0)

    def colliders(self, when: float) -> tuple[Collider, ...]:
        """What the cloth can bump into at a time [s]: the floor, and the bodies if they are switched on."""
        scene = self.scene if not self.sphere or self.bodied(when) else replace(self.scene, sphere=True)
        there = scene.colliders(scene, when)
        return there if self.sphere else tuple(c for c in there if isinstance(c, Plane))

    def bodied(self, when: float) -> bool:
        """Whether the scene has a body of its own."""
        return any(isinstance(c, (Sphere, Capsule)) for c in self.scene.colliders(self.scene, when))

    @property
    def contacts(self) -> int:
        """Vertices that a body (not the floor) held back in the last step."""
        bodies = [not isinstance(c, Plane) for c in self.colliders(self.state.time)]
        found = self.state.contacts
        if len(found) != len(bodies):  # bodies were switched since
            return 0
        return sum(len(c.vertices) for c, body in zip(found, bodies, strict=True) if body)

    # Time --------------------------------------------------------------------------------------------------

    def step(self) -> None:
        """Take exactly one step; what goes wrong becomes `message`, pauses, and leaves the last good state."""
        self._good = (self.adapter.model, self.adapter.refined) if self.adapter else None
        try:
            with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
                following = next(self._states)
        except MuslinError as error:
            self._fail(str(error))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            self._fail(f"The step could not be computed ({type(error).__name__}: {error}).")
        else:
            self.state, self.steps = following, self.steps + 1

    def advance(self, elapsed: float, budget: float = 0.025) -> None:
        """Let `elapsed` [s] of real time pass, computing for about `budget` [s] at most."""
        self.pace.advance(self, elapsed, budget)

    def reset(self) -> None:
        """Back to the start, exactly; whether time passes and what is drawn stay as they are."""
        if self.message:
            self.playing = True
        self._return()

    def _return(self) -> None:
        self.state = State(self.start.x.copy(), self.start.v.copy(), self.start.time)
        self.steps, self.message = 0, ""
        self.release()
        self.pace = Pace()
        if self.adapter:
            self.adapter.begin_again()
            self._take(self.adapter.model)
        self._go_on()

    def _fail(self, what: str) -> None:
        self.message = f"{what} Paused at step {self.steps}; reset starts again."
        self.playing = False
        self.release()
        if self.adapter and self._good:
            self.adapter.model, self.adapter.refined = self._good
            self._take(self.adapter.model)
        self._go_on()

    def _go_on(self) -> None:
        """The next step goes from `state`."""
        if self.adapter:
            self._states = self.adapter.steps(self.state, self.steps, sys.maxsize)
        else:
            self._states = steps(self.model, self.state, self.scene.dt, self.scene.integrator)
        self.state = next(self._states)

    def _take(self, model: Model) -> None:
        """Go on with a model; what pulls at it and what it bumps into is the session's."""
        self.model = model
        model.pull, model.colliders = self._spring, self.colliders

    def _changed(self) -> None:
        """The mesh has been adapted: the hand keeps its vertex, while there is one."""
        assert self.adapter is not None
        self._take(self.adapter.model)
        if self.grabbed is not None:
            there = np.flatnonzero(self.adapter.came_from == self.grabbed)
            self.grabbed = int(there[0]) if len(there) else None

    # The mouse ---------------------------------------------------------------------------------------------

    def pick(self, eye: Any, direction: Any) -> int | None:
        """The free vertex nearest to a ray, as shown, on the side of the cloth turned to the eye.

        Parameters
        ----------
        eye, direction : (3,)
            Where the ray starts [m] and where it goes.

        Returns
        -------
        int or None
            None where the ray misses the cloth by more than a triangle's size.
        """
        d = np.asarray(direction, float) / np.linalg.norm(direction)
        p = self.x - np.asarray(eye, float)
        along = p @ d
        away = np.linalg.norm(p - along[:, None] * d, axis=1)
        reach = self._edge()
        near = (along > 0) & (away < reach)
        near[self.model.pinned] = False
        if not near.any():
            return None
        near &= along < along[near].min() + 2 * reach
        return int(np.flatnonzero(near)[np.argmin(away[near])])

    def nearest(self, point: Any) -> int | None:
        """The free vertex nearest to a point as shown (3,) [m]; None if all are pinned."""
        distance = np.linalg.norm(self.x - np.asarray(point, float), axis=1)
        distance[self.model.pinned] = np.inf
        vertex = int(np.argmin(distance))
        return vertex if np.isfinite(distance[vertex]) else None

    def grab(self, vertex: int | None) -> None:
        """Take hold of a vertex; it stays where it is until it is dragged.  None lets go."""
        self.grabbed = vertex
        if vertex is not None:
            self._pull = self.x[vertex].copy()

    def drag_to(self, target: Any) -> None:
        """Pull the grabbed vertex towards a point as shown, (3,) [m]."""
        if np.isfinite(target).all():
            self._pull = np.asarray(target, float)

    def drag_along(self, eye: Any, direction: Any, forward: Any) -> None:
        """Pull the grabbed vertex to a ray, in the plane through it that faces the camera.

        Parameters
        ----------
        eye, direction : (3,)
            The ray [m].
        forward : (3,)
            Where the camera looks.
        """
        if self.grabbed is None:
            return
        eye, d, f = (np.asarray(a, float) for a in (eye, direction, forward))
        if d @ f > 1e-6:
            self.drag_to(eye + d * ((self._pull - eye) @ f) / (d @ f))

    def release(self) -> None:
        """Let go."""
        self.grabbed = None

    @property
    def pull(self) -> np.ndarray | None:
        """The grabbed vertex and where it is pulled, as shown, (2, 3) [m]."""
        return None if self.grabbed is None else np.stack([self.x[self.grabbed], self._pull])

    def _spring(self, time: float) -> Spring | None:
        if self.grabbed is None:
            return self._own_spring(time)
        target = (self._pull + self.origin).tolist()
        # half the cloth's own stiffness: it follows the hand, and gives before a triangle is torn out
        stiffness = max(self.scene.drag_stiffness, self.model.body.stiffness / 2)
        return Spring(self.grabbed, (target[0], target[1], target[2]), stiffness)

    def _edge(self) -> float:
        """A usual length of an edge [m]."""
        body = self.model.body
        return float(np.sqrt(2.5 * area_and_normal(body.X, body.surface)[0].mean()))

    # Words -------------------------------------------------------------------------------------------------

    def clock(self) -> str:
        """The time, and how it passes."""
        time_now = f"t = {self.state.time:.2f} s"
        if not self.playing:
            return f"{time_now}, paused"
        factor = self.pace.factor
        if factor is None:
            return time_now
        if factor > 0.93:
            return f"{time_now}, real time"
        return f"{time_now}, slow motion: {factor:.2g} of real time"

    def credits(self) -> list[str]:
        """Who computes what: a line for the student's functions, one for those that native code stands in for."""
        body = self.model.body
        if body.functions is None:
            return []
        behind = {**needs(body.functions.assignment.tasks), **body.needs}
        parts = [part for part in PARTS if part in behind]
        calling = {part for part in parts if body.roles.calling(behind[part]) is not None}
        yours = [PARTS[part] for part in parts if part in calling]
        lines = [f"Your functions compute: {', '.join(yours) or 'nothing yet'}."]
        if missing := [part for part in parts if part not in calling]:
            lines.append(f"Muslin stands in for: {', '.join(PARTS[part] for part in missing)}.")
            wanted = {n for part in missing for n in behind[part]}
            lines.append(
                f"Because: {', '.join(f'{t} {why}' for t, why in self.faults.items() if t in wanted)}."
            )
        return lines


def begin(
    scene: str | Scene,
    functions: Functions | Path | str | None = None,
    stand_ins: Mapping[str, str] | None = None,
    **parameters: Any,
) -> Session:
    """Begin a session.

    Parameters
    ----------
    scene : str or Scene
    functions : Functions or path, optional
        Whose functions run.
    stand_ins : mapping, optional
        Tasks not to call, and why. Default: those that `faults` finds.
    **parameters
        Scene parameters.

    Raises
    ------
    MuslinError
        For a scene, parameter or folder that does not exist or make sense.
    """
    chosen = (
        scenes.override(scene, **parameters) if isinstance(scene, Scene) else scenes.get(scene, **parameters)
    )
    functions = taken(functions)
    if stand_ins is None:
        stand_ins = faults(functions) if functions is not None else {}
    mesh = chosen.load_mesh()
    model, state = build(chosen, functions, mesh=mesh, stand_ins=tuple(stand_ins))
    adapter = adapter_for(chosen, functions, None, "closed", mesh, tuple(stand_ins), model, state.x)
    session = Session(chosen, model, state, stand_ins, adapter=adapter)
    session.step()  # compiles; what goes wrong here will go wrong again when somebody is looking
    session.reset()
    session.playing = True
    return session


def faults(functions: Functions, parts: Iterable[str] = tuple(PARTS)) -> dict[str, str]:
    """Tasks that these parts of a simulation need and that are not done, or wrong on the public cases.

    Returns
    -------
    dict
        Task -> what is the matter with it, to follow its name in a sentence.
    """
    from muslin.judging.checking import check

    tasks = functions.assignment.tasks
    behind = needs(tasks)
    wanted = [name for name in tasks if any(name in behind.get(part, ()) for part in parts)]
    found = {}
    for name in wanted:
        failure = failure_of(functions[name])
        if isinstance(failure, NotImplementedYet):
            found[name] = "is not written yet"
        elif failure is not None:
            found[name] = "cannot be loaded"
    for verdict in check(functions, [name for name in wanted if name not in found]):
        if not verdict.ok:
            found[verdict.task] = "cannot be run" if verdict.error is None else "is wrong"
    return {name: found[name] for name in wanted if name in found}
