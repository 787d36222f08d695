# ruff: noqa
# wrong: column-by-column | cause: column by column
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[i + 3 * j, m + 3 * n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[i + 3 * j, m + 3 * n] += c
    return H


# wrong: rows-column-by-column | cause: rows permuted:0,3,6,1,4,7,2,5,8
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[i + 3 * j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[i + 3 * j, 3 * m + n] += c
    return H


# wrong: G-held-fixed | cause: G held fixed
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = 0.0
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: sign-of-dG | cause: sign of dG
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = -G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: indices-of-dG | cause: indices of dG
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, m] * G[j, n]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: indices-of-dG-straight | cause: indices of dG
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, m] * G[n, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: one-of-a-pair | cause: one of a pair
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: the-other-of-a-pair | cause: one of a pair
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: identity-missing | cause: identity missing
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
    return H


# wrong: power-held-fixed | cause: second derivative of J^(-2/3)
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 3 * turned - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: factor-of-the-power | cause: second derivative of J^(-2/3)
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: volume-held-fixed | cause: J(J - 1) held fixed
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            J * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: one-minus-missing | cause: J(J - 1) held fixed
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            2 * J * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: un-barred | cause: un-barred
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        H[3 * i + j, 3 * m + n] = 2 * D * J * ((2 * J - 1) * G[i, j] * G[m, n] - (J - 1) * G[i, n] * G[m, j])
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += 2 * C
    return H


# wrong: no-two-in-the-shape | cause: halved
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: no-two-in-the-volume | cause: halved
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: C-and-D-exchanged | cause: exchanged:C,D
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * D * J ** (-2 / 3), 2 * C * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: not-transposed | cause: not transposed
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    return H


# wrong: diagonal-only | cause: diagonal only
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    c, d = 2 * C * J ** (-2 / 3), 2 * D * J
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        GG = G[i, j] * G[m, n]
        turned = G[i, n] * G[m, j]
        FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
        H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG) + d * (
            (2 * J - 1) * GG - (J - 1) * turned
        )
        if i == m and j == n:
            H[3 * i + j, 3 * m + n] += c
    for p, q in ti.ndrange(9, 9):
        if p != q:
            H[p, q] = 0.0
    return H


# right: with-cofactors
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    K = J * F.inverse().transpose()
    s = ti.pow(J, -2.0 / 3.0)
    I1 = F.norm_sqr()
    H = ti.Matrix.zero(float, 9, 9)
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        one = 0.0
        if i == m and j == n:
            one = 1.0
        dK = (K[i, j] * K[m, n] - K[i, n] * K[m, j]) / J
        h = 2 * s * one - 4 / 3 * s / J * (F[i, j] * K[m, n] + K[i, j] * F[m, n])
        h += 10 / 9 * s / J**2 * I1 * K[i, j] * K[m, n] - 2 / 3 * s / J * I1 * dK
        H[3 * i + j, 3 * m + n] = C * h + 2 * D * (K[i, j] * K[m, n] + (J - 1) * dK)
    return H


# right: column-after-column
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = F.norm_sqr()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        E = ti.Matrix.zero(float, 3, 3)
        E[m, n] = 1.0
        dG = -G @ E.transpose() @ G
        dJ = J * G[m, n]
        da = -2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (E - 2 / 3 * F[m, n] * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H


# wrong: two-of-the-invariant | cause: derivative of the invariant
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = F[m, n]
        da = -2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H


# wrong: two-of-the-power | cause: derivative of the power
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = 2 * F[m, n]
        da = -1 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H


# wrong: sign-of-the-power | cause: derivative of the power
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = 2 * F[m, n]
        da = 2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H


# wrong: J-too-often | cause: derivative of J
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = 2 * F[m, n]
        da = -2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * (2 * (2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H


# wrong: factor-of-dG | cause: factor of dG
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = 2 * F[m, n]
        da = -2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + 2 * (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H


# wrong: columns-by-a-sum | cause: other numbers
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = 2 * F[m, n]
        da = -2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, m + n] += dP[i, j]
    return H


# right: change-by-change
@ti.func
def d2psi_dF2(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    I1 = (F.transpose() @ F).trace()
    a = 2 * C * J ** (-2 / 3)
    H = ti.Matrix.zero(float, 9, 9)
    for m, n in ti.ndrange(3, 3):
        dF = ti.Matrix.zero(float, 3, 3)
        dF[m, n] = 1.0
        dG = -G @ dF.transpose() @ G
        dJ = J * G[m, n]
        dI = 2 * F[m, n]
        da = -2 / 3 * a * G[m, n]
        dP = da * (F - I1 / 3 * G) + a * (dF - dI / 3 * G - I1 / 3 * dG)
        dP += 2 * D * ((2 * J - 1) * dJ * G + (J - 1) * J * dG)
        for i, j in ti.ndrange(3, 3):
            H[3 * i + j, 3 * m + n] = dP[i, j]
    return H
