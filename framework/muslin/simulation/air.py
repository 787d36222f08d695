"""Wind: pressure drag on both sides of a surface, implicit in the velocity.

A triangle of area a with normal n feels k/2 |u| u a along n, where u = n . (w - v) is how fast the air w comes through
it. A third of that acts on each corner, by the corner's own velocity; |u| is taken of the triangle before the step, so
that the force is linear in the velocities, dt D v is symmetric and positive semi-definite, and no step is so large that
the air would throw back what it slows down.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from muslin.mesh import area_and_normal
from muslin.physics.body import Body


class Air:
    """What the wind does in a step of dt [s] from where things are.

    Parameters
    ----------
    body : Body
    wind : (3,) array
        Velocity of the air [m/s].
    drag : float
        k [kg/m^3].
    x, v : (n, 3) arrays
        Before the step.
    dt : float
    """

    def __init__(
        self, body: Body, wind: Sequence[float], drag: float, x: np.ndarray, v: np.ndarray, dt: float
    ):
        t = body.surface
        area, n = area_and_normal(x, t)
        self.wind = np.asarray(wind, float)
        through = np.einsum("ij,ij->i", self.wind - v[t].mean(axis=1), n)
        strength = dt * drag / 2 * np.abs(through) * area / 3
        thirds = np.repeat(strength[:, None, None] * n[:, :, None] * n[:, None, :], 3, axis=0)
        #: (n, 3, 3) [kg], symmetric: the impulse on vertex i is blocks_i (w - v_i)
        self.blocks = np.stack([body.on_surface(row) for row in thirds.transpose(1, 0, 2)], axis=1)

    def impulse(self, v: np.ndarray) -> np.ndarray:
        """On the vertices, for velocities (n, 3), [N s]."""
        return np.einsum("nij,nj->ni", self.blocks, self.wind - v)

    def value(self, v: np.ndarray) -> float:
        """The function of velocities (n, 3) whose gradient is minus the impulse [J]."""
        return 0.5 * float(np.sum((self.wind - v) * self.impulse(v)))

    def work(self, v: np.ndarray) -> float:
        """Done on the body [J]."""
        return float(np.sum(self.impulse(v) * v))
