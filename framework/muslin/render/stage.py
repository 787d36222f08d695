"""What stands around a cloth when it is drawn, exported or viewed: colliders, ground, and the cloth's own pattern."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.physics.colliders import Capsule, Sphere
from muslin.render.shapes import Surface, capsule_surface, ground_surface, sphere_surface

#: The ground is drawn this much lower than it holds [m]: what lies on it is not half in it.
BELOW = 0.004


def collider_surface(collider: Sphere | Capsule, radius: float, **look: Any) -> Surface:
    """A collider as a surface, of a radius smaller than its own: cloth touches it with vertices, and cuts corners."""
    if isinstance(collider, Sphere):
        return sphere_surface(collider.center, radius, **look)
    return capsule_surface(collider.a, collider.b, radius, **look)


def collider_corners(collider: Sphere | Capsule) -> NDArray[np.float64]:
    """Corners (k, 3) of boxes around a collider, for framing."""
    centres = [collider.center] if isinstance(collider, Sphere) else [collider.a, collider.b]
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.concatenate([np.asarray(c) + collider.radius * signs for c in centres])


def ground_height(height: float) -> float:
    """Where ground that holds at a height is drawn [m]."""
    return height - BELOW


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
