# ruff: noqa
# wrong: edges-without-vertex-0 | cause: lacks:x0
@ti.func
def interpolate(phi, x0, x1, x2):
    return phi[1] * (x1 - x0) + phi[2] * (x2 - x0)


# wrong: first-term-forgotten | cause: missing:x0
@ti.func
def interpolate(phi, x0, x1, x2):
    return phi[1] * x1 + phi[2] * x2


# wrong: phi-0-last | cause: rolled:x0,x1,x2
@ti.func
def interpolate(phi, x0, x1, x2):
    return phi[2] * x0 + phi[0] * x1 + phi[1] * x2


# wrong: vertices-1-and-2-exchanged | cause: swapped:x1,x2
@ti.func
def interpolate(phi, x0, x1, x2):
    return phi[0] * x0 + phi[2] * x1 + phi[1] * x2


# wrong: average | cause: average
@ti.func
def interpolate(phi, x0, x1, x2):
    return (x0 + x1 + x2) / 3


# wrong: not-weighted | cause: missing:phi
@ti.func
def interpolate(phi, x0, x1, x2):
    return x0 + x1 + x2


# wrong: weighted-and-averaged | cause: scaled:1/3
@ti.func
def interpolate(phi, x0, x1, x2):
    return (phi[0] * x0 + phi[1] * x1 + phi[2] * x2) / 3


# wrong: rows-for-columns | cause: transposed vertices
@ti.func
def interpolate(phi, x0, x1, x2):
    return ti.Matrix.rows([x0, x1, x2]) @ phi


# wrong: entry-by-entry | cause: entry by entry
@ti.func
def interpolate(phi, x0, x1, x2):
    return ti.Vector([phi[0] * x0[0], phi[1] * x1[1], phi[2] * x2[2]])


# wrong: j-where-i | cause: swapped:x0,x1
@ti.func
def interpolate(phi, x0, x1, x2):
    return phi[1] * x0 + phi[0] * x1 + phi[2] * x2


# right: vertices-as-columns
@ti.func
def interpolate(phi, x0, x1, x2):
    return ti.Matrix.cols([x0, x1, x2]) @ phi


# right: component-by-component
@ti.func
def interpolate(phi, x0, x1, x2):
    x = ti.Vector([0.0, 0.0, 0.0])
    for k in ti.static(range(3)):
        x[k] = x2[k] * phi[2] + x1[k] * phi[1] + x0[k] * phi[0]
    return x
