"""Take the steps of a scene, keep its log and its frames: a model and a state in, a `Run` out."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import muslin
from muslin.base import paths
from muslin.base.errors import SimulationError
from muslin.mesh import Mesh
from muslin.physics import colliders, skinning
from muslin.physics.body import Body
from muslin.physics.colliders import approach, depth
from muslin.physics.skinning import bind
from muslin.simulation.adapting import Adapter
from muslin.simulation.integrators import Exploded, by_integrator, steps
from muslin.simulation.model import Model, State
from muslin.simulation.runs import Writer, as_table
from muslin.simulation.scenes import Scene


@dataclass
class Run:
    """What a simulation leaves.

    Attributes
    ----------
    x, v : (n, 3) arrays
        Final positions [m] and velocities [m/s].
    x0, v0 : (n, 3) arrays
        Those it started from.
    energies : record array
        One row per step, the start included: step, time, kinetic, elastic, gravity (and pull) [J], contacts
        (vertices pressed against a collider), approach (smallest n^T v of those in contact after the filter
        [m/s]), penetration (deepest vertex [m]), px, py, pz (linear momentum [kg m/s]), lx, ly, lz (angular
        momentum about the centre of mass [kg m^2/s]), work (put in since the start by moving colliders, moving pins,
        wind and what takes back penetration, where contacts are in the system [J]).
    scene : Scene
    mesh : Mesh
    body : Body
    folder : Path, optional
        Where it was written.
    interrupted : bool
        Whether Ctrl-C ended it early.
    uses : frozenset of str
        Tasks whose functions the run called; native code stood in for the others.
    """

    x: np.ndarray
    v: np.ndarray
    x0: np.ndarray
    v0: np.ndarray
    energies: np.recarray
    scene: Scene
    mesh: Mesh
    body: Body
    folder: Path | None = None
    interrupted: bool = False
    uses: frozenset[str] = frozenset()

    def __repr__(self) -> str:
        last = self.energies[-1]
        where = f", in {paths.shown(self.folder)}" if self.folder else ""
        return f"Run({self.scene.name}: {last.step} steps, {last.time:.3g} s, {len(self.x)} vertices{where})"

    def _repr_html_(self) -> str:
        return str(muslin.run_html(self))


class CameApart(SimulationError):
    """A run that could not go on.

    Attributes
    ----------
    uses : frozenset of str
        As of a `Run`.
    written : bool
        Whether there is a folder with what was simulated until then, the start at least.
    """

    def __init__(self, message: str, hint: str, uses: frozenset[str], written: bool):
        super().__init__(message, hint)
        self.uses, self.written = uses, written


def march(
    scene: Scene,
    model: Model,
    state: State,
    open_writer: Callable[[], Writer] | None = None,
    shown: Mesh | None = None,
    on_step: Callable[[int, int], None] | None = None,
    start: State | None = None,
    step: int = 0,
    adapter: Adapter | None = None,
) -> Run:
    """Take steps until the scene's last.

    Parameters
    ----------
    scene, model, state
        As `build` made them, or where to go on.
    open_writer : callable, optional
        Opens what the run is written to. An earlier run in its folder is lost then, so it is called only when
        everything the first step needs has been tried.
    shown : Mesh, optional
        A finer mesh to carry along.
    on_step : callable, optional
        Called as (step, steps) after every step.
    start : State, optional
        Where the run began, if that is not `state`.
    step : int
        The number of `state`.
    adapter : Adapter, optional
        What adapts the mesh between steps; `state` is on the mesh it has now.

    Raises
    ------
    CameApart
        If it cannot go on.
    """
    first, interrupted = start or state, False
    body, skin = model.body, None
    with np.errstate(invalid="ignore", over="ignore"):
        if adapter:
            states = adapter.steps(state, step)
        else:
            states = steps(model, state, scene.dt, scene.integrator, scene.steps - step)
        try:
            state = next(states)
        except SimulationError as error:
            raise _came_apart(error, step, scene, model, state.time, None, shown is not None) from None
        if adapter:
            model = adapter.model
            body = model.body
        skin = bind(shown, body.undeformed, body.functions, body.stand_ins) if shown is not None else None
        row = _row(model, state, step)
        uses = _uses(scene, model, state.time, skin is not None)
        following = _tried(states)
        writer = open_writer() if open_writer else None
        rows: list[tuple[float, ...]] = writer.rows if writer else []

        def record(row: tuple[float, ...]) -> None:
            rows.append(row)
            if writer and (step % scene.frame_every == 0 or step == scene.steps):
                writer.frame(step, state, skin.carry(state.x) if skin else None, adapter)

        try:
            if step == 0:
                record(row)
            for state in following:
                step += 1
                if adapter and model is not adapter.model:
                    model, body = adapter.model, adapter.model.body
                    skin = (
                        None
                        if shown is None
                        else bind(shown, body.undeformed, body.functions, body.stand_ins)
                    )
                record(_row(model, state, step))
                uses |= _uses(scene, model, state.time, skin is not None)
                if on_step:
                    on_step(step, scene.steps)
        except SimulationError as error:
            raise _came_apart(error, step + 1, scene, model, state.time, writer, skin is not None) from None
        except KeyboardInterrupt:
            interrupted = True
        finally:
            if writer:
                writer.close()
    return Run(
        state.x, state.v, first.x, first.v, as_table(rows), scene, body.mesh, body,
        writer.folder if writer else None, interrupted, uses,
    )  # fmt: skip


def _tried(states: Iterator[State]) -> Iterator[State]:
    """The same states, the first of them computed now; should it come apart, that is said when it is asked for."""
    try:
        first = [next(states)]
    except StopIteration:
        return iter(())
    except SimulationError as error:
        return _raising(error)
    return itertools.chain(first, states)


def _raising(error: Exception) -> Iterator[State]:
    raise error
    yield


def _uses(scene: Scene, model: Model, time: float, shown: bool) -> frozenset[str]:
    """Tasks whose functions the step to this time called: a collider may come later, and the mouse lets go."""
    roles = model.body.roles
    called = {name for part in ("detection", "response") for name in roles.called(colliders.NEEDS[part])}
    met = called if model.colliders_at(time) else set()
    carried = {name for names in skinning.NEEDS.values() for name in roles.called(names)} if shown else set()
    return model.body.uses | met | carried | by_integrator(model, scene.integrator)


def _row(model: Model, state: State, step: int) -> tuple[float, ...]:
    body = model.body
    speeds_in = [approach(state.v, contact) for contact in state.contacts]
    count = int(sum((speeds < 1e-6).sum() for speeds in speeds_in))
    slowest = min((float(speeds.min()) for speeds in speeds_in if len(speeds)), default=0.0) if count else 0.0
    deepest = max((depth(collider, state.x) for collider in model.colliders_at(state.time)), default=0.0)
    kinetic, elastic = body.kinetic_energy(state.v), model.elastic(state.x)
    gravity = model.potential(state.x)
    total = kinetic + elastic + gravity
    momenta = np.concatenate(body.momenta(state.x, state.v)).tolist()
    return (
        step, state.time, kinetic, elastic, gravity, total, count, slowest, deepest, *momenta, state.work,
    )  # fmt: skip


def _came_apart(
    error: SimulationError,
    step: int,
    scene: Scene,
    model: Model,
    time: float,
    writer: Writer | None,
    shown: bool,
) -> CameApart:
    kept = f" What was simulated until then is in {paths.shown(writer.folder)}." if writer else ""
    message = error.message
    if isinstance(error, Exploded):
        message = f"The {model.body.word} of {scene.name!r} exploded at step {step}: {error.how}."
    return CameApart(message, f"{error.hint}{kept}", _uses(scene, model, time, shown), writer is not None)
