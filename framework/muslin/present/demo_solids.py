"""A film of a solid in one command: the bear of jelly, with its skin, by the reference solution where there is one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.present import pictures
from muslin.simulation import scenes
from muslin.simulation.simulating import simulate
from muslin.tasks import load

SCENE = "jelly"


def run(
    out: Path,
    quality: str,
    progress: Callable[[str], Any],
    say: Callable[[str], Any],
    steps: int | None = None,
) -> None:
    """Write `out/jelly.mp4`, `out/jelly.png`, the energies and the run itself.

    Parameters
    ----------
    out : Path
    quality : {"draft", "good", "best"}
    progress : callable
        title -> context manager that gives a (done, total) callback.
    say : callable
        Prints a line.
    steps : int, optional
        Fewer than the scene's.
    """
    scene = scenes.get(SCENE)
    solution = load(paths.solution("solids")) if paths.in_repository() else None
    say(f"{scene.title}: by {'the reference solution' if solution else 'the native element'} ...")
    with progress("simulating") as tick:
        result = simulate(SCENE, functions=solution, steps=steps, out=out / "run", on_step=tick)
    if result.interrupted:
        say(f"Stopped. What was simulated until now is in {paths.shown(out / 'run')}.")
        raise KeyboardInterrupt
    with progress("filming") as tick:
        written = pictures.render_run(out / "run", out / SCENE, "mp4", on_frame=tick, quality=quality)
    say(f"Wrote {pictures.shown(written)}.")
