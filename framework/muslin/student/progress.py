"""Where every task stands, from what was remembered and what the files say now. Nothing is run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from muslin.base.errors import MuslinError
from muslin.physics.stand_ins import needs
from muslin.reading import source
from muslin.student.checking import GREEN, TODO
from muslin.student.workspace import Workspace
from muslin.tasks import Task, is_stub

UNCHECKED, UNREADABLE = "not checked", "unreadable"


@dataclass(frozen=True)
class Standing:
    """A task and where it stands: "green", "wrong", "error", "to do", "not checked" or "unreadable"."""

    task: Task
    status: str
    needs: tuple[str, ...]


def standings(workspace: Workspace) -> list[Standing]:
    """Where every task stands, in the order of the handout."""
    verdicts = workspace.memory()["verdicts"]
    texts: dict[str, source.Source | None] = {}
    for file in workspace.table.files:
        try:
            text, _ = source.legible(source.read(workspace.folder / file), workspace.table.tasks, file)
            texts[file] = source.read_once(text)
        except MuslinError:
            texts[file] = None
    found, order = [], list(workspace.table.tasks)
    for task in workspace.table.tasks.values():
        read = texts[task.file]
        status = UNREADABLE
        if read is not None and task.name in read.functions:
            known = verdicts.get(task.name, {})
            if is_stub(read.functions[task.name].node):
                status = TODO
            elif known.get("key") == workspace.key(task.name):
                status = known["status"]
            else:
                status = UNCHECKED
        found.append(Standing(task, status, prerequisites(task, order)))
    return found


def prerequisites(task: Task, order: list[str]) -> tuple[str, ...]:
    """Earlier tasks (in this order) a task waits for in the simulator; each can be checked without them."""
    together = {name for names in needs(order).values() if task.name in names for name in names}
    return task.needs or tuple(name for name in order[: order.index(task.name)] if name in together)


def open_task(found: Iterable[Standing], after: str | None = None) -> Standing | None:
    """The next task that is not green: the first after one named, or from the beginning; None if all are."""
    found = list(found)
    names = [standing.task.name for standing in found]
    start = names.index(after) + 1 if after in names else 0
    return next((s for s in found[start:] + found[:start] if s.status != GREEN), None)


def bar(found: Iterable[Standing], width: int = 30) -> str:
    """A progress bar: tasks and points."""
    found = list(found)
    done = [s.task for s in found if s.status == GREEN]
    filled = round(width * len(done) / max(1, len(found)))
    points, total = sum(t.points for t in done), sum(s.task.points for s in found)
    return f"[{'#' * filled}{'-' * (width - filled)}] {len(done)}/{len(found)} tasks, {points}/{total} points"


def listed(workspace: Workspace) -> list[str]:
    """The list of tasks, in lines."""
    found = standings(workspace)
    wide = max(len(s.task.name) for s in found)
    lines = [f"     {'task':{wide}}  points  {'state':11}  simulated with (each task is checked alone)"]
    section = ""
    for s in found:
        section, shown = s.task.section, s.task.section if s.task.section != section else ""
        needs = ", ".join(s.needs)
        lines.append(f"{shown:4} {s.task.name:{wide}}  {s.task.points:6}  {s.status:11}  {needs}".rstrip())
    return [*lines, "", bar(found)]
