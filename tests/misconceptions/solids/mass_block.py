# ruff: noqa
# wrong: lumped | cause: lumped
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 0
    if i == j:
        m = rho * volume * 1 / 4
    return m


# wrong: of-a-triangle | cause: scaled:5/3
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 1 / 12
    if i == j:
        m = rho * volume * 1 / 6
    return m


# wrong: one-point | cause: one point
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 1 / 16
    if i == j:
        m = rho * volume * 1 / 16
    return m


# wrong: exchanged | cause: exchanged
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 1 / 10
    if i == j:
        m = rho * volume * 1 / 20
    return m


# wrong: not-coupled | cause: not coupled
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 0
    if i == j:
        m = rho * volume * 1 / 10
    return m


# wrong: same-everywhere | cause: same everywhere
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 1 / 20
    if i == j:
        m = rho * volume * 1 / 20
    return m


# wrong: six-volumes | cause: scaled:6
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 6 / 20
    if i == j:
        m = rho * volume * 6 / 10
    return m


# wrong: half-of-the-energy | cause: scaled:1/2
@ti.func
def mass_block(i, j, volume, rho):
    m = rho * volume * 1 / 40
    if i == j:
        m = rho * volume * 1 / 20
    return m


# wrong: density-missing | cause: missing:rho
@ti.func
def mass_block(i, j, volume, rho):
    m = volume / 20
    if i == j:
        m = volume / 10
    return m


# right: one-plus-delta
@ti.func
def mass_block(i, j, volume, rho):
    d = 0.0
    if i == j:
        d = 1.0
    return rho * volume / 20 * (1 + d)


# right: by-select
@ti.func
def mass_block(i, j, volume, rho):
    return rho * volume * ti.select(i == j, 0.1, 0.05)
