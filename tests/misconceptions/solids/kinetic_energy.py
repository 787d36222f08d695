# ruff: noqa
# wrong: lumped | cause: lumped
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    return rho * volume / 8 * squares


# wrong: squares-only | cause: missing coupling
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    return rho * volume / 20 * squares


# wrong: mixed-terms-once | cause: mixed terms once
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)
    return rho * volume / 20 * (squares + products / 2)


# wrong: mixed-terms-doubled | cause: mixed terms doubled
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)
    return rho * volume / 20 * (squares + 2 * products)


# wrong: a-pair-missing | cause: missing pair
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3)
    return rho * volume / 20 * (squares + products)


# wrong: around-the-ring | cause: missing pair
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v1.dot(v2) + v2.dot(v3) + v3.dot(v0)
    return rho * volume / 20 * (squares + products)


# wrong: of-a-triangle | cause: scaled:5/3
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)
    return rho * volume / 12 * (squares + products)


# wrong: middle-only | cause: one point
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    v = (v0 + v1 + v2 + v3) / 4
    return rho * volume / 2 * v.dot(v)


# wrong: no-half | cause: scaled:2
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)
    return rho * volume / 10 * (squares + products)


# wrong: half-twice | cause: scaled:1/2
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)
    return rho * volume / 40 * (squares + products)


# wrong: sum-squared | cause: sum of velocities
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    v = v0 + v1 + v2 + v3
    return rho * volume / 40 * v.dot(v)


# right: sum-and-squares
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    v = v0 + v1 + v2 + v3
    return rho * volume / 40 * (squares + v.dot(v))


# right: double-sum
@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    V = ti.Matrix.cols([v0, v1, v2, v3])
    T = 0.0
    for i, j in ti.ndrange(4, 4):
        m = rho * volume / 20
        if i == j:
            m = rho * volume / 10
        T += m * (V[0, i] * V[0, j] + V[1, i] * V[1, j] + V[2, i] * V[2, j]) / 2
    return T
