"""stress: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Derivative, Given, Line, Property, Rng
from muslin.judging.differences import CASES, stepped
from muslin.judging.differences import dot as dot_rows
from muslin.judging.relations import (
    FACTOR,
    Q,
    again,
    binades,
    follows,
    in_turn,
    matrices,
    norms,
    relative,
    split_runs,
    summed,
    times,
    vanishes,
)
from muslin.judging.vectors import I, apply, diag, mul, outer, transposed
from muslin.tasks.comparing import size_of

from .stretched import Deformed
from .triangles import LIES, left, reversed, sheets, stresses, with_gradients


def terms_dpsi_dF(a: Given) -> Any:
    """Size of the terms that dpsi_dF is a sum of, (b,)."""
    return size_of(a["dpsi_ds"])


def terms_nodal_force(a: Given) -> Any:
    """Size of the terms that nodal_force is a sum of, (b,)."""
    return a["h"] * a["area"] * size_of(a["P"]) * size_of(a["grad_phi"])


def _rotated_back(a: Given, P: np.ndarray) -> np.ndarray:
    return mul(mul(transposed(a["U"]), P), a["V"]) - diag(a["dpsi_ds"])


properties_dpsi_dF = (
    Property(
        "linear in dpsi_ds",
        "The sum of two gradients in the stretches must give the sum of the stresses.",
        summed(stresses, "dpsi_ds"),
        follows(terms_dpsi_dF, lambda one, other: one + other, runs=3),
    ),
    Property(
        "principal directions",
        "Seen along the principal directions, U^T P V, the stress must be diagonal and hold dpsi_ds.",
        stresses,
        vanishes(terms_dpsi_dF, _rotated_back),
    ),
    Property(
        "turns with the deformed cloth",
        "Turning the deformed cloth, U -> R U, must turn the stress: P -> R P.",
        again(stresses, left("U")),
        follows(terms_dpsi_dF, lambda P: mul(Q, P)),
    ),
    Property(
        "turns with the undeformed cloth",
        "Turning the undeformed cloth, V -> R V, must turn the stress: P -> P R^T.",
        again(stresses, left("V")),
        follows(terms_dpsi_dF, lambda P: mul(P, Q.T)),
    ),
    Property(
        "signs of the principal directions",
        "Reversing the same two columns of U and V is the same F: the stress must not change.",
        again(stresses, reversed("U", "V")),
        follows(terms_dpsi_dF, lambda P: P),
    ),
)


def _pulled(rng: Rng) -> np.ndarrays:
    """One vertex of triangles under stress."""
    _, G = with_gradients(rng)
    sheet = sheets(rng, len(G))
    return {"P": _P(rng), "grad_phi": G[:, 1], "area": sheet["area"], "h": sheet["h"]}


def _P(rng: Rng, count: int = len(LIES)) -> np.ndarray:
    return matrices(rng, count) * binades(rng, 7, 16, count)[:, None, None]


def _three_pulled(rng: Rng) -> np.ndarrays:
    """All three vertices, one after another."""
    _, G = with_gradients(rng)
    sheet, P = sheets(rng, len(LIES)), _P(rng)
    return in_turn(*({"P": P, "grad_phi": G[:, i], "area": sheet["area"], "h": sheet["h"]} for i in range(3)))


def _force_scale(a: Given) -> np.ndarray:
    return a["h"] * a["area"] * norms(a["P"]) * norms(a["grad_phi"])


def _power(a: Given, f: np.ndarray) -> np.ndarray:
    """Power of the force on a vertex that moves with each unit vector, plus the rate of the stored energy."""
    rates = [(a["P"] * outer(v[None], a["grad_phi"])).sum(axis=(1, 2)) for v in I]
    return f + (a["h"] * a["area"])[:, None] * np.stack(rates, axis=1)


properties_nodal_force = (
    Property(
        "forces sum to zero",
        "The gradients of the three shape functions sum to zero, so the three forces must, too.",
        _three_pulled,
        lambda a, out: relative(
            split_runs(out[0], 3).sum(axis=0), split_runs(_force_scale(a), 3).sum(axis=0)
        ),
    ),
    Property(
        "power",
        "When the vertex moves, the force must do the work that the triangle gives up.",
        _pulled,
        vanishes(terms_nodal_force, _power),
    ),
    Property(
        "turns with the stress",
        "Turning the stress, P -> R P, must turn the force.",
        again(_pulled, left("P")),
        follows(terms_nodal_force, lambda f: apply(Q, f)),
    ),
    Property(
        "linear in P",
        "The sum of two stresses must pull with the sum of the forces.",
        summed(_pulled, "P"),
        follows(terms_nodal_force, lambda one, other: one + other, runs=3),
    ),
    Property(
        "linear in grad_phi",
        "The sum of two gradients must give the sum of the forces.",
        summed(_pulled, "grad_phi"),
        follows(terms_nodal_force, lambda one, other: one + other, runs=3),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must pull twice as hard.",
            again(_pulled, times(name)),
            follows(terms_nodal_force, lambda f: FACTOR * f),
        )
        for name in ("area", "h")
    ),
)


def steps_dpsi_dF(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"Psi_s = diag(dpsi_ds)": np.diag(a["dpsi_ds"])}


def steps_nodal_force(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"P grad_phi": a["P"] @ a["grad_phi"]}


def _line_dpsi_dF(io: Any) -> Line:
    a = Deformed(io)
    d = io.direction(3, 3)
    d = d - np.einsum("cij,cj,ck->cik", d, a.N, a.N)  # the normal is carried along, not stretched

    def along(P: np.ndarray) -> np.ndarray:
        return np.einsum("cij,cij->c", P, d)

    values = {"U": a.U, "dpsi_ds": a.p, "V": a.V}
    return Line(
        lambda t: a.psi(io, stepped(a.F, t, d)),
        along(io.yours("dpsi_dF", **values)),
        along(io.true("dpsi_dF", **values)),
    )


derivative_dpsi_dF = Derivative("{psi} psi of the singular values of F, moved in F", "central", _line_dpsi_dF)


def _line_nodal_force(io: Any) -> Line:
    a = Deformed(io)
    d, g = io.direction(3), io.rng.normal(size=(CASES, 3))
    g -= dot_rows(g, a.N)[:, None] * a.N  # gradients of shape functions lie in the plane
    area, h = np.full(CASES, 0.3), np.full(CASES, 0.01)
    P = (a.U * a.p[:, None, :]) @ a.V.transpose(0, 2, 1)
    values = {"P": P, "grad_phi": g, "area": area, "h": h}

    def at(t: np.ndarray) -> np.ndarray:
        return (h * area)[:, None] * a.psi(io, stepped(a.F, t, np.einsum("ci,cj->cij", d, g)))

    return Line(
        at, -dot_rows(io.yours("nodal_force", **values), d), -dot_rows(io.true("nodal_force", **values), d)
    )


def loss_nodal_force(a: Given) -> Any:
    """A sum of products loses no digits beyond those of its terms."""
    return 1.0


loss_dpsi_dF = loss_nodal_force
derivative_nodal_force = Derivative(
    "the energy h a psi with {psi} psi, the vertex moved", "central", _line_nodal_force
)
