"""Strain limiting: what one linear step over-stretches is pulled back, triangle by triangle.

A linearly implicit step moves vertices along straight lines. Where a fold turns by an angle a in one step, the
triangles in it come out longer by about 1 / cos a, though nothing pulls at them. Like Provot (1995) we correct the
velocities of a triangle's corners along the gradient of its larger principal stretch,

    dv_i = -w_i (s_0 - limit) / (dt sum_j w_j |ds_0/dx_j|^2) ds_0/dx_i,    ds_0/dx_i = (g_i . v_0) u_0,

weighted by inverse masses w: the impulses of a triangle's corners sum to zero and turn nothing. It goes from triangle
to triangle, and from each that was corrected to those that share a vertex with it, until none is over the limit.
"""

import numpy as np

from muslin.base.launch import Launch, is_small
from muslin.physics.elements.layout import pointers
from muslin.physics.elements.limit_kernels import TOLERANCE, correct, measure
from muslin.physics.elements.native import rest_gradients


class StretchLimit:
    """Corrects velocities so that no triangle is stretched beyond a limit at the end of a step, where that can be.

    Parameters
    ----------
    X : (n, 3), triangles : (m, 3), normal : (m, 3)
        Undeformed positions [m], and the triangles' vertices and unit normals.
    mass : (n,)
        Of the vertices [kg].
    pinned : (n,) bool
        Vertices that are not moved.
    limit : float
        Largest principal stretch, above 1.
    """

    def __init__(
        self,
        X: np.ndarray,
        triangles: np.ndarray,
        normal: np.ndarray,
        mass: np.ndarray,
        pinned: np.ndarray,
        limit: float,
    ):
        n, m = len(X), len(triangles)
        g = rest_gradients(X, triangles, normal)
        ptr, around = pointers(triangles.ravel(), n), np.argsort(triangles.ravel(), kind="stable") // 3
        self._limit = limit
        self._x, self._v, self._numbers = np.zeros((n, 3)), np.zeros((n, 3)), np.array([0.0, limit])
        self._stretch = np.zeros(m)
        self._count, self._queue, self._queued = np.zeros(1, np.int32), *np.zeros((2, m), np.int32)
        moving = (self._x, self._v, self._numbers, triangles, g)
        self._measure = Launch(measure(is_small(m, 25)), *moving, self._stretch)
        weight, work = np.where(pinned, 0.0, 1 / mass), (self._count, self._queue, self._queued)
        self._correct = Launch(correct, *moving, weight, ptr, around.astype(np.int32), *work)

    def __call__(self, x: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Velocities (n, 3) [m/s] from v, for a step of dt [s] from x; v itself if nothing is over the limit."""
        self._x[...], self._v[...], self._numbers[0] = x, v, dt
        self._measure()
        over = np.flatnonzero(self._stretch > self._limit + TOLERANCE)
        if len(over) == 0:
            return v
        self._count[0] = len(over)
        self._queue[: len(over)] = over
        self._queued[:] = 0
        self._queued[over] = 1
        self._correct()
        return self._v.copy()
