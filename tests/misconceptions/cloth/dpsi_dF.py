# ruff: noqa
# wrong: V-not-transposed | cause: transposed:V
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return U @ diag(dpsi_ds) @ V


# wrong: U-transposed | cause: transposed:U
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return U.transpose() @ diag(dpsi_ds) @ V.transpose()


# wrong: both-transposed | cause: transposed:U,V
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return U.transpose() @ diag(dpsi_ds) @ V


# wrong: U-and-V-exchanged | cause: transposed
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return V @ diag(dpsi_ds) @ U.transpose()


# wrong: V-forgotten | cause: missing:V
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return U @ diag(dpsi_ds)


# wrong: U-forgotten | cause: missing:U
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return diag(dpsi_ds) @ V.transpose()


# wrong: diagonal-outside | cause: diagonal outside
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return diag(dpsi_ds) @ U @ V.transpose()


# wrong: like-a-force | cause: negated
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return -U @ diag(dpsi_ds) @ V.transpose()


# wrong: entry-by-entry | cause: entry by entry
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return U * diag(dpsi_ds) * V.transpose()


# wrong: second-stretch-forgotten | cause: missing:dpsi_ds[1]
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return dpsi_ds[0] * U[:, 0].outer_product(V[:, 0])


# wrong: j-where-i | cause: permuted:dpsi_ds
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    return dpsi_ds[1] * U[:, 0].outer_product(V[:, 0]) + dpsi_ds[0] * U[:, 1].outer_product(V[:, 1])


# right: sum-of-outer-products
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    P = ti.Matrix.zero(float, 3, 3)
    for k in ti.static(range(3)):
        P += dpsi_ds[k] * U[:, k].outer_product(V[:, k])
    return P


# right: triple-loop
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    P = ti.Matrix.zero(float, 3, 3)
    for i, j in ti.static(ti.ndrange(3, 3)):
        for k in ti.static(range(3)):
            P[i, j] += U[i, k] * dpsi_ds[k] * V[j, k]
    return P


# right: from-the-right
@ti.func
def dpsi_dF(U, dpsi_ds, V):
    W = ti.Matrix.cols([dpsi_ds[0] * V[:, 0], dpsi_ds[1] * V[:, 1], dpsi_ds[2] * V[:, 2]])
    return (W @ U.transpose()).transpose()
