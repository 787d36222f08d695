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
        lo = ti.Vector([1e9, 1e9])
        hi = ti.Vector([-1e9, -1e9])
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
                a0, b0, c0 = edges[m, 0], edges[m, 1], edges[m, 2]
                a1, b1, c1 = edges[m, 3], edges[m, 4], edges[m, 5]
                a2, b2, c2 = edges[m, 6], edges[m, 7], edges[m, 8]
                for row in range(first, last):
                    for column in range(box[m, 0], box[m, 1] + 1):
                        x, y = sample_place(row, column, jitter)
                        l0 = a0 * x + b0 * y + c0
                        l1 = a1 * x + b1 * y + c1
                        l2 = a2 * x + b2 * y + c2
                        if l0 >= 0 and l1 >= 0 and l2 >= 0:
                            w = ti.cast(l0 + l1 + l2, ti.f32)
                            if w > depth[row, column] and w * near <= 1:
                                depth[row, column] = w
                                seen[row, column] = m


@ti.kernel
def depth_maps(points: F2, triangles: I2, frames: F2, far_side: ti.i32, bands: ti.i32, maps: F3):
    """Orthographic depth maps: the height of the first surface met by parallel light.

    frames (k, 12): rows u, v (in texels) and height towards the light, each three numbers and an offset;
    maps (k, r, r) the greatest height over each texel, or with `far_side` maps (2k, r, r), where map k + i is
    the least height over each texel of map i: what the opposite light meets first.
    """
    res = maps.shape[1]
    count = frames.shape[0]
    ti.loop_config(block_dim=1)
    for task in range(count * bands):
        k = task // bands
        band = task % bands
        top = band * res // bands
        bottom = (band + 1) * res // bands
        for y in range(top, bottom):
            for x in range(res):
                maps[k, y, x] = F(-1e30)
                if far_side != 0:
                    maps[count + k, y, x] = F(1e30)
        for m in range(triangles.shape[0]):
            p = ti.Matrix.zero(ti.f32, 3, 3)
            for i in range(3):
                q = triangles[m, i]
                for r in ti.static(range(3)):
                    p[i, r] = (
                        frames[k, 4 * r] * points[q, 0]
                        + frames[k, 4 * r + 1] * points[q, 1]
                        + frames[k, 4 * r + 2] * points[q, 2]
                        + frames[k, 4 * r + 3]
                    )
            half = F(0.5)
            v_low = ti.min(p[0, 1], p[1, 1], p[2, 1]) - half
            v_high = ti.max(p[0, 1], p[1, 1], p[2, 1]) - half
            first = ti.max(ti.cast(ti.ceil(v_low), ti.i32), top)
            last = ti.min(ti.cast(ti.floor(v_high), ti.i32) + 1, bottom)
            if first < last:
                u_low = ti.min(p[0, 0], p[1, 0], p[2, 0]) - half
                u_high = ti.max(p[0, 0], p[1, 0], p[2, 0]) - half
                left = ti.max(ti.cast(ti.ceil(u_low), ti.i32), 0)
                right = ti.min(ti.cast(ti.floor(u_high), ti.i32) + 1, res)
                e1u, e1v, e1h = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
                e2u, e2v, e2h = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
                area = e1u * e2v - e1v * e2u
                if left < right and ti.abs(area) > F(1e-6):
                    scale = 1 / area
                    slack = F(-1e-4)  # no gaps between neighbours
                    for y in range(first, last):
                        dv = y + half - p[0, 1]
                        for x in range(left, right):
                            du = x + half - p[0, 0]
                            s = (du * e2v - dv * e2u) * scale
                            t = (dv * e1u - du * e1v) * scale
                            if s >= slack and t >= slack and s + t <= 1 - slack:
                                h = p[0, 2] + s * e1h + t * e2h
                                maps[k, y, x] = ti.max(maps[k, y, x], h)
                                if far_side != 0:
                                    maps[count + k, y, x] = ti.min(maps[count + k, y, x], h)


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
    iu = ti.cast(ti.floor(u), ti.i32)
    iv = ti.cast(ti.floor(v), ti.i32)
    if iu >= 0 and iv >= 0 and iu < res - 1 and iv < res - 1:
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
