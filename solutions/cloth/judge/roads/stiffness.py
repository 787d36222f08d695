"""Ways to write `d2psi_dFij`, `eigensystem`: see the folder's `__init__`."""

import taichi as ti

from muslin.given import diag

# --- d2psi_dFij ----------------------------------------------------------------------------------------------


def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    c = d2psi_ds2 @ ds  # the change of psi_s by the chain rule
    a = dU @ diag(dpsi_ds) @ V.transpose()  # the first term
    b = U @ diag(c) @ V.transpose()  # the middle term
    d = U @ diag(dpsi_ds) @ dV.transpose()  # the last term
    return a + b + d  # the sum of the three terms


def d2psi_dFij__chain_rule(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    c = ti.Vector([0.0, 0.0, 0.0])  # the change of psi_s before the loop
    for i in range(3):  # the components of the change of psi_s
        for j in range(3):  # the sum of the chain rule
            c[i] += d2psi_ds2[i, j] * ds[j]  # the chain rule in the middle term
    A = (dU @ diag(dpsi_ds) + U @ diag(c)) @ V.transpose()  # the first and the middle term
    return A + U @ diag(dpsi_ds) @ dV.transpose()  # the last term added


def d2psi_dFij__full(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    """The whole Hessian of psi stands in the middle term, where a diagonal matrix belongs.

    How psi_s changes is a vector: the Hessian times ds. Its diagonal matrix stands in the middle.
    """
    return (
        dU @ diag(dpsi_ds) @ V.transpose()
        + U @ d2psi_ds2 @ V.transpose()
        + U @ diag(dpsi_ds) @ dV.transpose()
    )


def d2psi_dFij__diagonals(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    """The Hessian of psi is multiplied with the diagonal matrix of ds, which leaves a full matrix in the middle.

    How psi_s changes is a vector: the Hessian times ds. Its diagonal matrix stands in the middle.
    """
    b = U @ (d2psi_ds2 @ diag(ds)) @ V.transpose()
    return dU @ diag(dpsi_ds) @ V.transpose() + b + U @ diag(dpsi_ds) @ dV.transpose()


# --- eigensystem ---------------------------------------------------------------------------------------------


def eigensystem(s, dpsi_ds, d2psi_ds2):
    p = dpsi_ds[0]  # the stress psi_0
    q = dpsi_ds[1]  # the stress psi_1
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]  # the limit of flip
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])  # the quotient of flip
    twist = (p + q) / max(s[0] + s[1], 1e-6)  # the quotient of twist
    a = p / max(s[0], 1e-6)  # out_0
    b = q / max(s[1], 1e-6)  # out_1
    return ti.Vector([flip, twist, a, b])  # the four values


def eigensystem__mean(s, dpsi_ds, d2psi_ds2):
    p = dpsi_ds[0]  # the stress psi_0
    q = dpsi_ds[1]  # the stress psi_1
    gap = s[0] - s[1]  # the gap of the stretches
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]  # the limit of flip
    if abs(gap) > 1e-3:
        flip = (p - q) / gap  # the quotient of flip
    twist = (p + q) / max(s[0] + s[1], 1e-6)  # the quotient of twist
    a = p / max(s[0], 1e-6)  # the quotient of out_0
    b = q / max(s[1], 1e-6)  # the quotient of out_1
    return ti.Vector([flip, twist, a, b])  # the four values


def eigensystem__floor_below_one(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i - 1 (kept from zero): that is the mode of the 3x3 matrix, singular at rest.

    The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / max(s[0] - 1, 1e-6), q / max(s[1] - 1, 1e-6)])


def eigensystem__floor_below_one_abs(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by |s_i - 1| (kept from zero): that is the mode of the 3x3 matrix, singular at rest.

    The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / max(abs(s[0] - 1), 1e-6), q / max(abs(s[1] - 1), 1e-6)])


def eigensystem__guarded_minus(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i - 1, and set to zero at rest: that is the mode of the 3x3 matrix.

    The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist, a, b = (p + q) / max(s[0] + s[1], 1e-6), 0.0, 0.0
    if abs(s[0] - 1) > 1e-6:
        a = p / (s[0] - 1)
    if abs(s[1] - 1) > 1e-6:
        b = q / (s[1] - 1)
    return ti.Vector([flip, twist, a, b])


def eigensystem__plus_one(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i + 1: that is the other mode of the 3x3 matrix, which knows no normal that turns.

    The normal turns along when the cloth tilts. Add both modes up as the handout does.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / (s[0] + 1), q / (s[1] + 1)])


def eigensystem__plus_third(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i + s_2, as if the third stretch were one of the energy's.

    The normal turns along when the cloth tilts: only the stretch s_i is left below.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / (s[0] + s[2]), q / (s[1] + s[2])])


def eigensystem__pushed(s, dpsi_ds, d2psi_ds2):
    """A small number is added to the denominators: then they are wrong everywhere, by a little.

    Divide by the larger of the two, the denominator and 1e-6: where nothing collapses, nothing changes.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    return ti.Vector([flip, (p + q) / (s[0] + s[1] + 1e-6), p / (s[0] + 1e-6), q / (s[1] + 1e-6)])
