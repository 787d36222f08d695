"""Mass and kinetic energy: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging import Case, Mistake
from muslin.judging.arrays import lengths
from muslin.judging.draws import Draw
from muslin.judging.exact import Vector, dot, exact, precise

from .shape_functions import truth_interpolate
from .triangles import draw_sheet


def over_triangle(f: Callable[[Vector], Any], area: Any) -> Any:
    """Integral over a triangle of a polynomial f(phi) of degree 2.

    phi = (1-u, u(1-v), uv) maps the unit square to the triangle, with dA = 2 area u du dv: an iterated
    integral of degree 3 in u and 2 in v, for which Simpson's rule is exact.
    """
    half, sixth = precise().mpf(1) / 2, precise().mpf(1) / 6
    simpson = ((precise().mpf(0), sixth), (half, 4 * sixth), (precise().mpf(1), sixth))
    samples = (wu * wv * u * f([1 - u, u * (1 - v), u * v]) for u, wu in simpson for v, wv in simpson)
    return 2 * area * sum(samples)


def truth_mass_block(i: Any, j: Any, area: Any, rho: Any, h: Any) -> Any:
    """Thickness times the integral of rho phi_i phi_j."""
    return h * over_triangle(lambda phi: rho * phi[int(i)] * phi[int(j)], area)


def truth_kinetic_energy(v0: Vector, v1: Vector, v2: Vector, area: Any, rho: Any, h: Any) -> Any:
    """Thickness times the integral of rho |v(X)|^2 / 2."""

    def density(phi: Vector) -> Any:
        v = truth_interpolate(phi, v0, v1, v2)
        return rho * dot(v, v) / 2

    return h * over_triangle(density, area)


def draw_mass_block(draw: Draw, k: int) -> dict[str, Any]:
    """All nine blocks in turn."""
    return {"i": k % 3, "j": k // 3 % 3, **draw_sheet(draw)}


def draw_kinetic_energy(draw: Draw, k: int) -> dict[str, Any]:
    """Any velocities; all the same; one vertex alone; at rest."""
    v, still = [draw.vector(5) for _ in range(3)], exact([0, 0, 0])
    if k % 6 == 1:
        v = [v[0]] * 3
    elif k % 6 in (2, 3, 4):
        v = [v[i] if i == k % 6 - 2 else still for i in range(3)]
    elif k == 5:
        v = [still] * 3
    return {**{f"v{i}": v[i] for i in range(3)}, **draw_sheet(draw)}


def _mass(a: Case) -> np.ndarray:
    return a.area * a.rho * a.h


def _squares(a: Case) -> np.ndarray:
    """What the three vertices would have if they moved one at a time."""
    still = np.zeros_like(a.v0)
    alone = ({"v1": still, "v2": still}, {"v0": still, "v2": still}, {"v0": still, "v1": still})
    return sum(a.truth(**others) for others in alone)  # type: ignore[return-value]


def _mixed(count: float, times: float = 1) -> Callable[[Case], np.ndarray]:
    return lambda a: times * _squares(a) + count * (a.right - _squares(a))


def _without_pair(a: Case) -> tuple[np.ndarray, ...]:
    still = np.zeros_like(a.v0)
    two, one, other = {"v0": still}, {"v0": still, "v1": still}, {"v0": still, "v2": still}
    pairs = []
    for k in range(3):
        named = [
            {f"v{(int(name[1]) + k) % 3}": v for name, v in still_ones.items()}
            for still_ones in (two, one, other)
        ]
        pairs.append(a.truth(**named[0]) - a.truth(**named[1]) - a.truth(**named[2]))
    return tuple(a.right - pair for pair in pairs)


mistakes_mass_block = (
    Mistake(
        "lumped",
        "This is the lumped mass: a third of the triangle at each vertex, nothing between them.",
        "The consistent mass couples the vertices: integrate phi_i phi_j for i != j, too.",
        lambda a: np.where(a.i == a.j, _mass(a) / 3, 0),
    ),
    Mistake(
        "one point",
        "The product of the shape functions is taken at the centre of the triangle only.",
        "The integrand is quadratic: one sample at the centre is not exact.",
        lambda a: _mass(a) / 9,
    ),
    Mistake(
        "exchanged",
        "The fractions for i = j and for i != j are exchanged.",
        "A shape function overlaps most with itself: which of the two must be larger?",
        lambda a: a.truth(j=np.where(a.i == a.j, (a.i + 1) % 3, a.i)),
    ),
    Mistake(
        "linear",
        "The integral of one shape function stands in place of that of a product of two.",
        "Two shape functions meet under the integral, also for i = j.",
        lambda a: _mass(a) / 3,
    ),
)


said_mass_block = {
    "scaled:3": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
    "where i != j: scaled:2": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
    "where i = j: scaled:2": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
    "where i = j: scaled:1/2": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
    "scaled:2": ("", "Is the area doubled? `area` is that of the triangle, not of the parallelogram."),
    "scaled:1/2": ("", "The 1/2 of the kinetic energy does not belong into the mass."),
    "where i != j: zeros": (
        "The blocks off the diagonal are zero: the vertices are not coupled.",
        "Integrate phi_i phi_j for i != j, too: all nine blocks weigh as much as the triangle.",
    ),
}


mistakes_kinetic_energy = (
    Mistake(
        "lumped",
        "This is the energy of lumped masses: a third of the triangle at each vertex.",
        "Between the vertices the velocity is interpolated, so they are coupled: v_i . v_j for i != j, too.",
        _mixed(0, 2),
    ),
    Mistake(
        "missing coupling",
        "Only the terms v_i . v_i are there: the coupling between the vertices is missing.",
        "The double sum has nine terms. Which ones are left out?",
        _mixed(0),
    ),
    Mistake(
        "mixed terms once",
        "Each mixed term is counted once: v_0 . v_1, but not v_1 . v_0.",
        "The double sum has nine terms, and the mixed ones come in pairs.",
        _mixed(0.5),
    ),
    Mistake(
        "mixed terms doubled",
        "The mixed terms count twice as much as they should.",
        "Write the nine terms out: how often does each mixed pair come, and with which fraction?",
        _mixed(2),
    ),
    Mistake(
        "missing pair",
        "One pair of vertices is not coupled.",
        "The double sum has nine terms: three squares and three pairs, each of them twice.",
        _without_pair,
    ),
    Mistake(
        "one point",
        "The velocity is taken at the centre of the triangle only.",
        "The energy is quadratic in the velocity: one sample at the centre is not exact.",
        lambda a: _mass(a) / 2 * lengths((a.v0 + a.v1 + a.v2) / 3) ** 2,
    ),
    Mistake(
        "sum of velocities",
        "The velocities are added first, and their sum squared.",
        "Then i = j and i != j count alike. In the mass matrix they do not.",
        lambda a: tuple(_mass(a) / k * lengths(a.v0 + a.v1 + a.v2) ** 2 for k in (12, 24, 6, 2)),
    ),
)


said_kinetic_energy = {
    "scaled:2": ("", "Where is the 1/2 in front of qdot^T M qdot?"),
    "scaled:1/2": ("", "The 1/2 in front of qdot^T M qdot is there once, not twice."),
}
