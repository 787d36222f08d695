"""Shape functions: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from muslin.judging import Case, Given, Mistake
from muslin.judging.arrays import dot_column, transposed
from muslin.judging.draws import Draw, coarse, float64
from muslin.judging.exact import Matrix, Vector, apply, cross, derivative, dot, exact, precise, sub, transpose

from .tetrahedra import draw_tetrahedron, draw_weights, length, pick


def _volume(a: Vector, b: Vector, c: Vector, d: Vector) -> Any:
    """Six times the volume of a tetrahedron, with its sign."""
    return dot(cross(sub(b, a), sub(c, a)), sub(d, a))


def truth_phi(X: Vector, X0: Vector, X1: Vector, X2: Vector, X3: Vector) -> Vector:
    """X parts the tetrahedron in four: phi_i is the share of the volume that has X in place of vertex i."""
    corners = [X0, X1, X2, X3]
    whole = _volume(*corners)
    return [_volume(*(X if k == i else p for k, p in enumerate(corners))) / whole for i in range(4)]


def truth_dphi_dX(X0: Vector, X1: Vector, X2: Vector, X3: Vector) -> Matrix:
    """`truth_phi`, differentiated in X."""
    return transpose([derivative(lambda X: truth_phi(X, X0, X1, X2, X3), X0, k) for k in range(3)])


def truth_interpolate(phi: Vector, x0: Vector, x1: Vector, x2: Vector, x3: Vector) -> Vector:
    """N(X) q with the 3x12 matrix written out."""
    matrix = [[phi[m // 3] if m % 3 == k else precise().zero for m in range(12)] for k in range(3)]
    return apply(matrix, [*x0, *x1, *x2, *x3])


def gradients(X0: Vector, X1: Vector, X2: Vector, X3: Vector) -> Matrix:
    """Gradients of the shape functions that sum to zero exactly, also after rounding to float64."""
    rows = truth_dphi_dX(X0, X1, X2, X3)
    largest = max(abs(float(entry)) for row in rows for entry in row)
    quantum = math.ldexp(1.0, math.frexp(largest)[1] - 49)
    others = [[coarse(entry, quantum) for entry in row] for row in rows[1:]]
    return [[-sum(column) for column in zip(*others, strict=True)], *others]


def draw_phi(draw: Draw, k: int) -> dict[str, Any]:
    """Points inside, outside, at a vertex, at the middle of an edge."""
    T = pick(draw_tetrahedron(draw, k), "X0", "X1", "X2", "X3")
    half = [[0.5, 0.5, 0, 0], [0, 0.5, 0.5, 0], [0, 0, 0.5, 0.5], [0.5, 0, 0, 0.5]]
    weights = (
        draw_weights(draw),
        draw_weights(draw, 4),
        exact(np.eye(4)[k // 4 % 4]),
        exact(half[k // 4 % 4]),
    )[k % 4]
    return {"X": float64(truth_interpolate(weights, *T.values())), **T}


def draw_dphi_dX(draw: Draw, k: int) -> dict[str, Any]:
    return pick(draw_tetrahedron(draw, k), "X0", "X1", "X2", "X3")


def draw_interpolate(draw: Draw, k: int) -> dict[str, Any]:
    """Points inside and outside, and at each vertex."""
    phi = exact(np.eye(4)[k // 4 % 4]) if k % 4 == 3 else draw_weights(draw, (1, 1, 3)[k % 4])
    return {"phi": phi, **pick(draw_tetrahedron(draw, k), "x0", "x1", "x2", "x3")}


def _edges(a: Case) -> np.ndarray:
    """The edge matrix D, (b, 3, 3)."""
    return np.stack([a.X1 - a.X0, a.X2 - a.X0, a.X3 - a.X0], axis=2)


def _whole(three: np.ndarray, total: float) -> np.ndarray:
    """Entries (or rows) 1 to 3, and a zeroth that makes the sum right."""
    return np.concatenate([total - three.sum(axis=1, keepdims=True), three], axis=1)


def _solved(M: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.solve(M, b[..., None])[..., 0]


def _unsigned_volumes(a: Case) -> np.ndarray:
    shares = np.abs(a.right)
    return np.where(np.abs(shares - a.right).max(axis=1, keepdims=True) > 0, shares, a.right)


def _phi_apart(a: Case) -> tuple[np.ndarray, ...]:
    d, D = a.X - a.X0, _edges(a)
    along = np.einsum("bij,bi->bj", D, d)
    lengths = np.linalg.norm(D, axis=1)
    return tuple(_whole(along / lengths**p, 1.0) for p in (2, 1, 0))


def _gradients_apart(a: Case) -> tuple[np.ndarray, ...]:
    D = _edges(a)
    lengths = np.linalg.norm(D, axis=1)
    return tuple(_whole(transposed(D / lengths[:, None, :] ** p), 0.0) for p in (2, 1, 0))


def _other_way(a: Case) -> np.ndarray:
    """The edges as rows where columns are asked."""
    return _whole(_solved(transposed(_edges(a)), a.X - a.X0), 1.0)


def _face_normals(a: Case) -> tuple[np.ndarray, ...]:
    """Normals of the opposite faces: as long as twice the area, of length one, or with the volume below."""
    lengths = np.linalg.norm(a.right, axis=2, keepdims=True)
    volume = np.abs(np.linalg.det(_edges(a)))[:, None, None]
    return a.right / lengths, a.right * volume, a.right * 6, a.right / 6


mistakes_phi = (
    Mistake(
        "missing:X0",
        "X0 is not subtracted from X: your phi is right only if vertex 0 is the origin.",
        "A tetrahedron that is moved must keep its barycentric coordinates. Measure from a vertex.",
        lambda a: a.truth(X=a.X + a.X0),
    ),
    Mistake(
        "edges as rows",
        "The edges stand in the rows of your matrix, where they should be columns.",
        "X - X0 is phi_1 times the first edge, plus phi_2 times the second, plus phi_3 times the third.",
        _other_way,
    ),
    Mistake(
        "not inverted",
        "X - X0 is multiplied with the edges: the system has not been solved.",
        "The unknowns stand beside D: which matrix brings them to stand alone?",
        lambda a: (
            _whole(np.einsum("bij,bj->bi", _edges(a), a.X - a.X0), 1.0),
            _whole(np.einsum("bji,bj->bi", _edges(a), a.X - a.X0), 1.0),
        ),
    ),
    Mistake(
        "edges apart",
        "The edges are treated one at a time, as if they were perpendicular.",
        "Three unknowns need all three equations at once: a 3x3 system.",
        _phi_apart,
    ),
    Mistake(
        "unsigned volumes",
        "Your phi are shares of volume without a sign: outside the tetrahedron none of them is negative.",
        "Give each volume a sign: positive if X lies on the same side of the face as the vertex.",
        _unsigned_volumes,
    ),
    Mistake(
        "unit edges",
        "Your phi count metres along the edges: the edges have been made of length one.",
        "phi_1 must be 1 at vertex 1, however long the edge is.",
        lambda a: _whole(np.linalg.norm(_edges(a), axis=1) * a.right[:, 1:], 1.0),
    ),
    Mistake(
        "vertices as columns",
        "The matrix holds the vertices, not the edges.",
        "Only differences of points matter: the edges that leave X0.",
        lambda a: (
            _whole(_solved(np.stack([a.X1, a.X2, a.X3], axis=2), a.X), 1.0),
            _whole(_solved(np.stack([a.X1, a.X2, a.X3], axis=2), a.X - a.X0), 1.0),
        ),
    ),
    Mistake(
        "phi_0 last",
        "The components are in another order: phi_0 comes last in yours.",
        "The first component belongs to vertex 0: at X0 it is 1.",
        lambda a: a.right[:, [1, 2, 3, 0]],
    ),
    Mistake(
        "phi_0 not the rest",
        "Your phi do not sum to one: phi_0 is missing, or a shape function is not subtracted in it.",
        "The four shape functions sum to one, everywhere.",
        lambda a: tuple(
            np.concatenate([first[:, None], a.right[:, 1:]], axis=1)
            for first in (
                *(a.right[:, 0] + a.right[:, k] for k in (1, 2, 3)),
                0 * a.right[:, 0],
                1 + 0 * a.right[:, 0],
                a.right[:, 1:].sum(axis=1),
                1 + a.right[:, 1:].sum(axis=1),
                -a.right[:, 1:].sum(axis=1),
            )
        ),
    ),
)


said_phi = {
    "permuted:1,2,3,0": (
        "The components are in another order: phi_0 comes last in yours.",
        "The first component belongs to vertex 0: at X0 it is 1.",
    ),
    "absolute": (
        "Your phi are never negative, also outside the tetrahedron.",
        "Give each volume a sign: positive if X lies on the same side of the face as the vertex.",
    ),
    "component 0": ("", "The four shape functions sum to one, everywhere."),
    "component 0: zeros": ("", "The four shape functions sum to one, everywhere."),
}


mistakes_dphi_dX = (
    Mistake(
        "columns of the inverse",
        "Columns of the inverse stand where its rows belong.",
        "phi_1 is row 1 of the inverse times X - X0: which row or column is its gradient?",
        lambda a: _whole(transposed(np.linalg.inv(_edges(a))), 0.0),
    ),
    Mistake(
        "not inverted",
        "These are the edges, not the gradients: nothing has been inverted.",
        "Check the unit: a gradient is in 1/m. Doubling the tetrahedron must halve it.",
        lambda a: (_whole(transposed(_edges(a)), 0.0), _whole(_edges(a), 0.0)),
    ),
    Mistake(
        "edges apart",
        "The edges are treated one at a time, as if they were perpendicular.",
        "Each gradient must be perpendicular to the face opposite its vertex. Is yours?",
        _gradients_apart,
    ),
    Mistake(
        "face normals",
        "Your gradients point the right way, but have the wrong length.",
        "phi_i grows from 0 to 1 over one height of the tetrahedron. How much is that per metre?",
        _face_normals,
    ),
    Mistake(
        "heights",
        "Your gradients point the right way, but are as long as the heights of the tetrahedron.",
        "phi_i grows by one over the whole height: how much per metre?",
        lambda a: a.right / np.sum(a.right**2, axis=2, keepdims=True),
    ),
    Mistake(
        "row 0 not the rest",
        "Row 0 is wrong: the four rows do not sum to zero.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
        lambda a: tuple(
            np.concatenate([first[:, None], a.right[:, 1:]], axis=1)
            for first in (
                0 * a.right[:, 0],
                -a.right[:, 0],
                1 + a.right[:, 0],
                np.ones_like(a.right[:, 0]),
                *(a.right[:, 0] + a.right[:, k] for k in (1, 2, 3)),
            )
        ),
    ),
    Mistake(
        "row 0 last",
        "The rows are in another order: the gradient of phi_0 comes last in yours.",
        "Row 0 belongs to vertex 0.",
        lambda a: a.right[:, [1, 2, 3, 0]],
    ),
)


said_dphi_dX = {
    "rows permuted:1,2,3,0": (
        "The rows are in another order: the gradient of phi_0 comes last in yours.",
        "Row 0 belongs to vertex 0.",
    ),
    "scaled:6": ("", "The box of the edges is six times as large as the tetrahedron."),
    "scaled:1/6": ("", "The box of the edges is six times as large as the tetrahedron."),
    "row 0: zeros": (
        "Row 0 is zero: the gradient of phi_0 has been forgotten.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
    ),
    "row 0: negated": (
        "Row 0 has the opposite sign.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
    ),
    "row 0": (
        "Row 0 is wrong: the four rows do not sum to zero.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
    ),
    "rows normalised": (
        "",
        "phi_i grows from 0 to 1 over one height of the tetrahedron. How much is that per metre?",
    ),
}


mistakes_interpolate = (
    Mistake(
        "average",
        "Your point is the middle of the tetrahedron, whatever phi is.",
        "Weight each vertex with its own shape function.",
        lambda a: (a.x0 + a.x1 + a.x2 + a.x3) / 4,
    ),
    Mistake(
        "missing:phi",
        "Your point is the sum of the vertices, without the shape functions.",
        "Weight each vertex with its own shape function.",
        lambda a: a.x0 + a.x1 + a.x2 + a.x3,
    ),
    Mistake(
        "three vertices",
        "One of the four vertices is missing.",
        "A tetrahedron has four vertices: each is weighted with its own shape function.",
        lambda a: tuple(a.right - a.phi[:, [k]] * x for k, x in enumerate((a.x0, a.x1, a.x2, a.x3))),
    ),
    Mistake(
        "edges without X0",
        "The edges are weighted, and vertex 0 is not added.",
        "Either weight the four vertices, or begin at vertex 0.",
        lambda a: a.right - a.x0,
    ),
    Mistake(
        "other order",
        "The shape functions meet the wrong vertices.",
        "phi_0 multiplies vertex 0, and so on: at a vertex its own shape function is 1.",
        lambda a: tuple(
            sum(a.phi[:, [k]] * (a.x0, a.x1, a.x2, a.x3)[o] for k, o in enumerate(order))
            for order in ((1, 2, 3, 0), (3, 0, 1, 2), (3, 2, 1, 0), (1, 0, 2, 3), (0, 2, 1, 3), (0, 1, 3, 2))
        ),
    ),
    Mistake(
        "transposed vertices",
        "The vertices stand in the rows of your matrix, where they should be columns.",
        "phi_0 must multiply vertex 0: look what it multiplies in your product.",
        lambda a: np.stack([dot_column(x, a.phi[:, :3])[:, 0] for x in (a.x0, a.x1, a.x2)], axis=1),
    ),
    Mistake(
        "weights added",
        "The shape functions are added to the vertices, not multiplied.",
        "A share of a vertex is a product.",
        lambda a: a.x0 + a.x1 + a.x2 + a.x3 + a.phi.sum(axis=1, keepdims=True),
    ),
)


said_interpolate = {
    "lacks:x0": (
        "The edges are weighted, and vertex 0 is not added.",
        "Either weight the four vertices, or begin at vertex 0.",
    ),
}


def conditions_phi(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    yield "vertex 0 is not the origin", length(a["X0"]) > 0


def conditions_interpolate(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    yield "phi is negative somewhere", (a["phi"] < 0).any(axis=1)
    yield "the point is a vertex", (a["phi"] == 1).any(axis=1)
