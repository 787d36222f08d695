"""kinetic_energy: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.judging import Arrays, Change, Given, Outputs, Property, Rng, Tested
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

from .triangles import renumbered, sheets

#: All nine blocks, row by row.
BLOCKS = np.array([(i, j) for i in range(3) for j in range(3)], dtype=np.int32)


def _blocks(rng: Rng) -> Arrays:
    """The nine blocks of two triangles, block by block."""
    sheet = sheets(rng, 2)
    return in_turn(
        *({**sheet, "i": np.full(2, i, np.int32), "j": np.full(2, j, np.int32)} for i, j in BLOCKS)
    )


def _block_matrix(rest: Callable[[np.ndarray], np.ndarray]) -> Tested:
    """`rest` of the matrices of all nine blocks, (b, 3, 3), in parts of rho h a, is zero."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        blocks = (out[0] / (a["rho"] * a["h"] * a["area"])).reshape(3, 3, -1)
        m = np.moveaxis(blocks, -1, 0)
        return relative(rest(m), 1 + norms(m))

    return error


properties_mass_block = (
    Property(
        "all nine blocks weigh the triangle",
        "The shape functions sum to one, so all nine blocks together must be rho h area.",
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
        "The three blocks on the diagonal must be alike, and so must the six off it.",
        _blocks,
        _block_matrix(lambda m: m - np.roll(m, 1, axis=(1, 2))),
    ),
    Property(
        "diagonal twice the rest",
        "The integral of phi_i phi_i over a triangle must be twice that of phi_i phi_j.",
        _blocks,
        _block_matrix(lambda m: m[:, [0, 1, 2], [0, 1, 2]] - 2 * m[:, [0, 1, 2], [1, 2, 0]]),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must weigh twice as much.",
            again(_blocks, times(name)),
            follows(None, lambda m: FACTOR * m),
        )
        for name in ("area", "rho", "h")
    ),
)


def _moving(rng: Rng, count: int = 8) -> Arrays:
    return {**{f"v{i}": vectors(rng, count, 5) for i in range(3)}, **sheets(rng, count)}


def _together(rng: Rng) -> Arrays:
    a = _moving(rng)
    return {**a, "v1": a["v0"], "v2": a["v0"]}


def _alone(i: int) -> Change:
    """Change: only vertex i moves."""
    return lambda rng, a: {f"v{k}": a[f"v{k}"] * float(k == i) for k in range(3)}


properties_kinetic_energy = (
    Property(
        "uniform velocity",
        "When all three vertices move with v, the energy must be rho h area |v|^2 / 2.",
        _together,
        vanishes(None, lambda a, T: T - a["rho"] * a["h"] * a["area"] * dot(a["v0"], a["v0"]) / 2),
    ),
    *(
        Property(
            f"vertex {i} alone",
            f"Vertex {i} moving alone must have a sixth of the energy of all three moving like it.",
            again(_together, _alone(i)),
            follows(None, lambda T: T / 6),
        )
        for i in range(3)
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
        again(_moving, times("v0", "v1", "v2", factor=-FACTOR)),
        follows(None, lambda T: FACTOR**2 * T),
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must not change the energy.",
        again(_moving, renumbered("v0", "v1", "v2")),
        follows(None, lambda T: T),
    ),
    Property(
        "rotation changes nothing",
        "Turning all three velocities must not change the energy.",
        again(_moving, turned("v0", "v1", "v2")),
        follows(None, lambda T: T),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must give twice the energy.",
            again(_moving, times(name)),
            follows(None, lambda T: FACTOR * T),
        )
        for name in ("area", "rho", "h")
    ),
)


def steps_mass_block(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"rho h area": a["rho"] * a["h"] * a["area"]}


def steps_kinetic_energy(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {
        "rho h area": a["rho"] * a["h"] * a["area"],
        "v0.v0, v1.v1, v2.v2": np.array([a[f"v{k}"] @ a[f"v{k}"] for k in range(3)]),
        "v0.v1, v1.v2, v2.v0": np.array([a[f"v{k}"] @ a[f"v{(k + 1) % 3}"] for k in range(3)]),
    }
