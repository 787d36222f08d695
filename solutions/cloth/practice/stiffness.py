"""stiffness: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Derivative, Given, Line, Outputs, Property, Rng
from muslin.judging.differences import CASES, stepped
from muslin.judging.relations import (
    FACTOR,
    Q,
    again,
    between,
    binades,
    follows,
    in_turn,
    integers,
    matrices,
    norms,
    relative,
    run_of,
    split_runs,
    summed,
    sweep,
    times,
    vanishes,
    vectors,
)
from muslin.judging.vectors import apply, diag, mul, transposed
from muslin.tasks.comparing import natural_scale, size_of

from .stretched import Deformed
from .triangles import left, reversed, stresses


def terms_d2psi_dFij(a: Given) -> Any:
    """Size of the terms that d2psi_dFij is a sum of, (b,)."""
    return size_of(a["dpsi_ds"]) * (size_of(a["dU"]) + size_of(a["dV"])) + size_of(a["d2psi_ds2"]) * size_of(
        a["ds"]
    )


def terms_eigensystem(a: Given) -> Any:
    """Size of the terms that eigensystem is a sum of, (b,)."""
    return size_of(a["d2psi_ds2"])


def _rates(rng: Rng) -> Arrays:
    """Arguments of d2psi_dFij: any symmetric in-plane Hessian, any derivatives of U, s and V."""
    a = stresses(rng)
    H = matrices(rng, 8) * np.outer([1, 1, 0], [1, 1, 0]) * binades(rng, 7, 16, 8)[:, None, None]
    return {
        **a,
        "d2psi_ds2": H + transposed(H),
        "dU": matrices(rng, 8),
        "ds": vectors(rng, 8),
        "dV": matrices(rng, 8),
    }


def _only_stretching(rng: Rng) -> Arrays:
    a = _rates(rng)
    return {**a, "dU": 0 * a["dU"], "dV": 0 * a["dV"]}


def _product_sweep(a: Given, out: Outputs) -> np.ndarray:
    """The result against differences of U diag(p) V^T, each factor moving at its rate."""
    dp = apply(a["d2psi_ds2"], a["ds"])

    def stress(t: float) -> np.ndarray:
        U, p, V = a["U"] + t * a["dU"], a["dpsi_ds"] + t * dp, a["V"] + t * a["dV"]
        return mul(mul(U, diag(p)), transposed(V))

    scale = natural_scale(terms_d2psi_dFij, out[0], a)
    return sweep(out[0], stress, scale, (2.0**-1, 2.0**-3, 2.0**-5, 2.0**-7))


properties_d2psi_dFij = (
    Property(
        "linear in dU, ds and dV",
        "The sum of two sets of rates dU, ds, dV must give the sum of the results.",
        summed(_rates, "dU", "ds", "dV"),
        follows(terms_d2psi_dFij, lambda one, other: one + other, runs=3),
    ),
    Property(
        "linear in the derivatives of psi",
        "The sum of two energies, dpsi_ds and d2psi_ds2 added, must give the sum of the results.",
        summed(_rates, "dpsi_ds", "d2psi_ds2"),
        follows(terms_d2psi_dFij, lambda one, other: one + other, runs=3),
    ),
    Property(
        "stretching alone",
        "Where dU = dV = 0 only the middle factor changes: seen as U^T (..) V it is diagonal, by the chain rule.",
        _only_stretching,
        vanishes(
            terms_d2psi_dFij,
            lambda a, dP: mul(mul(transposed(a["U"]), dP), a["V"]) - diag(apply(a["d2psi_ds2"], a["ds"])),
        ),
    ),
    Property(
        "turns with the deformed cloth",
        "Turning the deformed cloth, U -> R U and dU -> R dU, must turn the result in the same way.",
        again(_rates, left("U", "dU")),
        follows(terms_d2psi_dFij, lambda dP: mul(Q, dP)),
    ),
    Property(
        "turns with the undeformed cloth",
        "Turning the undeformed cloth, V -> R V and dV -> R dV, must turn the result by R^T from the right.",
        again(_rates, left("V", "dV")),
        follows(terms_d2psi_dFij, lambda dP: mul(dP, Q.T)),
    ),
    Property(
        "signs of the principal directions",
        "Reversing the same two columns of U, V, dU and dV must not change the result.",
        again(_rates, reversed("U", "V", "dU", "dV")),
        follows(terms_d2psi_dFij, lambda dP: dP),
    ),
    Property(
        "Taylor sweep of dpsi_dF",
        "Differences of U diag(dpsi_ds) V^T over ever smaller steps must approach your result.",
        _rates,
        _product_sweep,
    ),
)


def _of_sum(s: np.ndarray, m: np.ndarray, k: np.ndarray, l: np.ndarray) -> Arrays:  # noqa: E741
    s0, s1, zero = s[:, 0], s[:, 1], np.zeros(len(s))
    p = [2 * m * (s0 - 1) + k, 2 * m * (s1 - 1) + k, zero]
    H = [[2 * m + l, l, zero], [l, 2 * m + l, zero], [zero, zero, zero]]
    return {"s": s, "dpsi_ds": np.stack(p, axis=-1), "d2psi_ds2": np.moveaxis(np.array(H), -1, 0)}


def _of_product(s: np.ndarray, m: np.ndarray, k: np.ndarray, l: np.ndarray) -> Arrays:  # noqa: E741
    s0, s1, zero = s[:, 0], s[:, 1], np.zeros(len(s))
    p = [2 * m * (s0 - 1) + k * s1, 2 * m * (s1 - 1) + k * s0, zero]
    coupling = k + l * (s0 * s1)
    H = [[2 * m + l * s1 * s1, coupling, zero], [coupling, 2 * m + l * s0 * s0, zero], [zero, zero, zero]]
    return {"s": s, "dpsi_ds": np.stack(p, axis=-1), "d2psi_ds2": np.moveaxis(np.array(H), -1, 0)}


#: Gaps s_0 - s_1 for the sum, of either sign, across every threshold; relative ones for the product.
GAPS = (0.0, 2.0**-30, -(2.0**-30), 2.0**-20, -(2.0**-20), 2.0**-10, -(2.0**-10), 2.0**-7, -(2.0**-2))


APART = (0.0, 0.01, -0.01, 0.03, -0.1, 0.3)


def _meeting(rng: Rng) -> Arrays:
    """Stretches that meet; every number is short enough in binary for p_0 - p_1 to be exact."""
    m, k, l = (integers(rng, *span, 3) for span in ((1, 64), (-400, 400), (0, 200)))  # noqa: E741
    s1 = np.floor(between(rng, 0.5, 2, 3) * 2.0**20) / 2.0**20
    return in_turn(*(_of_sum(np.stack([s1 + gap, s1, np.ones(3)], axis=1), m, k, l) for gap in GAPS))


def _nearly_meeting(rng: Rng) -> Arrays:
    """Stretches with a gap of 1e-12 to 1e-11: there the quotient is rounding, whatever the numbers are."""
    m, k, l, s1 = (between(rng, *span, 8) for span in ((1, 60), (20, 40), (0, 50), (0.7, 1.6)))  # noqa: E741
    gap = between(rng, 1e-12, 1e-11, 8) * np.where(np.arange(8) % 2, 1.0, -1.0)
    return _of_sum(np.stack([s1 + gap, s1, np.ones(8)], axis=1), m, k, l)


def _constant_area(rng: Rng) -> Arrays:
    """Stretches that meet while their product, so the area, stays what it is."""
    m, k, l = (between(rng, *span, 3) for span in ((1, 60), (-40, 40), (0, 50)))  # noqa: E741
    a = np.concatenate([[0.4], between(rng, 0.4, 1.8, 2)])  # the narrowest gaps always: nobody passes by luck
    runs = []
    for gap in APART:
        s0 = a * (1 + gap)
        s1 = a * a / s0 if gap else a
        runs.append(_of_product(np.stack([s0, s1, np.ones(3)], axis=1), m, k, l))
    return in_turn(*runs)


def _equal(rng: Rng) -> Arrays:
    return run_of(_constant_area(rng), 0, len(APART))


def _unstressed(rng: Rng) -> Arrays:
    m, l, zero = between(rng, 1, 60, 4), between(rng, 0, 50, 4), np.zeros(4)  # noqa: E741
    return in_turn(*(energy(np.ones((4, 3)), m, zero, l) for energy in (_of_sum, _of_product)))


#: In-plane stretches of a cloth that collapses, to a line or to a point, or nearly.
COLLAPSED = np.array(
    [
        (0, 0), (0.5, 0), (0, 0.25), (2.0**-24, 0), (2.0**-24, 2.0**-24), (0.75, 2.0**-30),
        (2.0**-8, 0.5), (0.3125, 2.0**-14), (2.0**-18, 2.0**-12),
    ]
)  # fmt: skip


#: What the handout divides by at least.
LEAST = 1e-6


def _collapsing(rng: Rng) -> Arrays:
    count = len(COLLAPSED)
    m, k, l = (integers(rng, *span, count) for span in ((1, 64), (-400, 400), (0, 200)))  # noqa: E741
    return _of_sum(np.concatenate([COLLAPSED, np.ones((count, 1))], axis=1), m, k, l)


def _beside_the_guard(a: Given, out: Outputs) -> np.ndarray:
    """How far twist, out_0 and out_1 miss the quotient by what the guard allows, in parts of the stresses."""
    s, p = a["s"], a["dpsi_ds"]
    s = np.stack([s[:, 0] + s[:, 1], s[:, 0], s[:, 1]], axis=1)
    p = np.stack([p[:, 0] + p[:, 1], p[:, 0], p[:, 1]], axis=1)
    most = np.stack([np.abs(p[:, 1]) + np.abs(p[:, 2]), np.abs(p[:, 1]), np.abs(p[:, 2])], axis=1)
    return relative(np.abs(out[0][:, 1:] * np.maximum(s, LEAST) - p), norms(most))


def _jump(a: Given, out: Outputs) -> np.ndarray:
    """How far flip at each gap is from flip at none."""
    flip = split_runs(out[0][:, 0], len(APART))
    scale = split_runs(natural_scale(terms_eigensystem, out[0], a), len(APART))
    return relative(np.moveaxis(flip - flip[0], 0, 1), scale.max(axis=0))


def _outside(a: Given, out: np.ndarray) -> np.ndarray:
    """How far twist lies outside the interval from out_0 to out_1."""
    twist, low, high = out[:, 1], out[:, 2:].min(axis=1), out[:, 2:].max(axis=1)
    return np.maximum(np.maximum(low - twist, twist - high), 0)


properties_eigensystem = (
    Property(
        "flip through equal stretches",
        "For the energy of this assignment flip is 2 mu, however near the two stretches come, equal ones included.",
        _meeting,
        vanishes(
            terms_eigensystem, lambda a, out: out[:, 0] - (a["d2psi_ds2"][:, 0, 0] - a["d2psi_ds2"][:, 0, 1])
        ),
    ),
    Property(
        "flip where the stretches nearly meet",
        "Where the gap is tiny the quotient is one rounding error divided by another: there the limit must be taken.",
        _nearly_meeting,
        vanishes(
            terms_eigensystem, lambda a, out: out[:, 0] - (a["d2psi_ds2"][:, 0, 0] - a["d2psi_ds2"][:, 0, 1])
        ),
    ),
    Property(
        "flip is continuous",
        "Let the stretches of a material that resists changes of area meet: flip must not jump.",
        _constant_area,
        _jump,
    ),
    Property(
        "exchanging s_0 and s_1",
        "Exchanging s_0 and s_1 with their derivatives must exchange out_0 and out_1 and nothing else.",
        again(
            _constant_area,
            lambda rng, a: {
                "s": a["s"][:, [1, 0, 2]],
                "dpsi_ds": a["dpsi_ds"][:, [1, 0, 2]],
                "d2psi_ds2": a["d2psi_ds2"][:, [1, 0, 2]][:, :, [1, 0, 2]],
            },
        ),
        follows(terms_eigensystem, lambda out: out[:, [0, 1, 3, 2]]),
    ),
    Property(
        "linear in the derivatives of psi",
        "dpsi_ds and d2psi_ds2 times a factor, of either sign, must give all four values times that factor.",
        again(_constant_area, times("dpsi_ds", "d2psi_ds2", factor=-FACTOR)),
        follows(terms_eigensystem, lambda out: -FACTOR * out),
    ),
    Property(
        "at rest only flip is left",
        "At rest there is no stress: twist, out_0 and out_1 must be zero.",
        _unstressed,
        vanishes(terms_eigensystem, lambda a, out: out[:, 1:]),
    ),
    Property(
        "at equal stretches three agree",
        "Where s_0 = s_1, twist, out_0 and out_1 must be the same.",
        _equal,
        vanishes(terms_eigensystem, lambda a, out: out[:, 1:] - out[:, [2, 3, 1]]),
    ),
    Property(
        "twist lies between out_0 and out_1",
        "A sum over a sum lies between the two quotients: twist must lie between out_0 and out_1.",
        _constant_area,
        vanishes(terms_eigensystem, _outside),
    ),
    Property(
        "stress over stretch",
        "With the same stress, stretches larger by a factor must give twist, out_0 and out_1 smaller by it.",
        again(_constant_area, times("s")),
        lambda a, out: follows(terms_eigensystem, lambda rest: rest / FACTOR)(a, (out[0][:, 1:],)),
    ),
    Property(
        "finite at collapse",
        "Where a stretch or the sum is below 1e-6, it must be divided by 1e-6, no more and no less; above, by itself.",
        _collapsing,
        _beside_the_guard,
    ),
)


def _modes(a: Given) -> dict[str, Any]:
    s, p, H = a["s"], a["dpsi_ds"], a["d2psi_ds2"]
    return {
        "s0 - s1": s[0] - s[1], "s0 + s1": s[0] + s[1],
        "psi_0 - psi_1": p[0] - p[1], "psi_0 + psi_1": p[0] + p[1], "psi_00 - psi_01": H[0, 0] - H[0, 1],
    }  # fmt: skip


def steps_d2psi_dFij(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"Psi_s = diag(dpsi_ds)": np.diag(a["dpsi_ds"]), "ds_ij = d2psi_ds2 ds": a["d2psi_ds2"] @ a["ds"]}


steps_eigensystem = _modes


def _line_d2psi_dFij(io: Any) -> Line:
    from muslin import given
    from muslin.tasks.batch import evaluate

    a = Deformed(io)
    i, j = np.array([0, 1, 2, 0])[:CASES], np.array([1, 1, 0, 2])[:CASES]
    d = np.zeros((CASES, 3, 3))
    d[np.arange(CASES), i, j] = 1.0
    dU, ds, dV = evaluate(given.dsvd, U=a.U, s=a.s, V=a.V, i=i.astype(np.int32), j=j.astype(np.int32))
    values = {"U": a.U, "V": a.V, "dpsi_ds": a.p, "d2psi_ds2": a.H, "dU": dU, "ds": ds, "dV": dV}
    return Line(
        lambda t: a.stress(io, stepped(a.F, t, d)),
        io.yours("d2psi_dFij", **values),
        io.true("d2psi_dFij", **values),
    )


def loss_d2psi_dFij(a: Given) -> Any:
    """A sum of products loses no digits beyond those of its terms."""
    return 1.0


derivative_d2psi_dFij = Derivative(
    "the stress with {dpsi_ds} dpsi_ds, one entry of F moved", "central", _line_d2psi_dFij
)
