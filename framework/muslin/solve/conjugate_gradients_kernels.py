"""Conjugate gradients on 3x3 blocks, preconditioned by the diagonal blocks, in one Taichi kernel."""

from muslin.base.arrays import integers, mat3s, scalars, vec3s
from muslin.base.engine import ti


@ti.kernel
def invert_diagonal(data: scalars, start: integers, stride: integers, diagonal: integers, inverse: mat3s):
    """Inverse of the diagonal block of every row of blocks."""
    for i in range(inverse.shape[0]):
        B = ti.Matrix.zero(float, 3, 3)
        for a, b in ti.static(ti.ndrange(3, 3)):
            B[a, b] = data[start[diagonal[i]] + a * stride[diagonal[i]] + b]
        inverse[i] = B.inverse()


@ti.kernel
def begin(
    ptr: integers, col: integers, start: integers, stride: integers, data: scalars, inverse: mat3s,
    b: vec3s, y: vec3s, r: vec3s, p: vec3s, sums: scalars,
):  # fmt: skip
    """Start: r = b - A y, p = z = r preconditioned; sums[0] = r.z, sums[1] = |r|^2, sums[2] = |b|^2."""
    ti.loop_config(serialize=True)
    for k in range(3):
        sums[k] = 0.0
    for i in range(y.shape[0]):
        r[i] = b[i] - times(ptr, col, start, stride, data, y, i)
        p[i] = inverse[i] @ r[i]
    ti.loop_config(serialize=True)  # sums in a fixed order: the same bits in every run
    for i in range(y.shape[0]):
        sums[0] += r[i].dot(p[i])
        sums[1] += r[i].norm_sqr()
        sums[2] += b[i].norm_sqr()


@ti.func
def times(
    ptr: ti.template(), col: ti.template(), start: ti.template(), stride: ti.template(), data: ti.template(),
    p: ti.template(), i,
):  # fmt: skip
    """Row i of A p."""
    total = ti.Vector([0.0, 0.0, 0.0])
    for k in range(ptr[i], ptr[i + 1]):
        v, at, step = p[col[k]], start[k], stride[k]
        for a in ti.static(range(3)):
            total[a] += (
                data[at + a * step] * v[0] + data[at + a * step + 1] * v[1] + data[at + a * step + 2] * v[2]
            )
    return total


@ti.kernel
def iterate(
    ptr: integers, col: integers, start: integers, stride: integers, data: scalars, inverse: mat3s,
    y: vec3s, r: vec3s, p: vec3s, w: vec3s, part: vec3s, sums: scalars,
):  # fmt: skip
    """One step of conjugate gradients, sums per block of rows in a fixed order.

    part[c] holds the sums of rows c * SPAN to (c + 1) * SPAN.
    """
    for c in range(part.shape[0]):
        pAp = 0.0
        for i in range(c * SPAN, ti.min((c + 1) * SPAN, y.shape[0])):
            w[i] = times(ptr, col, start, stride, data, p, i)
            pAp += p[i].dot(w[i])
        part[c][0] = pAp
    for _ in range(1):
        total = 0.0
        for c in range(part.shape[0]):
            total += part[c][0]
        sums[3] = 0.0
        if total > 0:
            sums[3] = sums[0] / total
    for c in range(part.shape[0]):
        rz, rr = 0.0, 0.0
        for i in range(c * SPAN, ti.min((c + 1) * SPAN, y.shape[0])):
            y[i] += sums[3] * p[i]
            r[i] -= sums[3] * w[i]
            w[i] = inverse[i] @ r[i]
            rz += r[i].dot(w[i])
            rr += r[i].norm_sqr()
        part[c][1], part[c][2] = rz, rr
    for _ in range(1):
        rz, rr = 0.0, 0.0
        for c in range(part.shape[0]):
            rz += part[c][1]
            rr += part[c][2]
        sums[4] = 0.0
        if sums[0] > 0:
            sums[4] = rz / sums[0]
        sums[0], sums[1] = rz, rr
    for i in range(y.shape[0]):
        p[i] = w[i] + sums[4] * p[i]


#: Rows whose sums are added up together.
SPAN = 512
