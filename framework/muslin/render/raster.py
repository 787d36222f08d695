"""Which triangle each sample of the picture sees: the z-buffer.

Rasterising is done in homogeneous form (Olano & Greer 1997). A ray d through a sample, scaled to advance by
1 along the line of sight, meets the triangle v0, v1, v2 (camera at the origin) at t d = sum_i beta_i v_i, so

    beta_i / t = d . (v_j x v_k) / det [v0 v1 v2],        sum_i beta_i / t = 1 / t :

three linear functions of the pixel position give the inside test, the inverse depth and the
perspective-correct barycentric coordinates at once, and triangles that reach behind the camera need no
clipping, only a bounding box of their visible part.

No atomics: a parallel task owns a band of rows and walks through the triangles in
order, so every run gives the same bytes, whatever the number of threads.
"""

from muslin.base.engine import ti

#: What no triangle covers; what several triangles share.
NONE, MIXED = -1, -2

F = ti.f32
D2 = ti.types.ndarray(dtype=ti.f64, ndim=2)
F1 = ti.types.ndarray(dtype=ti.f32, ndim=1)
F2 = ti.types.ndarray(dtype=ti.f32, ndim=2)
I1 = ti.types.ndarray(dtype=ti.i32, ndim=1)
I2 = ti.types.ndarray(dtype=ti.i32, ndim=2)
U1 = ti.types.ndarray(dtype=ti.u8, ndim=1)
U3 = ti.types.ndarray(dtype=ti.u8, ndim=3)


@ti.func
def lesser(a, b):
    """The lesser of two numbers in one instruction; `ti.min` takes four to treat what is not a number."""
    return ti.select(a < b, a, b)


@ti.func
def greater(a, b):
    """The greater of two numbers, as `lesser`."""
    return ti.select(a > b, a, b)


@ti.kernel
def edge_functions(
    view: D2, triangles: I2, focal: ti.f64, near: ti.f64, width: ti.i32, height: ti.i32, edges: D2, box: I2,
    facing: I1,
):  # fmt: skip
    """Linear functions beta_i / t = a x + b y + c of the sample position, and the box of samples to test.

    view (n, 3): right, up, forward of the camera; focal, width, height: in samples; edges (m, 9): a, b, c of
    each vertex; box (m, 4): first and last column, first and last row; empty if nothing is visible; facing
    (m,): 1 where the eye sees the front, -1 the back, 0 nothing; doubled where it is seen nearly edge-on.
    """
    for m in range(triangles.shape[0]):
        v = ti.Matrix.zero(ti.f64, 3, 3)
        for i in ti.static(range(3)):
            for k in ti.static(range(3)):
                v[i, k] = view[triangles[m, i], k]
        lo = ti.Vector([1e9, 1e9], dt=ti.f64)
        hi = ti.Vector([-1e9, -1e9], dt=ti.f64)
        for i in range(3):
            j = (i + 1) % 3
            a = ti.Vector([v[i, 0], v[i, 1], v[i, 2]])
            b = ti.Vector([v[j, 0], v[j, 1], v[j, 2]])
            if a[2] < near and b[2] >= near:
                a += (b - a) * ((near - a[2]) / (b[2] - a[2]))
            elif a[2] >= near and b[2] < near:
                b = a + (b - a) * ((near - a[2]) / (b[2] - a[2]))
                p = ti.Vector([width / 2 + focal * b[0] / near, height / 2 - focal * b[1] / near])
                lo = ti.min(lo, p)
                hi = ti.max(hi, p)
            if a[2] >= near or b[2] >= near:
                z = ti.max(a[2], near)
                p = ti.Vector([width / 2 + focal * a[0] / z, height / 2 - focal * a[1] / z])
                lo = ti.min(lo, p)
                hi = ti.max(hi, p)
        box[m, 0] = ti.cast(ti.math.clamp(lo[0] - 1, 0, width), ti.i32)
        box[m, 1] = ti.cast(ti.math.clamp(hi[0] + 1, -1, width - 1), ti.i32)
        box[m, 2] = ti.cast(ti.math.clamp(lo[1] - 1, 0, height), ti.i32)
        box[m, 3] = ti.cast(ti.math.clamp(hi[1] + 1, -1, height - 1), ti.i32)
        n0 = ti.Vector([v[1, 0], v[1, 1], v[1, 2]]).cross(ti.Vector([v[2, 0], v[2, 1], v[2, 2]]))
        n1 = ti.Vector([v[2, 0], v[2, 1], v[2, 2]]).cross(ti.Vector([v[0, 0], v[0, 1], v[0, 2]]))
        n2 = ti.Vector([v[0, 0], v[0, 1], v[0, 2]]).cross(ti.Vector([v[1, 0], v[1, 1], v[1, 2]]))
        det = v[0, 0] * n0[0] + v[0, 1] * n0[1] + v[0, 2] * n0[2]
        facing[m] = 0
        if ti.abs(det) < 1e-18:
            box[m, 0] = width  # seen edge-on, or no area
            box[m, 1] = -1
        else:
            slope = ti.Vector([0.0, 0.0])
            for i in ti.static(range(3)):
                n = (n0, n1, n2)[i] / det
                edges[m, 3 * i] = n[0] / focal
                edges[m, 3 * i + 1] = -n[1] / focal
                # No gaps between neighbours: each reaches a ten-millionth of a sample beyond its edges.
                gap = 1e-7 * (ti.abs(n[0]) + ti.abs(n[1])) / focal
                edges[m, 3 * i + 2] = n[2] - (n[0] * width - n[1] * height) / (2 * focal) + gap
                slope += ti.Vector([n[0], n[1]]) / focal
            facing[m] = ti.select(det > 0, 1, -1)
            # Too steep to tell its depth within a pixel from that at the pixel's centre?
            if ti.abs(slope).sum() * ti.max(v[0, 2], v[1, 2], v[2, 2]) >= 0.005:
                facing[m] *= 2


@ti.kernel
def find_outlines(triangles: I2, neighbours: I2, facing: I1, corner: I1, outer: I1):
    """Triangles at which a smooth surface ends or turns away from the eye: outer[m], 0 or 1.

    neighbours (m, 3): triangles across each edge, opposite vertex 0, 1, 2, and -1 for none; corner (n,):
    scratch.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        for q in range(corner.shape[0]):
            corner[q] = 0
        for m in range(triangles.shape[0]):
            for i in range(3):
                beyond = neighbours[m, i]
                if beyond < 0 or ti.abs(facing[m]) != 1 or facing[ti.max(beyond, 0)] != facing[m]:
                    corner[triangles[m, (i + 1) % 3]] = 1
                    corner[triangles[m, (i + 2) % 3]] = 1
        for m in range(triangles.shape[0]):
            outer[m] = corner[triangles[m, 0]] | corner[triangles[m, 1]] | corner[triangles[m, 2]]


@ti.func
def sample_place(row, column, jitter):
    """Where in the picture a sample lies: its cell's centre, shifted to make four samples a rotated grid."""
    x = column + 0.5 + jitter * (1 - 2 * (row & 1))
    y = row + 0.5 + jitter * (2 * (column & 1) - 1)
    return x, y


@ti.func
def span(begin, end, start, step, spread):
    """Columns from begin to end in which start + step * column >= -spread, with one to spare on each side."""
    lo, hi = ti.f64(begin), ti.f64(end)
    for i in ti.static(range(3)):
        zero = -(start[i] + spread[i]) / step[i]
        if step[i] > 0:
            lo = greater(lo, zero - 1)
        elif step[i] < 0:
            hi = lesser(hi, zero + 2)
    return ti.cast(lesser(lo, ti.f64(end)), ti.i32), ti.cast(greater(hi, ti.f64(begin)), ti.i32)


@ti.func
def coefficients(edges: ti.template(), m):
    """a, b, c of triangle m's three functions beta = a x + b y + c, as vectors."""
    return (
        ti.Vector([edges[m, 0], edges[m, 3], edges[m, 6]]),
        ti.Vector([edges[m, 1], edges[m, 4], edges[m, 7]]),
        ti.Vector([edges[m, 2], edges[m, 5], edges[m, 8]]),
    )


@ti.kernel
def mark_rims(
    edges: D2, box: I2, outer: I1, samples: ti.i32, width: ti.i32, height: ti.i32, bands: ti.i32, rim: I1
):
    """Pixels that an `outer` triangle touches, whose samples may differ: rim, 0 or 1."""
    ti.loop_config(block_dim=1)
    for band in range(bands):
        top = band * height // bands
        bottom = (band + 1) * height // bands
        for i in range(top * width, bottom * width):
            rim[i] = 0
        for m in range(edges.shape[0]):
            first = ti.max(box[m, 2] // samples, top)
            last = ti.min(box[m, 3] // samples + 1, bottom)
            if outer[m] != 0 and first < last and box[m, 0] <= box[m, 1]:
                a, b, c = coefficients(edges, m)
                spread = 0.5 * samples * (ti.abs(a) + ti.abs(b))
                for row in range(first, last):
                    start = a * (0.5 * samples) + b * ((row + 0.5) * samples) + c
                    begin, end = span(
                        box[m, 0] // samples, box[m, 1] // samples + 1, start, a * samples, spread
                    )
                    for i in range(row * width + begin, row * width + end):
                        rim[i] = 1


@ti.kernel
def rasterise(
    edges: D2, box: I2, near: ti.f64, samples: ti.i32, jitter: ti.f64, width: ti.i32, height: ti.i32,
    bands: ti.i32, rim: I1, seen: I1, nearest: F1, farthest: F1, sample_seen: I1, sample_depth: F1,
):  # fmt: skip
    """The triangle that every pixel sees in `seen`: `NONE`, or `MIXED` where its samples differ.

    Samples are looked at one by one only where it can make a difference: in pixels of the rim (see
    `mark_rims`) that a triangle does not cover whole, and where surfaces meet. Anywhere else the triangle at
    the pixel's centre has all of the pixel.

    nearest, farthest: greatest and least inverse depth of a pixel's samples; sample_seen, sample_depth: what
    the samples of mixed pixels see, and nothing elsewhere.
    """
    reach = 0.5 * (samples - 1) + jitter  # of a sample from the pixel's centre, at most
    ti.loop_config(block_dim=1)
    for band in range(bands):
        top = band * height // bands
        bottom = (band + 1) * height // bands
        for i in range(top * width, bottom * width):
            seen[i] = NONE
            nearest[i] = 0
            farthest[i] = 0
        for m in range(edges.shape[0]):
            first = ti.max(box[m, 2] // samples, top)
            last = ti.min(box[m, 3] // samples + 1, bottom)
            if first < last and box[m, 0] <= box[m, 1]:
                a, b, c = coefficients(edges, m)
                spread = reach * (ti.abs(a) + ti.abs(b))
                w_spread = reach * (ti.abs(a.sum()) + ti.abs(b.sum()))
                step = a * samples
                left, right = box[m, 0] // samples, box[m, 1] // samples + 1
                for row in range(first, last):
                    start = a * (0.5 * samples) + b * ((row + 0.5) * samples) + c
                    begin, end = left, right
                    if right - left > 6:
                        begin, end = span(left, right, start, step, spread)
                    unclear = 0
                    b0 = start[0] + step[0] * begin
                    b1 = start[1] + step[1] * begin
                    b2 = start[2] + step[2] * begin
                    for i in range(row * width + begin, row * width + end):
                        if lesser(lesser(b0 + spread[0], b1 + spread[1]), b2 + spread[2]) >= 0:
                            w = b0 + b1 + b2
                            most, least = F(w + w_spread), F(w - w_spread)
                            if most > farthest[i]:
                                inset = ti.f64(rim[i])
                                if (
                                    b0 >= inset * spread[0] and b1 >= inset * spread[1]
                                    and b2 >= inset * spread[2]
                                    and least > nearest[i] and most * near <= 1
                                ):  # fmt: skip
                                    seen[i] = m
                                    nearest[i] = most
                                    farthest[i] = least
                                else:
                                    unclear += 1
                        b0 += step[0]
                        b1 += step[1]
                        b2 += step[2]
                    if unclear > 0 and samples > 1:
                        for column in range(begin, end):
                            i = row * width + column
                            beta = start + step * column
                            if seen[i] != m and F(beta.sum() + w_spread) > farthest[i]:
                                whole = rim[i] == 0
                                touches = least_of(beta) >= 0
                                if not whole:
                                    touches = least_of(beta + spread) >= 0
                                if touches:
                                    sample(
                                        edges, m, whole, near, samples, jitter, row, column, i, seen, nearest,
                                        farthest, sample_seen, sample_depth,
                                    )  # fmt: skip


@ti.func
def least_of(beta):
    """The least of three numbers."""
    return lesser(lesser(beta[0], beta[1]), beta[2])


@ti.func
def sample(
    edges: ti.template(), m, whole, near, samples, jitter, row, column, pixel, seen: ti.template(),
    nearest: ti.template(), farthest: ti.template(), sample_seen: ti.template(), sample_depth: ti.template(),
):  # fmt: skip
    """Test triangle m, which may have the whole pixel, against each sample of it."""
    total = samples * samples
    before = seen[pixel]
    least, most = F(1e30), F(0.0)
    for r in range(total):
        k = pixel * total + r
        x, y = sample_place(row * samples + r // samples, column * samples + r % samples, jitter)
        if before != MIXED:
            sample_seen[k] = before
            sample_depth[k] = 0
            if before >= 0:
                a, b, c = coefficients(edges, before)
                sample_depth[k] = F((a * x + b * y + c).sum())
        a, b, c = coefficients(edges, m)
        beta = a * x + b * y + c
        w = F(beta.sum())
        if (whole or least_of(beta) >= 0) and w > sample_depth[k] and w * near <= 1:
            sample_seen[k] = m
            sample_depth[k] = w
        least = lesser(least, sample_depth[k])
        most = greater(most, sample_depth[k])
    seen[pixel] = MIXED
    nearest[pixel] = most
    farthest[pixel] = least
