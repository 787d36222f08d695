"""Strain energy: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Case, Mistake
from muslin.judging.arrays import diag, transposed
from muslin.judging.draws import Draw, float64
from muslin.judging.exact import (
    Matrix,
    Vector,
    apply,
    diagonal,
    dot,
    exact,
    gradient,
    hessian,
    matmul,
    precise,
    transpose,
)

from .energies import linearised
from .triangles import STRETCHES, conditions_stretches, draw_state, pick


def truth_right_cauchy_green(F: Matrix) -> Matrix:
    """Half the second derivatives of |F dX|^2 in dX."""

    def squared_length(dX: Vector) -> Any:
        dx = apply(F, dX)
        return dot(dx, dx)

    return [[value / 2 for value in row] for row in hessian(squared_length, exact([0, 0, 0]))]


def truth_psi(s: Vector, mu: Any, lam: Any) -> Any:
    """The energy itself: `linearised`, of the two in-plane stretches."""
    return linearised(s, mu, lam)


def truth_dpsi_ds(s: Vector, mu: Any, lam: Any) -> Vector:
    """`linearised`, differentiated in all three stretches."""
    return gradient(lambda t: linearised(t, mu, lam), s)


def truth_d2psi_ds2(s: Vector, mu: Any, lam: Any) -> Matrix:
    """`linearised`, differentiated twice in all three stretches."""
    return hessian(lambda t: linearised(t, mu, lam), s)


def draw_stretches(draw: Draw, k: int) -> dict[str, Any]:
    """In-plane stretches of every kind; now and then a third that is not 1, which must not matter."""
    inputs = pick(draw_state(draw, k), "s", "mu", "lam")
    if k % 10 == 9:
        inputs["s"] = [*inputs["s"][:2], float64(draw.between(0.5, 1.8))]
    return inputs


def draw_right_cauchy_green(draw: Draw, k: int) -> dict[str, Any]:
    """Deformation gradients of cloth, rotations, and any matrix (so that F F^T shows)."""
    s = [*list(STRETCHES.values())[k % len(STRETCHES)](draw), precise().one]
    F = matmul(matmul(draw.rotation(), diagonal(s)), transpose(draw.rotation()))
    return {"F": draw.matrix(2) if k % 4 == 3 else F}


draw_psi = draw_dpsi_ds = draw_d2psi_ds2 = draw_stretches


def _principal_root(a: Case) -> np.ndarray:
    squares, V = np.linalg.eigh(a.right)
    return V @ diag(np.sqrt(squares)) @ transposed(V)


def _apart(a: Case) -> np.ndarray:
    """The lam term of each stretch alone: then lam only adds to mu."""
    return a.truth(mu=a.mu + a.lam / 2, lam=np.zeros_like(a.lam))


def _without_lam(a: Case) -> np.ndarray:
    return a.truth(lam=np.zeros_like(a.lam))


def _psi_third(a: Case) -> tuple[np.ndarray, ...]:
    t, plane = a.s[:, 2] - 1, a.s[:, 0] + a.s[:, 1] - 2
    more = a.lam / 2 * (2 * plane * t + t * t)
    return a.right + a.mu * t**2, a.right + more, a.right + a.mu * t**2 + more


def _dpsi_third(a: Case) -> tuple[np.ndarray, ...]:
    t = (a.s[:, 2] - 1)[:, None]
    total = np.sum(a.s, axis=1, keepdims=True) - 3
    third, mu, lam = np.array([0.0, 0.0, 1.0]), a.mu[:, None], a.lam[:, None]
    alone = a.right + 2 * mu * t * third
    return (
        alone,
        alone + lam * (t * (1 - third) + total * third),
        a.right + lam * total * third,
        alone + lam * t * third,
    )


def _area_psi(a: Case, power: int = 2) -> np.ndarray:
    return _without_lam(a) + a.lam / 2 * (a.s[:, 0] * a.s[:, 1] - 1) ** power


def _area_gradient(a: Case) -> np.ndarray:
    change = a.lam * (a.s[:, 0] * a.s[:, 1] - 1)
    return _without_lam(a) + change[:, None] * a.s[:, [1, 0, 2]] * np.array([1.0, 1.0, 0.0])


def _area_hessian(a: Case) -> np.ndarray:
    s0, s1, _ = a.s.T
    block = np.zeros((len(s0), 3, 3))
    block[:, 0, 0], block[:, 1, 1] = s1**2, s0**2
    block[:, 0, 1] = block[:, 1, 0] = 2 * s0 * s1 - 1
    return _without_lam(a) + a.lam[:, None, None] * block


def _third_row(a: Case) -> tuple[np.ndarray, ...]:
    corner = np.diag([0.0, 0.0, 1.0])
    border = 1 - np.diag([1.0, 1.0, 0.0]) - np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 0]])
    mu, lam = a.mu[:, None, None], a.lam[:, None, None]
    alone = a.right + 2 * mu * corner
    return alone, alone + lam * border, alone + lam * corner, a.right + corner


def _times_s(a: Case) -> tuple[np.ndarray, ...]:
    S = diag(a.s)
    return S @ a.right, a.right @ S, S @ a.right @ S, a.right * S, a.right + a.right * (S - np.eye(3))


mistakes_right_cauchy_green = (
    Mistake(
        "strain",
        "This is a strain: the identity has been subtracted.",
        "C itself is asked: for a rotation it is the identity, not zero.",
        lambda a: (
            (a.right - np.eye(3)) / 2,
            a.right - np.eye(3),
            a.F @ transposed(a.F) - np.eye(3),
            (a.F @ transposed(a.F) - np.eye(3)) / 2,
        ),
    ),
    Mistake(
        "entry by entry",
        "The matrices are multiplied entry by entry.",
        "In Taichi * is entry by entry. The matrix product has another sign.",
        lambda a: (a.F * a.F, transposed(a.F) * a.F),
    ),
    Mistake(
        "F F",
        "F is multiplied with itself, and nothing is transposed.",
        "Put dx = F dX into dx^T dx: what happens to the first factor?",
        lambda a: a.F @ a.F,
    ),
    Mistake(
        "stretch",
        "This is the root of C: its eigenvalues are the stretches, not their squares.",
        "C holds the squares. Do not take the root.",
        _principal_root,
    ),
    Mistake(
        "small strain",
        "This is the symmetric part of F (or what remains without the identity), right for tiny changes only.",
        "Lengths are squared: C is a product, not a sum.",
        lambda a: (
            (a.F + transposed(a.F)) / 2,
            (a.F + transposed(a.F)) / 2 - np.eye(3),
            a.F + transposed(a.F) - np.eye(3),
            a.F + transposed(a.F),
        ),
    ),
)


said_right_cauchy_green = {
    "transposed:F": (
        "This is the left Cauchy-Green tensor: the factors are in the other order.",
        "Turn the cloth after deforming it, F -> R F: your result must not change.",
    ),
}


mistakes_psi = (
    Mistake(
        "third stretch",
        "The sum runs over three stretches.",
        "Only the two stretches in the plane store energy; do not count on the third being 1.",
        _psi_third,
    ),
    Mistake(
        "missing stretch",
        "Only one of the two stretches is in the mu term.",
        "mu resists each of the two stretches in the plane.",
        lambda a: tuple(a.right - a.mu * (a.s[:, k] - 1) ** 2 for k in (1, 0)),
    ),
    Mistake(
        "area energy",
        "This is the area energy, with the product of the stretches.",
        "The task asks for the linearised one: what is the product, to first order around (1, 1)?",
        lambda a: (_area_psi(a), _area_psi(a, 1)),
    ),
    Mistake(
        "each stretch alone",
        "The lam term squares the change of each stretch alone.",
        "Add the changes of both stretches first, then square.",
        lambda a: (_apart(a), a.truth(mu=a.mu + a.lam, lam=0 * a.lam)),
    ),
    Mistake(
        "missing square",
        "The square of the lam term is missing.",
        "Without a square, compressing the cloth would win energy without end.",
        lambda a: _without_lam(a) + a.lam / 2 * (a.s[:, 0] + a.s[:, 1] - 2),
    ),
    Mistake(
        "rest at one",
        "The lam term does not vanish at rest.",
        "At s_0 = s_1 = 1 nothing is stored: what must be subtracted from the sum of the stretches?",
        lambda a: tuple(_without_lam(a) + a.lam / 2 * (a.s[:, 0] + a.s[:, 1] - k) ** 2 for k in (1, 0, 3)),
    ),
)


said_psi = {
    "swapped:mu,lam": (
        "mu and lam are exchanged.",
        "mu weighs the stretches one by one, lam their common change.",
    ),
    "doubled:lam": (
        "The lam term is twice too large.",
        "Look at the number in front of lam in the formula.",
    ),
    "halved:mu": (
        "The mu term is half of the right one.",
        "Look at the number in front of mu in the formula.",
    ),
    "squared:s": (
        "The stretches are squared before one is subtracted.",
        "The energy counts s - 1. With squares it is another material.",
    ),
    "missing:lam": ("The lam term is missing.", "The second term resists a change of area."),
    "missing:mu": ("The mu term is missing.", "The first term resists each stretch."),
}


mistakes_dpsi_ds = (
    Mistake(
        "third stretch",
        "The third stretch takes part.",
        "psi does not contain s_2: what is its derivative by it?",
        _dpsi_third,
    ),
    Mistake(
        "each stretch alone",
        "The lam term of each component holds its own stretch only.",
        "Differentiate the square of a sum: the whole sum stays inside.",
        lambda a: _apart(a),
    ),
    Mistake(
        "area energy",
        "This is the gradient of the area energy, the handout's example.",
        "Differentiate the linearised energy in the same way. It is easier.",
        _area_gradient,
    ),
    Mistake(
        "stretches",
        "These are the stretches themselves, not the derivative of psi.",
        "Differentiate psi by s_0 with s_1 fixed.",
        lambda a: (a.s, a.s * np.array([1.0, 1.0, 0.0]), a.s - 1),
    ),
    Mistake(
        "rest at one",
        "The lam term does not vanish at rest.",
        "At s_0 = s_1 = 1 there is no stress: what must be subtracted from the sum of the stretches?",
        lambda a: tuple(a.right + k * a.lam[:, None] * np.array([1.0, 1.0, 0.0]) for k in (1.0, 2.0, -1.0)),
    ),
)


said_dpsi_ds = {
    "component 0": ("", "The term with lam depends on both stretches: it is in both components."),
    "component 1": ("", "The term with lam depends on both stretches: it is in both components."),
    "swapped:mu,lam": (
        "mu and lam are exchanged.",
        "mu weighs the stretches one by one, lam their common change.",
    ),
    "halved:mu": ("The 2 in the mu term is missing.", "Differentiate the square once more."),
    "halved:lam": (
        "The lam term is half of the right one.",
        "The square brings a factor of two: what becomes of lam/2?",
    ),
    "negated": (
        "This is minus the gradient.",
        "The gradient of psi points uphill; the sign of a force comes later.",
    ),
    "missing:lam": (
        "The lam term is missing.",
        "The square of the sum depends on both stretches: differentiate it, too.",
    ),
}


mistakes_d2psi_ds2 = (
    Mistake(
        "third row and column",
        "There is something in the third row and column.",
        "psi does not contain s_2: what are its second derivatives by it?",
        _third_row,
    ),
    Mistake(
        "multiplied by s",
        "The Hessian has been multiplied by the stretches.",
        "psi is quadratic in s: its second derivative does not contain s any more.",
        _times_s,
    ),
    Mistake(
        "area energy",
        "This is the Hessian of the area energy, the handout's example.",
        "Differentiate the linearised energy in the same way: the result is constant.",
        _area_hessian,
    ),
)


said_d2psi_ds2 = {
    "diagonal": ("", "psi depends on s_0 through both of its terms: differentiate both twice."),
    "off the diagonal": ("", "Differentiate the first component of the gradient by the other stretch."),
    "off the diagonal: negated": (
        "",
        "Pull one stretch up: does the stress along the other rise or fall?",
    ),
    "off the diagonal: scaled:2": (
        "",
        "Differentiate the first component of the gradient by the other stretch.",
    ),
    "upper triangle only": ("", "It does not matter which stretch comes first: the matrix is symmetric."),
    "lower triangle only": ("", "It does not matter which stretch comes first: the matrix is symmetric."),
    "swapped:mu,lam": (
        "mu and lam are exchanged.",
        "mu weighs the stretches one by one, lam their common change.",
    ),
    "diagonal only": (
        "The matrix is diagonal: the coupling of the stretches is missing.",
        "Differentiate the first component of the gradient by the other stretch.",
    ),
    "halved:mu": (
        "The 2 at mu is missing.",
        "Differentiate the gradient: which factor does mu carry there?",
    ),
    "missing:lam": ("The lam term is missing.", "lam comes in on the diagonal and off it."),
}


conditions_psi = conditions_dpsi_ds = conditions_d2psi_ds2 = conditions_stretches
