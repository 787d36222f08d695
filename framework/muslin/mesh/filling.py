"""Tetrahedra inside a surface that is given by a signed distance: a lattice, cut where the surface goes through it.

Cube corners and cube centres make the body-centred cubic lattice, whose tetrahedra are all alike and nearly regular.
Its vertices near the surface are moved onto it, so that what is cut off the others is never a sliver, and every
tetrahedron that the surface goes through is cut there.  (After Labelle and Shewchuk, "Isosurface Stuffing", 2007.)
The same function and spacing give the same mesh.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from muslin.mesh.shapes import positive
from muslin.mesh.surface import Mesh
from muslin.mesh.tets import TetMesh, boundary_triangles, signed_volumes

#: Signed distance of points (n, 3) from a surface, negative inside, (n,) [m].
Distance = Callable[[np.ndarray], np.ndarray]

Corner = tuple[float, float, float]

#: A vertex nearer to the surface than this share of the spacing is moved onto it.
NEAR = 0.25


def fill(distance: Distance, low: Corner, high: Corner, spacing: float, name: str = "solid") -> TetMesh:
    """The inside of a surface as tetrahedra.

    Parameters
    ----------
    distance : callable
        Of points (n, 3), negative inside, (n,) [m].
    low, high : (3,)
        Corners of a box around the inside [m].
    spacing : float
        Of the lattice [m].
    name : str

    Raises
    ------
    MeshError
        If the spacing is not positive, or so large that parts hang together by an edge alone.
    """
    positive("fill", spacing=spacing)
    X, cells, _ = _cut(distance, low, high, spacing, np.inf)
    return TetMesh.from_arrays(X, cells, name)


def skin(distance: Distance, low: Corner, high: Corner, spacing: float, name: str = "skin") -> Mesh:
    """The surface itself as triangles: the boundary of `fill`, of which only a layer is made."""
    positive("skin", spacing=spacing)
    X, cells, outer = _cut(distance, low, high, spacing, 3 * spacing)
    triangles = boundary_triangles(cells)
    triangles = triangles[outer[triangles].all(axis=1)]
    used, corners = np.unique(triangles, return_inverse=True)
    return Mesh.from_arrays(X[used], corners.reshape(-1, 3), name)


def _cut(
    distance: Distance, low: Corner, high: Corner, spacing: float, depth: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, right-handed tetrahedra down to a depth, and which vertices lie on the surface."""
    X, cells = _lattice(np.asarray(low, float), np.asarray(high, float), spacing)
    phi = distance(X)
    shallow = (phi[cells].min(axis=1) < NEAR * spacing) & (phi[cells].max(axis=1) > -depth)
    cells = cells[shallow]
    near = np.abs(phi) < NEAR * spacing
    X[near] = onto(distance, X[near], 1e-3 * spacing)
    phi[near] = 0.0
    X, phi, cells = _clipped(distance, X, phi, cells, spacing)
    used, corners = np.unique(cells, return_inverse=True)
    X, cells = X[used], corners.reshape(-1, 4)
    left = signed_volumes(X, cells) < 0
    cells[left] = cells[left][:, [0, 2, 1, 3]]
    return X, cells, phi[used] == 0


def onto(distance: Distance, X: np.ndarray, step: float) -> np.ndarray:
    """Points (n, 3) near the surface, moved onto it."""
    for _ in range(4):
        away = np.stack([distance(X + step * a) - distance(X - step * a) for a in np.eye(3)], axis=1)
        away /= 2 * step
        X = X - (distance(X) / np.maximum((away**2).sum(axis=1), 0.1))[:, None] * away
    return X


def _lattice(low: np.ndarray, high: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and tetrahedra of the lattice in a box, with a cube to spare on every side."""
    cubes = np.ceil((high - low) / spacing).astype(int) + 2
    origin = (low + high) / 2 - spacing * cubes / 2
    corners, centres = (np.indices(cubes + more).reshape(3, -1).T for more in (1, 0))
    X = origin + spacing * np.concatenate([corners, centres + 0.5])

    def corner(at: np.ndarray) -> np.ndarray:
        return np.ravel_multi_index(tuple(at.T), tuple(cubes + 1))

    def centre(at: np.ndarray) -> np.ndarray:
        return len(corners) + np.ravel_multi_index(tuple(at.T), tuple(cubes))

    cells = []
    for axis in range(3):  # two neighbouring centres and an edge of the face between them
        forward, right, up = np.eye(3, dtype=int)[[axis, (axis + 1) % 3, (axis + 2) % 3]]
        first = centres[centres[:, axis] < cubes[axis] - 1]
        face = [corner(first + forward + at) for at in (0 * up, right, right + up, up)]
        for k in range(4):
            cells.append(
                np.stack([centre(first), centre(first + forward), face[k], face[(k + 1) % 4]], axis=1)
            )
    return X, np.concatenate(cells)


def _clipped(
    distance: Distance, X: np.ndarray, phi: np.ndarray, cells: np.ndarray, spacing: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tetrahedra cut at the surface; the new vertices follow the old ones."""
    cells = np.take_along_axis(cells, np.argsort(phi[cells], axis=1, kind="stable"), axis=1)
    sign = np.sign(phi[cells])
    inside, outside = (sign < 0).sum(axis=1), (sign > 0).sum(axis=1)
    crossed = (inside > 0) & (outside > 0)
    pairs = [(i, j) for i, j in itertools.combinations(range(4), 2)]
    edges = np.concatenate([cells[crossed][:, pair] for pair in pairs])
    edges = np.unique(np.sort(edges[phi[edges[:, 0]] * phi[edges[:, 1]] < 0], axis=1), axis=0)
    a, b = edges.T
    share = (phi[a] / (phi[a] - phi[b]))[:, None]
    new = onto(distance, X[a] + share * (X[b] - X[a]), 1e-3 * spacing)
    keys = a.astype(np.int64) * len(X) + b

    def cut(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """The new vertex between vertices i and j; j itself where it lies on the surface."""
        key = np.minimum(i, j).astype(np.int64) * len(X) + np.maximum(i, j)
        return np.where(phi[j] == 0, j, len(X) + np.searchsorted(keys, key))

    found = [cells[(inside > 0) & (outside == 0)]]
    a, b, c, d = cells[inside == 1].T
    found.append(np.stack([a, cut(a, b), cut(a, c), cut(a, d)], axis=1)[phi[d] > 0])
    a, b, c, d = cells[(inside == 2) & (outside == 2)].T
    found.append(_prisms(np.stack([a, cut(a, c), cut(a, d), b, cut(b, c), cut(b, d)], axis=1)))
    a, b, c, d = cells[(inside == 2) & (outside == 1)].T  # c lies on the surface: a pyramid
    turned = a > b
    a, b = np.where(turned, b, a), np.where(turned, a, b)
    found += [np.stack([a, b, cut(b, d), c], axis=1), np.stack([a, cut(b, d), cut(a, d), c], axis=1)]
    a, b, c, d = cells[(inside == 3) & (outside == 1)].T
    found.append(_prisms(np.stack([a, b, c, cut(a, d), cut(b, d), cut(c, d)], axis=1)))
    return np.concatenate([X, new]), np.concatenate([phi, np.zeros(len(new))]), np.concatenate(found)


def _prisms(P: np.ndarray) -> np.ndarray:
    """Three tetrahedra of each prism (m, 6), triangles 0 1 2 and 3 4 5.

    Each of its quadrilaterals is cut at its lowest number, whichever prism it is seen from.
    """
    turns = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4],
                      [3, 4, 5, 0, 1, 2], [4, 5, 3, 1, 2, 0], [5, 3, 4, 2, 0, 1]])  # fmt: skip
    P = np.take_along_axis(P, turns[np.argmin(P, axis=1)], axis=1)
    low = np.minimum(P[:, 1], P[:, 5]) < np.minimum(P[:, 2], P[:, 4])
    one = [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]]
    other = [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]]
    return np.concatenate([P[low][:, rows] for rows in one] + [P[~low][:, rows] for rows in other])
