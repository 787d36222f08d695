# ruff: noqa
# wrong: gradient-for-force | cause: negated
@ti.func
def nodal_force(P, grad_phi, volume):
    return volume * P @ grad_phi


# wrong: P-transposed | cause: transposed:P
@ti.func
def nodal_force(P, grad_phi, volume):
    return -volume * P.transpose() @ grad_phi


# wrong: volume-missing | cause: missing:volume
@ti.func
def nodal_force(P, grad_phi, volume):
    return -P @ grad_phi


# wrong: shared-out | cause: scaled:1/4
@ti.func
def nodal_force(P, grad_phi, volume):
    return -volume / 4 * P @ grad_phi


# wrong: six-volumes | cause: scaled:1/6
@ti.func
def nodal_force(P, grad_phi, volume):
    return -volume / 6 * P @ grad_phi


# wrong: unit-gradient | cause: unit gradient
@ti.func
def nodal_force(P, grad_phi, volume):
    return -volume * P @ grad_phi.normalized()


# wrong: volume-squared | cause: area for volume
@ti.func
def nodal_force(P, grad_phi, volume):
    return -volume * volume * P @ grad_phi


# wrong: diagonal-of-P | cause: entry by entry
@ti.func
def nodal_force(P, grad_phi, volume):
    return -volume * ti.Vector([P[0, 0] * grad_phi[0], P[1, 1] * grad_phi[1], P[2, 2] * grad_phi[2]])


# right: in-components
@ti.func
def nodal_force(P, grad_phi, volume):
    f = ti.Vector([0.0, 0.0, 0.0])
    for i, j in ti.static(ti.ndrange(3, 3)):
        f[i] -= volume * P[i, j] * grad_phi[j]
    return f


# right: columns
@ti.func
def nodal_force(P, grad_phi, volume):
    return -(P[:, 0] * grad_phi[0] + P[:, 1] * grad_phi[1] + P[:, 2] * grad_phi[2]) * volume
