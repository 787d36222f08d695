"""Run a scene: mesh -> model -> steps -> frames.

`simulate` is the one way in, from Python and from the command line alike.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin import mesh as meshes
from muslin.base import handed, paths
from muslin.base.errors import MuslinError
from muslin.mesh import Mesh, Refinement, TetMesh
from muslin.physics.barrier import Barrier
from muslin.physics.body import Body
from muslin.physics.selfcontact import SELF_COLLISION, SelfContact
from muslin.simulation import scenes
from muslin.simulation.adapting import Adapter
from muslin.simulation.marching import Run, march
from muslin.simulation.model import Model, State
from muslin.simulation.runs import RunFolder, Writer
from muslin.simulation.scenes import Scene, idle
from muslin.tasks import Functions, taken


def build(
    scene: Scene,
    functions: Functions | None = None,
    energy: str | None = None,
    hessian: str = "closed",
    mesh: Mesh | TetMesh | None = None,
    stand_ins: Iterable[str] = (),
    x: np.ndarray | None = None,
    pinned: np.ndarray | None = None,
) -> tuple[Model, State]:
    """Model and starting state of a scene, with another mesh than its own if one is given.

    So may be where the vertices x (n, 3) start, and which are pinned.

    The other parameters are those of `simulate`.

    Returns
    -------
    model : Model
    state : State
    """
    mesh = scene.load_mesh() if mesh is None else mesh
    body = scene.body(mesh, functions, energy or _energy(scene, functions), hessian, stand_ins)
    x = _start(scene, mesh) if x is None else x
    pinned = scene.pinned_vertices(mesh) if pinned is None else pinned
    carried = scene.carried

    def pinned_velocity(time: float, dt: float) -> np.ndarray:
        assert carried is not None
        start = x[pinned]
        return (carried(scene, start, time + dt) - carried(scene, start, time)) / dt

    model = Model(
        body,
        gravity=np.asarray(scene.gravity),
        pinned=pinned,
        pinned_velocity=pinned_velocity if carried else None,
        colliders=lambda time: scene.colliders(scene, time),
        wind=scene.wind,
        drag=scene.drag,
        spring=scene.spring(mesh, 0.0),
        pull=lambda time: scene.spring(mesh, time),
        project=scene.project,
        solver=scene.solver,
        contact=scene.contact,
        friction=scene.friction,
        stretch_limit=scene.stretch_limit,
        damping=scene.damping,
        tolerance=scene.tolerance,
        **_apart(scene, body, x),
        lasting=not scene.adaptive,
    )
    v = np.tile(np.asarray(scene.start_velocity, float), (len(x), 1))
    v[pinned] = 0.0
    return model, State(x, v)


def _apart(scene: Scene, body: Body, x: np.ndarray) -> dict[str, Any]:
    """What keeps a scene's body from crossing itself, where the scene wants that, as `Model` takes it."""
    if scene.self_collision == SELF_COLLISION[0]:
        return {}
    if not np.array_equal(body.surface, body.cells):
        raise MuslinError("Self-collision is for cloth; a solid has none.", "Leave self_collision at off.")
    exact = scene.self_collision == "exact"
    contact: Barrier | SelfContact
    if exact:
        contact = Barrier(body.X, body.surface, body.stiffness, scene.self_gap, scene.friction)
    else:
        masses = np.asarray(body.mass.sum(axis=1)).ravel()[::3]
        contact = SelfContact(body.X, body.surface, masses, scene.self_gap)
    if contact.crosses(x):
        raise MuslinError(
            f"The {body.word} of {scene.name!r} crosses itself where it starts: it cannot be kept from that.",
            "Start it elsewhere, or use --set self_collision=off.",
        )
    return {"barrier" if exact else "self_contact": contact}


def _moving(state: State, velocities: np.ndarray, pinned: np.ndarray) -> State:
    """The state with a velocity for each vertex, pinned ones at rest.

    Raises
    ------
    MuslinError
        If there is not one for each, or one is not finite.
    """
    if velocities.shape != state.x.shape or not np.isfinite(velocities).all():
        what = (
            f"the shape {velocities.shape}"
            if velocities.shape != state.x.shape
            else "a number that is not finite"
        )
        raise MuslinError(
            f"start_velocity has {what}.",
            f"Give three numbers, or a finite array {state.x.shape}: one row for each vertex of this mesh.",
        )
    v = velocities.astype(float)
    v[pinned] = 0.0
    return State(state.x, v)


def _start(scene: Scene, mesh: Mesh | TetMesh) -> np.ndarray:
    """Where a mesh's vertices are at the start, (n, 3)."""
    x = np.ascontiguousarray(scene.start(scene, mesh))
    middle = (x.min(axis=0) + x.max(axis=0)) / 2
    return middle + (x - middle) * np.asarray(scene.stretch) if scene.stretch != (1.0, 1.0, 1.0) else x


def adapter_for(
    scene: Scene,
    functions: Functions | None,
    energy: str | None,
    hessian: str,
    mesh: Mesh | TetMesh,
    stand_ins: Iterable[str],
    model: Model,
    start: np.ndarray,
    refined: tuple[Refinement, list[tuple[float, ...]]] | None = None,
) -> Adapter | None:
    """What adapts the mesh of a scene that asks for it."""
    if not scene.adaptive:
        return None
    if not isinstance(mesh, Mesh):
        raise MuslinError("Only cloth can be adaptive; this is a solid.", "Leave adaptive off.")
    if scene.self_collision != SELF_COLLISION[0]:
        raise MuslinError(
            "An adaptive cloth cannot be kept from crossing itself yet: a flipped edge may cut through it.",
            "Use --set adaptive=off, or --set self_collision=off.",
        )

    def rebuilt(mesh: Mesh, x: np.ndarray, pinned: np.ndarray, rho: float) -> Model:
        dense = scene if rho == scene.rho else replace(scene, rho=rho)
        return build(dense, functions, energy, hessian, mesh, tuple(stand_ins), x, pinned)[0]

    return Adapter(scene, mesh, start, model, rebuilt, refined)


def simulate(
    scene: str | Scene,
    *,
    functions: Functions | Path | str | None = None,
    steps: int | None = None,
    mesh: Mesh | TetMesh | tuple[np.ndarray, np.ndarray] | Path | str | None = None,
    energy: str | None = None,
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
        A name from `muslin.simulation.scenes.SCENES`, or a scene of one's own.
    functions : Functions or path, optional
        Whose functions run: a folder of the assignment's files. Default: the framework's own element.
    steps : int, optional
        Time steps; default the scene's.
    mesh : path, Mesh, TetMesh or (vertices, cells), optional
        Another undeformed cloth or solid than the scene's.
    energy : str, optional
        Of cloth see `muslin.physics.cloth.ENERGIES`; default the one that the functions' assignment asks for, and
        without functions the first of these, linearised. Of solids see `muslin.physics.solid.ENERGIES`.
    hessian : {"closed", "lecture"}
    stand_ins : names of tasks
        Whose functions must not be called: native code computes what needs them. `muslin.physics.stand_ins.unusable`
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
        Called before the first step with each thing a person should know of the mesh (see `Scene.remarks`), and with
        each parameter given that has no effect in this scene, which without it is a warning of Python's.
    **parameters
        Any scene parameter: mu, lam, dt, gravity, pinned, scale, sphere, ... `start_velocity` may be an array
        (n, 3), too: a velocity for each vertex [m/s], of which those of pinned ones do not count.

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
        given |= {"energy": energy, "hessian": None if hessian == "closed" else hessian}
        if changed := [name for name, value in given.items() if value is not None]:
            raise MuslinError(f"A resumed run keeps its parameters: {', '.join(changed)} cannot change.")
        return _resume(scene, functions, steps, out, on_step)
    out = None if out is None else handed.path("out", out)
    velocities = None
    if np.ndim(given := parameters.get("start_velocity", 0)) == 2 and not isinstance(given, str):
        velocities = handed.real("start_velocity", parameters.pop("start_velocity"))
    chosen, mesh = _chosen(scene, mesh, parameters if steps is None else parameters | {"steps": steps})
    functions = taken(functions)
    model, state = build(chosen, functions, energy, hessian, mesh, stand_ins)
    if velocities is not None:
        state = _moving(state, velocities, model.pinned)
    own = scene if isinstance(scene, Scene) else scenes.get(scene)
    for remark in idle.remarks(chosen, (n for n in parameters if getattr(chosen, n) != getattr(own, n))):
        if on_notice:
            on_notice(remark)
        else:
            warnings.warn(remark, stacklevel=2)
    if on_notice:
        for remark in chosen.remarks(mesh, model.pinned):
            on_notice(remark)
    shown = chosen.skin(mesh) if display is None else meshes.load(display).scaled(mesh.scale)
    energy = energy or _energy(chosen, functions)
    adapter = adapter_for(chosen, functions, energy, hessian, mesh, stand_ins, model, state.x)
    if out is None:
        return march(chosen, model, state, shown=shown, on_step=on_step, adapter=adapter)
    described = _description(chosen, functions, energy, hessian, model.body.stand_ins)

    def writer() -> Writer:
        opened = Writer(out, described)
        opened.meshes(model.body, model.pinned, shown)
        return opened

    return march(chosen, model, state, writer, shown, on_step, adapter=adapter)


def _energy(scene: Scene, functions: Functions | None) -> str:
    """The energy that the functions' assignment asks for, else the scene's first."""
    return (functions.assignment.energy if functions is not None else "") or scene.ENERGIES[0]


def _chosen(
    scene: str | Scene,
    mesh: Mesh | TetMesh | tuple[np.ndarray, np.ndarray] | Path | str | None,
    parameters: dict[str, Any],
) -> tuple[Scene, Mesh | TetMesh]:
    """The scene with these parameters, and its mesh or the one given, scaled."""
    if isinstance(mesh, (str, Path)):
        parameters, mesh = parameters | {"mesh": str(mesh)}, None
    chosen = (
        scenes.override(scene, **parameters) if isinstance(scene, Scene) else scenes.get(scene, **parameters)
    )
    return chosen, chosen.load_mesh() if mesh is None else chosen.scaled(meshes.taken(mesh, chosen.MESH))


def _description(
    scene: Scene, functions: Functions | None, energy: str, hessian: str, stand_ins: frozenset[str]
) -> dict[str, Any]:
    said = scenes.recorded(scene)
    if scene.mesh != "grid" and Path(scene.mesh).is_file():
        said["parameters"]["mesh"] = str(Path(scene.mesh).resolve())
    return {
        **said,
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
    functions = taken(functions)
    mesh = chosen.MESH.from_arrays(folder.X, folder.triangles if folder.cells is None else folder.cells)
    mesh = replace(mesh, numbers=folder.numbers)
    stand_ins = recorded.get("stand_ins", ())
    model, start = build(chosen, functions, recorded["energy"], recorded["hessian"], mesh, stand_ins)
    state, step = folder.checkpoint()
    shown = None
    if (folder.folder / "display.npz").is_file():
        shown = Mesh.from_arrays(folder.rest, folder.shown_triangles, name="display")
    refined = folder.refined() if chosen.adaptive else None
    adapter = adapter_for(
        chosen, functions, recorded["energy"], recorded["hessian"], mesh, stand_ins, model, start.x, refined
    )
    return march(
        chosen,
        model,
        state,
        lambda: Writer.resumed(folder, step, chosen.steps),
        shown,
        on_step,
        start,
        step,
        adapter,
    )
