"""Time of a step of an elastic bar in Muslin, and in NVIDIA's Newton by vertex block descent (VBD), on the CPU.

    pip install newton warp-lang      # beside Muslin
    python tests/benchmarks/solid_vbd.py [--iterations 10,100,1000]

Newton's soft-body example in small: a bar of the same 384 cells (5 tetrahedra each there, 6 in Muslin) hangs from one
end, one step of 1/60 s from rest. Both
minimise the same kind of function, a step of backward Euler; their material is stable Neo-Hookean. VBD moves one vertex
after the other, in single precision, and is not made to end at a residual: how much is left after so many iterations is
the largest distance of a vertex from where 20,000 of them end, as a share of the largest way. Muslin's Newton ends at
1e-10 of its gradient's scale.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import numpy as np

from muslin.mesh import block
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.integrators import steps as steps_of

#: Cells along and across the bar, their size [m], its Lamé parameters [Pa], density [kg/m^3], and the step [s].
ALONG, ACROSS, SIZE, MU, LAM, RHO, DT = 24, 4, 0.05, 1e5, 1e5, 1e3, 1 / 60

#: Iterations after which VBD counts as done.
DONE = 20_000


def ours(count: int = 5) -> tuple[int, float]:
    """(tetrahedra, CPU time of the first step from rest [ms])."""
    E, nu = MU * (3 * LAM + 2 * MU) / (LAM + MU), LAM / (2 * (LAM + MU))
    mesh = block(ALONG + 1, ACROSS + 1, ACROSS + 1, ALONG * SIZE, ACROSS * SIZE, ACROSS * SIZE)
    scene = scenes.get("beam", E=E, nu=nu, rho=RHO, dt=DT)
    model, state = simulation.build(scene, mesh=mesh, energy="stable-neo-hookean")
    taken = []
    for _ in range(count):
        states = steps_of(model, state, DT, "backward-euler")
        next(states)
        began = time.process_time()
        next(states)
        taken.append(1e3 * (time.process_time() - began))
    return len(model.body.cells), float(np.median(taken[1:]))


def theirs(newton: Any, wp: Any, iterations: int) -> tuple[np.ndarray, np.ndarray, float]:
    """(positions at rest, after a step, CPU time of the step [ms])."""
    builder = newton.ModelBuilder()
    builder.add_soft_grid(
        pos=wp.vec3(0.0, 0.0, 0.0), rot=wp.quat_identity(), vel=wp.vec3(0.0, 0.0, 0.0), dim_x=ALONG, dim_y=ACROSS,
        dim_z=ACROSS, cell_x=SIZE, cell_y=SIZE, cell_z=SIZE, density=RHO, k_mu=MU, k_lambda=LAM, k_damp=0.0,
        fix_left=True,
    )  # fmt: skip
    builder.color()
    model = builder.finalize()
    solver = newton.solvers.SolverVBD(
        model=model,
        iterations=iterations,
        particle_enable_self_contact=False,
        particle_enable_tile_solve=False,
    )
    for warm in (True, False):
        before, after = model.state(), model.state()
        if warm and iterations == DONE:
            continue
        began = time.process_time()
        solver.step(before, after, model.control(), None, DT)
        wp.synchronize()
        taken = 1e3 * (time.process_time() - began)
    return model.particle_q.numpy().copy(), after.particle_q.numpy().copy(), taken


def main() -> None:
    """Compare and time."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--iterations", default="10,100,1000")
    chosen = parser.parse_args()
    try:
        import newton
        import warp as wp
    except ImportError:
        sys.exit("Newton is not installed: pip install newton warp-lang")
    wp.set_device("cpu")
    tetrahedra, mine = ours()
    print(f"{tetrahedra} tetrahedra; Muslin, Newton's method to 1e-10: {mine:.1f} ms of CPU time", flush=True)
    start, end, _ = theirs(newton, wp, DONE)
    way = np.abs(end - start).max()
    for iterations in map(int, chosen.iterations.split(",")):
        _, x, taken = theirs(newton, wp, iterations)
        left = np.abs(x - end).max() / way
        print(
            f"  VBD, {iterations} iterations: {taken:.1f} ms, {taken / mine:.1f} times Muslin's; {left:.0e} left",
            flush=True,
        )


if __name__ == "__main__":
    main()
