"""A finer display mesh carried on a coarse simulation mesh: x(X) = N(X) q at every display vertex (S2)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from muslin.physics.roles import Roles, checked
from muslin.tasks import Functions

if TYPE_CHECKING:
    from muslin.mesh import Mesh, TetMesh

#: Tasks behind each part of carrying a finer mesh.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType({"binding": ("phi",), "carrying": ("interpolate",)})


@dataclass(frozen=True)
class Skin:
    """Where each display vertex sits: a cell (k, 3 or 4 vertex numbers) and its shape functions, as many."""

    corners: np.ndarray
    phi: np.ndarray
    functions: Functions | None = None

    def carry(self, q: np.ndarray) -> np.ndarray:
        """Positions or velocities (k, 3) of the display vertices, from those of the simulation's (n, 3)."""
        x = {f"x{k}": q[corner] for k, corner in enumerate(self.corners.T)}
        if self.functions is not None:
            from muslin.tasks.batch import evaluate

            return evaluate(self.functions.interpolate, phi=self.phi, **x)
        return np.einsum("kc,ckd->kd", self.phi, np.stack(list(x.values())))


def bind(
    display: Mesh, mesh: Mesh | TetMesh, functions: Functions | None = None, stand_ins: Iterable[str] = ()
) -> Skin:
    """Bind a display mesh to a simulation mesh, both undeformed.

    Each display vertex goes to the nearest triangle, and keeps its barycentric coordinates there (of the
    nearest point of the triangle's plane: beside the mesh they extrapolate), by the student's `phi` where
    functions are given; in a solid to the tetrahedron it lies in, or least outside. Native code stands in for the
    tasks named in `stand_ins`.
    """
    from muslin.mesh import TetMesh

    roles = Roles(functions, checked(stand_ins, functions))
    X = display.vertices
    if isinstance(mesh, TetMesh):
        corners = mesh.cells[_nearest_tetrahedron(X, mesh)]
    else:
        corners = mesh.triangles[_nearest_triangle(X, mesh)]
    rest = {f"X{k}": mesh.vertices[corner] for k, corner in enumerate(corners.T)}
    if students := roles.calling(NEEDS["binding"]):
        from muslin.tasks.batch import evaluate

        phi = evaluate(students.phi, X=X, **rest)
    else:
        others = _others(X, np.stack(list(rest.values())))
        phi = np.stack([_first(others), *others], axis=1)
    return Skin(corners, phi, roles.calling(NEEDS["carrying"]))


def _others(X: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """How much of each corner but the first of cells (3 or 4, k, 3) there is in points (k, 3), one row per corner.

    Barycentric coordinates as ratios of signed areas and volumes; the first corner has what is left.
    """
    first, a, b = corners[0], corners[1] - corners[0], corners[2] - corners[0]
    d = X - first
    if len(corners) == 3:
        m = np.cross(a, b)
        total = np.einsum("ij,ij->i", m, m)
        rows = [np.einsum("ij,ij->i", np.cross(*pair), m) / total for pair in ((d, b), (a, d))]
    else:
        c = corners[3] - first
        total = np.einsum("ij,ij->i", np.cross(a, b), c)
        three = ((d, b, c), (a, d, c), (a, b, d))
        rows = [np.einsum("ij,ij->i", np.cross(p, q), r) / total for p, q, r in three]
    return np.stack(rows)


def _first(others: np.ndarray) -> np.ndarray:
    """How much of the first corner there is."""
    rest = 1 - others[0]
    for row in others[1:]:
        rest = rest - row
    return rest


def _least(X: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The smallest of the barycentric coordinates: below zero outside."""
    others = _others(X, corners)
    return np.minimum(_first(others), others.min(axis=0))


def _nearest_tetrahedron(points: np.ndarray, mesh: TetMesh, candidates: int = 24) -> np.ndarray:
    """The tetrahedron (k,) each point is in; or least outside, among the `candidates` with the nearest centroids."""
    from scipy.spatial import cKDTree

    corners = mesh.vertices[mesh.cells]
    count = min(candidates, len(corners))
    _, near = cKDTree(corners.mean(axis=1)).query(points, k=count)
    near = np.asarray(near).reshape(len(points), count)
    best, deepest = near[:, 0].copy(), np.full(len(points), -np.inf)
    for column in near.T:
        least = _least(points, corners[column].swapaxes(0, 1))
        deeper = least > deepest + 1e-12
        best[deeper], deepest[deeper] = column[deeper], least[deeper]
    if len(
        lost := np.flatnonzero(deepest < -1e-9)
    ):  # outside of all, or in a large one whose centroid is far
        which, cells = _within(points[lost], corners, np.zeros(len(lost)))
        if len(which):
            there = points[lost][which]
            least = _least(there, corners[cells].swapaxes(0, 1))
            inside = least >= 0
            best[lost[which[inside]]] = cells[inside]
    return best


def _within(points: np.ndarray, corners: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of a point (k, 3) and a cell, by its corners (m, c, 3), whose bounding sphere is within its reach (k,).

    Returns
    -------
    point, cell : (pairs,) int arrays
        Sorted by point.
    """
    from scipy.spatial import cKDTree

    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    found: list[tuple[np.ndarray, np.ndarray]] = []
    # cells of similar size share a tree: in a graded mesh a reach for the largest would meet all of the smallest
    sizes = np.ceil(np.log2(radii / radii.max())).astype(int)
    for size in np.unique(sizes):
        cells = np.flatnonzero(sizes == size)
        largest = float(radii[cells].max())
        near = cKDTree(centres[cells]).query_ball_point(points, reach + largest * (1 + 1e-9))
        count = np.array([len(numbers) for numbers in near], dtype=int)
        flat = np.fromiter((number for numbers in near for number in numbers), dtype=int, count=count.sum())
        found.append((np.repeat(np.arange(len(points)), count), cells[flat]))
    point, cell = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(point, kind="stable")
    return point[order], cell[order]


#: Points looked for at a time.
BATCH = 20_000


def _nearest_triangle(points: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Nearest triangle (k,) of each point; of several, the one with the nearest centroid."""
    from scipy.spatial import cKDTree

    corners, best = mesh.vertices[mesh.triangles], np.empty(len(points), dtype=int)
    reach, _ = cKDTree(mesh.vertices[np.unique(mesh.triangles)]).query(points)
    centres = corners.mean(axis=1)
    for begin in range(0, len(points), BATCH):
        part = slice(begin, begin + BATCH)
        point, cell = _within(points[part], corners, np.asarray(reach)[part])
        there = points[part][point]
        off = _distances(there, *(corners[cell, k] for k in range(3)))
        starts = np.flatnonzero(np.diff(point, prepend=-1))
        least = np.minimum.reduceat(off, starts)
        kept = np.flatnonzero(off <= least[point] + 1e-12)
        to_centre = np.linalg.norm(there[kept] - centres[cell[kept]], axis=1)
        order = kept[np.lexsort((to_centre, point[kept]))]
        best[part] = cell[order[np.flatnonzero(np.diff(point[order], prepend=-1))]]
    return best


def _distances(p: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Distance of points (k, 3) from triangles: from the plane where they are above it, else from the nearest side."""
    m = np.cross(b - a, c - a)
    height = np.abs(np.einsum("ij,ij->i", p - a, m)) / np.linalg.norm(m, axis=1)
    sides = []
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        share = np.einsum("ij,ij->i", p - start, edge) / np.einsum("ij,ij->i", edge, edge)
        sides.append(np.linalg.norm(p - start - np.clip(share, 0, 1)[:, None] * edge, axis=1))
    above = _least(p, np.stack([a, b, c])) >= 0
    return np.where(above, height, np.minimum.reduce(sides))
