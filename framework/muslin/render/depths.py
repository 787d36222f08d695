"""How far light gets: the heights of what parallel light and the sky meet first.

A parallel task owns a band of a map's rows and walks through the triangles in order, without atomics (see `raster`).
"""

from muslin.base.engine import ti
from muslin.render.raster import F1, F2, I2, F, greater, lesser


@ti.kernel
def depth_maps(
    points: F2, triangles: I2, frames: F2, far_side: ti.i32, res: ti.i32, bands: ti.i32, scratch: F1, maps: F1
):
    """Orthographic depth maps: the height of the first surface met by parallel light.

    frames (k, 12): rows u, v (in texels) and height towards the light, each three numbers and an offset;
    scratch (k bands n 3) for the points in those axes; maps (k res res) the greatest height over each texel,
    or with `far_side` maps (2k res res), where map k + i is the least height over each texel of map i: what
    the opposite light meets first.
    """
    count = frames.shape[0]
    half, up = F(0.5), F(0.9999)
    far = count * res * res
    ti.loop_config(block_dim=1)
    for task in range(count * bands):
        k = task // bands
        band = task % bands
        top = band * res // bands
        bottom = (band + 1) * res // bands
        base = 3 * task * points.shape[0]
        for q in range(points.shape[0]):
            x, y, z = points[q, 0], points[q, 1], points[q, 2]
            for r in ti.static(range(3)):
                scratch[base + 3 * q + r] = (
                    frames[k, 4 * r] * x
                    + frames[k, 4 * r + 1] * y
                    + frames[k, 4 * r + 2] * z
                    + frames[k, 4 * r + 3]
                )
        for i in range((k * res + top) * res, (k * res + bottom) * res):
            maps[i] = F(-1e30)
            if far_side != 0:
                maps[far + i] = F(1e30)
        for m in range(triangles.shape[0]):
            i0, i1, i2 = base + 3 * triangles[m, 0], base + 3 * triangles[m, 1], base + 3 * triangles[m, 2]
            u0, v0, h0 = scratch[i0] - half, scratch[i0 + 1] - half, scratch[i0 + 2]
            u1, v1 = scratch[i1] - half, scratch[i1 + 1] - half
            u2, v2 = scratch[i2] - half, scratch[i2 + 1] - half
            # The maps have a margin around all points: coordinates are positive, so casts round down.
            first = ti.max(ti.cast(lesser(lesser(v0, v1), v2) + up, ti.i32), top)
            last = ti.min(ti.cast(greater(greater(v0, v1), v2), ti.i32) + 1, bottom)
            left = ti.cast(lesser(lesser(u0, u1), u2) + up, ti.i32)
            right = ti.cast(greater(greater(u0, u1), u2), ti.i32) + 1
            area = (u1 - u0) * (v2 - v0) - (v1 - v0) * (u2 - u0)
            if first < last and left < right and ti.abs(area) > F(1e-6):
                # s and t are the barycentric coordinates of the second and third vertex, r of the first.
                scale = F(1.0) / area
                s_u, s_v = (v2 - v0) * scale, (u0 - u2) * scale
                t_u, t_v = (v0 - v1) * scale, (u1 - u0) * scale
                h1 = scratch[i1 + 2] - h0
                h2 = scratch[i2 + 2] - h0
                r_u, h_u = -s_u - t_u, s_u * h1 + t_u * h2
                for y in range(first, last):
                    dx, dy = left - u0, y - v0
                    s = dx * s_u + dy * s_v
                    t = dx * t_u + dy * t_v
                    r = 1 - s - t
                    h = h0 + s * h1 + t * h2
                    row = (k * res + y) * res
                    for i in range(row + left, row + right):
                        # No branches, for which texels lie inside is hard to guess; no gaps to neighbours.
                        inside = lesser(lesser(s, t), r) >= F(-1e-4)
                        maps[i] = greater(maps[i], ti.select(inside, h, F(-1e30)))
                        if far_side != 0:
                            maps[far + i] = lesser(maps[far + i], ti.select(inside, h, F(1e30)))
                        s += s_u
                        t += t_u
                        r += r_u
                        h += h_u


@ti.kernel
def roof_heights(points: F2, triangles: I2, frame: F2, roof: F2):
    """The greatest height of whatever reaches into each cell of a coarse map; frame (1, 12) as in `depth_maps`."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        for v in range(roof.shape[0]):
            for u in range(roof.shape[1]):
                roof[v, u] = F(-1e30)
        for m in range(triangles.shape[0]):
            lo = ti.Vector([F(1e30), F(1e30), F(1e30)])
            hi = -lo
            for i in range(3):
                q = triangles[m, i]
                for r in ti.static(range(3)):
                    at_r = (
                        frame[0, 4 * r] * points[q, 0]
                        + frame[0, 4 * r + 1] * points[q, 1]
                        + frame[0, 4 * r + 2] * points[q, 2]
                        + frame[0, 4 * r + 3]
                    )
                    lo[r] = lesser(lo[r], at_r)
                    hi[r] = greater(hi[r], at_r)
            for v in range(ti.cast(lo[1], ti.i32), ti.cast(hi[1], ti.i32) + 1):
                for u in range(ti.cast(lo[0], ti.i32), ti.cast(hi[0], ti.i32) + 1):
                    roof[v, u] = greater(roof[v, u], hi[2])


@ti.func
def reached(maps: ti.template(), frames: ti.template(), res, k, sign, i, p):
    """Share of the light of map k that reaches a point, from the four nearest texels: 0 in shadow, 1 lit.

    i: row of the map's axes in frames; sign: 1, or -1 for the opposite light (see `depth_maps`).
    """
    half = F(0.5)
    u = frames[i, 0] * p[0] + frames[i, 1] * p[1] + frames[i, 2] * p[2] + frames[i, 3] - half
    v = frames[i, 4] * p[0] + frames[i, 5] * p[1] + frames[i, 6] * p[2] + frames[i, 7] - half
    light = F(1.0)
    inside = F(res - 1)
    if u >= 0 and v >= 0 and u < inside and v < inside:
        h = sign * (frames[i, 8] * p[0] + frames[i, 9] * p[1] + frames[i, 10] * p[2] + frames[i, 11])
        iu, iv = ti.cast(u, ti.i32), ti.cast(v, ti.i32)
        fu, fv = u - iu, v - iv
        first = (k * res + iv) * res + iu
        a = ti.select(h >= sign * maps[first], 1 - fu, F(0.0))
        b = ti.select(h >= sign * maps[first + 1], fu, F(0.0))
        c = ti.select(h >= sign * maps[first + res], 1 - fu, F(0.0))
        d = ti.select(h >= sign * maps[first + res + 1], fu, F(0.0))
        low = a + b
        light = low + fv * (c + d - low)
    return light
