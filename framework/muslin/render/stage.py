"""What stands around a cloth when it is drawn, exported or viewed: colliders, ground, and the cloth's own pattern."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from muslin.mesh import area_and_normal, block
from muslin.physics.colliders import Capsule, Sphere
from muslin.render.materials import PROP
from muslin.render.shapes import Surface, capsule_surface, ground_surface, sphere_surface

#: Half the thickness that cloth is taken to have where it is drawn [m]: ground and colliders are drawn that much deeper
#: than they hold, so that what lies on them is not half in them.
HALF_THICKNESS = 5e-4

#: Share of its radius that a collider is drawn at where the filter of S9 alone keeps cloth out of it: that notices what
#: is inside already.
FILTERED = 0.975


#: Angle between neighbouring triangles of a solid at rest from which the edge between them is a sharp one [degrees].
SHARP = 60.0


def creased(
    rest: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """A surface whose triangles share a vertex only where it is round between them, so that sharp edges look sharp.

    Parameters
    ----------
    rest : (n, 3) float64
        Undeformed [m].
    triangles : (m, 3) int

    Returns
    -------
    rows : (k,) int
        Which vertex each of the surface drawn is.
    faces : (m, 3) int
        The triangles, with vertices of the surface drawn.
    """
    _, normal = area_and_normal(rest, triangles)
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    order = np.lexsort((ends.max(axis=1), ends.min(axis=1)))
    key = np.sort(ends[order], axis=1)
    first = np.flatnonzero((key[1:] == key[:-1]).all(axis=1))  # an edge, from either of its triangles
    a, b = order[first], order[first + 1]
    round_ = np.einsum("ei,ei->e", normal[a // 3], normal[b // 3]) > np.cos(np.radians(SHARP))
    a, b = a[round_], b[round_]
    corners = np.arange(triangles.size).reshape(-1, 3)
    following = np.roll(corners, -1, axis=1).reshape(-1)  # the corner at the other end of a corner's edge
    joined = np.concatenate([a, following[a]]), np.concatenate([following[b], b])
    shape = (triangles.size, triangles.size)
    count, group = connected_components(
        sp.coo_matrix((np.ones(len(joined[0])), joined), shape), directed=False
    )
    rows = np.zeros(count, dtype=np.int64)
    rows[group] = np.ravel(triangles)
    return rows, group.reshape(-1, 3)


def longest_edge(x: NDArray[np.float64], cells: NDArray[np.integer]) -> float:
    """Length of the longest edge of triangles or tetrahedra [m]."""
    corners = x[cells]
    k = cells.shape[1]
    edges = [corners[:, i] - corners[:, j] for i in range(k) for j in range(i)]
    return float(np.sqrt(max(np.einsum("ti,ti->t", e, e).max(initial=0.0) for e in edges)))


def drawn_radius(collider: Sphere | Capsule, contact: str, longest: float) -> float:
    """Radius that a collider is drawn with: its own, less what the cloth's triangles cut into it [m].

    A triangle with its corners on a sphere lies within longest^2 / (6 radius) below it. One whose edges are longer than
    the radius is held by its nearest point and cuts into nothing.

    Parameters
    ----------
    collider : Sphere or Capsule
    contact : {"solve", "filter"}
        What keeps cloth out of it.
    longest : float
        The cloth's longest edge [m].
    """
    radius = collider.radius
    if contact == "filter":
        return FILTERED * radius
    return radius - HALF_THICKNESS - (longest**2 / (6 * radius) if longest < radius else 0.0)


def collider_surface(collider: Sphere | Capsule, radius: float, **look: Any) -> Surface:
    """A collider as a surface, of a radius of its own; see `drawn_radius`."""
    if isinstance(collider, Sphere):
        return sphere_surface(collider.center, radius, **look)
    return capsule_surface(collider.a, collider.b, radius, **look)


def collider_corners(collider: Sphere | Capsule) -> NDArray[np.float64]:
    """Corners (k, 3) of boxes around a collider, for framing."""
    centres = [collider.center] if isinstance(collider, Sphere) else [collider.a, collider.b]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.concatenate([np.asarray(c) + collider.radius * signs for c in centres])


def walls(rest: NDArray[np.float64], pinned: NDArray[np.integer]) -> list[Surface]:
    """What a solid (n, 3) is held by that is held by its whole left or right end: a plate, half as wide again."""
    found: list[Surface] = []
    for side in (-1, 1):
        end = (side * rest[:, 0]).max()
        face = side * rest[:, 0] > end - 1e-9 * np.ptp(rest[:, 0])
        size = np.ptp(rest[face], axis=0)[1:]
        if not np.isin(np.flatnonzero(face), pinned).all() or not size.all():
            continue
        thickness = 0.2 * size.max()
        plate = block(3, 9, 9, thickness, *(1.5 * size)).shell()
        middle = (rest[face].min(axis=0) + rest[face].max(axis=0)) / 2 + (side * thickness / 2, 0, 0)
        found.append(
            Surface(plate.vertices + middle, plate.triangles, PROP, smooth=False, name="wall", prop=True)
        )
    return found


def ground_height(height: float) -> float:
    """Where ground that holds at a height is drawn [m]."""
    return height - HALF_THICKNESS


def ground(height: float, **where: Any) -> Surface:
    """The ground that holds at a height; `where`: see `ground_surface`."""
    return ground_surface(ground_height(height), **where)


def thinnest(rest: NDArray[np.float64]) -> int:
    """The axis along which a rest shape (n, 3) is thinnest; in doubt z, so that its plane is x, y."""
    return int(np.argmin(np.ptp(rest, axis=0) * [1, 1, 1 - 1e-12]))


def pattern(rest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Undeformed positions in the cloth's main plane, (n, 2) [m]: what a weave follows."""
    return np.ascontiguousarray(np.delete(rest, thinnest(rest), axis=1))


def texture_coordinates(rest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where each vertex lies on the cloth's pattern: the rest shape seen along its thinnest axis.

    Parameters
    ----------
    rest : (n, 3) float64
        [m]

    Returns
    -------
    (n, 2) float64
        u to the right, v up; the longer side runs from 0 to 1, both are to the same scale.
    """
    right, up, sign = [(2, 1, (-1, 1)), (0, 2, (1, -1)), (0, 1, (1, 1))][thinnest(rest)]
    uv = rest[:, [right, up]] * sign
    size = np.ptp(uv, axis=0).max()
    return (uv - uv.min(axis=0)) / (size if size > 0 else 1.0)
