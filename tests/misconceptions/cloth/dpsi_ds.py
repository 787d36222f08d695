# ruff: noqa
# wrong: mu-and-lam-exchanged | cause: swapped:mu,lam
@ti.func
def dpsi_ds(s, mu, lam):
    t = mu * (s[0] + s[1] - 2)
    return ti.Vector([2 * lam * (s[0] - 1) + t, 2 * lam * (s[1] - 1) + t, 0.0])


# wrong: two-at-mu-missing | cause: halved:mu
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([mu * (s[0] - 1) + t, mu * (s[1] - 1) + t, 0.0])


# wrong: half-at-lam-left-over | cause: halved:lam
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam / 2 * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])


# wrong: lam-term-of-each-alone | cause: each stretch alone
@ti.func
def dpsi_ds(s, mu, lam):
    a = 2 * mu + lam
    return ti.Vector([a * (s[0] - 1), a * (s[1] - 1), 0.0])


# wrong: third-component | cause: third stretch
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] + s[2] - 3)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 2 * mu * (s[2] - 1) + t])


# wrong: lam-in-the-first-component-only | cause: component 1
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1), 0.0])


# wrong: lam-term-missing | cause: missing:lam
@ti.func
def dpsi_ds(s, mu, lam):
    return ti.Vector([2 * mu * (s[0] - 1), 2 * mu * (s[1] - 1), 0.0])


# wrong: area-energy | cause: area energy
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam * (s[0] * s[1] - 1)
    return ti.Vector([2 * mu * (s[0] - 1) + t * s[1], 2 * mu * (s[1] - 1) + t * s[0], 0.0])


# wrong: like-a-force | cause: negated
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] - 2)
    return -ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])


# wrong: stretches-exchanged | cause: permuted:1,0,2
@ti.func
def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[1] - 1) + t, 2 * mu * (s[0] - 1) + t, 0.0])


# wrong: squares-of-the-stretches | cause: squared:s
@ti.func
def dpsi_ds(s, mu, lam):
    c0, c1 = s[0] ** 2, s[1] ** 2
    t = lam * (c0 + c1 - 2)
    return ti.Vector([2 * mu * (c0 - 1) + t, 2 * mu * (c1 - 1) + t, 0.0])


# wrong: the-stretches-themselves | cause: stretches
@ti.func
def dpsi_ds(s, mu, lam):
    return ti.Vector([s[0], s[1], 0.0])


# right: hessian-times-strain
@ti.func
def dpsi_ds(s, mu, lam):
    H = ti.Matrix([[2 * mu + lam, lam, 0.0], [lam, 2 * mu + lam, 0.0], [0.0, 0.0, 0.0]])
    return H @ (s - 1.0)


# right: component-by-component
@ti.func
def dpsi_ds(s, mu, lam):
    p = ti.Vector([0.0, 0.0, 0.0])
    for i in ti.static(range(2)):
        p[i] += mu * (s[i] - 1) * 2
        for j in ti.static(range(2)):
            p[i] += lam * (s[j] - 1)
    return p
