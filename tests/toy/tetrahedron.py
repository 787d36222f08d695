"""A linear tetrahedron.  (S2)"""

import taichi as ti


@ti.func
def dphi_dX(X0, X1, X2, X3):
    """X0..X3: vec3 [m]; returns mat4x3 [1/m]."""
    # begin solution: the rows of the inverse of the edges, and what makes them sum to zero
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    G = ti.Matrix.zero(float, 4, 3)
    for i, j in ti.static(ti.ndrange(3, 3)):
        G[i + 1, j] = D[i, j]
        G[0, j] -= D[i, j]
    return G
    # end solution


@ti.func
def deformation_gradient(q, dphi_dX):
    """q: vec12 [m]; dphi_dX: mat4x3 [1/m]; returns mat3 [1]."""
    # begin solution: the sum over the vertices of position times gradient
    F = ti.Matrix.zero(float, 3, 3)
    for k, i, j in ti.ndrange(4, 3, 3):
        F[i, j] += q[3 * k + i] * dphi_dX[k, j]
    return F
    # end solution
