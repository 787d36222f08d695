"""What Quadrants costs beside Taichi: steps, pictures and compiling, in turns in one run.

    python tests/benchmarks/engines.py [--rounds 5] [--sizes 20,50] [--steps 100] [--profile]

Needs both engines (the extra `quadrants`). Every turn is two processes of one engine, the first with an empty cache
and the second with what the first has compiled; then it is the other engine's turn, and who begins changes from round
to round. Times count within a process, wall and CPU: importing the engine; compiling (what the first call of every
student function, the first step of a simulation and the first picture take beyond a later one); a step of `throw`
with the student's functions, and a picture of `drape`: the least of many, since a busy machine only adds.

Ratios are Quadrants' time over Taichi's within a round; printed are their median and range, and the ratio of the
least CPU times of all rounds. `--profile` shows where the time of compiling with an empty cache goes.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import os
import pstats
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ENGINES = ("taichi", "quadrants")
#: What was asked of each ratio.
ASKED = {"step": 1.15, "picture": 1.15, "compile": 1.3}

Times = dict[str, tuple[float, float]]


def now() -> np.ndarray:
    """Wall and CPU time [s]."""
    return np.array([time.perf_counter(), time.process_time()])


def measured(sizes: list[int], steps: int) -> Times:
    """Wall and CPU time [ms] of everything, in this process."""
    began = now()
    from muslin.base import engine

    engine.load()
    imported = now() - began
    import muslin
    from muslin import tasks
    from muslin.base import paths
    from muslin.judging import reference
    from muslin.present.pictures import Show
    from muslin.simulation import scenes
    from muslin.simulation.runs import RunFolder

    functions = muslin.load(paths.solution("cloth"))
    found, compiling = {}, np.zeros(2)
    for name in tasks.assignment("cloth").tasks:
        inputs, _ = reference.cases("cloth", name)
        taken = []
        for _ in range(2):
            before = now()
            muslin.evaluate(functions[name], **inputs)
            taken.append(now() - before)
        compiling += taken[0] - taken[1]
    for size in sizes:
        scene = scenes.get("throw", mesh="grid", resolution=size, steps=steps)
        ticks = [now()]
        muslin.simulate(scene, functions=functions, on_step=lambda *_, t=ticks: t.append(now()))
        each = np.diff(ticks, axis=0)
        usual = each[2:].min(axis=0)
        compiling += each[0] - usual
        found[f"step {size}x{size}"] = usual
    with tempfile.TemporaryDirectory() as folder:
        muslin.simulate("drape", steps=40, frame_every=5, out=Path(folder) / "drape")
        for quality in ("draft", "good"):
            show = Show(RunFolder(Path(folder) / "drape"), size=(1280, 720), quality=quality)
            ticks = [now()]
            for k in (*range(len(show.times)), *range(len(show.times))):
                show.picture(k)
                ticks.append(now())
            each = np.diff(ticks, axis=0)
            usual = each[1:].min(axis=0)
            compiling += each[0] - usual
            found[f"picture, {quality}"] = usual
    found |= {"import": imported, "compile": compiling}
    return {name: tuple(1e3 * taken) for name, taken in found.items()}


def turn(engine: str, cache: str, sizes: str, steps: int) -> Times:
    """What one process with this engine measures."""
    environment = os.environ | {"MUSLIN_ENGINE": engine, "XDG_CACHE_HOME": cache}
    for prefix in ("TI", "QD"):
        environment[f"{prefix}_OFFLINE_CACHE_FILE_PATH"] = f"{cache}/kernels"
    command = [sys.executable, __file__, "--child", "--sizes", sizes, "--steps", str(steps)]
    told = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout
    return dict(json.loads(told.splitlines()[-1]))


def in_turns(rounds: int, sizes: str, steps: int) -> list[dict[str, Times]]:
    """By round, what either engine has measured; compiling is `compile, cold` and `compile, warm`."""
    found = []
    for k in range(rounds):
        this: dict[str, Times] = {}
        for engine in ENGINES if k % 2 == 0 else ENGINES[::-1]:
            with tempfile.TemporaryDirectory() as cache:
                cold = turn(engine, cache, sizes, steps)
                warm = turn(engine, cache, sizes, steps)
            compiling = {"compile, cold": cold["compile"], "compile, warm": warm.pop("compile")}
            this[engine] = warm | compiling
        found.append(this)
        print(f"round {k + 1} of {rounds}", file=sys.stderr)
    return found


def table(rounds: list[dict[str, Times]]) -> list[str]:
    """Lines of a table in Markdown."""
    lines = [
        "| least of all rounds, ms wall (CPU) | Taichi | Quadrants | ratio, CPU | within rounds, wall: median (range) "
        "| within rounds, CPU | asked |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for name in rounds[0]["taichi"]:
        ours, theirs = (np.array([found[engine][name] for found in rounds]) for engine in ENGINES)
        least = [of.min(axis=0) for of in (ours, theirs)]
        cells = [f"{wall:.4g} ({cpu:.4g})" for wall, cpu in least]
        cells.append(f"{least[1][1] / least[0][1]:.2f}")
        ratios = theirs / ours
        spread = [
            f"{np.median(of):.2f} ({of.min():.2f}-{of.max():.2f})" for of in (ratios[:, 0], ratios[:, 1])
        ]
        asked = next((str(most) for begin, most in ASKED.items() if name.startswith(begin)), "")
        lines.append(f"| {name} | {' | '.join([*cells, *spread, asked])} |")
    return lines


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--sizes", default="20,50")
    options.add_argument("--steps", type=int, default=100)
    options.add_argument("--profile", action="store_true")
    options.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    chosen = options.parse_args()
    sizes = [int(size) for size in chosen.sizes.split(",")]
    if chosen.child:
        with cProfile.Profile() if os.environ.get("MUSLIN_PROFILE") else open(os.devnull) as profile:
            times = measured(sizes, chosen.steps)
        if isinstance(profile, cProfile.Profile):
            pstats.Stats(profile, stream=sys.stderr).sort_stats("tottime").print_stats(15)
        print(json.dumps(times))
        return
    if chosen.profile:
        os.environ["MUSLIN_PROFILE"] = "1"
        for engine in ENGINES:
            print(engine, file=sys.stderr)
            with tempfile.TemporaryDirectory() as cache:
                turn(engine, cache, chosen.sizes, chosen.steps)
        return
    print(*table(in_turns(chosen.rounds, chosen.sizes, chosen.steps)), sep="\n")


if __name__ == "__main__":
    main()
