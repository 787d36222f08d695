"""The light: smooth normals, sky occlusion at the vertices, and the colour of every pixel.

The sky is a hemisphere of light, the floor a dimmer hemisphere below. Both are sampled at the vertices, from
each side of the surface apart, with one depth map per direction: cheap, and free of noise. The sun's shadow
is sampled per pixel, from several depth maps spread over the sun's disc, so its edge softens with distance.
"""

from muslin.render.colours import Vec3, patterned, strained, three, three_of
from muslin.render.depths import reached
from muslin.render.raster import D2, F1, F2, I1, I2, MIXED, U1, U3, F, sample_place, ti

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


@ti.kernel
def add_normals(triangles: I2, first: ti.i32, last: ti.i32, vertex: F2):
    """Add the unit normals of the triangles first..last, times their angle there, to their vertices' normals.

    As `mesh.vertex_normals`: by area instead, a grid's diagonals would show where light and shadow meet.
    """
    ti.loop_config(serialize=True)
    for m in range(first, last):
        i, j, k = triangles[m, 0], triangles[m, 1], triangles[m, 2]
        p0, p1, p2 = three_of(vertex, i, 0), three_of(vertex, j, 0), three_of(vertex, k, 0)
        n = (p1 - p0).cross(p2 - p0)
        length = ti.sqrt(n.dot(n))
        if length > 0:
            angles = Vec3(
                ti.atan2(length, (p1 - p0).dot(p2 - p0)),
                ti.atan2(length, (p2 - p1).dot(p0 - p1)),
                ti.atan2(length, (p0 - p2).dot(p1 - p2)),
            )
            for a in ti.static(range(3)):
                for c in ti.static(range(3)):
                    vertex[triangles[m, a], 3 + c] += angles[a] / length * n[c]


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
def unit(v):
    """The unit vector along v; `normalized()` would compute it in double precision."""
    return v * (F(1.0) / ti.sqrt(v.dot(v) + F(1e-30)))


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
def spot_at(b, m, vertex: ti.template(), triangles: ti.template(), facing: ti.template(), smooth):
    """Place, unit normal towards the eye, and whether the back is seen (0, 1) at b in triangle m."""
    i, j, k = triangles[m, 0], triangles[m, 1], triangles[m, 2]
    p0, p1, p2 = three_of(vertex, i, 0), three_of(vertex, j, 0), three_of(vertex, k, 0)
    p = b[0] * p0 + b[1] * p1 + b[2] * p2
    n = Vec3(0.0)
    if smooth > 0:
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
    return p, n, back


@ti.func
def rounded(b, m, p, flip, vertex: ti.template(), triangles: ti.template()) -> Vec3:
    """The point p of triangle m, out where the round surface would be that its vertices' normals tell of.

    Light that this surface gets, the flat triangle below it may turn away from: without this, large triangles
    stand in their own light near the border of light and shade, in stripes. flip: 1, or -1 to lift to the back.
    (J. Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II, 2021.)
    """
    result = p
    for c in ti.static(range(3)):
        corner = triangles[m, c]
        n = flip * unit(three_of(vertex, corner, NORMAL))
        below = ti.min((p - three_of(vertex, corner, POSITION)).dot(n), F(0.0))
        result -= b[c] * below * n
    return result


@ti.func
def corners_of(m, column, vertex: ti.template(), triangles: ti.template()) -> Vec3:
    """What a column of the vertex table says at the corners of triangle m."""
    return Vec3(
        vertex[triangles[m, 0], column], vertex[triangles[m, 1], column], vertex[triangles[m, 2], column]
    )


@ti.func
def sun_over(cosine, translucency):
    """Share of the sunlight that the seen side sends on, and on which side it arrives (1: the seen one, -1)."""
    share = cosine
    side = F(1.0)
    if cosine < 0:  # some shines through from the other
        side = F(-1.0)
        share = -translucency * cosine
    return share, side


@ti.func
def sun_seen(
    q, settings: ti.template(), frames: ti.template(), maps: ti.template(), res, roof: ti.template()
):
    """Share of the sun's disc that a point sees."""
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
    return sun


@ti.func
def light_around(
    m, b, back, vertex: ti.template(), triangles: ti.template(), settings: ti.template()
) -> Vec3:
    """Light of sky and floor on the seen side."""
    sky = F(0.0)
    floor = F(0.0)
    for c in ti.static(range(3)):
        corner = triangles[m, c]
        sky += b[c] * vertex[corner, SKY_FRONT + 2 * back]
        floor += b[c] * vertex[corner, FLOOR_FRONT + 2 * back]
    return sky * three(settings, SKY) + floor * three(settings, FLOOR)


@ti.func
def glossed(light, own, p, n, share, cosine, sun, around, sheen, rough, settings: ti.template()) -> Vec3:
    """The light of a matt surface with what sheen and gloss add to it."""
    result = light
    to_eye = unit(three(settings, EYE) - p)
    sun_colour = three(settings, SUN)
    graze = 1 - ti.max(n.dot(to_eye), F(0.0))
    graze2 = graze * graze
    soft = sheen * graze2 * graze
    result += soft * (F(0.25) + F(0.75) * own) * (F(0.5) * share * sun * sun_colour + around)
    if rough < F(0.95):
        alpha = rough * rough
        power = F(2.0) / (alpha * alpha) - 2
        h = unit(to_eye + three(settings, TO_SUN))
        fresnel = F(0.04) + F(0.96) * graze2 * graze2 * graze
        shine = F(0.005) * (power + 8) * ti.pow(ti.max(n.dot(h), F(0.0)), power)
        result += ti.max(cosine, F(0.0)) * sun * shine * sun_colour
        result += fresnel * (1 - rough) * around * (F(0.6) + F(0.4) * n[1])
    return result


@ti.func
def wired(light, m, x, y, samples, edges: ti.template(), settings: ti.template()) -> Vec3:
    """The light with the triangle's edges drawn over it."""
    rim = F(1e9)  # distance to the nearest edge in pixels
    for c in range(3):
        across, along = edges[m, 3 * c], edges[m, 3 * c + 1]
        here = across * x + along * y + edges[m, 3 * c + 2]
        rim = ti.min(rim, F(here / (samples * ti.sqrt(across * across + along * along))))
    line = ti.math.clamp(settings[WIRE_WIDTH] + F(0.5) - rim, F(0.0), F(1.0)) * F(0.75)
    return light + line * (three(settings, WIRE_COLOUR) - light)


@ti.func
def alike(place, row, column, samples, jitter, all_see, sample_seen: ti.template(), first):
    """Triangle that a sample of a pixel sees, how many of the samples do, and the middle of them.

    The count is not positive where a sample before this one has spoken for it.
    """
    total = samples * samples
    m, count = all_see, total
    x, y = samples * (column + 0.5), samples * (row + 0.5)
    if m == MIXED:
        m = sample_seen[first + place]
        count, x, y = 0, 0.0, 0.0
        for r in range(total):
            if sample_seen[first + r] == m:
                if r < place:
                    count = -total
                a, b = sample_place(row * samples + r // samples, column * samples + r % samples, jitter)
                x += a
                y += b
                count += 1
        x /= count
        y /= count
    return m, count, x, y


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
                m, count, x, y = alike(
                    place, row, column, samples, jitter, seen[pixel], sample_seen, pixel * total
                )
                if count > 0:
                    colour = behind
                    if m >= 0:
                        b = barycentric(edges, m, x, y)
                        which = triangles[m, 3]
                        p, n, back = spot_at(b, m, vertex, triangles, facing, surfaces[which, SMOOTH])
                        value = b.dot(corners_of(m, VALUE, vertex, triangles))
                        own = three_of(surfaces, which, FRONT + 3 * back)
                        kind = ti.cast(surfaces[which, KIND], ti.i32)
                        if kind == 3:
                            own = strained(value, surfaces[which, LO], surfaces[which, HI], strain)
                        elif kind > 0:
                            own = patterned(
                                own, three_of(surfaces, which, SECOND + 3 * back), kind == 2, surfaces[which, SCALE],
                                b, barycentric(edges, m, x + samples, y), barycentric(edges, m, x, y + samples),
                                corners_of(m, UV, vertex, triangles), corners_of(m, UV + 1, vertex, triangles),
                            )  # fmt: skip
                        cosine = n.dot(three(settings, TO_SUN))
                        share, side = sun_over(cosine, surfaces[which, TRANSLUCENCY])
                        sun = F(0.0)
                        if share > 0:
                            # Step off the surface just as far as the depth maps' texels make it uncertain.
                            off = settings[OFFSET] * ti.sqrt(ti.max(F(0.02), 1 - cosine * cosine))
                            start = p + side * off * n
                            if surfaces[which, SMOOTH] > 0:
                                start += rounded(b, m, p, side * (1 - 2 * back), vertex, triangles) - p
                            sun = sun_seen(start, settings, frames, maps, res, roof)
                        around = light_around(m, b, back, vertex, triangles, settings)
                        colour = own * (share * sun * three(settings, SUN) + around)
                        sheen, rough = surfaces[which, SHEEN], surfaces[which, ROUGHNESS]
                        if sheen > 0 or rough < F(0.95):
                            colour = glossed(
                                colour, own, p, n, share, cosine, sun, around, sheen, rough, settings
                            )
                        if surfaces[which, WIRE] > 0:
                            colour = wired(colour, m, x, y, samples, edges, settings)
                        if surfaces[which, FADE] > 0:
                            colour = behind + value * (colour - behind)
                    light += count * colour
                place += 1
                if count == total:
                    place = total
            for c in ti.static(range(3)):
                mean = ti.math.clamp(light[c] * scale, F(0.0), top)
                picture[row, column, c] = encode[ti.cast(mean + F(0.5), ti.i32)]
