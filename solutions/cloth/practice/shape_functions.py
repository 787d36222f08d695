"""shape_functions: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Derivative, Given, Line, Property, Rng
from muslin.judging.differences import flat, longest, stepped
from muslin.judging.relations import (
    FACTOR,
    OMEGA,
    STRAIN,
    Q,
    again,
    between,
    follows,
    in_turn,
    summed,
    times,
    turned,
    vanishes,
)
from muslin.judging.vectors import I, apply, dot, mul, outer, transposed
from muslin.tasks.comparing import largest_of, size_of

from .stretched import fattest
from .triangles import (
    LIES,
    corners,
    deformed,
    longest_edge,
    moved,
    normals,
    points,
    renumbered,
    rigidly,
    rounding,
    triangles,
    undeformed,
    weights_around,
)


def terms_phi(a: Given) -> Any:
    """Size of the terms that phi is a sum of, (b,)."""
    return 1.0


def terms_interpolate(a: Given) -> Any:
    """Size of the terms that interpolate is a sum of, (b,)."""
    return largest_of(a, "x0", "x1", "x2") * size_of(a["phi"])


def _point(rng: Rng) -> np.ndarrays:
    """Points in and around triangles, above and below their plane."""
    X = triangles(rng)
    above = between(rng, -0.5, 0.5, len(X)) * longest_edge(X)
    return {
        "X": apply(transposed(X), weights_around(rng, len(X))) + above[:, None] * normals(X),
        **corners("X", X),
    }


def _raised(rng: Rng, a: np.ndarrays) -> np.ndarrays:
    """Change: the point moves along the normal."""
    X = points(a, "X")
    return {"X": a["X"] + (between(rng, 0.2, 1, len(X)) * longest_edge(X))[:, None] * normals(X)}


def _phi_at_vertices(rng: Rng) -> np.ndarrays:
    a = undeformed(rng)
    return in_turn(*({"X": a[f"X{i}"], **a} for i in range(3)))


def _nearest(a: Given, phi: np.ndarray) -> np.ndarray:
    """Sum of phi_i X_i, less the nearest point of the plane, seen from X0."""
    X, d = points(a, "X"), a["X"] - a["X0"]
    N = normals(X)
    return apply(transposed(X - X[:, :1]), phi) - (d - dot(N, d)[:, None] * N)


properties_phi = (
    Property(
        "partition of unity",
        "The three shape functions must sum to one at every point.",
        _point,
        vanishes(terms_phi, lambda a, phi: phi.sum(axis=1) - 1),
    ),
    Property(
        "Kronecker delta at the vertices",
        "At a vertex its own shape function must be one and the other two zero.",
        _phi_at_vertices,
        vanishes(terms_phi, lambda a, phi: phi - np.repeat(I, len(LIES), axis=0)),
    ),
    Property(
        "linear functions are reproduced",
        "The vertices, weighted with the shape functions, must give the point's nearest point in the plane.",
        _point,
        vanishes(terms_phi, _nearest, lambda a: longest_edge(points(a, "X"))),
    ),
    Property(
        "blind to an offset along the normal",
        "Moving the point along the normal of the triangle must not change its shape functions.",
        again(_point, _raised),
        follows(terms_phi, lambda phi: phi),
    ),
    Property(
        "rigid motion changes nothing",
        "Turning and moving the point together with its triangle must not change its shape functions.",
        again(_point, rigidly("X", "X0", "X1", "X2")),
        follows(terms_phi, lambda phi: phi),
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must renumber the shape functions in the same way.",
        again(_point, renumbered("X0", "X1", "X2")),
        follows(terms_phi, lambda phi: np.roll(phi, -1, axis=1)),
    ),
)


def _linear_exact(a: Given, G: np.ndarray) -> np.ndarray:
    """Sum of X_i grad_i^T, less I - N N^T; X_i seen from their middle."""
    X = points(a, "X")
    N = normals(X)
    return mul(transposed(X - X.mean(axis=1, keepdims=True)), G) - (I - outer(N, N))


properties_dphi_dX = (
    Property(
        "rows sum to zero",
        "The shape functions sum to one everywhere, so their gradients, the rows, must sum to zero.",
        undeformed,
        vanishes(None, lambda a, G: G.sum(axis=1)),
    ),
    Property(
        "rows lie in the plane",
        "Every row must be orthogonal to the normal N of the triangle.",
        undeformed,
        vanishes(None, lambda a, G: apply(G, normals(points(a, "X")))),
    ),
    Property(
        "exact on linear functions",
        "The sum of X_i times row i must be I - N N^T: a linear function has its own gradient.",
        undeformed,
        vanishes(None, _linear_exact, lambda a: longest_edge(points(a, "X"))),
    ),
    Property(
        "shrinks as the triangle grows",
        "A triangle larger by a factor must have gradients smaller by that factor.",
        again(undeformed, times("X0", "X1", "X2")),
        follows(None, lambda G: G / FACTOR),
    ),
    Property(
        "turns with the triangle",
        "Turning the triangle must turn every row with it.",
        again(undeformed, turned("X0", "X1", "X2")),
        follows(None, lambda G: mul(G, Q.T)),
    ),
    Property(
        "translation changes nothing",
        "Moving the triangle must not change the gradients.",
        again(undeformed, moved("X0", "X1", "X2")),
        follows(None, lambda G: G),
    ),
)


def _weighted(rng: Rng) -> np.ndarrays:
    return {"phi": weights_around(rng, len(LIES)), **deformed(rng)}


def _weighted_vertices(rng: Rng) -> np.ndarrays:
    x = deformed(rng)
    return in_turn(*({"phi": np.tile(I[i], (len(LIES), 1)), **x} for i in range(3)))


properties_interpolate = (
    Property(
        "vertices",
        "Where one shape function is one and the others are zero, the point must be that vertex.",
        _weighted_vertices,
        vanishes(terms_interpolate, lambda a, x: x - apply(transposed(points(a, "x")), a["phi"])),
    ),
    Property(
        "linear in the vertices",
        "x(X) = N(X) q is linear in q: the sum of two sets of vertices must give the sum of the points.",
        summed(_weighted, "x0", "x1", "x2"),
        follows(terms_interpolate, lambda x, y: x + y, runs=3),
    ),
    Property(
        "straight lines stay straight",
        "Halfway between two points the shape functions are halfway, and so must be the interpolated point.",
        again(
            _weighted,
            lambda rng, a: {"phi": np.roll(a["phi"], 1, axis=1)},
            lambda rng, a: {"phi": (a["phi"] + np.roll(a["phi"], 1, axis=1)) / 2},
        ),
        follows(terms_interpolate, lambda x, y: (x + y) / 2, runs=3),
    ),
    Property(
        "follows affine maps",
        "Stretching, shearing and moving all three vertices must do the same to the point.",
        again(
            _weighted,
            lambda rng, a: {name: apply(STRAIN, a[name]) + OMEGA for name in ("x0", "x1", "x2")},
        ),
        follows(terms_interpolate, lambda x: apply(STRAIN, x) + OMEGA),
    ),
)


def _triangle(a: Given, X: str = "X") -> dict[str, Any]:
    D = np.stack([a[f"{X}1"] - a[f"{X}0"], a[f"{X}2"] - a[f"{X}0"]], axis=1)
    m = np.cross(D[:, 0], D[:, 1])
    return {"D": D, "D^T D": D.T @ D, "m": m, "|m|": np.linalg.norm(m)}


def steps_phi(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return _triangle(a) | {"X - X0": a["X"] - a["X0"]}


steps_dphi_dX = _triangle


def _line_dphi_dX(io: Any) -> Line:
    a = io.cases("dphi_dX")
    a = {key: value[fattest(*a.values())] for key, value in a.items()}
    d = io.direction(3) * longest(a["X1"] - a["X0"], a["X2"] - a["X0"])[:, None]

    def at(t: np.ndarray) -> np.ndarray:
        same = {key: (value, False) for key, value in a.items()}
        return flat(lambda **v: io.best("phi", **v), t.shape[1], X=(stepped(a["X0"], t, d), True), **same)

    along = lambda J: np.einsum("cij,cj->ci", J, d)  # noqa: E731
    return Line(at, along(io.yours("dphi_dX", **a)), along(io.true("dphi_dX", **a)))


def loss_dphi_dX(a: Given) -> Any:
    """How many times rounding grows: in cross products of places, and in products of edges, (b,)."""
    return rounding(points(a, "X"))


loss_phi = loss_dphi_dX
derivative_dphi_dX = Derivative("{phi} phi, moved in X", "central", _line_dphi_dX)
