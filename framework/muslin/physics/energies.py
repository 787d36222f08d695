"""The energies of the stretches a student does not write.

The linearised energy is the student's (`strain_energy.py`); in a variant of the assignment it is another one, which
only the framework's own element knows (`elements.native`), in another form than is asked for. The area and the
volumetric energy of the lecture live here with the same three functions; `ENERGIES` names them.
"""

from muslin.base.engine import ti


@ti.func
def area_psi(s, mu, lam):
    """mu * sum over i < 2 of (s_i - 1)^2 + lam/2 (s_0 s_1 - 1)^2."""  # noqa: D403
    a, b = s[0] - 1, s[1] - 1
    change = a * b + a + b  # s_0 s_1 - 1 without cancellation
    return mu * (a * a + b * b) + lam / 2 * change * change


@ti.func
def area_dpsi_ds(s, mu, lam):
    """Gradient of `area_psi` in the stretches."""
    a, b = s[0] - 1, s[1] - 1
    change = a * b + a + b
    return ti.Vector([2 * mu * a + lam * change * s[1], 2 * mu * b + lam * change * s[0], 0.0])


@ti.func
def area_d2psi_ds2(s, mu, lam):
    """Hessian of `area_psi` in the stretches."""
    c = lam * (2 * s[0] * s[1] - 1)
    return ti.Matrix(
        [[2 * mu + lam * s[1] ** 2, c, 0.0], [c, 2 * mu + lam * s[0] ** 2, 0.0], [0.0, 0.0, 0.0]]
    )


@ti.func
def area_flip(s, mu, lam):
    """(psi_0 - psi_1) / (s_0 - s_1) of the area energy, simplified by hand."""
    return 2 * mu - lam * (s[0] * s[1] - 1)


@ti.func
def volumetric_psi(s, mu, lam):
    """mu * sum over i < 3 of (s_i - 1)^2 + lam/2 (s_0 s_1 s_2 - 1)^2 (the slide drops the square: a slip)."""  # noqa: D403
    J = s[0] * s[1] * s[2]
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2 + (s[2] - 1) ** 2) + lam / 2 * (J - 1) ** 2


@ti.func
def volumetric_dpsi_ds(s, mu, lam):
    """Gradient of `volumetric_psi` in all three stretches."""
    pressure = lam * (s[0] * s[1] * s[2] - 1)
    cofactor = ti.Vector([s[1] * s[2], s[2] * s[0], s[0] * s[1]])
    return 2 * mu * (s - 1) + pressure * cofactor


@ti.func
def volumetric_d2psi_ds2(s, mu, lam):
    """Hessian of `volumetric_psi` in all three stretches."""
    pressure = lam * (s[0] * s[1] * s[2] - 1)
    cofactor = ti.Vector([s[1] * s[2], s[2] * s[0], s[0] * s[1]])
    H = lam * cofactor.outer_product(cofactor)
    H += pressure * ti.Matrix([[0.0, s[2], s[1]], [s[2], 0.0, s[0]], [s[1], s[0], 0.0]])
    for i in ti.static(range(3)):
        H[i, i] += 2 * mu
    return H


@ti.func
def volumetric_on_cloth_dpsi_ds(s, mu, lam):
    """`volumetric_dpsi_ds` of a cloth, whose third stretch cannot change."""
    p = volumetric_dpsi_ds(s, mu, lam)
    return ti.Vector([p[0], p[1], 0.0])


@ti.func
def volumetric_on_cloth_d2psi_ds2(s, mu, lam):
    """`volumetric_d2psi_ds2` of a cloth, whose third stretch cannot change."""
    H = volumetric_d2psi_ds2(s, mu, lam)
    return ti.Matrix([[H[0, 0], H[0, 1], 0.0], [H[1, 0], H[1, 1], 0.0], [0.0, 0.0, 0.0]])


#: Energies by name: (psi, dpsi_ds, d2psi_ds2) on a cloth.
ENERGIES = {
    "area": (area_psi, area_dpsi_ds, area_d2psi_ds2),
    "volumetric": (volumetric_psi, volumetric_on_cloth_dpsi_ds, volumetric_on_cloth_d2psi_ds2),
}

#: Energies whose flip is known in simplified form: name -> function of (s, mu, lam).
FLIPS = {"area": area_flip, "volumetric": area_flip}
