# ruff: noqa
# wrong: lumped | cause: lumped
@ti.func
def mass_block(i, j, area, rho, h):
    m = 0.0
    if i == j:
        m = rho * h * area / 3
    return m


# wrong: half-and-quarter | cause: scaled:3
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * h * area / 4
    if i == j:
        m = rho * h * area / 2
    return m


# wrong: density-missing | cause: missing:rho
@ti.func
def mass_block(i, j, area, rho, h):
    m = h * area / 12
    if i == j:
        m = h * area / 6
    return m


# wrong: thickness-missing | cause: missing:h
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * area / 12
    if i == j:
        m = rho * area / 6
    return m


# wrong: area-missing | cause: missing:area
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * h / 12
    if i == j:
        m = rho * h / 6
    return m


# wrong: area-doubled | cause: scaled:2
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * h * 2 * area / 12
    if i == j:
        m = rho * h * 2 * area / 6
    return m


# wrong: half-of-the-energy | cause: scaled:1/2
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * h * area / 24
    if i == j:
        m = rho * h * area / 12
    return m


# wrong: the-same-everywhere | cause: where i != j: scaled:2
@ti.func
def mass_block(i, j, area, rho, h):
    return rho * h * area / 6


# wrong: diagonal-only | cause: where i != j: zeros
@ti.func
def mass_block(i, j, area, rho, h):
    m = 0.0
    if i == j:
        m = rho * h * area / 6
    return m


# wrong: sample-at-the-centre | cause: one point
@ti.func
def mass_block(i, j, area, rho, h):
    return rho * h * area / 9


# wrong: integral-of-one-function | cause: where i = j: scaled:2
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * h * area / 12
    if i == j:
        m = rho * h * area / 3
    return m


# wrong: exchanged | cause: exchanged
@ti.func
def mass_block(i, j, area, rho, h):
    m = rho * h * area / 6
    if i == j:
        m = rho * h * area / 12
    return m


# wrong: born-as-an-integer | cause: zeros
@ti.func
def mass_block(i, j, area, rho, h):
    m = 0
    m = rho * h * area / 12
    if i == j:
        m = rho * h * area / 6
    return ti.cast(m, float)


# right: one-plus-delta
@ti.func
def mass_block(i, j, area, rho, h):
    delta = ti.cast(i == j, float)
    delta = ti.abs(delta)
    return h * rho / 12.0 * (1.0 + delta) * area


# right: three-point-quadrature
@ti.func
def mass_block(i, j, area, rho, h):
    total = 0.0
    for q in ti.static(range(3)):
        a, b = 0.5, 0.5
        if i == q:
            a = 0.0
        if j == q:
            b = 0.0
        total += a * b / 3
    return total * area * (rho * h)
