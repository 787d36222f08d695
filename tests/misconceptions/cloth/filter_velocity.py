# ruff: noqa
# wrong: always | cause: always
@ti.func
def filter_velocity(v, n):
    return v - n.dot(v) * n


# wrong: reflected | cause: reflected
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d < 0:
        w = v - 2 * d * n
    return w


# wrong: added | cause: wrong sign
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d < 0:
        w = v + d * n
    return w


# wrong: condition-turned-round | cause: reversed
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d > 0:
        w = v - d * n
    return w


# wrong: stopped | cause: stopped
@ti.func
def filter_velocity(v, n):
    w = v
    if n.dot(v) < 0:
        w = 0.0 * v
    return w


# wrong: along-the-velocity | cause: along the velocity
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d < 0:
        w = v - d * v
    return w


# wrong: normal-part-only | cause: the part that goes in
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d < 0:
        w = d * n
    return w


# wrong: number-for-vector | cause: missing:n
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d < 0:
        w = v - d
    return w


# wrong: not-filtered | cause: echo:v
@ti.func
def filter_velocity(v, n):
    return v + 0.0 * n


# wrong: length-in-place-of-the-part | cause: whole speed
@ti.func
def filter_velocity(v, n):
    w = v
    if n.dot(v) < 0:
        w = v + v.norm() * n
    return w


# wrong: bounces-a-little | cause: change scaled:3/2
@ti.func
def filter_velocity(v, n):
    d = n.dot(v)
    w = v
    if d < 0:
        w = v - 1.5 * d * n
    return w


# right: minimum
@ti.func
def filter_velocity(v, n):
    return v - ti.min(v.dot(n), 0.0) * n


# right: projector-matrix
@ti.func
def filter_velocity(v, n):
    P = ti.Matrix.identity(float, 3) - n.outer_product(n)
    w = v
    if v[0] * n[0] + v[1] * n[1] + v[2] * n[2] < 0:
        w = P @ v
    return w


# right: into-a-new-vector
@ti.func
def filter_velocity(v, n):
    w = ti.Vector([v[0], v[1], v[2]])
    into = -(n[0] * v[0] + n[1] * v[1] + n[2] * v[2])
    if into > 0:
        for k in ti.static(range(3)):
            w[k] += into * n[k]
    return w
