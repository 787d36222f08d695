# solids 1.0: fill in the functions of this file; README.md explains each.
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
    # Your code here: the formula above
    raise NotImplementedError


@ti.func
def dpsi_dF(F, C, D):
    """Gradient of psi in F: the first Piola-Kirchhoff stress.

    F       : deformation gradient, J > 0, mat3 [1]
    C, D    : stiffness against a change of shape, and of volume [Pa]
    returns : P, mat3 [Pa]
    """
    # Your code here: the product rule for J^(-2/3) tr(F^T F), the chain rule for (J - 1)^2; dJ/dF = J F^(-T)
    raise NotImplementedError


@ti.func
def d2psi_dF2(F, C, D):
    """Hessian of psi in F: entry (3 i + j, 3 m + n) is the derivative of P_ij in F_mn.

    F       : deformation gradient, J > 0, mat3 [1]
    C, D    : stiffness against a change of shape, and of volume [Pa]
    returns : d2psi_dF2, mat9 [Pa]
    """
    # Your code here: differentiate P_ij by F_mn, with dG_ij/dF_mn = -G_in G_mj for G = F^(-T)
    raise NotImplementedError
