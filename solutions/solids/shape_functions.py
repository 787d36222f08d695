"""Shape functions of a tetrahedron, and interpolation.  (S1, S2; lecture "Finite Elements in 3D")"""

import taichi as ti


@ti.func
def phi(X, X0, X1, X2, X3):
    """Barycentric coordinates of X: E [phi_1, phi_2, phi_3]^T = X - X0 and phi_0 = 1 - phi_1 - phi_2 - phi_3.

    X       : undeformed point, vec3 [m]
    X0..X3  : undeformed vertices of the tetrahedron, vec3 [m]
    returns : (phi_0, phi_1, phi_2, phi_3), vec4 [1]
    """
    # begin solution: solve for phi_1, phi_2, phi_3 with the edges as columns of E, then phi_0
    E = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = E.inverse() @ (X - X0)
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])
    # end solution


@ti.func
def dphi_dX(X0, X1, X2, X3):
    """Gradients of the shape functions: constant on the tetrahedron.

    X0..X3  : undeformed vertices of the tetrahedron, vec3 [m]
    returns : row i is the gradient of phi_i, mat4x3 [1/m]
    """
    # begin solution: rows 1, 2, 3 from the formula of phi_1, phi_2, phi_3; row 0 from the sum of all four
    E = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    G = E.inverse()
    g1, g2, g3 = G[0, :], G[1, :], G[2, :]
    return ti.Matrix.rows([-g1 - g2 - g3, g1, g2, g3])
    # end solution


@ti.func
def interpolate(phi, x0, x1, x2, x3):
    """x(X) = N(X) q with N(X) = [phi_0 I, phi_1 I, phi_2 I, phi_3 I]; velocities in, velocity out works just the same.

    phi     : shape functions at the point, vec4 [1]
    x0..x3  : world positions of the vertices, vec3 [m]
    returns : world position of the point, vec3 [m]
    """
    # begin solution: the sum of the vertices, each weighted by its shape function
    return phi[0] * x0 + phi[1] * x1 + phi[2] * x2 + phi[3] * x3
    # end solution
