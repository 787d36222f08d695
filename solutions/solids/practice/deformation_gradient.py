"""deformation_gradient: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Derivative, Given, Inputs, Line, Property, Rng
from muslin.judging.differences import CASES, stepped
from muslin.judging.relations import STRAIN, Q, again, follows, summed, turned, vanishes
from muslin.judging.vectors import I, apply, det, mul
from muslin.tasks.comparing import largest_of, size_of

from .tetrahedra import corners, deformed, moved, points, six_volumes, with_gradients


def terms_deformation_gradient(a: Given) -> Any:
    """Size of the terms that deformation_gradient is a sum of, (b,)."""
    return largest_of(a, "x0", "x1", "x2", "x3") * size_of(a["dphi_dX"])


def _carried(rng: Rng) -> Arrays:
    """Deformed tetrahedra, with the shape gradients of undeformed ones."""
    return {**deformed(rng), "dphi_dX": with_gradients(rng)[1]}


def _mapped(A: np.ndarray) -> Inputs:
    """Tetrahedra deformed by x = A X + t."""

    def inputs(rng: Rng) -> Arrays:
        X, G = with_gradients(rng)
        x = moved("x0", "x1", "x2", "x3")(rng, corners("x", apply(A, X)))
        return {**x, "dphi_dX": G}

    return inputs


def _volumes(a: Given, F: np.ndarray) -> np.ndarray:
    """det F, less the ratio of the volumes, deformed to undeformed."""
    g = a["dphi_dX"][:, 1:]
    return det(F) - six_volumes(points(a, "x")) * det(g)


properties_deformation_gradient = (
    Property(
        "undeformed gives the identity",
        "A tetrahedron that is only moved must have the identity as its F.",
        _mapped(I),
        vanishes(terms_deformation_gradient, lambda a, F: F - I),
    ),
    Property(
        "rigid motion gives its rotation",
        "A tetrahedron that is only turned and moved must have that rotation as its F.",
        _mapped(Q),
        vanishes(terms_deformation_gradient, lambda a, F: F - Q),
    ),
    Property(
        "an affine map is its own gradient",
        "Under x = A X + t, F must be A.",
        _mapped(STRAIN),
        vanishes(terms_deformation_gradient, lambda a, F: F - STRAIN),
    ),
    Property(
        "rotation equivariance",
        "Turning the deformed tetrahedron, x -> Q x, must turn its deformation gradient: F -> Q F.",
        again(_carried, turned("x0", "x1", "x2", "x3")),
        follows(terms_deformation_gradient, lambda F: mul(Q, F)),
    ),
    Property(
        "translation changes nothing",
        "Moving the deformed tetrahedron must not change F.",
        again(_carried, moved("x0", "x1", "x2", "x3")),
        follows(terms_deformation_gradient, lambda F: F),
    ),
    Property(
        "linear in the vertices",
        "The sum of two sets of vertices must give the sum of the gradients.",
        summed(_carried, "x0", "x1", "x2", "x3"),
        follows(terms_deformation_gradient, lambda one, other: one + other, runs=3),
    ),
    Property(
        "the determinant is the change of volume",
        "det F must be the deformed volume over the undeformed one.",
        _carried,
        vanishes(terms_deformation_gradient, _volumes, lambda a: terms_deformation_gradient(a) ** 2),
    ),
)


def steps_deformation_gradient(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {f"x{k} grad_phi_{k}^T": np.outer(a[f"x{k}"], a["dphi_dX"][k]) for k in range(4)}


def _line_deformation_gradient(io: Any) -> Line:
    """F dX against the way of the point, which moves by dX in the undeformed tetrahedron."""
    a = {key: value[:CASES] for key, value in io.cases("deformation_gradient").items()}
    x, g = points(a, "x"), a["dphi_dX"]
    d = io.direction(3) / np.linalg.norm(g, axis=(1, 2))[:, None]
    shares = np.einsum("cij,cj->ci", g, d)

    def at(t: np.ndarray) -> np.ndarray:
        phi = stepped(np.full((len(x), 4), 0.25), t, shares)
        return np.einsum("cki,cij->ckj", phi, x - x[:, :1])

    along = lambda F: np.einsum("cij,cj->ci", F, d)  # noqa: E731
    return Line(at, along(io.yours("deformation_gradient", **a)), along(io.true("deformation_gradient", **a)))


def loss_deformation_gradient(a: Given) -> Any:
    """A sum of products loses no digits beyond those of its terms."""
    return 1.0


derivative_deformation_gradient = Derivative(
    "the point x(X), moved in X", "central", _line_deformation_gradient
)
