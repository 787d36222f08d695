"""Scores set by hand, from a table a person keeps: student, task (blank: the total), score, reason.

A written question of the assignment stands in the column of tasks, too; its points come on top.

A line without a score is a comment. A score above the maximum is a bonus; so are points in a column `bonus`, which come
on top of what was graded. The student `*` is everyone who has no line of their own for that task.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes.finding import Submission, tidy_name
from muslin.classes.tables import Sheet
from muslin.grading.views.text import one_line
from muslin.tasks import Assignment, Question

COLUMNS = ("student", "task", "score", "reason")

#: A column that may be there, and whoever has no line of their own.
BONUS, EVERYONE = "bonus", "*"


@dataclass(frozen=True)
class Override:
    """A score set by hand, of `most` that there are, or points on top; without either, a comment.

    An empty `task` means the total; `written` is the question it marks, if it is none of the tasks.
    """

    task: str
    score: float | None
    reason: str
    most: float = math.inf
    bonus: float = 0.0
    written: Question | None = None


def read(
    path: Path | str, submissions: Sequence[Submission], table: Assignment
) -> dict[str, tuple[Override, ...]]:
    """Overrides by the key of the submission.

    Parameters
    ----------
    path : path
        A CSV file, its cells apart by commas, semicolons or tabs. A student is meant by name, by number, or by the
        key in the report.
    submissions : sequence of Submission
    table : Assignment

    Raises
    ------
    MuslinError
        With every line that is wrong, and why.
    """
    path = Path(path)
    try:
        lines = [row for row in Sheet(path.read_bytes()).rows if row]
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise MuslinError(f"The overrides {paths.shown(path)} cannot be read: {why}.") from None
    header = [cell.strip().lower() for cell in lines[0]] if lines else []
    if missing := [column for column in COLUMNS if column not in header]:
        raise MuslinError(
            f"The overrides {paths.shown(path)} have no column {' and no '.join(missing)}.",
            f"Its first line should be: {','.join(COLUMNS)}",
        )
    meant = names(submissions)
    totals = {"": sum(task.points for task in table.tasks.values())}
    most = totals | {name: task.points for name, task in table.tasks.items()}
    most |= {name: question.points for name, question in table.written.items()}
    found: dict[str, list[Override]] = {}
    everyones: list[Override] = []
    wrong = []
    for number, cells in enumerate(lines[1:], 2):
        if not any(cell.strip() for cell in cells):
            continue
        row = dict(zip(header, (cell.strip() for cell in cells), strict=False))
        try:
            keys, override = _override(row, meant, most)
            override = replace(override, written=table.written.get(override.task))
            earlier = everyones if keys is None else found.setdefault(keys, [])
            if _clashes(override, earlier):
                raise ValueError("this score is set in an earlier line already")
            earlier.append(override)
        except ValueError as error:
            wrong.append(f"line {number}: {error}")
    if wrong:
        more = f"\n  and {len(wrong) - 20} more" if len(wrong) > 20 else ""
        told = "".join(f"\n  {line}" for line in wrong[:20])
        raise MuslinError(f"The overrides {paths.shown(path)} cannot be used:{told}{more}")
    for submission in submissions if everyones else ():
        own = found.setdefault(submission.key, [])
        own += [override for override in everyones if not _clashes(override, own)]
    return {key: tuple(entries) for key, entries in found.items()}


def _clashes(override: Override, others: Sequence[Override]) -> bool:
    """Whether one of the others sets the same score."""
    return override.score is not None and any(
        other.task == override.task and other.score is not None for other in others
    )


def _number(text: str) -> float:
    """A number, with a point or a decimal comma; nan if it is none."""
    try:
        return float(text.replace(",", ".") if text.count(",") == 1 and "." not in text else text)
    except ValueError:
        return math.nan


def _override(
    row: Mapping[str, str], meant: Mapping[str, set[str]], most: Mapping[str, float]
) -> tuple[str | None, Override]:
    """What a line says, and of whom: a key, or nothing for everyone."""
    student, task = tidy_name(row.get("student", "")), row.get("task", "")
    key = None if student == EVERYONE else the_one(student, meant)
    if task not in most:
        raise ValueError(f"there is no task {one_line(task)!r}{_near(task, most)}")
    score, bonus = _points(row, "score"), _points(row, BONUS)
    if score is not None and bonus is not None:
        raise ValueError("there is a score and a bonus; write the score with the bonus in it")
    if not row.get("reason"):
        what = (
            "neither a score nor a comment"
            if score is None and bonus is None
            else "no reason; students will ask"
        )
        raise ValueError(f"there is {what}")
    return key, Override(task, score, row["reason"], most[task], bonus or 0.0)


def _points(row: Mapping[str, str], column: str) -> float | None:
    """The points in a column, if there are any."""
    if not (said := row.get(column, "")):
        return None
    if not 0 <= (number := _number(said)) < math.inf:
        raise ValueError(f"the {column} {one_line(said)!r} is no number from 0")
    return number


def the_one(student: str, meant: Mapping[str, set[str]]) -> str:
    """The key of the one submission that a name, number or key means.

    Raises
    ------
    ValueError
        If it means none, or several.
    """
    keys = meant.get(student.casefold(), set())
    if not keys:
        raise ValueError(f"there is no student {one_line(student)!r}{_near(student, meant)}")
    if len(keys) > 1:
        raise ValueError(f"{one_line(student)!r} may be {', '.join(sorted(keys))}; write one of these")
    return next(iter(keys))


def names(submissions: Sequence[Submission]) -> dict[str, set[str]]:
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
