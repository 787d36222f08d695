"""Ways to write `stiffness_block`, `nodal_force`, `spring_force`: see the folder's `__init__`."""

import taichi as ti

# --- stiffness_block ---------------------------------------------------------------------------------------


def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)  # the empty block
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        h = d2psi_dF2[3 * a + c, 3 * b + d]  # the entry of the Hessian
        K[a, b] += volume * grad_phi_i[c] * h * grad_phi_j[d]  # the term of the sum
    return K


# --- nodal_force -------------------------------------------------------------------------------------------


def nodal_force(P, grad_phi, volume):
    return -volume * (P @ grad_phi)  # the force


# --- spring_force ------------------------------------------------------------------------------------------


def spring_force(x0, x1, l0, k):
    d = x1 - x0  # the vector from x0 to x1
    n = d.norm()  # the length
    f = 0 * d  # the force where the ends meet
    if n > 0:  # the question whether the ends are apart
        f = k * (n - l0) * d / n  # the force
    return f


def spring_force__unit(x0, x1, l0, k):
    d = x1 - x0  # the vector from x0 to x1
    n = d.norm()  # the length
    u = 0 * d  # the direction where the ends meet
    if n > 0:  # the question whether the ends are apart
        u = d / n  # the direction
    return k * (n - l0) * u  # the force
