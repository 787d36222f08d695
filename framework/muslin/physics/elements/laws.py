"""Strain energies of solids: psi, P = dpsi/dF, and the modes of d2psi/dF2 in the frame of the principal directions.

With F = U diag(s) V^T the Hessian of an isotropic energy is, in the frame (U, V), a symmetric 3x3 matrix A that
couples the stretches, A_ij = d2psi/ds_i ds_j, and three pairs of numbers, one for each axis k and the plane (i, j)
across it::

    flip_k  = (p_i - p_j) / (s_i - s_j)      along (u_i v_j^T + u_j v_i^T) / sqrt 2,     p_i = dpsi/ds_i
    twist_k = (p_i + p_j) / (s_i + s_j)      along (u_i v_j^T - u_j v_i^T) / sqrt 2

Each law has them simplified by hand, so that nothing is divided by a difference of stretches. `a` and `b` are C and D
of the Neo-Hookean law, mu and lam of the others.  (Smith, de Goes, Kim: "Analytic Eigensystems for Isotropic Distortion
Energies", 2019, and "Stable Neo-Hookean Flesh Simulation", 2018.)
"""

from typing import Any, NamedTuple

from muslin.base.engine import ti
from muslin.physics.elements.decompose import signed_svd

#: Sums of stretches are not divided by less than this.
CLOSEST = 1e-8


class Law(NamedTuple):
    """What an element calls of a strain energy.

    energy : (F, I, J, a, b) -> psi [J/m^3], with I = |F|^2 and J = det F
    stress : (F, I, J, a, b) -> P, mat3 [Pa]
    modes : (s, a, b) -> diagonal and off-diagonal of A, flip, twist, vec3 each [Pa]; entry k of the last three is
        about the plane across axis k.
    bounded : whether psi is infinite where det F <= 0.
    derivatives : (I, J, a, b) -> psi_I, psi_J, psi_II, psi_IJ, psi_JJ, of a law of I = |F|^2 and J = det F; else None.
    """

    energy: Any
    stress: Any
    modes: Any
    bounded: bool = False
    derivatives: Any = None


@ti.func
def cofactor(F):
    """dJ/dF, the cofactors of F: J F^(-T) where there is an inverse."""
    f0, f1, f2 = F[:, 0], F[:, 1], F[:, 2]
    return ti.Matrix.cols([f1.cross(f2), f2.cross(f0), f0.cross(f1)])


@ti.func
def across(s):
    """(s_1 s_2, s_2 s_0, s_0 s_1): what J = s_0 s_1 s_2 changes by with each stretch."""
    return ti.Vector([s[1] * s[2], s[2] * s[0], s[0] * s[1]])


@ti.func
def by_invariants(s, d_I, d_J, d_II, d_IJ, d_JJ):
    """Modes of an energy of I = |F|^2 and J = det F, from its derivatives in these."""
    c = across(s)
    diagonal, off = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
    for k in ti.static(range(3)):
        i, j = (k + 1) % 3, (k + 2) % 3
        diagonal[k] = 2 * d_I + 4 * d_II * s[k] * s[k] + 4 * d_IJ * s[k] * c[k] + d_JJ * c[k] * c[k]
        mixed = 2 * d_IJ * (s[i] * c[j] + c[i] * s[j])
        off[k] = 4 * d_II * s[i] * s[j] + mixed + d_JJ * c[i] * c[j] + d_J * s[k]
    return diagonal, off, 2 * d_I - d_J * s, 2 * d_I + d_J * s


# Neo-Hookean: C (J^(-2/3) I - 3) + D (J - 1)^2 --------------------------------------------------------------------


@ti.func
def _neo_energy(F, I, J, C, D):  # noqa: E741
    psi = ti.math.inf
    if J > 0:
        psi = C * (I * J ** (-2 / 3) - 3) + D * (J - 1) ** 2
    return psi


@ti.func
def _neo_stress(F, I, J, C, D):  # noqa: E741
    root = J ** (-2 / 3)
    return 2 * C * root * F + (2 * D * (J - 1) - 2 / 3 * C * root / J * I) * cofactor(F)


@ti.func
def _neo_derivatives(I, J, C, D):  # noqa: E741
    c = C * J ** (-2 / 3)
    d_J = 2 * D * (J - 1) - 2 / 3 * c * I / J
    return c, d_J, 0.0, -2 / 3 * c / J, 10 / 9 * c * I / (J * J) + 2 * D


@ti.func
def _neo_modes(s, C, D):
    d_I, d_J, d_II, d_IJ, d_JJ = _neo_derivatives(s.norm_sqr(), s[0] * s[1] * s[2], C, D)
    return by_invariants(s, d_I, d_J, d_II, d_IJ, d_JJ)


# Stable Neo-Hookean: mu'/2 (I - 3) + lam'/2 (J - alpha)^2 - mu'/2 log(I + 1), without its value at rest; mu' and lam'
# are such that mu and lam are those of small strains -----------------------------------------------------------


@ti.func
def _stable_energy(F, I, J, mu, lam):  # noqa: E741
    m, l = 4 / 3 * mu, lam + 5 / 6 * mu  # noqa: E741
    beyond = J - 1
    # l/2 (J - alpha)^2 - l/2 (1 - alpha)^2, multiplied out
    return m / 2 * (I - 3) + l / 2 * beyond * beyond - 3 / 4 * m * beyond - m / 2 * ti.log((I + 1) / 4)


@ti.func
def _stable_stress(F, I, J, mu, lam):  # noqa: E741
    m, l = 4 / 3 * mu, lam + 5 / 6 * mu  # noqa: E741
    pressure = l * (J - 1) - 3 / 4 * m
    return m * (1 - 1 / (I + 1)) * F + pressure * cofactor(F)


@ti.func
def _stable_derivatives(I, J, mu, lam):  # noqa: E741
    m, l = 4 / 3 * mu, lam + 5 / 6 * mu  # noqa: E741
    longer = I + 1
    return m / 2 * (1 - 1 / longer), l * (J - 1) - 3 / 4 * m, m / 2 / (longer * longer), 0.0, l


@ti.func
def _stable_modes(s, mu, lam):
    d_I, d_J, d_II, d_IJ, d_JJ = _stable_derivatives(s.norm_sqr(), s[0] * s[1] * s[2], mu, lam)
    return by_invariants(s, d_I, d_J, d_II, d_IJ, d_JJ)


# St. Venant-Kirchhoff: mu |E|^2 + lam/2 (tr E)^2 with E = (F^T F - I)/2 --------------------------------------------


@ti.func
def _green(F):
    D = F - ti.Matrix.identity(float, 3)  # nothing cancels near rest
    return (D + D.transpose() + D.transpose() @ D) / 2


@ti.func
def _venant_energy(F, I, J, mu, lam):  # noqa: E741
    E = _green(F)
    return mu * E.norm_sqr() + lam / 2 * E.trace() ** 2


@ti.func
def _venant_stress(F, I, J, mu, lam):  # noqa: E741
    E = _green(F)
    return 2 * mu * F @ E + lam * E.trace() * F


@ti.func
def _venant_modes(s, mu, lam):
    pressure = lam / 2 * (s.norm_sqr() - 3) - mu
    diagonal = (3 * mu + lam) * s * s + pressure
    off = lam * across(s)
    flip, twist = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
    for k in ti.static(range(3)):
        i, j = (k + 1) % 3, (k + 2) % 3
        squares, product = s[i] * s[i] + s[j] * s[j], s[i] * s[j]
        flip[k], twist[k] = mu * (squares + product) + pressure, mu * (squares - product) + pressure
    return diagonal, off, flip, twist


# Corotated: mu |F - R|^2 + lam/2 (tr S - 3)^2 with F = R S ---------------------------------------------------------


@ti.func
def _corotated_energy(F, I, J, mu, lam):  # noqa: E741
    _, s, _ = signed_svd(F)
    strain = s - 1
    return mu * strain.norm_sqr() + lam / 2 * strain.sum() ** 2


@ti.func
def _corotated_stress(F, I, J, mu, lam):  # noqa: E741
    U, s, V = signed_svd(F)
    return 2 * mu * F + (lam * (s - 1).sum() - 2 * mu) * U @ V.transpose()


@ti.func
def _corotated_modes(s, mu, lam):
    ones = ti.Vector([1.0, 1.0, 1.0])
    twist = 2 * mu * ones
    pull = 2 * lam * (s - 1).sum() - 4 * mu
    for k in ti.static(range(3)):
        apart = s[(k + 1) % 3] + s[(k + 2) % 3]
        twist[k] += pull / (ti.max(apart, CLOSEST) if apart >= 0 else ti.min(apart, -CLOSEST))
    return (2 * mu + lam) * ones, lam * ones, 2 * mu * ones, twist


#: Name -> law.
LAWS = {
    "neo-hookean": Law(_neo_energy, _neo_stress, _neo_modes, True, _neo_derivatives),
    "corotated": Law(_corotated_energy, _corotated_stress, _corotated_modes),
    "st-venant-kirchhoff": Law(_venant_energy, _venant_stress, _venant_modes),
    "stable-neo-hookean": Law(_stable_energy, _stable_stress, _stable_modes, False, _stable_derivatives),
}
