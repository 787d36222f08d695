"""The colour a surface has of its own at a place: strain map, checker, weave."""

from muslin.render.raster import F, ti

Vec3 = ti.types.vector(3, ti.f32)


@ti.func
def three(table: ti.template(), first) -> Vec3:
    """Three numbers of a list."""
    return Vec3(table[first], table[first + 1], table[first + 2])


@ti.func
def three_of(table: ti.template(), row, first) -> Vec3:
    """Three numbers of a row."""
    return Vec3(table[row, first], table[row, first + 1], table[row, first + 2])


@ti.func
def wave(x):
    """Integral of the square wave that is +1 on even and -1 on odd unit intervals."""
    r = x - 2 * ti.floor(x * F(0.5))
    return 1 - ti.abs(r - 1)


@ti.func
def random(i, j):
    """A number in [0, 1) that looks random and depends on two integers only."""
    h = ti.cast(i, ti.u32) * ti.u32(0x8DA6B343) ^ ti.cast(j, ti.u32) * ti.u32(0xD8163841)
    h = (h ^ (h >> 15)) * ti.u32(0x2C1B3C6D)
    h = (h ^ (h >> 12)) * ti.u32(0x297A2D39)
    h = h ^ (h >> 15)
    return ti.cast(h >> 8, ti.f32) * F(5.9604645e-08)


@ti.func
def uneven(x, seed):
    """Smooth noise in [-1, 1] along a line."""
    i = ti.cast(ti.floor(x), ti.i32)
    t = ti.cast(x - ti.floor(x), ti.f32)
    a = random(i, seed)
    b = random(i + 1, seed)
    return 2 * (a + (b - a) * t * t * (3 - 2 * t)) - 1


@ti.func
def woven(s, t, width):
    """Brightness of plain weave around 1, and the share of weft; s, t in yarns, width of a pixel in yarns.

    Whatever is finer than a pixel has faded out before it could alias.
    """
    i = ti.cast(ti.floor(s), ti.i32)
    j = ti.cast(ti.floor(t), ti.i32)
    across = s - i - F(0.5)
    along = t - j - F(0.5)
    weft = F((i + j) & 1)
    if weft > 0:
        across, along = along, across
    yarn = (1 - 4 * across * across) * (1 - F(1.6) * along * along) - F(0.58)
    keep = ti.math.clamp(F(1.5) - F(2.4) * width, F(0.0), F(1.0))
    # Handspun yarns: each a little lighter or darker, thicker places along it, bands of many yarns.
    slub = weft * uneven(s * F(0.11), j) + (1 - weft) * uneven(t * F(0.11), i + 7919)
    band = uneven(s * F(0.2), 11) + uneven(t * F(0.2), 12)
    wide = ti.math.clamp(F(1.5) - F(0.4) * width, F(0.0), F(1.0))
    light = 1 + keep * (F(0.26) * yarn + F(0.07) * slub) + F(0.022) * wide * band
    return light, F(0.5) + keep * (weft - F(0.5))


@ti.func
def strained(value, lo, hi, strain: ti.template()) -> Vec3:
    """Colour of a stretch on the strain map from lo to hi."""
    t = F(0.5) + F(0.5) * (value - 1) / (hi - 1)
    if value < 1:
        t = F(0.5) * (value - lo) / (1 - lo)
    t = ti.math.clamp(t, F(0.0), F(1.0)) * (strain.shape[0] - 1)
    row = ti.min(ti.cast(t, ti.i32), strain.shape[0] - 2)
    return three_of(strain, row, 0) + (t - row) * (three_of(strain, row + 1, 0) - three_of(strain, row, 0))


@ti.func
def checkered(own, second, uv, wide) -> Vec3:
    """Squares of two colours, averaged over a pixel that is `wide` in squares."""
    half = ti.max(wide, F(1e-3)) * F(0.5)
    s = (wave(uv[0] + half[0]) - wave(uv[0] - half[0])) / (2 * half[0])
    t = (wave(uv[1] + half[1]) - wave(uv[1] - half[1])) / (2 * half[1])
    return own + (F(0.5) - F(0.5) * s * t) * (second - own)


@ti.func
def patterned(own, second, checker, scale, b, b_right, b_down, u, v) -> Vec3:
    """A checker or a weave; b, b_right, b_down: here and a pixel further; u, v: pattern coordinates of the corners."""
    uv = ti.Vector([F(0.0), F(0.0)])
    uv_right = ti.Vector([F(0.0), F(0.0)])
    uv_down = ti.Vector([F(0.0), F(0.0)])
    for c in ti.static(range(2)):
        w = (u, v)[c] / scale
        uv[c] = b.dot(w)
        uv_right[c] = b_right.dot(w) - uv[c]
        uv_down[c] = b_down.dot(w) - uv[c]
    result = own
    if checker:
        result = checkered(own, second, uv, ti.max(ti.abs(uv_right), ti.abs(uv_down)))
    else:
        width = ti.sqrt(ti.max(uv_right.dot(uv_right), uv_down.dot(uv_down)))
        light, weft = woven(uv[0], uv[1], width)
        result = light * (own + weft * (second - own))
    return result
