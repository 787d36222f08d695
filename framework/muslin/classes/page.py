"""The report about a class: one self-contained page, whose only script sorts and filters its table.

What it looks like is in `page.html.j2`; here is what it says.
"""

from __future__ import annotations

import base64
import hashlib
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from markupsafe import Markup

from muslin.base.engine import ENGINES
from muslin.base.templates import filled, verbatim
from muslin.classes.gradebook import NOTES, Row
from muslin.classes.reports import SIZE, Printed
from muslin.classes.similarity import Alike
from muslin.grading.record import FAILED, NOT_IMPLEMENTED
from muslin.grading.views.text import one_line, points
from muslin.tasks import Assignment, Task

#: How a task can stand: name in the style sheet -> in words.
STANDS = {"full": "right", "part": "partly", "none": "wrong, or cannot be run", "open": "not implemented yet"}

#: What the table can be narrowed to besides how a task stands: mark of a row -> in words.
KINDS = {
    "late": "late",
    "hand": "changed by hand",
    "failed": "not graded",
    "lost": "with points lost",
    "whole": "with every point",
}

#: Mistakes that are listed, and students named as examples of each.
MISTAKES, EXAMPLES = 15, 5


def render(
    rows: Sequence[Row],
    table: Assignment,
    printed: Mapping[str, Printed],
    alike: Alike,
    passed_over: Sequence[str] = (),
    roster: Sequence[tuple[str, Sequence[str]]] = (),
) -> str:
    """The page.

    Parameters
    ----------
    rows : sequence of Row
    table : Assignment
    printed : dict of Printed
        Pictures by key.
    alike : Alike
        Submissions that are alike, or like the published solution.
    passed_over : sequence of str
        What in the folder of submissions was none.
    roster : sequence of (str, sequence of str)
        What is to be said of the class's roster, and of whom.
    """
    script = verbatim("classes/class.js")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    tasks = list(table.tasks.values())
    return filled(
        "classes/page",
        policy=Markup(
            f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data:; "
            "base-uri 'none'; form-action 'none'"
        ),
        script=script,
        title=f"{one_line(table.title)}: the class",
        table=table,
        tasks=tasks,
        rows=rows,
        failed=[row for row in rows if row.error],
        names={row.key: row.submission.name for row in rows},
        numbers=_numbers(rows, table),
        bars=_totals(rows, table),
        done=[(task, Counter(_stand(row, task) for row in rows if _stand(row, task))) for task in tasks],
        mistakes=_mistakes(rows),
        pictures=_pictures(rows, printed),
        alike=alike,
        passed_over=passed_over,
        roster=roster,
        policy_of_late=any(row.late is not None for row in rows),
        circumstances=_circumstances(rows, table),
        # how it is said
        stands=STANDS,
        stands_of=_stand,
        kinds_of=_kinds,
        kinds=KINDS,
        most=sum(task.points for task in tasks),
        points=points,
        ids=lambda row: ", ".join(student.id for student in row.submission.students if student.id),
        longest=NOTES,
        examples=EXAMPLES,
        size=SIZE,
    )


def _numbers(rows: Sequence[Row], table: Assignment) -> list[tuple[str, str]]:
    totals = [row.counts for row in rows if row.counts is not None]
    most = sum(task.points for task in table.tasks.values())
    said: list[tuple[str, str]] = [(str(len(rows)), "submission" + "s" * (len(rows) != 1))]
    if totals:
        said += [
            (points(statistics.median(totals)), f"median, of {points(most)} points"),
            (points(round(statistics.fmean(totals), 1)), "mean"),
            (str(sum(total >= most for total in totals)), "with every point"),
        ]
    counted = {
        "late": sum(row.was_late for row in rows),
        "with scores set by hand": sum(bool(row.overrides) for row in rows),
        "not graded": sum(bool(row.error) for row in rows),
    }
    said += [(str(count), what) for what, count in counted.items() if count]
    return said


def _stand(row: Row, task: Task) -> str:
    """How a task of a row stands: one of `STANDS`, or nothing."""
    score = row.score(task.name)
    if score is None:
        return ""
    if score >= task.points:
        return "full"
    if score > 0:
        return "part"
    graded = row.record is not None and not row.touched(task.name)
    return "open" if graded and row.record[task.name].status == NOT_IMPLEMENTED else "none"  # type: ignore[index]


def _kinds(row: Row, most: float) -> str:
    """Which of `KINDS` a row is."""
    counts = row.counts
    is_one = {
        "late": row.was_late,
        "hand": bool(row.overrides),
        "failed": bool(row.error),
        "lost": counts is not None and counts < most,
        "whole": counts is not None and counts >= most,
    }
    return " ".join(kind for kind in KINDS if is_one[kind])


@dataclass(frozen=True)
class Bar:
    """One bar of the plot of all points: where it stands and how tall it is [pixels], and what it counts."""

    x: float
    tall: float
    begins: str
    count: int


def _totals(rows: Sequence[Row], table: Assignment) -> dict[str, Any] | None:
    """How many have how many points, in tenths of what there is."""
    most = sum(task.points for task in table.tasks.values())
    totals = [row.total for row in rows if row.total is not None]
    if not totals:
        return None
    bins = [0] * 10
    for total in totals:
        bins[min(int(10 * total / most), 9)] += 1
    width, height, highest = 560, 150, max(bins)
    bars = [
        Bar(4 + k * width / 10, round(height * count / highest, 1), points(k * most / 10), count)
        for k, count in enumerate(bins)
    ]
    said = ", ".join(f"{bar.count} from {bar.begins}" for bar in bars if bar.count)
    return {"width": width, "height": height, "bars": bars, "most": points(most), "said": said}


@dataclass
class Mistake:
    """One mistake, in the words of the first who made it, and who did."""

    task: str
    cause: str
    diagnosis: str
    advice: str
    who: list[Row] = field(default_factory=list)


def _mistakes(rows: Sequence[Row]) -> list[Mistake]:
    """The mistakes that were recognised, by how many made them."""
    made: dict[tuple[str, str], Mistake] = {}
    for row in rows:
        for task in row.record or ():
            check = next((c for c in task.checks if c.status == FAILED and c.cause), None)
            if check is not None:
                first = Mistake(task.name, check.cause, check.diagnosis, check.advice)
                made.setdefault((task.name, check.cause), first).who.append(row)
    return sorted(made.values(), key=lambda one: (-len(one.who), one.task, one.cause))[:MISTAKES]


def _pictures(rows: Sequence[Row], printed: Mapping[str, Printed]) -> list[tuple[Row, str, str]]:
    """Every simulation's last frame, or why there is none."""
    made = [(row, printed[row.key]) for row in rows if row.key in printed]
    return [(row, base64.b64encode(one.picture).decode(), one.why) for row, one in made]


def _circumstances(rows: Sequence[Row], table: Assignment) -> list[tuple[str, str]]:
    records = [row.record for row in rows if row.record]
    levels = Counter(record.safety.level for record in records)
    versions = Counter(
        ", ".join(
            f"{name} {record.environment[name]}"
            for name in ("muslin", *ENGINES, "python")
            if name in record.environment
        )
        for record in records
    )
    instructors = {record.hidden.get("instructor", 0) for record in records}
    entries = [
        ("Assignment", f"{table.name} {table.version}"),
        ("Hidden cases", f"{table.grading.hidden_cases} drawn per task"),
        ("Safety", ", ".join(f"{level}: {count}" for level, count in sorted(levels.items()))),
        ("Versions", "; ".join(sorted(versions))),
    ]
    if any(instructors):
        entries[1] = (entries[1][0], f"{entries[1][1]}, {max(instructors)} per task from the instructor")
    return entries
