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

#: Longest notes in a cell [characters].
NOTES = 2000


@dataclass(frozen=True)
class Row:
    """A submission, what came of it, and what was set by hand.

    `error` says why there is no record, `found` what was noticed about the files. Scores are those that count,
    overrides included.
    """

    submission: Submission
    record: Record | None = None
    error: str = ""
    overrides: tuple[Override, ...] = ()
    found: tuple[str, ...] = ()

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

    def score(self, task: str) -> float | None:
        """Points that count for a task."""
        score = self.by_hand(task)
        return score if score is not None or self.record is None else self.record[task].score

    @property
    def total(self) -> float | None:
        """Points that count in all."""
        if (total := self.by_hand()) is not None:
            return total
        if self.record:
            return round(sum(self.score(task.name) or 0.0 for task in self.record), 2)
        return round(sum(self._by_hand.values()), 2) if self._by_hand else None

    def notes(self) -> list[str]:
        """What a person should know: late, not graded and why, set by hand."""
        said = ["late"] if self.submission.late else []
        if self.submission.time:
            said.append(f"handed in {self.submission.time}")
        if self.error:
            said.append(f"not graded: {self.error}")
        return [*said, *map(self._said, self.overrides)]

    def told(self) -> str:
        """All notes in a cell: those, and what was noticed about the files."""
        return " | ".join([*self.notes(), *self.found])

    def _said(self, override: Override) -> str:
        """An override in words."""
        what = override.task or "total"
        if override.score is None:
            return f"{override.task}: {override.reason}" if override.task else override.reason
        bonus = "" if override.score <= override.most else f", above the {points(override.most)} there are"
        return f"{what} set by hand to {points(override.score)}{self._instead(override)}{bonus}: {override.reason}"

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
        checks = tuple(self._check(task, entry) for entry in self.overrides if entry.task == task.name)
        if (score := self.by_hand(task.name)) is None:
            return replace(task, checks=(*checks, *task.checks))
        status = task.status
        if status == NOT_IMPLEMENTED:  # a view would show nothing else of it
            status = PASSED if score >= task.max_score else FAILED
        return replace(task, score=score, status=status, checks=(*checks, *task.checks))

    def _check(self, task: TaskResult, override: Override) -> Check:
        if override.score is None:
            return Check("comment", "form", SKIPPED, override.reason)
        said = f"{points(override.score)} of {points(task.max_score)}{self._instead(override)}. {override.reason}"
        return Check("set by hand", "form", SKIPPED, said)


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
                    cell(row.told(), NOTES),
                ]
            )
    lines.sort(key=lambda line: (line[0].casefold(), line[0], line[1]))
    writer.writerows(lines)
    return stream.getvalue()
