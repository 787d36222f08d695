"""Kernels of the two models of bending (see `bending`).

A hinge has the corners x_0, x_1 (the edge's ends), x_2, x_3 (across it). Of its angle theta, with n_a, h_a, t_a the
unit normals, the heights above the edge and the heights' feet (as shares of the edge) of its triangles a = 0, 1:

    d theta = sum_a sum_k beta_ak n_a . dx_k,        beta_a = (1 - t_a, t_a, -1) / h_a  for the corners 0, 1, 2 + a

and with g_ak the gradients of the shape functions, m_a the unit vectors across the edge into the triangles

    d2 theta = sum_a -(U_a^T V_a + V_a^T U_a) + E,   U_a = sum_k beta_ak (I - n_a n_a^T) dx_k,
                                                     V_a = sum_k g_ak (n_a . dx_k),
    E = (dx_1 - dx_0)^T (n_0 m_0^T + n_1 m_1^T) (dx_1 - dx_0) / |e|^2.

(Tamstorf and Grinspun 2013, grouped.) Times f = k w |e|^2 (theta - theta_0) each of the three has eigenvalues of both
signs in pairs, known in closed form: with C = sum_k g_k g_k^T, the positive half of -f (U^T V + V^T U) is
|f|/2 (U^T C^(1/2) U / |beta| + |beta| V^T C^(-1/2) V) - f/2 (U^T V + V^T U), and that of f E is made of
|f sin theta|/2 times the identity across the edge. Made so, each hinge's Hessian is positive semi-definite.
"""

import functools

from muslin.base.arrays import TINY, index4, integers, mat3s, scalars, vec3s, vec4s
from muslin.base.engine import ti


@functools.cache
def quadratic(serial: bool):
    """Kernel of every hinge's energy and gradient in the quadratic model."""

    @ti.kernel
    def kernel(x: vec3s, cells: index4, c: vec4s, weight: scalars, energy: scalars, gradient: vec3s):
        ti.loop_config(serialize=serial)
        for e in range(cells.shape[0]):
            v = cells[e]
            x0 = x[v[0]]
            bent = c[e][1] * (x[v[1]] - x0) + c[e][2] * (x[v[2]] - x0) + c[e][3] * (x[v[3]] - x0)
            energy[e] = weight[e] / 2 * bent.dot(bent)
            for k in ti.static(range(4)):
                gradient[4 * e + k] = weight[e] * c[e][k] * bent

    return kernel


@ti.kernel
def constant(
    narrow: int, cells: index4, c: vec4s, weight: scalars, ptr: integers, col: integers, place: integers, own: scalars,
    between: scalars,
):  # fmt: skip
    """Sum the quadratic model's Hessian into blocks, of vertices with themselves in `own` first.

    `narrow`: what is between corners 2 and 3 of a hinge goes to these themselves. `place`: where each row begins.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        e = 0
        while e < cells.shape[0]:
            v, w, b = cells[e], weight[e], c[e]
            outside = 0.0
            if narrow:
                outside = w * b[2] * b[3]
            for i in ti.static(range(4)):
                mine = w * b[i] * b[i]
                if ti.static(i > 1):
                    mine += outside
                own[v[i]] = own[v[i]] + mine
                for j in ti.static(range(i + 1, 4)):
                    if ti.static(i < 2) or not narrow:
                        at = ptr[v[i]]
                        while col[at] != v[j]:
                            at += 1
                        between[at] = between[at] + w * b[i] * b[j]
            e += 1
        i = 0
        while i < own.shape[0]:  # row by row, as the entries below the diagonal lie in their columns
            at = ptr[i]
            while at < ptr[i + 1]:
                j = col[at]
                if j == i:
                    between[at] = own[i]
                elif j > i:
                    mirrored = place[j]
                    place[j] = mirrored + 1
                    both = between[at] + between[mirrored]
                    between[at], between[mirrored] = both, both
                at += 1
            i += 1


@ti.kernel
def across(
    cells: index4, c: vec4s, weight: scalars, ptr: integers, corners: integers, begin: integers, columns: integers,
    entries: scalars,
):  # fmt: skip
    """Rows of `bending._outside`; `ptr` and `corners` say which corners of hinges each vertex is."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        i, to, n = 0, 0, ptr.shape[0] - 1
        while i < n:
            begin[i] = to
            r, last, k = ptr[i], ptr[i + 1], 0
            while r < last:
                k += (corners[r] & 3) > 1
                r += 1
            for corner in ti.static((2, 3)):
                r = ptr[i]
                while r < last:
                    e = corners[r] >> 2
                    if corners[r] & 3 == corner:
                        pull = weight[e] * c[e][2] * c[e][3]
                        columns[to], entries[to] = i, pull
                        columns[to + k], entries[to + k] = cells[e][5 - corner], -pull
                        to += 1
                    r += 1
            to += k
            i += 1
        begin[n] = to


@ti.func
def angle(n0, n1, t):
    """Angle between the triangles' unit normals, positive about the edge's direction t."""
    return ti.atan2(n0.cross(n1).dot(t), n0.dot(n1))


@ti.func
def side(x0, t, length, opposite, sign):
    """One triangle of a hinge: unit normal n, unit vector m across the edge, height, and its foot."""
    to = opposite - x0
    along = to.dot(t)
    m = to - along * t
    height = ti.max(m.norm(), TINY)
    m = m / height
    return sign * t.cross(m), m, height, along / length


@ti.func
def corner(k, a):
    """Which of a hinge's corners is corner k of its triangle a."""
    c = k
    if k == 2:
        c = 2 + a
    return c


@functools.cache
def shells(serial: bool):
    """Kernel of the parts in `orders[0]`, as bits, of every hinge; `orders[1]` says whether to project."""

    @ti.kernel
    def kernel(
        orders: integers,
        x: vec3s,
        cells: index4,
        rest: scalars,
        weight: scalars,
        energy: scalars,
        gradient: vec3s,
        hessian: mat3s,
    ):
        ti.loop_config(serialize=serial)
        for e in range(cells.shape[0]):
            v = cells[e]
            x0 = x[v[0]]
            edge = x[v[1]] - x0
            length = ti.max(edge.norm(), TINY)
            t = edge / length
            n0, m0, h0, s0 = side(x0, t, length, x[v[2]], 1.0)
            n1, m1, h1, s1 = side(x0, t, length, x[v[3]], -1.0)
            theta = angle(n0, n1, t)
            off = theta - rest[e]
            f = weight[e] * off
            g = ti.Matrix.rows(
                [(1 - s0) / h0 * n0 + (1 - s1) / h1 * n1, s0 / h0 * n0 + s1 / h1 * n1, -n0 / h0, -n1 / h1]
            )
            if orders[0] & 1:
                energy[e] = weight[e] / 2 * off * off
            if orders[0] & 2:
                for k in ti.static(range(4)):
                    for a in ti.static(range(3)):
                        gradient[4 * e + k][a] = f * g[k, a]
            if orders[0] & 4:
                for i in range(4):
                    for j in range(4):
                        gi = ti.Vector([g[i, 0], g[i, 1], g[i, 2]])
                        gj = ti.Vector([g[j, 0], g[j, 1], g[j, 2]])
                        hessian[16 * e + 4 * i + j] = weight[e] * gi.outer_product(gj)
                for a in range(2):
                    n, m, h, s = n0, m0, h0, s0
                    if a == 1:
                        n, m, h, s = n1, m1, h1, s1
                    beta = ti.Vector([(1 - s) / h, s / h, -1 / h])
                    # gradients of the shape functions along the edge and across it
                    gt, gm = ti.Vector([-1 / length, 1 / length, 0.0]), -beta
                    ctt, ctm, cmm = gt.dot(gt), gt.dot(gm), gm.dot(gm)
                    size = ti.sqrt(cmm)  # of beta
                    det = ti.sqrt(ti.max(ctt * cmm - ctm * ctm, 0.0))
                    both = ti.max(ti.sqrt(ctt + cmm + 2 * det), TINY)
                    rtt, rtm, rmm = (ctt + det) / both, ctm / both, (cmm + det) / both  # C^(1/2)
                    inverse = ti.max(det, TINY)
                    plane = (
                        rtt * t.outer_product(t)
                        + rtm * (t.outer_product(m) + m.outer_product(t))
                        + rmm * m.outer_product(m)
                    )
                    for k in range(3):
                        for j in range(3):
                            gk, gj = gt[k] * t + gm[k] * m, gt[j] * t + gm[j] * m
                            B = -f * (beta[k] * gj.outer_product(n) + beta[j] * n.outer_product(gk))
                            if orders[1] == 1:
                                out = (
                                    rmm * gt[k] * gt[j]
                                    - rtm * (gt[k] * gm[j] + gm[k] * gt[j])
                                    + rtt * gm[k] * gm[j]
                                )
                                B = B / 2 + ti.abs(f) / 2 * (
                                    beta[k] * beta[j] / size * plane
                                    + size * out / inverse * n.outer_product(n)
                                )
                            hessian[16 * e + 4 * corner(k, a) + corner(j, a)] += B
                S = f * (n0.outer_product(m0) + n1.outer_product(m1))
                if orders[1] == 1:
                    across = ti.Matrix.identity(float, 3) - t.outer_product(t)
                    S = S / 2 + ti.abs(f * ti.sin(theta)) / 2 * across
                S = S / (length * length)
                for i in range(2):
                    for j in range(2):
                        if i == j:
                            hessian[16 * e + 4 * i + j] += S
                        else:
                            hessian[16 * e + 4 * i + j] -= S

    return kernel
