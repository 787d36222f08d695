"""shape_functions: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Derivative, Given, Line, Property, Rng
from muslin.judging.differences import CASES, flat, longest, stepped
from muslin.judging.relations import (
    FACTOR,
    OMEGA,
    STRAIN,
    Q,
    again,
    follows,
    in_turn,
    summed,
    times,
    turned,
    vanishes,
)
from muslin.judging.vectors import I, apply, mul
from muslin.tasks.comparing import largest_of, size_of

from .tetrahedra import (
    LIES,
    combined,
    deformed,
    longest_edge,
    moved,
    points,
    renumbered,
    rigidly,
    tetrahedra,
    undeformed,
    weights_around,
)
from .tetrahedra import corners as as_arguments

FOUR = np.eye(4)


def terms_phi(a: Given) -> Any:
    """Size of the terms that phi is a sum of, (b,)."""
    return 1.0


def terms_interpolate(a: Given) -> Any:
    """Size of the terms that interpolate is a sum of, (b,)."""
    return largest_of(a, "x0", "x1", "x2", "x3") * size_of(a["phi"])


def _point(rng: Rng) -> Arrays:
    """Points in and around tetrahedra."""
    X = tetrahedra(rng)
    return {"X": combined(X, weights_around(rng, len(X))), **as_arguments("X", X)}


def _at_vertices(rng: Rng) -> Arrays:
    a = undeformed(rng)
    return in_turn(*({"X": a[f"X{i}"], **a} for i in range(4)))


def _reproduced(a: Given, phi: np.ndarray) -> np.ndarray:
    """Sum of phi_i X_i, less X, all seen from X0."""
    X = points(a, "X")
    return combined(X - X[:, :1], phi) - (a["X"] - a["X0"])


#: Largest error of a right phi: worked out from places, 4x4 determinants, it is 2e-10 on the most distant solids.
OF_PLACES = 1e-8

properties_phi = (
    Property(
        "partition of unity",
        "The four shape functions must sum to one at every point.",
        _point,
        vanishes(terms_phi, lambda a, phi: phi.sum(axis=1) - 1),
        tolerance=OF_PLACES,
    ),
    Property(
        "Kronecker delta at the vertices",
        "At a vertex its own shape function must be one and the other three zero.",
        _at_vertices,
        vanishes(terms_phi, lambda a, phi: phi - np.repeat(FOUR, len(LIES), axis=0)),
        tolerance=OF_PLACES,
    ),
    Property(
        "linear functions are reproduced",
        "The vertices, weighted with the shape functions, must give the point itself.",
        _point,
        vanishes(terms_phi, _reproduced, lambda a: longest_edge(points(a, "X"))),
        tolerance=OF_PLACES,
    ),
    Property(
        "rigid motion changes nothing",
        "Turning and moving the point together with its tetrahedron must not change its shape functions.",
        again(_point, rigidly("X", "X0", "X1", "X2", "X3")),
        follows(terms_phi, lambda phi: phi),
        tolerance=OF_PLACES,
    ),
    Property(
        "size changes nothing",
        "A tetrahedron larger by a factor, and the point with it, must have the same shape functions.",
        again(_point, times("X", "X0", "X1", "X2", "X3")),
        follows(terms_phi, lambda phi: phi),
        tolerance=OF_PLACES,
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must renumber the shape functions in the same way.",
        again(_point, renumbered("X0", "X1", "X2", "X3")),
        follows(terms_phi, lambda phi: np.roll(phi, -1, axis=1)),
        tolerance=OF_PLACES,
    ),
)


def _linear_exact(a: Given, G: np.ndarray) -> np.ndarray:
    """Sum of X_i grad_i^T, less the identity; X_i seen from their middle."""
    X = points(a, "X")
    X = X - X.mean(axis=1, keepdims=True)
    return sum(X[:, i, :, None] * G[:, i, None, :] for i in range(4)) - I  # type: ignore[no-any-return]


properties_dphi_dX = (
    Property(
        "rows sum to zero",
        "The shape functions sum to one everywhere, so their gradients, the rows, must sum to zero.",
        undeformed,
        vanishes(None, lambda a, G: G.sum(axis=1)),
    ),
    Property(
        "exact on linear functions",
        "The sum of X_i times row i must be the identity: a linear function has its own gradient.",
        undeformed,
        vanishes(None, _linear_exact, lambda a: longest_edge(points(a, "X"))),
    ),
    Property(
        "across the opposite face",
        "Row 0 must be perpendicular to the face opposite vertex 0: phi_0 is zero on all of it.",
        undeformed,
        vanishes(
            None,
            lambda a, G: np.stack(
                [
                    np.sum(G[:, 0] * (a["X2"] - a["X1"]), axis=1),
                    np.sum(G[:, 0] * (a["X3"] - a["X1"]), axis=1),
                ],
                axis=1,
            ),
            lambda a: longest_edge(points(a, "X")),
        ),
    ),
    Property(
        "shrinks as the tetrahedron grows",
        "A tetrahedron larger by a factor must have gradients smaller by that factor.",
        again(undeformed, times("X0", "X1", "X2", "X3")),
        follows(None, lambda G: G / FACTOR),
    ),
    Property(
        "turns with the tetrahedron",
        "Turning the tetrahedron must turn every row with it.",
        again(undeformed, turned("X0", "X1", "X2", "X3")),
        follows(None, lambda G: mul(G, Q.T)),
    ),
    Property(
        "translation changes nothing",
        "Moving the tetrahedron must not change the gradients.",
        again(undeformed, moved("X0", "X1", "X2", "X3")),
        follows(None, lambda G: G),
    ),
)


def _weighted(rng: Rng) -> Arrays:
    return {"phi": weights_around(rng, len(LIES)), **deformed(rng)}


def _weighted_vertices(rng: Rng) -> Arrays:
    x = deformed(rng)
    return in_turn(*({"phi": np.tile(FOUR[i], (len(LIES), 1)), **x} for i in range(4)))


properties_interpolate = (
    Property(
        "vertices",
        "Where one shape function is one and the others are zero, the point must be that vertex.",
        _weighted_vertices,
        vanishes(terms_interpolate, lambda a, x: x - combined(points(a, "x"), a["phi"])),
    ),
    Property(
        "linear in the vertices",
        "x(X) = N(X) q is linear in q: the sum of two sets of vertices must give the sum of the points.",
        summed(_weighted, "x0", "x1", "x2", "x3"),
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
        "Stretching, shearing and moving all four vertices must do the same to the point.",
        again(
            _weighted,
            lambda rng, a: {name: apply(STRAIN, a[name]) + OMEGA for name in ("x0", "x1", "x2", "x3")},
        ),
        follows(terms_interpolate, lambda x: apply(STRAIN, x) + OMEGA),
    ),
)


def _tetrahedron(a: Given) -> dict[str, Any]:
    D = np.stack([a[f"X{k}"] - a["X0"] for k in (1, 2, 3)], axis=1)
    return {"D": D, "det D": np.linalg.det(D)}


def steps_phi(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return _tetrahedron(a) | {"X - X0": a["X"] - a["X0"]}


steps_dphi_dX = _tetrahedron


def steps_interpolate(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {f"phi_{k} x{k}": a["phi"][k] * a[f"x{k}"] for k in range(4)}


def _line_dphi_dX(io: Any) -> Line:
    a = {key: value[:CASES] for key, value in io.cases("dphi_dX").items()}
    d = io.direction(3) * longest(a["X1"] - a["X0"], a["X2"] - a["X0"])[:, None]

    def at(t: np.ndarray) -> np.ndarray:
        same = {key: (value, False) for key, value in a.items()}
        return flat(lambda **v: io.best("phi", **v), t.shape[1], X=(stepped(a["X0"], t, d), True), **same)

    along = lambda J: np.einsum("cij,cj->ci", J, d)  # noqa: E731
    return Line(at, along(io.yours("dphi_dX", **a)), along(io.true("dphi_dX", **a)))


def loss_dphi_dX(a: Given) -> Any:
    """How many times rounding grows where a volume is worked out from places, X1.(X2 x X3) and so on, (b,)."""
    e = [a[f"X{k}"] - a["X0"] for k in (1, 2, 3)]
    far, volume = largest_of(a, "X0", "X1", "X2", "X3"), np.abs(np.sum(e[0] * np.cross(e[1], e[2]), axis=1))
    return 1 + far**3 / volume


loss_phi = loss_dphi_dX
derivative_dphi_dX = Derivative("{phi} phi, moved in X", "central", _line_dphi_dX)
