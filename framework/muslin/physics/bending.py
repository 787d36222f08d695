"""Bending: what a sheet's hinges are, and how much each of them counts.

A hinge is an inner edge with its two triangles. Two models say what its energy is (see `elements.bending`); both are
sums over hinges of k/2 w |e|^2 theta^2 for small angles theta, k being the sheet's flexural rigidity [N m]. What is
found here is w: such that a sheet bent to a cylinder of radius r stores k/2 A / r^2, in whatever direction it is bent.

The jump of a bent sheet's slope across an edge says one number about its curvature, a symmetric 2x2 matrix; hinges in
three directions say all three. For curvature dd^T (a cylinder around an axis across d = (cos phi, sin phi)) a hinge's
|e| theta is alpha + Re(Z exp(-2 i phi)), and what it stores is a sum of the harmonics 0, 2 and 4 of phi. Around each
inner vertex the second and the fourth should vanish and the first be the vertex's share of the area. Where all
triangles are equilateral w = 1/(A_0 + A_1) does that; elsewhere w is the nearest to it that does it best.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from muslin.base.errors import MuslinError, choices

if TYPE_CHECKING:
    import scipy.sparse as sp

#: What a sheet may do against being bent: nothing; the model of Bergou et al. 2006; that of Grinspun et al. 2003.
MODELS = ("off", "quadratic", "shells")

#: How much more the zeroth harmonic counts than the others; how much it counts that a weight stays near 1/(A_0 + A_1);
#: and the least part of that which it may become.
AVERAGE, NEARNESS, LEAST = 5.0, 0.01, 0.05

#: Of the quick way to the weights: its steps, and the part of the mean that a hinge's own share counts at least there.
QUICK_STEPS, QUICK_LEAST = 8, 0.3


@dataclass(frozen=True)
class Hinges:
    """Inner edges with their two triangles, undeformed.

    Attributes
    ----------
    cells : (h, 4) int32
        The two ends of each edge, and the vertices across it in its two triangles.
    length : (h,)
        Of the edges [m].
    area : (h,)
        Of both triangles [m^2].
    angle : (h,)
        Between the two normals, as `elements.bending_kernels.angle` has it.
    cotangents : (h, 4)
        What the corners' positions count in |e| (m_0 + m_1), m being the unit vectors across the edge into each
        triangle: zero for a flat sheet, 2 |e| sin(theta/2) long for a bent one.
    weight : (h,)
        w [1/m^2]; see above.
    """

    cells: np.ndarray
    length: np.ndarray
    area: np.ndarray
    angle: np.ndarray
    cotangents: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, X: np.ndarray, triangles: np.ndarray, quick: bool = False) -> Hinges:
        """Hinges of an undeformed mesh: X (n, 3) [m], triangles (m, 3).

        With `quick` their weights fit as well, and are found in a fifth of the time (see `_quickly`).
        """
        cells = inner_edges(triangles)
        x0, x1, x2, x3 = (X[cells[:, k]] for k in range(4))
        length = np.linalg.norm(x1 - x0, axis=1)
        t = (x1 - x0) / length[:, None]
        along, across, normals = [], [], []
        for opposite, sign in ((x2, 1.0), (x3, -1.0)):
            to = opposite - x0
            along.append(np.einsum("ij,ij->i", to, t))
            n = sign * np.cross(t, to)
            across.append(np.linalg.norm(n, axis=1))
            normals.append(n / across[-1][:, None])
        sine = np.einsum("ij,ij->i", np.cross(normals[0], normals[1]), t)
        angle = np.arctan2(sine, np.einsum("ij,ij->i", *normals))
        (a0, a1), (h0, h1) = along, across
        cotangents = np.stack(
            [(length - a0) / h0 + (length - a1) / h1, a0 / h0 + a1 / h1, -length / h0, -length / h1], axis=1
        )
        zero = np.zeros_like(length)
        flat = np.stack([zero, length, a0, a1], axis=1), np.stack([zero, zero, h0, -h1], axis=1)
        area = length * (h0 + h1) / 2
        weight = _weights(X, triangles, cells, area, _slopes(cotangents, *flat), quick)
        return cls(cells, length, area, angle, cotangents, weight)


def inner_edges(triangles: np.ndarray) -> np.ndarray:
    """Edges of two triangles, (h, 4) int32: its two ends, and the vertices across it in its first and second triangle.

    The first triangle has the edge's direction. Edges of one triangle, or of more than two, are no hinges.
    """
    start, end, across = (np.roll(triangles, -k, axis=1).T.ravel().astype(np.int64) for k in range(3))
    keys = np.minimum(start, end) * (int(triangles.max(initial=0)) + 1) + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    begins = np.flatnonzero(np.diff(keys[order], prepend=-1))
    pairs = begins[np.diff(begins, append=len(keys)) == 2]
    one, two = order[pairs], order[pairs + 1]
    return np.stack([start[one], end[one], across[one], across[two]], axis=1).astype(np.int32)


def _slopes(cotangents: np.ndarray, px: np.ndarray, py: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(alpha, Z) of each hinge, laid flat with its corners at (px, py) and its edge along x."""
    xx, yy = ((cotangents * p**2).sum(axis=1) / 2 for p in (px, py))
    xy = (cotangents * px * py).sum(axis=1)
    return (xx + yy) / 2, (xx - yy + 1j * xy) / 2


def _weights(
    X: np.ndarray,
    triangles: np.ndarray,
    cells: np.ndarray,
    area: np.ndarray,
    slopes: tuple[np.ndarray, np.ndarray],
    quick: bool = False,
) -> np.ndarray:
    """What each hinge counts, by least squares (see the top of this file)."""
    import scipy.sparse as sp
    import scipy.sparse.linalg as sla

    if not len(cells):
        return np.zeros(0)
    alpha, Z = slopes
    mean = alpha**2 + np.abs(Z) ** 2 / 2
    weight = (area / 3).sum() / (mean / area).sum() / area
    n, h = len(X), len(cells)
    doubled = np.cross(X[triangles[:, 1]] - X[triangles[:, 0]], X[triangles[:, 2]] - X[triangles[:, 0]])
    corner = triangles.ravel()
    share = np.bincount(corner, np.repeat(np.linalg.norm(doubled, axis=1) / 6, 3), n)
    normal: np.ndarray = np.stack([np.bincount(corner, np.repeat(part, 3), n) for part in doubled.T], axis=1)
    inner = np.bincount(cells[:, :2].ravel(), minlength=n) == np.bincount(triangles.ravel(), minlength=n)
    length = np.linalg.norm(normal, axis=1)
    inner &= length > 1e-12 * share
    normal /= np.maximum(length, 1e-300)[:, None]
    east = np.where(np.abs(normal[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    east = east - np.einsum("ij,ij->i", east, normal)[:, None] * normal
    north = np.cross(normal, east := east / np.linalg.norm(east, axis=1)[:, None])
    edge = X[cells[:, 1]] - X[cells[:, 0]]
    rows, entries = np.zeros((h, 2, 5), dtype=np.int32), np.zeros((h, 2, 5))
    for end in (0, 1):
        v = cells[:, end]
        up, right = np.einsum("ij,ij->i", edge, north[v]), np.einsum("ij,ij->i", edge, east[v])
        along = right + 1j * up  # where the edge points to around the vertex
        there = Z * (np.divide(along**2, right**2 + up**2) if quick else np.exp(2j * np.arctan2(up, right)))
        second, fourth = 2 * alpha * there, there**2 / 2
        counts = np.where(inner[v], weight, 0.0)
        over = np.where(inner[v], share[v], 1.0)
        rows[:, end] = 5 * v[:, None] + np.arange(5)
        for number, part in enumerate((mean, second.real, second.imag, fourth.real, fourth.imag)):
            entries[:, end, number] = (AVERAGE if number == 0 else 1) * counts * part / 2 / over
    wanted = np.zeros(5 * n)
    wanted[::5] = AVERAGE * inner
    system = sp.csc_matrix((entries.ravel(), rows.ravel(), 10 * np.arange(h + 1)), shape=(5 * n, h))
    off = wanted - system @ np.ones(h)
    change = (
        _quickly(system, off)
        if quick
        else sla.lsmr(system.tocsr(), off, damp=NEARNESS, atol=1e-6, btol=1e-6, maxiter=120)[0]
    )
    fitted, kept = weight * (1 + change), weight * np.maximum(1 + change, LEAST)
    return np.asarray(kept * (fitted @ mean) / (kept @ mean))


def _quickly(system: sp.csc_matrix, off: np.ndarray) -> np.ndarray:
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
    size = _dot(down, step)
    for _ in range(QUICK_STEPS):
        if not size > 0:
            break
        along = system @ direction
        length = size / (_dot(along, along) + damp * _dot(direction, direction))
        y = y + length * direction
        left -= length * along
        down = transposed @ left - damp * y
        step = scale * down
        size, before = _dot(down, step), size
        direction = step + size / before * direction
    return y


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    """a^T b with the same bits on any number of threads, which BLAS does not promise."""
    return float(np.einsum("i,i", a, b))


def require_model(name: str, stiffness: float) -> None:
    """Refuse what is no model of bending, or no stiffness.

    Raises
    ------
    MuslinError
    """
    if name not in MODELS:
        raise MuslinError(f"bending = {name!r} is not understood.", choices(name, MODELS))
    if not (np.isfinite(stiffness) and stiffness >= 0):
        raise MuslinError(
            f"bending_stiffness = {stiffness} must not be negative.", "In N m: cotton has about 1e-5."
        )
