# ruff: noqa
# wrong: not-projected | cause: not projected
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    return ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]]) / m.norm()


# wrong: not-divided | cause: not divided
@ti.func
def dn_dx(x0, x1, x2, i):
    n = (x1 - x0).cross(x2 - x0).normalized()
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    dm = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ dm


# wrong: neither-projected-nor-divided | cause: not normalised
@ti.func
def dn_dx(x0, x1, x2, i):
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    return ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])


# wrong: cross-matrix-transposed | cause: negated
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    dm = ti.Matrix([[0, e[2], -e[1]], [-e[2], 0, e[0]], [e[1], -e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ dm / m.norm()


# wrong: edges-in-the-wrong-order | cause: shifted:i
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x1 - x0
    if i == 1:
        e = x2 - x1
    if i == 2:
        e = x0 - x2
    dm = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ dm / m.norm()


# wrong: one-edge-with-the-wrong-sign | cause: where i = 1: negated
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    if i == 1:
        e = x2 - x0
    if i == 2:
        e = x1 - x0
    dm = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ dm / m.norm()


# wrong: always-vertex-0 | cause: ignored:i
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    dm = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ dm / m.norm()


# wrong: rows-for-columns | cause: transposed
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    return n.outer_product(e.cross(n)) / m.norm()


# wrong: projected-from-the-right | cause: negated and transposed
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    dm = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return dm @ (ti.Matrix.identity(float, 3) - n.outer_product(n)) / m.norm()


# wrong: plane-z-0-only | cause: only in a plane
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = ti.Vector([0.0, 0.0, 1.0])
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    dm = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ dm / m.norm()


# wrong: area-for-the-norm | cause: scaled:2
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n, area = m.normalized(), m.norm() / 2
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    return e.cross(n).outer_product(n) / area


# wrong: by-differences | cause: digits
@ti.func
def dn_dx(x0, x1, x2, i):
    J = ti.Matrix.zero(float, 3, 3)
    h = 1e-6 * (x1 - x0).norm()
    for k in ti.static(range(3)):
        d = ti.Vector([0.0, 0.0, 0.0])
        d[k] = h
        a, b, c = 0.0 * d, 0.0 * d, 0.0 * d
        if i == 0:
            a = d
        if i == 1:
            b = d
        if i == 2:
            c = d
        p = (x1 - x0 + b - a).cross(x2 - x0 + c - a).normalized()
        q = (x1 - x0 - b + a).cross(x2 - x0 - c + a).normalized()
        for m in ti.static(range(3)):
            J[m, k] = (p[m] - q[m]) / (2 * h)
    return J


# right: rank-one
@ti.func
def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    return e.cross(n).outer_product(n) / m.norm()


# right: quotient-rule-column-by-column
@ti.func
def dn_dx(x0, x1, x2, i):
    a, b = x1 - x0, x2 - x0
    m = a.cross(b)
    l = m.norm()
    J = ti.Matrix.zero(float, 3, 3)
    for k in ti.static(range(3)):
        w = ti.Vector([0.0, 0.0, 0.0])
        w[k] = 1.0
        dm = -w.cross(b) - a.cross(w)
        if i == 1:
            dm = w.cross(b)
        elif i == 2:
            dm = a.cross(w)
        dn = dm / l - m * (m.dot(dm) / l**3)
        for j in ti.static(range(3)):
            J[j, k] = dn[j]
    return J
