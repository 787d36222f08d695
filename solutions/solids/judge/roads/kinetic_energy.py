"""Ways to write `mass_block`, `kinetic_energy`: see the folder's `__init__`."""


# --- mass_block --------------------------------------------------------------------------------------------


def mass_block(i, j, volume, rho):
    m = rho * volume / 20  # the mass for i != j
    if i == j:  # the question whether both are one vertex
        m = rho * volume / 10  # the mass for i = j
    return m


def mass_block__delta(i, j, volume, rho):
    d = 0.0  # the delta
    if i == j:  # the question whether both are one vertex
        d = 1.0  # the delta for i = j
    return rho * volume / 20 * (1 + d)  # the mass


# --- kinetic_energy ----------------------------------------------------------------------------------------


def kinetic_energy(v0, v1, v2, v3, volume, rho):
    s = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)  # the squares
    p = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)  # the mixed products
    return rho * volume / 20 * (s + p)  # the energy


def kinetic_energy__half(v0, v1, v2, v3, volume, rho):
    s = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)  # the squares
    v = v0 + v1 + v2 + v3  # the sum of the velocities
    p = v.dot(v) - s  # the mixed products, each twice
    return rho * volume / 2 * (s / 10 + p / 20)  # the energy
