"""Where an adaptive cloth wants smaller triangles: how far each is from what may be left as it is.

An indicator is 1 where a triangle is as large as it may be. Three things are looked at, the worst counts:

* **curvature**: the angle between a triangle and its neighbours, which is the curvature across their edge times the
  distance of their centres, against `refine_angle`;
* **contact**: the same angle, as it will be when the triangle lies on the collider it is near: the distance of centres
  over the collider's radius. So the mesh is fine where cloth is about to meet something curved, before it cuts in;
* **stretch**: how much the principal stretches differ from a neighbour's, against `refine_stretch`. A uniform stretch
  is exact on any mesh and asks for nothing.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from muslin.mesh import Refinement
from muslin.mesh.refinement import BASE
from muslin.physics.colliders import Collider


def indicator(
    mesh: Refinement,
    rest: np.ndarray,
    x: np.ndarray,
    colliders: Iterable[Collider],
    angle: float,
    stretch: float,
) -> np.ndarray:
    """How much each triangle should be refined, (m,): from 1 on it is too large.

    Parameters
    ----------
    mesh : Refinement
    rest, x : (n, 3)
        Undeformed and deformed positions [m].
    colliders : Colliders
    angle : float
        Largest angle between neighbours [rad].
    stretch : float
        Largest difference of their principal stretches; 0: any.
    """
    corners = np.ascontiguousarray(mesh.triangles.T)
    here, there = np.ascontiguousarray(x.T), np.ascontiguousarray(rest.T)
    one, two = _edges(here, corners)
    normal, area = _normal(one, two)
    found = _angles(_chords(mesh, normal).max(axis=0)) / angle
    size = np.sqrt(4 / np.sqrt(3) * area)  # edge of an equilateral triangle of this area
    for collider in colliders:
        if (radius := getattr(collider, "radius", None)) is not None:
            centre, _ = collider.nearest(x)  # type: ignore[union-attr]
            away = x - centre
            gap = np.sqrt(np.einsum("ij,ij->i", away, away)) - radius
            near = np.minimum(np.minimum(*gap[corners[:2]]), gap[corners[2]]) < size
            found = np.where(near, np.maximum(found, size / np.sqrt(3) / radius / angle), found)
    if stretch:
        larger, smaller = _stretches(*_edges(there, corners), one, two, area)
        jump = np.zeros(len(area))
        for other in _neighbours(mesh):
            for s in (larger, smaller):
                np.maximum(jump, np.abs(s - s.take(other)), out=jump)
        found = np.maximum(found, jump / stretch)
    return found


def _edges(x: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From each triangle's first corner to the others, (3, m) both; positions and corners come by columns too."""
    first = x.take(corners[0], axis=1)
    return x.take(corners[1], axis=1) - first, x.take(corners[2], axis=1) - first


def _normal(p: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (3, m) and areas (m,)."""
    n = np.stack([p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]])
    length = np.sqrt(_dot(n, n))
    return n / np.where(length > 0, length, 1.0), length / 2


def _dot(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.asarray(p[0] * q[0] + p[1] * q[1] + p[2] * q[2])


def _stretches(
    P: np.ndarray, Q: np.ndarray, p: np.ndarray, q: np.ndarray, area: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Principal stretches from edges undeformed and deformed: the larger, and what area there is over it."""
    length = _dot(P, P)
    along, whole = _dot(P, Q) / length, _normal(P, Q)[1]
    across = length / (4 * whole**2)  # 1 / height^2
    beside = q - along * p
    a, b, c = _dot(p, p) / length, _dot(p, beside) * np.sqrt(across / length), _dot(beside, beside) * across
    larger = np.sqrt((a + c) / 2 + np.hypot((a - c) / 2, b))
    return larger, area / whole / np.where(larger > 0, larger, 1.0)


def _neighbours(mesh: Refinement) -> np.ndarray:
    """The triangles across each triangle's edges, (3, m); itself at the boundary."""
    return np.ascontiguousarray(
        np.where(mesh.across >= 0, mesh.across // 3, np.arange(len(mesh.triangles))[:, None]).T
    )


def _chords(mesh: Refinement, normal: np.ndarray) -> np.ndarray:
    """Squared distances of each triangle's normal (3, m) to its neighbours', (3, m)."""
    out = np.empty(normal.shape)
    for k, other in enumerate(_neighbours(mesh)):
        between = normal - normal.take(other, axis=1)
        out[k] = _dot(between, between)
    return out


def _angles(chords: np.ndarray) -> np.ndarray:
    return np.asarray(2 * np.arcsin(np.minimum(np.sqrt(chords) / 2, 1.0)))


def folded(mesh: Refinement, x: np.ndarray) -> np.ndarray:
    """Angle of each triangle to the one across each of its half-edges, (m, 3) [rad]; 0 on the boundary."""
    normal, _ = _normal(*_edges(np.ascontiguousarray(x.T), mesh.triangles.T))
    return _angles(_chords(mesh, normal)).T


def bound(mesh: Refinement, x: np.ndarray, sharpest: float) -> np.ndarray:
    """Which triangles cannot be refined without the flip of a fold sharper than this [rad], (m,) bool.

    A flip cuts the corner of a fold off: the two triangles that take its place are as far from their undeformed
    shape as the way round the corner is longer than the way through it, by an eighth of the angle's square. Where two
    triangles of an even generation meet at such a fold neither is split, since the other may be, too.
    """
    angles = folded(mesh, x).T
    sharp = angles > sharpest
    if not sharp.any():
        return np.zeros(len(sharp[0]), dtype=bool)
    own, neighbours = mesh.generation, _neighbours(mesh)
    other, even = own[neighbours], own % 2 == 0
    out = even & (sharp & (mesh.across.T >= 0) & ((other == own) | (other == own + 1))).any(axis=0)
    behind = even & (other < own)  # these are refined before
    which, edge = np.nonzero(behind.T)
    odd = np.flatnonzero(~even)
    needs = np.concatenate([which, odd]), np.concatenate([neighbours[edge, which], neighbours[BASE, odd]])
    while True:
        more = out.copy()
        more[needs[0][out[needs[1]]]] = True
        if (more == out).all():
            return out
        out = more
