# ruff: noqa
# wrong: un-barred | cause: un-barred
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * ((F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: power-minus-a-third | cause: wrong power
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-1 / 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: power-two-thirds | cause: wrong power
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (2 / 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: whole-number-division | cause: wrong power
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 // 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: rest-at-zero | cause: rest at three
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace()) + D * (J - 1) ** 2


# wrong: rest-at-one | cause: rest at three
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 1) + D * (J - 1) ** 2


# wrong: three-times-the-power | cause: three outside
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * J ** (-2 / 3) * ((F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: J-minus-one-not-squared | cause: not squared
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1)


# wrong: J-squared-minus-one | cause: not squared
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D * (J**2 - 1)


# wrong: log-squared | cause: not squared
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D * ti.log(J) ** 2


# wrong: half-D | cause: half D
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D / 2 * (J - 1) ** 2


# wrong: half-C | cause: half C
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C / 2 * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: C-and-D-exchanged | cause: exchanged:C,D
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return D * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + C * (J - 1) ** 2


# wrong: trace-of-F | cause: sum of F
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * F.trace() - 3) + D * (J - 1) ** 2


# wrong: trace-of-F-F | cause: sum of F
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F @ F).trace() - 3) + D * (J - 1) ** 2


# wrong: norm-of-F | cause: sum of F
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * F.norm() - 3) + D * (J - 1) ** 2


# wrong: entry-by-entry | cause: sum of F
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * (F * F).trace() - 3) + D * (J - 1) ** 2


# wrong: with-a-logarithm | cause: logarithm
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * ((F.transpose() @ F).trace() - 3) - 2 * C * ti.log(J) + D * (J - 1) ** 2


# wrong: J-clamped | cause: clamped J
@ti.func
def psi(F, C, D):
    J = ti.max(F.determinant(), 0.5)
    return C * (J ** (-2 / 3) * (F.transpose() @ F).trace() - 3) + D * (J - 1) ** 2


# right: sum-of-squares
@ti.func
def psi(F, C, D):
    J = F.determinant()
    return C * (F.norm_sqr() / ti.pow(J, 2 / 3) - 3) + D * (J - 1) * (J - 1)


# right: F-freed-of-its-volume
@ti.func
def psi(F, C, D):
    J = F.determinant()
    B = F * ti.exp(-ti.log(J) / 3)
    return C * ((B @ B.transpose()).trace() - 3) + D * (J * J - 2 * J + 1)


# right: by-triple-product
@ti.func
def psi(F, C, D):
    a, b, c = F[:, 0], F[:, 1], F[:, 2]
    J = a.cross(b).dot(c)
    I1 = a.dot(a) + b.dot(b) + c.dot(c)
    return C * (I1 * J ** (-2.0 / 3.0) - 3.0) + D * (J - 1.0) ** 2
