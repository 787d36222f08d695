"""Strain and stress as a colour: one number for each vertex that is shown."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.mesh import area_and_normal, principal_stretches
from muslin.mesh.tets import furthest_stretches, signed_volumes
from muslin.simulation.runs import RunFolder


def vertex_strain(rest: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Principal stretch furthest from 1, averaged by area onto vertices, (n,) [1]."""
    s = principal_stretches(rest, x, triangles)
    furthest = s[np.arange(len(s)), np.argmax(np.abs(s - 1), axis=1)]
    area, _ = area_and_normal(rest, triangles)
    corners = triangles.ravel()
    weight = np.bincount(corners, np.repeat(area, 3), minlength=len(x))
    return np.bincount(corners, np.repeat(area * furthest, 3), minlength=len(x)) / weight


def solid_strain(rest: np.ndarray, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Principal stretch of tetrahedra furthest from 1, averaged by volume onto vertices, (n,) [1]."""
    return onto_vertices(rest, cells, furthest_stretches(rest, x, cells))


def onto_vertices(rest: np.ndarray, cells: np.ndarray, values: np.ndarray) -> np.ndarray:
    """A number of each tetrahedron, averaged by volume onto vertices, (m,) -> (n,)."""
    volume, corners = signed_volumes(rest, cells), cells.ravel()
    weight = np.bincount(corners, np.repeat(volume, 4), minlength=len(rest))
    total = np.bincount(corners, np.repeat(volume * values, 4), minlength=len(rest))
    return np.asarray(total / weight)


def cell_stress(run: RunFolder) -> Callable[[np.ndarray], np.ndarray]:
    """What gives the von Mises stress of each tetrahedron of a run's solid: positions -> (m,) [Pa].

    Raises
    ------
    MuslinError
        If the run is one of cloth.
    """
    if run.solid is None:
        raise MuslinError(
            f"{paths.shown(run.folder)} is a run of cloth, and stress is shown of solids.",
            "Colour it by its stretch: --strain",
        )
    body = run.scene.body(run.solid, None, run.description["energy"], "closed", ())
    stress: Callable[[np.ndarray], np.ndarray] = body.von_mises  # type: ignore[attr-defined]
    return stress


def vertex_stress(run: RunFolder) -> Callable[[np.ndarray], np.ndarray]:
    """The same, averaged by volume onto vertices, (n,) [Pa]."""
    of_cells, solid = cell_stress(run), run.solid
    assert solid is not None
    return lambda x: onto_vertices(run.X, solid.cells, of_cells(x))
