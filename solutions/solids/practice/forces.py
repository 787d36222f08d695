"""forces: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Derivative, Given, Line, Outputs, Property, Rng
from muslin.judging.differences import CASES, flat, stepped
from muslin.judging.differences import dot as dot_rows
from muslin.judging.relations import (
    FACTOR,
    OMEGA,
    Q,
    again,
    between,
    binades,
    directions,
    follows,
    in_turn,
    matrices,
    norms,
    relative,
    split_runs,
    summed,
    sweep,
    times,
    turned,
    vanishes,
    vectors,
)
from muslin.judging.vectors import apply, length, transposed
from muslin.tasks.comparing import largest_of, natural_scale, size_of

from .tetrahedra import LIES, bodies, left, with_gradients


def terms_nodal_force(a: Given) -> Any:
    """Size of the terms that nodal_force is a sum of, (b,)."""
    return a["volume"] * size_of(a["P"]) * size_of(a["grad_phi"])


def terms_stiffness_block(a: Given) -> Any:
    """Size of the terms that stiffness_block is a sum of, (b,)."""
    return a["volume"] * size_of(a["d2psi_dF2"]) * size_of(a["grad_phi_i"]) * size_of(a["grad_phi_j"])


def terms_spring_force(a: Given) -> Any:
    """Size of the terms that spring_force is a sum of, (b,)."""
    return a["k"] * (size_of(a["x1"] - a["x0"]) + a["l0"])


def _pulled(rng: Rng) -> Arrays:
    """One vertex of tetrahedra under stress."""
    _, G = with_gradients(rng)
    P = matrices(rng, len(LIES)) * binades(rng, 7, 16, len(LIES))[:, None, None]
    return {"P": P, "grad_phi": G[:, 1], "volume": bodies(rng, len(G))["volume"]}


def _all_four(rng: Rng) -> Arrays:
    """The same stress at all four vertices."""
    a, (_, G) = _pulled(rng), with_gradients(rng)
    return in_turn(*({**a, "grad_phi": G[:, i]} for i in range(4)))


def _together(a: Given, out: Outputs) -> np.ndarray:
    return relative(
        split_runs(out[0], 4).sum(axis=0),
        split_runs(natural_scale(terms_nodal_force, out[0], a), 4).sum(axis=0),
    )


def _power(a: Given, f: np.ndarray) -> np.ndarray:
    """What the force does on a move, plus what the energy gains."""
    gained = a["volume"] * np.sum(a["P"] * (OMEGA[:, None] * a["grad_phi"][:, None, :]), axis=(1, 2))
    return np.sum(f * OMEGA, axis=1) + gained


properties_nodal_force = (
    Property(
        "balance",
        "The four forces of a tetrahedron must sum to zero, as the gradients do.",
        _all_four,
        _together,
    ),
    Property(
        "power",
        "When the vertex moves, the force must do the work that the tetrahedron gives up.",
        _pulled,
        vanishes(terms_nodal_force, _power),
        cause="negated",
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
    Property(
        "linear in volume",
        "Twice the volume must pull twice as hard.",
        again(_pulled, times("volume")),
        follows(terms_nodal_force, lambda f: FACTOR * f),
    ),
)


def _stiff(rng: Rng) -> Arrays:
    """Two vertices of tetrahedra, and any symmetric Hessian."""
    (_, G), count = with_gradients(rng), len(LIES)
    H = between(rng, -1, 1, count, 9, 9) * binades(rng, 7, 16, count)[:, None, None]
    return {
        "d2psi_dF2": H + transposed(H),
        "grad_phi_i": G[:, 1],
        "grad_phi_j": G[:, 2],
        "volume": bodies(rng, count)["volume"],
    }


def _unsymmetric(rng: Rng) -> Arrays:
    a = _stiff(rng)
    return {**a, "d2psi_dF2": between(rng, -1, 1, len(LIES), 9, 9)}


def _every_other(rng: Rng) -> Arrays:
    """Vertex i with each of the four vertices j."""
    a, (_, G) = _stiff(rng), with_gradients(rng)
    return in_turn(*({**a, "grad_phi_i": G[:, 1], "grad_phi_j": G[:, j]} for j in range(4)))


def _no_resistance(a: Given, out: Outputs) -> np.ndarray:
    scale = split_runs(natural_scale(terms_stiffness_block, out[0], a), 4).sum(axis=0)
    return relative(split_runs(out[0], 4).sum(axis=0), scale)


def _quadratic(a: Given, K: np.ndarray) -> np.ndarray:
    """v^T K w, less what moving vertex j by w and vertex i by v makes of the energy, to second order."""
    v, w = OMEGA, Q[0]
    one = (v[:, None] * a["grad_phi_i"][:, None, :]).reshape(-1, 9)
    other = (w[:, None] * a["grad_phi_j"][:, None, :]).reshape(-1, 9)
    energy = a["volume"] * np.sum(one * np.sum(a["d2psi_dF2"] * other[:, None, :], axis=2), axis=1)
    return np.sum(v[:, None] * K * w, axis=(1, 2)) - energy


properties_stiffness_block = (
    Property(
        "translations meet no resistance",
        "Moving all four vertices together deforms nothing: the four blocks of a row must sum to zero.",
        _every_other,
        _no_resistance,
    ),
    Property(
        "symmetric as a whole",
        "Block (j, i) must be block (i, j) transposed.",
        again(_stiff, lambda rng, a: {"grad_phi_i": a["grad_phi_j"], "grad_phi_j": a["grad_phi_i"]}),
        follows(terms_stiffness_block, transposed),
    ),
    Property(
        "second order of the energy",
        "Moving vertex i by v and j by w must change the energy by v^T K w, to second order.",
        _stiff,
        vanishes(terms_stiffness_block, _quadratic),
        cause="negated",
    ),
    Property(
        "rows to i, columns to j",
        "For a matrix that is not symmetric, too: rows belong to vertex i, columns to vertex j.",
        _unsymmetric,
        vanishes(terms_stiffness_block, _quadratic),
    ),
    Property(
        "linear in d2psi_dF2",
        "The sum of two Hessians must give the sum of the blocks.",
        summed(_stiff, "d2psi_dF2"),
        follows(terms_stiffness_block, lambda one, other: one + other, runs=3),
    ),
    *(
        Property(
            f"linear in {name}",
            f"{name} times a factor must give the block times that factor.",
            again(_stiff, times(name)),
            follows(terms_stiffness_block, lambda K: FACTOR * K),
        )
        for name in ("grad_phi_i", "grad_phi_j", "volume")
    ),
)


def _springs(rng: Rng, low: float = 0.2, high: float = 3) -> Arrays:
    """Springs of every length between shares of their rest length."""
    l0, x0 = binades(rng, -5, 3, 8), vectors(rng, 8, 3)
    way = (l0 * between(rng, low, high, 8))[:, None] * directions(rng, 8)
    return {"x0": x0, "x1": x0 + way, "l0": l0, "k": binades(rng, 0, 14, 8)}


def _relaxed(rng: Rng) -> Arrays:
    """Exactly as long as at rest: along an axis, of lengths that are short in binary."""
    a = _springs(rng)
    l0 = np.floor(a["l0"] * 64 + 1) / 64
    axis = np.eye(3)[np.arange(8) % 3]
    x0 = np.floor(a["x0"] * 64) / 64
    return {**a, "x0": x0, "x1": x0 + l0[:, None] * axis, "l0": l0}


def _met(rng: Rng) -> Arrays:
    """Both ends at one place."""
    a = _springs(rng)
    return {**a, "x1": a["x0"]}


def _exchanged(rng: Rng, a: Arrays) -> Arrays:
    return {"x0": a["x1"], "x1": a["x0"]}


def _spring_sweep(a: Given, out: Outputs) -> np.ndarray:
    """Minus the force against differences of k/2 (l - l0)^2, with x0 moving along a fixed direction."""
    way = 0.1 * a["l0"][:, None] * (OMEGA / np.sqrt(np.sum(OMEGA * OMEGA)))

    def energy(t: float) -> np.ndarray:
        return a["k"] / 2 * (length(a["x1"] - a["x0"] - t * way) - a["l0"]) ** 2

    scale = terms_spring_force(a) * norms(way)
    return sweep(-np.sum(out[0] * way, axis=1), energy, scale, (2.0**-1, 2.0**-3, 2.0**-5, 2.0**-7))


properties_spring_force = (
    Property(
        "no force at rest length",
        "A spring that is as long as l0 must pull at nothing.",
        _relaxed,
        vanishes(terms_spring_force, lambda a, f: f),
    ),
    Property(
        "zero where the ends meet",
        "Where both ends are at one place the force must be zero.",
        _met,
        vanishes(terms_spring_force, lambda a, f: f),
    ),
    Property(
        "action and reaction",
        "Exchanging the ends must turn the force round.",
        again(_springs, _exchanged),
        follows(terms_spring_force, lambda f: -f),
    ),
    Property(
        "turns with the spring",
        "Turning both ends must turn the force.",
        again(_springs, turned("x0", "x1")),
        follows(terms_spring_force, lambda f: apply(Q, f)),
    ),
    Property(
        "stretched, it pulls",
        "A stretched spring must pull x0 towards x1.",
        lambda rng: _springs(rng, 1.2, 3),
        vanishes(
            terms_spring_force,
            lambda a, f: np.minimum(dot_rows(f, a["x1"] - a["x0"]) / length(a["x1"] - a["x0"]), 0),
        ),
        cause="negated",
    ),
    Property(
        "linear in k",
        "Twice the stiffness must pull twice as hard.",
        again(_springs, times("k")),
        follows(terms_spring_force, lambda f: FACTOR * f),
    ),
    Property(
        "Taylor sweep of the energy",
        "Moving x0 by ever smaller steps, the change of k/2 (l - l0)^2 per step must approach minus your force.",
        _springs,
        _spring_sweep,
    ),
)


def steps_nodal_force(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"P grad_phi": a["P"] @ a["grad_phi"]}


def steps_stiffness_block(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    H = a["d2psi_dF2"].reshape(3, 3, 3, 3)
    return {"change of row 0 of P as x_j moves along x": H[0, :, 0] @ a["grad_phi_j"]}


def steps_spring_force(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    d = a["x1"] - a["x0"]
    return {"x1 - x0": d, "l": np.linalg.norm(d), "l - l0": np.linalg.norm(d) - a["l0"]}


def _strained(io: Any) -> tuple[Arrays, np.ndarray, np.ndarray]:
    """Deformation gradients and a material, a gradient of a shape function, volumes."""
    rng = io.rng
    frames = [np.linalg.qr(rng.normal(size=(CASES, 3, 3)))[0] for _ in range(2)]
    R, V = (f * np.sign(np.linalg.det(f))[:, None, None] for f in frames)
    s = rng.uniform(0.7, 1.5, (CASES, 3))
    F = (R * s[:, None, :]) @ V.transpose(0, 2, 1)
    return (
        {"F": F, "C": np.full(CASES, 500.0), "D": np.full(CASES, 1250.0)},
        rng.normal(size=(CASES, 3)),
        np.full(CASES, 0.3),
    )


def _line_nodal_force(io: Any) -> Line:
    a, g, volume = _strained(io)
    d = 0.3 * io.direction(3)
    values = {"P": io.true("dpsi_dF", **a), "grad_phi": g, "volume": volume}

    def at(t: np.ndarray) -> np.ndarray:
        F = stepped(a["F"], t, np.einsum("ci,cj->cij", d, g))
        psi = flat(
            lambda **v: io.best("psi", **v), t.shape[1], F=(F, True), C=(a["C"], False), D=(a["D"], False)
        )
        return volume[:, None] * psi

    return Line(
        at, -dot_rows(io.yours("nodal_force", **values), d), -dot_rows(io.true("nodal_force", **values), d)
    )


def loss_nodal_force(a: Given) -> Any:
    """A sum of products loses no digits beyond those of its terms."""
    return 1.0


loss_stiffness_block = loss_nodal_force
derivative_nodal_force = Derivative(
    "the energy volume psi with {psi} psi, the vertex moved", "central", _line_nodal_force
)


def _line_stiffness_block(io: Any) -> Line:
    a, g, volume = _strained(io)
    other, d = io.rng.normal(size=(CASES, 3)), 0.3 * io.direction(3)
    values = {
        "d2psi_dF2": io.true("d2psi_dF2", **a), "grad_phi_i": g, "grad_phi_j": other, "volume": volume,
    }  # fmt: skip

    def at(t: np.ndarray) -> np.ndarray:
        F = stepped(a["F"], t, np.einsum("ci,cj->cij", d, other))
        P = flat(
            lambda **v: io.best("dpsi_dF", **v), t.shape[1], F=(F, True), C=(a["C"], False), D=(a["D"], False)
        )
        return volume[:, None, None] * np.einsum("ckij,cj->cki", P, g)

    along = lambda K: np.einsum("cij,cj->ci", K, d)  # noqa: E731
    return Line(at, along(io.yours("stiffness_block", **values)), along(io.true("stiffness_block", **values)))


derivative_stiffness_block = Derivative(
    "minus the force on vertex i with {dpsi_dF} dpsi_dF, vertex j moved", "central", _line_stiffness_block
)


def _line_spring_force(io: Any) -> Line:
    a = io.cases("spring_force")
    l = length(a["x1"] - a["x0"])  # noqa: E741
    fit = np.flatnonzero((l > 0) & (a["l0"] > 0) & (l > 0.3 * a["l0"]))[:CASES]
    a = {key: value[fit] for key, value in a.items()}
    d = 0.3 * l[fit, None] * io.direction(3)

    def at(t: np.ndarray) -> np.ndarray:
        apart = length(a["x1"][:, None] - stepped(a["x0"], t, d))
        return a["k"][:, None] / 2 * (apart - a["l0"][:, None]) ** 2

    return Line(at, -dot_rows(io.yours("spring_force", **a), d), -dot_rows(io.true("spring_force", **a), d))


def loss_spring_force(a: Given) -> Any:
    """How many times rounding grows where the length is worked out from places, |x0|^2 - 2 x0.x1 + |x1|^2, (b,)."""
    long, far = size_of(a["x1"] - a["x0"]), largest_of(a, "x0", "x1")
    return 1 + (np.where(long > 0, far, 0.0) / np.where(long > 0, long, 1.0)) ** 2


derivative_spring_force = Derivative("the spring's energy, x0 moved", "central", _line_spring_force)
