# ruff: noqa
# wrong: no-limit | cause: missing limit
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q = dpsi_ds[0], dpsi_ds[1]
    a, b = ti.max(s[0], 1e-6), ti.max(s[1], 1e-6)
    return ti.Vector([(p - q) / (s[0] - s[1]), (p + q) / ti.max(s[0] + s[1], 1e-6), p / a, q / b])


# wrong: flip-and-twist-exchanged | cause: permuted:1,0,2,3
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([twist, flip, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)])


# wrong: three-by-three-mode | cause: 3x3 mode
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / (s[0] - 1), q / (s[1] - 1)])


# wrong: projected | cause: clamped
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.max(ti.Vector([flip, twist, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)]), 0.0)


# wrong: limit-with-a-plus | cause: wrong limit
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = d2psi_ds2[0, 0] + d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)])


# wrong: limit-always | cause: limit always
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)])


# wrong: stress-for-out | cause: out not divided
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    return ti.Vector([flip, (p + q) / ti.max(s[0] + s[1], 1e-6), p, q])


# wrong: other-stretch-below | cause: other stretch
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / ti.max(s[1], 1e-6), q / ti.max(s[0], 1e-6)])


# wrong: difference-in-twist | cause: difference in twist
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p - q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)])


# wrong: outs-exchanged | cause: permuted:0,1,3,2
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, q / ti.max(s[1], 1e-6), p / ti.max(s[0], 1e-6)])


# wrong: twist-halved | cause: component 1: scaled:1/2
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / 2 / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)])


# wrong: limit-born-as-zero | cause: missing limit
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    p, q, gap = dpsi_ds[0], dpsi_ds[1], s[0] - s[1]
    flip = 0.0
    if abs(gap) > 1e-3:
        flip = (p - q) / gap
    twist = (p + q) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / ti.max(s[0], 1e-6), q / ti.max(s[1], 1e-6)])


# right: as-the-handout-says
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if ti.abs(s[0] - s[1]) > 1e-3:
        flip = (dpsi_ds[0] - dpsi_ds[1]) / (s[0] - s[1])
    twist = (dpsi_ds[0] + dpsi_ds[1]) / ti.max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, dpsi_ds[0] / ti.max(s[0], 1e-6), dpsi_ds[1] / ti.max(s[1], 1e-6)])


# right: with-a-loop-and-floors
@ti.func
def eigensystem(s, dpsi_ds, d2psi_ds2):
    e = ti.Vector([0.0, 0.0, 0.0, 0.0])
    total, gap = 0.0, s[1] - s[0]
    for i in ti.static(range(2)):
        below = s[i]
        if below < 1e-6:
            below = 1e-6
        e[2 + i] = dpsi_ds[i] / below
        total += s[i]
    if total < 1e-6:
        total = 1e-6
    e[1] = dpsi_ds[0] / total + dpsi_ds[1] / total
    if gap > -1e-3 and gap < 1e-3:
        e[0] = 0.5 * (d2psi_ds2[0, 0] - d2psi_ds2[0, 1] - d2psi_ds2[1, 0] + d2psi_ds2[1, 1])
    else:
        e[0] = dpsi_ds[1] / gap - dpsi_ds[0] / gap
    return e
