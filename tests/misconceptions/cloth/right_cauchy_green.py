# ruff: noqa
# wrong: left | cause: transposed:F
@ti.func
def right_cauchy_green(F):
    return F @ F.transpose()


# wrong: not-transposed | cause: F F
@ti.func
def right_cauchy_green(F):
    return F @ F


# wrong: entry-by-entry | cause: entry by entry
@ti.func
def right_cauchy_green(F):
    return F.transpose() * F


# wrong: green-strain | cause: strain
@ti.func
def right_cauchy_green(F):
    return (F.transpose() @ F - ti.Matrix.identity(float, 3)) / 2


# wrong: half | cause: scaled:1/2
@ti.func
def right_cauchy_green(F):
    return 0.5 * F.transpose() @ F


# wrong: inverse | cause: inverse
@ti.func
def right_cauchy_green(F):
    return (F.transpose() @ F).inverse()


# wrong: small-strain | cause: small strain
@ti.func
def right_cauchy_green(F):
    return (F + F.transpose()) / 2


# wrong: identity-subtracted | cause: strain
@ti.func
def right_cauchy_green(F):
    return F.transpose() @ F - ti.Matrix.identity(float, 3)


# wrong: lower-triangle-empty | cause: upper triangle only
@ti.func
def right_cauchy_green(F):
    C = F.transpose() @ F
    return ti.Matrix([[C[0, 0], C[0, 1], C[0, 2]], [0.0, C[1, 1], C[1, 2]], [0.0, 0.0, C[2, 2]]])


# wrong: returned-unchanged | cause: echo:F
@ti.func
def right_cauchy_green(F):
    return F


# right: dot-products-of-columns
@ti.func
def right_cauchy_green(F):
    a, b, c = F[:, 0], F[:, 1], F[:, 2]
    return ti.Matrix(
        [
            [a.dot(a), a.dot(b), a.dot(c)],
            [b.dot(a), b.dot(b), b.dot(c)],
            [c.dot(a), c.dot(b), c.dot(c)],
        ]
    )


# right: sum-over-the-rows
@ti.func
def right_cauchy_green(F):
    C = ti.Matrix.zero(float, 3, 3)
    for k in ti.static(range(3)):
        row = F[k, :]
        C += row.outer_product(row)
    return C
