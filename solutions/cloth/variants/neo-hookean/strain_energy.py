@ti.func
def psi(s, mu, lam):
    """Neo-Hooke, without its pole: mu/2 (s_0 - s_1)^2 + (lam + mu)/2 (s_0 s_1 - 1)^2.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : strain-energy density [J/m^3]
    """
    # begin solution: the formula above; only the two stretches in the plane count
    return mu / 2 * (s[0] - s[1]) ** 2 + (lam + mu) / 2 * (s[0] * s[1] - 1) ** 2
    # end solution


@ti.func
def dpsi_ds(s, mu, lam):
    """Gradient of psi in the stretches.

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : (dpsi/ds_0, dpsi/ds_1, 0), vec3 [Pa]
    """
    # begin solution: differentiate psi once; mind the chain rule through the area
    pull = (lam + mu) * (s[0] * s[1] - 1)
    p0 = mu * (s[0] - s[1]) + pull * s[1]
    p1 = mu * (s[1] - s[0]) + pull * s[0]
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
    k = lam + mu
    a = mu + k * s[1] ** 2
    b = mu + k * s[0] ** 2
    c = k * (2 * s[0] * s[1] - 1) - mu
    return ti.Matrix([[a, c, 0.0], [c, b, 0.0], [0.0, 0.0, 0.0]])
    # end solution
