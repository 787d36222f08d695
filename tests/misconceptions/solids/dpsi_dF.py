# ruff: noqa
# wrong: un-barred | cause: un-barred
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * F + 2 * D * (J - 1) * J * G


# wrong: power-held-fixed | cause: J held fixed
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * F + 2 * D * (J - 1) * J * G


# wrong: not-transposed | cause: not transposed
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G


# wrong: J-missing | cause: J missing
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * G


# wrong: minus-five-thirds | cause: wrong derivative of J^(-2/3)
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * F - 2 / 3 * C * J ** (-5 / 3) * I1 * G + 2 * D * (J - 1) * J * G


# wrong: sign-of-the-power | cause: wrong derivative of J^(-2/3)
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F + I1 / 3 * G) + 2 * D * (J - 1) * J * G


# wrong: third-missing | cause: wrong derivative of J^(-2/3)
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 * G) + 2 * D * (J - 1) * J * G


# wrong: cauchy | cause: cauchy
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    P = 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G
    return P @ F.transpose() / J


# wrong: second-piola-kirchhoff | cause: cauchy
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    P = 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G
    return F.inverse() @ P


# wrong: no-two-in-the-shape | cause: halved
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G


# wrong: no-two-in-the-volume | cause: halved
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + D * (J - 1) * J * G


# wrong: C-and-D-exchanged | cause: exchanged:C,D
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * D * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * C * (J - 1) * J * G


# wrong: negated | cause: negated
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return -(2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G)


# wrong: transposed | cause: transposed
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return (2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G).transpose()


# wrong: pressure-along-F | cause: undeformed pressure
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G) + 2 * D * (J - 1) * F


# wrong: volume-missing | cause: missing:D
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * J ** (-2 / 3) * (F - I1 / 3 * G)


# wrong: with-a-logarithm | cause: other energy
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    return 2 * C * (F - G) + 2 * D * ti.log(J) * G


# right: with-cofactors
@ti.func
def dpsi_dF(F, C, D):
    a, b, c = F[:, 0], F[:, 1], F[:, 2]
    K = ti.Matrix.cols([b.cross(c), c.cross(a), a.cross(b)])
    J = a.dot(b.cross(c))
    s = ti.pow(J, -2.0 / 3.0)
    return 2 * C * s * F - 2 * C / 3 * s / J * F.norm_sqr() * K + 2 * D * (J - 1) * K


# right: two-terms
@ti.func
def dpsi_dF(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    P = C * J ** (-2 / 3) * (2 * F) + C * (-2 / 3) * J ** (-5 / 3) * I1 * (J * G)
    return P + D * 2 * (J - 1) * (J * G)
