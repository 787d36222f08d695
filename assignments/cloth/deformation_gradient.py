# cloth 1.0: fill in the functions of this file; README.md explains each.
"""Deformation gradient of a triangle in 3D with its normal.  (S3; lecture "2D triangle in 3D")"""

import taichi as ti


@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    """F = dx/dX = [x0 x1 x2 n] [dphi_dX; N^T], where n is the unit normal of the deformed triangle.

    x0, x1, x2 : world positions of the vertices, vec3 [m]
    dphi_dX    : rows are the gradients of phi_0..phi_2, mat3 [1/m]
    N          : unit normal of the undeformed triangle, vec3 [1]
    returns    : F, mat3 [1]
    """
    # Your code here: the normal n, the vertices as columns times dphi_dX, plus what carries N to n
    raise NotImplementedError


@ti.func
def dn_dx(x0, x1, x2, i):
    """Derivative of the unit normal n in the position of vertex i.

    x0, x1, x2 : world positions of the vertices, vec3 [m]
    i          : which vertex, 0, 1 or 2
    returns    : column k is the derivative of n in component k of x_i, mat3 [1/m]
    """
    # Your code here: m = (x1-x0) x (x2-x0); dm/dx_i from the edge opposite vertex i; then normalise
    raise NotImplementedError
