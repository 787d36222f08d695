"""Ways to write `psi`, `dpsi_dF`, `d2psi_dF2`: see the folder's `__init__`."""

import taichi as ti

# --- psi ---------------------------------------------------------------------------------------------------


def psi(F, C, D):
    J = F.determinant()  # the change of volume
    t = (F.transpose() @ F).trace()  # the invariant
    a = J ** (-2 / 3)  # the power of J
    return C * (a * t - 3) + D * (J - 1) ** 2  # the energy


def psi__barred(F, C, D):
    J = F.determinant()  # the change of volume
    B = F * J ** (-1 / 3)  # F freed of its volume
    t = (B.transpose() @ B).trace()  # the barred invariant
    return C * (t - 3) + D * (J - 1) * (J - 1)  # the energy


# --- dpsi_dF -----------------------------------------------------------------------------------------------


def dpsi_dF(F, C, D):
    J = F.determinant()  # the change of volume
    G = F.inverse().transpose()  # the inverse transposed
    t = (F.transpose() @ F).trace()  # the invariant
    a = J ** (-2 / 3)  # the power of J
    A = 2 * C * a * (F - t / 3 * G)  # the stress of the change of shape
    B = 2 * D * (J - 1) * J * G  # the stress of the change of volume
    return A + B  # the sum of both stresses


def dpsi_dF__chain(F, C, D):
    J = F.determinant()  # the change of volume
    K = J * F.inverse().transpose()  # the derivative of J
    t = (F.transpose() @ F).trace()  # the invariant
    a = J ** (-2 / 3)  # the power of J
    b = -2 / 3 * J ** (-5 / 3)  # the derivative of the power of J
    A = C * (b * t * K + a * 2 * F)  # the stress of the change of shape
    B = D * 2 * (J - 1) * K  # the stress of the change of volume
    return A + B  # the sum of both stresses


# --- d2psi_dF2 ---------------------------------------------------------------------------------------------


def d2psi_dF2(F, C, D):
    J = F.determinant()  # the change of volume
    G = F.inverse().transpose()  # the inverse transposed
    t = (F.transpose() @ F).trace()  # the invariant
    c = 2 * C * J ** (-2 / 3)  # the factor of the change of shape
    d = 2 * D * J  # the factor of the change of volume
    H = ti.Matrix.zero(float, 9, 9)  # the empty matrix
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        p = G[i, j] * G[m, n]  # the product of two entries of G
        q = G[i, n] * G[m, j]  # the change of G
        r = F[i, j] * G[m, n] + G[i, j] * F[m, n]  # the pair of mixed terms
        h = c * (t / 9 * (2 * p + 3 * q) - 2 / 3 * r)  # the terms of the change of shape
        v = d * ((2 * J - 1) * p - (J - 1) * q)  # the terms of the change of volume
        H[3 * i + j, 3 * m + n] = h + v  # the entry
        if i == m and j == n:  # the question whether both are one entry of F
            H[3 * i + j, 3 * m + n] += c  # the term of F itself
    return H
