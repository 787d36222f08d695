# ruff: noqa
# wrong: squared-distance-against-r | cause: squared distance
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm_sqr() < r, ti.i32), n


# wrong: inward-normal | cause: negated
@ti.func
def sphere_contact(x, c, r):
    d = c - x
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm() < r, ti.i32), n


# wrong: nan-at-the-centre | cause: where x = c: nan
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    return ti.cast(d.norm() < r, ti.i32), d / d.norm()


# wrong: not-normalised | cause: scaled by distance
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d
    return ti.cast(d.norm() < r, ti.i32), n


# wrong: divided-by-the-radius | cause: divided by the radius
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d / r
    return ti.cast(d.norm() < r, ti.i32), n


# wrong: surface-counts | cause: surface counts
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm() <= r, ti.i32), n


# wrong: outside-hits | cause: inverted
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm() > r, ti.i32), n


# wrong: centre-forgotten | cause: missing:c
@ti.func
def sphere_contact(x, c, r):
    n = ti.Vector([0.0, 1.0, 0.0])
    if x.norm() > 0:
        n = x.normalized()
    return ti.cast(x.norm() < r, ti.i32), n


# wrong: normal-only-on-a-hit | cause: no normal without a hit
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    hit = 0
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() < r:
        hit = 1
        if d.norm() > 0:
            n = d.normalized()
    return hit, n


# wrong: default-of-integers | cause: whole numbers
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0, 1, 0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm() < r, ti.i32), n


# wrong: up-is-z | cause: where x = c: permuted:0,2,1
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 0.0, 1.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm() < r, ti.i32), n


# wrong: always-a-hit | cause: constant
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return 1, n


# wrong: a-cube-for-a-sphere | cause: a box
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(ti.max(abs(d[0]), abs(d[1]), abs(d[2])) < r, ti.i32), n


# right: squares-on-both-sides
@ti.func
def sphere_contact(x, c, r):
    d = x - c
    l2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    n = ti.Vector([0.0, 1.0, 0.0])
    if l2 > 0.0:
        n = d * (1.0 / ti.sqrt(l2))
    hit = 0
    if l2 < r * r:
        hit = 1
    return hit, n


# right: default-afterwards
@ti.func
def sphere_contact(x, c, r):
    l = (x - c).norm()
    hit = ti.select(r - l > 0, 1, 0)
    n = (x - c) / ti.max(l, 1e-300)
    if l == 0:
        n = ti.Vector([0.0, 1.0, 0.0])
    return hit, n
