"""Triangles, stretches and states that the cases of the cloth assignment are drawn from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from muslin.judging import Given
from muslin.judging.draws import Draw, coarse, float64
from muslin.judging.exact import (
    Matrix,
    Vector,
    add,
    apply,
    cross,
    diagonal,
    gradient,
    hessian,
    matmul,
    norm,
    precise,
    sub,
    times,
    transpose,
)

from .energies import ENERGIES

#: Where the two in-plane stretches lie; each kind keeps its gaps 0 or above 1e-2.
STRETCHES: Mapping[str, Callable[[Draw], tuple[Any, Any]]] = {
    "generic": lambda draw: (draw.between(1.05, 1.4), draw.between(0.6, 0.95)),
    "rest": lambda draw: (1, 1),
    "equal and stretched": lambda draw: (draw.between(1.1, 2.5),) * 2,
    "equal and compressed": lambda draw: (draw.between(0.3, 0.9),) * 2,
    "strip: one stretch 1": lambda draw: (draw.between(1.1, 2.0), 1),
    "folded: one stretch 1": lambda draw: (1, draw.between(0.2, 0.9)),
    "both stretched": lambda draw: (draw.between(2.0, 3.0), draw.between(1.1, 1.8)),
    "both compressed": lambda draw: (draw.between(0.5, 0.9), draw.between(0.05, 0.3)),
    "sheared far": lambda draw: (draw.between(2.0, 3.0), draw.between(0.05, 0.3)),
    "nearly rest": lambda draw: (1 + draw.between(0.01, 0.03), 1 - draw.between(0.01, 0.03)),
}


#: How a triangle lies: (longest edge over height, size [m], distance from the origin [m]).
LIES: tuple[tuple[str, float, float, float], ...] = (
    ("generic", 1, 1.0, 1.0),
    ("far from the origin", 1, 1.0, 300.0),
    ("small, as in a cloth", 1, 0.03, 1.0),
    ("thin", 30, 1.0, 0.5),
    ("large", 1, 20.0, 10.0),
    ("at the origin", 1, 1.0, 0.0),
    ("thin and small", 10, 0.05, 2.0),
)


def flat_triangle(draw: Draw, thin: float, size: float) -> list[Vector]:
    """A counterclockwise triangle in the plane z = 0, neither slimmer nor rounder than asked."""
    zero = precise().zero
    while True:
        y = [[size * draw.between(-1, 1), size * draw.between(-1, 1), zero] for _ in range(3)]
        edges = [sub(y[(k + 1) % 3], y[k]) for k in range(3)]
        lengths = [norm(e) for e in edges]
        double_area = cross(edges[0], edges[1])[2]
        if double_area > 0.4 * max(lengths) ** 2 and min(lengths) > 0.5 * size:
            return [[p[0], p[1] / thin, zero] for p in y]


def draw_triangle(draw: Draw, k: int) -> dict[str, Any]:
    """Undeformed and deformed triangle number k: X0..X2, x0..x2, rounded to float64, as exact numbers."""
    _, thin, size, distance = LIES[k % len(LIES)]
    s = list(STRETCHES.values())[k % len(STRETCHES)](draw)
    y = flat_triangle(draw, thin, size)
    turn, other = (draw_turn(draw), draw_turn(draw))
    stretch = matmul(matmul(turn, diagonal([*s, precise().one])), transpose(other))
    if s == (1, 1):  # a rigid motion
        stretch = diagonal([precise().one] * 3)
    placed = {}
    for letter, points in (("X", y), ("x", [apply(stretch, p) for p in y])):
        R, t = draw.rotation(), times(precise().mpf(distance), draw.vector())
        for i, p in enumerate(points):
            placed[f"{letter}{i}"] = float64(add(apply(R, p), t))
    return placed


def draw_turn(draw: Draw) -> Matrix:
    """A rotation of the plane z = 0."""
    one, zero = precise().one, precise().zero
    while True:
        a, b = draw.between(-1, 1), draw.between(-1, 1)
        r = precise().sqrt(a * a + b * b)
        if r > 0.1:
            return [[a / r, -b / r, zero], [b / r, a / r, zero], [zero, zero, one]]


def draw_weights(draw: Draw, spread: float = 1.0) -> Vector:
    """Shape functions inside (spread 1) or around the triangle, whose sum is exactly one in float64."""
    a, b = sorted(draw.random() for _ in range(2))
    middle = 1 / 3
    phi1, phi2 = (coarse(precise().mpf(middle + spread * (p - middle)), 2.0**-40) for p in (a, b - a))
    return [1 - phi1 - phi2, phi1, phi2]


def draw_state(draw: Draw, k: int, energy: str | None = None) -> dict[str, Any]:
    """Stretches number k with Lamé parameters, and the derivatives of one of the energies there."""
    one = precise().one
    s = float64([*list(STRETCHES.values())[k % len(STRETCHES)](draw), one])
    mu, lam = float64(list(draw.material()))
    of = ENERGIES[energy or ("linearised", "area")[k // len(STRETCHES) % 2]]
    return {
        "s": s,
        "mu": mu,
        "lam": lam,
        "dpsi_ds": gradient(lambda t: of(t, mu, lam), s),
        "d2psi_ds2": hessian(lambda t: of(t, mu, lam), s),
    }


def pick(values: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: values[name] for name in names}


def draw_sheet(draw: Draw) -> dict[str, Any]:
    return {"area": draw.decades(-4, 0), "rho": draw.decades(0, 3), "h": draw.decades(-4, 0)}


def conditions_stretches(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases with stretches may be told apart."""
    s0, s1, s2 = a["s"].T
    yield "s_0 = s_1", s0 == s1
    yield "s_2 is not 1", s2 != 1
    yield "the cloth is at rest", (s0 == 1) & (s1 == 1)
    yield "s_0 or s_1 is 1", (s0 == 1) | (s1 == 1)
    yield "s_0 = 1", s0 == 1
    yield "s_1 = 1", s1 == 1
    yield "s_0 < 1", s0 < 1
    yield "s_1 < 1", s1 < 1
    yield "s_0 + s_1 < 2", s0 + s1 < 2
    yield "s_0 s_1 < 1", s0 * s1 < 1
    yield "s_1 <= 1", s1 <= 1


def conditions_stress(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases with a gradient of the energy may be told apart."""
    yield "dpsi_ds is negative somewhere", (a["dpsi_ds"] < 0).any(axis=1)
