# ruff: noqa
# wrong: vertex-0-not-subtracted | cause: missing:X0
@ti.func
def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ X)
    return ti.Vector([1 - p[0] - p[1], p[0], p[1]])


# wrong: phi-0-last | cause: permuted:1,2,0
@ti.func
def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([p[0], p[1], 1 - p[0] - p[1]])


# wrong: phi-0-forgotten | cause: component 0: zeros
@ti.func
def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([0.0, p[0], p[1]])


# wrong: areas-without-sign | cause: unsigned areas
@ti.func
def phi(X, X0, X1, X2):
    whole = (X1 - X0).cross(X2 - X0).norm()
    a = (X1 - X).cross(X2 - X).norm()
    b = (X2 - X).cross(X0 - X).norm()
    c = (X0 - X).cross(X1 - X).norm()
    return ti.Vector([a, b, c]) / whole


# wrong: one-edge-at-a-time | cause: edges apart
@ti.func
def phi(X, X0, X1, X2):
    a, b, d = X1 - X0, X2 - X0, X - X0
    p = d.dot(a) / a.norm_sqr()
    q = d.dot(b) / b.norm_sqr()
    return ti.Vector([1 - p - q, p, q])


# wrong: unit-edges | cause: unit edges
@ti.func
def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([(X1 - X0).normalized(), (X2 - X0).normalized()])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([1 - p[0] - p[1], p[0], p[1]])


# wrong: plane-z-0-only | cause: in a plane
@ti.func
def phi(X, X0, X1, X2):
    a, b, d = X1 - X0, X2 - X0, X - X0
    det = a[0] * b[1] - a[1] * b[0]
    p = (d[0] * b[1] - d[1] * b[0]) / det
    q = (a[0] * d[1] - a[1] * d[0]) / det
    return ti.Vector([1 - p - q, p, q])


# wrong: vertices-1-and-2-exchanged | cause: permuted:0,2,1
@ti.func
def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([X2 - X0, X1 - X0])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([1 - p[0] - p[1], p[0], p[1]])


# wrong: sum-not-one | cause: component 0
@ti.func
def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([1 - p[0] + p[1], p[0], p[1]])


# right: shares-of-area-with-sign
@ti.func
def phi(X, X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)
    p1 = m.dot((X - X0).cross(X2 - X0)) / m.norm_sqr()
    p2 = m.dot((X1 - X0).cross(X - X0)) / m.norm_sqr()
    return ti.Vector([1 - p1 - p2, p1, p2])


# right: cramers-rule
@ti.func
def phi(X, X0, X1, X2):
    e, f, d = X1 - X0, X2 - X0, X - X0
    ee, ef, ff = e.dot(e), e.dot(f), f.dot(f)
    de, df = d.dot(e), d.dot(f)
    det = ee * ff - ef * ef
    p = ti.Vector([0.0, 0.0, 0.0])
    p[1] = (ff * de - ef * df) / det
    p[2] = (ee * df - ef * de) / det
    p[0] = 1.0 - (p[1] + p[2])
    return p
