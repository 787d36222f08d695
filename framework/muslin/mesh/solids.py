"""Solids from formulas: a block and a ball of tetrahedra.  The same arguments give the same mesh."""

from __future__ import annotations

import itertools

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.shapes import positive
from muslin.mesh.tets import TetMesh, frozen_solid


def block(
    nx: int,
    ny: int,
    nz: int,
    width: float = 1.0,
    height: float = 1.0,
    depth: float = 1.0,
    name: str = "block",
) -> TetMesh:
    """Box around the origin, of cubes cut into six tetrahedra each along the same diagonal.

    Parameters
    ----------
    nx, ny, nz : int
        Vertices along x, y and z, at least 2 each.
    width, height, depth : float
        Along x, y and z [m].
    name : str

    Returns
    -------
    TetMesh
        Vertex i + nx (j + ny k) is number i, j, k along x, y, z; 6 (nx - 1) (ny - 1) (nz - 1) tetrahedra.

    Raises
    ------
    MeshError
        If a size is not positive, or a count below 2.
    """
    positive("block", width=width, height=height, depth=depth)
    X, cells = _unit_block(nx, ny, nz, "block")
    return frozen_solid((X - 0.5) * (width, height, depth), cells, name)


def ball(n: int, radius: float = 1.0, name: str = "ball") -> TetMesh:
    """Ball around the origin: a block of n x n x n vertices, each shell of which is blown up to a sphere.

    Parameters
    ----------
    n : int
        Vertices along an edge of the block, odd and at least 3.
    radius : float
        [m]
    name : str

    Raises
    ------
    MeshError
        If the radius is not positive, or n is not an odd number from 3 on.
    """
    positive("ball", radius=radius)
    if not isinstance(n, (int, np.integer)) or n < 3 or n % 2 == 0:
        raise MeshError(f"ball: n is {n!r}.", "It should be an odd number, at least 3.")
    X, cells = _unit_block(n, n, n, "ball")
    X = 2 * X - 1
    shell = np.abs(X).max(axis=1, keepdims=True)
    length = np.linalg.norm(X, axis=1, keepdims=True)
    X = radius * X * np.where(length > 0, shell / np.where(length > 0, length, 1.0), 0.0)
    return frozen_solid(X, cells, name)


def _unit_block(nx: int, ny: int, nz: int, shape: str) -> tuple[np.ndarray, np.ndarray]:
    for value, what in ((nx, "nx"), (ny, "ny"), (nz, "nz")):
        if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 2:
            raise MeshError(
                f"{shape}: {what} is {value!r}.", "It should be a whole number of vertices, at least 2."
            )
    k, j, i = np.meshgrid(*(np.arange(n) for n in (nz, ny, nx)), indexing="ij")
    X = np.stack([i.ravel() / (nx - 1), j.ravel() / (ny - 1), k.ravel() / (nz - 1)], axis=1)
    stride = np.array([1, nx, nx * ny])
    first = (i + nx * (j + ny * k))[:-1, :-1, :-1].ravel()
    cells = []
    for order in itertools.permutations(range(3)):  # from corner 0 along one axis after the other to corner 7
        path = np.concatenate([[0], np.cumsum(stride[list(order)])])
        odd = np.linalg.det(np.eye(3)[list(order)]) < 0
        cells.append(first[:, None] + (path[[0, 2, 1, 3]] if odd else path))
    return X, np.stack(cells, axis=1).reshape(-1, 4)
