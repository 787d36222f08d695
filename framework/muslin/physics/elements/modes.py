"""The closed-form Hessian of one triangle, from the modes of its 3x2 deformation gradient.

In the frame of the principal directions (u_0, u_1, n) and (v_0, v_1) the Hessian of psi is the 2x2 stretch
block (rows and columns: stretching u_0 v_0^T and u_1 v_1^T) and four numbers: flip, (u_0 v_1^T + u_1 v_0^T)/sqrt 2;
twist, (u_0 v_1^T - u_1 v_0^T)/sqrt 2; and out_i, n v_i^T. Positive semi-definiteness is a matter of those numbers
alone, so projection clamps them and never decomposes a 9x9 matrix.

`store` writes a triangle's modes as one row of `LENGTH` numbers, a quarter of its 9x9 matrix; `load` gives any
of its 3x3 blocks back, where it is needed.
"""

from muslin.base.engine import ti

#: Numbers of a row: U (9), gradients of phi_i in the frame (v_0, v_1) (6), stretch block (3), same and cross (2),
#: out_0 and out_1 (2), the last seven times h a.
LENGTH = 22


@ti.func
def clamp_stretch(a, b, c):
    """Nearest positive semi-definite matrix of [[a, c], [c, b]], in closed form; returns (a, b, c)."""
    middle, half = (a + b) / 2, (a - b) / 2
    radius = ti.sqrt(half * half + c * c)
    high, low = middle + radius, middle - radius
    if low < 0:
        if high <= 0:
            a, b, c = 0.0 * a, 0.0 * b, 0.0 * c
        else:  # keep only high: high * w w^T, with w w^T = (A - low I) / (high - low)
            scale = high / (high - low)
            a, b, c = scale * (a - low), scale * (b - low), scale * c
    return a, b, c


@ti.func
def store(row: ti.template(), e, U, g0, g1, g2, stretch, flip, twist, out0, out1, weight, project):
    """Write the modes of triangle e, with `project` made positive semi-definite.

    U          : principal directions u_0, u_1, n as columns, mat3
    g0, g1, g2 : gradients of the shape functions in the frame (v_0, v_1), vec2 [1/m]
    stretch    : (psi_00, psi_11, psi_01), vec3 [Pa]
    flip, twist, out0, out1 : the other modes [Pa]
    weight     : h a [m^3]
    """
    a, b, c = stretch[0], stretch[1], stretch[2]
    w = weight + 0.0 * (flip + twist + out0 + out1)  # clamping a NaN would hide it
    if project == 1:
        a, b, c = clamp_stretch(a, b, c)
        flip, twist = ti.max(flip, 0.0), ti.max(twist, 0.0)
        out0, out1 = ti.max(out0, 0.0), ti.max(out1, 0.0)
    for k in ti.static(range(9)):
        row[e, k] = U[k // 3, k % 3]
    for k in ti.static(range(2)):
        row[e, 9 + k], row[e, 11 + k], row[e, 13 + k] = g0[k], g1[k], g2[k]
    row[e, 15], row[e, 16], row[e, 17] = w * a, w * b, w * c
    row[e, 18], row[e, 19] = w * (flip + twist) / 2, w * (flip - twist) / 2
    row[e, 20], row[e, 21] = w * out0, w * out1


@ti.func
def load(row: ti.template(), e, i, j):
    """Block (i, j) of triangle e's Hessian, mat3 [N/m], from its stored modes."""
    i0, i1, j0, j1 = row[e, 9 + 2 * i], row[e, 10 + 2 * i], row[e, 9 + 2 * j], row[e, 10 + 2 * j]
    U = ti.Matrix([[row[e, 3 * k + m] for m in range(3)] for k in range(3)])
    stretch = ti.Vector([row[e, 15], row[e, 16], row[e, 17]])
    return in_frame(U, i0, i1, j0, j1, stretch, row[e, 18], row[e, 19], row[e, 20], row[e, 21])


@ti.func
def in_frame(U, i0, i1, j0, j1, stretch, same, cross, out0, out1):
    """Block U C U^T with C made of the modes in the frame; (i0, i1), (j0, j1) are the gradients there."""
    c00 = stretch[0] * i0 * j0 + same * i1 * j1
    c11 = stretch[1] * i1 * j1 + same * i0 * j0
    c01 = stretch[2] * i0 * j1 + cross * i1 * j0
    c10 = stretch[2] * i1 * j0 + cross * i0 * j1
    cnn = out0 * i0 * j0 + out1 * i1 * j1
    u0, u1, n = U[:, 0], U[:, 1], U[:, 2]
    return (
        u0.outer_product(c00 * u0 + c01 * u1)
        + u1.outer_product(c10 * u0 + c11 * u1)
        + (cnn * n).outer_product(n)
    )


@ti.func
def block(U, gi, gj, stretch, flip, twist, out):
    """Block (i, j) of the triangle's Hessian per h a.

    U       : principal directions u_0, u_1, n as columns, mat3
    gi, gj  : gradients of phi_i, phi_j in the frame (v_0, v_1), vec2 [1/m]
    stretch : (psi_00, psi_11, psi_01), vec3 [Pa]
    flip, twist, out : the four modes, scalars and vec2 [Pa]
    returns : mat3 [Pa/m^2]
    """
    same, cross = (flip + twist) / 2, (flip - twist) / 2
    return in_frame(U, gi[0], gi[1], gj[0], gj[1], stretch, same, cross, out[0], out[1])
