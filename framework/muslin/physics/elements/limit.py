"""Strain limiting: what one linear step over-stretches is pulled back, triangle by triangle.

A linearly implicit step moves vertices along straight lines. Where a fold turns by an angle a in one step, the
triangles in it come out longer by about 1 / cos a, though nothing pulls at them. Like Provot (1995) we correct the
velocities of a triangle's corners along the gradient of its larger principal stretch,

    dv_i = -w_i (s_0 - limit) / (dt sum_j w_j |ds_0/dx_j|^2) ds_0/dx_i,    ds_0/dx_i = (g_i . v_0) u_0,

weighted by inverse masses w: the impulses of a triangle's corners sum to zero and turn nothing. It goes from triangle
to triangle, and from each that was corrected to those that share a vertex with it, until none is over the limit.
"""

import functools

import numpy as np

from muslin.base.arrays import index3, integers, scalars, vec3s
from muslin.base.engine import ti
from muslin.base.launch import Launch, is_small
from muslin.physics.elements.layout import pointers
from muslin.physics.elements.native import rest_gradients

#: A triangle is let be when it is over the limit by no more than this.
TOLERANCE = 1e-4

#: Triangles looked at in one step at most, in terms of those there are.
VISITS = 4


class StretchLimit:
    """Corrects velocities so that no triangle is stretched beyond a limit at the end of a step, where that can be.

    Parameters
    ----------
    X : (n, 3), triangles : (m, 3), normal : (m, 3)
        Undeformed positions [m], and the triangles' vertices and unit normals.
    mass : (n,)
        Of the vertices [kg].
    held : (n,) bool
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
        held: np.ndarray,
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
        self._measure = Launch(_measure(is_small(m, 25)), *moving, self._stretch)
        weight, work = np.where(held, 0.0, 1 / mass), (self._count, self._queue, self._queued)
        self._correct = Launch(_correct, *moving, weight, ptr, around.astype(np.int32), *work)

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


@ti.func
def _stretched(x: ti.template(), v: ti.template(), dt, t, g1, g2):
    """F^T F of the 3x2 deformation gradient at x + dt v as (p, r, o) = (00, 11, 01), and the columns of F."""
    a, b, c = x[t[0]] + dt * v[t[0]], x[t[1]] + dt * v[t[1]], x[t[2]] + dt * v[t[2]]
    f0 = (b - a) * g1[0] + (c - a) * g2[0]
    f1 = (b - a) * g1[1] + (c - a) * g2[1]
    return ti.Vector([f0.dot(f0), f1.dot(f1), f0.dot(f1)]), f0, f1


@ti.func
def _largest(C):
    """s_0 from F^T F, and half the difference of its diagonal entries and of its eigenvalues."""
    half = (C[0] - C[1]) / 2
    radius = ti.sqrt(half * half + C[2] * C[2])
    return ti.sqrt((C[0] + C[1]) / 2 + radius), half, radius


@functools.cache
def _measure(serial: bool):
    @ti.kernel
    def kernel(x: vec3s, v: vec3s, numbers: scalars, triangles: index3, g: vec3s, stretch: scalars):
        ti.loop_config(serialize=serial)
        for e in range(stretch.shape[0]):
            C, _, _ = _stretched(x, v, numbers[0], triangles[e], g[3 * e + 1], g[3 * e + 2])
            stretch[e], _, _ = _largest(C)

    return kernel


#: A triangle over the limit waits in a ring, `queue`, at most once: `queued` says so. `around[ptr[i]:ptr[i + 1]]` are
#: the triangles at vertex i.
@ti.kernel
def _correct(
    x: vec3s,
    v: vec3s,
    numbers: scalars,
    triangles: index3,
    g: vec3s,
    weight: scalars,
    ptr: integers,
    around: integers,
    count: integers,
    queue: integers,
    queued: integers,
):
    ti.loop_config(serialize=True)
    for _ in range(1):
        m = queue.shape[0]
        first, waiting, visits = 0, count[0], 0
        dt, limit = numbers[0], numbers[1]
        while waiting > 0 and visits < VISITS * m:
            e = queue[first]
            first = (first + 1) % m
            waiting -= 1
            visits += 1
            queued[e] = 0
            t, g1, g2 = triangles[e], g[3 * e + 1], g[3 * e + 2]
            C, f0, f1 = _stretched(x, v, dt, t, g1, g2)
            s, half, radius = _largest(C)
            if s > limit + TOLERANCE:
                c, d = radius + half, C[2]  # v_0, not yet of length 1
                if half < 0:
                    c, d = C[2], radius - half
                length = ti.sqrt(c * c + d * d)
                c, d = (c / length, d / length) if length > 0 else (1.0, 0.0)
                u = (c * f0 + d * f1) / s
                h1, h2 = c * g1[0] + d * g1[1], c * g2[0] + d * g2[1]
                h = ti.Vector([-h1 - h2, h1, h2])  # g_i . v_0
                w = ti.Vector([weight[t[0]], weight[t[1]], weight[t[2]]])
                total = (w * h).dot(h)
                if total > 0:
                    impulse = (s - limit) / (dt * total)
                    for i in ti.static(range(3)):
                        v[t[i]] -= w[i] * h[i] * impulse * u
                        for k in range(ptr[t[i]], ptr[t[i] + 1]):
                            if queued[around[k]] == 0:
                                queued[around[k]] = 1
                                queue[(first + waiting) % m] = around[k]
                                waiting += 1
