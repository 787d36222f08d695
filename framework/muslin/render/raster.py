"""Which triangle each sample of the picture sees, and how far light gets: the z-buffer and the depth maps.

Rasterising is done in homogeneous form (Olano & Greer 1997). A ray d through a sample, scaled to advance by
1 along the line of sight, meets the triangle v0, v1, v2 (camera at the origin) at t d = sum_i beta_i v_i, so

    beta_i / t = d . (v_j x v_k) / det [v0 v1 v2],        sum_i beta_i / t = 1 / t :

three linear functions of the pixel position give the inside test, the inverse depth and the
perspective-correct barycentric coordinates at once, and triangles that reach behind the camera need no
clipping, only a bounding box of their visible part.

No atomics: a parallel task owns a band of rows (or of a depth map's rows) and walks through the triangles in
order, so every run gives the same bytes, whatever the number of threads.
"""

from muslin import runtime

ti = runtime.taichi()

F = ti.f32
D2 = ti.types.ndarray(dtype=ti.f64, ndim=2)
F1 = ti.types.ndarray(dtype=ti.f32, ndim=1)
F2 = ti.types.ndarray(dtype=ti.f32, ndim=2)
F3 = ti.types.ndarray(dtype=ti.f32, ndim=3)
I2 = ti.types.ndarray(dtype=ti.i32, ndim=2)
U1 = ti.types.ndarray(dtype=ti.u8, ndim=1)
U3 = ti.types.ndarray(dtype=ti.u8, ndim=3)


@ti.kernel
def edge_functions(
    view: D2, triangles: I2, focal: ti.f64, near: ti.f64, width: ti.i32, height: ti.i32, edges: D2, box: I2
):
    """Linear functions beta_i / t = a x + b y + c of the sample position, and the box of samples to test.

    view (n, 3): right, up, forward of the camera; focal, width, height: in samples; edges (m, 9): a, b, c of
    each vertex; box (m, 4): first and last column, first and last row; empty if nothing is visible.
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
        if ti.abs(det) < 1e-18:
            box[m, 0] = width  # seen edge-on, or no area
            box[m, 1] = -1
        else:
            for i in ti.static(range(3)):
                n = (n0, n1, n2)[i] / det
                edges[m, 3 * i] = n[0] / focal
                edges[m, 3 * i + 1] = -n[1] / focal
                edges[m, 3 * i + 2] = n[2] - (n[0] * width - n[1] * height) / (2 * focal)


@ti.func
def sample_place(row, column, jitter):
    """Where in the picture a sample lies: its cell's centre, shifted to make four samples a rotated grid."""
    x = column + 0.5 + jitter * (1 - 2 * (row & 1))
    y = row + 0.5 + jitter * (2 * (column & 1) - 1)
    return x, y


@ti.kernel
def rasterise(edges: D2, box: I2, near: ti.f64, jitter: ti.f64, bands: ti.i32, depth: F2, seen: I2):
    """The nearest triangle of every sample: `seen` (-1 for none) and the inverse depth in `depth`."""
    ti.loop_config(block_dim=1)
    for band in range(bands):
        top = band * seen.shape[0] // bands
        bottom = (band + 1) * seen.shape[0] // bands
        for y in range(top, bottom):
            for x in range(seen.shape[1]):
                depth[y, x] = 0
                seen[y, x] = -1
        for m in range(edges.shape[0]):
            first = ti.max(box[m, 2], top)
            last = ti.min(box[m, 3] + 1, bottom)
            if first < last:
                a = ti.Vector([edges[m, 0], edges[m, 3], edges[m, 6]])
                b = ti.Vector([edges[m, 1], edges[m, 4], edges[m, 7]])
                c = ti.Vector([edges[m, 2], edges[m, 5], edges[m, 8]])
                left, right = box[m, 0], box[m, 1] + 1
                wide = right - left > 6
                for row in range(first, last):
                    x = 0.5 + jitter * (1 - 2 * (row & 1))
                    y = row + 0.5
                    start = a * x + b * y + c  # at column 0, without the columns' own jitter
                    step = b * jitter
                    begin, end = left, right
                    if wide:  # a narrower span, with a sample to spare on each side
                        lo, hi = ti.f64(left), ti.f64(right)
                        for i in ti.static(range(3)):
                            zero = -(start[i] + ti.abs(step[i])) / a[i]
                            if a[i] > 0:
                                lo = ti.max(lo, zero - 1)
                            elif a[i] < 0:
                                hi = ti.min(hi, zero + 2)
                        begin = ti.cast(ti.min(lo, right), ti.i32)
                        end = ti.cast(ti.max(hi, left), ti.i32)
                    for column in range(begin, end):
                        side = ti.f64(2 * (column & 1) - 1)
                        l0 = start[0] + a[0] * column + side * step[0]
                        l1 = start[1] + a[1] * column + side * step[1]
                        l2 = start[2] + a[2] * column + side * step[2]
                        if l0 >= 0 and l1 >= 0 and l2 >= 0:
                            w = ti.cast(l0 + l1 + l2, ti.f32)
                            if w > depth[row, column] and w * near <= 1:
                                depth[row, column] = w
                                seen[row, column] = m


@ti.kernel
def depth_maps(points: F2, triangles: I2, frames: F2, far_side: ti.i32, bands: ti.i32, scratch: F3, maps: F3):
    """Orthographic depth maps: the height of the first surface met by parallel light.

    frames (k, 12): rows u, v (in texels) and height towards the light, each three numbers and an offset;
    scratch (k * bands, n, 3) for the points in those axes; maps (k, r, r) the greatest height over each
    texel, or with `far_side` maps (2k, r, r), where map k + i is the least height over each texel of map i:
    what the opposite light meets first.
    """
    res = maps.shape[1]
    count = frames.shape[0]
    half, up = F(0.5), F(0.9999)
    ti.loop_config(block_dim=1)
    for task in range(count * bands):
        k = task // bands
        band = task % bands
        top = band * res // bands
        bottom = (band + 1) * res // bands
        for q in range(points.shape[0]):
            x, y, z = points[q, 0], points[q, 1], points[q, 2]
            for r in ti.static(range(3)):
                scratch[task, q, r] = (
                    frames[k, 4 * r] * x
                    + frames[k, 4 * r + 1] * y
                    + frames[k, 4 * r + 2] * z
                    + frames[k, 4 * r + 3]
                )
        for y in range(top, bottom):
            for x in range(res):
                maps[k, y, x] = F(-1e30)
                if far_side != 0:
                    maps[count + k, y, x] = F(1e30)
        for m in range(triangles.shape[0]):
            i0, i1, i2 = triangles[m, 0], triangles[m, 1], triangles[m, 2]
            u0, v0, h0 = scratch[task, i0, 0] - half, scratch[task, i0, 1] - half, scratch[task, i0, 2]
            u1, v1 = scratch[task, i1, 0] - half, scratch[task, i1, 1] - half
            u2, v2 = scratch[task, i2, 0] - half, scratch[task, i2, 1] - half
            # The maps have a margin around all points: coordinates are positive, so casts round down.
            first = ti.max(ti.cast(ti.min(v0, v1, v2) + up, ti.i32), top)
            last = ti.min(ti.cast(ti.max(v0, v1, v2), ti.i32) + 1, bottom)
            left = ti.cast(ti.min(u0, u1, u2) + up, ti.i32)
            right = ti.cast(ti.max(u0, u1, u2), ti.i32) + 1
            area = (u1 - u0) * (v2 - v0) - (v1 - v0) * (u2 - u0)
            if first < last and left < right and ti.abs(area) > F(1e-6):
                # s and t are the barycentric coordinates of the second and third vertex.
                scale = F(1.0) / area
                s_u, s_v = (v2 - v0) * scale, (u0 - u2) * scale
                t_u, t_v = (v0 - v1) * scale, (u1 - u0) * scale
                h1 = scratch[task, i1, 2] - h0
                h2 = scratch[task, i2, 2] - h0
                slack = F(-1e-4)  # no gaps between neighbours
                for y in range(first, last):
                    for x in range(left, right):
                        s = (x - u0) * s_u + (y - v0) * s_v
                        t = (x - u0) * t_u + (y - v0) * t_v
                        if s >= slack and t >= slack and s + t <= 1 - slack:
                            h = h0 + s * h1 + t * h2
                            if h > maps[k, y, x]:
                                maps[k, y, x] = h
                            if far_side != 0 and h < maps[count + k, y, x]:
                                maps[count + k, y, x] = h


@ti.func
def reached(maps: ti.template(), frames: ti.template(), k, px, py, pz, bias):
    """Share of the light k that reaches a point, from the four nearest texels: 0 in shadow, 1 lit.

    A light beyond the number of frames is the opposite of light k - count (see `depth_maps`).
    """
    count = frames.shape[0]
    res = maps.shape[1]
    i = k
    sign = F(1.0)
    if k >= count:
        i = k - count
        sign = F(-1.0)
    half = F(0.5)
    u = frames[i, 0] * px + frames[i, 1] * py + frames[i, 2] * pz + frames[i, 3] - half
    v = frames[i, 4] * px + frames[i, 5] * py + frames[i, 6] * pz + frames[i, 7] - half
    h = frames[i, 8] * px + frames[i, 9] * py + frames[i, 10] * pz + frames[i, 11]
    light = F(1.0)
    inside = F(res - 1)
    if u >= 0 and v >= 0 and u < inside and v < inside:
        iu, iv = ti.cast(u, ti.i32), ti.cast(v, ti.i32)
        fu = u - iu
        fv = v - iv
        t = sign * h + bias
        a = F(0.0)
        b = F(0.0)
        c = F(0.0)
        d = F(0.0)
        if t >= sign * maps[k, iv, iu]:
            a = F(1.0)
        if t >= sign * maps[k, iv, iu + 1]:
            b = F(1.0)
        if t >= sign * maps[k, iv + 1, iu]:
            c = F(1.0)
        if t >= sign * maps[k, iv + 1, iu + 1]:
            d = F(1.0)
        low = a + fu * (b - a)
        high = c + fu * (d - c)
        light = low + fv * (high - low)
    return light
