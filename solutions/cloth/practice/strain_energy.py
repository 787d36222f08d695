"""strain_energy: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Change, Derivative, Given, Line, Property, Rng
from muslin.judging.differences import dot as dot_rows
from muslin.judging.differences import flat, stepped
from muslin.judging.relations import (
    Q,
    again,
    between,
    follows,
    matrices,
    norms,
    rotations,
    summed,
    times,
    vanishes,
)
from muslin.judging.vectors import I, det, diag, dot, mul, transposed
from muslin.tasks.comparing import Terms, size_of

from .stretched import stretched
from .triangles import material, states, stretches


def terms_right_cauchy_green(a: Given) -> Any:
    """Size of the terms that right_cauchy_green is a sum of, (b,)."""
    return size_of(a["F"]) ** 2


def terms_psi(a: Given) -> Any:
    """Size of the terms that psi is a sum of, (b,)."""
    return 2 * a["mu"] + a["lam"]


def terms_dpsi_ds(a: Given) -> Any:
    """Size of the terms that dpsi_ds is a sum of, (b,)."""
    return 2 * a["mu"] + a["lam"]


def _cloth_gradients(rng: Rng) -> np.ndarrays:
    """F of stretched cloth, and any other."""
    stretched = mul(mul(rotations(rng, 8), diag(stretches(rng, 8))), transposed(rotations(rng, 8)))
    return {"F": np.concatenate([stretched, 2 * matrices(rng, 4)])}


def _rotation_only(rng: Rng) -> np.ndarrays:
    return {"F": np.concatenate([rotations(rng, 4), I[None]])}


properties_right_cauchy_green = (
    Property(
        "symmetric",
        "|dx|^2 = dX^T C dX: C must be symmetric.",
        _cloth_gradients,
        vanishes(terms_right_cauchy_green, lambda a, C: C - transposed(C)),
    ),
    Property(
        "a rotation strains nothing",
        "If F is a rotation, C must be the identity.",
        _rotation_only,
        vanishes(terms_right_cauchy_green, lambda a, C: C - I),
    ),
    Property(
        "blind to a rotation after the deformation",
        "Turning the deformed cloth, F -> R F, must not change C.",
        again(_cloth_gradients, lambda rng, a: {"F": mul(Q, a["F"])}),
        follows(terms_right_cauchy_green, lambda C: C),
    ),
    Property(
        "turns with the undeformed cloth",
        "Turning the undeformed cloth, F -> F R^T, must turn C: C -> R C R^T.",
        again(_cloth_gradients, lambda rng, a: {"F": mul(a["F"], Q.T)}),
        follows(terms_right_cauchy_green, lambda C: mul(mul(Q, C), Q.T)),
    ),
    Property(
        "trace",
        "The trace of C must be the sum of the squares of all entries of F.",
        _cloth_gradients,
        vanishes(terms_right_cauchy_green, lambda a, C: np.trace(C, axis1=1, axis2=2) - norms(a["F"]) ** 2),
    ),
    Property(
        "determinant",
        "The determinant of C must be the square of that of F.",
        _cloth_gradients,
        vanishes(
            terms_right_cauchy_green, lambda a, C: det(C) - det(a["F"]) ** 2, lambda a: 1 + norms(a["F"]) ** 4
        ),
    ),
)


AT_REST = np.ones(3)


def _exchanged(rng: Rng, a: np.ndarrays) -> np.ndarrays:
    """Change: s_0 and s_1 trade places."""
    return {"s": a["s"][:, [1, 0, 2]]}


def _other_normal(rng: Rng, a: np.ndarrays) -> np.ndarrays:
    """Change: another third stretch."""
    return {"s": a["s"] * np.array([1, 1, 0]) + between(rng, 0.4, 1.8, len(a["s"]), 1) * np.array([0, 0, 1])}


def _slightly_strained(rng: Rng) -> np.ndarrays:
    return {**material(rng, 8), "s": AT_REST + between(rng, -0.3, 0.3, 8, 3) * np.array([1, 1, 0])}


def _strained(factor: float) -> Change:
    """Change: the strain s - 1 times a factor."""
    return lambda rng, a: {"s": AT_REST + factor * (a["s"] - AT_REST)}


def _other_stretches(rng: Rng, a: np.ndarrays) -> np.ndarrays:
    return {"s": stretches(rng, len(a["s"]))}


def _relaxed(rng: Rng) -> np.ndarrays:
    return {**material(rng, 8), "s": np.ones((8, 3))}


def _strip(rng: Rng) -> np.ndarrays:
    """One stretch away from 1, now the first, now the second."""
    away = np.where(np.arange(8)[:, None] % 2 == 0, I[0], I[1])
    return {**material(rng, 8), "s": AT_REST + between(rng, -0.8, 1.5, 8, 1) * away}


def _balanced(rng: Rng) -> np.ndarrays:
    """One stretch as far above 1 as the other is below."""
    d = between(rng, 0.1, 0.8, 8, 1) * np.array([1, -1, 0])
    return {**material(rng, 8), "s": AT_REST + d}


def _materials_add(terms: Terms) -> Property:
    return Property(
        "linear in mu and lam",
        "Two materials together, mu and lam added, must give the sum of both.",
        summed(states, "mu", "lam"),
        follows(terms, lambda one, other: one + other, runs=3),
    )


def _third_stretch(terms: Terms) -> Property:
    return Property(
        "the normal's stretch does not count",
        "Only the two stretches in the plane store energy: the third, s_2, must not matter.",
        again(states, _other_normal),
        follows(terms, lambda result: result),
        cause="third stretch",
    )


properties_psi = (
    Property(
        "no energy at rest",
        "At s = (1, 1, 1) the energy must be zero.",
        _relaxed,
        vanishes(terms_psi, lambda a, psi: psi),
    ),
    Property(
        "never negative",
        "Deforming the cloth in any way costs energy: psi must never be negative.",
        lambda rng: states(rng, 24),
        vanishes(terms_psi, lambda a, psi: np.minimum(psi, 0)),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must not change the energy.",
        again(states, _exchanged),
        follows(terms_psi, lambda psi: psi),
    ),
    _third_stretch(terms_psi),
    _materials_add(terms_psi),
    Property(
        "quadratic in the strain",
        "Three times the strain s - 1, of either sign, must cost nine times the energy.",
        again(_slightly_strained, _strained(-3.0)),
        follows(terms_psi, lambda psi: 9 * psi),
    ),
    Property(
        "one stretch alone",
        "Stretching in one direction only, s = (1 + d, 1), must cost (mu + lam/2) d^2.",
        _strip,
        vanishes(terms_psi, lambda a, psi: psi - (a["mu"] + a["lam"] / 2) * dot(a["s"] - 1, a["s"] - 1)),
    ),
    Property(
        "lam feels only the change of area",
        "Where s_0 + s_1 = 2 the area does not change (to first order), and lam must not matter.",
        again(_balanced, times("lam")),
        follows(terms_psi, lambda psi: psi),
    ),
)


def _work(a: Given, p: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """dpsi_ds^T (s - 1), less a stiffness times |s - 1|^2."""
    d = a["s"] - AT_REST
    return dot(p - stiffness[:, None] * d, d)


properties_dpsi_ds = (
    Property(
        "no stress at rest",
        "At s = (1, 1, 1) the energy is least, so its gradient must be zero.",
        _relaxed,
        vanishes(terms_dpsi_ds, lambda a, p: p),
    ),
    Property(
        "third entry zero",
        "psi does not depend on s_2, so the third entry must be zero.",
        states,
        vanishes(terms_dpsi_ds, lambda a, p: p[:, 2]),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must exchange the first two entries.",
        again(states, _exchanged),
        follows(terms_dpsi_ds, lambda p: p[:, [1, 0, 2]]),
    ),
    _third_stretch(terms_dpsi_ds),
    _materials_add(terms_dpsi_ds),
    Property(
        "linear in the strain",
        "Minus three times the strain s - 1 must give minus three times the gradient.",
        again(_slightly_strained, _strained(-3.0)),
        follows(terms_dpsi_ds, lambda p: -3 * p),
    ),
    Property(
        "work of one stretch alone",
        "Stretching in one direction only, s = (1 + d, 1): dpsi_ds^T (s - 1) must be (2 mu + lam) d^2.",
        _strip,
        vanishes(terms_dpsi_ds, lambda a, p: _work(a, p, 2 * a["mu"] + a["lam"])),
    ),
    Property(
        "lam feels only the change of area",
        "Where s_0 + s_1 = 2 the area does not change (to first order): dpsi_ds^T (s - 1) must be 2 mu |s - 1|^2.",
        _balanced,
        vanishes(terms_dpsi_ds, lambda a, p: _work(a, p, 2 * a["mu"])),
    ),
)


def _met(H: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """How a change of the stretches in a direction d is met: d^T H d."""
    return np.sum(H * direction[:, None] * direction, axis=(1, 2))


def _negative_part(a: Given, H: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of the in-plane block, where it is negative."""
    a00, a11, a01 = H[:, 0, 0], H[:, 1, 1], (H[:, 0, 1] + H[:, 1, 0]) / 2
    return np.minimum((a00 + a11) / 2 - np.hypot((a00 - a11) / 2, a01), 0)


properties_d2psi_ds2 = (
    Property(
        "symmetric",
        "Second derivatives do not care about their order: the matrix must be symmetric.",
        states,
        vanishes(None, lambda a, H: H - transposed(H)),
    ),
    Property(
        "third row and column zero",
        "psi does not depend on s_2, so the third row and column must be zero.",
        states,
        vanishes(None, lambda a, H: np.concatenate([H[:, 2], H[:, :, 2]], axis=1)),
    ),
    Property(
        "the same everywhere",
        "psi is quadratic, so its Hessian must not depend on the stretches.",
        again(states, _other_stretches),
        follows(None, lambda H: H),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must exchange the first two rows and columns.",
        again(states, _exchanged),
        follows(None, lambda H: H[:, [1, 0, 2]][:, :, [1, 0, 2]]),
    ),
    _materials_add(None),
    Property(
        "positive semi-definite",
        "At rest psi is least: with mu > 0 and lam >= 0 no eigenvalue may be negative.",
        states,
        vanishes(None, _negative_part),
    ),
    Property(
        "both stretches alike",
        "Along d = (1, 1, 0) both stretches grow: d^T d2psi_ds2 d must be 4 (mu + lam).",
        states,
        vanishes(None, lambda a, H: _met(H, np.array([1, 1, 0])) - 4 * (a["mu"] + a["lam"])),
    ),
    Property(
        "lam feels only the change of area",
        "Along d = (1, -1, 0) the area stays (to first order): d^T d2psi_ds2 d must be 4 mu.",
        states,
        vanishes(None, lambda a, H: _met(H, np.array([1, -1, 0])) - 4 * a["mu"]),
    ),
)


def _svd(F: np.ndarray) -> dict[str, Any]:
    s = np.linalg.svd(F, compute_uv=False)
    return {"singular values of F": s, "their squares": s * s, "det F": np.linalg.det(F)}


def _stretches(a: Given) -> dict[str, Any]:
    s = a["s"]
    return {"s0 - 1": s[0] - 1, "s1 - 1": s[1] - 1, "s0 + s1 - 2": s[0] + s[1] - 2}


def steps_right_cauchy_green(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return _svd(a["F"])


steps_psi = _stretches


steps_dpsi_ds = _stretches


def _line_dpsi_ds(io: Any) -> Line:
    a, d = stretched(io), io.direction(3)

    def at(t: np.ndarray) -> np.ndarray:
        return flat(
            lambda **v: io.best("psi", **v), t.shape[1],
            s=(stepped(a["s"], t, d), True), mu=(a["mu"], False), lam=(a["lam"], False),
        )  # fmt: skip

    return Line(at, dot_rows(io.yours("dpsi_ds", **a), d), dot_rows(io.true("dpsi_ds", **a), d))


derivative_dpsi_ds = Derivative("{psi} psi, moved in s", "forward", _line_dpsi_ds)


def _line_d2psi_ds2(io: Any) -> Line:
    a, d = stretched(io), io.direction(3)

    def at(t: np.ndarray) -> np.ndarray:
        return flat(
            lambda **v: io.best("dpsi_ds", **v), t.shape[1],
            s=(stepped(a["s"], t, d), True), mu=(a["mu"], False), lam=(a["lam"], False),
        )  # fmt: skip

    along = lambda H: np.einsum("cij,cj->ci", H, d)  # noqa: E731
    return Line(at, along(io.yours("d2psi_ds2", **a)), along(io.true("d2psi_ds2", **a)))


def loss_d2psi_ds2(a: Given) -> Any:
    """A sum of products loses no digits beyond those of its terms."""
    return 1.0


loss_dpsi_ds = loss_d2psi_ds2
derivative_d2psi_ds2 = Derivative("{dpsi_ds} dpsi_ds, moved in s", "central", _line_d2psi_ds2)
