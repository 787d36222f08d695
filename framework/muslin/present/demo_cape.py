"""The film of a cape in one command: finer than the scene's own, on a figure that walks for eight seconds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.mesh import sector
from muslin.present import pictures
from muslin.present.demo import energy_lines
from muslin.simulation import scenes

#: Size of its triangles [m]; the pattern is the scene's.
SPACING = 0.0117

#: Eight seconds, filmed at 30 frames a second.
SHOWN = {"dt": 1 / 120, "steps": 960, "frame_every": 4, "fps": 30}


def run(
    out: Path,
    quality: str,
    progress: Callable[[str], Any],
    say: Callable[[str], Any],
    steps: int | None = None,
    spacing: float = SPACING,
) -> None:
    """Write `out/cape.mp4`, `out/cape.png`, the energies and the run; the camera follows, so filming comes after.

    Parameters
    ----------
    out : Path
    quality : {"draft", "good", "best"}
    progress : callable
        title -> context manager that gives a (done, total) callback.
    say : callable
        Prints a line.
    steps : int, optional
        Fewer than eight seconds' worth.
    spacing : float
        Size of the triangles [m].
    """
    from muslin.simulation.simulating import simulate

    scene = scenes.get("cape", **SHOWN | ({} if steps is None else {"steps": steps}))
    mesh = sector(spacing=spacing)
    say(
        f"{scene.title}: {len(mesh.vertices)} vertices, {scene.steps * scene.dt:.3g} s, and then its film ..."
    )
    with progress("simulating") as tick:
        result = simulate(scene, mesh=mesh, out=out / "run", on_step=tick)
    if result.interrupted:
        say(f"Stopped. What was simulated until now is in {paths.shown(out / 'run')}.")
        raise KeyboardInterrupt
    for line in energy_lines(result):
        say(line)
    with progress("filming") as tick:
        written = pictures.render_run(out / "run", out / "cape.mp4", on_frame=tick, quality=quality)
    say(f"\nWrote {pictures.shown(written)}.")
