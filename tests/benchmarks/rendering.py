"""What a picture of `drape` costs, and what simulating, filming and doing both at once cost.

    python tests/benchmarks/rendering.py [--against FOLDER] [--rounds 3] [--demo]

Every figure is measured in a process of its own, in turns, so that a noisy machine is noisy for all; the
median of the rounds counts. `--against` names the `framework` folder of another checkout, which takes turns
with this one: the ratio of CPU times is the claim, the wall times need a quiet machine.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve()
FRAMEWORK = HERE.parents[2] / "framework"

#: Ceilings of a frame at 1280x720 on two quiet cores [ms], and of simulating and filming at once against the
#: slower of the two.
WALL = {"draft": 60, "good": 200}
OVERLAP = 1.2


def frames(quality: str, run: str) -> dict[str, float]:
    """Wall and CPU time of a frame [ms], over a dozen frames."""
    from muslin.present.pictures import Show
    from muslin.simulation.runs import RunFolder

    show = Show(RunFolder(run), quality=quality)
    some = range(0, len(show.times), max(1, len(show.times) // 12))
    for k in (0, len(show.times) // 2):
        show.picture(k)
    wall, cpu = time.perf_counter(), time.process_time()
    for k in some:
        show.picture(k)
    return {
        "wall": (time.perf_counter() - wall) / len(some) * 1e3,
        "cpu": (time.process_time() - cpu) / len(some) * 1e3,
    }


def simulated(folder: str) -> None:
    """Simulate the demo's drape."""
    from muslin.present import demo
    from muslin.simulation.simulating import simulate

    simulate("drape", **demo.SHOWN, out=Path(folder) / "run")


def filmed(quality: str, run: str, folder: str) -> None:
    """Film a run that is there."""
    from muslin.present import pictures as show

    show.render_run(run, Path(folder) / "drape", quality=quality)


def both(quality: str, folder: str) -> None:
    """Do both at once."""
    from muslin.present import demo
    from muslin.present.film import Filming
    from muslin.simulation import scenes
    from muslin.simulation.simulating import simulate

    scene = scenes.get("drape", **demo.SHOWN)
    out = Path(folder)
    with Filming(scene, out / "run", out / "drape", around=demo.AROUND, quality=quality) as filming:
        simulate(scene, out=out / "run", on_step=filming.on_step)
        filming.finish()


def apart(what: str, *words: str, framework: Path = FRAMEWORK) -> dict[str, float]:
    """One of the functions above, in a process of its own; and `whole`, the life of that process [s]."""
    begin = time.perf_counter()
    done = subprocess.run(
        [sys.executable, HERE, "--measure", what, *words], stdout=subprocess.PIPE, text=True, check=True,
        env=os.environ | {"PYTHONPATH": str(framework), "OPENBLAS_NUM_THREADS": "1"},  # as the command line does
    )  # fmt: skip
    whole = time.perf_counter() - begin
    return {"whole": whole} | (json.loads(done.stdout.splitlines()[-1]) or {})


def first_picture(folder: str, cache: str) -> float:
    """Seconds from typing `muslin demo` to its first picture, with Taichi's cache in `cache`."""
    environment = os.environ | {"PYTHONPATH": str(FRAMEWORK), "TI_OFFLINE_CACHE_FILE_PATH": cache}
    picture = Path(folder) / "drape.png"
    picture.unlink(missing_ok=True)
    begin, taken = time.perf_counter(), 0.0
    demo = subprocess.Popen(
        [sys.executable, "-m", "muslin.cli", "demo", "--out", folder], env=environment,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    while demo.poll() is None:
        if not taken and picture.is_file():
            taken = time.perf_counter() - begin
        time.sleep(0.02)
    if demo.returncode or not taken:
        raise SystemExit("muslin demo failed.")
    return taken


def compare_pictures(run: str, against: Path | None, rounds: int) -> None:
    """Print the cost of a frame, here and in another checkout."""
    sides = {"here": FRAMEWORK} | ({"there": against.resolve()} if against else {})
    for quality, ceiling in WALL.items():
        taken: dict[str, list[dict[str, float]]] = {name: [] for name in sides}
        for _ in range(rounds):
            for name, framework in sides.items():
                taken[name].append(apart("frames", quality, run, framework=framework))
        for name, all_of in taken.items():
            wall, cpu = (statistics.median(t[key] for t in all_of) for key in ("wall", "cpu"))
            print(
                f"{quality:5} {name:5}  wall {wall:6.1f} ms  CPU {cpu:6.1f} ms  (ceiling {ceiling} ms wall)"
            )
        if against:
            ratios = [a["cpu"] / b["cpu"] for a, b in zip(taken["here"], taken["there"], strict=True)]
            print(f"{quality:5} CPU here / there: {statistics.median(ratios):.2f}", flush=True)


def compare_at_once(run: str, scratch: Path, rounds: int) -> None:
    """Print what simulating and filming cost apart and at once, from starting Python to its end."""
    for quality in WALL:
        times = [
            (
                apart("simulated", str(scratch / "a"))["whole"],
                apart("filmed", quality, run, str(scratch / "b"))["whole"],
                apart("both", quality, str(scratch / "c"))["whole"],
            )
            for _ in range(rounds)
        ]
        simulate, film, once = (statistics.median(column) for column in zip(*times, strict=True))
        ratio = statistics.median(t[2] / max(t[:2]) for t in times)
        print(
            f"{quality:5} simulate {simulate:.1f} s, film {film:.1f} s, both at once {once:.1f} s:"
            f" {ratio:.2f} of the slower (ceiling {OVERLAP})",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", type=Path, help="the framework folder of another checkout")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--demo", action="store_true", help="the demo's first picture too, cold and warm")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        apart("simulated", str(scratch))  # for the frames to draw; compiles what is not in the cache
        compare_pictures(str(scratch / "run"), options.against, options.rounds)
        compare_at_once(str(scratch / "run"), scratch, options.rounds)
        if options.demo:
            for state in ("cold", "warm"):
                taken = first_picture(str(scratch / "demo"), str(scratch / "cache"))
                print(f"muslin demo, first picture, {state}: {taken:.1f} s", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(globals()[sys.argv[2]](*sys.argv[3:])))
    else:
        main()
