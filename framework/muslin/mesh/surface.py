"""The mesh itself, and the geometry and topology of triangles that a simulator asks for."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.checks import Places, check_surface


@dataclass(frozen=True, eq=False)
class Mesh:
    """An undeformed cloth.

    Parameters
    ----------
    vertices : (n, 3) float64
        Undeformed positions X [m].
    triangles : (m, 3) int32
        Vertex indices, counterclockwise seen from the side the normal points to.
    name : str
    notices : tuple of str
        What was changed or left out on the way in, for a person to read.
    numbers : (n,) int, optional
        What the file calls each vertex, counting from 0, where some of its vertices were left out.
    scale : float
        What the file's coordinates were multiplied with.

    Notes
    -----
    `Mesh.from_arrays`, `load` and the generators check what they return, and their arrays are read-only.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    name: str = "mesh"
    notices: tuple[str, ...] = ()
    numbers: np.ndarray | None = None
    scale: float = 1.0

    @functools.cached_property
    def area_and_normal(self) -> tuple[np.ndarray, np.ndarray]:
        """As the function of this name has them, of the vertices as they are."""
        found = area_and_normal(self.vertices, self.triangles)
        for array in found:
            array.setflags(write=False)
        return found

    def find(self, numbers: Any) -> np.ndarray:
        """Indices of vertices by their numbers in the file (which are the indices if none was left out).

        Raises
        ------
        MeshError
            If there is no such vertex, or it was left out.
        """
        return find(self, numbers, "triangle")

    def called(self, indices: np.ndarray) -> list[int]:
        """Numbers in the file of vertices by their indices: the inverse of `find`."""
        return list(map(int, indices if self.numbers is None else self.numbers[indices]))

    def scaled(self, factor: float) -> Mesh:
        """The mesh, this many times as large.

        Raises
        ------
        MeshError
            If it cannot be cloth at that size.
        """
        if factor == 1.0:
            return self
        X = self.vertices * factor
        check_surface(X, self.triangles, Places(f"Mesh {self.name!r}, scaled by {factor:g}", file=False))
        made = frozen(X, self.triangles, self.name, self.notices, self.numbers)
        return replace(made, scale=self.scale * factor)

    @property
    def extent(self) -> float:
        """Length of the longest side of the box around the mesh [m]."""
        return float(np.ptp(self.vertices, axis=0).max())

    @classmethod
    def from_arrays(cls, vertices: Any, triangles: Any, name: str = "mesh") -> Mesh:
        """Convert and check.

        Parameters
        ----------
        vertices : (n, 3) or (n, 2) array-like of numbers
            Positions [m]; two columns are taken as x and y, with z = 0 and a notice.
        triangles : (m, 3) array-like of whole numbers
            Vertex indices from 0.
        name : str

        Raises
        ------
        MeshError
            If the arrays are not of these shapes and kinds, or the mesh cannot be cloth (see `check`).
        """
        title = f"Mesh {str(name)!r}"
        X, notices = flat_to_3d(numbers_of(vertices, title, "vertices"), title)
        T = indices(triangles, title)
        check_surface(X, T, Places(title, file=False))
        return frozen(X, T, str(name), notices)


def find(mesh: Any, numbers: Any, cell: str) -> np.ndarray:
    """Indices of a mesh's vertices by their numbers in its file.

    Raises
    ------
    MeshError
        If there is no such vertex, or it was left out.
    """
    wanted = np.atleast_1d(np.asarray(numbers, dtype=np.int64))
    known = np.arange(len(mesh.vertices)) if mesh.numbers is None else mesh.numbers
    at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
    missing = wanted[known[at] != wanted]
    if len(missing):
        left_out = 0 <= missing[0] < known[-1]
        raise MeshError(
            f"The mesh {mesh.name!r} has no vertex {missing[0]}"
            + (f": it is in no {cell}, and was left out." if left_out else "."),
            f"Its vertices are numbered from {known[0]} to {known[-1]}.",
        )
    return at


def check(mesh: Mesh) -> None:
    """Refuse a mesh that cannot be cloth.

    Parameters
    ----------
    mesh : Mesh

    Raises
    ------
    MeshError
        If the mesh is empty; has coordinates that are not finite, indices out of range, triangles that
        repeat a vertex, are flat or occur twice, an edge in more than two triangles, neighbours wound
        against each other, or vertices in no triangle.
    """
    Mesh.from_arrays(mesh.vertices, mesh.triangles, mesh.name)


def area_and_normal(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area and unit normal of each triangle.

    Parameters
    ----------
    vertices : (n, 3) float
        Positions, undeformed or deformed [m].
    triangles : (m, 3) int

    Returns
    -------
    area : (m,) float64
        [m^2]
    normal : (m, 3) float64
        (x1 - x0) x (x2 - x0), normalised; zero where the triangle has collapsed.
    """
    x = np.ascontiguousarray(np.asarray(vertices, dtype=np.float64).T)
    x0, x1, x2 = (x.take(corner, axis=1) for corner in np.ascontiguousarray(np.asarray(triangles).T))
    a, b = x1 - x0, x2 - x0
    n = np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    length = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    return length / 2, np.ascontiguousarray((n / np.where(length > 0, length, 1.0)).T)


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normal at each vertex: the mean over the triangles around it, each by its angle there.

    How a flat piece is divided into triangles makes no difference to it. (A mean by area leans to the side on which
    more of them meet: on a fold that runs askew over a grid, from row to row to the other side.)

    Parameters
    ----------
    vertices : (n, 3) float
        Positions, undeformed or deformed [m].
    triangles : (m, 3) int

    Returns
    -------
    (n, 3) float64
        Zero where the mean vanishes or there are no triangles.
    """
    area, normal = area_and_normal(vertices, triangles)
    x = np.asarray(vertices, dtype=np.float64)[triangles]
    along, back = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    angle = np.arctan2(2 * area[:, None], np.einsum("mik,mik->mi", along, back))
    weighted = (angle[:, :, None] * normal[:, None]).reshape(-1, 3)
    corners = np.ravel(triangles)
    total = np.stack([np.bincount(corners, weighted[:, k], len(vertices)) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1)
    return total / np.where(length > 0, length, 1.0)[:, None]


def edges(triangles: np.ndarray) -> np.ndarray:
    """Edges of the triangles, each once.

    Parameters
    ----------
    triangles : (m, 3) int

    Returns
    -------
    (e, 2) int32
        Vertex pairs, lower index first, in ascending order.
    """
    return _edges_and_times(triangles)[0]


def boundary(triangles: np.ndarray) -> np.ndarray:
    """Vertices on the boundary: on an edge that belongs to one triangle only.

    Parameters
    ----------
    triangles : (m, 3) int

    Returns
    -------
    (b,) int32
        In ascending order.
    """
    pairs, times = _edges_and_times(triangles)
    return np.unique(pairs[times == 1])


def _edges_and_times(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    start = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    end = start[:, [1, 2, 0]]
    n = int(start.max(initial=0)) + 1
    key, times = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_counts=True)
    return np.stack([key // n, key % n], axis=1).astype(np.int32), times


def frozen(
    vertices: np.ndarray,
    triangles: np.ndarray,
    name: str,
    notices: tuple[str, ...] = (),
    numbers: np.ndarray | None = None,
    scale: float = 1.0,
) -> Mesh:
    """Mesh of private, read-only copies of these (checked) arrays."""
    X = np.array(vertices, dtype=np.float64, order="C")
    T = np.array(triangles, dtype=np.int32, order="C")
    X.setflags(write=False)
    T.setflags(write=False)
    return Mesh(X, T, name, notices, numbers, scale)


def flat_to_3d(points: np.ndarray, title: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Points (n, 3) of points (n, 2) or (n, 3), with a notice if z = 0 was added."""
    if points.ndim == 2 and points.shape[1] == 2:
        padded = np.column_stack([points, np.zeros(len(points))])
        return padded, (f"{title} has two coordinates per vertex: taken as x and y, with z = 0.",)
    if points.ndim == 2 and points.shape[1] == 3:
        return points, ()
    if points.size == 0:
        return points.reshape(0, 3), ()
    raise MeshError(
        f"{title}: vertices have shape {points.shape}.",
        "They should be an array (n, 3): one row x, y, z a vertex.",
    )


def numbers_of(values: Any, title: str, what: str) -> np.ndarray:
    """Float array of anything, or a MeshError: user objects may raise whatever they like on the way."""
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "iufO":
            raise TypeError(f"they are of type {array.dtype}")
        return array.astype(np.float64)
    except Exception as error:
        raise MeshError(
            f"{title}: the {what} are not an array of numbers ({_reason(error)}).",
            "Give them as an array (n, 3), one row a vertex.",
        ) from None


def indices(values: Any, title: str, what: str = "triangles", corners: int = 3) -> np.ndarray:
    """Integer array (m, corners) of anything, or a MeshError."""
    hint = f"Give them as an array (m, {corners}) of vertex numbers, counting from 0."
    try:
        array = np.asarray(values)
        if array.size == 0:
            return np.zeros((0, corners), dtype=np.int64)
        if array.dtype.kind not in "iufO":
            raise TypeError(f"they are of type {array.dtype}")
        if array.dtype.kind in "fO":
            # Whole numbers in floats are welcome; beyond 2^53 they are no vertex numbers.
            floats = array.astype(np.float64)
            if not (np.abs(floats) < 2.0**53).all():
                raise ValueError("some are not finite, or huge")
            if (floats != np.floor(floats)).any():
                raise ValueError("some are not whole numbers")
            array = floats.astype(np.int64)
    except Exception as error:
        raise MeshError(f"{title}: the {what} are not vertex numbers ({_reason(error)}).", hint) from None
    if array.ndim != 2 or array.shape[1] != corners:
        raise MeshError(f"{title}: {what} have shape {array.shape}.", hint)
    return array


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:150] or type(error).__name__


def principal_stretches(rest: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Singular values of each triangle's deformation gradient in its plane, (m, 2), larger first.

    Parameters
    ----------
    rest, x : (n, 3)
        Undeformed and deformed positions [m].
    triangles : (m, 3) int
    """
    p, q = (rest[triangles[:, k]] - rest[triangles[:, 0]] for k in (1, 2))
    first, second = (x[triangles[:, k]] - x[triangles[:, 0]] for k in (1, 2))
    length = np.linalg.norm(p, axis=1)
    e = (
        p / length[:, None]
    )  # and across it, in the plane: a frame in which p = (length, 0), q = (along, height)
    along = np.einsum("ij,ij->i", q, e)
    height = np.linalg.norm(q - along[:, None] * e, axis=1)
    first = first / length[:, None]
    second = (second - along[:, None] * first) / height[:, None]
    a, b, c = (np.einsum("ij,ij->i", u, w) for u, w in ((first, first), (first, second), (second, second)))
    larger = np.sqrt((a + c) / 2 + np.hypot((a - c) / 2, b))
    area = np.linalg.norm(np.cross(first, second), axis=1)
    return np.stack([larger, area / np.where(larger > 0, larger, 1.0)], axis=1)
