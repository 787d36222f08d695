# cloth 1.0: fill in the functions of this file; README.md explains each.
"""Principal stretches, and the energy they store.  (S5, S6; lecture "A Quadratic Energy Model in 2D")

The stretches of a cloth triangle come as s = (s_0, s_1, s_2): two in its plane, and the normal's, last, which
is always 1 and stores no energy.
"""

import taichi as ti


@ti.func
def right_cauchy_green(F):
    """C in |dx|^2 = dX^T C dX; the squares of the principal stretches are its eigenvalues.

    F       : deformation gradient, mat3 [1]
    returns : C, mat3 [1]
    """
    # Your code here: put dx = F dX into |dx|^2 = dx^T dx
    raise NotImplementedError


@ti.func
def psi(s, mu, lam):
    """Corotational linear elasticity: mu * sum over i < 2 of (s_i - 1)^2 + lam/2 (s_0 + s_1 - 2)^2.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : strain-energy density [J/m^3]
    """
    # Your code here: the formula above; only the two stretches in the plane count
    raise NotImplementedError


@ti.func
def dpsi_ds(s, mu, lam):
    """Gradient of psi in the stretches.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : (dpsi/ds_0, dpsi/ds_1, 0), vec3 [Pa]
    """
    # Your code here: differentiate psi once
    raise NotImplementedError


@ti.func
def d2psi_ds2(s, mu, lam):
    """Hessian of psi in the stretches.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : second derivatives, third row and column zero, mat3 [Pa]
    """
    # Your code here: differentiate psi twice
    raise NotImplementedError
