"""Singular values and eigenvalues of 3x3 matrices by Jacobi's rotations: to the last digits, in runtime loops."""

from muslin.base.arrays import TINY
from muslin.base.engine import ti
from muslin.given import tangents

#: Rounds of three rotations at most; five do.
SWEEPS = 12

#: Columns count as orthogonal, and off-diagonal entries as zero, below this share of what is beside them.
SMALL = 1e-16


@ti.func
def _turn(half, off):
    """Cosine and sine of the rotation that takes `off` to zero in [[a, off], [off, a + 2 half]]."""
    c, s = 1.0, 0.0
    if off != 0:
        t = ti.abs(off) / (ti.abs(half) + ti.sqrt(half * half + off * off))
        c = 1 / ti.sqrt(1 + t * t)
        s = c * t
        if (half < 0) != (off < 0):
            s = -s
    return c, s


@ti.func
def signed_svd(F):
    """F = U diag(s) V^T with rotations U and V; the last stretch is the smallest, and negative if det F is.

    One-sided Jacobi: columns of F are rotated until they are orthogonal; their lengths are the stretches.
    """
    A, V = F, ti.Matrix.identity(float, 3)
    turned, sweep = 1, 0
    while turned == 1 and sweep < SWEEPS:
        turned = 0
        sweep += 1
        for k in ti.static(range(3)):
            p, q = (k + 1) % 3, (k + 2) % 3
            a, b = A[:, p], A[:, q]
            aa, bb, ab = a.norm_sqr(), b.norm_sqr(), a.dot(b)
            if ti.abs(ab) > SMALL * ti.sqrt(aa * bb):
                turned = 1
                c, s = _turn((bb - aa) / 2, ab)
                v, w = V[:, p], V[:, q]
                A[:, p], A[:, q] = c * a - s * b, s * a + c * b
                V[:, p], V[:, q] = c * v - s * w, s * v + c * w
    lengths = ti.Vector([A[:, 0].norm(), A[:, 1].norm(), A[:, 2].norm()])
    a0, a1, a2, v0, v1, v2 = A[:, 0], A[:, 1], A[:, 2], V[:, 0], V[:, 1], V[:, 2]
    if lengths[0] < lengths[1] and lengths[0] <= lengths[2]:
        a0, a1, a2, v0, v1, v2 = a1, a2, a0, v1, v2, v0
    elif lengths[1] <= lengths[0] and lengths[1] < lengths[2]:
        a0, a1, a2, v0, v1, v2 = a2, a0, a1, v2, v0, v1
    s0, s1 = a0.norm(), a1.norm()
    u0 = a0 / ti.max(s0, TINY)
    u1 = a1 / ti.max(s1, TINY)
    if s0 <= TINY:  # nothing, or a line: any directions across do
        u0 = u1 if s1 > TINY else ti.Vector([1.0, 0.0, 0.0])
        if s1 > TINY:
            u0, _ = tangents(u1)
    if s1 <= TINY:
        u1, _ = tangents(u0)
    u2 = u0.cross(u1)
    return ti.Matrix.cols([u0, u1, u2]), ti.Vector([s0, s1, u2.dot(a2)]), ti.Matrix.cols([v0, v1, v2])


@ti.func
def clamped(A):
    """The nearest positive semi-definite matrix to a symmetric one: itself, bit for bit, where it is one."""
    B, W = A, ti.Matrix.identity(float, 3)
    left, sweep = 1, 0
    while left == 1 and sweep < SWEEPS:
        left = 0
        sweep += 1
        for k in ti.static(range(3)):
            p, q = (k + 1) % 3, (k + 2) % 3
            if ti.abs(B[p, q]) > SMALL * (ti.abs(B[p, p]) + ti.abs(B[q, q])):
                left = 1
                c, s = _turn((B[q, q] - B[p, p]) / 2, B[p, q])
                a, b = B[:, p], B[:, q]
                B[:, p], B[:, q] = c * a - s * b, s * a + c * b
                a, b = B[p, :], B[q, :]
                B[p, :], B[q, :] = c * a - s * b, s * a + c * b
                a, b = W[:, p], W[:, q]
                W[:, p], W[:, q] = c * a - s * b, s * a + c * b
                B[p, q], B[q, p] = 0.0, 0.0
    result = A
    for k in ti.static(range(3)):
        if B[k, k] < 0:
            result -= B[k, k] * W[:, k].outer_product(W[:, k])
    return result
