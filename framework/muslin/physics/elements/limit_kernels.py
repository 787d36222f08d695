"""Kernels of strain limiting: stretches at the end of a step, and the impulses that take them back (see `limit`)."""

import functools

from muslin.base.arrays import index3, integers, scalars, vec3s
from muslin.base.engine import ti

#: A triangle is let be when it is over the limit by no more than this.
TOLERANCE = 1e-4


#: Triangles looked at in one step at most, in terms of those there are.
VISITS = 4


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
def measure(serial: bool):
    """Kernel of the larger principal stretch of every triangle after a step."""

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
def correct(
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
    """Take back what is over the limit, triangle by triangle, in the velocities."""
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
