"""Neo-Hookean elasticity: energy, stress, and how stress changes.  (S5; lecture "Neo-Hookean Strain Energy")

F is asked for where J = det F > 0 only. Where a tetrahedron is inverted the energy is infinite, and the
simulator sees to that.
"""

import taichi as ti


@ti.func
def psi(F, C, D):
    """C (J^(-2/3) tr(F^T F) - 3) + D (J - 1)^2 with J = det F.

    F       : deformation gradient, J > 0, mat3 [1]
    C, D    : stiffness against a change of shape, and of volume [Pa]
    returns : strain-energy density [J/m^3]
    """
    # begin solution: the formula above
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2
    # end solution


@ti.func
def dpsi_dF(F, C, D):
    """Gradient of psi in F: the first Piola-Kirchhoff stress.

    F       : deformation gradient, J > 0, mat3 [1]
    C, D    : stiffness against a change of shape, and of volume [Pa]
    returns : P, mat3 [Pa]
    """
    # begin solution: the product rule for J^(-2/3) tr(F^T F), the chain rule for (J - 1)^2; dJ/dF = J F^(-T)
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G
    # end solution


@ti.func
def d2psi_dF2(F, C, D):
    """Hessian of psi in F: entry (3 i + j, 3 m + n) is the derivative of P_ij in F_mn.

    F       : deformation gradient, J > 0, mat3 [1]
    C, D    : stiffness against a change of shape, and of volume [Pa]
    returns : d2psi_dF2, mat9 [Pa]
    """
    # begin solution: differentiate P_ij by F_mn, with dG_ij/dF_mn = -G_in G_mj for G = F^(-T)
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG)
        H[3 * i + j, 3 * m + n] += d * ((2 * J - 1) * GG - (J - 1) * turned)
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H
    # end solution
