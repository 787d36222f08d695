# ruff: noqa
# wrong: X0-not-subtracted | cause: missing:X0
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = D.inverse() @ X
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])


# wrong: edges-as-rows | cause: edges as rows
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.rows([X1 - X0, X2 - X0, X3 - X0])
    p = D.inverse() @ (X - X0)
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])


# wrong: inverse-forgotten | cause: not inverted
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = D @ (X - X0)
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])


# wrong: transpose-for-inverse | cause: not inverted
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = D.transpose() @ (X - X0)
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])


# wrong: phi-0-last | cause: permuted:1,2,3,0
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = D.inverse() @ (X - X0)
    return ti.Vector([p[0], p[1], p[2], 1 - p[0] - p[1] - p[2]])


# wrong: phi-0-without-phi-3 | cause: phi_0 not the rest
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = D.inverse() @ (X - X0)
    return ti.Vector([1 - p[0] - p[1], p[0], p[1], p[2]])


# wrong: phi-0-with-plus | cause: phi_0 not the rest
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = D.inverse() @ (X - X0)
    return ti.Vector([1 + p[0] + p[1] + p[2], p[0], p[1], p[2]])


# wrong: volumes-without-sign | cause: absolute
@ti.func
def phi(X, X0, X1, X2, X3):
    whole = ti.abs((X1 - X0).cross(X2 - X0).dot(X3 - X0))
    a = ti.abs((X1 - X).cross(X2 - X).dot(X3 - X))
    b = ti.abs((X2 - X0).cross(X3 - X0).dot(X - X0))
    c = ti.abs((X3 - X0).cross(X1 - X0).dot(X - X0))
    d = ti.abs((X1 - X0).cross(X2 - X0).dot(X - X0))
    return ti.Vector([a, b, c, d]) / whole


# wrong: one-edge-at-a-time | cause: edges apart
@ti.func
def phi(X, X0, X1, X2, X3):
    d, e, f, g = X - X0, X1 - X0, X2 - X0, X3 - X0
    a, b, c = d.dot(e) / e.norm_sqr(), d.dot(f) / f.norm_sqr(), d.dot(g) / g.norm_sqr()
    return ti.Vector([1 - a - b - c, a, b, c])


# wrong: unit-edges | cause: unit edges
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([(X1 - X0).normalized(), (X2 - X0).normalized(), (X3 - X0).normalized()])
    p = D.inverse() @ (X - X0)
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])


# wrong: vertices-for-edges | cause: vertices as columns
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1, X2, X3])
    p = D.inverse() @ X
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])


# right: shares-of-the-volume
@ti.func
def phi(X, X0, X1, X2, X3):
    whole = (X1 - X0).cross(X2 - X0).dot(X3 - X0)
    b = (X2 - X0).cross(X3 - X0).dot(X - X0) / whole
    c = (X3 - X0).cross(X1 - X0).dot(X - X0) / whole
    d = (X1 - X0).cross(X2 - X0).dot(X - X0) / whole
    return ti.Vector([1 - b - c - d, b, c, d])


# right: normal-equations
@ti.func
def phi(X, X0, X1, X2, X3):
    D = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([1 - p.sum(), p[0], p[1], p[2]])


# right: four-by-four
@ti.func
def phi(X, X0, X1, X2, X3):
    A = ti.Matrix(
        [
            [1.0, 1.0, 1.0, 1.0],
            [0.0, X1[0] - X0[0], X2[0] - X0[0], X3[0] - X0[0]],
            [0.0, X1[1] - X0[1], X2[1] - X0[1], X3[1] - X0[1]],
            [0.0, X1[2] - X0[2], X2[2] - X0[2], X3[2] - X0[2]],
        ]
    )
    b = ti.Vector([1.0, X[0] - X0[0], X[1] - X0[1], X[2] - X0[2]])
    return A.inverse() @ b
