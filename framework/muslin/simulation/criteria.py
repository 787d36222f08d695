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
    inside = mesh.across >= 0
    neighbour = np.where(inside, mesh.across // 3, np.arange(len(triangles))[:, None])
    cosine = np.einsum("mi,mki->mk", normal, normal[neighbour])
    sine = np.linalg.norm(np.cross(normal[:, None], normal[neighbour]), axis=2)
    found = np.where(inside, np.arctan2(sine, cosine), 0.0).max(axis=1) / angle
    size = np.sqrt(4 / np.sqrt(3) * area)  # edge of an equilateral triangle of this area
    for collider in colliders:
        if (radius := getattr(collider, "radius", None)) is not None:
            centre, _ = collider.nearest(x)  # type: ignore[union-attr]
            gap = np.linalg.norm(x - centre, axis=1) - radius
            near = gap[triangles].min(axis=1) < size
            found = np.where(near, np.maximum(found, size / np.sqrt(3) / radius / angle), found)
    if stretch:
        s = principal_stretches(rest, x, triangles)
        jump = np.abs(s[:, None] - s[neighbour]).max(axis=(1, 2))
        found = np.maximum(found, jump / stretch)
    return found
