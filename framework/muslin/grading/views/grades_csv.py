"""A row for the grade book: a header and one line, safe to open in a spreadsheet."""

from __future__ import annotations

import csv
import io
import re

from muslin.grading.record import Record
from muslin.grading.views.text import one_line

#: A spreadsheet takes a cell that begins like this for a formula; the wide forms count in East Asian settings. And
#: where it separates cells at semicolons, as in most of Europe, cells begin in the middle of ours.
_FORMULA = re.compile(r"(^|;)([ \"]*[=+\-@＝＋－＠])")


def render(record: Record) -> str:
    """The record as CSV (RFC 4180): name, score, max, one column per task, seed, sha256."""
    header = ["name", "score", "max", *(task.name for task in record.tasks), "seed", "sha256"]
    scores = [round(task.score, 2) for task in record.tasks]
    row: list[str | float] = [
        record.submission.name, record.score, record.max_score, *scores, record.seed, record.submission.sha256,
    ]  # fmt: skip
    table = io.StringIO()
    writer = csv.writer(table, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\r\n")
    writer.writerow([cell(name) for name in header])
    writer.writerow([cell(value) if isinstance(value, str) else value for value in row])
    return table.getvalue()


def cell(text: str, limit: int = 200) -> str:
    """Text that no spreadsheet takes for a formula: an apostrophe goes in front of what looks like one."""
    odd_start = "'" if text.lstrip(" ").startswith(("\t", "\r", "\n")) else ""
    return odd_start + _FORMULA.sub(r"\1'\2", one_line(text, limit))
