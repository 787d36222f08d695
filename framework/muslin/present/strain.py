"""Strain as a colour: one number for each vertex that is shown."""

from __future__ import annotations

import numpy as np

from muslin.mesh import area_and_normal, principal_stretches
from muslin.mesh.tets import furthest_stretches, signed_volumes


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
    volume, corners = signed_volumes(rest, cells), cells.ravel()
    weight = np.bincount(corners, np.repeat(volume, 4), minlength=len(x))
    total = np.repeat(volume * furthest_stretches(rest, x, cells), 4)
    return np.asarray(np.bincount(corners, total, minlength=len(x)) / weight)
