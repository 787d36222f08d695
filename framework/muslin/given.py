"""Given code: what a student may use but need not write (the singular value decomposition and its derivative).

All of it runs inside Taichi kernels, on the 3x3 deformation gradient of a triangle that carries its normal
along: F N = n. The normal's stretch is therefore exactly 1; it stands last, with V's third column N and U's n.
"""

from muslin.base.engine import ti

#: Equal stretches are pushed apart by about this much before the singular value decomposition is differentiated.
SPLIT = 1e-6


@ti.func
def diag(p):
    """Diagonal matrix (mat3) of a vec3."""
    return ti.Matrix([[p[0], 0.0, 0.0], [0.0, p[1], 0.0], [0.0, 0.0, p[2]]])


@ti.func
def tangents(N):
    """Two unit vectors that complete the unit vector N to a right-handed frame (t0, t1, N).

    Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017. Exact for N along z.
    """
    sign = 1.0
    if N[2] < 0:
        sign = -1.0
    a = -1 / (sign + N[2])
    b = N[0] * N[1] * a
    t0 = ti.Vector([1 + sign * N[0] * N[0] * a, sign * b, -sign * N[0]])
    t1 = ti.Vector([b, sign + N[1] * N[1] * a, -N[1]])
    return t0, t1


@ti.func
def half_angle(z):
    """Cosine and sine of half the angle of the vector z, by square roots; of zero where z vanishes."""
    length = z.norm()
    c, s = 1.0, 0.0
    if length > 0:
        x, y = z[0] / length, z[1] / length
        if x >= 0:
            c = ti.sqrt((1 + x) / 2)
            s = y / (2 * c)
        else:
            s = ti.sqrt((1 - x) / 2)
            c = ti.abs(y) / (2 * s)
            if y < 0:
                s = -s
    return c, s


@ti.func
def svd(F, N):
    """F = U diag(s) V^T with s_0 >= s_1 >= 0 in the plane of the triangle and s_2 = 1 along its normal.

    Closed form: the two in-plane columns of F are orthogonalised (Gram-Schmidt, the longer first) and the
    remaining 2x2 triangle is decomposed by two half angles. U and V are rotations. Error about 1e-15, also for
    equal, vanishing and very different stretches.

    F       : deformation gradient with F N = n, mat3 [1]
    N       : unit normal of the undeformed triangle, vec3 [1]
    returns : U mat3, s vec3, V mat3 [1]
    """
    t0, t1 = tangents(N)
    a, b = F @ t0, F @ t1
    if b.norm_sqr() > a.norm_sqr():  # the longer column first; turning the frame keeps it right-handed
        a, b = b, -a
        t0, t1 = t1, -t0
    n = F @ N
    length = a.norm()
    q0, _ = tangents(n)
    if length > 0:
        q0 = a / length
    r01 = q0.dot(b)
    q1 = b - r01 * q0
    q1 -= q0.dot(q1) * q0
    r11 = q1.norm()
    if r11 > 1e-14 * length:
        q1 /= r11
        q1 = (q1 - q0.dot(q1) * q0).normalized()
    else:
        q1 = n.cross(q0).normalized()
        r11 = ti.max(q1.dot(b), 0.0)
    # 2x2: [[length, r01], [0, r11]] = R(left) diag(s_0, s_1) R(right), by two half angles
    plus = ti.Vector([length + r11, -r01]) / 2
    minus = ti.Vector([length - r11, r01]) / 2
    s0 = plus.norm() + minus.norm()
    s1 = 0.0 * s0
    if s0 > 0:
        s1 = ti.min(length * (r11 / s0), s0)
    ca, sa = half_angle(plus)
    cb, sb = half_angle(minus)
    c, d = ca * cb - sa * sb, sa * cb + ca * sb  # left: the sum of the half angles
    u0, u1 = c * q0 + d * q1, c * q1 - d * q0
    c, d = ca * cb + sa * sb, sa * cb - ca * sb  # right: their difference
    v0, v1 = c * t0 - d * t1, d * t0 + c * t1
    U = ti.Matrix.cols([u0, u1, u0.cross(u1)])
    V = ti.Matrix.cols([v0, v1, N])
    return U, ti.Vector([s0, s1, 1.0]), V


@ti.func
def split(s):
    """Push equal stretches apart, the same way every time, so that all three differ by about `SPLIT`.

    s       : s_0 >= s_1, and the normal's 1, vec3 [1]
    returns : the stretches of a nearby matrix with the same U and V, vec3 [1]
    """
    s0, s1 = s[0], s[1]
    close = 0.99 * SPLIT
    middle = (s0 + s1) / 2
    apart = ti.max(ti.min(middle, 1.0), 0.7)  # less for small stretches, whose energy bends more
    if s0 - s1 < close * apart:
        s0, s1 = middle + SPLIT * apart / 2, middle - SPLIT * apart / 2
    if abs(s0 - 1) < close:
        s0 = 1 + SPLIT
    if abs(s1 - 1) < close:
        s1 = 1 - SPLIT
    return ti.Vector([s0, s1, s[2]])


@ti.func
def dsvd(U, s, V, i, j):
    """Derivatives of U, s and V in the entry F_ij of F = U diag(s) V^T.

    With A = U^T (dF/dF_ij) V: ds is A's diagonal, and dU = U W, dV = V Z with W, Z antisymmetric solve
    A = W diag(s) + diag(ds) - diag(s) Z off the diagonal. Where stretches are equal they are `split` first;
    evaluate dpsi_ds and d2psi_ds2 at `split(s)` too, so that everything belongs to the same nearby matrix.

    returns : dU mat3, ds vec3, dV mat3 [1]
    """
    t = split(s)
    W = ti.Matrix.zero(float, 3, 3)
    Z = ti.Matrix.zero(float, 3, 3)
    ds = ti.Vector([U[i, 0] * V[j, 0], U[i, 1] * V[j, 1], U[i, 2] * V[j, 2]])
    for k, m in ti.static(((0, 1), (0, 2), (1, 2))):
        Akm = U[i, k] * V[j, m]
        Amk = U[i, m] * V[j, k]
        squares = (t[m] - t[k]) * (t[m] + t[k])
        W[k, m] = (t[m] * Akm + t[k] * Amk) / squares
        Z[k, m] = (t[k] * Akm + t[m] * Amk) / squares
        W[m, k] = -W[k, m]
        Z[m, k] = -Z[k, m]
    return U @ W, ds, V @ Z


#: What the given functions take and return, for `muslin.evaluate`: kinds as in `muslin.tasks.KINDS`.
KINDS = {
    "diag": (("vec3",), ("mat3",)),
    "tangents": (("vec3",), ("vec3", "vec3")),
    "svd": (("mat3", "vec3"), ("mat3", "vec3", "mat3")),
    "split": (("vec3",), ("vec3",)),
    "dsvd": (("mat3", "vec3", "mat3", "int", "int"), ("mat3", "vec3", "mat3")),
}
