# ruff: noqa
# wrong: pushes | cause: negated
@ti.func
def spring_force(x0, x1, l0, k):
    d = x0 - x1
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k * (n - l0) / n * d
    return f


# wrong: no-rest-length | cause: rest length
@ti.func
def spring_force(x0, x1, l0, k):
    return k * (x1 - x0)


# wrong: no-direction | cause: no direction
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k * (n - l0) * d
    return f


# wrong: doubled | cause: scaled:2
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = 2 * k * (n - l0) / n * d
    return f


# wrong: halved | cause: scaled:1/2
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k / 2 * (n - l0) / n * d
    return f


# wrong: energy | cause: energy
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k / 2 * (n - l0) ** 2 / n * d
    return f


# wrong: only-pulls | cause: only pulls
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k * ti.max(n - l0, 0.0) / n * d
    return f


# wrong: squared-lengths | cause: squared length
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k * (n * n - l0 * l0) / n * d
    return f


# wrong: relative-to-the-rest-length | cause: relative
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k * (n - l0) / l0 / n * d
    return f


# wrong: nan-where-the-ends-meet | cause: ends meet
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    return k * (d.norm() - l0) * d.normalized()


# right: unit-vector-first
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    u = 0 * d
    if d.norm() > 0:
        u = d / d.norm()
    return k * (d.norm() - l0) * u


# right: one-minus-a-quotient
@ti.func
def spring_force(x0, x1, l0, k):
    d = x1 - x0
    n = d.norm()
    f = 0 * d
    if n > 0:
        f = k * (1 - l0 / n) * d
    return f
