# ruff: noqa
# wrong: opposite-sign | cause: negated
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += -volume * grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_j[d]
    return K


# wrong: transposed | cause: transposed
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume * grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_j[d]
    return K.transpose()


# wrong: gradients-exchanged | cause: exchanged gradients
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume * grad_phi_j[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_i[d]
    return K


# wrong: column-by-column | cause: column by column
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume * grad_phi_i[c] * d2psi_dF2[a + 3 * c, b + 3 * d] * grad_phi_j[d]
    return K


# wrong: rows-column-by-column | cause: column by column
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume * grad_phi_i[c] * d2psi_dF2[a + 3 * c, 3 * b + d] * grad_phi_j[d]
    return K


# wrong: volume-missing | cause: missing:volume
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_j[d]
    return K


# wrong: same-gradient-twice | cause: one gradient
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume * grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_i[d]
    return K


# wrong: half | cause: scaled:1/2
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        K[a, b] += volume / 2 * grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_j[d]
    return K


# wrong: one-inner-index | cause: same index
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c in ti.ndrange(3, 3, 3):
        K[a, b] += volume * grad_phi_i[c] * d2psi_dF2[3 * a + c, 3 * b + c] * grad_phi_j[c]
    return K


# right: in-two-steps
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)
    for a, b in ti.ndrange(3, 3):
        total = 0.0
        for c, d in ti.ndrange(3, 3):
            total += d2psi_dF2[3 * a + c, 3 * b + d] * grad_phi_i[c] * grad_phi_j[d]
        K[a, b] = volume * total
    return K


# right: matrix-products
@ti.func
def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    A = ti.Matrix.zero(float, 9, 3)
    for a, b, d in ti.ndrange(9, 3, 3):
        A[a, b] += d2psi_dF2[a, 3 * b + d] * grad_phi_j[d]
    K = ti.Matrix.zero(float, 3, 3)
    for a, b, c in ti.ndrange(3, 3, 3):
        K[a, b] += grad_phi_i[c] * A[3 * a + c, b] * volume
    return K
