"""The main job in one command: simulate, film, and check every task against the reference data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin import paths

#: The demo follows the drape until the cloth, which no friction holds, begins to slide off [steps].
STEPS = 240


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
    from muslin import reference, show
    from muslin.simulation import simulate
    from muslin.solvers import choose
    from muslin.tasks import load

    solution = load(paths.solution("cloth")) if paths.in_repository() else None
    say(
        f"Simulating a drape with {'the reference solution' if solution else 'the native element'} ({choose()}) ..."
    )
    with progress("simulating") as tick:
        result = simulate("drape", functions=solution, steps=STEPS, out=out / "run", on_step=tick)
    with progress("rendering") as tick:
        every = 1 if choose() == "cholmod" else 2  # what the slower solver took, the film gives back
        written = show.render_run(out / "run", out / "drape", "mp4", None, tick, every, quality=quality)
    say("\nEnergies [J]\n  time [s]    kinetic    elastic    gravity      total")
    table = result.energies
    for row in table[:: max(1, len(table) // 8)]:
        say(
            f"  {row.time:8.3f} {row.kinetic:10.4f} {row.elastic:10.4f} {row.gravity:10.4f} {row.total:10.4f}"
        )
    if solution:
        say("\nThe reference solution against the reference data")
        say_verdicts(reference.check(solution))
    say(f"\nWrote {show.shown(written)}.")
