# ruff: noqa
# wrong: middle | cause: average
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return (x0 + x1 + x2 + x3) / 4


# wrong: without-shape-functions | cause: missing:phi
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return x0 + x1 + x2 + x3


# wrong: three-vertices | cause: three vertices
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return phi[0] * x0 + phi[1] * x1 + phi[2] * x2


# wrong: edges-without-x0 | cause: lacks:x0
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return phi[1] * (x1 - x0) + phi[2] * (x2 - x0) + phi[3] * (x3 - x0)


# wrong: order-reversed | cause: other order
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return phi[3] * x0 + phi[2] * x1 + phi[1] * x2 + phi[0] * x3


# wrong: order-rotated | cause: other order
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return phi[0] * x1 + phi[1] * x2 + phi[2] * x3 + phi[3] * x0


# wrong: two-exchanged | cause: other order
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return phi[0] * x0 + phi[1] * x2 + phi[2] * x1 + phi[3] * x3


# wrong: vertex-1-subtracted | cause: negated:x1
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return phi[0] * x0 - phi[1] * x1 + phi[2] * x2 + phi[3] * x3


# right: columns-times-phi
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return ti.Matrix.cols([x0, x1, x2, x3]) @ phi


# right: edges-from-x0
@ti.func
def interpolate(phi, x0, x1, x2, x3):
    return x0 + phi[1] * (x1 - x0) + phi[2] * (x2 - x0) + phi[3] * (x3 - x0)
