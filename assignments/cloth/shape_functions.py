# cloth 1.0: fill in the functions of this file; README.md explains each.
"""Shape functions of a triangle in 3D, and interpolation.  (S1, S2; lecture "Triangular Finite Elements")"""

import taichi as ti


@ti.func
def phi(X, X0, X1, X2):
    """Barycentric coordinates of X: D^T D [phi_1, phi_2]^T = D^T (X - X0) and phi_0 = 1 - phi_1 - phi_2.

    X          : undeformed point, vec3 [m]
    X0, X1, X2 : undeformed vertices of the triangle, vec3 [m]
    returns    : (phi_0, phi_1, phi_2), vec3 [1]
    """
    # Your code here: solve the 2x2 least-squares problem for phi_1 and phi_2, then phi_0
    raise NotImplementedError


@ti.func
def dphi_dX(X0, X1, X2):
    """Gradients of the shape functions: constant on the triangle, and lying in its plane.

    X0, X1, X2 : undeformed vertices of the triangle, vec3 [m]
    returns    : row i is the gradient of phi_i, mat3 [1/m]
    """
    # Your code here: rows 1 and 2 from the formula of phi_1 and phi_2; row 0 from the sum of all three
    raise NotImplementedError


@ti.func
def interpolate(phi, x0, x1, x2):
    """x(X) = N(X) q with N(X) = [phi_0 I, phi_1 I, phi_2 I]; velocities in, velocity out works just the same.

    phi        : shape functions at the point, vec3 [1]
    x0, x1, x2 : world positions of the vertices, vec3 [m]
    returns    : world position of the point, vec3 [m]
    """
    # Your code here: the sum of the vertices, each weighted by its shape function
    raise NotImplementedError
