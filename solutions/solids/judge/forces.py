"""Forces, stiffness and a spring: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from muslin.judging import Case, Given, Mistake
from muslin.judging.arrays import long, transposed
from muslin.judging.draws import Draw, float64
from muslin.judging.exact import (
    Matrix,
    Vector,
    add,
    dot,
    exact,
    gradient,
    norm,
    precise,
    second,
    sub,
    times,
)

from .neo_hookean import truth_d2psi_dF2, truth_dpsi_dF
from .shape_functions import gradients
from .tetrahedra import draw_body, draw_strained, draw_tetrahedron, length, pick


def truth_nodal_force(P: Matrix, grad_phi: Vector, volume: Any) -> Vector:
    """Minus the derivative of volume psi in the vertex x: psi changes by P : F, and F by x grad_phi^T."""

    def work(x: Vector) -> Any:
        F = [times(component, grad_phi) for component in x]
        return volume * sum(dot(p, f) for p, f in zip(P, F, strict=True))

    return [-component for component in gradient(work, exact([0, 0, 0]))]


def truth_stiffness_block(d2psi_dF2: Matrix, grad_phi_i: Vector, grad_phi_j: Vector, volume: Any) -> Matrix:
    """The bilinear form volume (x_i grad_i^T) : H : (x_j grad_j^T), differentiated in x_i and in x_j."""

    def form(moved: Vector) -> Any:
        left, right = (
            [value * g for value in x for g in grad]
            for x, grad in ((moved[:3], grad_phi_i), (moved[3:], grad_phi_j))
        )
        return volume * dot(left, [dot(row, right) for row in d2psi_dF2])

    at = exact([0] * 6)
    return [[second(form, at, a, 3 + b) for b in range(3)] for a in range(3)]


def truth_spring_force(x0: Vector, x1: Vector, l0: Any, k: Any) -> Vector:
    """Minus the derivative of k/2 (|x1 - x0| - l0)^2 in x0; zero where both ends meet."""
    if norm(sub(x1, x0)) == 0:
        return exact([0, 0, 0])
    return [-part for part in gradient(lambda x: k / 2 * (norm(sub(x1, x)) - l0) ** 2, x0)]


def draw_nodal_force(draw: Draw, k: int) -> dict[str, Any]:
    """The stress and shape gradients of a tetrahedron, and any others."""
    T = draw_tetrahedron(draw, k)
    P = truth_dpsi_dF(**draw_strained(draw, k))
    return {
        "P": draw.matrix(100) if k % 5 == 4 else P,
        "grad_phi": gradients(T["X0"], T["X1"], T["X2"], T["X3"])[k % 4],
        **pick(draw_body(draw), "volume"),
    }


def draw_stiffness_block(draw: Draw, k: int) -> dict[str, Any]:
    """The Hessian and shape gradients of a tetrahedron, i = j among them, and any other matrix, symmetric or not."""
    T = draw_tetrahedron(draw, k)
    G = gradients(T["X0"], T["X1"], T["X2"], T["X3"])
    if k % 4 == 3:
        H = [[draw.between(-9, 9) for _ in range(9)] for _ in range(9)]
    else:
        H = truth_d2psi_dF2(**draw_strained(draw, k))
    return {
        "d2psi_dF2": H,
        "grad_phi_i": G[k % 4],
        "grad_phi_j": G[k // 4 % 4],
        **pick(draw_body(draw), "volume"),
    }


def draw_spring_force(draw: Draw, k: int) -> dict[str, Any]:
    """Stretched, pressed, of no rest length, relaxed up to rounding, and both ends at one place."""
    x0, way = draw.vector(3), draw.direction()
    l0, size = draw.between(0.2, 2), draw.choice((0.01, 1.0, 30.0))
    x0, l0 = times(precise().mpf(size), x0), l0 * size
    stretch = (draw.between(1.1, 3), draw.between(0.2, 0.9), draw.between(1.1, 3), draw.between(0.05, 5))[
        k % 4
    ]
    x1 = add(x0, times(stretch * l0, way))
    if k % 4 == 2:
        l0 = precise().zero
    if k % 8 == 7:
        x0 = x1 = float64(x0)
    return {"x0": x0, "x1": x1, "l0": l0, "k": draw.decades(0, 5)}


mistakes_nodal_force = (
    Mistake(
        "negated",
        "This is the gradient of the energy: the force has the opposite sign.",
        "The gradient points uphill, a force pulls downhill.",
        lambda a: -a.right,
    ),
    Mistake(
        "transposed:P",
        "P is transposed.",
        "P : (w g^T) = w^T P g. Which index of P meets the gradient?",
        lambda a: -long(a.volume, a.right) * np.einsum("bji,bj->bi", a.P, a.grad_phi),
    ),
    Mistake(
        "missing:volume",
        "The volume is missing.",
        "psi is energy per volume.",
        lambda a: (a.right / long(a.volume, a.right), -a.right / long(a.volume, a.right)),
    ),
    Mistake(
        "entry by entry",
        "P and the gradient are multiplied entry by entry somewhere.",
        "The force is a matrix times a vector.",
        lambda a: -long(a.volume, a.right) * np.einsum("bii->bi", a.P) * a.grad_phi,
    ),
    Mistake(
        "shared out",
        "The force is a part of the right one: as if it were shared out, or the 6 of a volume put in.",
        "Nothing is shared out among the vertices: each has a gradient of its own. `volume` is the tetrahedron's.",
        lambda a: (a.right / 4, a.right / 3, a.right / 6, a.right * 6, a.right * 4, a.right / 2, a.right * 2),
    ),
    Mistake(
        "unit gradient",
        "The gradient has been made of length one.",
        "The length of the gradient knows the size of the tetrahedron: use it as it comes.",
        lambda a: a.right / length(a.grad_phi)[:, None],
    ),
    Mistake(
        "area for volume",
        "The volume has another power than one.",
        "psi is energy per volume: newton is pascal times 1/m times m^3.",
        lambda a: tuple(a.right * long(a.volume, a.right) ** p for p in (1.0, -1 / 3, -2.0)),
    ),
)


said_nodal_force = {
    "negated": (
        "This is the gradient of the energy: the force has the opposite sign.",
        "The gradient points uphill, a force pulls downhill.",
    ),
    "missing:volume": ("The volume is missing.", "psi is energy per volume."),
    "transposed:P": ("P is transposed.", "P : (w g^T) = w^T P g. Which index of P meets the gradient?"),
    "missing:|grad_phi|": (
        "The gradient has been made of length one.",
        "The length of the gradient knows the size of the tetrahedron: use it as it comes.",
    ),
    "scaled:1/4": ("", "Nothing is shared out among the vertices: each has a gradient of its own."),
    "scaled:1/6": ("", "`volume` is that of the tetrahedron: no 6 is left over."),
    "scaled:6": ("", "`volume` is that of the tetrahedron: no 6 is left over."),
}


def _contracted(a: Case, letters: str) -> np.ndarray:
    """Volume times the sum over c and d of g_i[c] H[..] g_j[d], with the four indices of H in some order."""
    H = a.d2psi_dF2.reshape(-1, 3, 3, 3, 3)
    return long(a.volume, a.right) * np.einsum(f"z{letters},zc,zd->zab", H, a.grad_phi_i, a.grad_phi_j)


mistakes_stiffness_block = (
    Mistake(
        "negated",
        "This has the opposite sign: it is the derivative of the force, not the second derivative of the energy.",
        "Stiffness is the Hessian of the energy: at rest its blocks for i = j are positive definite.",
        lambda a: -a.right,
    ),
    Mistake(
        "transposed",
        "Rows and columns are exchanged, or the two vertices.",
        "Row a belongs to vertex i, column b to vertex j.",
        lambda a: (transposed(a.right), _contracted(a, "bdac")),
    ),
    Mistake(
        "exchanged gradients",
        "The two gradients are exchanged.",
        "Rows of d2psi_dF2 belong to vertex i, columns to vertex j.",
        lambda a: a.truth(grad_phi_i=a.grad_phi_j, grad_phi_j=a.grad_phi_i),
    ),
    Mistake(
        "column by column",
        "F is taken column by column: entry F_ac has the number 3 a + c, not a + 3 c.",
        "d2psi_dF2 comes in row-major order of F.",
        lambda a: (
            _contracted(a, "cadb"),
            _contracted(a, "acdb"),
            _contracted(a, "cabd"),
            _contracted(a, "abcd"),
            _contracted(a, "adcb"),
            _contracted(a, "cbad"),
        ),
    ),
    Mistake(
        "missing:volume",
        "The volume is missing.",
        "psi is energy per volume.",
        lambda a: a.right / long(a.volume, a.right),
    ),
    Mistake(
        "one gradient",
        "The same gradient stands on both sides.",
        "Vertex i moves the one F, vertex j the other: each has a gradient of its own.",
        lambda a: (a.truth(grad_phi_j=a.grad_phi_i), a.truth(grad_phi_i=a.grad_phi_j)),
    ),
    Mistake(
        "first block",
        "Only one 3x3 block of d2psi_dF2 is used.",
        "All nine entries of F change with a vertex through its gradient: sum over both inner indices.",
        lambda a: tuple(
            long(a.volume, a.right) * np.einsum("zab,zc,zc->zab", block, a.grad_phi_i, a.grad_phi_j)
            for block in (a.d2psi_dF2[:, :3, :3], a.d2psi_dF2[:, ::3, ::3])
        ),
    ),
    Mistake(
        "same index",
        "The two inner indices run together: the sum over c and d is double.",
        "c and d are independent: nine terms for each entry of the result.",
        lambda a: (
            long(a.volume, a.right)
            * np.einsum("zacbc,zc,zc->zab", a.d2psi_dF2.reshape(-1, 3, 3, 3, 3), a.grad_phi_i, a.grad_phi_j)
        ),
    ),
    Mistake(
        "shared out",
        "The stiffness is a part of the right one.",
        "Nothing is shared out, and nothing halved: it is a plain second derivative.",
        lambda a: (a.right / 2, a.right * 2, a.right / 4, a.right / 6, a.right * 6),
    ),
)


said_stiffness_block = {
    "negated": (
        "This has the opposite sign: it is the derivative of the force, not the second derivative of the energy.",
        "Stiffness is the Hessian of the energy: at rest its blocks for i = j are positive definite.",
    ),
    "missing:volume": ("The volume is missing.", "psi is energy per volume."),
    "transposed": ("Rows and columns are exchanged.", "Row a belongs to vertex i, column b to vertex j."),
    "transposed:d2psi_dF2": (
        "d2psi_dF2 is used with rows and columns exchanged.",
        "Rows of d2psi_dF2 belong to vertex i, columns to vertex j.",
    ),
    "swapped:grad_phi_i,grad_phi_j": (
        "The two gradients are exchanged.",
        "Rows of d2psi_dF2 belong to vertex i, columns to vertex j.",
    ),
}


def _way(a: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From x0 to x1, its length as a column, and its direction, zero where there is none."""
    d = a.x1 - a.x0
    n = length(d)[:, None]
    return d, n, np.where(n > 0, d / np.where(n > 0, n, 1), 0)


def _springs(make: Any) -> Any:
    def makes(a: Case) -> Any:
        d, n, u = _way(a)
        return make(a.k[:, None], d, n, u, a.l0[:, None])

    return makes


mistakes_spring_force = (
    Mistake(
        "negated",
        "Your spring pushes where it should pull: the force on the other end.",
        "Stretched, the spring pulls x0 towards x1.",
        lambda a: -a.right,
    ),
    Mistake(
        "rest length",
        "The rest length is missing: your spring pulls at any length.",
        "At its rest length a spring has no force.",
        _springs(lambda k, d, n, u, l0: (k * d, -k * d)),
    ),
    Mistake(
        "no direction",
        "The direction is not of length one.",
        "The force is as large as k (l - l0) says, whatever the length of the spring.",
        _springs(lambda k, d, n, u, l0: (k * (n - l0) * d, -k * (n - l0) * d)),
    ),
    Mistake(
        "doubled",
        "The force is twice or half of the right one.",
        "The 1/2 of the energy and the 2 of its square cancel.",
        lambda a: (2 * a.right, a.right / 2),
    ),
    Mistake(
        "energy",
        "The energy of the spring stands in place of its force: it pulls when it should push.",
        "Differentiate k/2 (l - l0)^2: the square goes.",
        _springs(
            lambda k, d, n, u, l0: (
                k / 2 * (n - l0) ** 2 * u,
                k * (n - l0) ** 2 * u,
                -k / 2 * (n - l0) ** 2 * u,
                k * np.abs(n - l0) * u,
            )
        ),
    ),
    Mistake(
        "relative",
        "The elongation is taken relative to the rest length, or not by a difference.",
        "k is in N/m: newton is k times metres.",
        _springs(
            lambda k, d, n, u, l0: (
                np.where(l0 > 0, k * (n - l0) / np.where(l0 > 0, l0, 1) * u, np.nan),
                np.where(l0 > 0, k * (n / np.where(l0 > 0, l0, 1) - 1) * d, np.nan),
                k * (n + l0) * u,
            )
        ),
    ),
    Mistake(
        "squared length",
        "Squared lengths are compared.",
        "A length is the root of a dot product.",
        _springs(
            lambda k, d, n, u, l0: (
                k * (n**2 - l0**2) * u,
                k * (n**2 - l0**2) * d,
                2 * k * (n**2 - l0**2) * d,
                k * (n**2 - l0) * u,
            )
        ),
    ),
    Mistake(
        "only pulls",
        "Your spring pulls, but it does not push.",
        "Pressed, the spring pushes its ends apart: nothing is cut off.",
        _springs(lambda k, d, n, u, l0: k * np.maximum(n - l0, 0) * u),
    ),
    Mistake(
        "ends meet",
        "Where both ends meet your force is not a number, or not zero.",
        "Ask whether the length is zero before you divide by it.",
        lambda a: tuple(
            np.where(_way(a)[1] > 0, a.right, value) for value in (np.nan, -a.k[:, None] * a.l0[:, None])
        ),
    ),
)


said_spring_force = {
    "scaled:2": ("", "The 1/2 of the energy and the 2 of its square cancel."),
    "scaled:1/2": ("", "The 1/2 of the energy and the 2 of its square cancel."),
    "negated": (
        "Your spring pushes where it should pull: the force on the other end.",
        "Stretched, the spring pulls x0 towards x1.",
    ),
    "missing:l0": (
        "The rest length is missing: your spring pulls at any length.",
        "At its rest length a spring has no force.",
    ),
    "missing:k": ("The stiffness is missing.", "Twice the stiffness must pull twice as hard."),
    "swapped:x0,x1": (
        "Your spring pushes where it should pull: the force on the other end.",
        "Stretched, the spring pulls x0 towards x1.",
    ),
}


def conditions_spring_force(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    apart = length(a["x1"] - a["x0"])
    yield "both ends meet", apart == 0
    yield "the spring is pressed", (apart < a["l0"]) & (apart > 0)
    yield "the rest length is zero", a["l0"] == 0


def conditions_stiffness_block(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    H = a["d2psi_dF2"]
    yield "i and j are different vertices", np.abs(a["grad_phi_i"] - a["grad_phi_j"]).max(axis=1) > 0
    yield (
        "d2psi_dF2 is not symmetric",
        np.abs(H - transposed(H)).max(axis=(1, 2)) > 1e-6 * np.abs(H).max(axis=(1, 2)),
    )
