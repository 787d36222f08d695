"""Stress and nodal forces: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Mistake
from muslin.judging.arrays import diag, long, transposed
from muslin.judging.draws import Draw
from muslin.judging.exact import (
    Matrix,
    Vector,
    diagonal,
    dot,
    exact,
    gradient,
    matmul,
    precise,
    rotation,
    times,
    transpose,
)

from .energies import stretches
from .shape_functions import gradients
from .triangles import conditions_stress, draw_sheet, draw_state, draw_triangle


def truth_dpsi_dF(U: Matrix, dpsi_ds: Vector, V: Matrix) -> Matrix:
    """An energy of the stretches of F, differentiated in the nine entries of F.

    P depends on the energy only through its gradient in the stretches, and not on the stretches: so the
    energy sum of dpsi_ds[k] s_k(F) is taken, at F = U diag(3, 2, 1) V^T, where the stretches are far apart.
    """
    s = [3, 2, 1]
    F = matmul(matmul(rotation(U), diagonal(exact(s))), transpose(rotation(V)))

    def psi(entries: Vector) -> Any:
        return dot(dpsi_ds, stretches([entries[:3], entries[3:6], entries[6:]], s))

    P = gradient(psi, [entry for row in F for entry in row])
    return [P[:3], P[3:6], P[6:]]


def truth_nodal_force(P: Matrix, grad_phi: Vector, area: Any, h: Any) -> Vector:
    """Minus the derivative of h a psi in the vertex x: psi changes by P : F, and F by x grad_phi^T."""

    def work(x: Vector) -> Any:
        F = [times(component, grad_phi) for component in x]
        return h * area * sum(dot(p, f) for p, f in zip(P, F, strict=True))

    return [-component for component in gradient(work, exact([0, 0, 0]))]


def draw_dpsi_dF(draw: Draw, k: int) -> dict[str, Any]:
    """The stress of both energies, and pure compression, tension and shear."""
    p = draw_state(draw, k)["dpsi_ds"]
    if k % 6 == 5:
        p = [draw.between(-1, 1), draw.between(-1, 1), precise().zero]
    return {"U": draw.rotation(), "dpsi_ds": p, "V": draw.rotation()}


def draw_nodal_force(draw: Draw, k: int) -> dict[str, Any]:
    """The stress and shape gradients of a triangle, and any others."""
    stress = draw_dpsi_dF(draw, k)
    T = draw_triangle(draw, k)
    P = matmul(matmul(stress["U"], diagonal(stress["dpsi_ds"])), transpose(stress["V"]))
    sheet = draw_sheet(draw)
    return {
        "P": draw.matrix(100) if k % 5 == 4 else P,
        "grad_phi": gradients(T["X0"], T["X1"], T["X2"])[k % 3],
        "area": sheet["area"],
        "h": sheet["h"],
    }


mistakes_dpsi_dF = (
    Mistake(
        "transposed:V",
        "V stands where its transpose is asked.",
        "Compare with F = U diag(s) V^T.",
        lambda a: a.U @ diag(a.dpsi_ds) @ a.V,
    ),
    Mistake(
        "transposed:U",
        "U is transposed.",
        "Compare with F = U diag(s) V^T.",
        lambda a: transposed(a.V @ diag(a.dpsi_ds) @ a.U),
    ),
    Mistake(
        "transposed:U,V",
        "Both rotations are transposed.",
        "The principal directions are the columns of U and V, not the rows.",
        lambda a: transposed(a.U) @ diag(a.dpsi_ds) @ a.V,
    ),
    Mistake(
        "missing:V",
        "V is missing.",
        "The result belongs to F, not to the principal directions: turn it back on both sides.",
        lambda a: a.U @ diag(a.dpsi_ds),
    ),
    Mistake(
        "missing:U",
        "U is missing.",
        "The result belongs to F, not to the principal directions: turn it back on both sides.",
        lambda a: transposed(a.V @ diag(a.dpsi_ds)),
    ),
    Mistake(
        "permuted:dpsi_ds",
        "The components of dpsi_ds meet the wrong principal directions.",
        "Component i belongs to column i of U and of V.",
        lambda a: a.U @ diag(a.dpsi_ds[:, [1, 0, 2]]) @ transposed(a.V),
    ),
    Mistake(
        "diagonal outside",
        "The diagonal matrix stands outside of the product of the two rotations.",
        "The stress in the principal directions is diagonal: U and V turn it from both sides.",
        lambda a: (diag(a.dpsi_ds) @ a.U @ transposed(a.V), a.U @ transposed(a.V) @ diag(a.dpsi_ds)),
    ),
    Mistake(
        "entry by entry",
        "The matrices are multiplied entry by entry.",
        "In Taichi * is entry by entry. The matrix product has another sign.",
        lambda a: (a.U * diag(a.dpsi_ds) * transposed(a.V), a.U * diag(a.dpsi_ds) @ transposed(a.V)),
    ),
)


said_dpsi_dF = {
    "transposed": (
        "This is P transposed: U and V have changed places.",
        "P belongs to F: U turns in the deformed cloth and stands on the same side as in F.",
    ),
}


mistakes_nodal_force = (
    Mistake(
        "entry by entry",
        "P and the gradient are multiplied entry by entry somewhere.",
        "The force is a matrix times a vector.",
        lambda a: -long(a.area * a.h, a.right) * np.einsum("bii->bi", a.P) * a.grad_phi,
    ),
)


said_nodal_force = {
    "scaled:1/3": ("", "Nothing is shared out among the vertices: each has a gradient of its own."),
    "scaled:1/2": ("", "`area` is that of the triangle, and psi has its halves inside already."),
    "scaled:2": ("", "`area` is that of the triangle, not of the parallelogram."),
    "negated": (
        "This is the gradient of the energy: the force has the opposite sign.",
        "The gradient points uphill, a force pulls downhill.",
    ),
    "missing:area": (
        "The area is missing.",
        "psi is energy per volume: how large is the volume of a triangle of cloth?",
    ),
    "missing:h": (
        "The thickness is missing.",
        "psi is energy per volume: how large is the volume of a triangle of cloth?",
    ),
    "missing:area,h": (
        "Area and thickness are missing.",
        "psi is energy per volume: how large is the volume of a triangle of cloth?",
    ),
    "transposed:P": ("P is transposed.", "P : (w g^T) = w^T P g. Which index of P meets the gradient?"),
    "missing:|grad_phi|": (
        "The gradient has been made of length one.",
        "The length of the gradient knows the size of the triangle: use it as it comes.",
    ),
}


conditions_dpsi_dF = conditions_stress
