"""Time per step of Muslin and of a C++/Eigen program that does the same, alternating in one run.

    python tests/benchmarks/steps.py [--sizes 20,50,100,200] [--rounds 5] [--steps 60] [--scene throw|neutral]

The C++ program is `eigen_baseline.cpp`, built on the spot (g++ and Debian's libeigen3-dev, -O3 -march=native). Ours
is `muslin.simulate` itself, everything in a step included: contacts, energies of the log. Each round times every
candidate once, so that a busy machine is busy for all; a ratio is taken within a round, and the median and the
range of the rounds' ratios are printed, by wall and by CPU time. CPU time is what a contended machine still
measures; it charges us for both threads. Before timing, both are compared: positions after 20 steps, and every
single step from the same state.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import muslin
from muslin.bench.candidates import build_baseline, run_baseline, write_problem
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.integrators import State, linearly_implicit_euler
from muslin.simulation.scenes import Scene

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COMPARED = 20  # steps whose positions the C++ program writes


def scene_of(name: str, size: int, steps: int) -> Scene:
    """The scene `throw`, or the neutral one other simulators are measured on too, on size x size vertices."""
    if name == "throw":
        return scenes.get("throw", mesh="grid", resolution=size, steps=steps)
    edge = ",".join(str(k) for k in range(size))
    return replace(
        scenes.get("drape", resolution=size, steps=steps, mu=1e3, lam=1e3, rho=0.2, h=1.0, dt=1 / 60,
            diagonals="uniform", bending="off"),
        name="neutral", pinned=edge, start=level, gravity=(0.0, 0.0, -9.81), floor=False,
        sphere_center=(0.0, 0.0, 0.6), sphere_radius=0.25,
    )  # fmt: skip


def level(scene: Scene, mesh: muslin.Mesh) -> np.ndarray:
    """Horizontal at z = 1."""
    return mesh.vertices + np.array([0.0, 0.0, 1.0])


def run_ours(scene: Scene, functions: object) -> np.ndarray:
    """(steps, 2) wall and CPU time [ms] of `muslin.simulate`."""
    ticks: list[tuple[float, float]] = []
    muslin.simulate(
        scene,
        functions=functions,
        on_step=lambda *_: ticks.append((time.perf_counter(), time.process_time())),
    )
    return 1e3 * np.diff(np.array(ticks), axis=0)


def differences(scene: Scene, functions: object, positions: np.ndarray) -> tuple[float, float, float]:
    """How far we are from the C++ program.

    Returns
    -------
    single, whole, own : float
        Largest difference of a position: of single steps from the same state; after all steps; and, for
        comparison, between two of our own runs that start one rounding error apart [m].
    """
    model, start = simulation.build(scene, functions)

    def step(state: State) -> State:
        model.body.update(state.x)
        return linearly_implicit_euler(model, state, scene.dt)

    single, before = 0.0, start
    for x in positions:
        single = max(single, float(np.abs(step(before).x - x).max()))
        before = State(x, (x - before.x) / scene.dt, before.time + scene.dt)
    rng = np.random.default_rng(0)
    nudged = State(start.x * (1 + 1e-16 * rng.integers(-2, 3, start.x.shape)), start.v)
    state = start
    for _ in positions:
        state, nudged = step(state), step(nudged)
    return single, float(np.abs(state.x - positions[-1]).max()), float(np.abs(state.x - nudged.x).max())


def spread(ratios: list[float]) -> str:
    """Median and range."""
    return f"{np.median(ratios):5.2f} ({min(ratios):.2f}-{max(ratios):.2f})"


def main() -> None:
    """Compare, then time."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", default="20,50,100,200")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--scene", choices=["throw", "neutral"], default="throw")
    parser.add_argument("--largest-baseline", type=int, default=100)
    chosen = parser.parse_args()
    functions = muslin.load(ROOT / "solutions" / "cloth")
    ours = {"student": functions, "native": None}
    growth: dict[str, list[tuple[int, float]]] = {name: [] for name in ours}
    with tempfile.TemporaryDirectory() as folder:
        program, why = build_baseline(Path(folder))
        if program is None:
            sys.exit(f"No C++ baseline: {why}.")
        for size in map(int, chosen.sizes.split(",")):
            steps = chosen.steps if size <= 100 else max(12, chosen.steps // 4)
            scene = scene_of(chosen.scene, size, steps)
            problem = Path(folder) / f"{size}.txt"
            write_problem(scene, problem)
            compared = size <= chosen.largest_baseline
            print(f"{chosen.scene}, {size}x{size}")
            if compared:
                _, positions = run_baseline(program, problem, COMPARED, "direct")
                for name, f in ours.items():
                    single, whole, own = differences(scene, f, positions)
                    print(
                        f"  {name:8} differs from C++ by {single:.0e} m in a step, {whole:.0e} m after {COMPARED}"
                        f" (two runs of ours, one rounding apart: {own:.0e})"
                    )
            for f in ours.values():  # warm up
                muslin.simulate(replace(scene, steps=3), functions=f)
            times: dict[str, list[np.ndarray]] = {}
            for _ in range(chosen.rounds):
                if compared:
                    for how in ("direct", "triplets"):
                        taken, _ = run_baseline(program, problem, steps, how)
                        times.setdefault(f"C++ {how}", []).append(np.median(taken[5:], axis=0))
                for name, f in ours.items():
                    times.setdefault(name, []).append(np.median(run_ours(scene, f)[5:], axis=0))
            for name, taken in times.items():
                wall, cpu = np.array(taken).T
                text = f"  {name:13} {np.median(wall):8.2f} ms wall (least {wall.min():.2f}), "
                text += f"{np.median(cpu):8.2f} ms CPU"
                if name in ours:
                    growth[name].append((size * size, float(cpu.min())))
                    for how in ("direct", "triplets") if compared else ():
                        base = np.array(times[f"C++ {how}"]).T
                        walls, cpus = list(base[0] / wall), list(base[1] / cpu)
                        text += (
                            f"\n      {how:9}: {spread(walls)} times faster by wall, {spread(cpus)} by CPU"
                        )
                print(text, flush=True)
    for name, points in growth.items():
        if len(points) > 1:
            (n0, t0), (n1, t1) = points[0], points[-1]
            print(f"{name}: CPU time per step grows like vertices^{np.log(t1 / t0) / np.log(n1 / n0):.2f}")


if __name__ == "__main__":
    main()
