"""Deformation gradient of a tetrahedron.  (S3; lecture "Deformation")"""

import taichi as ti


@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    """F = dx/dX = [x0 x1 x2 x3] dphi_dX.

    x0..x3  : world positions of the vertices, vec3 [m]
    dphi_dX : rows are the gradients of phi_0..phi_3, mat4x3 [1/m]
    returns : F, mat3 [1]
    """
    # begin solution: the vertices as columns, times the gradients as rows
    return ti.Matrix.cols([x0, x1, x2, x3]) @ dphi_dX
    # end solution
