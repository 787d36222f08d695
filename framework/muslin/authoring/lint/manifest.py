"""The manifest: its fields, prerequisites and hints."""

from __future__ import annotations

import graphlib
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from muslin.authoring import wheel
from muslin.authoring.lint.finding import Finding, Subject
from muslin.tasks import MANIFEST, Assignment, Task

#: How many hints a task must have.
FEWEST_HINTS = 2


def check_entries(subject: Subject) -> Iterator[Finding]:
    """Names, numbers and words of the manifest."""
    table, where = subject.table, subject.where(MANIFEST)
    raw = wheel.read_toml(subject.source / MANIFEST)
    known = {"schema", "task", *(field.name for field in fields(Assignment))}
    for entry in sorted(set(raw) - known):
        yield Finding(where, f"there is no entry {entry!r}", f"the entries are {', '.join(sorted(known))}")
    if table.name != subject.name:
        yield Finding(where, f"the name is {table.name!r}", f"give it the folder's name, {subject.name!r}")
    if not re.fullmatch(r"\d+(\.\d+)+", str(table.version)):
        yield Finding(where, f"the version is {table.version!r}", 'write it as "1.0"')
    if not str(table.title).strip():
        yield Finding(where, "the title is empty", "give it one")
    for task in table.tasks.values():
        at = subject.where(MANIFEST, task.name)
        yield from (Finding(at, what, do) for what, do in _task_fields(task, raw["task"][task.name]))


def _task_fields(task: Task, raw: dict[str, Any]) -> Iterator[tuple[str, str]]:
    known = {field.name for field in fields(Task)} - {"name"}
    for entry in sorted(set(raw) - known):
        yield f"there is no entry {entry!r}", f"the entries of a task are {', '.join(sorted(known))}"
    if isinstance(task.points, bool) or not isinstance(task.points, int) or task.points <= 0:
        yield f"its points are {task.points!r}", "give it a whole number of points, 1 or more"
    if not re.fullmatch(r"[A-Za-z_]\w*\.py", str(task.file)):
        yield f"its file is {task.file!r}", "name a Python file in the same folder"
    for name in ("section", "title"):
        if not str(getattr(task, name)).strip():
            yield f"its {name} is empty", "give it one"
    for value in (*task.arguments, *task.results):
        if not value.name.isidentifier():
            yield f"{value.name!r} is no name in Python", "choose another"
        if not value.meaning:
            yield f"nobody says what {value.name} means", 'write "kind [unit] meaning"'
    for what, values in (("arguments", task.arguments), ("results", task.results)):
        if not values:
            yield f"it has no {what}", "add them"


def check_prerequisites(subject: Subject) -> Iterator[Finding]:
    """Every task another one needs exists, and none needs itself in the end."""
    known = subject.table.tasks
    for task in known.values():
        for needed in task.needs:
            if needed not in known:
                what = f"it needs {needed!r}, which is no task"
                yield Finding(subject.where(MANIFEST, task.name), what, "correct or remove it in needs")
    try:
        graphlib.TopologicalSorter({task.name: task.needs for task in known.values()}).prepare()
    except graphlib.CycleError as error:
        circle = " needs ".join(reversed(error.args[1]))
        yield Finding(subject.where(MANIFEST), f"{circle}: a circle", "take one of them out of needs")


def check_hints(subject: Subject) -> Iterator[Finding]:
    """Hints in levels, from a nudge to nearly the answer."""
    for task in subject.table.tasks.values():
        at = subject.where(MANIFEST, task.name)
        hints = [str(hint).strip() for hint in task.hints]
        if len(hints) < FEWEST_HINTS:
            what = f"it has {len(hints) or 'no'} hint{'s' if len(hints) != 1 else ''}"
            yield Finding(at, what, f"write at least {FEWEST_HINTS}, from a nudge to nearly the answer")
        if len(set(hints)) < len(hints) or not all(hints):
            yield Finding(at, "a hint is empty or said twice", "make every level say more")
