"""A scene with the student's own functions, and Muslin's where they are not right yet."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin import paths
from muslin.errors import MuslinError
from muslin.student.checking import GREEN, TODO, Checker
from muslin.student.progress import standings
from muslin.student.workspace import Workspace


@dataclass(frozen=True)
class Cast:
    """Whose function plays which task: `stand_ins` are played by Muslin's own code, with the reason."""

    green: tuple[str, ...]
    stand_ins: dict[str, str]


def cast(workspace: Workspace, say: Callable[[str], Any]) -> Cast:
    """Find out which functions can be used: those that pass the public cases. Checks what has not been."""
    found = {s.task.name: s.status for s in standings(workspace)}
    unsure = [name for name, status in found.items() if status not in (GREEN, TODO)]
    if unsure:
        say(f"Checking {', '.join(unsure)} ...")
        with Checker() as checker:
            found |= {report.task: report.status for report in checker.check(workspace, unsure)}
    green = tuple(name for name, status in found.items() if status == GREEN)
    return Cast(green, {name: status for name, status in found.items() if status != GREEN})


def told(cast: Cast, uses: Iterable[str]) -> list[str]:
    """Whose functions a run has used, in lines."""
    called = set(uses)
    yours = [name for name in cast.green if name in called]
    idle = [name for name in cast.green if name not in called]
    waiting = dict.fromkeys(cast.stand_ins.values())
    others = [f"{why}: {', '.join(n for n, w in cast.stand_ins.items() if w == why)}" for why in waiting]
    rows = [
        ("Yours", ", ".join(yours) or "none yet"),
        ("Muslin's own instead of yours", "; ".join(others)),
        ("Right, but not called here", ", ".join(idle)),
    ]
    lines = [f"{label}: {names}." for label, names in rows if names]
    if idle and cast.stand_ins:
        lines.append(
            "(A part of the simulation is yours once all the functions it needs are right: muslin list.)"
        )
    return lines


def simulate(
    workspace: Workspace,
    cast: Cast,
    scene: str,
    out: Path,
    on_step: Callable[[int, int], None],
    **options: Any,
) -> Any:
    """Simulate a scene with this cast; see `muslin.simulate` for the options and the result."""
    from muslin import simulation
    from muslin.tasks import load

    functions = load(workspace.folder, workspace.table) if cast.green else None
    return simulation.simulate(
        scene,
        functions=functions,
        stand_ins=tuple(cast.stand_ins) if functions else (),
        out=out,
        on_step=on_step,
        **options,
    )


def mesh(name: str | None) -> Path | None:
    """Path of a mesh: a file, or one that comes with Muslin, by its name."""
    if name is None or Path(name).exists():
        return Path(name) if name else None
    shipped = paths.meshes() / f"{name}.obj"
    if not shipped.is_file():
        known = ", ".join(sorted(path.stem for path in paths.meshes().glob("*.obj")))
        raise MuslinError(f"There is no mesh {name}.", f"Name a file, or one of: {known}.")
    return shipped
