# ruff: noqa
# wrong: dU-term-missing | cause: missing:dU
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    return U @ diag(d2psi_ds2 @ ds) @ V.transpose() + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: dV-term-missing | cause: missing:dV
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    return dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()


# wrong: middle-term-missing | cause: missing:ds
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    return dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: middle-term-only | cause: missing:dU,dV
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    return U @ diag(d2psi_ds2 @ ds) @ V.transpose()


# wrong: dV-not-transposed | cause: transposed:dV
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
    return P + U @ diag(dpsi_ds) @ dV


# wrong: V-not-transposed | cause: transposed:V
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = dU @ diag(dpsi_ds) @ V + U @ diag(d2psi_ds2 @ ds) @ V
    return P + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: ds-without-the-hessian | cause: missing:d2psi_ds2
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(ds) @ V.transpose()
    return P + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: hessian-entry-by-entry | cause: diagonal:d2psi_ds2
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    p = ti.Vector([d2psi_ds2[0, 0] * ds[0], d2psi_ds2[1, 1] * ds[1], d2psi_ds2[2, 2] * ds[2]])
    P = dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(p) @ V.transpose()
    return P + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: hessian-times-diagonal | cause: entry by entry
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = dU @ diag(dpsi_ds) @ V.transpose() + U @ (d2psi_ds2 @ diag(ds)) @ V.transpose()
    return P + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: last-term-subtracted | cause: negated:dV
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
    return P - U @ diag(dpsi_ds) @ dV.transpose()


# wrong: dU-transposed | cause: transposed:dU
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = dU.transpose() @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
    return P + U @ diag(dpsi_ds) @ dV.transpose()


# wrong: all-factors-differentiated-at-once | cause: one product
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    return dU @ diag(d2psi_ds2 @ ds) @ dV.transpose()


# wrong: transposed | cause: transposed
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = V @ diag(dpsi_ds) @ dU.transpose() + V @ diag(d2psi_ds2 @ ds) @ U.transpose()
    return P + dV @ diag(dpsi_ds) @ U.transpose()


# right: sum-over-the-stretches
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    P = ti.Matrix.zero(float, 3, 3)
    for k in ti.static(range(3)):
        change = d2psi_ds2[k, 0] * ds[0] + d2psi_ds2[k, 1] * ds[1] + d2psi_ds2[k, 2] * ds[2]
        u, v, du, dv = U[:, k], V[:, k], dU[:, k], dV[:, k]
        P += change * u.outer_product(v) + dpsi_ds[k] * (du.outer_product(v) + u.outer_product(dv))
    return P


# right: in-two-products
@ti.func
def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    S = diag(dpsi_ds)
    left = dU @ S + U @ diag(d2psi_ds2 @ ds)
    return left @ V.transpose() + (dV @ S @ U.transpose()).transpose()
