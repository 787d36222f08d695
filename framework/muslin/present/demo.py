"""The main job in one command: simulate, film meanwhile, and check every task against the reference data."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from muslin.base import paths
from muslin.simulation import scenes

if TYPE_CHECKING:
    from muslin.simulation.marching import Run
    from muslin.simulation.scenes import Scene

#: What is shown: the drape on a sphere that stands on the floor, as long as it takes to come to rest.
SHOWN = {"ground": -0.3, "steps": 240}

#: Where the cloth goes in that time: known from earlier runs, for the film begins before this one has ended.
AROUND = [
    (x, y, z) for y, reach in ((0.35, 0.505), (-0.3, 0.45)) for x in (-reach, reach) for z in (-reach, reach)
]


def run(
    out: Path,
    quality: str,
    progress: Callable[[str], Any],
    say: Callable[[str], Any],
    say_verdicts: Callable[[list[Any]], None],
) -> None:
    """Write `out/drape.mp4`, `out/drape.png` and the run itself; print energies and verdicts.

    In a checkout the reference solution runs; an installed Muslin has none and shows its own element.

    Parameters
    ----------
    out : Path
    quality : {"draft", "good", "best"}
    progress : callable
        title -> context manager that gives a (done, total) callback.
    say, say_verdicts : callables
        Print a line; print verdicts.
    """
    from muslin.judging import checking
    from muslin.present import pictures as show
    from muslin.solve.solvers import choose
    from muslin.tasks import load

    every = 1 if choose() == "cholmod" else 2  # what the slower solver took, the film gives back
    solution = paths.solution("cloth") if paths.in_repository() else None
    whose = "the reference solution" if solution else "the native element"
    say(f"Simulating a drape with {whose} ({choose()}), and filming it ...")
    scene = scenes.get("drape", **SHOWN)
    result, written = filmed(scene, solution, out, quality, progress, say, around=AROUND, every=every)
    for line in energy_lines(result):
        say(line)
    if solution:
        say("\nThe reference solution against the reference data")
        say_verdicts(checking.check(load(solution)))
    say(f"\nWrote {show.shown(written)}.")


def energy_lines(run: Run) -> Iterator[str]:
    """A table of a run's energies at some nine times, as they are called in its plot."""
    names, table = run.scene.energy_names, run.energies
    wide = {column: max(10, len(name)) for name, column in names.items()}
    yield "\nEnergies [J]"
    yield "  time [s] " + " ".join(f"{name:>{wide[column]}}" for name, column in names.items())
    for row in table[:: max(1, len(table) // 8)]:
        yield f"  {row.time:8.3f} " + " ".join(f"{row[column] + 0.0:{wide[column]}.4f}" for column in wide)


def filmed(
    scene: Scene,
    functions: Path | None,
    out: Path,
    quality: str,
    progress: Callable[[str], Any],
    say: Callable[[str], Any],
    **how: Any,
) -> tuple[Run, list[Path]]:
    """Simulate a scene, and film it meanwhile: the run, and the files written.

    Parameters
    ----------
    scene : Scene
    functions : Path, optional
        Folder of those to simulate with. Default: Muslin's own element.
    out : Path
        Folder for `run`, and the film and still, named after the scene.
    quality, progress, say
        As for `run`.
    **how
        As for `Filming`: what the camera must see, ...

    Raises
    ------
    KeyboardInterrupt
        If it is stopped; what there is by then is kept.
    """
    from muslin.present.film import Filming
    from muslin.simulation.simulating import simulate
    from muslin.tasks import load

    began = time.monotonic()

    def first(path: Path) -> None:
        say(f"First frame after {time.monotonic() - began:.1f} s: {paths.shown(path)}")

    filming = Filming(scene, out / "run", out / scene.name, quality=quality, on_first=first, **how)
    try:
        with filming:
            with progress("simulating") as tick:

                def on_step(step: int, steps: int) -> None:
                    tick(step, steps)
                    filming.on_step(step, steps)

                found = load(functions) if functions else None
                result = simulate(scene, functions=found, out=out / "run", on_step=on_step)
            if result.interrupted:
                raise KeyboardInterrupt
            with progress("filming") as tick:
                return result, filming.finish(tick)
    except KeyboardInterrupt:
        say(f"Stopped. What was simulated and filmed until now is in {paths.shown(out)}.")
        raise
