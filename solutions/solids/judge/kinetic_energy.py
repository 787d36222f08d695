"""Mass and kinetic energy: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging import Case, Mistake
from muslin.judging.arrays import lengths
from muslin.judging.draws import Draw
from muslin.judging.exact import Vector, dot, exact

from .shape_functions import truth_interpolate
from .tetrahedra import draw_body


def over_tetrahedron(f: Callable[[Vector], Any], volume: Any) -> Any:
    """Integral over a tetrahedron of a polynomial f(phi) of degree 2.

    It is found from the values at the vertices and at the middles of the edges, which such a polynomial is given by:
    -1/20 of the volume for each vertex, 1/5 for each middle.
    """
    unit = exact(np.eye(4))
    middles = [[(p + q) / 2 for p, q in zip(a, b, strict=True)] for a, b in itertools.combinations(unit, 2)]
    corners = sum(f(phi) for phi in unit)
    return volume * (sum(f(phi) for phi in middles) / 5 - corners / 20)


def truth_mass_block(i: Any, j: Any, volume: Any, rho: Any) -> Any:
    """The integral of rho phi_i phi_j."""
    return over_tetrahedron(lambda phi: rho * phi[int(i)] * phi[int(j)], volume)


def truth_kinetic_energy(v0: Vector, v1: Vector, v2: Vector, v3: Vector, volume: Any, rho: Any) -> Any:
    """The integral of rho |v(X)|^2 / 2."""

    def density(phi: Vector) -> Any:
        v = truth_interpolate(phi, v0, v1, v2, v3)
        return rho * dot(v, v) / 2

    return over_tetrahedron(density, volume)


def draw_mass_block(draw: Draw, k: int) -> dict[str, Any]:
    """All sixteen blocks in turn."""
    return {"i": k % 4, "j": k // 4 % 4, **draw_body(draw)}


def draw_kinetic_energy(draw: Draw, k: int) -> dict[str, Any]:
    """Any velocities; all the same; one vertex alone; at rest."""
    v, still = [draw.vector(5) for _ in range(4)], exact([0, 0, 0])
    if k % 7 == 1:
        v = [v[0]] * 4
    elif k % 7 in (2, 3, 4, 5):
        v = [v[i] if i == k % 7 - 2 else still for i in range(4)]
    elif k == 6:
        v = [still] * 4
    return {**{f"v{i}": v[i] for i in range(4)}, **draw_body(draw)}


def _mass(a: Case) -> np.ndarray:
    return a.volume * a.rho


def _fractions(same: float, other: float) -> Callable[[Case], np.ndarray]:
    return lambda a: _mass(a) * np.where(a.i == a.j, same, other)


def _sums(a: Case) -> tuple[np.ndarray, np.ndarray]:
    """Sums of v_i . v_i, and of v_i . v_j over the six pairs."""
    v = np.stack([a.v0, a.v1, a.v2, a.v3], axis=1)
    squares = np.sum(v * v, axis=(1, 2))
    return squares, (np.sum(v.sum(axis=1) ** 2, axis=1) - squares) / 2


def _parts(same: float, other: float) -> Callable[[Case], np.ndarray]:
    """Rho V times parts of the squares and of the pairs."""

    def makes(a: Case) -> np.ndarray:
        squares, pairs = _sums(a)
        return _mass(a) * (same * squares + other * pairs)

    return makes


def _without_pair(a: Case) -> tuple[np.ndarray, ...]:
    v = (a.v0, a.v1, a.v2, a.v3)
    return tuple(
        a.right - _mass(a) / 20 * np.sum(v[i] * v[j], axis=1) for i, j in itertools.combinations(range(4), 2)
    )


def _only_a_ring(a: Case) -> np.ndarray:
    """Pairs of neighbours around the four vertices, as for a polygon: two of six are missing."""
    squares, _ = _sums(a)
    v = (a.v0, a.v1, a.v2, a.v3)
    ring = sum(np.sum(v[k] * v[(k + 1) % 4], axis=1) for k in range(4))
    return np.asarray(_mass(a) / 20 * (squares + ring))


mistakes_mass_block = (
    Mistake(
        "lumped",
        "This is the lumped mass: a quarter of the tetrahedron at each vertex, nothing between them.",
        "The consistent mass couples the vertices: integrate phi_i phi_j for i != j, too.",
        _fractions(1 / 4, 0),
    ),
    Mistake(
        "triangle",
        "These are the fractions of a triangle, a sixth and a twelfth.",
        "Integrate over a tetrahedron: all sixteen blocks together weigh rho volume.",
        _fractions(1 / 6, 1 / 12),
    ),
    Mistake(
        "one point",
        "The product of the shape functions is taken at the middle of the tetrahedron only.",
        "The integrand is quadratic: one sample at the middle is not exact.",
        _fractions(1 / 16, 1 / 16),
    ),
    Mistake(
        "exchanged",
        "The fractions for i = j and for i != j are exchanged.",
        "A shape function overlaps most with itself: which of the two must be larger?",
        _fractions(1 / 20, 1 / 10),
    ),
    Mistake(
        "linear",
        "The integral of one shape function stands in place of that of a product of two.",
        "Two shape functions meet under the integral, also for i = j.",
        _fractions(1 / 4, 1 / 4),
    ),
    Mistake(
        "not coupled",
        "The blocks off the diagonal are zero: the vertices are not coupled.",
        "Integrate phi_i phi_j for i != j, too: all sixteen blocks weigh as much as the tetrahedron.",
        _fractions(1 / 10, 0),
    ),
    Mistake(
        "six volumes",
        "The 6 between the volume and that of the edges' box is in the wrong place.",
        "`volume` is that of the tetrahedron: no 6 is left over.",
        lambda a: (6 * a.right, a.right / 6),
    ),
    Mistake(
        "same everywhere",
        "The fractions for i = j and for i != j are the same.",
        "The integral of phi_i^2 is twice that of phi_i phi_j.",
        lambda a: tuple(_fractions(c, c)(a) for c in (1 / 10, 1 / 20)),
    ),
)


said_mass_block = {
    "scaled:5/3": (
        "These are the fractions of a triangle, a sixth and a twelfth.",
        "Integrate over a tetrahedron: all sixteen blocks together weigh rho volume.",
    ),
    "scaled:6": ("", "`volume` is that of the tetrahedron: no 6 is left over."),
    "scaled:1/6": ("", "`volume` is that of the tetrahedron: no 6 is left over."),
    "where i = j: scaled:1/2": (
        "",
        "All sixteen blocks together weigh as much as the tetrahedron. Do yours?",
    ),
    "where i != j: scaled:2": ("", "All sixteen blocks together weigh as much as the tetrahedron. Do yours?"),
    "scaled:2": ("", "All sixteen blocks together weigh as much as the tetrahedron. Do yours?"),
    "scaled:1/2": ("", "The 1/2 of the kinetic energy does not belong into the mass."),
}


mistakes_kinetic_energy = (
    Mistake(
        "lumped",
        "This is the energy of lumped masses: a quarter of the tetrahedron at each vertex.",
        "Between the vertices the velocity is interpolated, so they are coupled: v_i . v_j for i != j, too.",
        _parts(1 / 8, 0),
    ),
    Mistake(
        "missing coupling",
        "Only the terms v_i . v_i are there: the coupling between the vertices is missing.",
        "The double sum has sixteen terms. Which ones are left out?",
        _parts(1 / 20, 0),
    ),
    Mistake(
        "mixed terms once",
        "Each mixed term is counted once: v_0 . v_1, but not v_1 . v_0.",
        "The double sum has sixteen terms, and the mixed ones come in pairs.",
        _parts(1 / 20, 1 / 40),
    ),
    Mistake(
        "mixed terms doubled",
        "The mixed terms count twice as much as they should.",
        "Write the sixteen terms out: how often does each mixed pair come, and with which fraction?",
        _parts(1 / 20, 1 / 10),
    ),
    Mistake(
        "missing pair",
        "A pair of vertices is not coupled.",
        "Four vertices make six pairs: every vertex meets every other one.",
        lambda a: (*_without_pair(a), _only_a_ring(a)),
    ),
    Mistake(
        "triangle",
        "These are the fractions of a triangle.",
        "The integrals of S4 are over a tetrahedron: a tenth and a twentieth.",
        _parts(1 / 12, 1 / 12),
    ),
    Mistake(
        "one point",
        "The velocity is taken at the middle of the tetrahedron only.",
        "The energy is quadratic in the velocity: one sample at the middle is not exact.",
        lambda a: _mass(a) / 2 * lengths((a.v0 + a.v1 + a.v2 + a.v3) / 4) ** 2,
    ),
    Mistake(
        "sum of velocities",
        "The velocities are added first, and their sum squared.",
        "Then i = j and i != j count alike. In the mass matrix they do not.",
        lambda a: tuple(_parts(1 / k, 2 / k)(a) for k in (2, 20, 40, 10, 8)),
    ),
    Mistake(
        "not halved",
        "The 1/2 in front of qdot^T M qdot is missing, or is there twice.",
        "T = 1/2 qdot^T M qdot: moving as one, the tetrahedron has half its mass times |v|^2.",
        lambda a: (2 * a.right, a.right / 2),
    ),
)


said_kinetic_energy = {
    "scaled:5/3": (
        "These are the fractions of a triangle.",
        "The integrals of S4 are over a tetrahedron: a tenth and a twentieth.",
    ),
    "scaled:2": ("", "Where is the 1/2 in front of qdot^T M qdot?"),
    "scaled:1/2": ("", "The 1/2 in front of qdot^T M qdot is there once, not twice."),
}
