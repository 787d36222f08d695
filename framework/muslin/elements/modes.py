"""The closed-form Hessian of one triangle, from the modes of its 3x2 deformation gradient.

In the frame of the principal directions (u_0, u_1, n) and (v_0, v_1) the Hessian of psi is the 2x2 stretch
block (rows and columns: stretching u_0 v_0^T and u_1 v_1^T) and four numbers: flip, (u_0 v_1^T + u_1 v_0^T)/sqrt 2;
twist, (u_0 v_1^T - u_1 v_0^T)/sqrt 2; and out_i, n v_i^T. Positive semi-definiteness is a matter of those numbers
alone, so projection clamps them and never decomposes a 9x9 matrix.
"""

import taichi as ti


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
def block(U, gi, gj, stretch, flip, twist, out):
    """Block (i, j) of the triangle's Hessian per h a.

    U       : principal directions u_0, u_1, n as columns, mat3
    gi, gj  : gradients of phi_i, phi_j in the frame (v_0, v_1), vec2 [1/m]
    stretch : (psi_00, psi_11, psi_01), vec3 [Pa]
    flip, twist, out : the four modes, scalars and vec2 [Pa]
    returns : mat3 [Pa/m^2]
    """
    same, cross = (flip + twist) / 2, (flip - twist) / 2
    c00 = stretch[0] * gi[0] * gj[0] + same * gi[1] * gj[1]
    c11 = stretch[1] * gi[1] * gj[1] + same * gi[0] * gj[0]
    c01 = stretch[2] * gi[0] * gj[1] + cross * gi[1] * gj[0]
    c10 = stretch[2] * gi[1] * gj[0] + cross * gi[0] * gj[1]
    cnn = out[0] * gi[0] * gj[0] + out[1] * gi[1] * gj[1]
    B = ti.Matrix.zero(float, 3, 3)
    for a, b in ti.static(ti.ndrange(3, 3)):
        B[a, b] = (
            U[a, 0] * (c00 * U[b, 0] + c01 * U[b, 1])
            + U[a, 1] * (c10 * U[b, 0] + c11 * U[b, 1])
            + cnn * U[a, 2] * U[b, 2]
        )
    return B
