"""kinetic_energy: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging import Arrays, Change, Derivative, Given, Line, Outputs, Property, Rng, Tested
from muslin.judging.differences import CASES, flat, stepped
from muslin.judging.relations import (
    FACTOR,
    again,
    follows,
    in_turn,
    norms,
    relative,
    times,
    turned,
    vanishes,
    vectors,
)
from muslin.judging.vectors import dot, transposed

from .tetrahedra import bodies, renumbered

#: All sixteen blocks, row by row.
BLOCKS = np.array([(i, j) for i in range(4) for j in range(4)], dtype=np.int32)

VELOCITIES = ("v0", "v1", "v2", "v3")


def _blocks(rng: Rng) -> Arrays:
    """The sixteen blocks of two tetrahedra, block by block."""
    body = bodies(rng, 2)
    return in_turn(*({**body, "i": np.full(2, i, np.int32), "j": np.full(2, j, np.int32)} for i, j in BLOCKS))


def _block_matrix(rest: Callable[[np.ndarray], np.ndarray]) -> Tested:
    """`rest` of the matrices of all sixteen blocks, (b, 4, 4), in parts of rho volume, is zero."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        blocks = (out[0] / (a["rho"] * a["volume"])).reshape(4, 4, -1)
        m = np.moveaxis(blocks, -1, 0)
        return relative(rest(m), 1 + norms(m))

    return error


properties_mass_block = (
    Property(
        "all sixteen blocks weigh the tetrahedron",
        "The shape functions sum to one, so all sixteen blocks together must be rho volume.",
        _blocks,
        _block_matrix(lambda m: m.sum(axis=(1, 2)) - 1),
    ),
    Property(
        "symmetric",
        "Block (i, j) must be block (j, i).",
        _blocks,
        _block_matrix(lambda m: m - transposed(m)),
    ),
    Property(
        "no vertex is special",
        "The four blocks on the diagonal must be alike, and so must the twelve off it.",
        _blocks,
        _block_matrix(
            lambda m: np.concatenate(
                [m - np.roll(m, 1, axis=(1, 2)), m[:, [0, 3, 1, 2]][:, :, [0, 3, 1, 2]] - m], axis=1
            )
        ),
    ),
    Property(
        "diagonal twice the rest",
        "The integral of phi_i phi_i over a tetrahedron must be twice that of phi_i phi_j.",
        _blocks,
        _block_matrix(lambda m: m[:, [0, 1, 2, 3], [0, 1, 2, 3]] - 2 * m[:, [0, 1, 2, 3], [1, 2, 3, 0]]),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must weigh twice as much.",
            again(_blocks, times(name)),
            follows(None, lambda m: FACTOR * m),
        )
        for name in ("volume", "rho")
    ),
)


def _moving(rng: Rng, count: int = 8) -> Arrays:
    return {**{name: vectors(rng, count, 5) for name in VELOCITIES}, **bodies(rng, count)}


def _together(rng: Rng) -> Arrays:
    a = _moving(rng)
    return {**a, **{name: a["v0"] for name in VELOCITIES}}


def _alone(i: int) -> Change:
    """Change: only vertex i moves."""
    return lambda rng, a: {f"v{k}": a[f"v{k}"] * float(k == i) for k in range(4)}


properties_kinetic_energy = (
    Property(
        "uniform velocity",
        "When all four vertices move with v, the energy must be rho volume |v|^2 / 2.",
        _together,
        vanishes(None, lambda a, T: T - a["rho"] * a["volume"] * dot(a["v0"], a["v0"]) / 2),
    ),
    *(
        Property(
            f"vertex {i} alone",
            f"Vertex {i} moving alone must have a tenth of the energy of all four moving like it.",
            again(_together, _alone(i)),
            follows(None, lambda T: T / 10),
        )
        for i in range(4)
    ),
    Property(
        "never negative",
        "Kinetic energy is never negative.",
        lambda rng: _moving(rng, 24),
        vanishes(None, lambda a, T: np.minimum(T, 0)),
    ),
    Property(
        "quadratic in the velocities",
        "All velocities times a factor, of either sign, must give the energy times its square.",
        again(_moving, times(*VELOCITIES, factor=-FACTOR)),
        follows(None, lambda T: FACTOR**2 * T),
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must not change the energy.",
        again(_moving, renumbered(*VELOCITIES)),
        follows(None, lambda T: T),
    ),
    Property(
        "rotation changes nothing",
        "Turning all four velocities must not change the energy.",
        again(_moving, turned(*VELOCITIES)),
        follows(None, lambda T: T),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must give twice the energy.",
            again(_moving, times(name)),
            follows(None, lambda T: FACTOR * T),
        )
        for name in ("volume", "rho")
    ),
)


def steps_mass_block(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"rho volume": a["rho"] * a["volume"]}


def steps_kinetic_energy(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    v = [a[name] for name in VELOCITIES]
    return {
        "rho volume": a["rho"] * a["volume"],
        "v_i.v_j": np.array([[p @ q for q in v] for p in v]),
    }


def _line_kinetic_energy(io: Any) -> Line:
    """Two energies and a mass: the slope of T in v_0 is the sum of m_0j v_j, by `mass_block`."""
    a = {key: value[:CASES] for key, value in io.cases("kinetic_energy").items()}
    d = io.direction(3) * np.maximum(np.linalg.norm(a["v0"], axis=1), 1)[:, None]

    def at(t: np.ndarray) -> np.ndarray:
        same = {key: (value, False) for key, value in a.items() if key != "v0"}
        moved = (stepped(a["v0"], t, d), True)
        return flat(lambda **v: io.best("kinetic_energy", **v), t.shape[1], v0=moved, **same)

    def momentum(mass: Callable[..., np.ndarray]) -> np.ndarray:
        total = np.zeros(len(d))
        for j, name in enumerate(VELOCITIES):
            i, k = np.zeros(len(d), np.int32), np.full(len(d), j, np.int32)
            total += mass("mass_block", i=i, j=k, volume=a["volume"], rho=a["rho"]) * dot(a[name], d)
        return total

    return Line(at, momentum(io.yours), momentum(io.true))


def loss_mass_block(a: Given) -> Any:
    """A sum of products loses no digits beyond those of its terms."""
    return 1.0


derivative_mass_block = Derivative(
    "{kinetic_energy} kinetic_energy, moved in v0", "central", _line_kinetic_energy
)
