"""How stress changes: two roads to the Hessian.  (S8; lecture "Hessian of Principal Stretch Materials")"""

import taichi as ti

from muslin.given import diag


@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    """Lecture's road: the derivative of dpsi_dF = U diag(dpsi_ds) V^T in one entry F_ij, by the product rule.

    U, V      : rotations of the singular value decomposition of F, mat3 [1]
    dpsi_ds   : gradient of psi in the stretches, vec3 [Pa]
    d2psi_ds2 : Hessian of psi in the stretches, mat3 [Pa]
    dU, ds, dV: derivatives of U, s and V in F_ij (given), mat3, vec3, mat3 [1]
    returns   : d(dpsi_dF)/dF_ij, mat3 [Pa]
    """
    # begin solution: three terms, one for each factor; the middle one needs the chain rule through s
    dpsi = d2psi_ds2 @ ds
    Vt, dVt = V.transpose(), dV.transpose()
    return dU @ diag(dpsi_ds) @ Vt + U @ diag(dpsi) @ Vt + U @ diag(dpsi_ds) @ dVt
    # end solution


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
    # begin solution: four quotients; the limit of the first where the stretches meet; no division by zero
    psi_0, psi_1, s_0, s_1 = dpsi_ds[0], dpsi_ds[1], s[0], s[1]
    gap = s_0 - s_1
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]  # the limit where the stretches meet
    missed = psi_0 - psi_1 - flip * gap  # what the limit misses; taken where it is more than rounding
    scale = 2 * (abs(psi_0) + abs(psi_1)) + abs(d2psi_ds2[0, 0]) + abs(d2psi_ds2[1, 1])
    if abs(gap) > 1e-5 and abs(missed) > 2e-16 * scale:
        flip += missed / gap
    twist = (psi_0 + psi_1) / max(s_0 + s_1, 1e-6)
    return ti.Vector([flip, twist, psi_0 / max(s_0, 1e-6), psi_1 / max(s_1, 1e-6)])
    # end solution
