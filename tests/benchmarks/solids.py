"""Time per backward Euler step of a solid, in Muslin and in a C++/Eigen program that does the same, in turns.

    python tests/benchmarks/solids.py [--resolutions 5,10] [--rounds 3] [--steps 6]

The C++ program is `solid_baseline.cpp`, built on the spot (g++, Debian's libeigen3-dev). Both compute the scene `beam`
from the same mesh with the same parameters and Newton tolerance. Each round runs every candidate once; ratios are
taken within a round. How far the last positions lie apart is printed first: a ratio means nothing where they differ.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import muslin
from muslin.bench.candidates import EIGEN, FLAGS
from muslin.physics.solid import constants
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.integrators import steps as steps_of
from muslin.simulation.scenes import Scene

HERE = Path(__file__).resolve().parent


def write_problem(scene: Scene, path: Path) -> int:
    """What the C++ program reads; returns the number of tetrahedra."""
    model, state = simulation.build(scene)
    C, D = constants(*scene.lame, scene.course_parameters)
    with path.open("w") as file:
        print(len(model.body.X), len(model.body.cells), len(model.pinned), file=file)
        print(*map(repr, map(float, (C, D, scene.rho, scene.dt, model.tolerance, *scene.gravity))), file=file)
        np.savetxt(file, np.hstack([model.body.X, state.x]), fmt="%.17g")
        np.savetxt(file, model.body.cells, fmt="%d")
        np.savetxt(file, model.pinned, fmt="%d")
    return len(model.body.cells)


def run_ours(scene: Scene, functions: object, count: int) -> tuple[np.ndarray, np.ndarray]:
    """((steps, 2) wall and CPU time [ms], last positions)."""
    model, state = simulation.build(scene, functions)
    states = steps_of(model, state, scene.dt, scene.integrator)
    next(states)
    ticks = [(time.perf_counter(), time.process_time())]
    for _ in range(count):
        state = next(states)
        ticks.append((time.perf_counter(), time.process_time()))
    return 1e3 * np.diff(np.array(ticks), axis=0), state.x


def main() -> None:
    """Compare and time."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--resolutions", default="5,10")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=6)
    chosen = parser.parse_args()
    functions = muslin.load(HERE.parent.parent / "solutions" / "solids")
    ours = {"student": functions, "native": None}
    with tempfile.TemporaryDirectory() as folder:
        program, problem, end = (Path(folder) / name for name in ("program", "problem.txt", "end"))
        eigen = next((path for path in EIGEN if Path(path).is_dir()), None)
        if eigen is None:
            sys.exit("No C++ baseline: Eigen's headers are not installed (Debian: libeigen3-dev).")
        source = HERE / "solid_baseline.cpp"
        subprocess.run(["g++", *FLAGS, f"-I{eigen}", str(source), "-o", str(program)], check=True)
        for resolution in map(int, chosen.resolutions.split(",")):
            scene = scenes.get("beam", resolution=resolution)
            print(f"beam, {write_problem(scene, problem)} tetrahedra", flush=True)
            for f in ours.values():  # warm up
                run_ours(scene, f, 1)
            ratios: dict[str, list[np.ndarray]] = {name: [] for name in ours}
            for _ in range(chosen.rounds):
                command = [str(program), str(problem), str(chosen.steps), str(end)]
                text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
                base = np.array([line.split() for line in text.splitlines()], float)
                x = np.fromfile(end).reshape(-1, 3)
                for name, f in ours.items():
                    taken, own = run_ours(scene, f, chosen.steps)
                    apart = float(np.abs(own - x).max())
                    ratios[name].append(np.median(base[:, :2], axis=0) / np.median(taken, axis=0))
                    print(
                        f"  {name}: {ratios[name][-1][0]:.2f} times faster by wall, {ratios[name][-1][1]:.2f} by CPU;"
                        f" {apart:.0e} m apart; C++ {np.median(base[:, 0]):.1f} ms, {base[:, 2].mean():.1f} iterations",
                        flush=True,
                    )
            for name, found in ratios.items():
                wall, cpu = np.median(found, axis=0)
                print(f"  {name}, median: {wall:.2f} by wall, {cpu:.2f} by CPU", flush=True)


if __name__ == "__main__":
    main()
