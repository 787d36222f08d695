"""A film of a solid in one command: the bear of jelly, with its skin, by the reference solution where there is one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.present import pictures
from muslin.present.demo import energy_lines, filmed
from muslin.simulation import scenes

SCENE = "jelly"

#: Where the bear goes [m], known from earlier runs: the film begins before this one has ended.
AROUND = [
    (-0.67, 0.74, 0.19), (-0.62, 0.82, 0.17), (-0.22, -0.02, 0.03), (0.0, 1.09, 0.08),
    (0.16, 1.0, 0.47), (0.18, 0.01, 0.27), (0.25, 0.58, 0.56), (0.63, 0.85, 0.41), (0.82, 0.66, 0.25),
]  # fmt: skip


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
    scene = scenes.get(SCENE, **({} if steps is None else {"steps": steps}))
    solution = paths.solution("solids") if paths.in_repository() else None
    whose = "the reference solution" if solution else "the native element"
    say(f"{scene.title}: by {whose}, and filmed meanwhile ...")
    result, written = filmed(scene, solution, out, quality, progress, say, around=AROUND)
    for line in energy_lines(result):
        say(line)
    say(f"Wrote {pictures.shown(written)}.")
