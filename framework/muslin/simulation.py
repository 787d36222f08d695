"""Run a scene: mesh -> model -> steps -> frames.

`simulate` is the one way in, from Python and from the command line alike.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin import colliders, paths, scenes, skinning
from muslin import mesh as meshes
from muslin.body import Body
from muslin.cloth import Cloth
from muslin.colliders import approach, depth
from muslin.errors import MuslinError, SimulationError
from muslin.integrators import Exploded, Model, Spring, State, steps
from muslin.mesh import Mesh
from muslin.runs import RunFolder, Writer, as_table
from muslin.scenes import Scene
from muslin.skinning import bind
from muslin.tasks import Functions, load


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
        One row per step, the start included: step, time, kinetic, elastic, gravity [J], contacts
        (vertices pressed against a collider), approach (smallest n^T v of those in contact after the filter
        [m/s]), penetration (deepest vertex [m]).
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
        from muslin.notebook.shows import run_html

        return run_html(self)


def build(
    scene: Scene,
    functions: Functions | None = None,
    energy: str = "linearised",
    hessian: str = "closed",
    mesh: Mesh | None = None,
    stand_ins: Iterable[str] = (),
) -> tuple[Model, State]:
    """Model and starting state of a scene, with another mesh than its own if one is given.

    The other parameters are those of `simulate`.

    Returns
    -------
    model : Model
    state : State
    """
    mesh = scene.load_mesh() if mesh is None else mesh
    mu, lam = scene.lame
    cloth = Cloth(
        mesh,
        mu=mu,
        lam=lam,
        rho=scene.rho,
        h=scene.h,
        functions=functions,
        energy=energy,
        hessian=hessian,
        stand_ins=stand_ins,
    )
    x = np.ascontiguousarray(scene.start(scene, mesh))
    middle = (x.min(axis=0) + x.max(axis=0)) / 2
    x = middle + (x - middle) * np.asarray(scene.stretch) if scene.stretch != (1.0, 1.0, 1.0) else x
    held = scene.pinned_vertices(mesh)
    carried = scene.carried

    def held_velocity(time: float, dt: float) -> np.ndarray:
        assert carried is not None
        start = x[held]
        return (carried(scene, start, time + dt) - carried(scene, start, time)) / dt

    model = Model(
        cloth,
        gravity=np.asarray(scene.gravity),
        held=held,
        held_velocity=held_velocity if carried else None,
        colliders=lambda time: scene.colliders(scene, time),
        wind=scene.wind,
        drag=scene.drag,
        spring=_spring(scene, mesh),
        project=scene.project,
        solver=scene.solver,
        contact=scene.contact,
        stretch_limit=scene.stretch_limit,
        tolerance=scene.tolerance,
    )
    v = np.tile(np.asarray(scene.start_velocity, float), (len(x), 1))
    v[held] = 0.0
    return model, State(x, v)


def _spring(scene: Scene, mesh: Mesh) -> Spring | None:
    if scene.drag_vertex < 0:
        return None
    return Spring(int(mesh.find(scene.drag_vertex)[0]), scene.drag_to, scene.drag_stiffness)


def simulate(
    scene: str | Scene,
    *,
    functions: Functions | Path | str | None = None,
    steps: int | None = None,
    mesh: Mesh | tuple[np.ndarray, np.ndarray] | Path | str | None = None,
    energy: str = "linearised",
    hessian: str = "closed",
    stand_ins: Iterable[str] = (),
    display: Path | str | None = None,
    out: Path | str | None = None,
    resume: bool = False,
    on_step: Callable[[int, int], None] | None = None,
    on_notice: Callable[[str], None] | None = None,
    **parameters: Any,
) -> Run:
    """Simulate a scene.

    Parameters
    ----------
    scene : str or Scene
        A name from `muslin.scenes.SCENES`.
    functions : Functions or path, optional
        Whose functions run: a folder of the assignment's files. Default: the framework's own element.
    steps : int, optional
        Time steps; default the scene's.
    mesh : path, Mesh or (vertices, triangles), optional
        Another undeformed cloth than the scene's.
    energy : {"linearised", "area", "volumetric"}
    hessian : {"closed", "lecture"}
    stand_ins : names of tasks
        Whose functions must not be called: native code computes what needs them. `muslin.stand_ins.unusable`
        lists those a folder does not have.
    display : path, optional
        A finer mesh to carry along and show, in the same undeformed space.
    out : path, optional
        Folder to write the run to; an earlier run there is replaced.
    resume : bool
        Go on from the checkpoint in `out` instead; scene and parameters are the ones recorded there.
    on_step : callable, optional
        Called as (step, steps) after every step.
    on_notice : callable, optional
        Called before the first step with each thing a person should know of the mesh; see `Scene.remarks`.
    **parameters
        Any scene parameter: mu, lam, dt, gravity, pinned, scale, sphere, ...

    Returns
    -------
    Run

    Raises
    ------
    SimulationError
        If it blows up; what was written so far stays usable.
    MuslinError
        For a scene, parameter, mesh or folder that does not exist or make sense.
    """
    if resume:
        given = {"mesh": mesh, "display": display, "stand_ins": tuple(stand_ins) or None, **parameters}
        if (energy, hessian) != ("linearised", "closed"):
            given |= {"energy": energy, "hessian": hessian}
        if changed := [name for name, value in given.items() if value is not None]:
            raise MuslinError(f"A resumed run keeps its parameters: {', '.join(changed)} cannot change.")
        return _resume(scene, functions, steps, out, on_step)
    chosen, mesh = _chosen(scene, mesh, parameters if steps is None else parameters | {"steps": steps})
    functions = load(functions) if isinstance(functions, (str, Path)) else functions
    model, state = build(chosen, functions, energy, hessian, mesh, stand_ins)
    if on_notice:
        for remark in chosen.remarks(mesh, model.held):
            on_notice(remark)
    shown = meshes.load(display).scaled(mesh.scale) if display is not None else None
    if out is None:
        return march(chosen, model, state, shown=shown, on_step=on_step)
    _require_repeatable(chosen)

    def writer() -> Writer:
        opened = Writer(out, _description(chosen, functions, energy, hessian, model.body.stand_ins))
        opened.meshes(model.body.mesh, model.held, shown)
        return opened

    return march(chosen, model, state, writer, shown, on_step)


def _chosen(
    scene: str | Scene,
    mesh: Mesh | tuple[np.ndarray, np.ndarray] | Path | str | None,
    parameters: dict[str, Any],
) -> tuple[Scene, Mesh]:
    """The scene with these parameters, and its mesh or the one given, scaled."""
    if isinstance(mesh, (str, Path)):
        parameters, mesh = parameters | {"mesh": str(mesh)}, None
    chosen = (
        scenes.get(scene, **parameters) if isinstance(scene, str) else scenes.override(scene, **parameters)
    )
    if isinstance(mesh, tuple):
        mesh = Mesh.from_arrays(*mesh)
    return chosen, chosen.load_mesh() if mesh is None else chosen.scaled(mesh)


def _require_repeatable(scene: Scene) -> None:
    """Only scenes that can be found again by name can be written: a run records the name and the parameters."""
    if scene.name not in scenes.SCENES or scenes.get(scene.name, **scene.parameters()) != scene:
        raise MuslinError(
            f"The scene {scene.name!r} is not one of Muslin's, so a run of it could not be read back.",
            "Add it to muslin/scenes, or simulate without out=.",
        )


def _description(
    scene: Scene, functions: Functions | None, energy: str, hessian: str, stand_ins: frozenset[str]
) -> dict[str, Any]:
    parameters = scene.parameters()
    if scene.mesh != "grid" and Path(scene.mesh).is_file():
        parameters["mesh"] = str(Path(scene.mesh).resolve())
    return {
        "scene": scene.name,
        "parameters": parameters,
        "functions": str(functions.folder.resolve()) if functions else None,
        "energy": energy,
        "hessian": hessian,
        "stand_ins": sorted(stand_ins),
    }


def _resume(
    scene: str | Scene,
    functions: Functions | Path | str | None,
    steps: int | None,
    out: Path | str | None,
    on_step: Callable[[int, int], None] | None,
) -> Run:
    if out is None:
        raise MuslinError("To resume, name the folder of the run.", "Use --out DIR --resume.")
    folder = RunFolder(out)
    recorded = folder.description
    if isinstance(scene, str) and scene != recorded["scene"]:
        raise MuslinError(f"{paths.shown(out)} holds the scene {recorded['scene']!r}, not {scene!r}.")
    chosen = folder.scene if steps is None else replace(folder.scene, steps=steps)
    if functions is None and recorded["functions"]:
        functions = recorded["functions"]
    functions = load(functions) if isinstance(functions, (str, Path)) else functions
    mesh = replace(Mesh.from_arrays(folder.X, folder.triangles), numbers=folder.numbers)
    stand_ins = recorded.get("stand_ins", ())
    model, start = build(chosen, functions, recorded["energy"], recorded["hessian"], mesh, stand_ins)
    state, step = folder.checkpoint()
    shown = None
    if (folder.folder / "display.npz").is_file():
        shown = Mesh.from_arrays(folder.rest, folder.shown_triangles, name="display")
    return march(
        chosen, model, state, lambda: Writer.resumed(folder, step, chosen.steps), shown, on_step, start, step
    )


def march(
    scene: Scene,
    model: Model,
    state: State,
    open_writer: Callable[[], Writer] | None = None,
    shown: Mesh | None = None,
    on_step: Callable[[int, int], None] | None = None,
    start: State | None = None,
    step: int = 0,
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
    """
    body, first, interrupted = model.body, start or state, False
    skin = bind(shown, body.mesh, body.functions, body.stand_ins) if shown is not None else None
    with np.errstate(invalid="ignore", over="ignore"):
        states = steps(model, state, scene.dt, scene.integrator, scene.steps - step)
        next(states)
        row = _row(model, state, step)
        following = _tried(states)
        writer = open_writer() if open_writer else None
        rows: list[tuple[float, ...]] = writer.rows if writer else []

        def record(row: tuple[float, ...]) -> None:
            rows.append(row)
            if writer and (step % scene.frame_every == 0 or step == scene.steps):
                writer.frame(step, state, skin.carry(state.x) if skin else None)

        try:
            if step == 0:
                record(row)
            for state in following:
                step += 1
                record(_row(model, state, step))
                if on_step:
                    on_step(step, scene.steps)
        except Exploded as error:
            raise _blown_up(error, step + 1, scene, writer) from None
        except KeyboardInterrupt:
            interrupted = True
        finally:
            if writer:
                writer.close()
    return Run(
        state.x, state.v, first.x, first.v, as_table(rows), scene, body.mesh, body,
        writer.folder if writer else None, interrupted, _uses(model, state.time, skin is not None),
    )  # fmt: skip


def _tried(states: Iterator[State]) -> Iterator[State]:
    """The same states, the first of them computed now; should it explode, that is said when it is asked for."""
    try:
        first = [next(states)]
    except StopIteration:
        return iter(())
    except Exploded as error:
        return _raising(error)
    return itertools.chain(first, states)


def _raising(error: Exception) -> Iterator[State]:
    raise error
    yield


def _uses(model: Model, time: float, shown: bool) -> frozenset[str]:
    """Tasks whose functions a run calls."""
    roles = model.body.roles
    called = {name for part in ("detection", "response") for name in roles.called(colliders.NEEDS[part])}
    met = called if model.colliders(time) else set()
    carried = {name for names in skinning.NEEDS.values() for name in roles.called(names)} if shown else set()
    return model.body.uses | met | carried


def _row(model: Model, state: State, step: int) -> tuple[float, ...]:
    body = model.body
    pressed = [approach(state.v, contact) for contact in state.contacts]
    count = int(sum((speeds < 1e-6).sum() for speeds in pressed))
    slowest = min((float(speeds.min()) for speeds in pressed if len(speeds)), default=0.0) if count else 0.0
    deepest = max((depth(collider, state.x) for collider in model.colliders_at(state.time)), default=0.0)
    kinetic, elastic = body.kinetic_energy(state.v), body.energy_here()
    gravity = model.potential(state.x)
    total = kinetic + elastic + gravity
    return (step, state.time, kinetic, elastic, gravity, total, count, slowest, deepest)


def _blown_up(error: Exploded, step: int, scene: Scene, writer: Writer | None) -> SimulationError:
    kept = f" What was simulated until then is in {paths.shown(writer.folder)}." if writer else ""
    return SimulationError(
        f"The cloth of {scene.name!r} exploded at step {step}: {error.how}.", f"{error.hint}{kept}"
    )
