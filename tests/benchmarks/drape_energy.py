"""Whether `drape` gains energy, over sizes and time steps: python tests/benchmarks/drape_energy.py [SIZE ...]

For every case the highest total energy less work, as a share of the start's; the kinetic energy at the end; the deepest
vertex; the processor time.
"""

import sys
import time

import muslin

SIZES = (32, 64, 100)
#: Time step [s] and simulated time [s].
TIMES = ((1 / 60, 4.0), (1 / 240, 4.0), (1 / 960, 4.0))
#: Height of the floor [m]: the sphere stands on it, or is above it.
FLOORS = (-0.3, -0.62)


def main(sizes: tuple[int, ...]) -> None:
    """Print a line for every case."""
    print("vertices     dt  floor  highest/start  kinetic at the end  deepest  processor time [s]")
    for size in sizes:
        for dt, span in TIMES:
            for ground in FLOORS:
                began = time.process_time()
                run = muslin.simulate(
                    "drape", contact="solve", friction=0.3, resolution=size, dt=dt, steps=round(span / dt),
                    ground=ground,
                )  # fmt: skip
                energy = run.energies.total - run.energies.work
                print(
                    f"{size:4}x{size:<4} 1/{round(1 / dt):<4} {ground:5}  {energy.max() / energy[0]:13.4f}  "
                    f"{run.energies.kinetic[-1]:18.2e}  {run.energies.penetration.max():7.1e}  "
                    f"{time.process_time() - began:8.1f}",
                    flush=True,
                )


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or SIZES)
