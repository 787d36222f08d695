"""What a mesh file holds before it is triangles: polygons of any size, and where each came from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.checks import Places


@dataclass
class Polygons:
    """Contents of a mesh file, as found.

    Parameters
    ----------
    points : (n, 2) or (n, 3) float64
    faces : list of ((b,) int, (b, k) int)
        Faces by number of corners k: their numbers in the file, and their vertices, both from 0.
    base : int
        What the file calls its first vertex.
    point_lines, face_lines : (n,) and (number of faces,) int arrays, optional
        The line each stands on, for text formats.
    ignored : dict
        Elements that are no surface, by kind, and how many.
    ignored_points : int array
        The vertices of these elements.
    tetrahedra : (m, 4) int, optional
        Vertices of tetrahedra, from 0 (they count among `ignored` too).
    tetrahedron_lines : (m,) int, optional
    notices : tuple of str
    """

    points: np.ndarray
    faces: list[tuple[np.ndarray, np.ndarray]]
    base: int = 0
    point_lines: np.ndarray | None = None
    face_lines: np.ndarray | None = None
    ignored: dict[str, int] = field(default_factory=dict)
    ignored_points: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    tetrahedra: np.ndarray | None = None
    tetrahedron_lines: np.ndarray | None = None
    notices: tuple[str, ...] = ()


def by_corners(faces: list[list[int]]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Faces of mixed size as the groups `Polygons` wants."""
    sizes = np.array([len(face) for face in faces], dtype=np.int64)
    groups = []
    for k in np.unique(sizes):
        ids = np.flatnonzero(sizes == k)
        groups.append((ids, np.array([faces[i] for i in ids], dtype=np.int64)))
    return groups


def strip_triangles(strip: np.ndarray) -> np.ndarray:
    """Triangles (m, 3) of a triangle strip (k,), each wound like the first; a negative index begins another.

    Strips turn corners by repeating a vertex; the empty triangles of that are left out.
    """
    ends = np.flatnonzero(strip < 0)
    if len(ends):
        return np.concatenate([strip_triangles(part[part >= 0]) for part in np.split(strip, ends)])
    if len(strip) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    triangles = np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1).astype(np.int64)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    same = triangles == np.roll(triangles, 1, axis=1)
    return triangles[~same.any(axis=1)]


def triangulate(
    vertices: np.ndarray, faces: list[tuple[np.ndarray, np.ndarray]], places: Places
) -> tuple[np.ndarray, np.ndarray]:
    """Cut faces into triangles: each into the fan whose worst triangle is best.

    For a quad this picks the better diagonal, also if the quad is not convex.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : list of ((b,) int, (b, k) int)
    places : Places
        To name a face that cannot be cut.

    Returns
    -------
    triangles : (m, 3) int64
        In the order of the file, wound like their face.
    origin : (m,) int64
        The face each comes from.

    Raises
    ------
    MeshError
        If no fan of a polygon keeps all its triangles on one side, or it has no area.
    """
    triangles, origin = [], []
    for ids, corners in faces:
        k = corners.shape[1]
        if k == 3:
            triangles.append(corners)
            origin.append(ids)
            continue
        x = vertices[corners]  # (b, k, 3)
        # Area vector of the polygon, by Newell; its direction tells inside from outside of a fan triangle.
        arms = x - x[:, :1]
        normal = np.cross(arms[:, 1:-1], arms[:, 2:]).sum(axis=1)
        worst = np.stack([_worst_of_fan(np.roll(x, -apex, axis=1), normal) for apex in range(k)], axis=1)
        best = np.argmax(np.round(worst, 6), axis=1)  # rounded: equal choices go to the first corner
        hopeless = worst[np.arange(len(ids)), best] < -1e-6
        if hopeless.any():
            count, first = int(hopeless.sum()), int(np.argmax(hopeless))
            raise MeshError(
                f"{places.mesh}: {count} polygon{'s' if count > 1 else ''} cannot be cut into a fan of "
                f"triangles; {'the first' if count > 1 else 'it'} is {places.face(ids[first])}, "
                f"with {k} corners.",
                "Does it cross itself? If not, triangulate the mesh before exporting it "
                "(in Blender: Face > Triangulate Faces).",
            )
        turned = np.take_along_axis(corners, (best[:, None] + np.arange(k)) % k, axis=1)
        fan = np.stack(
            [np.broadcast_to(turned[:, :1], (len(ids), k - 2)), turned[:, 1:-1], turned[:, 2:]], axis=2
        )
        triangles.append(fan.reshape(-1, 3))
        origin.append(np.repeat(ids, k - 2))
    all_triangles, all_origins = np.concatenate(triangles), np.concatenate(origin)
    order = np.argsort(all_origins, kind="stable")
    return all_triangles[order], all_origins[order]


def _worst_of_fan(x: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Quality (b,) of the worst triangle in the fan from corner 0 of x (b, k, 3).

    Signed area over the longest edge squared: negative for a triangle outside the polygon.
    """
    a, b = x[:, 1:-1] - x[:, :1], x[:, 2:] - x[:, :1]
    squares = np.stack([(e**2).sum(axis=2) for e in (a, b, b - a)]).max(axis=0)
    with np.errstate(all="ignore"):
        unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        quality = np.einsum("btk,bk->bt", np.cross(a, b), unit) / squares
    return np.nan_to_num(quality, nan=-1.0).min(axis=1)  # no area, no inside
