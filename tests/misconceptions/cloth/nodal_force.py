# ruff: noqa
# wrong: gradient-for-force | cause: negated
@ti.func
def nodal_force(P, grad_phi, area, h):
    return h * area * P @ grad_phi


# wrong: area-missing | cause: missing:area
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * P @ grad_phi


# wrong: thickness-missing | cause: missing:h
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -area * P @ grad_phi


# wrong: area-and-thickness-missing | cause: missing:area,h
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -P @ grad_phi


# wrong: P-transposed | cause: transposed:P
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * area * P.transpose() @ grad_phi


# wrong: a-third-for-each-vertex | cause: scaled:1/3
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * area / 3 * P @ grad_phi


# wrong: half-of-the-area | cause: scaled:1/2
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * area / 2 * P @ grad_phi


# wrong: unit-gradient | cause: missing:|grad_phi|
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * area * P @ grad_phi.normalized()


# wrong: area-squared | cause: extra:area
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * area * area * P @ grad_phi


# wrong: divided-by-the-area | cause: missing:area^2
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h / area * P @ grad_phi


# wrong: entry-by-entry | cause: entry by entry
@ti.func
def nodal_force(P, grad_phi, area, h):
    return -h * area * ti.Vector([P[0, 0], P[1, 1], P[2, 2]]) * grad_phi


# wrong: last-component-forgotten | cause: component 2: zeros
@ti.func
def nodal_force(P, grad_phi, area, h):
    f = -h * area * P @ grad_phi
    return ti.Vector([f[0], f[1], 0.0])


# right: row-by-row
@ti.func
def nodal_force(P, grad_phi, area, h):
    V = h * area
    return -ti.Vector([V * P[0, :].dot(grad_phi), V * P[1, :].dot(grad_phi), V * P[2, :].dot(grad_phi)])


# right: subtracted-column-by-column
@ti.func
def nodal_force(P, grad_phi, area, h):
    f = ti.Vector([0.0, 0.0, 0.0])
    for k in range(3):
        for i in range(3):
            f[i] -= P[i, k] * (grad_phi[k] * area)
    return f * h
