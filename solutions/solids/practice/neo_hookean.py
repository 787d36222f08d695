"""neo_hookean: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Derivative, Given, Line, Property, Rng
from muslin.judging.differences import CASES, flat, stepped
from muslin.judging.relations import (
    STRAIN,
    Q,
    again,
    between,
    follows,
    rotations,
    summed,
    vanishes,
)
from muslin.judging.vectors import I, det, mul, transposed
from muslin.tasks.comparing import Terms, size_of

from .tetrahedra import left, material, right, states

#: Share of the cases in which `ti.svd` may leave more than rounding: it ends after so many sweeps, with errors up to
#: 2e-10 in a quarter of the cases, sometimes in half of them.
SPARED = 0.75

#: A shear of the undeformed solid, dF = F SHEAR: it keeps the volume, and sheared twice it is nothing.
SHEAR = Q[0][:, None] * Q[1]


def _measures(a: Given) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """J, J^(-2/3) and the length of F's inverse, (b,) each."""
    J = np.abs(np.linalg.det(a["F"]))
    return J, np.cbrt(J) ** -2.0, size_of(np.linalg.inv(a["F"]))


def terms_psi(a: Given) -> Any:
    """Size of the terms that psi is a sum of, (b,)."""
    J, freed, _ = _measures(a)
    return a["C"] * (freed * size_of(a["F"]) ** 2 + 3) + a["D"] * (J * J + 1)


def terms_dpsi_dF(a: Given) -> Any:
    """Size of the terms that dpsi_dF is a sum of, (b,)."""
    J, freed, inverse = _measures(a)
    size = size_of(a["F"])
    return a["C"] * freed * size * (1 + size * inverse) + a["D"] * (J + 1) * J * inverse


def terms_d2psi_dF2(a: Given) -> Any:
    """Size of the terms that d2psi_dF2 is a sum of, (b,)."""
    J, freed, inverse = _measures(a)
    return a["C"] * freed * (1 + (size_of(a["F"]) * inverse) ** 2) + a["D"] * (J + 1) * J * inverse**2


def _at_rest(rng: Rng) -> Arrays:
    """Only turned, or not even that."""
    return {"F": np.concatenate([rotations(rng, 7), I[None]]), **material(rng, 8)}


def _blown_up(rng: Rng) -> Arrays:
    """The same stretch in all directions, and turned."""
    s = between(rng, 0.4, 2, 8, 1, 1)
    return {"F": s * rotations(rng, 8), **material(rng, 8)}


def _volume_kept(rng: Rng) -> Arrays:
    """Sheared: the volume stays exactly what it is."""
    F = np.tile(I, (8, 1, 1))
    F[:, 0, 1], F[:, 1, 2] = between(rng, -2, 2, 8), between(rng, -2, 2, 8)
    return {"F": F, **material(rng, 8)}


def _stiffer(rng: Rng, a: Arrays) -> Arrays:
    """Change: another D."""
    return {"D": 1.75 * a["D"]}


def _materials_add(terms: Terms) -> Property:
    return Property(
        "linear in C and D",
        "Two materials together, C and D added, must give the sum of both.",
        summed(states, "C", "D"),
        follows(terms, lambda one, other: one + other, runs=3),
    )


properties_psi = (
    Property(
        "no energy at rest",
        "A solid that is only turned must store no energy.",
        _at_rest,
        vanishes(terms_psi, lambda a, psi: psi),
        cause="un-barred",
    ),
    Property(
        "never negative",
        "Deforming the solid in any way costs energy: psi must never be negative.",
        lambda rng: states(rng, 24),
        vanishes(terms_psi, lambda a, psi: np.minimum(psi, 0)),
    ),
    Property(
        "blind to a rotation after the deformation",
        "Turning the deformed solid, F -> R F, must not change the energy.",
        again(states, left("F")),
        follows(terms_psi, lambda psi: psi),
    ),
    Property(
        "alike in all directions",
        "Turning the undeformed solid, F -> F R^T, must not change the energy.",
        again(states, right("F")),
        follows(terms_psi, lambda psi: psi),
    ),
    _materials_add(terms_psi),
    Property(
        "size costs only D",
        "Growing alike in all directions must cost D (J - 1)^2 and nothing more.",
        _blown_up,
        vanishes(terms_psi, lambda a, psi: psi - a["D"] * (det(a["F"]) - 1) ** 2),
    ),
    Property(
        "a shear costs only C",
        "Where the volume stays, D must not matter.",
        again(_volume_kept, _stiffer),
        follows(terms_psi, lambda psi: psi),
    ),
)


def _torque(a: Given, P: np.ndarray) -> np.ndarray:
    """The antisymmetric part of P F^T."""
    stress = mul(P, transposed(a["F"]))
    return stress - transposed(stress)


properties_dpsi_dF = (
    Property(
        "no stress at rest",
        "A solid that is only turned must be free of stress.",
        _at_rest,
        vanishes(terms_dpsi_dF, lambda a, P: P),
        cause="un-barred",
    ),
    Property(
        "turns with the deformed solid",
        "Turning the deformed solid, F -> R F, must turn the stress: P -> R P.",
        again(states, left("F")),
        follows(terms_dpsi_dF, lambda P: mul(Q, P)),
    ),
    Property(
        "turns with the undeformed solid",
        "Turning the undeformed solid, F -> F R^T, must turn the stress: P -> P R^T.",
        again(states, right("F")),
        follows(terms_dpsi_dF, lambda P: mul(P, Q.T)),
    ),
    Property(
        "no torque",
        "Stress must not turn anything by itself: P F^T must be symmetric.",
        states,
        vanishes(terms_dpsi_dF, _torque, lambda a: size_of(a["F"])),
    ),
    _materials_add(terms_dpsi_dF),
    Property(
        "work of growing",
        "Growing alike in all directions must do work against D alone: P : F must be 6 D J (J - 1).",
        states,
        vanishes(
            terms_dpsi_dF,
            lambda a, P: np.sum(P * a["F"], axis=(1, 2)) - 6 * a["D"] * det(a["F"]) * (det(a["F"]) - 1),
            lambda a: size_of(a["F"]),
        ),
    ),
    Property(
        "work of a shear",
        "A shear dF keeps the volume, and must do work against C alone: P : dF must be 2 C J^(-2/3) F : dF.",
        states,
        vanishes(
            terms_dpsi_dF,
            lambda a, P: np.sum(
                (P - (2 * a["C"] * _measures(a)[1])[:, None, None] * a["F"]) * mul(a["F"], SHEAR), axis=(1, 2)
            ),
            lambda a: size_of(a["F"]),
        ),
    ),
)


def _along(H: np.ndarray, move: np.ndarray) -> np.ndarray:
    """H times a change of F, as a matrix (b, 3, 3)."""
    flat = np.broadcast_to(move, (len(H), 3, 3)).reshape(-1, 9)
    return np.sum(H * flat[:, None, :], axis=2).reshape(-1, 3, 3)


def _turned_hessian(H: np.ndarray) -> np.ndarray:
    """The Hessian at Q F from that at F: both first indices turned."""
    H = H.reshape(-1, 3, 3, 3, 3)
    return np.einsum("ia,zajbn,mb->zijmn", Q, H, Q).reshape(-1, 9, 9)


def _turned_before(H: np.ndarray) -> np.ndarray:
    """The Hessian at F Q^T from that at F: both second indices turned."""
    H = H.reshape(-1, 3, 3, 3, 3)
    return np.einsum("ja,ziamb,nb->zijmn", Q, H, Q).reshape(-1, 9, 9)


def _only_strained(rng: Rng) -> Arrays:
    return {"F": np.tile(I, (8, 1, 1)), **material(rng, 8)}


def _hooke(a: Given, H: np.ndarray) -> np.ndarray:
    """At rest: H dF, less Hooke's law, 4 C times the strain's shape and 2 D times its volume."""
    strain = (STRAIN + STRAIN.T) / 2
    volume = np.trace(strain)
    shape = strain - volume / 3 * I
    law = 4 * a["C"][:, None, None] * shape + 2 * a["D"][:, None, None] * volume * I
    return _along(H, STRAIN) - law


def _growing_twice(a: Given, H: np.ndarray) -> np.ndarray:
    """F : H : F, less what growing alike in all directions costs, to second order."""
    J = det(a["F"])
    return np.sum(_along(H, a["F"]) * a["F"], axis=(1, 2)) - 6 * a["D"] * J * (5 * J - 2)


def _shearing_twice(a: Given, H: np.ndarray) -> np.ndarray:
    """dF : H : dF, less what a shear costs, to second order."""
    move, freed = mul(a["F"], SHEAR), _measures(a)[1]
    return np.sum(_along(H, move) * move, axis=(1, 2)) - 2 * a["C"] * freed * np.sum(move * move, axis=(1, 2))


properties_d2psi_dF2 = (
    Property(
        "symmetric",
        "Second derivatives do not care about their order: the matrix must be symmetric.",
        states,
        vanishes(terms_d2psi_dF2, lambda a, H: H - transposed(H)),
    ),
    Property(
        "Hooke's law at rest",
        "At rest a small strain must be met by 4 C times its change of shape and 2 D times its change of volume.",
        _only_strained,
        vanishes(terms_d2psi_dF2, _hooke),
    ),
    Property(
        "a small rotation costs nothing at rest",
        "At rest, turning a little must change no stress.",
        _only_strained,
        vanishes(terms_d2psi_dF2, lambda a, H: _along(H, STRAIN - STRAIN.T)),
    ),
    Property(
        "turns with the deformed solid",
        "Turning the deformed solid, F -> R F, must turn stress and change of F alike.",
        again(states, left("F")),
        follows(terms_d2psi_dF2, _turned_hessian),
    ),
    Property(
        "turns with the undeformed solid",
        "Turning the undeformed solid, F -> F R^T, must turn stress and change of F alike, from the other side.",
        again(states, right("F")),
        follows(terms_d2psi_dF2, _turned_before),
    ),
    _materials_add(terms_d2psi_dF2),
    Property(
        "growing, to second order",
        "Growing alike in all directions must be met by D alone: F : d2psi_dF2 : F must be 6 D J (5 J - 2).",
        states,
        vanishes(terms_d2psi_dF2, _growing_twice, lambda a: size_of(a["F"]) ** 2),
    ),
    Property(
        "a shear, to second order",
        "A shear dF keeps the volume and must be met by C alone: dF : d2psi_dF2 : dF must be 2 C J^(-2/3) |dF|^2.",
        states,
        vanishes(terms_d2psi_dF2, _shearing_twice, lambda a: size_of(a["F"]) ** 2),
    ),
)


def steps_psi(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    F = a["F"]
    return {
        "J = det F": np.linalg.det(F),
        "tr(F^T F)": np.trace(F.T @ F),
        "J^(-2/3)": np.cbrt(np.linalg.det(F)) ** -2.0,
    }


def steps_dpsi_dF(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    inverse = np.linalg.inv(a["F"])
    return steps_psi(a) | {"F^(-T)": inverse.T, "dJ/dF = J F^(-T)": np.linalg.det(a["F"]) * inverse.T}


steps_d2psi_dF2 = steps_dpsi_dF


def _cases(io: Any, task: str) -> Arrays:
    """The cases that are deformed most mildly, but deformed."""
    a = io.cases(task)
    off = np.abs(np.einsum("bij,bik->bjk", a["F"], a["F"]) - I).max(axis=(1, 2))
    mild = np.argsort(np.abs(off - 0.6), kind="stable")[:CASES]
    return {key: value[mild] for key, value in a.items()}


def _line_dpsi_dF(io: Any) -> Line:
    a, d = _cases(io, "dpsi_dF"), 0.3 * io.direction(3, 3)

    def at(t: np.ndarray) -> np.ndarray:
        return flat(
            lambda **v: io.best("psi", **v), t.shape[1],
            F=(stepped(a["F"], t, d), True), C=(a["C"], False), D=(a["D"], False),
        )  # fmt: skip

    along = lambda P: np.einsum("cij,cij->c", P, d)  # noqa: E731
    return Line(at, along(io.yours("dpsi_dF", **a)), along(io.true("dpsi_dF", **a)))


def loss_dpsi_dF(a: Given) -> Any:
    """How many times rounding grows on the way through F^T F, (b,)."""
    return 1 + (size_of(a["F"]) * _measures(a)[2] / 3) ** 2


loss_d2psi_dF2 = loss_dpsi_dF
derivative_dpsi_dF = Derivative("{psi} psi, moved in F", "central", _line_dpsi_dF, spared=SPARED)


def _line_d2psi_dF2(io: Any) -> Line:
    a, d = _cases(io, "d2psi_dF2"), 0.3 * io.direction(3, 3)

    def at(t: np.ndarray) -> np.ndarray:
        return flat(
            lambda **v: io.best("dpsi_dF", **v), t.shape[1],
            F=(stepped(a["F"], t, d), True), C=(a["C"], False), D=(a["D"], False),
        )  # fmt: skip

    along = lambda H: np.einsum("cpq,cq->cp", H, d.reshape(CASES, 9)).reshape(CASES, 3, 3)  # noqa: E731
    return Line(at, along(io.yours("d2psi_dF2", **a)), along(io.true("d2psi_dF2", **a)))


derivative_d2psi_dF2 = Derivative("{dpsi_dF} dpsi_dF, moved in F", "central", _line_d2psi_dF2, spared=SPARED)
