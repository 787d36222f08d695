"""A scene with the student's own functions, and Muslin's where they are not right yet; or with the wrong ones, too."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError, SimulationError
from muslin.student.checking import GREEN, TODO, WRONG, Checker
from muslin.student.progress import standings
from muslin.student.workspace import Workspace


@dataclass(frozen=True)
class Cast:
    """Whose function plays which task.

    Attributes
    ----------
    green : tuple of str
        Right, and the student's.
    stand_ins : dict
        Played by Muslin's own code -> the reason.
    wrong : tuple of str
        Wrong, and played by the student's function all the same, since that is what they want to see.
    """

    green: tuple[str, ...]
    stand_ins: dict[str, str]
    wrong: tuple[str, ...] = ()


def scene(workspace: Workspace, asked: str | None) -> str:
    """The scene that was asked for, or the assignment's own.

    Raises
    ------
    MuslinError
        If no scene calls a function of this assignment.
    """
    if not workspace.scene:
        raise MuslinError(
            f"{workspace.table.name} has no simulation: no scene calls its functions.",
            f"Instead: {workspace.next_step()}",
        )
    return asked or workspace.scene


def shown(workspace: Workspace) -> dict[str, Any]:
    """Scene parameters that the assignment shows a student's functions with, unless they are set."""
    made = workspace.table.simulation
    return dict(made.shown) if made is not None else {}


def cast(workspace: Workspace, say: Callable[[str], Any], as_is: bool = False) -> Cast:
    """Find out which functions can be used. Checks what has not been.

    Parameters
    ----------
    workspace : Workspace
    say : callable
        Prints a line.
    as_is : bool
        Take wrong functions, too, as long as they can be called; else those that pass the public cases.
    """
    found = {s.task.name: s.status for s in standings(workspace)}
    unsure = [name for name, status in found.items() if status not in (GREEN, TODO)]
    if unsure:
        say(f"Checking {', '.join(unsure)} ...")
        with Checker() as checker:
            found |= {report.task: report.status for report in checker.check(workspace, unsure)}
    green = tuple(name for name, status in found.items() if status == GREEN)
    wrong = tuple(name for name, status in found.items() if as_is and status == WRONG)
    waiting = {name: status for name, status in found.items() if name not in (*green, *wrong)}
    return Cast(green, waiting, wrong)


def told(cast: Cast, uses: Iterable[str]) -> list[str]:
    """Whose functions a run has used, in lines."""
    called = set(uses)
    yours = [name for name in cast.green if name in called]
    idle = [name for name in cast.green if name not in called]
    shown = [name for name in cast.wrong if name in called]
    waiting = dict.fromkeys(cast.stand_ins.values())
    others = [f"{why}: {', '.join(n for n, w in cast.stand_ins.items() if w == why)}" for why in waiting]
    rows = [
        ("Yours", ", ".join(yours) or "none yet"),
        ("Yours as it is, though wrong", ", ".join(shown)),
        ("Muslin's own instead of yours", "; ".join(others)),
        ("Right, but not called here", ", ".join(idle)),
    ]
    lines = [f"{label}: {names}." for label, names in rows if names]
    if idle and cast.stand_ins:
        lines.append(
            "(A part of the simulation is yours once all the functions it needs are right: muslin list.)"
        )
    return lines


@dataclass(frozen=True)
class Came:
    """What came of a run.

    Attributes
    ----------
    uses : collection of str
        Tasks whose functions, yours or Muslin's own, it calls.
    last : record, optional
        Last row of the energy log, if anything was simulated.
    written : bool
        Whether there are frames to show.
    interrupted : bool
    trouble : str
        Why it ended before its time; only where wrong functions were asked for.
    """

    uses: Collection[str]
    last: Any
    written: bool
    interrupted: bool = False
    trouble: str = ""


def simulate(
    workspace: Workspace,
    cast: Cast,
    scene: str,
    out: Path,
    on_step: Callable[[int, int], None],
    **options: Any,
) -> Came:
    """Simulate a scene with this cast; see `muslin.simulate` for the options.

    Wrong functions may make it explode: then what was simulated until then is the result.
    """
    from muslin.simulation import simulating as simulation
    from muslin.simulation.marching import CameApart
    from muslin.simulation.runs import RunFolder
    from muslin.tasks import load

    functions = load(workspace.folder, workspace.table) if cast.green or cast.wrong else None
    waiting = tuple(cast.stand_ins) if functions else ()
    try:
        run = simulation.simulate(
            scene, functions=functions, stand_ins=waiting, out=out, on_step=on_step, **options
        )
    except SimulationError as error:
        if not cast.wrong:
            raise
        uses = error.uses if isinstance(error, CameApart) else frozenset()
        blamed = [name for name in cast.wrong if name in uses]
        trouble = str(error) if not blamed else f"{error.message} {_blaming(blamed)}"
        if not isinstance(error, CameApart) or not error.written:
            return Came(
                uses, None, False, trouble=trouble
            )  # an earlier run's frames say nothing about this one
        return Came(uses, RunFolder(out).energies[-1], True, trouble=trouble)
    return Came(run.uses, run.energies[-1], True, run.interrupted)


def reference(scene: str, beside: Path, on_step: Callable[[int, int], None], **options: Any) -> Path:
    """Simulate a scene as it should be, into a folder beside a run; returns the folder."""
    from muslin.simulation import simulating as simulation

    out = beside.with_name(f"{beside.name}-reference")
    simulation.simulate(scene, out=out, on_step=on_step, on_notice=lambda said: None, **options)
    return out


def _blaming(wrong: list[str]) -> str:
    """What to do where wrong functions have made a run come apart."""
    those = wrong[0] if len(wrong) == 1 else f"{', '.join(wrong[:-1])} and {wrong[-1]}"
    return f"It was simulated with your wrong {those}: muslin check {' '.join(wrong)}"


def mesh(name: str | None) -> Path | None:
    """Path of a mesh: a file, or one that comes with Muslin, by its name."""
    if name is None or Path(name).exists():
        return Path(name) if name else None
    shipped = paths.meshes() / f"{name}.obj"
    if not shipped.is_file():
        known = ", ".join(sorted(path.stem for path in paths.meshes().glob("*.obj")))
        raise MuslinError(f"There is no mesh {name}.", f"Name a file, or one of: {known}.")
    return shipped
