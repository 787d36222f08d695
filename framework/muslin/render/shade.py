"""The light: smooth normals, sky occlusion at the vertices, and the colour of every pixel.

The sky is a hemisphere of light, the floor a dimmer hemisphere below. Both are sampled at the vertices, from
each side of the surface apart, with one depth map per direction: cheap, and free of noise. The sun's shadow
is sampled per pixel, from several depth maps spread over the sun's disc, so its edge softens with distance.
"""

from muslin.render.raster import D2, F1, F2, I1, I2, MIXED, U1, U3, F, reached, sample_place, ti

# Columns of the vertex table.
POSITION, NORMAL, UV, VALUE, SKY_FRONT, FLOOR_FRONT, SKY_BACK, FLOOR_BACK = 0, 3, 6, 8, 9, 10, 11, 12
VERTEX_COLUMNS = 13

# Columns of the surface table: a material's row, then three flags.
KIND, FRONT, BACK, SECOND, SECOND_BACK = 0, 1, 4, 7, 10
SCALE, ROUGHNESS, SHEEN, TRANSLUCENCY, LO, HI = 13, 14, 15, 16, 17, 18
SMOOTH, FADE, WIRE = 20, 21, 22
SURFACE_COLUMNS = 23

# Entries of the table of settings.
EYE, TO_SUN, SUN, SKY, FLOOR, TOP, BOTTOM, WIRE_COLOUR = 0, 3, 6, 9, 12, 15, 18, 21
OFFSET, WIRE_WIDTH, WHITEST, ROOF, LOWEST = 24, 25, 26, 27, 39
SETTINGS = 40

Vec3 = ti.types.vector(3, ti.f32)


@ti.kernel
def add_normals(triangles: I2, first: ti.i32, last: ti.i32, vertex: F2):
    """Add the area vectors of the triangles first..last to their vertices' normals."""
    ti.loop_config(serialize=True)
    for m in range(first, last):
        i, j, k = triangles[m, 0], triangles[m, 1], triangles[m, 2]
        e = Vec3(0.0)
        f = Vec3(0.0)
        for c in ti.static(range(3)):
            e[c] = vertex[j, c] - vertex[i, c]
            f[c] = vertex[k, c] - vertex[i, c]
        n = e.cross(f)
        for a in range(3):
            for c in ti.static(range(3)):
                vertex[triangles[m, a], 3 + c] += n[c]


@ti.kernel
def sides_seen(triangles: I2, facing: I1, box: I2, passes: ti.i32, side: I2):
    """Which sides of the vertices count in the picture, side[q, 0]: 1 the front, 2 the back, 3 both.

    A vertex counts on the sides from which its triangles in the picture are seen, or those of neighbours as
    many edges away as there are passes; side[q, 1]: scratch.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        for q in range(side.shape[0]):
            side[q, 0] = 0
            side[q, 1] = 0
        for m in range(triangles.shape[0]):
            if box[m, 0] <= box[m, 1] and box[m, 2] <= box[m, 3]:
                for c in range(3):
                    side[triangles[m, c], 0] |= ti.select(facing[m] < 0, 2, 1)
        for _pass in range(passes):
            for m in range(triangles.shape[0]):
                i, j, k = triangles[m, 0], triangles[m, 1], triangles[m, 2]
                around = side[i, 0] | side[j, 0] | side[k, 0]
                side[i, 1] |= around
                side[j, 1] |= around
                side[k, 1] |= around
            for q in range(side.shape[0]):
                side[q, 0] |= side[q, 1]


@ti.kernel
def sky_light(vertex: F2, side: I2, frames: F2, maps: F1, res: ti.i32, to_light: F2, offset: ti.f32):
    """How much of the sky and of the floor each side of each vertex sees, 1 for all of a hemisphere.

    side: the sides that count (see `sides_seen`); to_light (2k, 5): direction, then its shares of the sky and
    of the floor per cosine.
    """
    for q in range(vertex.shape[0]):
        here = Vec3(vertex[q, 0], vertex[q, 1], vertex[q, 2])
        n = Vec3(vertex[q, 3], vertex[q, 4], vertex[q, 5])
        for back in range(2):
            sky = F(0.0)
            floor = F(0.0)
            if side[q, 0] & (1 + back):
                p = here + offset * n
                for k in range(to_light.shape[0]):
                    cosine = n.dot(Vec3(to_light[k, 0], to_light[k, 1], to_light[k, 2]))
                    if cosine > 0:
                        opposite = k // frames.shape[0]
                        light = cosine * reached(
                            maps, frames, res, k, F(1 - 2 * opposite), k - opposite * frames.shape[0], p
                        )
                        sky += light * to_light[k, 3]
                        floor += light * to_light[k, 4]
            vertex[q, SKY_FRONT + 2 * back] = sky
            vertex[q, FLOOR_FRONT + 2 * back] = floor
            n = -n


@ti.kernel
def smooth_light(triangles: I2, passes: ti.i32, vertex: F2, sums: F2):
    """Average what the vertices see with their neighbours, to blur the shadow edges of single directions.

    sums (n, 5): scratch.
    """
    ti.loop_config(serialize=True)
    for _ in range(passes):
        for q in range(vertex.shape[0]):
            for c in ti.static(range(4)):
                sums[q, c] = vertex[q, SKY_FRONT + c]
            sums[q, 4] = F(1.0)
        for m in range(triangles.shape[0]):
            i, j, k = triangles[m, 0], triangles[m, 1], triangles[m, 2]
            for c in ti.static(range(4)):
                a, b, d = vertex[i, SKY_FRONT + c], vertex[j, SKY_FRONT + c], vertex[k, SKY_FRONT + c]
                sums[i, c] += b + d
                sums[j, c] += a + d
                sums[k, c] += a + b
            sums[i, 4] += 2
            sums[j, 4] += 2
            sums[k, 4] += 2
        for q in range(vertex.shape[0]):
            for c in ti.static(range(4)):
                vertex[q, SKY_FRONT + c] = sums[q, c] / sums[q, 4]


@ti.func
def three(table: ti.template(), first) -> Vec3:
    """Three numbers of a list."""
    return Vec3(table[first], table[first + 1], table[first + 2])


@ti.func
def three_of(table: ti.template(), row, first) -> Vec3:
    """Three numbers of a row."""
    return Vec3(table[row, first], table[row, first + 1], table[row, first + 2])


@ti.func
def unit(v):
    """The unit vector along v; `normalized()` would compute it in double precision."""
    return v * (F(1.0) / ti.sqrt(v.dot(v) + F(1e-30)))


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
def barycentric(edges: ti.template(), m, x, y) -> Vec3:
    """Perspective-correct barycentric coordinates in triangle m of the place (x, y)."""
    l0 = edges[m, 0] * x + edges[m, 1] * y + edges[m, 2]
    l1 = edges[m, 3] * x + edges[m, 4] * y + edges[m, 5]
    l2 = edges[m, 6] * x + edges[m, 7] * y + edges[m, 8]
    scale = 1.0 / (l0 + l1 + l2)
    return Vec3(F(l0 * scale), F(l1 * scale), F(l2 * scale))


@ti.func
def under_the_open_sky(q, settings: ti.template(), roof: ti.template()):
    """Whether nothing can possibly stand between a point and any part of the sun: one look, no depth map."""
    place = Vec3(0.0)
    for r in ti.static(range(3)):
        place[r] = three(settings, ROOF + 4 * r).dot(q) + settings[ROOF + 4 * r + 3]
    result = False
    if place[2] > settings[LOWEST]:
        result = True
        if place[0] >= 0 and place[1] >= 0:
            u, v = ti.cast(place[0], ti.i32), ti.cast(place[1], ti.i32)
            if u < roof.shape[1] and v < roof.shape[0]:
                result = place[2] > roof[v, u]
    return result


@ti.func
def colour_at(
    m, x, y, samples, behind, vertex: ti.template(), triangles: ti.template(), facing: ti.template(),
    edges: ti.template(), surfaces: ti.template(), settings: ti.template(), strain: ti.template(),
    frames: ti.template(), maps: ti.template(), res, roof: ti.template(),
) -> Vec3:  # fmt: skip
    """Linear light that leaves triangle m towards the eye at the place (x, y) of the picture."""
    i, j, k, which = triangles[m, 0], triangles[m, 1], triangles[m, 2], triangles[m, 3]
    b = barycentric(edges, m, x, y)
    p0, p1, p2 = three_of(vertex, i, 0), three_of(vertex, j, 0), three_of(vertex, k, 0)
    p = b[0] * p0 + b[1] * p1 + b[2] * p2
    n = Vec3(0.0)
    if surfaces[which, SMOOTH] > 0:
        n = (
            b[0] * three_of(vertex, i, NORMAL)
            + b[1] * three_of(vertex, j, NORMAL)
            + b[2] * three_of(vertex, k, NORMAL)
        )
    else:
        n = (p1 - p0).cross(p2 - p0)
    n = unit(n)
    back = 0
    if facing[m] < 0:
        back = 1
        n = -n
    value = b[0] * vertex[i, VALUE] + b[1] * vertex[j, VALUE] + b[2] * vertex[k, VALUE]
    # The surface's own colour.
    kind = ti.cast(surfaces[which, KIND], ti.i32)
    own = three_of(surfaces, which, FRONT + 3 * back)
    if kind == 3:
        lo, hi = surfaces[which, LO], surfaces[which, HI]
        t = F(0.5) + F(0.5) * (value - 1) / (hi - 1)
        if value < 1:
            t = F(0.5) * (value - lo) / (1 - lo)
        t = ti.math.clamp(t, F(0.0), F(1.0)) * (strain.shape[0] - 1)
        row = ti.min(ti.cast(t, ti.i32), strain.shape[0] - 2)
        own = three_of(strain, row, 0) + (t - row) * (three_of(strain, row + 1, 0) - three_of(strain, row, 0))
    elif kind > 0:
        second = three_of(surfaces, which, SECOND + 3 * back)
        scale = surfaces[which, SCALE]
        uv = ti.Vector([F(0.0), F(0.0)])
        uv_right = ti.Vector([F(0.0), F(0.0)])
        uv_down = ti.Vector([F(0.0), F(0.0)])
        b_right = barycentric(edges, m, x + samples, y)
        b_down = barycentric(edges, m, x, y + samples)
        for c in ti.static(range(2)):
            w = Vec3(vertex[i, UV + c], vertex[j, UV + c], vertex[k, UV + c]) / scale
            uv[c] = b.dot(w)
            uv_right[c] = b_right.dot(w) - uv[c]
            uv_down[c] = b_down.dot(w) - uv[c]
        wide = ti.max(ti.abs(uv_right), ti.abs(uv_down))
        if kind == 2:
            half = ti.max(wide, F(1e-3)) * F(0.5)
            s = (wave(uv[0] + half[0]) - wave(uv[0] - half[0])) / (2 * half[0])
            t = (wave(uv[1] + half[1]) - wave(uv[1] - half[1])) / (2 * half[1])
            own += (F(0.5) - F(0.5) * s * t) * (second - own)
        else:
            width = ti.sqrt(ti.max(uv_right.dot(uv_right), uv_down.dot(uv_down)))
            light, weft = woven(uv[0], uv[1], width)
            own = light * (own + weft * (second - own))
    # Sun: reflected on the lit side; some shines through from the other.
    to_sun = three(settings, TO_SUN)
    cosine = n.dot(to_sun)
    share = cosine
    out = F(1.0)
    if cosine < 0:
        out = F(-1.0)
        share = -surfaces[which, TRANSLUCENCY] * cosine
    sun = F(0.0)
    if share > 0:
        # Step off the surface just as far as the depth maps' texels make it uncertain.
        q = p + out * settings[OFFSET] * ti.sqrt(ti.max(F(0.02), 1 - cosine * cosine)) * n
        sun = F(1.0)
        if not under_the_open_sky(q, settings, roof):
            # The first few lie on the sun's rim: if they all agree, so will the rest.
            total = frames.shape[0]
            known = ti.min(total, 8)
            sun = F(0.0)
            s = 0
            while s < known:
                sun += reached(maps, frames, res, s, F(1.0), s, q)
                s += 1
                if s == 8 and sun > 0 and sun < 8:
                    known = total
            sun /= F(known)
    # Sky and floor, as seen from this side.
    sky = F(0.0)
    floor = F(0.0)
    for c in ti.static(range(3)):
        corner = triangles[m, c]
        sky += b[c] * vertex[corner, SKY_FRONT + 2 * back]
        floor += b[c] * vertex[corner, FLOOR_FRONT + 2 * back]
    sun_colour = three(settings, SUN)
    around = sky * three(settings, SKY) + floor * three(settings, FLOOR)
    light = own * (share * sun * sun_colour + around)
    sheen, rough = surfaces[which, SHEEN], surfaces[which, ROUGHNESS]
    if sheen > 0 or rough < F(0.95):
        to_eye = unit(three(settings, EYE) - p)
        graze = 1 - ti.max(n.dot(to_eye), F(0.0))
        graze2 = graze * graze
        soft = sheen * graze2 * graze
        light += soft * (F(0.25) + F(0.75) * own) * (F(0.5) * share * sun * sun_colour + around)
        if rough < F(0.95):
            alpha = rough * rough
            power = F(2.0) / (alpha * alpha) - 2
            h = unit(to_eye + to_sun)
            fresnel = F(0.04) + F(0.96) * graze2 * graze2 * graze
            shine = F(0.005) * (power + 8) * ti.pow(ti.max(n.dot(h), F(0.0)), power)
            light += ti.max(cosine, F(0.0)) * sun * shine * sun_colour
            light += fresnel * (1 - rough) * around * (F(0.6) + F(0.4) * n[1])
    if surfaces[which, WIRE] > 0:
        rim = F(1e9)  # distance to the nearest edge in pixels
        for c in range(3):
            across, along = edges[m, 3 * c], edges[m, 3 * c + 1]
            here = across * x + along * y + edges[m, 3 * c + 2]
            rim = ti.min(rim, F(here / (samples * ti.sqrt(across * across + along * along))))
        line = ti.math.clamp(settings[WIRE_WIDTH] + F(0.5) - rim, F(0.0), F(1.0)) * F(0.75)
        light += line * (three(settings, WIRE_COLOUR) - light)
    if surfaces[which, FADE] > 0:
        light = behind + value * (light - behind)
    return light


@ti.kernel
def shade(
    samples: ti.i32, jitter: ti.f64, seen: I1, sample_seen: I1, vertex: F2, triangles: I2, facing: I1,
    edges: D2, surfaces: F2, settings: F1, strain: F2, frames: F2, maps: F1, res: ti.i32, roof: F2,
    encode: U1, picture: U3,
):  # fmt: skip
    """The picture: each triangle that a pixel's samples see is shaded once, at the middle of its samples.

    encode: bytes of the picture for linear light from 0 to settings[WHITEST].
    """
    total = samples * samples
    top = F(encode.shape[0] - 1)
    scale = top / (F(total) * settings[WHITEST])
    ti.loop_config(block_dim=8)
    for row in range(picture.shape[0]):
        t = (row + F(0.5)) / F(picture.shape[0])
        behind = three(settings, TOP) + t * (three(settings, BOTTOM) - three(settings, TOP))
        for column in range(picture.shape[1]):
            pixel = row * picture.shape[1] + column
            light = Vec3(0.0)
            place = 0
            while place < total:
                m, count = seen[pixel], total
                x, y = samples * (column + 0.5), samples * (row + 0.5)
                if m == MIXED:
                    # The samples that see the same triangle as this one, unless one before it does.
                    m = sample_seen[pixel * total + place]
                    count, x, y = 0, 0.0, 0.0
                    for r in range(total):
                        if sample_seen[pixel * total + r] == m:
                            if r < place:
                                count = -total
                            a, b = sample_place(
                                row * samples + r // samples, column * samples + r % samples, jitter
                            )
                            x += a
                            y += b
                            count += 1
                    x /= count
                    y /= count
                if count > 0:
                    colour = behind
                    if m >= 0:
                        colour = colour_at(
                            m, x, y, samples, behind, vertex, triangles, facing, edges, surfaces, settings, strain,
                            frames, maps, res, roof,
                        )  # fmt: skip
                    light += count * colour
                place += 1
                if count == total:
                    place = total
            for c in ti.static(range(3)):
                mean = ti.math.clamp(light[c] * scale, F(0.0), top)
                picture[row, column, c] = encode[ti.cast(mean + F(0.5), ti.i32)]
