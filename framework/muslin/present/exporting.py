"""A run as files for other programs: where runs meet export."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from muslin.base.errors import MuslinError, choices
from muslin.export import FORMATS, Animation, Prop, Shape, Solid, write
from muslin.present.carried import Carried
from muslin.present.pictures import Show
from muslin.present.strain import cell_stress, vertex_strain
from muslin.render import stage
from muslin.render.materials import GROUND
from muslin.simulation.runs import RunFolder


def animation(folder: Path | str) -> Animation:
    """A run as an animation to export: what moves, what it meets and is held by, and the ground."""
    run = RunFolder(folder)
    show = Show(run)
    bodies = [
        [stage.collider_surface(c, c.radius) for c in show.colliders(k)] for k in range(len(show.times))
    ]
    names = [f"{type(c).__name__.lower()}_{number}" for number, c in enumerate(show.colliders(0))]
    props = []
    for number, name in enumerate(names):
        frames = [np.asarray(there[number].vertices) for there in bodies]
        moves = any(not np.array_equal(frames[0], frame) for frame in frames[1:])
        props.append(Prop(name, np.asarray(bodies[0][number].triangles), frames if moves else frames[0]))
    if run.cells is not None:
        props += [
            Prop(wall.name, np.asarray(wall.triangles), np.asarray(wall.vertices))
            for wall in stage.walls(run.X, run.pinned)
        ]
    if run.scene.ground is not None:
        props.append(_ground(show, props, run.scene.ground))
    if run.changes:
        carried = Carried(run)
        rest, triangles = carried.mesh.vertices, carried.mesh.triangles

        def adapted(k: int) -> Shape:
            x, (own, corners) = np.asarray(run.frames[k]), run.mesh_of(k)
            return Shape(x, own, corners, vertex_strain(own, x, corners))

        return Animation(
            show.times, carried, triangles, rest, name=run.scene.name, props=tuple(props),
            strain=lambda k: vertex_strain(rest, carried[k], triangles), adapted=adapted,
        )  # fmt: skip
    return Animation(
        show.times, run.frames, run.shown_triangles, run.rest,
        name=run.scene.name, props=tuple(props), strain=show.strain,
        solid=None if run.solid is None else Solid(run.simulated, run.solid.cells, run.X, cell_stress(run)),
    )  # fmt: skip


def _ground(show: Show, props: list[Prop], height: float) -> Prop:
    """A square of ground: what moves and what it meets have, on each side, as much room again as they take up."""
    points = np.concatenate(
        [show.frames[0], show.frames[show.whole], *(frame for prop in props for frame in prop.frames)]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, 1.5 * (high - low).max()
    corners = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)]) * half + middle[[0, 2]]
    square = np.insert(corners, 1, height, axis=1)
    return Prop("ground", np.array([[0, 1, 2], [0, 2, 3]]), square, str(GROUND.colour))


def export_run(folder: Path | str, to: str | None = None, out: Path | str | None = None) -> list[Path]:
    """Write a run for other programs (see `muslin.FORMATS`, default as `out` ends); returns the files."""
    ending = Path(out).suffix[1:].lower() if out is not None else ""
    to = to or (ending if ending in FORMATS else "glb")
    if to not in FORMATS:
        raise MuslinError(f"There is no export format {to!r}.", choices(to, FORMATS))
    path = out if out is not None else Path(folder) / to / RunFolder(folder).scene.name
    return write(animation(folder), path, to)
