"""Scores set by hand, from a table a person keeps: student, task (blank: the total), score, reason.

A line without a score is a comment. A score above the maximum is a bonus.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes.finding import Submission, tidy_name
from muslin.grading.views.text import one_line
from muslin.tasks import Assignment

COLUMNS = ("student", "task", "score", "reason")


@dataclass(frozen=True)
class Override:
    """A score set by hand, of `most` that there are; without a score, a comment. An empty `task` means the total."""

    task: str
    score: float | None
    reason: str
    most: float = math.inf


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
        lines = _lines(path.read_bytes())
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise MuslinError(f"The overrides {paths.shown(path)} cannot be read: {why}.") from None
    header = [cell.strip().lower() for cell in lines[0]] if lines else []
    if missing := [column for column in COLUMNS if column not in header]:
        raise MuslinError(
            f"The overrides {paths.shown(path)} have no column {', '.join(missing)}.",
            f"Its first line should be: {','.join(COLUMNS)}",
        )
    meant = _names(submissions)
    totals = {"": sum(task.points for task in table.tasks.values())}
    most = totals | {name: task.points for name, task in table.tasks.items()}
    found: dict[str, list[Override]] = {}
    wrong = []
    for number, cells in enumerate(lines[1:], 2):
        if not any(cell.strip() for cell in cells):
            continue
        row = dict(zip(header, (cell.strip() for cell in cells), strict=False))
        try:
            key, override = _override(row, meant, most)
            earlier = found.setdefault(key, [])
            if override.score is not None and any(
                e.task == override.task and e.score is not None for e in earlier
            ):
                raise ValueError("this score is set in an earlier line already")
            earlier.append(override)
        except ValueError as error:
            wrong.append(f"line {number}: {error}")
    if wrong:
        more = f"\n  and {len(wrong) - 20} more" if len(wrong) > 20 else ""
        told = "".join(f"\n  {line}" for line in wrong[:20])
        raise MuslinError(f"The overrides {paths.shown(path)} cannot be used:{told}{more}")
    return {key: tuple(entries) for key, entries in found.items()}


def _lines(data: bytes) -> list[list[str]]:
    """Cells of a CSV file, in the encodings and with the separators that spreadsheets write."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252")
    stream = io.StringIO(text, newline="")
    first = stream.readline()
    said = re.fullmatch(r"sep=(.)\s*", first)  # Excel's own line
    if said is None:
        stream.seek(0)
    return list(csv.reader(stream, delimiter=said[1] if said else max(",;\t", key=first.count)))


def _number(text: str) -> float:
    """A number, with a point or a decimal comma; nan if it is none."""
    try:
        return float(text.replace(",", ".") if text.count(",") == 1 and "." not in text else text)
    except ValueError:
        return math.nan


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
    said = row.get("score", "")
    score = _number(said) if said else None
    if score is not None and not 0 <= score < math.inf:
        raise ValueError(f"the score {one_line(said)!r} is no number from 0")
    if not row.get("reason"):
        what = "neither a score nor a comment" if score is None else "no reason; students will ask"
        raise ValueError(f"there is {what}")
    return next(iter(keys)), Override(task, score, row["reason"], most[task])


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
