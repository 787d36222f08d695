"""Deformation gradient: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from muslin.judging import Case, Given, Mistake
from muslin.judging.arrays import transposed
from muslin.judging.draws import Draw
from muslin.judging.exact import Matrix, Vector, add, derivative, dot, times, transpose

from .shape_functions import gradients
from .tetrahedra import draw_tetrahedron, pick


def truth_deformation_gradient(x0: Vector, x1: Vector, x2: Vector, x3: Vector, dphi_dX: Matrix) -> Matrix:
    """x(X) = sum of phi_i(X) x_i with phi_i(X) = phi_i(0) + grad phi_i . X, differentiated in X."""

    def place(X: Vector) -> Vector:
        at: Vector = times(0 * X[0], x0)
        for x, grad in zip((x0, x1, x2, x3), dphi_dX, strict=True):
            at = add(at, times(dot(grad, X), x))
        return at

    return transpose([derivative(place, times(0, x0), k) for k in range(3)])


def draw_deformation_gradient(draw: Draw, k: int) -> dict[str, Any]:
    """Deformed tetrahedra of every kind, with the gradients of the undeformed ones."""
    T = draw_tetrahedron(draw, k)
    G = gradients(T["X0"], T["X1"], T["X2"], T["X3"])
    return {**pick(T, "x0", "x1", "x2", "x3"), "dphi_dX": G}


def _vertices(a: Case) -> np.ndarray:
    """The vertices as columns, (b, 3, 4)."""
    return np.stack([a.x0, a.x1, a.x2, a.x3], axis=2)


mistakes_deformation_gradient = (
    Mistake(
        "transposed",
        "This is F transposed.",
        "dx = F dX: the vertices are columns, the gradients of the shape functions rows.",
        lambda a: transposed(a.right),
    ),
    Mistake(
        "vertex missing",
        "One of the four vertices is missing.",
        "All four vertices carry F: without vertex 0 a tetrahedron that is only moved would seem deformed.",
        lambda a: tuple(
            a.right - x[:, :, None] * a.dphi_dX[:, k, None, :] for k, x in enumerate((a.x0, a.x1, a.x2, a.x3))
        ),
    ),
    Mistake(
        "identity added",
        "This is F plus or minus the identity: a gradient of displacements, or one added to F.",
        "F belongs to positions: for an undeformed tetrahedron it is the identity itself.",
        lambda a: (a.right - np.eye(3), a.right + np.eye(3)),
    ),
    Mistake(
        "other order",
        "The gradients meet the wrong vertices.",
        "Row i of dphi_dX belongs to vertex i.",
        lambda a: tuple(
            _vertices(a)[:, :, list(order)] @ a.dphi_dX
            for order in ((1, 2, 3, 0), (3, 0, 1, 2), (3, 2, 1, 0), (0, 2, 1, 3), (0, 1, 3, 2), (1, 0, 2, 3))
        ),
    ),
    Mistake(
        "inverse",
        "This is the inverse of F, or its transpose: from deformed to undeformed.",
        "F takes a small step dX in the undeformed solid to dx in the world.",
        lambda a: (np.linalg.inv(a.right), transposed(np.linalg.inv(a.right))),
    ),
    Mistake(
        "cauchy-green",
        "This is the Cauchy-Green tensor F^T F, or F F^T.",
        "F itself is asked: for a rotation it is that rotation.",
        lambda a: (transposed(a.right) @ a.right, a.right @ transposed(a.right)),
    ),
    Mistake(
        "edges not vertices",
        "The deformed edges are multiplied with the gradients of the wrong vertices.",
        "Edge i leads from vertex 0 to vertex i: it meets the gradient of phi_i.",
        lambda a: (
            (_vertices(a)[:, :, 1:] - _vertices(a)[:, :, :1]) @ a.dphi_dX[:, :3],
            (_vertices(a)[:, :, 1:] - _vertices(a)[:, :, :1]) @ transposed(a.dphi_dX[:, 1:]),
        ),
    ),
    Mistake(
        "gradients as columns",
        "The gradients of the shape functions are used as columns, or the vertices as rows.",
        "Each term is a vertex (column) times the gradient of its shape function (row).",
        lambda a: (
            _vertices(a)[:, :, :3] @ a.dphi_dX[:, :3],
            transposed(_vertices(a)[:, :, 1:]) @ a.dphi_dX[:, 1:],
            transposed(_vertices(a)[:, :, 1:] - _vertices(a)[:, :, :1]) @ a.dphi_dX[:, 1:],
        ),
    ),
)


said_deformation_gradient = {
    "transposed": (
        "This is F transposed.",
        "dx = F dX: the vertices are columns, the gradients of the shape functions rows.",
    ),
}


def conditions_deformation_gradient(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    x = np.stack([a["x0"], a["x1"], a["x2"], a["x3"]], axis=2)
    F = x @ a["dphi_dX"]
    off = np.abs(np.einsum("bij,bik->bjk", F, F) - np.eye(3)).max(axis=(1, 2))
    yield "nothing is deformed", off < 1e-6
