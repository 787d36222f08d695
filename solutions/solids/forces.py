"""Forces of a tetrahedron, its stiffness, and a spring.  (S6; lecture "Generalized Forces")"""

import taichi as ti


@ti.func
def nodal_force(P, grad_phi, volume):
    """Force of the tetrahedron on one of its vertices: minus the gradient of its potential energy, volume psi.

    P        : dpsi_dF, mat3 [Pa]
    grad_phi : gradient of the vertex's shape function, vec3 [1/m]
    volume   : undeformed volume of the tetrahedron [m^3]
    returns  : force, vec3 [N]
    """
    # begin solution: the chain rule through F
    return -volume * P @ grad_phi
    # end solution


@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    """Second derivative of the potential energy, volume psi, in the vertices i and j.

    d2psi_dF2  : Hessian of psi, rows and columns in row-major order of F, mat9 [Pa]
    grad_phi_i : gradient of the shape function of vertex i, vec3 [1/m]
    grad_phi_j : gradient of the shape function of vertex j, vec3 [1/m]
    volume     : undeformed volume of the tetrahedron [m^3]
    returns    : entry (a, b) is the derivative in component a of x_i and component b of x_j, mat3 [N/m]
    """
    # begin solution: F_ac changes with x_a of vertex i by grad_phi_i[c], F_bd with x_b of vertex j by grad_phi_j[d]
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume * grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_j[d]
    return K
    # end solution


@ti.func
def spring_force(x0, x1, l0, k):
    """Force of a spring on its end x0, minus the gradient of k/2 (|x1 - x0| - l0)^2; zero where its ends meet.

    x0, x1  : ends of the spring, vec3 [m]
    l0      : rest length [m]
    k       : stiffness [N/m]
    returns : force on x0, vec3 [N]
    """
    # begin solution: how long it is, and which way it pulls x0
    d = x1 - x0
    length = d.norm()
    f = 0 * d
    if length > 0:
        f = k * (length - l0) / length * d
    return f
    # end solution
