"""Cells as VTK's files hold them, old and new: which are faces of a surface, and in which order their corners are."""

from __future__ import annotations

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons, strip_triangles

# Numbers of cell types, from vtkCellType.h.
TRIANGLE, STRIP, POLYGON, PIXEL, QUAD, TETRA = 5, 6, 7, 8, 9, 10
_FACES = {TRIANGLE: 3, POLYGON: None, PIXEL: 4, QUAD: 4}  # type -> corners
_CURVED = {
    22: "triangle6", 23: "quad8", 28: "quad9", 30: "quad6", 34: "triangle7", 36: "polygon of second order",
    69: "Lagrange triangle", 70: "Lagrange quad", 76: "Bezier triangle", 77: "Bezier quad",
}  # fmt: skip
_OTHERS = {
    1: "vertex", 2: "vertex", 3: "line", 4: "line", 10: "tetra", 11: "voxel", 12: "hexahedron", 13: "wedge",
    14: "pyramid", 15: "prism", 16: "prism", 21: "line3", 24: "tetra10", 25: "hexahedron20", 26: "wedge15",
    27: "pyramid13", 29: "hexahedron27", 35: "line4", 42: "polyhedron", 71: "Lagrange tetra",
}  # fmt: skip


def from_cells(
    points: np.ndarray, types: np.ndarray, offsets: np.ndarray, connectivity: np.ndarray, file: str
) -> Polygons:
    """Polygons of cells.

    Parameters
    ----------
    points : (n, 3)
    types : (c,) int
        Of each cell, as vtkCellType.h numbers them.
    offsets : (c + 1,) int
        Where each cell begins in `connectivity`, and where the last ends.
    connectivity : (k,) int
        The corners of all cells.
    file : str

    Raises
    ------
    ValueError
        If the arrays do not fit each other.
    MeshError
        If there are curved faces.
    """
    types, offsets, connectivity = (np.asarray(a, dtype=np.int64) for a in (types, offsets, connectivity))
    sizes = np.diff(offsets)
    if len(offsets) != len(types) + 1:
        raise ValueError(f"{len(types)} cell types for {len(offsets) - 1} cells")
    if len(types) and (offsets[0] < 0 or offsets[-1] > len(connectivity) or (sizes < 0).any()):
        raise ValueError(f"the cells have {offsets[-1]} corners and {len(connectivity)} are there")
    if len(types) and not 0 <= types.min() <= types.max() < 256:
        raise ValueError("a cell type outside 0 to 255")
    faces: list[tuple[np.ndarray, np.ndarray]] = []
    ignored: dict[str, int] = {}
    ignored_points = [np.zeros(0, dtype=np.int64)]
    tetrahedra = None
    for kind in np.unique(types).tolist():
        cells = np.flatnonzero(types == kind)
        if kind in _CURVED:
            raise MeshError(
                f"{file} has {len(cells)} curved face{'s' * (len(cells) != 1)} ({_CURVED[kind]}).",
                "Muslin's triangles are straight: save the mesh with first-order elements.",
            )
        if kind == STRIP:
            faces += _strips(cells, offsets, connectivity)
        elif kind in _FACES:
            faces += _groups(kind, cells, sizes, offsets, connectivity)
        else:
            name = _OTHERS.get(kind, f"type {kind}")
            ignored[name] = ignored.get(name, 0) + len(cells)
            used = [corners for _, corners in _by_size(cells, sizes, offsets, connectivity)]
            ignored_points += [corners.ravel() for corners in used]
            if kind == TETRA:
                if len(used) != 1 or used[0].shape[1] != 4:
                    raise ValueError("a tetrahedron without four corners")
                tetrahedra = used[0]
    return Polygons(
        points, faces, ignored=ignored, ignored_points=np.concatenate(ignored_points), tetrahedra=tetrahedra
    )


def _groups(
    kind: int, cells: np.ndarray, sizes: np.ndarray, offsets: np.ndarray, connectivity: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    wanted = _FACES[kind]
    groups = []
    for rows, corners in _by_size(cells, sizes, offsets, connectivity):
        k = corners.shape[1]
        if k < 3 or (wanted and k != wanted):
            raise ValueError(f"cell {rows[0]} of type {kind} has {k} corners")
        # A pixel's corners are counted row by row, not around.
        groups.append((rows, corners[:, [0, 1, 3, 2]] if kind == PIXEL else corners))
    return groups


def _by_size(
    cells: np.ndarray, sizes: np.ndarray, offsets: np.ndarray, connectivity: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Corners of these cells, grouped by how many they have."""
    groups = []
    for k in np.unique(sizes[cells]).tolist():
        rows = cells[sizes[cells] == k]
        groups.append((rows, connectivity[offsets[rows, None] + np.arange(k)]))
    return groups


def _strips(
    cells: np.ndarray, offsets: np.ndarray, connectivity: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    made = [strip_triangles(connectivity[offsets[cell] : offsets[cell + 1]]) for cell in cells]
    return [(np.full(len(t), cell), t) for cell, t in zip(cells, made, strict=True) if len(t)]
