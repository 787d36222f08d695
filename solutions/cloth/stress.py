"""Stress and the forces it pulls with.  (S7; lecture "Gradients of Principal Stretch Materials")"""

import taichi as ti

from muslin.given import diag


@ti.func
def dpsi_dF(U, dpsi_ds, V):
    """Gradient of the energy in the deformation gradient F = U diag(s) V^T.

    U, V    : rotations of the singular value decomposition, mat3 [1]
    dpsi_ds : gradient of psi in the stretches, vec3 [Pa]
    returns : P, mat3 [Pa]
    """
    # begin solution: a diagonal matrix is diag(vector); turn it with U and V
    return U @ diag(dpsi_ds) @ V.transpose()
    # end solution


@ti.func
def nodal_force(P, grad_phi, area, h):
    """Force of the triangle on one of its vertices: minus the gradient of its potential energy h a psi.

    P        : dpsi_dF, mat3 [Pa]
    grad_phi : gradient of the vertex's shape function, vec3 [1/m]
    area     : undeformed area of the triangle [m^2]
    h        : thickness [m]
    returns  : force, vec3 [N]
    """
    # begin solution: the chain rule through F; n may be left out, its part vanishes
    return -h * area * P @ grad_phi
    # end solution
