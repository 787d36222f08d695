"""What each integrator keeps: a free sheet that spins, and a sheet that swings.  The tables of docs/integrators.md.

python tests/benchmarks/integrators.py
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import muslin
from muslin.mesh import grid
from muslin.simulation.integrators import steps
from muslin.simulation.model import Model, State

NAMES = ("linearly-implicit", "backward-euler", "bdf2", "midpoint")
STEPS = (60, 240, 960)


def sheet() -> tuple[muslin.Cloth, np.ndarray]:
    """A square metre of 9x9 vertices, and its undeformed positions."""
    cloth = grid(9, 9, diagonals="zigzag")
    return muslin.Cloth(cloth, mu=2e3, lam=2e3, rho=0.2), cloth.vertices


def spin(name: str, rate: int, speed: float = 5.0) -> tuple[float, float]:
    """Shares of angular momentum and of energy after 1 s."""
    body, X = sheet()
    states = steps(
        Model(body, gravity=np.zeros(3)), State(X.copy(), np.cross([0, 0, speed], X)), 1 / rate, name, rate
    )

    def kept(state: State) -> tuple[float, float]:
        p = (body.mass @ state.v.ravel()).reshape(-1, 3)
        return float(np.cross(state.x, p).sum(axis=0)[2]), body.kinetic_energy(state.v) + body.energy_here()

    return ratio(map(kept, states))


def ratio(kept: Iterator[tuple[float, float]]) -> tuple[float, float]:
    """The last of both, of the first."""
    first, *_, last = kept
    return last[0] / first[0], last[1] / first[1]


def pendulum(name: str, rate: int, time: int = 1) -> tuple[float, float]:
    """A sheet let go level, held by one edge: the share of the energy it fell with that it has left after a second, and
    at most on the way."""
    body, X = sheet()
    level = np.stack([X[:, 0], X[:, 2], -X[:, 1]], axis=1)
    model = Model(body, gravity=np.array([0, -9.81, 0]), pinned=np.flatnonzero(X[:, 1] > 0.499))
    lowest = -9.81 * 0.2 * 0.5  # of the same sheet, hanging straight
    start = State(level, np.zeros_like(X))
    totals = [
        body.kinetic_energy(state.v) + body.energy_here() + model.potential(state.x)
        for state in steps(model, start, 1 / rate, name, time * rate)
    ]
    left = (np.array(totals) - lowest) / (totals[0] - lowest)
    return float(left[-1]), float(left.max())


def main() -> None:
    """Print both tables."""
    for what, measured in (("spin", spin), ("pendulum", pendulum)):
        for rate in STEPS:
            for name in NAMES:
                try:
                    one, two = measured(name, rate)
                    print(f"{what:10s} dt = 1/{rate:<4d} {name:20s} {one:8.4f} {two:8.4f}", flush=True)
                except muslin.MuslinError as error:
                    print(f"{what:10s} dt = 1/{rate:<4d} {name:20s} {error}", flush=True)


if __name__ == "__main__":
    main()
