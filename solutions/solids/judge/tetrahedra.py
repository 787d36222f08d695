"""Tetrahedra, deformations and materials that the cases of the solids assignment are drawn from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from muslin.judging import Given
from muslin.judging.draws import Draw, coarse, float64
from muslin.judging.exact import (
    Matrix,
    Vector,
    add,
    apply,
    cross,
    diagonal,
    dot,
    exact,
    matmul,
    precise,
    sub,
    times,
    transpose,
)

#: How a tetrahedron is deformed: its principal stretches. J runs from 0.05 to 8.
STRETCHES: Mapping[str, Callable[[Draw], tuple[Any, Any, Any]]] = {
    "generic": lambda draw: (draw.between(1.1, 1.5), draw.between(0.9, 1.1), draw.between(0.5, 0.8)),
    "rest": lambda draw: (1, 1, 1),
    "stretched in one direction": lambda draw: (draw.between(1.2, 2.5), 1, 1),
    "twice as large everywhere": lambda draw: (2, 2, 2),
    "pressed together everywhere": lambda draw: (draw.between(0.37, 0.9),) * 3,
    "pressed flat": lambda draw: (draw.between(0.06, 0.3), draw.between(0.9, 1.1), draw.between(0.9, 1.2)),
    "two alike": lambda draw: (draw.between(0.5, 0.9), *(draw.between(1.1, 1.8),) * 2),
    "sheared far": lambda draw: (draw.between(2, 3), draw.between(0.8, 1.2), draw.between(0.3, 0.5)),
    "nearly rest": lambda draw: tuple(1 + draw.between(-0.03, 0.03) for _ in range(3)),  # type: ignore[return-value]
    "blown up": lambda draw: tuple(draw.between(1.2, 2) for _ in range(3)),  # type: ignore[return-value]
}

#: How a tetrahedron lies: size [m], distance from the origin [m].
LIES: tuple[tuple[str, float, float], ...] = (
    ("generic", 1, 1),
    ("far from the origin", 1, 100),
    ("small, as in a mesh", 0.03, 1),
    ("large", 20, 10),
    ("at the origin", 1, 0),
    ("tiny", 0.001, 0.01),
    ("huge", 1000, 2000),
)

#: The corner of a cube: its tetrahedron and what is near it are well shaped.
CORNER = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))


def undeformed(draw: Draw, k: int) -> list[Vector]:
    """A positively oriented tetrahedron, neither flat nor a needle, somewhere in space."""
    _, size, distance = LIES[k % len(LIES)]
    while True:
        y = [add(exact(list(p)), draw.vector(0.35)) for p in CORNER]
        edges = [sub(p, y[0]) for p in y[1:]]
        if dot(cross(edges[0], edges[1]), edges[2]) > 0.35:
            break
    R, t = draw.rotation(), times(precise().mpf(distance), draw.vector())
    return [float64(add(times(precise().mpf(size), apply(R, p)), t)) for p in y]


def map_of(draw: Draw, k: int) -> Matrix:
    """A deformation gradient of kind k: rotations around principal stretches; now and then no rotation at all."""
    s = list(STRETCHES.values())[k % len(STRETCHES)](draw)
    if k % len(STRETCHES) == 1 and k // len(STRETCHES) % 2 == 0:
        return exact(np.eye(3))
    return matmul(matmul(draw.rotation(), diagonal(exact(list(s)))), transpose(draw.rotation()))


def draw_tetrahedron(draw: Draw, k: int) -> dict[str, Any]:
    """Undeformed and deformed tetrahedron number k: X0..X3, x0..x3."""
    X = undeformed(draw, k)
    F, t = map_of(draw, k), times(precise().mpf(LIES[k % len(LIES)][2]), draw.vector())
    x = [float64(add(apply(F, sub(p, X[0])), t)) for p in X]
    return {**{f"X{i}": p for i, p in enumerate(X)}, **{f"x{i}": p for i, p in enumerate(x)}}


def draw_weights(draw: Draw, spread: float = 1.0) -> Vector:
    """Shape functions inside (spread 1) or around the tetrahedron, whose sum is exactly one in float64."""
    cuts = sorted(draw.random() for _ in range(3))
    shares = (cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1])
    phi = [coarse(precise().mpf(0.25 + spread * (p - 0.25)), 2.0**-40) for p in shares]
    return [1 - sum(phi, start=precise().zero), *phi]


def draw_material(draw: Draw) -> dict[str, Any]:
    """C and D, never near each other, so that exchanging them shows."""
    C = draw.decades(2, 6)
    return {"C": C, "D": C * draw.choice((draw.between(0.1, 0.7), draw.between(1.5, 8)))}


def draw_strained(draw: Draw, k: int) -> dict[str, Any]:
    """A deformation gradient with J > 0, and a material."""
    return {"F": map_of(draw, k), **draw_material(draw)}


def draw_body(draw: Draw) -> dict[str, Any]:
    """Volume and density."""
    return {"volume": draw.decades(-9, 1), "rho": draw.decades(0, 4)}


def pick(values: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: values[name] for name in names}


def conditions_strained(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases with a deformation gradient may be told apart."""
    J = np.linalg.det(a["F"])
    turned = np.abs(np.einsum("bij,bik->bjk", a["F"], a["F"]) - np.eye(3)).max(axis=(1, 2)) < 1e-12
    yield "F is the identity", np.abs(a["F"] - np.eye(3)).max(axis=(1, 2)) < 1e-12
    yield "nothing is deformed", turned
    yield "det F < 1", J < 1 - 1e-12
    yield "det F > 1", J > 1 + 1e-12


def length(a: np.ndarray) -> np.ndarray:
    """Length of each vector, (b,)."""
    return np.linalg.norm(a, axis=-1)
