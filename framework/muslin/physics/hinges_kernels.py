"""Kernels of what `bending` and `hinge_weights` compute with columns of NumPy's: the same formulas, to the bit."""

from muslin.base.arrays import index4, integers, rows, scalars, vec3s, vec4s, vec5s
from muslin.base.engine import ti


@ti.kernel
def inner_edges(
    triangles: integers, row: integers, col: integers, numbers: integers, begin: integers, cells: index4,
    count: integers,
):  # fmt: skip
    """Pairs of vertices that two triangles share, sorted by their lower end and then by the higher one.

    Half-edges are numbered corner by corner, and an edge's first one is that of the lower number.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        k, found = 0, 0
        while k < row.shape[0]:
            at = begin[k]
            if row[k] < col[k] and begin[k + 1] == at + 2:
                e, f = numbers[at] // 9, numbers[at + 1] // 9
                c, d = _begins(numbers[at] % 9), _begins(numbers[at + 1] % 9)
                if c > d or (c == d and e > f):
                    e, f = f, e
                    c, d = d, c
                cells[found] = ti.Vector(
                    [
                        triangles[3 * e + c],
                        triangles[3 * e + (c + 1) % 3],
                        triangles[3 * e + (c + 2) % 3],
                        triangles[3 * f + (d + 2) % 3],
                    ]
                )
                found += 1
            k += 1
        count[0] = found


@ti.func
def _begins(pair):
    """Corner at which the half-edge of a pair of corners a and b, 3 a + b, begins."""
    a, b = pair // 3, pair % 3
    return ti.select((a + 1) % 3 == b, a, b)


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
def equations(
    average: float, x: vec3s, triangles: integers, ptr: integers, corners: integers, cells: index4, weight: scalars,
    mean: scalars, alpha: scalars, real: scalars, imag: scalars, edges: integers, doubled: vec3s, third: scalars,
    share: scalars, east: vec3s, north: vec3s, first: integers, high: integers, inner: integers, entries: rows,
):  # fmt: skip
    """What each hinge adds to the five equations of its two ends, the lower one first, (h, 10).

    For that, of each vertex: its `share` of the area, whether all its edges are hinges (`inner`), `east` and `north`;
    and the `first` hinge of which it is the lower end. Of each hinge: the higher end.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        e, v = 0, 0
        while e < cells.shape[0]:
            one, other = ti.min(cells[e][0], cells[e][1]), ti.max(cells[e][0], cells[e][1])
            while v <= one:
                first[v] = e
                v += 1
            edges[one], edges[other], high[e] = edges[one] + 1, edges[other] + 1, other
            e += 1
        while v < first.shape[0]:
            first[v] = e
            v += 1
    ti.loop_config(serialize=True)
    for e in range(third.shape[0]):
        a = x[triangles[3 * e]]
        twice = (x[triangles[3 * e + 1]] - a).cross(x[triangles[3 * e + 2]] - a)
        doubled[e], third[e] = twice, ti.sqrt(dot(twice, twice)) / 6
    ti.loop_config(serialize=True)
    for i in range(share.shape[0]):
        area, normal = 0.0, ti.Vector([0.0, 0.0, 0.0])
        r, last = ptr[i], ptr[i + 1]
        while r < last:
            e = corners[r] // 3
            area += third[e]
            normal += doubled[e]
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
            at = 5 * ti.cast(v != ti.min(cells[e][0], cells[e][1]), ti.i32)
            entries[e, at] = counts * (average * mean[e])
            entries[e, at + 1] = counts * (2 * alpha[e] * a)
            entries[e, at + 2] = counts * (2 * alpha[e] * b)
            entries[e, at + 3] = counts * ((a * a - b * b) / 2)
            entries[e, at + 4] = counts * (a * b)


@ti.kernel
def fit(
    steps: int, average: float, damp: float, least: float, first: integers, high: integers, entries: vec5s,
    inner: integers, left: vec5s, along: vec5s, scale: scalars, down: scalars, direction: scalars, y: scalars,
):  # fmt: skip
    """The conjugate gradients of `hinge_weights.quickly`: hinges in the order of their lower ends."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        n, h, v, total = left.shape[0], high.shape[0], 0, 0.0
        nothing = ti.Vector([0.0, 0.0, 0.0, 0.0, 0.0])
        while v < n:
            left[v], along[v] = nothing, nothing
            v += 1
        v = 0
        while v < n:  # what is wanted, less what 1 everywhere makes of it
            e, last, here = first[v], first[v + 1], left[v]
            while e < last:
                a, b, j = entries[2 * e], entries[2 * e + 1], high[e]
                own = a.dot(a) + b.dot(b)
                total += own
                scale[e], y[e], direction[e] = own, 0.0, 0.0
                here += a
                left[j] = left[j] + b
                e += 1
            left[v] = ti.Vector([average * inner[v], 0.0, 0.0, 0.0, 0.0]) - here
            v += 1
        e = 0
        while e < h:
            scale[e] = 1 / ti.max(scale[e], least * (total / h))
            e += 1
        size, length, k = 0.0, 0.0, 0
        while k <= steps:
            before = size
            size, v = 0.0, 0
            while v < n:
                e, last, here = first[v], first[v + 1], left[v]
                while e < last:
                    there, there_y = left[high[e]], y[e] + length * direction[e]
                    g = entries[2 * e].dot(here) + entries[2 * e + 1].dot(there) - damp * there_y
                    down[e], y[e] = g, there_y
                    size += g * (scale[e] * g)
                    e += 1
                v += 1
            if k == steps or not size > 0.0:
                k = steps
            else:
                ratio, short, long = 0.0, 0.0, 0.0
                if k > 0:
                    ratio = size / before
                v = 0
                while v < n:
                    e, last, here = first[v], first[v + 1], along[v]
                    while e < last:
                        d, j = scale[e] * down[e] + ratio * direction[e], high[e]
                        direction[e] = d
                        short += d * d
                        here += entries[2 * e] * d
                        along[j] = along[j] + entries[2 * e + 1] * d
                        e += 1
                    along[v] = here
                    v += 1
                v = 0
                while v < n:
                    long += along[v].dot(along[v])
                    v += 1
                length = size / (long + damp * short)
                v = 0
                while v < n:
                    left[v] = left[v] - length * along[v]
                    along[v] = nothing
                    v += 1
            k += 1
