"""An energy that is quadratic in F.  (S1)"""

import taichi as ti


@ti.func
def psi(F, mu):
    """F: mat3 [1]; mu: [Pa]; returns the energy density [J/m^3]."""
    # begin solution: half mu times what the squares exceed three by
    return 0.5 * mu * ((F.transpose() @ F).trace() - 3.0)
    # end solution


@ti.func
def dpsi_dF(F, mu):
    """F: mat3 [1]; mu: [Pa]; returns P, mat3 [Pa]."""
    # begin solution: its derivatives in the entries of F
    return mu * F
    # end solution


@ti.func
def d2psi_dF2(F, mu):
    """F: mat3 [1]; mu: [Pa]; returns H, mat9 [Pa]."""
    H = ti.Matrix.zero(float, 9, 9)
    # begin solution: how every entry of P changes with every entry of F
    for k in ti.static(range(9)):
        H[k, k] = mu
    return H
    # end solution
