"""Stiffness: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from muslin.judging import Case, Given, Mistake
from muslin.judging.arrays import diag, replaced, transposed
from muslin.judging.draws import Draw
from muslin.judging.exact import (
    Matrix,
    Vector,
    add,
    apply,
    derivative,
    diagonal,
    dot,
    exact,
    gradient,
    hessian,
    matmul,
    precise,
    second,
    sub,
    times,
    transpose,
)

from .energies import in_plane_stretches, linearised
from .triangles import conditions_stress, conditions_stretches, draw_state, pick


def truth_d2psi_dFij(
    U: Matrix, V: Matrix, dpsi_ds: Vector, d2psi_ds2: Matrix, dU: Matrix, ds: Vector, dV: Matrix
) -> Matrix:
    """(U + t dU) diag(dpsi_ds + t d2psi_ds2 ds) (V + t dV)^T, differentiated in t."""

    def along(A: Matrix, dA: Matrix, t: Any) -> Matrix:
        return [add(row, times(t, change)) for row, change in zip(A, dA, strict=True)]

    def stress(at: Vector) -> Vector:
        (t,) = at
        p = add(dpsi_ds, times(t, apply(d2psi_ds2, ds)))
        P = matmul(matmul(along(U, dU, t), diagonal(p)), transpose(along(V, dV, t)))
        return [entry for row in P for entry in row]

    entries = derivative(stress, exact([0]), 0)
    return [entries[:3], entries[3:6], entries[6:]]


def truth_eigensystem(s: Vector, dpsi_ds: Vector, d2psi_ds2: Matrix) -> Vector:
    """Second derivatives of psi(F) along the four modes, at the 3x2 matrix F with s on its diagonal.

    psi is the quadratic with this gradient and Hessian at s. At s_0 = s_1 it must be symmetric in the two, as
    every energy of the stretches is; elsewhere the stretches are followed in their order. F is moved along
    flip [[0,1],[1,0],[0,0]]/sqrt 2, twist [[0,-1],[1,0],[0,0]]/sqrt 2, and out_i, entry i of the third row.
    """
    one, zero = precise().one, precise().zero
    r = 1 / precise().sqrt(2)
    modes = (
        ([zero, r, zero], [r, zero, zero]),
        ([zero, r, zero], [-r, zero, zero]),
        ([zero, zero, one], [zero, zero, zero]),
        ([zero, zero, zero], [zero, zero, one]),
    )

    def psi(a: Vector, b: Vector) -> Any:
        ds = sub(in_plane_stretches(a, b), s[:2])
        H = [row[:2] for row in d2psi_ds2[:2]]
        return dot(dpsi_ds[:2], ds) + dot(ds, apply(H, ds)) / 2

    def along(mode: tuple[Vector, Vector], at: Vector) -> Any:
        a, b = add([s[0], zero, zero], times(at[0], mode[0])), add([zero, s[1], zero], times(at[0], mode[1]))
        return psi(a, b)

    return [second(functools.partial(along, mode), [zero], 0, 0) for mode in modes]


def dsvd(U: Matrix, s: Vector, V: Matrix, i: int, j: int) -> dict[str, Any]:
    """Derivatives of U, s and V in F_ij: A = W diag(s) + diag(ds) - diag(s) Z with A = U^T (dF/dF_ij) V."""
    A = [[U[i][k] * V[j][m] for m in range(3)] for k in range(3)]
    W, Z = exact([[0] * 3] * 3), exact([[0] * 3] * 3)
    for k in range(3):
        for m in range(3):
            if k != m:
                W[k][m] = (s[m] * A[k][m] + s[k] * A[m][k]) / (s[m] ** 2 - s[k] ** 2)
                Z[k][m] = (s[k] * A[k][m] + s[m] * A[m][k]) / (s[m] ** 2 - s[k] ** 2)
    return {"dU": matmul(U, W), "ds": [A[k][k] for k in range(3)], "dV": matmul(V, Z)}


def draw_d2psi_dFij(draw: Draw, k: int) -> dict[str, Any]:
    """The derivatives of a real singular value decomposition, with all stretches apart, and any others."""
    state = draw_state(draw, k)
    U, V = draw.rotation(), draw.rotation()
    given = {"U": U, "V": V, **pick(state, "dpsi_ds", "d2psi_ds2")}
    if k % 4 == 3:
        return {**given, "dU": draw.matrix(), "ds": draw.vector(), "dV": draw.matrix()}
    s = [draw.between(1.2, 3), draw.between(0.05, 0.8), precise().one]
    given["dpsi_ds"] = gradient(lambda t: linearised(t, state["mu"], state["lam"]), s)
    given["d2psi_ds2"] = hessian(lambda t: linearised(t, state["mu"], state["lam"]), s)
    i, j = k % 3, k // 3 % 3
    return {**given, **dsvd(U, s, V, i, j)}


def draw_eigensystem(draw: Draw, k: int) -> dict[str, Any]:
    return pick(draw_state(draw, k), "s", "dpsi_ds", "d2psi_ds2")


def _entrywise_chain(a: Case) -> tuple[np.ndarray, ...]:
    rest = a.truth(ds=np.zeros_like(a.ds))
    middles = (a.d2psi_ds2 * a.ds[:, None, :], a.d2psi_ds2 * a.ds[:, :, None])
    return tuple(rest + a.U @ middle @ transposed(a.V) for middle in middles)


def _without_limit(a: Case) -> tuple[np.ndarray, ...]:
    met = a.s[:, 0] == a.s[:, 1]
    return tuple(replaced(a.right, 0, np.where(met, value, a.right[:, 0])) for value in (np.nan, 0.0))


def _flip_limit(combine: Callable[[np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """Another limit where the stretches meet."""

    def makes(a: Case) -> np.ndarray:
        met = a.s[:, 0] == a.s[:, 1]
        return replaced(a.right, 0, np.where(met, combine(a.d2psi_ds2), a.right[:, 0]))

    return makes


def _limit_always(a: Case) -> tuple[np.ndarray, ...]:
    H = a.d2psi_ds2
    limits = ((H[:, 0, 0] + H[:, 1, 1]) / 2 - H[:, 0, 1], H[:, 0, 0] - H[:, 0, 1], H[:, 1, 1] - H[:, 0, 1])
    return tuple(replaced(a.right, 0, limit) for limit in limits)


def _outs(values: Callable[[Case, int], np.ndarray]) -> Callable[[Case], np.ndarray]:
    def makes(a: Case) -> np.ndarray:
        return replaced(replaced(a.right, 2, values(a, 0)), 3, values(a, 1))

    return makes


mistakes_d2psi_dFij = (
    Mistake(
        "missing:dU,dV",
        "Only the middle term is there: the principal directions never turn.",
        "Three factors depend on F_ij: the product rule has three terms.",
        lambda a: a.truth(dU=0 * a.dU, dV=0 * a.dV),
    ),
    Mistake(
        "one product",
        "All three factors are differentiated at once, in one product.",
        "The product rule differentiates one factor at a time, and adds.",
        lambda a: a.dU @ diag(np.einsum("bij,bj->bi", a.d2psi_ds2, a.ds)) @ transposed(a.dV),
    ),
    Mistake(
        "entry by entry",
        "The Hessian of psi and ds are multiplied entry by entry.",
        "How psi_s changes is a vector: a matrix times a vector. Its diagonal matrix stands in the middle.",
        _entrywise_chain,
    ),
)


said_d2psi_dFij = {
    "missing:dU": (
        "The term with dU is missing.",
        "Three factors depend on F_ij: the product rule has three terms.",
    ),
    "missing:dV": (
        "The term with dV is missing.",
        "Three factors depend on F_ij: the product rule has three terms.",
    ),
    "missing:ds": (
        "The middle term is missing.",
        "Three factors depend on F_ij: the product rule has three terms.",
    ),
    "transposed:dV": (
        "dV is not transposed.",
        "The last factor of the stress is V transposed: so is its derivative.",
    ),
    "transposed:V": (
        "V is not transposed.",
        "The last factor of the stress is V transposed, in every term.",
    ),
    "missing:d2psi_ds2": (
        "ds stands in the middle as it is, without the Hessian of psi.",
        "How does psi_s change when s changes by ds? That is the chain rule.",
    ),
    "diagonal:d2psi_ds2": (
        "Only the diagonal of the Hessian of psi is used.",
        "A change of one stretch changes both stresses: multiply with the whole matrix.",
    ),
}


mistakes_eigensystem = (
    Mistake(
        "3x3 mode",
        "out_i is divided by s_i - 1: that is the mode of the 3x3 matrix, singular at rest.",
        "The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.",
        _outs(lambda a, i: a.dpsi_ds[:, i] / (a.s[:, i] - 1)),
    ),
    Mistake(
        "missing limit",
        "Flip has no limit: where the stretches meet it is zero divided by zero.",
        "Where the gap is tiny, take the limit of the quotient in place of the quotient.",
        _without_limit,
    ),
    Mistake(
        "out not divided",
        "out_0 and out_1 are stresses: they have not been divided by a stretch.",
        "How far does the normal lean when the tangent is lifted? The stretch decides it.",
        _outs(lambda a, i: a.dpsi_ds[:, i]),
    ),
    Mistake(
        "other stretch",
        "out_i is divided by the wrong stretch.",
        "out_i belongs to the axis i: stress and stretch along the same axis.",
        _outs(lambda a, i: a.dpsi_ds[:, i] / a.s[:, 1 - i]),
    ),
    Mistake(
        "wrong limit",
        "The limit of flip, where the stretches meet, is not the right combination of second derivatives.",
        "Step apart by a small gap, one stretch up, the other down: what does that do to the two stresses?",
        lambda a: (
            _flip_limit(lambda H: H[:, 0, 0] + H[:, 0, 1])(a),
            _flip_limit(lambda H: H[:, 0, 0])(a),
            _flip_limit(lambda H: H[:, 0, 1])(a),
            _flip_limit(lambda H: H[:, 0, 1] - H[:, 0, 0])(a),
            _flip_limit(lambda H: (H[:, 0, 0] - H[:, 0, 1]) / 2)(a),
            _flip_limit(lambda H: H[:, 0, 0] + H[:, 1, 1] - H[:, 0, 1])(a),
        ),
    ),
    Mistake(
        "limit always",
        "The limit of flip is taken everywhere, or where the gap is large.",
        "The limit holds where the stretches meet; elsewhere the quotient does. It depends on the energy.",
        _limit_always,
    ),
    Mistake(
        "difference in twist",
        "Twist has the difference of the stresses above, where flip has it.",
        "Plus over plus, minus over minus.",
        lambda a: replaced(a.right, 1, (a.dpsi_ds[:, 0] - a.dpsi_ds[:, 1]) / (a.s[:, 0] + a.s[:, 1])),
    ),
    Mistake(
        "difference below twist",
        "Twist is divided by the difference of the stretches.",
        "Plus over plus, minus over minus.",
        lambda a: replaced(a.right, 1, (a.dpsi_ds[:, 0] + a.dpsi_ds[:, 1]) / (a.s[:, 0] - a.s[:, 1])),
    ),
)


said_eigensystem = {
    "digits": (
        "Your values are nearly right everywhere: as if a small number had been added to what you divide by.",
        "Divide by the larger of the two, the denominator and 1e-6: where nothing collapses, nothing changes.",
    ),
    "permuted:1,0,2,3": (
        "Flip and twist are exchanged.",
        "Minus over minus is flip, plus over plus is twist; flip comes first.",
    ),
    "permuted:0,1,3,2": ("out_0 and out_1 are exchanged.", "out_i belongs to stretch i."),
    "clamped": (
        "Negative eigenvalues are replaced by zero.",
        "The projection is done later, and not by you: return the true eigenvalues.",
    ),
    "where s_0 = s_1: nan": (
        "Where the stretches meet, your result is zero divided by zero.",
        "Where the gap is tiny, take the limit of the quotient in place of the quotient.",
    ),
}


conditions_d2psi_dFij = conditions_stress


def conditions_eigensystem(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    yield from conditions_stretches(a)
    yield from conditions_stress(a)
