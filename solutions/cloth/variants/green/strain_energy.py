@ti.func
def psi(s, mu, lam):
    """St. Venant-Kirchhoff: mu (e_0^2 + e_1^2) + lam/2 (e_0 + e_1)^2 with Green's strains e_i = (s_i^2 - 1)/2.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : strain-energy density [J/m^3]
    """
    # begin solution: the formula above; only the two stretches in the plane count
    e_0, e_1 = (s[0] ** 2 - 1) / 2, (s[1] ** 2 - 1) / 2
    return mu * (e_0**2 + e_1**2) + lam / 2 * (e_0 + e_1) ** 2
    # end solution


@ti.func
def dpsi_ds(s, mu, lam):
    """Gradient of psi in the stretches.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : (dpsi/ds_0, dpsi/ds_1, 0), vec3 [Pa]
    """
    # begin solution: differentiate psi once; mind the chain rule through the strains
    e_0, e_1 = (s[0] ** 2 - 1) / 2, (s[1] ** 2 - 1) / 2
    p0 = (2 * mu * e_0 + lam * (e_0 + e_1)) * s[0]
    p1 = (2 * mu * e_1 + lam * (e_0 + e_1)) * s[1]
    return ti.Vector([p0, p1, 0.0])
    # end solution


@ti.func
def d2psi_ds2(s, mu, lam):
    """Hessian of psi in the stretches.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : second derivatives, third row and column zero, mat3 [Pa]
    """
    # begin solution: differentiate psi twice
    e_0, e_1 = (s[0] ** 2 - 1) / 2, (s[1] ** 2 - 1) / 2
    a = 2 * mu * e_0 + lam * (e_0 + e_1) + (2 * mu + lam) * s[0] ** 2
    b = 2 * mu * e_1 + lam * (e_0 + e_1) + (2 * mu + lam) * s[1] ** 2
    c = lam * s[0] * s[1]
    return ti.Matrix([[a, c, 0.0], [c, b, 0.0], [0.0, 0.0, 0.0]])
    # end solution
