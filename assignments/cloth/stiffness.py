# cloth 1.0: fill in the functions of this file; README.md explains each.
"""How stress changes: two roads to the Hessian.  (S8; lecture "Hessian of Principal Stretch Materials")"""

import taichi as ti

from muslin.given import diag  # given, for your code below  # noqa: F401


@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    """Lecture's road: the derivative of dpsi_dF = U diag(dpsi_ds) V^T in one entry F_ij, by the product rule.

    U, V      : rotations of the singular value decomposition of F, mat3 [1]
    dpsi_ds   : gradient of psi in the stretches, vec3 [Pa]
    d2psi_ds2 : Hessian of psi in the stretches, mat3 [Pa]
    dU, ds, dV: derivatives of U, s and V in F_ij (given), mat3, vec3, mat3 [1]
    returns   : d(dpsi_dF)/dF_ij, mat3 [Pa]
    """
    # Your code here: three terms, one for each factor; the middle one needs the chain rule through s
    raise NotImplementedError


@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    """Closed form: eigenvalues of the energy's Hessian for the four modes that turn the principal directions.

    Where the stretches meet (a gap below 1e-3), flip is its limit.
    A cloth that collapses is divided by 1e-6, not by less.

    s         : principal stretches, the normal's last, vec3 [1]
    dpsi_ds   : gradient of psi in the stretches, vec3 [Pa]
    d2psi_ds2 : Hessian of psi in the stretches, mat3 [Pa]
    returns   : (flip, twist, out_0, out_1), vec4 [Pa]
    """
    # Your code here: four quotients; the limit of the first where the stretches meet; no division by zero
    raise NotImplementedError
