"""Kernels of what `bending` and `hinge_weights` compute with columns of NumPy's: the same formulas, to the bit."""

from muslin.base.arrays import index4, integers, rows, scalars, vec3s, vec4s, vec5s
from muslin.base.engine import ti


@ti.kernel
def inner_edges(
    triangles: integers, ptr: integers, corners: integers, end: integers, high: integers, number: integers,
    cells: index4, count: integers,
):  # fmt: skip
    """Edges of two triangles, sorted by their lower end and then by the higher one.

    Half-edges are numbered corner by corner, and an edge's first one is that of the lower number.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        n, m, j, found = ptr.shape[0] - 1, triangles.shape[0] // 3, 0, 0
        while j < n:
            end[j] = 2 * ptr[j]
            j += 1
        j = 0
        while j < n:
            r, last = ptr[j], ptr[j + 1]
            while r < last:
                e, c = corners[r] // 3, corners[r] % 3
                k = 0
                while k < 2:  # the half-edge that begins at j, and the one that ends there
                    begins = c if k == 0 else (c + 2) % 3
                    i = triangles[3 * e + (c + 1 + k) % 3]
                    if i < j:
                        at = end[i]
                        high[at], number[at] = j, begins * m + e
                        end[i] = at + 1
                    k += 1
                r += 1
            j += 1
        i = 0
        while i < n:
            at, last = 2 * ptr[i], end[i]
            while at < last:
                begin = at
                while at < last and high[at] == high[begin]:
                    at += 1
                if at == begin + 2:
                    one, two = number[begin], number[begin + 1]
                    if one > two:
                        one, two = two, one
                    e, c, f, d = one % m, one // m, two % m, two // m
                    cells[found] = ti.Vector(
                        [
                            triangles[3 * e + c],
                            triangles[3 * e + (c + 1) % 3],
                            triangles[3 * e + (c + 2) % 3],
                            triangles[3 * f + (d + 2) % 3],
                        ]
                    )
                    found += 1
            i += 1
        count[0] = found


@ti.func
def dot(a, b):
    """Scalar product, its terms in their order."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@ti.kernel
def geometry(
    x: vec3s, cells: index4, length: scalars, area: scalars, sine: scalars, cosine: scalars, cotangents: vec4s,
    alpha: scalars, real: scalars, imag: scalars,
):  # fmt: skip
    """Of each hinge; see `bending._geometry`."""
    ti.loop_config(serialize=True)
    for e in range(cells.shape[0]):
        v = cells[e]
        x0 = x[v[0]]
        along = x[v[1]] - x0
        L = ti.sqrt(dot(along, along))
        t = along / L
        to0, to1 = x[v[2]] - x0, x[v[3]] - x0
        n0, n1 = t.cross(to0), to1.cross(t)
        a0, a1, h0, h1 = dot(to0, t), dot(to1, t), ti.sqrt(dot(n0, n0)), ti.sqrt(dot(n1, n1))
        n0, n1 = n0 / h0, n1 / h1
        sine[e], cosine[e] = dot(n0.cross(n1), t), dot(n0, n1)
        c1, c2, c3 = a0 / h0 + a1 / h1, -L / h0, -L / h1
        cotangents[e] = ti.Vector([(L - a0) / h0 + (L - a1) / h1, c1, c2, c3])
        xx = (c1 * (L * L) + c2 * (a0 * a0) + c3 * (a1 * a1)) / 2
        yy = (c2 * (h0 * h0) + c3 * (h1 * h1)) / 2
        xy = c2 * a0 * h0 - c3 * a1 * h1
        length[e], area[e] = L, L * (h0 + h1) / 2
        alpha[e], real[e], imag[e] = (xx + yy) / 2, (xx - yy) / 2, xy / 2


@ti.kernel
def around(
    x: vec3s, triangles: integers, ptr: integers, corners: integers, cells: index4, edges: integers,
    share: scalars, inner: integers, east: vec3s, north: vec3s,
):  # fmt: skip
    """Of each vertex: its share of the area, whether all its edges are hinges, east and north."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        e = 0
        while e < cells.shape[0]:
            edges[cells[e][0]] = edges[cells[e][0]] + 1
            edges[cells[e][1]] = edges[cells[e][1]] + 1
            e += 1
    ti.loop_config(serialize=True)
    for i in range(share.shape[0]):
        area, normal = 0.0, ti.Vector([0.0, 0.0, 0.0])
        r, last = ptr[i], ptr[i + 1]
        while r < last:
            first = corners[r] // 3 * 3
            a = x[triangles[first]]
            doubled = (x[triangles[first + 1]] - a).cross(x[triangles[first + 2]] - a)
            area += ti.sqrt(dot(doubled, doubled)) / 6
            normal += doubled
            r += 1
        length = ti.sqrt(dot(normal, normal))
        share[i] = area
        inner[i] = edges[i] == ptr[i + 1] - ptr[i] and length > 1e-12 * area
        normal = normal / ti.max(length, 1e-300)
        second = ti.select(ti.abs(normal[0]) >= 0.7, 1.0, 0.0)
        d = ti.Vector([1.0 - second, second, 0.0])
        d = d - dot(d, normal) * normal
        d = d / ti.sqrt(dot(d, d))
        east[i], north[i] = d, normal.cross(d)


@ti.kernel
def equations(
    average: float, x: vec3s, cells: index4, share: scalars, inner: integers, east: vec3s, north: vec3s,
    weight: scalars, mean: scalars, alpha: scalars, real: scalars, imag: scalars, entries: rows,
):  # fmt: skip
    """What each hinge adds to the five equations of its two ends, (h, 10)."""
    ti.loop_config(serialize=True)
    for e in range(cells.shape[0]):
        edge = x[cells[e][1]] - x[cells[e][0]]
        for end in ti.static(range(2)):
            v = cells[e][end]
            right, up = dot(edge, east[v]), dot(edge, north[v])
            size = right * right + up * up
            c, s = (right * right - up * up) / size, 2 * right * up / size
            a, b = real[e] * c - imag[e] * s, real[e] * s + imag[e] * c
            counts = 0.0
            if inner[v]:
                counts = weight[e] * (0.5 / share[v])
            entries[e, 5 * end] = counts * (average * mean[e])
            entries[e, 5 * end + 1] = counts * (2 * alpha[e] * a)
            entries[e, 5 * end + 2] = counts * (2 * alpha[e] * b)
            entries[e, 5 * end + 3] = counts * ((a * a - b * b) / 2)
            entries[e, 5 * end + 4] = counts * (a * b)


@ti.func
def applied(cells: ti.template(), entries: ti.template(), y: ti.template(), out: ti.template()):
    """S y."""
    v = 0
    while v < out.shape[0]:
        out[v] = ti.Vector([0.0, 0.0, 0.0, 0.0, 0.0])
        v += 1
    e = 0
    while e < cells.shape[0]:
        i, j, f = cells[e][0], cells[e][1], y[e]
        out[i] = out[i] + entries[2 * e] * f
        out[j] = out[j] + entries[2 * e + 1] * f
        e += 1


@ti.kernel
def fit(
    steps: int, average: float, damp: float, least: float, cells: index4, entries: vec5s, inner: integers,
    left: vec5s, along: vec5s, scale: scalars, down: scalars, direction: scalars, y: scalars,
):  # fmt: skip
    """The conjugate gradients of `hinge_weights.quickly`."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        n, h, e, total = left.shape[0], cells.shape[0], 0, 0.0
        while e < h:
            scale[e] = entries[2 * e].dot(entries[2 * e]) + entries[2 * e + 1].dot(entries[2 * e + 1])
            y[e] = 1.0
            total += scale[e]
            e += 1
        applied(cells, entries, y, left)
        v = 0
        while v < n:
            left[v] = ti.Vector([average * inner[v], 0.0, 0.0, 0.0, 0.0]) - left[v]
            v += 1
        e = 0
        while e < h:
            scale[e] = 1 / ti.max(scale[e], least * (total / h))
            y[e], direction[e] = 0.0, 0.0
            e += 1
        size, k = 0.0, 0
        while k <= steps:
            before, e = size, 0
            size = 0.0
            while e < h:
                g = (
                    entries[2 * e].dot(left[cells[e][0]])
                    + entries[2 * e + 1].dot(left[cells[e][1]])
                    - damp * y[e]
                )
                down[e] = g
                size += g * (scale[e] * g)
                e += 1
            if k == steps or not size > 0.0:
                k = steps
            else:
                ratio = 0.0
                if k > 0:
                    ratio = size / before
                e, short = 0, 0.0
                while e < h:
                    d = scale[e] * down[e] + ratio * direction[e]
                    direction[e] = d
                    short += d * d
                    e += 1
                applied(cells, entries, direction, along)
                v, long = 0, 0.0
                while v < n:
                    long += along[v].dot(along[v])
                    v += 1
                length = size / (long + damp * short)
                v = 0
                while v < n:
                    left[v] = left[v] - length * along[v]
                    v += 1
                e = 0
                while e < h:
                    y[e] = y[e] + length * direction[e]
                    e += 1
            k += 1
