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

from muslin.mesh import Refinement, area_and_normal, principal_stretches
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
    triangles = mesh.triangles
    area, normal = area_and_normal(x, triangles)
    neighbour = np.where(mesh.across >= 0, mesh.across // 3, np.arange(len(triangles))[:, None])
    found = _largest(_between(mesh, normal)) / angle
    size = np.sqrt(4 / np.sqrt(3) * area)  # edge of an equilateral triangle of this area
    for collider in colliders:
        if (radius := getattr(collider, "radius", None)) is not None:
            centre, _ = collider.nearest(x)  # type: ignore[union-attr]
            gap = np.linalg.norm(x - centre, axis=1) - radius
            near = -_largest(-gap[triangles]) < size
            found = np.where(near, np.maximum(found, size / np.sqrt(3) / radius / angle), found)
    if stretch:
        s = principal_stretches(rest, x, triangles)
        jump = _largest(np.stack([_largest(np.abs(s - s[other])) for other in neighbour.T], axis=1))
        found = np.maximum(found, jump / stretch)
    return found


def _largest(values: np.ndarray) -> np.ndarray:
    """Largest of each row of a few columns, faster than NumPy's `max`."""
    out = values[:, 0]
    for k in range(1, values.shape[1]):
        out = np.maximum(out, values[:, k])
    return out


def folded(mesh: Refinement, x: np.ndarray) -> np.ndarray:
    """Angle of each triangle to the one across each of its half-edges, (m, 3) [rad]; 0 on the boundary."""
    return _between(mesh, area_and_normal(x, mesh.triangles)[1])


def _between(mesh: Refinement, normal: np.ndarray) -> np.ndarray:
    between = normal[:, None] - normal[mesh.across // 3]
    chord = np.sqrt(np.einsum("mki,mki->mk", between, between))
    return np.where(mesh.across >= 0, 2 * np.arcsin(np.minimum(chord / 2, 1.0)), 0.0)


def bound(mesh: Refinement, x: np.ndarray, sharpest: float) -> np.ndarray:
    """Which triangles cannot be refined without the flip of a fold sharper than this [rad], (m,) bool.

    A flip cuts the corner of a fold off: the two triangles that take its place are as far from their undeformed
    shape as the way round the corner is longer than the way through it, by an eighth of the angle's square. Where two
    triangles of an even generation meet at such a fold neither is split, since the other may be, too.
    """
    generation, inside = mesh.generation, mesh.across >= 0
    neighbours = mesh.across // 3
    own, other = generation[:, None], generation[neighbours]
    even = inside & (own % 2 == 0)
    sharp = folded(mesh, x) > sharpest
    out = (sharp & even & ((other == own) | (other == own + 1))).any(axis=1)
    behind = even & (other < own)  # these are refined before
    odd = np.flatnonzero(generation % 2)
    mates = neighbours[odd, BASE]
    while True:
        more = out | (behind & out[neighbours]).any(axis=1)
        more[odd] |= more[mates]
        if (more == out).all():
            return out
        out = more
