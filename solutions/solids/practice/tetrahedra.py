"""Tetrahedra, deformations and materials that properties of the solids assignment are asked on."""

from __future__ import annotations

import numpy as np

from muslin.judging import Arrays, Change, Given, Rng
from muslin.judging.relations import Q, between, binades, rotations, turned, vectors
from muslin.judging.vectors import apply, cross, diag, dot, length, mul, transposed

#: How a tetrahedron lies: size [m], distance from the origin [m].
#: Generic, far away, small as in a mesh, large, at the origin, tiny, huge, generic again.
LIES = np.array([(1, 1), (1, 100), (0.03, 1), (20, 10), (1, 0), (0.001, 0.01), (1000, 2000), (0.5, 1)])

#: The corner of a cube: its tetrahedron and what is near it are well shaped.
CORNER = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])


def tetrahedra(rng: Rng) -> np.ndarray:
    """One tetrahedron of each of the `LIES`, positively oriented: vertices (b, 4, 3)."""
    count = len(LIES)
    size, distance = LIES.T
    y = CORNER + between(rng, -0.15, 0.15, count, 4, 3)
    placed = size[:, None, None] * apply(rotations(rng, count)[:, None], y)
    return placed + (distance[:, None] * vectors(rng, count))[:, None, :]


def corners(letter: str, points: np.ndarray) -> Arrays:
    """Vertices (b, 4, 3) as arguments: x0, x1, x2, x3."""
    return {f"{letter}{i}": points[:, i] for i in range(4)}


def points(inputs: Given, letter: str) -> np.ndarray:
    """Arguments x0, x1, x2, x3 as vertices (b, 4, 3)."""
    return np.stack([inputs[f"{letter}{i}"] for i in range(4)], axis=1)


def longest_edge(x: np.ndarray) -> np.ndarray:
    """Longest of the edges from vertex 0, (b,)."""
    return np.max([length(x[:, i] - x[:, 0]) for i in range(1, 4)], axis=0)


def six_volumes(x: np.ndarray) -> np.ndarray:
    """Six times the volume of each tetrahedron, (b,)."""
    a, b, c = (x[:, i] - x[:, 0] for i in range(1, 4))
    return dot(cross(a, b), c)


def with_gradients(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    """Tetrahedra that lie as the `LIES` say, (b, 4, 3), and what the simulator would hand on as their dphi_dX.

    Both are drawn together: whatever is done to an edge is undone in the row that belongs to it.
    """
    size, distance = LIES.T
    R, long = rotations(rng, len(LIES)), size[:, None, None] * between(rng, 0.8, 1.2, len(LIES), 3, 1)
    edges, rows = long * R, R / long
    for i, j in ((0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)):
        share = between(rng, -0.2, 0.2, len(LIES), 1)
        edges[:, j] += share * edges[:, i]
        rows[:, i] -= share * rows[:, j]
    first = (distance[:, None] * vectors(rng, len(LIES)))[:, None]
    X = np.concatenate([first, first + edges], axis=1)
    return X, np.concatenate([-(rows[:, :1] + rows[:, 1:2] + rows[:, 2:]), rows], axis=1)


def weights_around(rng: Rng, count: int) -> np.ndarray:
    """Shape functions in and around a tetrahedron, whose sum is exactly one."""
    three = np.floor(between(rng, -0.4, 0.8, count, 3) * 2.0**40) / 2.0**40
    return np.concatenate([1 - three[:, :1] - three[:, 1:2] - three[:, 2:], three], axis=1)


def combined(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The sum of the vertices (b, 4, 3), each with its weight (b, 4)."""
    return sum(weights[:, i, None] * points[:, i] for i in range(4))  # type: ignore[return-value]


def material(rng: Rng, count: int) -> Arrays:
    """C and D, never near each other, so that exchanging them shows."""
    C = binades(rng, 7, 18, count)
    softer = np.arange(count) % 2 == 0
    ratio = np.where(softer, between(rng, 0.1, 0.7, count), between(rng, 1.5, 8, count))
    return {"C": C, "D": ratio * C}


def stretched(rng: Rng, count: int) -> np.ndarray:
    """Deformation gradients: stretched, compressed or both, turned on both sides, (b, 3, 3)."""
    s = np.where(
        rng.random((count, 3)) < 0.5, between(rng, 0.4, 0.95, count, 3), between(rng, 1.05, 2, count, 3)
    )
    return mul(mul(rotations(rng, count), diag(s)), transposed(rotations(rng, count)))


def states(rng: Rng, count: int = 8) -> Arrays:
    """A deformation gradient and a material."""
    return {"F": stretched(rng, count), **material(rng, count)}


def bodies(rng: Rng, count: int) -> Arrays:
    """Volume, density."""
    return {"volume": binades(rng, -20, 3, count), "rho": binades(rng, 0, 13, count)}


def undeformed(rng: Rng) -> Arrays:
    return corners("X", tetrahedra(rng))


def deformed(rng: Rng) -> Arrays:
    return corners("x", tetrahedra(rng))


def moved(*names: str) -> Change:
    """Change: points moved by a few sizes of their tetrahedron (the last four names)."""

    def change(rng: Rng, a: Arrays) -> Arrays:
        size = longest_edge(np.stack([a[name] for name in names[-4:]], axis=1))
        t = 2 * size[:, None] * vectors(rng, len(size))
        return {name: a[name] + t for name in names}

    return change


def rigidly(*names: str) -> Change:
    """Change: points turned and moved together."""
    return lambda rng, a: moved(*names)(rng, turned(*names)(rng, a))


def renumbered(*names: str) -> Change:
    """Change: vertex 1 is called 0, 2 is called 1, 3 is called 2, 0 is called 3."""
    return lambda rng, a: {name: a[other] for name, other in zip(names, names[1:] + names[:1], strict=True)}


def left(*names: str) -> Change:
    """Change: matrices turned, A -> Q A."""
    return lambda rng, a: {name: mul(Q, a[name]) for name in names}


def right(*names: str) -> Change:
    """Change: matrices turned from the other side, A -> A Q^T."""
    return lambda rng, a: {name: mul(a[name], Q.T) for name in names}
