"""Shape functions: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from muslin.judging import Case, Given, Mistake
from muslin.judging.arrays import completed, dot_column, lengths
from muslin.judging.draws import Draw, coarse
from muslin.judging.exact import (
    Matrix,
    Vector,
    add,
    apply,
    cross,
    derivative,
    dot,
    exact,
    norm,
    precise,
    sub,
    times,
    transpose,
    unit_normal,
)

from .triangles import draw_triangle, draw_weights, pick


def truth_phi(X: Vector, X0: Vector, X1: Vector, X2: Vector) -> Vector:
    """The nearest point of the plane parts the triangle in three: phi_i is the share opposite vertex i."""
    m = cross(sub(X1, X0), sub(X2, X0))
    P = sub(X, times(dot(m, sub(X, X0)) / dot(m, m), m))
    parts = (cross(sub(b, P), sub(c, P)) for b, c in ((X1, X2), (X2, X0), (X0, X1)))
    return [dot(m, part) / dot(m, m) for part in parts]


def truth_dphi_dX(X0: Vector, X1: Vector, X2: Vector) -> Matrix:
    """`_phi`, differentiated in X."""
    return transpose([derivative(lambda X: truth_phi(X, X0, X1, X2), X0, k) for k in range(3)])


def truth_interpolate(phi: Vector, x0: Vector, x1: Vector, x2: Vector) -> Vector:
    """N(X) q with the 3x9 matrix written out."""
    shape_matrix = [[phi[m // 3] if m % 3 == k else precise().zero for m in range(9)] for k in range(3)]
    return apply(shape_matrix, [*x0, *x1, *x2])


def gradients(X0: Vector, X1: Vector, X2: Vector) -> Matrix:
    """Gradients of the shape functions that sum to zero exactly, also after rounding to float64."""
    rows = truth_dphi_dX(X0, X1, X2)
    largest = max(abs(float(entry)) for row in rows for entry in row)
    quantum = math.ldexp(1.0, math.frexp(largest)[1] - 50)
    g1, g2 = ([coarse(entry, quantum) for entry in row] for row in rows[1:])
    return [[-p - q for p, q in zip(g1, g2, strict=True)], g1, g2]


def draw_phi(draw: Draw, k: int) -> dict[str, Any]:
    """Points inside, outside, above and below the plane, at a vertex, at the middle of an edge."""
    T = draw_triangle(draw, k)
    X012 = [T["X0"], T["X1"], T["X2"]]
    half, zero, one = precise().mpf(0.5), precise().zero, precise().one
    weights = (
        draw_weights(draw),
        draw_weights(draw, 4),
        [[one, zero, zero], [zero, one, zero], [zero, zero, one]][k // 4 % 3],
        [[half, half, zero], [zero, half, half], [half, zero, half]][k // 4 % 3],
    )[k % 4]
    X = truth_interpolate(weights, *X012)
    size = norm(sub(T["X1"], T["X0"]))
    if k % 4 < 2:
        X = add(X, times(draw.between(-0.5, 0.5) * size, unit_normal(*X012)))
    return {"X": X, **pick(T, "X0", "X1", "X2")}


def draw_dphi_dX(draw: Draw, k: int) -> dict[str, Any]:
    return pick(draw_triangle(draw, k), "X0", "X1", "X2")


def draw_interpolate(draw: Draw, k: int) -> dict[str, Any]:
    """Points inside and outside, and at each vertex."""
    at_vertex = exact([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    phi = at_vertex[k // 4 % 3] if k % 4 == 3 else draw_weights(draw, (1, 1, 3)[k % 4])
    return {"phi": phi, **pick(draw_triangle(draw, k), "x0", "x1", "x2")}


def _edges(a: Case) -> tuple[np.ndarray, np.ndarray]:
    return a.X1 - a.X0, a.X2 - a.X0


def _unsigned_areas(a: Case) -> np.ndarray:
    corners = (a.X0, a.X1, a.X2)
    shares = [lengths(np.cross(corners[k - 2] - a.X, corners[k - 1] - a.X)) for k in range(3)]
    return np.stack(shares, axis=1) / lengths(np.cross(*_edges(a)))[:, None]


def _phi_unit_edges(a: Case) -> np.ndarray:
    e, f = _edges(a)
    return completed(lengths(e) * a.right[:, 1], lengths(f) * a.right[:, 2], 1)


def _phi_apart(a: Case) -> tuple[np.ndarray, ...]:
    d, (e, f) = a.X - a.X0, _edges(a)
    along = [
        (dot_column(d, e)[:, 0] / lengths(e) ** p, dot_column(d, f)[:, 0] / lengths(f) ** p)
        for p in (2, 1, 0)
    ]
    return tuple(completed(first, second, 1) for first, second in along)


def _gradients_apart(a: Case) -> tuple[np.ndarray, ...]:
    e, f = _edges(a)
    along = [(e / lengths(e)[:, None] ** p, f / lengths(f)[:, None] ** p) for p in (2, 1, 0)]
    return tuple(completed(first, second, 0) for first, second in along)


def _opposite_edges(a: Case) -> np.ndarray:
    return (
        np.stack([a.X2 - a.X1, a.X0 - a.X2, a.X1 - a.X0], axis=1)
        / lengths(np.cross(*_edges(a)))[:, None, None]
    )


def _gradients_unit_edges(a: Case) -> np.ndarray:
    e, f = _edges(a)
    return completed(lengths(e)[:, None] * a.right[:, 1], lengths(f)[:, None] * a.right[:, 2], 0)


def _heights(a: Case) -> np.ndarray:
    """Gradients as long as the heights, not one over them."""
    return a.right / np.sum(a.right**2, axis=2, keepdims=True)


mistakes_phi = (
    Mistake(
        "missing:X0",
        "X0 is not subtracted from X: your phi is right only if vertex 0 is the origin.",
        "A triangle that is moved must keep its barycentric coordinates. Measure from a vertex.",
        lambda a: a.truth(X=a.X + a.X0),
    ),
    Mistake(
        "unsigned areas",
        "Your phi are shares of area without a sign: outside the triangle none of them is negative.",
        "Give each area a sign, positive if it turns the same way round as the triangle.",
        _unsigned_areas,
    ),
    Mistake(
        "edges apart",
        "The edges are treated one at a time, as if they were perpendicular.",
        "Two unknowns need both equations at once: a 2x2 system.",
        _phi_apart,
    ),
    Mistake(
        "unit edges",
        "Your phi count metres along the edges: the edges have been made of length one.",
        "phi_1 must be 1 at vertex 1, however long the edge is.",
        _phi_unit_edges,
    ),
)


said_phi = {
    "permuted:1,2,0": (
        "The components are in another order: phi_0 comes last in yours.",
        "The first component belongs to vertex 0: at X0 it is 1.",
    ),
    "absolute": (
        "Your phi are never negative, also outside the triangle.",
        "Give each area a sign, positive if it turns the same way round as the triangle.",
    ),
    "component 0": ("", "The three shape functions sum to one, everywhere."),
    "component 0: zeros": ("", "The three shape functions sum to one, everywhere."),
}


mistakes_dphi_dX = (
    Mistake(
        "edges apart",
        "The edges are treated one at a time, as if they were perpendicular.",
        "Each gradient must be perpendicular to the edge opposite its vertex. Is yours?",
        _gradients_apart,
    ),
    Mistake(
        "unit edges",
        "The edges have been made of length one, so your gradients do not know the size of the triangle.",
        "Doubling the triangle must halve the gradients.",
        _gradients_unit_edges,
    ),
    Mistake(
        "not turned",
        "Row i points along the edge opposite vertex i, not across it.",
        "A gradient points where phi_i grows: from the opposite edge towards the vertex.",
        _opposite_edges,
    ),
    Mistake(
        "heights",
        "Your gradients point the right way, but are as long as the heights of the triangle.",
        "phi_i grows by one over the whole height: how much per metre?",
        _heights,
    ),
)


said_dphi_dX = {
    **{
        cause: (
            "A singular matrix has been inverted: your gradients are huge, or not finite, nearly everywhere.",
            "Which of the two products of D and its transpose is 2x2, and which is 3x3 and singular?",
        )
        for cause in ("singular", "nan")
    },
    "scaled:2": ("", "The cross product of two edges is as long as twice the area."),
    "scaled:1/2": ("", "The cross product of two edges is as long as twice the area."),
    "transposed": (
        "Rows and columns are exchanged: your columns are the gradients.",
        "Row i of the result is the gradient of phi_i.",
    ),
    "row 0: zeros": (
        "Row 0 is zero: the gradient of phi_0 has been forgotten.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
    ),
    "row 0: negated": (
        "Row 0 has the opposite sign.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
    ),
    "row 0": (
        "Row 0 is wrong: the three rows do not sum to zero.",
        "The shape functions sum to one everywhere. What do their gradients sum to?",
    ),
    "rows normalised": (
        "",
        "phi_i grows from 0 to 1 over one height of the triangle. How much is that per metre?",
    ),
}


mistakes_interpolate = (
    Mistake(
        "average",
        "Your point is the centre of the triangle, whatever phi is.",
        "Weight each vertex with its own shape function.",
        lambda a: (a.x0 + a.x1 + a.x2) / 3,
    ),
    Mistake(
        "missing:phi",
        "Your point is the sum of the vertices, without the shape functions.",
        "Weight each vertex with its own shape function.",
        lambda a: a.x0 + a.x1 + a.x2,
    ),
    Mistake(
        "entry by entry",
        "Component k of your point comes from one vertex, or is weighted by phi_k.",
        "A shape function multiplies a whole vertex, all three components of it.",
        lambda a: (
            np.stack([a.phi[:, k] * (a.x0, a.x1, a.x2)[k][:, k] for k in range(3)], axis=1),
            a.phi * (a.x0 + a.x1 + a.x2),
        ),
    ),
    Mistake(
        "transposed vertices",
        "The vertices stand in the rows of your matrix, where they should be columns.",
        "phi_0 must multiply vertex 0: look what it multiplies in your product.",
        lambda a: np.stack([dot_column(x, a.phi)[:, 0] for x in (a.x0, a.x1, a.x2)], axis=1),
    ),
)


said_interpolate = {
    "lacks:x0": (
        "The edges are weighted, and vertex 0 is not added.",
        "Either weight the three vertices, or begin at vertex 0.",
    ),
}


def conditions_phi(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    m = np.cross(a["X1"] - a["X0"], a["X2"] - a["X0"])
    offset = np.abs(np.sum(m * (a["X"] - a["X0"]), axis=1)) / np.sum(m * m, axis=1) ** 0.75
    yield "X lies off the triangle's plane", offset > 1e-6


def conditions_interpolate(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    yield "phi is negative somewhere", (a["phi"] < 0).any(axis=1)
    yield "the point is a vertex", (a["phi"] == 1).any(axis=1)
