"""Time per backward Euler step of a solid, in Muslin and in a C++/Eigen program that does the same, in turns.

    python tests/benchmarks/solids.py [--resolutions 5,10] [--rounds 3] [--steps 6] [--profile]

The C++ program is `solid_baseline.cpp`, built on the spot (g++, Debian's libeigen3-dev). Both compute the scene `beam`
from the same mesh with the same parameters and Newton tolerance. Each round runs every candidate once; ratios are
taken within a round, and CPU time tells more than wall time where the machine has other work. It ends with an error
where the last positions differ, since a ratio means nothing then; Newton's iterations of both are printed beside them.
`--profile` says which functions Muslin's time goes into.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
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

#: How far the last positions may lie apart, as a share of the bar's length.
APART = 1e-8


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


def run_ours(
    scene: Scene, functions: object, count: int, profile: cProfile.Profile | None = None
) -> tuple[np.ndarray, np.ndarray, float]:
    """((steps, 2) wall and CPU time [ms], last positions, mean Newton iterations: directions solved for)."""
    model, state = simulation.build(scene, functions)
    solve, solved = model.system.solve, 0

    def counted(*given: object) -> np.ndarray:
        nonlocal solved
        solved += 1
        return solve(*given)

    model.system.solve = counted
    states = steps_of(model, state, scene.dt, scene.integrator)
    next(states)
    if profile:
        profile.enable()
    ticks = [(time.perf_counter(), time.process_time())]
    for _ in range(count):
        state = next(states)
        ticks.append((time.perf_counter(), time.process_time()))
    if profile:
        profile.disable()
    return 1e3 * np.diff(np.array(ticks), axis=0), state.x, solved / count


def main() -> None:
    """Compare and time."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--resolutions", default="5,10")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=6)
    parser.add_argument("--profile", action="store_true", help="say where Muslin's time goes")
    chosen = parser.parse_args()
    wrong = False
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
                    taken, own, iterations = run_ours(scene, f, chosen.steps)
                    apart = float(np.abs(own - x).max())
                    wrong |= not apart <= APART * scene.size
                    ratios[name].append(np.median(base[:, :2], axis=0) / np.median(taken, axis=0))
                    mine, theirs = np.median(taken, axis=0), np.median(base[:, :2], axis=0)
                    print(
                        f"  {name}: {ratios[name][-1][0]:.2f} times faster by wall, {ratios[name][-1][1]:.2f} by CPU"
                        f" ({mine[0]:.1f} and {mine[1]:.1f} ms, C++ {theirs[0]:.1f} and {theirs[1]:.1f} ms);"
                        f" Newton's iterations {iterations:.1f}, C++ {base[:, 2].mean():.1f}; {apart:.0e} m apart",
                        flush=True,
                    )
            for name, found in ratios.items():
                wall, cpu = np.median(found, axis=0)
                print(f"  {name}, median: {wall:.2f} by wall, {cpu:.2f} by CPU", flush=True)
            for name, f in ours.items() if chosen.profile else ():
                profile = cProfile.Profile()
                run_ours(scene, f, chosen.steps, profile)
                print(f"  {name}, where the time goes:", flush=True)
                pstats.Stats(profile).sort_stats("tottime").print_stats(12)
    if wrong:
        sys.exit(
            f"The last positions lie further apart than {APART:g} of the bar: no ratio above means anything."
        )


if __name__ == "__main__":
    main()
