"""Scores set by hand, from a table a person keeps: student, task (blank: the total), score, reason."""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from muslin import paths
from muslin.classes.finding import Submission, tidy_name
from muslin.errors import MuslinError
from muslin.grading.views.text import one_line
from muslin.tasks import Assignment

COLUMNS = ("student", "task", "score", "reason")


@dataclass(frozen=True)
class Override:
    """A score set by hand; an empty `task` means the total."""

    task: str
    score: float
    reason: str


def read(
    path: Path | str, submissions: Sequence[Submission], table: Assignment
) -> dict[str, tuple[Override, ...]]:
    """Overrides by the key of the submission.

    Parameters
    ----------
    path : path
        A CSV file. A student is meant by name, by number, or by the key in the report.
    submissions : sequence of Submission
    table : Assignment

    Raises
    ------
    MuslinError
        With every line that is wrong, and why.
    """
    path = Path(path)
    try:
        with open(path, encoding="utf-8-sig", newline="") as stream:
            lines = list(csv.reader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise MuslinError(f"The overrides {paths.shown(path)} cannot be read: {error}.") from None
    header = [cell.strip().lower() for cell in lines[0]] if lines else []
    if missing := [column for column in COLUMNS if column not in header]:
        raise MuslinError(
            f"The overrides {paths.shown(path)} have no column {', '.join(missing)}.",
            f"Its first line should be: {','.join(COLUMNS)}",
        )
    meant = _names(submissions)
    totals = {"": sum(task.points for task in table.tasks.values())}
    most = totals | {name: task.points for name, task in table.tasks.items()}
    found: dict[str, dict[str, Override]] = {}
    wrong = []
    for number, cells in enumerate(lines[1:], 2):
        if not any(cell.strip() for cell in cells):
            continue
        row = dict(zip(header, (cell.strip() for cell in cells), strict=False))
        try:
            key, override = _override(row, meant, most)
            if override.task in found.get(key, {}):
                raise ValueError("this score is set in an earlier line already")
            found.setdefault(key, {})[override.task] = override
        except ValueError as error:
            wrong.append(f"line {number}: {error}")
    if wrong:
        more = f"\n  and {len(wrong) - 20} more" if len(wrong) > 20 else ""
        told = "".join(f"\n  {line}" for line in wrong[:20])
        raise MuslinError(f"The overrides {paths.shown(path)} cannot be used:{told}{more}")
    return {key: tuple(by_task.values()) for key, by_task in found.items()}


def _override(
    row: Mapping[str, str], meant: Mapping[str, set[str]], most: Mapping[str, float]
) -> tuple[str, Override]:
    student, task = tidy_name(row.get("student", "")), row.get("task", "")
    keys = meant.get(student.casefold(), set())
    if not keys:
        raise ValueError(f"there is no student {one_line(student)!r}{_near(student, meant)}")
    if len(keys) > 1:
        raise ValueError(f"{one_line(student)!r} may be {', '.join(sorted(keys))}; write one of these")
    if task not in most:
        raise ValueError(f"there is no task {one_line(task)!r}{_near(task, most)}")
    try:
        score = float(row.get("score", ""))
    except ValueError:
        score = math.nan
    if not 0 <= score <= most[task]:
        said = one_line(row.get("score", ""))
        raise ValueError(f"the score {said!r} is no number from 0 to {most[task]:g}")
    if not row.get("reason"):
        raise ValueError("there is no reason; students will ask")
    return next(iter(keys)), Override(task, score, row["reason"])


def _names(submissions: Sequence[Submission]) -> dict[str, set[str]]:
    """Every way to name a student, and the submissions it may mean. A key means its own alone."""
    meant: dict[str, set[str]] = {}
    for submission in submissions:
        for student in submission.students:
            for name in filter(None, (student.name, student.id)):
                meant.setdefault(name.casefold(), set()).add(submission.key)
    return meant | {submission.key: {submission.key} for submission in submissions}


def _near(word: str, known: Mapping[str, object]) -> str:
    near = difflib.get_close_matches(word.casefold(), [name for name in known if name], 1, 0.6)
    return f"; did you mean {one_line(near[0])!r}?" if near else ""
