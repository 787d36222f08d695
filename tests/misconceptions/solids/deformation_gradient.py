# ruff: noqa
# wrong: transposed | cause: transposed
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    return (ti.Matrix.cols([x0, x1, x2, x3]) @ dphi_dX).transpose()


# wrong: vertex-0-missing | cause: vertex missing
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    F = x1.outer_product(dphi_dX[1, :]) + x2.outer_product(dphi_dX[2, :])
    return F + x3.outer_product(dphi_dX[3, :])


# wrong: vertex-3-missing | cause: vertex missing
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    F = x0.outer_product(dphi_dX[0, :]) + x1.outer_product(dphi_dX[1, :])
    return F + x2.outer_product(dphi_dX[2, :])


# wrong: displacements | cause: identity added
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    return ti.Matrix.cols([x0, x1, x2, x3]) @ dphi_dX - ti.Matrix.identity(float, 3)


# wrong: identity-added | cause: identity added
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    return ti.Matrix.cols([x0, x1, x2, x3]) @ dphi_dX + ti.Matrix.identity(float, 3)


# wrong: vertices-in-another-order | cause: other order
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    return ti.Matrix.cols([x1, x2, x3, x0]) @ dphi_dX


# wrong: two-vertices-exchanged | cause: other order
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    return ti.Matrix.cols([x0, x2, x1, x3]) @ dphi_dX


# wrong: inverse | cause: inverse
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    return (ti.Matrix.cols([x0, x1, x2, x3]) @ dphi_dX).inverse()


# wrong: outer-products-the-wrong-way-round | cause: transposed
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    g0, g1, g2, g3 = dphi_dX[0, :], dphi_dX[1, :], dphi_dX[2, :], dphi_dX[3, :]
    return g0.outer_product(x0) + g1.outer_product(x1) + g2.outer_product(x2) + g3.outer_product(x3)


# wrong: cauchy-green | cause: cauchy-green
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    F = ti.Matrix.cols([x0, x1, x2, x3]) @ dphi_dX
    return F.transpose() @ F


# right: sum-of-outer-products
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    F = x0.outer_product(dphi_dX[0, :]) + x1.outer_product(dphi_dX[1, :])
    return F + x2.outer_product(dphi_dX[2, :]) + x3.outer_product(dphi_dX[3, :])


# right: edges-times-gradients
@ti.func
def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    G = ti.Matrix.rows([dphi_dX[1, :], dphi_dX[2, :], dphi_dX[3, :]])
    return ti.Matrix.cols([x1 - x0, x2 - x0, x3 - x0]) @ G
