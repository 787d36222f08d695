"""Deformation gradient: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging import Case, Mistake
from muslin.judging.arrays import lengths, outer, transposed, unit
from muslin.judging.draws import Draw
from muslin.judging.exact import Matrix, Vector, add, derivative, dot, exact, times, transpose, unit_normal

from .shape_functions import gradients
from .triangles import draw_triangle, pick


def truth_deformation_gradient(x0: Vector, x1: Vector, x2: Vector, dphi_dX: Matrix, N: Vector) -> Matrix:
    """The map X -> sum of phi_i(X) x_i + (offset of X along N) n, differentiated in X."""
    n = unit_normal(x0, x1, x2)

    def x(X: Vector) -> Vector:
        point = times(dot(N, X), n)
        for g, vertex in zip(dphi_dX, (x0, x1, x2), strict=True):
            point = add(point, times(dot(g, X), vertex))
        return point

    return transpose([derivative(x, exact([0, 0, 0]), k) for k in range(3)])


def truth_dn_dx(x0: Vector, x1: Vector, x2: Vector, i: Any) -> Matrix:
    """The unit normal, differentiated in the position of vertex i."""

    def n(x: Vector) -> Vector:
        return unit_normal(x[:3], x[3:6], x[6:])

    return transpose([derivative(n, [*x0, *x1, *x2], 3 * int(i) + k) for k in range(3)])


def draw_deformation_gradient(draw: Draw, k: int) -> dict[str, Any]:
    T = draw_triangle(draw, k)
    X = [T["X0"], T["X1"], T["X2"]]
    return {**pick(T, "x0", "x1", "x2"), "dphi_dX": gradients(*X), "N": unit_normal(*X)}


def draw_dn_dx(draw: Draw, k: int) -> dict[str, Any]:
    return {**pick(draw_triangle(draw, k), "x0", "x1", "x2"), "i": k % 3}


def _normal_part(a: Case) -> tuple[np.ndarray, np.ndarray]:
    """F without what carries N to n, and that part."""
    flat = a.truth(N=np.zeros_like(a.N))
    return flat, a.right - flat


def _m(a: Case) -> np.ndarray:
    """The deformed triangle's normal, twice as long as its area."""
    return np.cross(a.x1 - a.x0, a.x2 - a.x0)


def _carried(change: Callable[[Case, np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """F with what carries N to n changed."""

    def makes(a: Case) -> np.ndarray:
        flat, part = _normal_part(a)
        return flat + change(a, part)

    return makes


def _vertices_as_rows(a: Case) -> np.ndarray:
    _, part = _normal_part(a)
    return np.stack([a.x0, a.x1, a.x2], axis=1) @ a.dphi_dX + part


def _dm(a: Case) -> np.ndarray:
    """How the triangle's long normal changes with vertex i: it is linear in it, so differences are exact."""
    x = [a.x0 - a.x0, a.x1 - a.x0, a.x2 - a.x0]

    def m(k: int, step: int) -> np.ndarray:
        y = [p + np.where(a.i == v, step, 0)[:, None] * np.eye(3)[k] for v, p in enumerate(x)]
        return np.cross(y[1] - y[0], y[2] - y[0])

    return np.stack([(m(k, 1) - m(k, -1)) / 2 for k in range(3)], axis=2)


def _turned(project: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """The normal's derivative, projected in another way: project(dm, n n^T) / |m|."""

    def makes(a: Case) -> np.ndarray:
        n = unit(_m(a))
        return project(_dm(a), outer(n, n)) / lengths(_m(a))[:, None, None]

    return makes


mistakes_deformation_gradient = (
    Mistake(
        "normal not normalised",
        "The deformed normal has not been made of length one.",
        "A normal has length one, whatever the size of the triangle: then F N = n keeps the thickness.",
        lambda a: (
            _carried(lambda a, part: part * lengths(_m(a))[:, None, None])(a),
            _carried(lambda a, part: part * lengths(_m(a))[:, None, None] / 2)(a),
        ),
    ),
    Mistake(
        "outer product transposed",
        "The outer product of the normals is the wrong way round.",
        "The matrix must send N to n. Multiply yours by N and see what comes out.",
        _carried(lambda a, part: transposed(part)),
    ),
    Mistake(
        "undeformed normal",
        "The undeformed normal stands where the deformed one should.",
        "A cloth that turns takes its normal along: compute n from the deformed vertices.",
        _carried(lambda a, part: outer(a.N, a.N)),
    ),
    Mistake(
        "deformed normal twice",
        "The deformed normal stands where the undeformed one should, too.",
        "F starts from the undeformed cloth: which normal does it multiply?",
        _carried(lambda a, part: outer(unit(_m(a)), unit(_m(a)))),
    ),
    Mistake(
        "missing vertex",
        "One of the three vertices has been left out.",
        "A cloth that is moved as a whole keeps its F: with a vertex left out it does not.",
        lambda a: tuple(a.right - outer(x, a.dphi_dX[:, k]) for k, x in enumerate((a.x0, a.x1, a.x2))),
    ),
    Mistake(
        "vertices as rows",
        "The vertices stand in the rows of your matrix, where they should be columns.",
        "Each term is a vertex (column) times the gradient of its shape function (row).",
        _vertices_as_rows,
    ),
)


said_deformation_gradient = {
    "missing:N": (
        "The normal is missing: your F flattens everything along N.",
        "Multiply your F by N: it must give the deformed normal, not zero.",
    ),
    "negated:N": (
        "The deformed normal points to the other side.",
        "Look at the order of the edges in the cross product: an undeformed triangle must give the identity.",
    ),
    "transposed": (
        "This is F transposed.",
        "dx = F dX: the vertices are columns, the gradients of the shape functions rows.",
    ),
    "transposed:dphi_dX": (
        "The gradients of the shape functions are used as columns.",
        "Row i of dphi_dX is the gradient of phi_i: which product takes column x_i times that row?",
    ),
}


mistakes_dn_dx = (
    Mistake(
        "not projected",
        "Your derivative has a part along n: the change of length has not been taken away.",
        "A unit vector keeps its length, so n^T dn must be zero. Check yours.",
        _turned(lambda dm, nn: dm),
    ),
    Mistake(
        "not divided",
        "You project, but do not divide by the length of the unnormalised normal.",
        "Check the unit: the result is in 1/m.",
        lambda a: a.right * lengths(_m(a))[:, None, None],
    ),
    Mistake(
        "not normalised",
        "This is the derivative of the unnormalised normal.",
        "Differentiate m/|m|: both the direction and the length of m depend on the vertex.",
        _dm,
    ),
    Mistake(
        "divided twice",
        "You divide by the length of the unnormalised normal once too often.",
        "Check the unit: the result is in 1/m.",
        lambda a: a.right / lengths(_m(a))[:, None, None],
    ),
    Mistake(
        "projected wrongly",
        "The projection keeps the part along n, or adds it once more.",
        "n^T dn must be zero: which part of the change has to go?",
        lambda a: (
            _turned(lambda dm, nn: nn @ dm)(a),
            _turned(lambda dm, nn: dm + nn @ dm)(a),
        ),
    ),
    Mistake(
        "only in a plane",
        "The normal in your projection is fixed: it fits triangles in a coordinate plane only.",
        "Take the triangle's own normal.",
        lambda a: tuple(
            (np.eye(3) - np.outer(z, z)) @ _dm(a) / lengths(_m(a))[:, None, None] for z in np.eye(3)[::-1]
        ),
    ),
    Mistake(
        "wrong edge",
        "This belongs to another vertex, walked the other way round.",
        "Which edge lies opposite vertex i? Walk the triangle always in the same sense.",
        lambda a: (-a.truth(i=(a.i + 1) % 3), -a.truth(i=(a.i + 2) % 3)),
    ),
)


said_dn_dx = {
    "scaled:2": ("", "The cross product of two edges is as long as twice the area."),
    "scaled:1/2": ("", "The cross product of two edges is as long as twice the area."),
    "negated": (
        "Your derivative has the opposite sign: the edge, or its cross-product matrix, is turned round.",
        "Lift one vertex: the normal leans away from it.",
    ),
    "transposed": (
        "Rows and columns are exchanged.",
        "Column k says how n changes when component k of x_i grows.",
    ),
    "negated and transposed": (
        "This is minus the transpose: so it comes out if the projection stands on the wrong side of the product.",
        "It acts on a change of the normal, after that change has been computed.",
    ),
    "shifted:i": (
        "The edges are in the wrong order: this is the derivative by another vertex.",
        "The edge that counts lies opposite vertex i.",
    ),
}
