# ruff: noqa
# wrong: columns-of-the-inverse | cause: columns of the inverse
@ti.func
def dphi_dX(X0, X1, X2, X3):
    G = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    a, b, c = G[:, 0], G[:, 1], G[:, 2]
    return ti.Matrix.rows([-a - b - c, a, b, c])


# wrong: edges-as-rows | cause: columns of the inverse
@ti.func
def dphi_dX(X0, X1, X2, X3):
    G = ti.Matrix.rows([X1 - X0, X2 - X0, X3 - X0]).inverse()
    return ti.Matrix.rows([-G[0, :] - G[1, :] - G[2, :], G[0, :], G[1, :], G[2, :]])


# wrong: not-inverted | cause: not inverted
@ti.func
def dphi_dX(X0, X1, X2, X3):
    a, b, c = X1 - X0, X2 - X0, X3 - X0
    return ti.Matrix.rows([-a - b - c, a, b, c])


# wrong: row-0-zero | cause: row 0 not the rest
@ti.func
def dphi_dX(X0, X1, X2, X3):
    G = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    return ti.Matrix.rows([0 * X0, G[0, :], G[1, :], G[2, :]])


# wrong: row-0-sign | cause: row 0 not the rest
@ti.func
def dphi_dX(X0, X1, X2, X3):
    G = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    return ti.Matrix.rows([G[0, :] + G[1, :] + G[2, :], G[0, :], G[1, :], G[2, :]])


# wrong: row-0-one-minus | cause: row 0 not the rest
@ti.func
def dphi_dX(X0, X1, X2, X3):
    G = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    return ti.Matrix.rows([1 - G[0, :] - G[1, :] - G[2, :], G[0, :], G[1, :], G[2, :]])


# wrong: row-0-last | cause: rows permuted:1,2,3,0
@ti.func
def dphi_dX(X0, X1, X2, X3):
    G = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    return ti.Matrix.rows([G[0, :], G[1, :], G[2, :], -G[0, :] - G[1, :] - G[2, :]])


# wrong: normals-of-the-faces | cause: face normals
@ti.func
def dphi_dX(X0, X1, X2, X3):
    e, f, g = X1 - X0, X2 - X0, X3 - X0
    a, b, c = f.cross(g), g.cross(e), e.cross(f)
    return ti.Matrix.rows([-a - b - c, a, b, c])


# wrong: unit-normals | cause: rows normalised
@ti.func
def dphi_dX(X0, X1, X2, X3):
    e, f, g = X1 - X0, X2 - X0, X3 - X0
    a, b, c = f.cross(g), g.cross(e), e.cross(f)
    return ti.Matrix.rows([-(a + b + c).normalized(), a.normalized(), b.normalized(), c.normalized()])


# wrong: volume-for-six-volumes | cause: scaled:6
@ti.func
def dphi_dX(X0, X1, X2, X3):
    e, f, g = X1 - X0, X2 - X0, X3 - X0
    V = e.cross(f).dot(g) / 6
    a, b, c = f.cross(g) / V, g.cross(e) / V, e.cross(f) / V
    return ti.Matrix.rows([-a - b - c, a, b, c])


# wrong: one-edge-at-a-time | cause: edges apart
@ti.func
def dphi_dX(X0, X1, X2, X3):
    e, f, g = X1 - X0, X2 - X0, X3 - X0
    a, b, c = e / e.norm_sqr(), f / f.norm_sqr(), g / g.norm_sqr()
    return ti.Matrix.rows([-a - b - c, a, b, c])


# right: face-normals-over-six-volumes
@ti.func
def dphi_dX(X0, X1, X2, X3):
    e, f, g = X1 - X0, X2 - X0, X3 - X0
    whole = e.cross(f).dot(g)
    a, b, c = f.cross(g) / whole, g.cross(e) / whole, e.cross(f) / whole
    return ti.Matrix.rows([-a - b - c, a, b, c])


# right: entry-by-entry
@ti.func
def dphi_dX(X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0]).inverse()
    G = ti.Matrix.zero(float, 4, 3)
    for i, j in ti.static(ti.ndrange(3, 3)):
        G[i + 1, j] = D[i, j]
        G[0, j] -= D[i, j]
    return G
