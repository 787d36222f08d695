"""Bending: what a sheet's hinges are, and how much each of them counts.

A hinge is an inner edge with its two triangles. Two models say what its energy is (see `elements.bending`); both are
sums over hinges of k/2 w |e|^2 theta^2 for small angles theta, k being the sheet's flexural rigidity [N m]. What is
found here is w: such that a sheet bent to a cylinder of radius r stores k/2 A / r^2, in whatever direction it is bent.

What that takes is in `hinge_weights`; for curvature dd^T (a cylinder around an axis across d = (cos phi, sin phi)) a
hinge's |e| theta is alpha + Re(Z exp(-2 i phi)), with alpha and Z found here.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from muslin.base import handed, runtime
from muslin.base.errors import MuslinError, choices
from muslin.physics.hinge_weights import cross, dot, launched, weights

if TYPE_CHECKING:
    from muslin.physics.elements.layout import Incidence

#: What a sheet may do against being bent: nothing; the model of Bergou et al. 2006; that of Grinspun et al. 2003.
MODELS = ("off", "quadratic", "shells")


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
    sine, cosine : (h,)
        Of the angle between the two normals, as `elements.bending_kernels.angle` has it.
    cotangents : (h, 4)
        What the corners' positions count in |e| (m_0 + m_1), m being the unit vectors across the edge into each
        triangle: zero for a flat sheet, 2 |e| sin(theta/2) long for a bent one.
    weight : (h,)
        w [1/m^2]; see above.
    """

    cells: np.ndarray
    length: np.ndarray
    area: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray
    cotangents: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(
        cls, X: np.ndarray, triangles: np.ndarray, quick: bool = False, incidence: Incidence | None = None
    ) -> Hinges:
        """Hinges of an undeformed mesh: X (n, 3) [m], triangles (m, 3), and their incidence if that is known.

        With `quick` their weights fit as well, and are found in a fifth of the time (see `hinge_weights.quickly`).
        """
        from muslin.physics.elements.layout import Incidence

        X = np.ascontiguousarray(X, dtype=np.float64)
        incidence = incidence or Incidence.of(triangles, len(X))
        cells = inner_edges(triangles, incidence)
        length, area, sine, cosine, cotangents, alpha, real, imag = _geometry(X, cells)
        weight = weights(X, triangles, incidence, cells, area, alpha, real, imag, quick)
        return cls(cells, length, area, sine, cosine, cotangents, weight)

    @functools.cached_property
    def angle(self) -> np.ndarray:
        """Between the two normals, (h,)."""
        return np.arctan2(self.sine, self.cosine)


def _geometry(X: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, ...]:
    """Length, area, sine and cosine, cotangents of hinges on vertices (n, 3), and alpha, Z.real and Z.imag."""
    if runtime.plain():
        h = len(cells)
        length, area, sine, cosine, alpha, real, imag = np.empty((7, h))
        cotangents = np.empty((h, 4))
        launched("geometry", X, cells, length, area, sine, cosine, cotangents, alpha, real, imag)
        return length, area, sine, cosine, cotangents, alpha, real, imag
    x = np.ascontiguousarray(X.T)
    x0, x1, x2, x3 = (x[:, corner] for corner in cells.T)
    along = x1 - x0
    length = np.sqrt(dot(along, along))
    t = along / length
    to0, to1 = x2 - x0, x3 - x0
    n0, n1 = cross(t, to0), cross(to1, t)
    a0, a1, h0, h1 = dot(to0, t), dot(to1, t), np.sqrt(dot(n0, n0)), np.sqrt(dot(n1, n1))
    n0, n1 = n0 / h0, n1 / h1
    sine, cosine = dot(cross(n0, n1), t), dot(n0, n1)
    cotangents = np.stack(
        [(length - a0) / h0 + (length - a1) / h1, a0 / h0 + a1 / h1, -length / h0, -length / h1], axis=1
    )
    # laid flat, its edge along x: corners at (0, 0), (length, 0), (a0, h0), (a1, -h1)
    _, c1, c2, c3 = cotangents.T
    xx, yy = (c1 * length**2 + c2 * a0**2 + c3 * a1**2) / 2, (c2 * h0**2 + c3 * h1**2) / 2
    xy = c2 * a0 * h0 - c3 * a1 * h1
    area = length * (h0 + h1) / 2
    return length, area, sine, cosine, cotangents, (xx + yy) / 2, (xx - yy) / 2, xy / 2


def inner_edges(triangles: np.ndarray, incidence: Incidence | None = None) -> np.ndarray:
    """Edges of two triangles, (h, 4) int32: its two ends, and the vertices across it in its first and second triangle.

    The first triangle has the edge's direction. Edges of one triangle, or of more than two, are no hinges.
    """
    from muslin.physics.elements.layout import Incidence, grouped, whole

    if runtime.on_cpu():
        at = incidence or Incidence.of(triangles, int(triangles.max(initial=-1)) + 1)
        flat, count = whole(triangles).ravel(), np.zeros(1, np.int32)
        cells = np.empty((len(flat) // 2, 4), np.int32)
        launched("inner_edges", flat, at.row, at.col, at.numbers, at.begin, cells, count)
        return cells[: count[0]].copy()
    n = int(triangles.max(initial=-1)) + 1
    start, end, across = (np.roll(triangles, -k, axis=1).T.ravel() for k in range(3))
    low, high = np.minimum(start, end), np.maximum(start, end)
    order, _ = grouped(high, n)
    order = order[grouped(low[order], n)[0]]
    low, high = low[order], high[order]
    begins = np.flatnonzero(np.append(True, (np.diff(low) != 0) | (np.diff(high) != 0))[: len(low)])
    pairs = begins[np.diff(begins, append=len(low)) == 2]
    one, two = order[pairs], order[pairs + 1]
    return np.stack([start[one], end[one], across[one], across[two]], axis=1).astype(np.int32)


def require_model(name: str, stiffness: float) -> None:
    """Refuse what is no model of bending, or no stiffness.

    Raises
    ------
    MuslinError
    """
    if name not in MODELS:
        raise MuslinError(f"bending = {name!r} is not understood.", choices(name, MODELS))
    if not handed.number("bending_stiffness", stiffness) >= 0:
        raise MuslinError(
            f"bending_stiffness = {stiffness} must not be negative.", "In N m: cotton has about 1e-5."
        )
