"""What counts in the end: results and overrides in one row per submission, and the table a platform takes in."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from muslin.classes.finding import Submission
from muslin.classes.overrides import Override
from muslin.grading.record import FAILED, NOT_IMPLEMENTED, PASSED, SKIPPED, Check, Record, TaskResult
from muslin.grading.views.grades_csv import cell
from muslin.grading.views.text import points
from muslin.tasks import Assignment


@dataclass(frozen=True)
class Row:
    """A submission, what came of it, and what was set by hand.

    `error` says why there is no record. Scores are those that count, overrides included.
    """

    submission: Submission
    record: Record | None = None
    error: str = ""
    overrides: tuple[Override, ...] = ()

    @property
    def key(self) -> str:
        """The submission's."""
        return self.submission.key

    @cached_property
    def _by_hand(self) -> dict[str, Override]:
        return {override.task: override for override in self.overrides}

    def by_hand(self, task: str = "") -> Override | None:
        """The override of a task, or of the total."""
        return self._by_hand.get(task)

    def score(self, task: str) -> float | None:
        """Points that count for a task."""
        if override := self.by_hand(task):
            return override.score
        return self.record[task].score if self.record else None

    @property
    def total(self) -> float | None:
        """Points that count in all."""
        if override := self.by_hand():
            return override.score
        if self.record:
            return round(sum(self.score(task.name) or 0.0 for task in self.record), 2)
        by_task = [override.score for override in self.overrides]
        return round(sum(by_task), 2) if by_task else None

    def notes(self) -> list[str]:
        """What a person should know: late, not graded, set by hand."""
        said = ["late"] if self.submission.late else []
        if self.error:
            said.append("not graded: see the report")
        for override in self.overrides:
            said.append(
                f"{override.task or 'total'} set by hand to {points(override.score)}"
                f"{self._instead(override)}: {override.reason}"
            )
        return said

    def _instead(self, override: Override) -> str:
        if self.record is None:
            return ""
        graded = self.record[override.task].score if override.task else self.record.score
        return f" (graded: {points(graded)})"

    def as_it_counts(self) -> Record | None:
        """The record with what was set by hand in it, each with a check that says so."""
        if self.record is None or not self.overrides:
            return self.record
        return replace(self.record, tasks=tuple(self._task(task) for task in self.record))

    def _task(self, task: TaskResult) -> TaskResult:
        override = self.by_hand(task.name)
        if override is None:
            return task
        said = f"{points(override.score)} of {points(task.max_score)}{self._instead(override)}. {override.reason}"
        status = task.status
        if status == NOT_IMPLEMENTED:  # a view would show nothing else of it
            status = PASSED if override.score >= task.max_score else FAILED
        checks = (Check("set by hand", "form", SKIPPED, said), *task.checks)
        return replace(task, score=override.score, status=status, checks=checks)


def grades_csv(rows: Sequence[Row], table: Assignment) -> str:
    """A line per student (RFC 4180); the same for every run, and safe to open in a spreadsheet."""
    most = sum(task.points for task in table.tasks.values())
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\r\n")
    writer.writerow(["student", "id", "score", "max", *map(cell, table.tasks), "late", "notes"])
    lines = []
    for row in rows:
        scores = [row.total, most, *(row.score(task) for task in table.tasks)]
        for student in row.submission.students:
            lines.append(
                [
                    cell(student.name),
                    cell(student.id),
                    *("" if score is None else points(score) for score in scores),
                    "yes" if row.submission.late else "",
                    cell("; ".join(row.notes())),
                ]
            )
    lines.sort(key=lambda line: (line[0].casefold(), line[0], line[1]))
    writer.writerows(lines)
    return stream.getvalue()
