"""Ways to write `deformation_gradient`: see the folder's `__init__`."""

import taichi as ti

# --- deformation_gradient ----------------------------------------------------------------------------------


def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    x = ti.Matrix.cols([x0, x1, x2, x3])  # the matrix of the vertices
    return x @ dphi_dX  # the product of vertices and gradients


def deformation_gradient__sum(x0, x1, x2, x3, dphi_dX):
    a = x0.outer_product(dphi_dX[0, :])  # the term of vertex 0
    b = x1.outer_product(dphi_dX[1, :])  # the term of vertex 1
    c = x2.outer_product(dphi_dX[2, :])  # the term of vertex 2
    d = x3.outer_product(dphi_dX[3, :])  # the term of vertex 3
    return a + b + c + d  # the sum of the terms
