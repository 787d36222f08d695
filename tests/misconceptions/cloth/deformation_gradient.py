# ruff: noqa
# wrong: no-normal | cause: missing:N
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX


# wrong: normal-not-normalised | cause: normal not normalised
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0)
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)


# wrong: edges-in-the-wrong-order | cause: negated:N
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x2 - x0).cross(x1 - x0).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)


# wrong: undeformed-normal | cause: undeformed normal
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + N.outer_product(N)


# wrong: deformed-normal-twice | cause: deformed normal twice
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(n)


# wrong: outer-product-turned | cause: outer product transposed
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + N.outer_product(n)


# wrong: transposed | cause: transposed
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()
    return dphi_dX.transpose() @ ti.Matrix.rows([x0, x1, x2]) + N.outer_product(n)


# wrong: vertices-as-rows | cause: vertices as rows
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.rows([x0, x1, x2]) @ dphi_dX + n.outer_product(N)


# wrong: gradients-as-columns | cause: transposed:dphi_dX
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX.transpose() + n.outer_product(N)


# wrong: vertex-0-forgotten | cause: missing vertex
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()
    zero = ti.Vector([0.0, 0.0, 0.0])
    return ti.Matrix.cols([zero, x1, x2]) @ dphi_dX + n.outer_product(N)


# right: edges-from-vertex-0
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    e, f = x1 - x0, x2 - x0
    n = e.cross(f)
    n /= n.norm()
    return e.outer_product(dphi_dX[1, :]) + f.outer_product(dphi_dX[2, :]) + n.outer_product(N)


# right: entry-by-entry-in-loops
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    n = (x2 - x1).cross(x0 - x1).normalized()
    F = ti.Matrix.zero(float, 3, 3)
    for i, j in ti.static(ti.ndrange(3, 3)):
        F[i, j] = x0[i] * dphi_dX[0, j] + x1[i] * dphi_dX[1, j] + x2[i] * dphi_dX[2, j] + n[i] * N[j]
    return F
