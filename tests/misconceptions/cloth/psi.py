# ruff: noqa
# wrong: mu-and-lam-exchanged | cause: swapped:mu,lam
@ti.func
def psi(s, mu, lam):
    return lam * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + mu / 2 * (s[0] + s[1] - 2) ** 2


# wrong: half-of-lam-missing | cause: doubled:lam
@ti.func
def psi(s, mu, lam):
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam * (s[0] + s[1] - 2) ** 2


# wrong: half-too-many-at-mu | cause: halved:mu
@ti.func
def psi(s, mu, lam):
    return mu / 2 * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 2) ** 2


# wrong: squares-of-the-stretches | cause: squared:s
@ti.func
def psi(s, mu, lam):
    c0, c1 = s[0] ** 2, s[1] ** 2
    return mu * ((c0 - 1) ** 2 + (c1 - 1) ** 2) + lam / 2 * (c0 + c1 - 2) ** 2


# wrong: three-stretches | cause: third stretch
@ti.func
def psi(s, mu, lam):
    total = (s[0] - 1) ** 2 + (s[1] - 1) ** 2 + (s[2] - 1) ** 2
    return mu * total + lam / 2 * (s[0] + s[1] + s[2] - 3) ** 2


# wrong: area-energy | cause: area energy
@ti.func
def psi(s, mu, lam):
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] * s[1] - 1) ** 2


# wrong: each-stretch-alone | cause: each stretch alone
@ti.func
def psi(s, mu, lam):
    return (mu + lam / 2) * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2)


# wrong: lam-term-missing | cause: missing:lam
@ti.func
def psi(s, mu, lam):
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2)


# wrong: lam-not-squared | cause: missing square
@ti.func
def psi(s, mu, lam):
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 2)


# wrong: sum-of-stretches-minus-one | cause: rest at one
@ti.func
def psi(s, mu, lam):
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 1) ** 2


# wrong: only-in-tension | cause: where s_1 < 1
@ti.func
def psi(s, mu, lam):
    a, b = ti.max(s[0] - 1, 0.0), ti.max(s[1] - 1, 0.0)
    return mu * (a**2 + b**2) + lam / 2 * (a + b) ** 2


# right: multiplied-out
@ti.func
def psi(s, mu, lam):
    a, b = s[0] - 1.0, s[1] - 1.0
    return (mu + lam / 2) * (a * a + b * b) + lam * a * b


# right: quadratic-form
@ti.func
def psi(s, mu, lam):
    e = ti.Vector([s[0] - 1, s[1] - 1])
    H = ti.Matrix([[2 * mu + lam, lam], [lam, 2 * mu + lam]])
    return 0.5 * e.dot(H @ e)


# right: in-a-loop
@ti.func
def psi(s, mu, lam):
    energy, trace = 0.0, 0.0
    for k in ti.static(range(2)):
        energy += mu * (s[k] - 1) * (s[k] - 1)
        trace += s[k] - 1
    return energy + 0.5 * lam * trace * trace
