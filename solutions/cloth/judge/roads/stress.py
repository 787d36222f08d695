"""Ways to write `dpsi_dF`, `nodal_force`: see the folder's `__init__`."""

import taichi as ti

from muslin.given import diag

# --- dpsi_dF -------------------------------------------------------------------------------------------------


def dpsi_dF(U, dpsi_ds, V):
    return U @ diag(dpsi_ds) @ V.transpose()  # the product of three matrices


def dpsi_dF__loop(U, dpsi_ds, V):
    P = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # P before the loop
    for k in range(3):  # the sum over the directions
        P += dpsi_ds[k] * U[:, k].outer_product(V[:, k])  # the term of each direction
    return P  # the sum over the directions


def dpsi_dF__loops(U, dpsi_ds, V):
    P = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # P before the loop
    for i in range(3):  # the rows of P
        for j in range(3):  # the columns of P
            for k in range(3):  # the sum over the directions
                P[i, j] += U[i, k] * dpsi_ds[k] * V[j, k]  # each entry, term by term
    return P  # the result


def dpsi_dF__entries(U, dpsi_ds, V):
    p = dpsi_ds  # the stresses
    S = ti.Matrix([[p[0], 0.0, 0.0], [0.0, p[1], 0.0], [0.0, 0.0, p[2]]])  # the diagonal matrix of dpsi_ds
    return U @ S @ V.transpose()  # the product of three matrices


def dpsi_dF__sum(U, dpsi_ds, V):
    a = dpsi_ds[0] * U[:, 0].outer_product(V[:, 0])  # the term of direction 0
    b = dpsi_ds[1] * U[:, 1].outer_product(V[:, 1])  # the term of direction 1
    c = dpsi_ds[2] * U[:, 2].outer_product(V[:, 2])  # the term of direction 2
    return a + b + c  # the sum over the three directions


def dpsi_dF__rows(U, dpsi_ds, V):
    """The rows of U and V are used, where the principal directions are their columns.

    u_i is column i: U[:, i].
    """
    a = dpsi_ds[0] * U[0, :].outer_product(V[0, :])
    b = dpsi_ds[1] * U[1, :].outer_product(V[1, :])
    return a + b + dpsi_ds[2] * U[2, :].outer_product(V[2, :])


def dpsi_dF__of_the_vectors(U, dpsi_ds, V):
    """U and V are multiplied with the vector dpsi_ds each, and both come together in an outer product.

    Each component of dpsi_ds belongs to one pair of columns: a diagonal matrix between U and V^T.
    """
    return (U @ dpsi_ds).outer_product(V @ dpsi_ds)


def dpsi_dF__dyad(U, dpsi_ds, V):
    """A full matrix of dpsi_ds with itself stands in the middle, where a diagonal one belongs.

    The stress in the principal directions is diagonal.
    """
    return U @ dpsi_ds.outer_product(dpsi_ds) @ V.transpose()


def dpsi_dF__entrywise(U, dpsi_ds, V):
    """The matrices are multiplied entry by entry.

    In Taichi * is entry by entry. The matrix product has another sign.
    """
    return U @ diag(dpsi_ds) * V.transpose()


# --- nodal_force ---------------------------------------------------------------------------------------------


def nodal_force(P, grad_phi, area, h):
    return -h * area * (P @ grad_phi)  # the force


def nodal_force__volume(P, grad_phi, area, h):
    w = h * area  # the volume of the triangle
    f = P @ grad_phi  # the product of P and the gradient
    return -w * f  # the force, minus the gradient of the energy


def nodal_force__components(P, grad_phi, area, h):
    a = P[0, :].dot(grad_phi)  # component 0, row 0 of P times the gradient
    b = P[1, :].dot(grad_phi)  # component 1, row 1 of P times the gradient
    c = P[2, :].dot(grad_phi)  # component 2, row 2 of P times the gradient
    return -h * area * ti.Vector([a, b, c])  # the three components and their factor


def nodal_force__loops(P, grad_phi, area, h):
    f = ti.Vector([0.0, 0.0, 0.0])  # the force before the loop
    for i in range(3):  # the components of the force
        for j in range(3):  # the sum over a row of P
            f[i] -= h * area * P[i, j] * grad_phi[j]  # each component, term by term
    return f  # the force


def nodal_force__columns(P, grad_phi, area, h):
    g = grad_phi  # the gradient
    f = g[0] * P[:, 0] + g[1] * P[:, 1] + g[2] * P[:, 2]  # the columns of P times the gradient's components
    return -h * area * f  # the force


def nodal_force__sum(P, grad_phi, area, h):
    """Area and thickness are added, where they should be multiplied.

    A volume is area times thickness.
    """
    return -(h + area) * (P @ grad_phi)


def nodal_force__symmetric(P, grad_phi, area, h):
    """Only the symmetric part of P is used.

    P need not be symmetric: use it as it comes.
    """
    return -h * area * ((P + P.transpose()) / 2 @ grad_phi)


def nodal_force__diagonal(P, grad_phi, area, h):
    """Only the diagonal of P is used.

    The force is a matrix times a vector: each component sums over a whole row of P.
    """
    return -h * area * ti.Vector([P[0, 0], P[1, 1], P[2, 2]]) * grad_phi


def nodal_force__no_depth(P, grad_phi, area, h):
    """The third component is zero.

    The cloth lives in space: use all three rows of P.
    """
    f = -h * area * (P @ grad_phi)
    return ti.Vector([f[0], f[1], 0.0])
