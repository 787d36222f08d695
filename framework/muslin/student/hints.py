"""Hints, one at a time: each says a little more than the one before."""

from __future__ import annotations

from muslin.base.errors import MuslinError
from muslin.student.workspace import Workspace


def shown(workspace: Workspace, task: str, level: int | None = None) -> list[str]:
    """The next hint for a task, in lines; it is remembered that it was shown.

    Parameters
    ----------
    workspace : Workspace
    task : str
    level : int, optional
        Which one, from 1; default the one after the last shown. When all have been, all are shown again.

    Raises
    ------
    MuslinError
        If there is no such hint.
    """
    hints = workspace.table.tasks[task].hints
    if not hints:
        return [f"There are no hints for {task}. Read {workspace.chapter(task)}."]
    if level is not None and not 1 <= level <= len(hints):
        raise MuslinError(f"{task} has hints 1 to {len(hints)}, not {level}.")
    last = workspace.memory()["hints"].get(task, 0)
    again = level is None and last >= len(hints)
    level = min(last + 1, len(hints)) if level is None else level
    kept = workspace.remember("hints", task, max(last, level))
    chosen = range(1, len(hints) + 1) if again else [level]
    lines = [f"{task}, hint {k} of {len(hints)}: {hints[k - 1]}" for k in chosen]
    more = f"Still stuck? {workspace.chapter(task)} derives it."
    if level < len(hints):
        following = f"muslin hint {task}" + ("" if kept else f" --level {level + 1}")
        more = f"The next one says more: {following}"
    return [*lines, more]
