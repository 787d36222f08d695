# ruff: noqa
# wrong: rows-and-columns-exchanged | cause: transposed
@ti.func
def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    g1, g2 = G[0, :], G[1, :]
    return ti.Matrix.cols([-g1 - g2, g1, g2])


# wrong: row-0-forgotten | cause: row 0: zeros
@ti.func
def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    return ti.Matrix.rows([ti.Vector([0.0, 0.0, 0.0]), G[0, :], G[1, :]])


# wrong: not-minus-the-sum | cause: row 0: negated
@ti.func
def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    return ti.Matrix.rows([G[0, :] + G[1, :], G[0, :], G[1, :]])


# wrong: one-minus-the-sum | cause: row 0
@ti.func
def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    return ti.Matrix.rows([1 - G[0, :] - G[1, :], G[0, :], G[1, :]])


# wrong: row-0-last | cause: rows permuted:1,2,0
@ti.func
def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    return ti.Matrix.rows([G[0, :], G[1, :], -G[0, :] - G[1, :]])


# wrong: one-edge-at-a-time | cause: edges apart
@ti.func
def dphi_dX(X0, X1, X2):
    e, f = X1 - X0, X2 - X0
    g1, g2 = e / e.norm_sqr(), f / f.norm_sqr()
    return ti.Matrix.rows([-g1 - g2, g1, g2])


# wrong: unit-edges | cause: unit edges
@ti.func
def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([(X1 - X0).normalized(), (X2 - X0).normalized()])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    return ti.Matrix.rows([-G[0, :] - G[1, :], G[0, :], G[1, :]])


# wrong: not-inverted | cause: edges apart
@ti.func
def dphi_dX(X0, X1, X2):
    g1, g2 = X1 - X0, X2 - X0
    return ti.Matrix.rows([-g1 - g2, g1, g2])


# wrong: area-for-twice-the-area | cause: scaled:2
@ti.func
def dphi_dX(X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)
    n, area = m.normalized(), m.norm() / 2
    return ti.Matrix.rows([n.cross(X2 - X1), n.cross(X0 - X2), n.cross(X1 - X0)]) / area


# wrong: inward | cause: negated
@ti.func
def dphi_dX(X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)
    return ti.Matrix.rows([(X2 - X1).cross(m), (X0 - X2).cross(m), (X1 - X0).cross(m)]) / m.norm_sqr()


# wrong: along-the-opposite-edge | cause: not turned
@ti.func
def dphi_dX(X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)
    return ti.Matrix.rows([X2 - X1, X0 - X2, X1 - X0]) / m.norm()


# wrong: unit-gradients | cause: rows normalised
@ti.func
def dphi_dX(X0, X1, X2):
    n = (X1 - X0).cross(X2 - X0)
    a, b, c = n.cross(X2 - X1), n.cross(X0 - X2), n.cross(X1 - X0)
    return ti.Matrix.rows([a.normalized(), b.normalized(), c.normalized()])


# right: cross-products
@ti.func
def dphi_dX(X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)
    k = m / m.norm_sqr()
    return ti.Matrix.rows([k.cross(X2 - X1), k.cross(X0 - X2), k.cross(X1 - X0)])


# right: dual-basis-in-a-loop
@ti.func
def dphi_dX(X0, X1, X2):
    e, f = X1 - X0, X2 - X0
    ee, ef, ff = e.dot(e), e.dot(f), f.dot(f)
    det = ee * ff - ef * ef
    G = ti.Matrix.zero(float, 3, 3)
    for k in ti.static(range(3)):
        G[1, k] = (ff * e[k] - ef * f[k]) / det
        G[2, k] = (ee * f[k] - ef * e[k]) / det
        G[0, k] = -(G[1, k] + G[2, k])
    return G


# right: heights
@ti.func
def dphi_dX(X0, X1, X2):
    e, f = X1 - X0, X2 - X0
    a = e - f * (e.dot(f) / f.dot(f))
    b = f - e * (f.dot(e) / e.dot(e))
    g1, g2 = a / a.norm_sqr(), b / b.norm_sqr()
    return ti.Matrix.rows([-g1 - g2, g1, g2])
