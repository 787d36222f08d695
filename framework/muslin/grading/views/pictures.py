"""The simulation's last frame: the submission's cloth and the reference's, drawn alike and seen from one place."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from muslin import render, tasks
from muslin.base.errors import MuslinError
from muslin.grading.record import Record
from muslin.physics.colliders import Capsule, Sphere
from muslin.present import pictures as show
from muslin.render import Surface, stage
from muslin.simulation import scenes
from muslin.simulation.scenes import Scene

#: Most vertices and triangles that are drawn, and the furthest place a cloth is drawn at, in sizes of the scene.
MOST, FURTHEST = 200_000, 3.0


def draw(record: Record, size: tuple[int, int] = (640, 480), quality: str = "good") -> tuple[bytes, bytes]:
    """PNG pictures of the submission's cloth and of the reference.

    The renderer compiles and runs in this process, but all it is given is numbers that were checked.

    Parameters
    ----------
    record : Record
    size : (width, height)
        In pixels.
    quality : {"draft", "good", "best"}

    Returns
    -------
    (submission, reference) : bytes

    Raises
    ------
    MuslinError
        If there is nothing that can be drawn; the message is for the report.
    """
    simulation = record.simulation
    if not simulation.positions or not simulation.reference_positions:
        raise MuslinError("There was no run to show.")
    triangles = _table(simulation.triangles, np.int32)
    yours, reference = _table(simulation.positions), _table(simulation.reference_positions)
    if not np.isfinite(reference).all() or reference.shape != yours.shape:
        raise MuslinError("The record's positions do not fit together.")
    if triangles.min() < 0 or triangles.max() >= len(yours):
        raise MuslinError("The record's triangles name vertices that do not exist.")
    made = tasks.assignment(record.assignment["name"]).simulation
    scene = scenes.get(
        simulation.scene, **(made.parameters if made and made.scene == simulation.scene else {})
    )
    if not np.isfinite(yours).all():
        raise MuslinError(f"The {scene.WORD} has blown up: its vertices are at places that are not numbers.")
    time = simulation.reference_energies[-1][0] if simulation.reference_energies else 0.0
    bodies = [b for b in scene.colliders(scene, float(time)) if isinstance(b, (Sphere, Capsule))]
    seen = np.concatenate([reference, *(stage.collider_corners(body) for body in bodies)])
    middle, extent = seen.mean(axis=0), float(np.ptp(seen, axis=0).max())
    near = np.linalg.norm(yours - middle, axis=1) < FURTHEST * extent
    if not near.all():
        raise MuslinError(f"The {scene.WORD} has flown apart: it is nowhere near the reference any more.")
    camera = render.fit_camera(np.concatenate([seen, yours]), scene.view, size)
    around = [_body(body, reference) for body in bodies]
    if scene.ground is not None:
        at = (float(reference[:, 0].mean()), float(reference[:, 2].mean()))
        around.append(stage.ground(scene.ground, center=at))
    cloth = _cloth(scene, triangles, len(reference))
    first, second = (
        _png(render.draw([replace(cloth, vertices=x), *around], camera, size, quality))
        for x in (yours, reference)
    )
    return first, second


def _table(rows: Sequence[Sequence[float]], dtype: type = np.float64) -> NDArray:
    if not 0 < len(rows) <= MOST:
        raise MuslinError(f"There are {len(rows)} rows in a table of the record; 1 to {MOST} can be drawn.")
    try:
        table: NDArray = np.array([[np.nan if v is None else v for v in row] for row in rows], dtype=dtype)
    except (ValueError, TypeError, OverflowError):
        raise MuslinError("A table of the record does not hold numbers.") from None
    if table.shape != (len(rows), 3):
        raise MuslinError(f"A table of the record has shape {table.shape} instead of (n, 3).")
    return table


def _cloth(scene: Scene, triangles: NDArray, count: int) -> Surface:
    """The cloth without its vertices: woven where the scene's mesh tells how the threads run, plain elsewhere."""
    rest = None
    if scene.mesh == "grid" and count >= 4:
        rest = scenes.override(scene, resolution=math.isqrt(count)).load_mesh()
    if rest is not None and len(rest.vertices) == count and np.array_equal(rest.triangles, triangles):
        return Surface(None, triangles, replace(render.CLOTH, back=show.BACK), stage.pattern(rest.vertices))
    plain = render.Material("solid", render.CLOTH.colour, back=show.BACK, sheen=render.CLOTH.sheen)
    return Surface(None, triangles, plain)


def _body(body: Sphere | Capsule, cloth: NDArray) -> Surface:
    """A collider, as much smaller as the reference's cloth sinks into it."""
    if isinstance(body, Capsule):
        return stage.collider_surface(body, 0.97 * body.radius)
    nearest = np.linalg.norm(cloth - np.asarray(body.center), axis=1).min()
    radius = min(max(nearest - 0.01 * body.radius, 0.9 * body.radius), 0.99 * body.radius)
    return stage.collider_surface(body, radius)


def _png(image: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(image).save(file, format="PNG", optimize=True)
    return file.getvalue()
