"""One task graded again, after an erratum: all other verdicts stay as they are, and who gains or loses is listed."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from muslin.base.errors import MuslinError, choices
from muslin.classes.gradebook import Row
from muslin.classes.work import Result
from muslin.grading.record import SKIPPED, Check, TaskResult, from_json
from muslin.grading.views.grades_csv import cell
from muslin.grading.views.text import points
from muslin.tasks import Assignment

#: Name of the table in the report's folder.
TABLE = "regraded.csv"


def named(tasks: Sequence[str], table: Assignment) -> tuple[str, ...]:
    """The tasks, in the order of the table.

    Raises
    ------
    MuslinError
        If there is no such task.
    """
    for task in tasks:
        if task not in table.tasks:
            raise MuslinError(f"There is no task {task!r} in {table.name}.", choices(task, list(table.tasks)))
    return tuple(name for name in table.tasks if name in tasks)


def merged(earlier: Result, fresh: Result, tasks: Sequence[str]) -> Result:
    """An earlier result with some of its tasks as they were graded now.

    Parameters
    ----------
    earlier, fresh : Result
        Both with a record.
    tasks : sequence of str
    """
    assert earlier.record is not None
    assert fresh.record is not None
    old, new = from_json(earlier.record), from_json(fresh.record)
    record = replace(old, tasks=tuple(_again(t, new[t.name]) if t.name in tasks else t for t in old))
    before = {**earlier.before, **{name: old[name].score for name in tasks}}
    return replace(fresh, record=record.as_json(), before=before)


def _again(old: TaskResult, new: TaskResult) -> TaskResult:
    said = f"After a correction of the assignment; it had {points(old.score)} of {points(old.max_score)}."
    return replace(new, checks=(Check("graded again", "form", SKIPPED, said), *new.checks))


@dataclass(frozen=True)
class Change:
    """A task of a student that was graded again: points before and after."""

    name: str
    id: str
    task: str
    before: float
    after: float


def changes(rows: Sequence[Row], results: Mapping[str, Result]) -> list[Change]:
    """Every task that was graded again, also those whose points are the same."""
    found = []
    for row in rows:
        for task, before in results[row.key].before.items():
            if row.record is not None:
                found += [
                    Change(student.name, student.id, task, before, row.record[task].score)
                    for student in row.submission.students
                ]
    return sorted(found, key=lambda change: (change.name.casefold(), change.name, change.id, change.task))


def as_csv(changed: Sequence[Change]) -> str:
    """A table for people: whose points differ now."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\r\n")
    writer.writerow(["student", "id", "task", "before", "after"])
    for one in changed:
        if one.before != one.after:
            writer.writerow([cell(one.name), cell(one.id), one.task, points(one.before), points(one.after)])
    return stream.getvalue()


def told(changed: Sequence[Change]) -> str:
    """The same in a line."""
    tasks = ", ".join(sorted({one.task for one in changed}))
    up, down = (sum(sign * (one.after - one.before) > 0 for one in changed) for sign in (1, -1))
    return f"Graded again: {tasks}, of {len({(c.name, c.id) for c in changed})} students; {up} gain, {down} lose."
