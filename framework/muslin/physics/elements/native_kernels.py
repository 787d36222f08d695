"""Kernels of the framework's own element: its polar decomposition, energy, gradient and modes (see `native`)."""

import functools

from muslin.base.arrays import REAL, TINY, index3, integers, rows, scalars, vec3s
from muslin.base.engine import ti
from muslin.given import tangents
from muslin.physics.elements import modes

#: Stretches and areas below this count as collapsed: what divides by them stays finite.
COLLAPSED = 1e-6


@functools.cache
def gradients_at_rest(serial: bool):
    """Kernel of the gradient of each corner's shape function in its triangle's plane."""

    @ti.kernel
    def kernel(X: vec3s, triangles: index3, normal: vec3s, g0: vec3s):
        ti.loop_config(serialize=serial)
        for e in range(triangles.shape[0]):
            t = triangles[e]
            t0, t1 = tangents(normal[e])
            a, b = X[t[1]] - X[t[0]], X[t[2]] - X[t[0]]
            a0, a1, b0, b1 = t0.dot(a), t1.dot(a), t0.dot(b), t1.dot(b)
            twice_area = a0 * b1 - a1 * b0
            g1 = ti.Vector([b1, -b0, 0.0]) / twice_area
            g2 = ti.Vector([-a1, a0, 0.0]) / twice_area
            g0[3 * e] = -g1 - g2
            g0[3 * e + 1] = g1
            g0[3 * e + 2] = g2

    return kernel


@ti.func
def polar(x0, x1, x2, g1, g2):
    """F = R S of the 3x2 deformation gradient; returns R's columns, n, S = [[a, c], [c, b]], s_0 + s_1 and s_0 s_1."""
    f0 = (x1 - x0) * g1[0] + (x2 - x0) * g2[0]
    f1 = (x1 - x0) * g1[1] + (x2 - x0) * g2[1]
    m = (x1 - x0).cross(x2 - x0)
    n = m / ti.max(m.norm(), TINY)  # a collapsed triangle has no normal, but must not make a NaN
    length = f0.norm()
    q0, _ = tangents(n)
    if length > 0:
        q0 = f0 / length
    q1 = n.cross(q0)
    m01, m11 = q0.dot(f1), ti.max(q1.dot(f1), 0.0)
    trace = ti.sqrt((length + m11) ** 2 + m01**2)  # of S, since the 2x2 part is a rotation times S
    c, d = 1.0, 0.0
    if trace > 0:
        c, d = (length + m11) / trace, -m01 / trace
    r0, r1 = c * q0 + d * q1, c * q1 - d * q0
    return r0, r1, n, ti.Vector([c * length, c * m11 - d * m01, -d * length]), trace, length * m11


@ti.func
def principal(S, trace, area):
    """Stretches s_0 >= s_1 of S = [[a, c], [c, b]] as `polar` gives it, and its eigenvector v_0 = (c, d)."""
    half = (S[0] - S[1]) / 2
    radius = ti.sqrt(half * half + S[2] * S[2])
    s0 = trace / 2 + radius
    s1 = area / ti.max(s0, COLLAPSED)
    c, d = 1.0, 0.0
    if radius > 0:
        if half >= 0:
            c, d = radius + half, S[2]
        else:
            c, d = ti.abs(S[2]), radius - half
            if S[2] < 0:
                d = -d
        length = ti.sqrt(c * c + d * d)
        c, d = c / length, d / length
    return s0, s1, c, d


@functools.cache
def element(serial: bool):
    """Kernel of the parts in `orders[0]`, as bits, of every triangle; `orders[1]` says whether to project."""

    @ti.kernel
    def kernel(
        orders: integers,
        x: vec3s,
        triangles: index3,
        g: vec3s,
        weight: scalars,
        mu: REAL,
        lam_trace: REAL,
        lam_area: REAL,
        energy: scalars,
        gradient: vec3s,
        row: rows,
    ):
        ti.loop_config(serialize=serial)
        for e in range(triangles.shape[0]):
            t = triangles[e]
            g0, g1, g2 = g[3 * e], g[3 * e + 1], g[3 * e + 2]
            r0, r1, n, S, trace, area = polar(x[t[0]], x[t[1]], x[t[2]], g1, g2)
            tension, pressure = lam_trace * (trace - 2), lam_area * (area - 1)
            if orders[0] & 1:
                off_rest = (S[0] - 1) ** 2 + (S[1] - 1) ** 2 + 2 * S[2] ** 2  # |S - I|^2
                energy[e] = weight[e] * (
                    mu * off_rest + lam_trace / 2 * (trace - 2) ** 2 + lam_area / 2 * (area - 1) ** 2
                )
            if orders[0] & 2:
                # P = R T with T = 2 mu (S - I) + lam (tr S - 2) I, or + lam (J - 1) adj(S) for the area energy
                T00 = 2 * mu * (S[0] - 1) + tension + pressure * S[1]
                T11 = 2 * mu * (S[1] - 1) + tension + pressure * S[0]
                T01 = (2 * mu - pressure) * S[2]
                p0, p1 = weight[e] * (T00 * r0 + T01 * r1), weight[e] * (T01 * r0 + T11 * r1)
                gradient[3 * e] = g0[0] * p0 + g0[1] * p1
                gradient[3 * e + 1] = g1[0] * p0 + g1[1] * p1
                gradient[3 * e + 2] = g2[0] * p0 + g2[1] * p1
            if orders[0] & 4:
                s0, s1, c, d = principal(S, trace, area)
                U = ti.Matrix.cols([c * r0 + d * r1, c * r1 - d * r0, n])
                # modes of 2 mu (F - R) + lam_trace (tr S - 2) R + lam_area (J - 1) dJ/dF, simplified by hand
                pull = tension - 2 * mu
                stretch0 = 2 * mu + lam_trace + lam_area * s1 * s1
                stretch1 = 2 * mu + lam_trace + lam_area * s0 * s0
                coupling = lam_trace + lam_area * (2 * area - 1)
                d0, d1 = ti.max(s0, COLLAPSED), ti.max(s1, COLLAPSED)
                modes.store(
                    row,
                    e,
                    U,
                    ti.Vector([c * g0[0] + d * g0[1], c * g0[1] - d * g0[0]]),
                    ti.Vector([c * g1[0] + d * g1[1], c * g1[1] - d * g1[0]]),
                    ti.Vector([c * g2[0] + d * g2[1], c * g2[1] - d * g2[0]]),
                    ti.Vector([stretch0, stretch1, coupling]),
                    2 * mu - pressure,
                    2 * mu + 2 * pull / ti.max(trace, COLLAPSED) + pressure,
                    2 * mu + pull / d0 + pressure * s1 / d0,
                    2 * mu + pull / d1 + pressure * s0 / d1,
                    weight[e],
                    orders[1],
                )

    return kernel


@functools.cache
def of_invariants(serial: bool):
    """As `element`, of mu/2 (s_0 - s_1)^2 + a/2 (I - 2)^2 + b/2 (J - 1)^2 (see `muslin.physics.invariants`)."""

    @ti.kernel
    def kernel(
        orders: integers,
        x: vec3s,
        triangles: index3,
        g: vec3s,
        weight: scalars,
        mu: REAL,
        a: REAL,
        b: REAL,
        energy: scalars,
        gradient: vec3s,
        row: rows,
    ):
        ti.loop_config(serialize=serial)
        for e in range(triangles.shape[0]):
            t = triangles[e]
            g0, g1, g2 = g[3 * e], g[3 * e + 1], g[3 * e + 2]
            r0, r1, n, S, trace, J = polar(x[t[0]], x[t[1]], x[t[2]], g1, g2)
            apart = (S[0] - S[1]) ** 2 + 4 * S[2] ** 2  # (s_0 - s_1)^2
            # I - 2 without cancellation
            longer = (S[0] - 1) * (S[0] + 1) + (S[1] - 1) * (S[1] + 1) + 2 * S[2] ** 2
            along, size = mu / 2 + a * longer, b * (J - 1) - mu  # the derivatives of psi in I and J
            if orders[0] & 1:
                energy[e] = weight[e] * (mu / 2 * apart + a / 2 * longer**2 + b / 2 * (J - 1) ** 2)
            if orders[0] & 2:
                # P = R T with T = 2 psi_I S + psi_J adj(S)
                T00, T11 = 2 * along * S[0] + size * S[1], 2 * along * S[1] + size * S[0]
                T01 = (2 * along - size) * S[2]
                p0, p1 = weight[e] * (T00 * r0 + T01 * r1), weight[e] * (T01 * r0 + T11 * r1)
                gradient[3 * e] = g0[0] * p0 + g0[1] * p1
                gradient[3 * e + 1] = g1[0] * p0 + g1[1] * p1
                gradient[3 * e + 2] = g2[0] * p0 + g2[1] * p1
            if orders[0] & 4:
                s0, s1, c, d = principal(S, trace, J)
                modes.store(
                    row,
                    e,
                    ti.Matrix.cols([c * r0 + d * r1, c * r1 - d * r0, n]),
                    ti.Vector([c * g0[0] + d * g0[1], c * g0[1] - d * g0[0]]),
                    ti.Vector([c * g1[0] + d * g1[1], c * g1[1] - d * g1[0]]),
                    ti.Vector([c * g2[0] + d * g2[1], c * g2[1] - d * g2[0]]),
                    ti.Vector(
                        [
                            2 * along + 4 * a * s0 * s0 + b * s1 * s1,
                            2 * along + 4 * a * s1 * s1 + b * s0 * s0,
                            size + 4 * a * J + b * J,
                        ]
                    ),
                    2 * along - size,
                    2 * along + size,
                    2 * along + size * s1 / ti.max(s0, COLLAPSED),
                    2 * along + size * s0 / ti.max(s1, COLLAPSED),
                    weight[e],
                    orders[1],
                )

    return kernel
