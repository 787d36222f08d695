"""What counts in the end: results and overrides in one row per submission, and the table a platform takes in."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from muslin.classes.finding import Submission
from muslin.classes.late import Lateness
from muslin.classes.overrides import Override
from muslin.grading.record import (
    FAILED,
    NOT_IMPLEMENTED,
    PASSED,
    SKIPPED,
    Answer,
    Check,
    Record,
    TaskResult,
)
from muslin.grading.views.grades_csv import cell
from muslin.grading.views.text import points
from muslin.tasks import Assignment, Question

#: Longest notes in a cell [characters].
NOTES = 2000

#: Columns where there is a late policy: the total before it, and what it took.
BEFORE = ("before late", "taken for late")


@dataclass(frozen=True)
class Row:
    """A submission, what came of it, and what was set by hand.

    `error` says why there is no record, `found` what was noticed about the files, `late` what the late policy makes of
    it where there is one. Scores are those with overrides.
    """

    submission: Submission
    record: Record | None = None
    error: str = ""
    overrides: tuple[Override, ...] = ()
    found: tuple[str, ...] = ()
    late: Lateness | None = None

    @property
    def key(self) -> str:
        """The submission's."""
        return self.submission.key

    @cached_property
    def _by_hand(self) -> dict[str, float]:
        return {entry.task: entry.score for entry in self.overrides if entry.score is not None}

    def by_hand(self, task: str = "") -> float | None:
        """The score set by hand for a task, or for the total."""
        return self._by_hand.get(task)

    def bonus(self, task: str = "") -> float:
        """Points by hand on top of what was graded for a task, or of the total."""
        return sum(entry.bonus for entry in self.overrides if entry.task == task)

    def touched(self, task: str = "") -> bool:
        """Whether a person has changed the score of a task, or the total."""
        return self.by_hand(task) is not None or self.bonus(task) > 0

    @property
    def written(self) -> dict[str, Question]:
        """The written questions that were marked, by name."""
        return {
            entry.task: entry.written
            for entry in self.overrides
            if entry.written and self.touched(entry.task)
        }

    def score(self, task: str) -> float | None:
        """Points that count for a task, or for a written question."""
        score = self.by_hand(task)
        if score is None and self.record is not None and task not in self.written:
            score = self.record[task].score
        bonus = self.bonus(task)
        return (score or 0.0) + bonus if bonus else score

    @property
    def total(self) -> float | None:
        """Points in all, before anything is taken off for being late."""
        if (total := self.by_hand()) is not None:
            return total + self.bonus()
        if self.record:
            parts = [*(task.name for task in self.record), *self.written]
            return round(sum(self.score(name) or 0.0 for name in parts) + self.bonus(), 2)
        tasks = {entry.task for entry in self.overrides if entry.task and self.touched(entry.task)}
        if not tasks and not self.bonus():
            return None
        return round(sum(self.score(task) or 0.0 for task in tasks) + self.bonus(), 2)

    @property
    def was_late(self) -> bool:
        """Whether it came late: as the late policy sees it, or else the platform."""
        return self.submission.late if self.late is None else self.late.late

    @property
    def counts(self) -> float | None:
        """Points that count in the end: a total set by hand is what the person who set it said."""
        total = self.total
        return total if total is None else round(max(0.0, total - self.taken), 2)

    @property
    def taken(self) -> float:
        """Points taken off for being late."""
        if self.late is None or self.total is None or self.by_hand() is not None:
            return 0.0
        return min(self.total, self.late.taken(self.total))

    def notes(self) -> list[str]:
        """What a person should know: late, not graded and why, set by hand."""
        said = ["late"] if self.submission.late and self.late is None else []
        if self.late is not None and self.late.said:
            said.append(self._lateness(self.late))
        if self.submission.time:
            said.append(f"handed in {self.submission.time}")
        if self.error:
            said.append(f"not graded: {self.error}")
        return [*said, *map(self._said, self.overrides)]

    def told(self) -> str:
        """All notes in a cell: those, and what was noticed about the files."""
        return " | ".join([*self.notes(), *self.found])

    def _lateness(self, late: Lateness) -> str:
        """What being late costs, in words."""
        if self.by_hand() is not None and late.percent:
            return f"{late.said}; nothing is taken off a total set by hand"
        if not self.taken or self.total is None or self.counts is None:
            return late.said
        return f"{late.said}: {points(self.total)} - {points(self.taken)} = {points(self.counts)}"

    def _said(self, override: Override) -> str:
        """An override in words."""
        what = override.task or "total"
        if override.bonus:
            return f"{what}: {points(override.bonus)} on top by hand: {override.reason}"
        if override.score is None:
            return f"{override.task}: {override.reason}" if override.task else override.reason
        bonus = "" if override.score <= override.most else f", above the {points(override.most)} there are"
        return f"{what} set by hand to {points(override.score)}{self._instead(override)}{bonus}: {override.reason}"

    def _instead(self, override: Override) -> str:
        if self.record is None or override.written:
            return ""
        graded = self.record[override.task].score if override.task else self.record.score
        return f" (graded: {points(graded)})"

    def as_it_counts(self) -> Record | None:
        """The record with what was set by hand in it, each with a check that says so."""
        if self.record is None or not self.overrides:
            return self.record
        marked = tuple(self._answer(question) for question in self.written.values())
        return replace(self.record, tasks=tuple(self._task(task) for task in self.record), written=marked)

    def _answer(self, question: Question) -> Answer:
        said = "; ".join(entry.reason for entry in self.overrides if entry.task == question.name)
        points_of = self.score(question.name) or 0.0
        return Answer(question.name, question.title, question.section, points_of, question.points, said)

    def _task(self, task: TaskResult) -> TaskResult:
        checks = tuple(self._check(task, entry) for entry in self.overrides if entry.task == task.name)
        score = self.score(task.name)
        if score is None or not self.touched(task.name):
            return replace(task, checks=(*checks, *task.checks))
        status = task.status
        if status == NOT_IMPLEMENTED:  # a view would show nothing else of it
            status = PASSED if score >= task.max_score else FAILED
        return replace(task, score=score, status=status, checks=(*checks, *task.checks))

    def _check(self, task: TaskResult, override: Override) -> Check:
        if override.bonus:
            return Check("bonus", "form", SKIPPED, f"{points(override.bonus)} on top. {override.reason}")
        if override.score is None:
            return Check("comment", "form", SKIPPED, override.reason)
        said = f"{points(override.score)} of {points(task.max_score)}{self._instead(override)}. {override.reason}"
        return Check("set by hand", "form", SKIPPED, said)


def grades_csv(rows: Sequence[Row], table: Assignment) -> str:
    """A line per student (RFC 4180); the same for every run, and safe to open in a spreadsheet.

    Where there is a late policy, it has the total before it and what it took besides the score that counts. Where a
    written question was marked, each has a column behind the tasks.
    """
    policy = any(row.late is not None for row in rows)
    most = sum(task.points for task in table.tasks.values())
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\r\n")
    before = BEFORE if policy else ()
    written = list(table.written) if any(row.written for row in rows) else []
    writer.writerow(
        ["student", "id", "score", "max", *map(cell, [*table.tasks, *written]), "late", *before, "notes"]
    )
    lines = []
    for row in rows:
        answers = (row.score(name) if name in row.written else None for name in written)
        scores = [row.counts, most, *(row.score(task) for task in table.tasks), *answers]
        for student in row.submission.students:
            lines.append(
                [
                    cell(student.name),
                    cell(student.id),
                    *("" if score is None else points(score) for score in scores),
                    "yes" if row.was_late else "",
                    *(_before(row) if policy else ()),
                    cell(row.told(), NOTES),
                ]
            )
    lines.sort(key=lambda line: (line[0].casefold(), line[0], line[1]))
    writer.writerows(lines)
    return stream.getvalue()


def _before(row: Row) -> tuple[str, str]:
    return "" if row.total is None else points(row.total), points(row.taken) if row.taken else ""
