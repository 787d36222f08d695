"""How much each hinge of a sheet counts, so that it resists being bent alike in all directions (see `bending`).

The jump of a bent sheet's slope across an edge says one number about its curvature, a symmetric 2x2 matrix; hinges in
three directions say all three. What a hinge stores is a sum of the harmonics 0, 2 and 4 of the direction phi in which
the sheet is bent. Around each inner vertex the second and the fourth should vanish and the first be the vertex's share
of the area. Where all triangles are equilateral w = 1/(A_0 + A_1) does that; elsewhere w is the nearest to it that does
it best: least squares over the whole sheet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.base import runtime
from muslin.base.launch import once

if TYPE_CHECKING:
    import scipy.sparse as sp

    from muslin.physics.elements.layout import Incidence

#: How much more the zeroth harmonic counts than the others; how much it counts that a weight stays near 1/(A_0 + A_1);
#: and the least part of that which it may become.
AVERAGE, NEARNESS, LEAST = 5.0, 0.01, 0.05

#: Of the quick way to the weights: its steps, and the part of the mean that a hinge's own share counts at least there.
QUICK_STEPS, QUICK_LEAST = 8, 0.3


def weights(
    X: np.ndarray,
    triangles: np.ndarray,
    incidence: Incidence,
    cells: np.ndarray,
    area: np.ndarray,
    alpha: np.ndarray,
    real: np.ndarray,
    imag: np.ndarray,
    quick: bool = False,
) -> np.ndarray:
    """What each hinge counts, by least squares (see the top of this file), (h,) [1/m^2].

    Parameters
    ----------
    X : (n, 3)
        Undeformed vertices [m].
    triangles, cells : (m, 3), (h, 4)
    incidence
        Of the triangles.
    area : (h,)
        Of both triangles [m^2].
    alpha, real, imag : (h,)
        alpha and Z, as `bending` has them.
    quick : bool
        Whether to find them `quickly`.
    """
    import scipy.sparse as sp
    import scipy.sparse.linalg as sla

    if not len(cells):
        return np.zeros(0)
    mean = alpha**2 + (real**2 + imag**2) / 2
    weight = (area / 3).sum() / (mean / area).sum() / area
    n, h = len(X), len(cells)
    entries, inner, ends = _equations(X, triangles, incidence, cells, weight, mean, alpha, real, imag)
    if quick and runtime.plain():
        change, (left, along) = np.empty(h), np.empty((2, n, 5))
        room = left, along, *np.empty((3, h)), change
        launched(
            "fit", QUICK_STEPS, AVERAGE, NEARNESS**2, QUICK_LEAST, *ends, entries.reshape(-1, 5), inner, *room
        )
    else:
        rows = (5 * np.sort(cells[:, :2], axis=1))[:, :, None] + np.arange(5, dtype=np.int32)
        wanted = np.zeros(5 * n)
        wanted[::5] = AVERAGE * inner
        system = sp.csc_matrix((entries.ravel(), rows.ravel(), 10 * np.arange(h + 1)), shape=(5 * n, h))
        off = wanted - system @ np.ones(h)
        change = (
            quickly(system, off)
            if quick
            else sla.lsmr(system.tocsr(), off, damp=NEARNESS, atol=1e-6, btol=1e-6, maxiter=120)[0]
        )
    fitted, kept = weight * (1 + change), weight * np.maximum(1 + change, LEAST)
    return np.asarray(kept * (fitted @ mean) / (kept @ mean))


def _equations(
    X: np.ndarray,
    triangles: np.ndarray,
    incidence: Incidence,
    cells: np.ndarray,
    weight: np.ndarray,
    mean: np.ndarray,
    alpha: np.ndarray,
    real: np.ndarray,
    imag: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
    """What each hinge adds to the five equations of its two ends, the lower one first, (h, 10); which vertices have
    them, (n,); and, if kernels found it, the first hinge of each lower end, (n + 1,), and the higher ends, (h,).
    """
    n, h = len(X), len(cells)
    if runtime.plain():
        flat, corners, ptr = np.ravel(triangles), incidence.corners, incidence.ptr
        edges, inner, entries = np.zeros(n, np.int32), np.empty(n, np.int32), np.empty((h, 10))
        room = (
            edges,
            np.empty((len(triangles), 3)),
            np.empty(len(triangles)),
            np.empty(n),
            *np.empty((2, n, 3)),
        )
        ends = np.empty(n + 1, dtype=np.int32), np.empty(h, dtype=np.int32)
        parts = (weight, mean, alpha, real, imag)
        launched("equations", AVERAGE, X, flat, ptr, corners, cells, *parts, *room, *ends, inner, entries)
        return entries, inner, ends
    x = np.ascontiguousarray(X.T)
    share, inner, east, north = _around(x, triangles, cells)
    edge = x[:, cells[:, 1]] - x[:, cells[:, 0]]
    found = np.empty((h, 2, 5))
    for end, v in enumerate(np.sort(cells[:, :2], axis=1).T):
        right, up = (
            dot(edge, east[:, v]),
            dot(edge, north[:, v]),
        )  # where the edge points to around the vertex
        size = right**2 + up**2
        cosine, sine = (right**2 - up**2) / size, 2 * right * up / size  # of twice its direction
        a, b = real * cosine - imag * sine, real * sine + imag * cosine
        counts = weight * np.where(inner[v], 0.5 / share[v], 0.0)
        parts = AVERAGE * mean, 2 * alpha * a, 2 * alpha * b, (a**2 - b**2) / 2, a * b
        for number, part in enumerate(parts):
            found[:, end, number] = counts * part
    return found.reshape(h, 10), inner, ()


def _around(x: np.ndarray, triangles: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, ...]:
    """Of vertices (3, n): their share of the area, whether all their edges are hinges, east and north, (3, n) both."""
    n, corners = x.shape[1], triangles.ravel()
    a, b, c = (x[:, corner] for corner in triangles.T)
    doubled = cross(b - a, c - a)
    share = np.bincount(corners, np.repeat(np.sqrt(dot(doubled, doubled)) / 6, 3), n)
    normal: np.ndarray = np.stack([np.bincount(corners, np.repeat(part, 3), n) for part in doubled])
    inner = np.bincount(cells[:, :2].ravel(), minlength=n) == np.bincount(corners, minlength=n)
    length = np.sqrt(dot(normal, normal))
    inner &= length > 1e-12 * share
    normal /= np.maximum(length, 1e-300)
    steep = np.abs(normal[0]) >= 0.7
    east: np.ndarray = np.stack([~steep, steep, np.zeros(n)]).astype(float)
    east -= dot(east, normal) * normal
    east /= np.sqrt(dot(east, east))
    return share, inner, east, cross(normal, east)


def quickly(system: sp.csc_matrix, off: np.ndarray) -> np.ndarray:
    """A y (h,) that nearly minimises |S y - off|^2 + NEARNESS^2 |y|^2, by a few conjugate gradients.

    Each hinge is scaled by what it counts itself (Jacobi), but for those that hardly count, which would run away. So
    scaled, 20 steps leave as much over as 120 of LSMR on refined meshes: 0.133 of `wanted` and 0.131, where the
    least is 0.127 and no step leaves 1. They depend on the mesh alone, to the bit, whatever was done to it before.
    """
    damp = NEARNESS**2
    own = np.add.reduceat(system.data**2, system.indptr[:-1])
    scale = 1 / np.maximum(own, QUICK_LEAST * own.mean())
    transposed = system.T  # CSR, without a copy
    y, left = np.zeros(len(own)), off.copy()
    down = transposed @ left
    step = direction = scale * down
    size = _sum(down, step)
    for _ in range(QUICK_STEPS):
        if not size > 0:
            break
        along = system @ direction
        length = size / (_sum(along, along) + damp * _sum(direction, direction))
        y = y + length * direction
        left -= length * along
        down = transposed @ left - damp * y
        step = scale * down
        size, before = _sum(down, step), size
        direction = step + size / before * direction
    return y


def _sum(a: np.ndarray, b: np.ndarray) -> float:
    """a^T b with the same bits on any number of threads, which BLAS does not promise."""
    return float(np.einsum("i,i", a, b))


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products of columns, (3, k) both."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of columns, (3, k) both."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def launched(kernel: str, *arguments: Any) -> None:
    """Run one of the kernels that do in one pass what columns do in many, where kernels compute in doubles."""
    runtime.start()
    from muslin.physics import hinges_kernels

    once(getattr(hinges_kernels, kernel), *arguments)
