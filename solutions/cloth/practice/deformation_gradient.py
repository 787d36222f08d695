"""deformation_gradient: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging import Change, Derivative, Given, Inputs, Line, Outputs, Property, Rng, Tested
from muslin.judging.differences import longest, stepped
from muslin.judging.relations import (
    OMEGA,
    STRAIN,
    Q,
    again,
    follows,
    in_turn,
    norms,
    relative,
    run_of,
    split_runs,
    sweep,
    turned,
    vanishes,
)
from muslin.judging.vectors import I, apply, cross, mul, outer, transposed
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
    rounding,
    smallest_height,
    with_gradients,
)


def terms_deformation_gradient(a: Given) -> Any:
    """Size of the terms that deformation_gradient is a sum of, (b,)."""
    return 1 + largest_of(a, "x0", "x1", "x2") * size_of(a["dphi_dX"])


def _carried(rng: Rng) -> np.ndarrays:
    """Deformed triangles, with the shape gradients and normals of undeformed ones."""
    X, G = with_gradients(rng)
    return {**deformed(rng), "dphi_dX": G, "N": normals(X)}


def _mapped(A: np.ndarray) -> Inputs:
    """Triangles deformed by x = A X + t."""

    def inputs(rng: Rng) -> np.ndarrays:
        X, G = with_gradients(rng)
        x = moved("x0", "x1", "x2")(rng, corners("x", apply(A, X)))
        return {**x, "dphi_dX": G, "N": normals(X)}

    return inputs


def _plane(a: Given, F: np.ndarray) -> np.ndarray:
    """F on the undeformed plane."""
    return F - outer(apply(F, a["N"]), a["N"])


properties_deformation_gradient = (
    Property(
        "rigid motion gives its rotation",
        "A triangle that is only turned and moved must have that rotation as its F.",
        _mapped(Q),
        vanishes(terms_deformation_gradient, lambda a, F: F - Q),
    ),
    Property(
        "an affine map is its own gradient",
        "Under x = A X + t, F must do to every vector in the plane of the triangle what A does.",
        _mapped(STRAIN),
        vanishes(terms_deformation_gradient, lambda a, F: _plane(a, F - STRAIN)),
    ),
    Property(
        "the normal goes to the normal",
        "F N must be the unit normal n of the deformed triangle.",
        _carried,
        vanishes(terms_deformation_gradient, lambda a, F: apply(F, a["N"]) - normals(points(a, "x"))),
    ),
    Property(
        "rotation equivariance",
        "Turning the deformed triangle, x -> Q x, must turn its deformation gradient: F -> Q F.",
        again(_carried, turned("x0", "x1", "x2")),
        follows(terms_deformation_gradient, lambda F: mul(Q, F)),
    ),
    Property(
        "translation changes nothing",
        "Moving the deformed triangle must not change F.",
        again(_carried, moved("x0", "x1", "x2")),
        follows(terms_deformation_gradient, lambda F: F),
    ),
)


def _each_vertex(*changes: Change) -> Inputs:
    """Deformed triangles with i = 0, 1 and 2 one after another; and the same again, changed."""

    def inputs(rng: Rng) -> np.ndarrays:
        x = deformed(rng)
        return in_turn(*({**x, "i": np.full(len(LIES), i, dtype=np.int32)} for i in range(3)))

    return again(inputs, *changes)


def _all_vertices(
    rest: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    scale: Callable[[np.ndarray], Any] = lambda x: 1.0,
) -> Tested:
    """`rest(x, n, dn)` of the three derivatives together, dn (3, b, 3, 3), is zero."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        x, dn = points(run_of(a, 0, 3), "x"), split_runs(out[0], 3)
        x = x - x.mean(axis=1, keepdims=True)
        return relative(rest(x, normals(x), dn), sum(norms(one) for one in dn) * scale(x))

    return error


def _normal_sweep(a: Given, out: Outputs) -> np.ndarray:
    """Columns of dn/dx_i against differences of n; steps are shares of the triangle's height."""
    x = points(a, "x") - a["x0"][:, None]
    height = smallest_height(x)[:, None]
    chosen = (a["i"][:, None] == np.arange(3))[..., None]
    return np.max(
        [
            sweep(
                out[0][..., k] * height,
                lambda t, k=k: normals(x + t * height[:, None] * chosen * I[k]),  # type: ignore[misc]
                1.0,
                (2.0**-3, 2.0**-5, 2.0**-7, 2.0**-9),
            )
            for k in range(3)
        ],
        axis=0,
    )


properties_dn_dx = (
    Property(
        "tangent to n",
        "n keeps its length, so no vertex can change it along itself: n^T dn/dx_i must be zero.",
        _each_vertex(),
        vanishes(None, lambda a, dn: apply(transposed(dn), normals(points(a, "x")))),
    ),
    Property(
        "motions in the plane leave n alone",
        "Moving a vertex along an edge does not turn the triangle: dn/dx_i times an edge must be zero.",
        _each_vertex(),
        vanishes(
            None,
            lambda a, dn: mul(dn, transposed(points(a, "x") - points(a, "x")[:, [1, 2, 0]])),
            lambda a: longest_edge(points(a, "x")),
        ),
    ),
    Property(
        "translation leaves n alone",
        "Moving all three vertices together does not turn the triangle: dn/dx_0 + dn/dx_1 + dn/dx_2 must be zero.",
        _each_vertex(),
        _all_vertices(lambda x, n, dn: dn.sum(axis=0)),
    ),
    Property(
        "rotation turns n with the triangle",
        "When the triangle spins with angular velocity w, n must change by w x n.",
        _each_vertex(),
        _all_vertices(
            lambda x, n, dn: (
                sum(apply(dn[i], cross(OMEGA[None], x[:, i])) for i in range(3)) - cross(OMEGA[None], n)
            ),
            longest_edge,
        ),
    ),
    Property(
        "rotation equivariance",
        "Turning the triangle by Q must turn the derivative: dn/dx_i -> Q dn/dx_i Q^T.",
        _each_vertex(turned("x0", "x1", "x2")),
        follows(None, lambda dn: mul(mul(Q, dn), Q.T)),
    ),
    Property(
        "finite differences of the normal",
        "Moving vertex i by ever smaller steps, the change of n per step must approach dn/dx_i.",
        _each_vertex(),
        _normal_sweep,
    ),
)


def _unit_normal(a: Any, b: Any, c: Any) -> Any:
    m = np.cross(b - a, c - a)
    return m / np.linalg.norm(m)


def _deformed(a: Given) -> dict[str, Any]:
    m = np.cross(a["x1"] - a["x0"], a["x2"] - a["x0"])
    return {"m = (x1-x0) x (x2-x0)": m, "|m|": np.linalg.norm(m), "n": m / np.linalg.norm(m)}


def _edges(a: Given) -> dict[str, Any]:
    x, i = [a["x0"], a["x1"], a["x2"]], int(a["i"])
    n = _unit_normal(*x)
    return {
        "edge opposite vertex i": x[(i + 2) % 3] - x[(i + 1) % 3],
        "I - n n^T": np.eye(3) - np.outer(n, n),
    }


steps_deformation_gradient = _deformed


def steps_dn_dx(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return _deformed(a) | _edges(a)


def _line_dn_dx(io: Any) -> Line:
    a = io.cases("dn_dx")
    a = {key: value[fattest(a["x0"], a["x1"], a["x2"])] for key, value in a.items()}
    d = io.direction(3) * longest(a["x1"] - a["x0"], a["x2"] - a["x0"])[:, None]

    def at(t: np.ndarray) -> np.ndarray:
        x = [stepped(a[f"x{k}"], t, d * (a["i"] == k)[:, None]) for k in range(3)]
        m = np.cross(x[1] - x[0], x[2] - x[0])
        return m / np.linalg.norm(m, axis=-1, keepdims=True)

    along = lambda J: np.einsum("cij,cj->ci", J, d)  # noqa: E731
    return Line(at, along(io.yours("dn_dx", **a)), along(io.true("dn_dx", **a)))


def loss_deformation_gradient(a: Given) -> Any:
    """How many times rounding grows: in cross products of places, and in products of edges, (b,)."""
    return rounding(points(a, "x"))


loss_dn_dx = loss_deformation_gradient
derivative_dn_dx = Derivative("the unit normal, one vertex moved", "central", _line_dn_dx)
