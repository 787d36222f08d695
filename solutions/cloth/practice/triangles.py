"""Triangles, stretches, materials and states that properties of the cloth assignment are asked on."""

from __future__ import annotations

import numpy as np

from muslin.judging import Arrays, Change, Given, Rng
from muslin.judging.relations import Q, between, binades, rotations, turned, vectors
from muslin.judging.vectors import apply, cross, length, mul, transposed, unit

#: Pairs of principal directions reversed together: still rotations, still the same F.
REVERSED = np.array([[-1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]])


#: How a triangle lies: how many times thinner than well-shaped, size [m], distance from the origin [m].
#: Generic, far away, small as in a cloth, thin, large, at the origin, thin and small, generic again.
LIES = np.array(
    [
        (1, 1, 1),
        (1, 1, 100),
        (1, 0.03, 1),
        (8, 1, 0.5),
        (1, 20, 10),
        (1, 1, 0),
        (5, 0.05, 2),
        (2, 0.5, 1),
    ]
)


def triangles(rng: Rng) -> np.ndarray:
    """One triangle of each of the `LIES`: vertices (b, 3, 3)."""
    count = len(LIES)
    thin, size, distance = LIES.T[:, :, None]
    y = np.array([[-0.5, -0.3], [0.5, -0.3], [0.0, 0.55]]) + between(rng, -0.15, 0.15, count, 3, 2)
    along = between(rng, -1, 1, count, 2)
    c, s = (along / np.sqrt(along[:, :1] * along[:, :1] + along[:, 1:] * along[:, 1:])).T[:, :, None]
    flat = [c * y[..., 0] - s * y[..., 1], (s * y[..., 0] + c * y[..., 1]) / thin, 0 * y[..., 0]]
    placed = size[..., None] * apply(rotations(rng, count)[:, None], np.stack(flat, axis=-1))
    return placed + (distance * vectors(rng, count))[:, None, :]


def corners(letter: str, points: np.ndarray) -> Arrays:
    """Vertices (b, 3, 3) as arguments: x0, x1, x2."""
    return {f"{letter}{i}": points[:, i] for i in range(3)}


def points(inputs: Given, letter: str) -> np.ndarray:
    """Arguments x0, x1, x2 as vertices (b, 3, 3)."""
    return np.stack([inputs[f"{letter}{i}"] for i in range(3)], axis=1)


def normals(x: np.ndarray) -> np.ndarray:
    return unit(cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]))


def rounding(x: np.ndarray) -> np.ndarray:
    """How many times rounding grows in formulas of triangles (b, 3, 3), however they are arranged, (b,).

    Twice the area may be a small difference of products of edges, or of places: x1 x x2 + x2 x x0 + x0 x x1.
    """
    long, far = longest_edge(x), np.max(length(x), axis=1)
    return 1 + ((far + long) * long / length(cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]))) ** 2


def longest_edge(x: np.ndarray) -> np.ndarray:
    """Longest edge, (b,)."""
    return np.max([length(x[:, i] - x[:, i - 1]) for i in range(3)], axis=0)


def smallest_height(x: np.ndarray) -> np.ndarray:
    """Smallest height, (b,)."""
    return length(cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])) / longest_edge(x)


def weights_around(rng: Rng, count: int) -> np.ndarray:
    """Shape functions in and around a triangle, whose sum is exactly one."""
    phi12 = np.floor(between(rng, -0.5, 1.0, count, 2) * 2.0**40) / 2.0**40
    return np.stack([1 - phi12[:, 0] - phi12[:, 1], phi12[:, 0], phi12[:, 1]], axis=1)


def with_gradients(rng: Rng) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that lie as the `LIES` say, (b, 3, 3), and what the simulator would hand on as their dphi_dX.

    Both are drawn together: whatever is done to an edge is undone in the row that belongs to it.
    """
    thin, size, distance = LIES.T
    R, long = rotations(rng, len(LIES)), np.stack([size, size / thin], axis=1)[..., None]
    edges, rows = long * transposed(R)[:, :2], transposed(R)[:, :2] / long
    for i, j in ((0, 1), (1, 0)):
        share = between(rng, -0.4, 0.4, len(LIES), 1) * (thin[:, None] if j == 0 else 1 / thin[:, None])
        edges[:, j] += share * edges[:, i]
        rows[:, i] -= share * rows[:, j]
    first = distance[:, None] * vectors(rng, len(LIES))
    X = np.stack([first, first + edges[:, 0], first + edges[:, 1]], axis=1)
    return X, np.concatenate([-(rows[:, :1] + rows[:, 1:]), rows], axis=1)


def material(rng: Rng, count: int) -> Arrays:
    """Lamé parameters, never near each other, so that swapping them shows."""
    mu = binades(rng, 7, 16, count)
    softer = np.arange(count) % 2 == 0
    ratio = np.where(softer, between(rng, 0.1, 0.7, count), between(rng, 1.5, 8, count))
    return {"mu": mu, "lam": ratio * mu}


def stretches(rng: Rng, count: int) -> np.ndarray:
    """Stretched, compressed or both, now and then alike; the normal's is 1, (b, 3)."""
    s = np.where(
        rng.random((count, 2)) < 0.5, between(rng, 0.2, 0.95, count, 2), between(rng, 1.05, 2.5, count, 2)
    )
    s[::4, 1] = s[::4, 0]
    return np.concatenate([s, np.ones((count, 1))], axis=1)


def states(rng: Rng, count: int = 8) -> Arrays:
    return {"s": stretches(rng, count), **material(rng, count)}


def sheets(rng: Rng, count: int) -> Arrays:
    """Area, density, thickness."""
    ranges = {"area": (-13, 0), "rho": (0, 10), "h": (-13, 0)}
    return {name: binades(rng, *span, count) for name, span in ranges.items()}


def stresses(rng: Rng, count: int = 8) -> Arrays:
    """Arguments of dpsi_dF: two rotations, and a gradient with nothing in the third place."""
    p = vectors(rng, count) * binades(rng, 7, 16, count)[:, None] * np.array([1, 1, 0])
    return {"U": rotations(rng, count), "dpsi_ds": p, "V": rotations(rng, count)}


def undeformed(rng: Rng) -> Arrays:
    return corners("X", triangles(rng))


def deformed(rng: Rng) -> Arrays:
    return corners("x", triangles(rng))


def moved(*names: str) -> Change:
    """Change: points moved by a few sizes of their triangle (the last three names)."""

    def change(rng: Rng, a: Arrays) -> Arrays:
        size = longest_edge(np.stack([a[name] for name in names[-3:]], axis=1))
        t = 2 * size[:, None] * vectors(rng, len(size))
        return {name: a[name] + t for name in names}

    return change


def rigidly(*names: str) -> Change:
    """Change: points turned and moved together."""
    return lambda rng, a: moved(*names)(rng, turned(*names)(rng, a))


def renumbered(*names: str) -> Change:
    """Change: vertex 1 is called 0, 2 is called 1, 0 is called 2."""
    return lambda rng, a: {name: a[other] for name, other in zip(names, names[1:] + names[:1], strict=True)}


def reversed(*names: str) -> Change:
    """Change: two principal directions reversed, the same in every matrix."""

    def change(rng: Rng, a: Arrays) -> Arrays:
        signs = REVERSED[np.arange(len(a[names[0]])) % len(REVERSED)]
        return {name: a[name] * signs[:, None, :] for name in names}

    return change


def left(*names: str) -> Change:
    """Change: matrices turned, A -> Q A."""
    return lambda rng, a: {name: mul(Q, a[name]) for name in names}
