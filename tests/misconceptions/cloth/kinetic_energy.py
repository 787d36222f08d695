# ruff: noqa
# wrong: half-missing | cause: scaled:2
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
    products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
    return rho * h * area / 6 * (squares + products)


# wrong: half-twice | cause: scaled:1/2
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
    products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
    return rho * h * area / 24 * (squares + products)


# wrong: coupling-missing | cause: missing coupling
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    return rho * h * area / 12 * (v0.dot(v0) + v1.dot(v1) + v2.dot(v2))


# wrong: mixed-terms-once | cause: mixed terms once
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
    products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
    return rho * h * area / 12 * (squares + products / 2)


# wrong: mixed-terms-as-large-as-squares | cause: mixed terms doubled
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    v = v0 + v1 + v2
    return rho * h * area / 12 * v.norm_sqr()


# wrong: lumped | cause: lumped
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    return 0.5 * rho * h * area / 3 * (v0.norm_sqr() + v1.norm_sqr() + v2.norm_sqr())


# wrong: velocity-of-the-centre | cause: one point
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    v = (v0 + v1 + v2) / 3
    return 0.5 * rho * h * area * v.norm_sqr()


# wrong: density-missing | cause: missing:rho
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
    products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
    return h * area / 12 * (squares + products)


# wrong: area-and-thickness-missing | cause: missing:area,h
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
    products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
    return rho / 12 * (squares + products)


# wrong: one-pair-forgotten | cause: missing pair
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
    products = v0.dot(v1) + v1.dot(v2)
    return rho * h * area / 12 * (squares + products)


# right: double-sum
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    v = ti.Matrix.rows([v0, v1, v2])
    T = 0.0
    for i in ti.static(range(3)):
        for j in ti.static(range(3)):
            m = rho * h * area / 12
            if ti.static(i == j):
                m *= 2
            for k in ti.static(range(3)):
                T += 0.5 * m * v[i, k] * v[j, k]
    return T


# right: sum-and-squares
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    v = v0 + v1 + v2
    squares = v0.norm_sqr() + v1.norm_sqr() + v2.norm_sqr()
    return (v.norm_sqr() + squares) / 24 * area * h * rho


# right: midpoints-of-the-edges
@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    a, b, c = (v0 + v1) / 2, (v1 + v2) / 2, (v2 + v0) / 2
    return area / 3 * h * (rho * a.norm_sqr() / 2 + rho * b.norm_sqr() / 2 + rho * c.norm_sqr() / 2)
