# ruff: noqa
# wrong: no-coupling | cause: diagonal only
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a, 0.0, 0.0], [0.0, a, 0.0], [0.0, 0.0, 0.0]])


# wrong: third-row-and-column | cause: third row and column
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a, lam, lam], [lam, a, lam], [lam, lam, a]])


# wrong: two-mu-in-the-corner | cause: third row and column
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 2 * mu]])


# wrong: mu-and-lam-exchanged | cause: swapped:mu,lam
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * lam + mu
    return ti.Matrix([[a, mu, 0.0], [mu, a, 0.0], [0.0, 0.0, 0.0]])


# wrong: two-at-mu-missing | cause: halved:mu
@ti.func
def d2psi_ds2(s, mu, lam):
    a = mu + lam
    return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 0.0]])


# wrong: half-at-lam-left-over | cause: halved:lam
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam / 2
    return ti.Matrix([[a, lam / 2, 0.0], [lam / 2, a, 0.0], [0.0, 0.0, 0.0]])


# wrong: times-s | cause: multiplied by s
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a * s[0], lam * s[1], 0.0], [lam * s[0], a * s[1], 0.0], [0.0, 0.0, 0.0]])


# wrong: lam-missing-on-the-diagonal | cause: diagonal
@ti.func
def d2psi_ds2(s, mu, lam):
    return ti.Matrix([[2 * mu, lam, 0.0], [lam, 2 * mu, 0.0], [0.0, 0.0, 0.0]])


# wrong: area-energy | cause: area energy
@ti.func
def d2psi_ds2(s, mu, lam):
    c = lam * (2 * s[0] * s[1] - 1)
    return ti.Matrix(
        [[2 * mu + lam * s[1] ** 2, c, 0.0], [c, 2 * mu + lam * s[0] ** 2, 0.0], [0.0, 0.0, 0.0]]
    )


# wrong: coupling-with-the-wrong-sign | cause: off the diagonal: negated
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a, -lam, 0.0], [-lam, a, 0.0], [0.0, 0.0, 0.0]])


# wrong: coupling-doubled | cause: off the diagonal: scaled:2
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a, 2 * lam, 0.0], [2 * lam, a, 0.0], [0.0, 0.0, 0.0]])


# wrong: one-half-of-the-matrix | cause: upper triangle only
@ti.func
def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam
    return ti.Matrix([[a, lam, 0.0], [0.0, a, 0.0], [0.0, 0.0, 0.0]])


# right: two-terms
@ti.func
def d2psi_ds2(s, mu, lam):
    one = ti.Vector([1.0, 1.0, 0.0])
    H = lam * one.outer_product(one)
    for k in ti.static(range(2)):
        H[k, k] += 2 * mu
    return H


# right: filled-in-a-loop
@ti.func
def d2psi_ds2(s, mu, lam):
    H = ti.Matrix.zero(float, 3, 3)
    for i in range(2):
        for j in range(2):
            H[i, j] = lam
            if i == j:
                H[i, j] = lam + mu + mu
    return H
