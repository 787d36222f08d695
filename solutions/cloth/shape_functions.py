"""Shape functions of a triangle in 3D, and interpolation.  (S1, S2; lecture "Triangular Finite Elements")"""

import taichi as ti


@ti.func
def phi(X, X0, X1, X2):
    """Barycentric coordinates of X: D^T D [phi_1, phi_2]^T = D^T (X - X0) and phi_0 = 1 - phi_1 - phi_2.

    X          : undeformed point, vec3 [m]
    X0, X1, X2 : undeformed vertices of the triangle, vec3 [m]
    returns    : (phi_0, phi_1, phi_2), vec3 [1]
    """
    # begin solution: solve the 2x2 least-squares problem for phi_1 and phi_2, then phi_0
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    phi12 = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([1 - phi12[0] - phi12[1], phi12[0], phi12[1]])
    # end solution


@ti.func
def dphi_dX(X0, X1, X2):
    """Gradients of the shape functions: constant on the triangle, and lying in its plane.

    X0, X1, X2 : undeformed vertices of the triangle, vec3 [m]
    returns    : row i is the gradient of phi_i, mat3 [1/m]
    """
    # begin solution: rows 1 and 2 from the formula of phi_1 and phi_2; row 0 from the sum of all three
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    g1 = ti.Vector([G[0, 0], G[0, 1], G[0, 2]])
    g2 = ti.Vector([G[1, 0], G[1, 1], G[1, 2]])
    return ti.Matrix.rows([-g1 - g2, g1, g2])
    # end solution


@ti.func
def interpolate(phi, x0, x1, x2):
    """x(X) = N(X) q with N(X) = [phi_0 I, phi_1 I, phi_2 I]; velocities in, velocity out works just the same.

    phi        : shape functions at the point, vec3 [1]
    x0, x1, x2 : world positions of the vertices, vec3 [m]
    returns    : world position of the point, vec3 [m]
    """
    # begin solution: the sum of the vertices, each weighted by its shape function
    return phi[0] * x0 + phi[1] * x1 + phi[2] * x2
    # end solution
