"""Tetrahedral meshes: the mesh of a solid, what it must satisfy, and its surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.checks import FLATTEST, SMALLEST, Places, check_coordinates, counted, listed, refuse
from muslin.mesh.surface import Mesh, find, flat_to_3d, frozen, indices, numbers_of

#: Corners of the four faces of a tetrahedron, seen from outside counterclockwise; face i lies opposite corner i.
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True, eq=False)
class TetMesh:
    """An undeformed solid.

    Parameters
    ----------
    vertices : (n, 3) float64
        Undeformed positions X [m].
    cells : (m, 4) int32
        Vertices of each tetrahedron, x1 - x0, x2 - x0, x3 - x0 right-handed.
    name : str
    notices : tuple of str
        What was changed or left out on the way in, for a person to read.
    numbers : (n,) int, optional
        What the file calls each vertex, counting from 0, where some of its vertices were left out.
    scale : float
        What the file's coordinates were multiplied with.

    Notes
    -----
    `TetMesh.from_arrays`, `load_tets` and the generators check what they return; their arrays are read-only.
    """

    vertices: np.ndarray
    cells: np.ndarray
    name: str = "solid"
    notices: tuple[str, ...] = ()
    numbers: np.ndarray | None = None
    scale: float = 1.0

    @classmethod
    def from_arrays(cls, vertices: Any, cells: Any, name: str = "solid") -> TetMesh:
        """Convert and check.

        Parameters
        ----------
        vertices : (n, 3) array-like of numbers
            Positions [m].
        cells : (m, 4) array-like of whole numbers
            Vertex indices from 0. If all are left-handed, all are turned, with a notice.
        name : str

        Raises
        ------
        MeshError
            If the arrays are not of these shapes and kinds, or the mesh cannot be a solid (see `check_solid`).
        """
        title = f"Mesh {str(name)!r}"
        X, notices = flat_to_3d(numbers_of(vertices, title, "vertices"), title)
        T = indices(cells, title, "tetrahedra", 4)
        places = Places(title, file=False, kind="tetrahedron")
        T, turned = turned_outwards(X, T, places)
        check_solid(X, T, places)
        return frozen_solid(X, T, str(name), (*notices, *turned))

    @cached_property
    def volumes(self) -> np.ndarray:
        """Volume of each tetrahedron, (m,) [m^3]."""
        return signed_volumes(self.vertices, self.cells)

    @cached_property
    def surface(self) -> np.ndarray:
        """Triangles of the boundary, (t, 3) int32, counterclockwise seen from outside."""
        return boundary_triangles(self.cells)

    @property
    def triangles(self) -> np.ndarray:
        """What is seen of it: its surface."""
        return self.surface

    def find(self, numbers: Any) -> np.ndarray:
        """Indices of vertices by their numbers in the file; see `Mesh.find`."""
        return find(self, numbers, "tetrahedron")

    def called(self, indices: np.ndarray) -> list[int]:
        """Numbers in the file of vertices by their indices: the inverse of `find`."""
        return list(map(int, indices if self.numbers is None else self.numbers[indices]))

    def shell(self) -> Mesh:
        """The boundary as a mesh of its own; `numbers` says which vertex of the solid each of its vertices is."""
        used, corners = np.unique(self.surface, return_inverse=True)
        return frozen(self.vertices[used], corners.reshape(-1, 3), self.name, self.notices, used)

    def scaled(self, factor: float) -> TetMesh:
        """The mesh, this many times as large.

        Raises
        ------
        MeshError
            If it cannot be a solid at that size.
        """
        if factor == 1.0:
            return self
        X = self.vertices * factor
        title = f"Mesh {self.name!r}, scaled by {factor:g}"
        check_solid(X, self.cells, Places(title, file=False, kind="tetrahedron"))
        made = frozen_solid(X, self.cells, self.name, self.notices, self.numbers)
        return replace(made, scale=self.scale * factor)

    @property
    def extent(self) -> float:
        """Length of the longest side of the box around the mesh [m]."""
        return float(np.ptp(self.vertices, axis=0).max())


def signed_volumes(vertices: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume of each tetrahedron, negative where it is left-handed, (m,) [m^3]."""
    x0, x1, x2, x3 = np.moveaxis(np.asarray(vertices, dtype=np.float64)[cells], 1, 0)
    return np.einsum("mk,mk->m", np.cross(x1 - x0, x2 - x0), x3 - x0) / 6


def deformation_gradients(X: np.ndarray, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """F of each tetrahedron between undeformed and deformed positions, (m, 3, 3)."""
    rest, now = (np.moveaxis(p[cells[:, 1:]] - p[cells[:, :1]], 1, 2) for p in (X, x))
    return np.asarray(now @ np.linalg.inv(rest))


def furthest_stretches(X: np.ndarray, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Principal stretch of each tetrahedron that is furthest from 1, (m,) [1]."""
    s = np.linalg.svd(deformation_gradients(X, x, cells), compute_uv=False)
    return np.asarray(s[np.arange(len(s)), np.argmax(np.abs(s - 1), axis=1)])


def boundary_triangles(cells: np.ndarray) -> np.ndarray:
    """Faces that belong to one tetrahedron only, (t, 3) int32, turned outwards, in the order of the cells."""
    faces = np.asarray(cells)[:, FACES].reshape(-1, 3)
    _, inverse, times = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    return np.ascontiguousarray(faces[times[inverse.ravel()] == 1], dtype=np.int32)


def frozen_solid(
    vertices: np.ndarray,
    cells: np.ndarray,
    name: str,
    notices: tuple[str, ...] = (),
    numbers: np.ndarray | None = None,
) -> TetMesh:
    """TetMesh of private, read-only copies of these (checked) arrays."""
    X, T = np.array(vertices, dtype=np.float64, order="C"), np.array(cells, dtype=np.int32, order="C")
    X.setflags(write=False)
    T.setflags(write=False)
    return TetMesh(X, T, name, notices, numbers)


def turned_outwards(
    vertices: np.ndarray, cells: np.ndarray, places: Places
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Right-handed tetrahedra of left-handed ones, with a notice, if all are: programs differ in this."""
    check_cells(vertices, cells, places)
    if (signed_volumes(vertices, cells) < 0).all():
        what = counted(len(cells), "tetrahedron is", "tetrahedra are")
        return cells[:, [0, 2, 1, 3]], (f"{places.mesh}: {what} left-handed: two corners of each exchanged.",)
    return cells, ()


def check_cells(vertices: np.ndarray, cells: np.ndarray, places: Places) -> None:
    """Refuse what has no volumes to speak of: no or impossible vertices, no tetrahedra, indices out of range."""
    check_coordinates(vertices, places)
    n = len(vertices)
    if len(cells) == 0:
        raise MeshError(
            f"{places.mesh} has no tetrahedra.",
            places.advice("Export the solid, not only its surface.", "Give it at least one tetrahedron."),
        )
    wrong: np.ndarray = (cells < 0) | (cells >= n)
    refuse(
        np.asarray(wrong.any(axis=1)),
        lambda e: (
            f"{places.face(e)}, which asks for vertex {places.number(int(cells[e][np.argmax(wrong[e])]))}"
        ),
        lambda k: (
            f"{places.mesh}: {counted(k, 'tetrahedron uses', 'tetrahedra use')} a vertex that does not exist "
            f"(there are {n}: {places.base} to {n - 1 + places.base})"
        ),
        "Is the mesh complete, and do its tetrahedra count vertices from "
        f"{places.base}{'' if places.file else ', as arrays do'}?",
    )


def check_solid(vertices: np.ndarray, cells: np.ndarray, places: Places) -> None:
    """Refuse what cannot be a solid.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions [m].
    cells : (m, 4) integer
    places : Places

    Raises
    ------
    MeshError
        If the mesh is empty; has coordinates that are not finite, indices out of range, tetrahedra that repeat a
        vertex, are flat, inverted or occur twice, a face in more than two tetrahedra or between two on the same
        side of it, an edge where the surface meets itself, or vertices in no tetrahedron.
    """
    check_cells(vertices, cells, places)

    def here(e: int) -> str:
        return f"{places.face(e)}, with vertices {listed(cells[e], places)}"

    ordered = np.sort(cells, axis=1)
    repeats: np.ndarray = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    refuse(
        repeats,
        here,
        lambda k: (
            f"{places.mesh}: {counted(k, 'tetrahedron is', 'tetrahedra are')} degenerate, "
            "using the same vertex twice"
        ),
        "A tetrahedron needs four different vertices: remove these.",
    )
    volume = signed_volumes(vertices, cells)
    refuse(
        _flat(vertices, cells, volume),
        lambda e: f"{here(e)}, volume {volume[e]:.3g} m^3",
        lambda k: (
            f"{places.mesh}: {counted(k, 'tetrahedron is', 'tetrahedra are')} degenerate, "
            "with (almost) no volume"
        ),
        "Remove these slivers where the mesh is made (in TetGen: a quality bound, -q; in Gmsh: Optimize 3D).",
    )
    refuse(
        volume < 0,
        lambda e: f"{here(e)}, volume {volume[e]:.3g} m^3",
        lambda k: (
            f"{places.mesh}: {counted(k, 'tetrahedron is', 'tetrahedra are')} inverted, wound against the others"
        ),
        "Exchange two vertices of each, if only their order is wrong; else the mesh folds over itself there.",
    )
    _check_twice(ordered, here, places)
    _check_faces(cells, places)
    _check_boundary(boundary_triangles(cells), len(vertices), places)
    used = np.zeros(len(vertices), dtype=bool)
    used[cells.ravel()] = True
    refuse(
        ~used,
        places.vertex,
        lambda k: (
            f"{places.mesh}: {counted(k, 'vertex is', 'vertices are')} unused: in no tetrahedron, "
            "so without mass"
        ),
        "Remove loose vertices.",
    )


def _flat(vertices: np.ndarray, cells: np.ndarray, volume: np.ndarray) -> np.ndarray:
    """Which tetrahedra have a face without area, or a height that is nothing beside their longest edge."""
    x = vertices[cells]
    edges = x[:, [1, 2, 3, 2, 3, 3]] - x[:, [0, 0, 0, 1, 1, 2]]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    faces = x[:, FACES]
    normals = np.cross(faces[:, :, 1] - faces[:, :, 0], faces[:, :, 2] - faces[:, :, 0])
    doubled = np.linalg.norm(normals, axis=2)
    thin = doubled.min(axis=1) < FLATTEST * longest**2
    low = 6 * np.abs(volume) < FLATTEST * longest * doubled.max(axis=1)
    return np.asarray((longest < SMALLEST) | thin | low)


def _check_twice(ordered: np.ndarray, here: Any, places: Places) -> None:
    _, first, inverse = np.unique(ordered, axis=0, return_index=True, return_inverse=True)
    earlier = first[inverse.ravel()]
    refuse(
        earlier != np.arange(len(ordered)),
        lambda e: f"{here(e)}, the same as {places.face(int(earlier[e]))}",
        lambda k: (
            f"{places.mesh}: {counted(k, 'tetrahedron is a duplicate', 'tetrahedra are duplicates')} "
            "of an earlier one"
        ),
        "Remove the duplicates.",
    )


def _check_faces(cells: np.ndarray, places: Places) -> None:
    """Every face lies between two tetrahedra on its two sides, or on the surface."""
    faces = cells[:, FACES].reshape(-1, 3)
    _, inverse, times = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    inverse = inverse.ravel()

    def at(face: int) -> str:
        around = np.flatnonzero(inverse == face)
        shown = ", ".join(places.face(int(row) // 4) for row in around[:3])
        more = ", ..." if len(around) > 3 else ""
        return f"the face of vertices {listed(np.sort(faces[around[0]]), places)}, in {shown}{more}"

    refuse(
        times > 2,
        at,
        lambda k: (
            f"{places.mesh}: {counted(k, 'face is', 'faces are')} non-manifold, "
            "shared by more than two tetrahedra"
        ),
        "Tetrahedra overlap there: make the mesh again from its surface.",
    )
    # seen from the one tetrahedron its corners run one way around, seen from the other the other way
    lowest = np.argmin(faces, axis=1)[:, None]
    turned = np.take_along_axis(faces, (lowest + np.arange(3)) % 3, axis=1)
    side = np.where(turned[:, 1] < turned[:, 2], 1, -1)
    refuse(
        (times == 2) & (np.bincount(inverse, side) != 0),
        at,
        lambda k: f"{places.mesh}: at {counted(k, 'face', 'faces')} both tetrahedra lie on the same side",
        "The mesh folds over itself there: make it again from its surface.",
    )


def _check_boundary(triangles: np.ndarray, n: int, places: Places) -> None:
    start = triangles.astype(np.int64)
    end = start[:, [1, 2, 0]]
    key, times = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_counts=True)
    refuse(
        np.asarray(times > 2),
        lambda e: (
            f"the edge from {places.vertex(int(key[e] // n))} to {places.vertex(int(key[e] % n))}, "
            f"in {times[e]} triangles of the surface"
        ),
        lambda k: f"{places.mesh}: its surface is non-manifold at {counted(k, 'edge', 'edges')}",
        "Parts of the solid meet there in nothing but an edge: join them by a face, or take them apart.",
    )
