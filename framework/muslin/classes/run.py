"""`grade_class`: find, grade what is not graded yet, and report."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from muslin import paths, runtime, tasks
from muslin.classes import engines, finding, gradebook, overrides, page, press, similarity
from muslin.classes.gradebook import Row
from muslin.classes.ledger import Ledger, write
from muslin.classes.work import Job, Result, Terms, edition
from muslin.errors import MuslinError
from muslin.grading.grader import instructors_data
from muslin.grading.record import from_json
from muslin.grading.submission import Handed, gather
from muslin.grading.views.text import one_line, points

#: How many submissions that could not be graded are named in the summary.
NAMED = 20

#: Longest source of a task file that is compared with others [characters].
LONGEST_SOURCE = 50_000

#: What is said of a submission that a platform lists and that is not in its download.
NOT_THERE = "It is listed in the platform's metadata, but not in the download."

#: Called as (done, total) while grading and reporting go on.
Tick = Callable[[int, int], None]


@dataclass(frozen=True)
class Class:
    """A class that was graded.

    Attributes
    ----------
    rows : tuple of Row
        One for each submission.
    taken : int
        How many of them an earlier run had graded.
    folder : Path
        Of the report.
    notes : tuple of str
        What was passed over in the folder of submissions.
    cpu : tuple of float
        Processor time of each grading of this run [s].
    """

    rows: tuple[Row, ...]
    taken: int
    folder: Path
    notes: tuple[str, ...]
    cpu: tuple[float, ...] = ()

    def told(self) -> str:
        """The class in a few lines."""
        totals = [row.total for row in self.rows if row.total is not None]
        failed = [row for row in self.rows if row.error]
        lines = [f"{len(self.rows) - len(failed)} graded, {len(failed)} could not be."]
        if totals:
            lines[0] += (
                f" Median {points(statistics.median(totals))} points, mean {points(statistics.fmean(totals))}."
            )
        lines += [f"  {one_line(row.submission.name)}: {one_line(row.error, 400)}" for row in failed[:NAMED]]
        if len(failed) > NAMED:
            lines.append(f"  and {len(failed) - NAMED} more; index.html names them all")
        bonus = [row for row in self.rows if any((o.score or 0) > o.most for o in row.overrides)]
        if bonus:
            lines.append(
                f"Set by hand above the maximum: {', '.join(one_line(r.submission.name) for r in bonus)}."
            )
        if self.cpu:
            each = statistics.fmean(self.cpu)
            lines.append(
                f"{60 / each:.1f} submissions per minute and core ({each:.1f} s of processor time each)."
            )
        return "\n".join(lines)


def grade_class(
    submissions: Path | str,
    out: Path | str,
    assignment: str = "cloth",
    *,
    hidden: Path | str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    by_hand: Path | str | None = None,
    seed: str | None = None,
    safety: str = "auto",
    deadline: float | None = None,
    on_find: Callable[[int, int], None] | None = None,
    on_progress: Tick | None = None,
) -> Class:
    """Grade every submission in a folder; what is graded already is taken over.

    Parameters
    ----------
    submissions : path
    out : path
        Folder of the report; its `records` make a run that was stopped go on.
    assignment : str
    hidden, seed, safety, deadline
        As in `muslin.grade`.
    jobs : int, optional
        Submissions at a time on this machine; default its usable cores.
    scheduler : str, optional
        Address of a Dask scheduler to grade on instead.
    by_hand : path, optional
        Overrides; see `muslin.classes.overrides`.
    on_find : callable, optional
        Called as (submissions, of those graded already).
    on_progress : callable, optional

    Returns
    -------
    Class

    Raises
    ------
    MuslinError
        If the class cannot be graded at all.
    """
    table = tasks.assignment(assignment)
    found, notes = finding.find(submissions, table)
    set_by_hand = overrides.read(by_hand, found, table) if by_hand else {}
    ours = (submissions, out, hidden, by_hand)
    secrets = tuple(str(Path(path).resolve()) for path in ours if path is not None)
    terms = Terms(assignment, edition(assignment), _hidden(hidden, table), seed, safety, deadline, secrets)
    ledger = Ledger(Path(out))
    with ledger.locked():
        collected = _collected(found, table)
        stamps = {key: terms.stamp(handed) for key, handed in collected.items()}
        results = {key: Result(key, error=h.unreadable) for key, h in collected.items() if h.unreadable}
        readable = [submission.key for submission in found if submission.key not in results]
        for key in readable:
            if (earlier := ledger.take(key, stamps[key])) is not None:
                results[key] = earlier
        waiting = [key for key in readable if key not in results]
        taken = len(readable) - len(waiting)
        if on_find:
            on_find(len(found), taken)
        cpu: list[float] = []
        total = len(waiting) + 1 + len(found) // 10  # a report costs a tenth of a grading

        def tick(done: int) -> None:
            if on_progress and done:
                on_progress(done, total)

        if waiting:
            work = (Job(key, collected[key]) for key in waiting)
            engine = (
                engines.cluster(scheduler) if scheduler else engines.local(jobs or runtime.usable_cores())
            )
            with engine as (pool, width, function):
                for done, result in enumerate(engines.results(pool, width, function, terms, work), 1):
                    ledger.keep(result, stamps[result.key])
                    results[result.key] = result
                    cpu.append(result.cpu)
                    tick(done)
        rows = tuple(
            _row(s, collected[s.key], results[s.key], set_by_hand.get(s.key, ()), table) for s in found
        )
        write(ledger.folder / "grades.csv", gradebook.grades_csv(rows, table).encode())
        share = (total - len(waiting)) / max(1, len(rows))
        printed = press.press(ledger.folder, rows, lambda done: tick(len(waiting) + int(share * done)))
        sources = {key: _text(handed.files) for key, handed in collected.items() if handed.files}
        alike = similarity.compared(sources, _stubs(table), _solution(table))
        text = page.render(rows, table, printed, alike, notes)
        write(ledger.folder / "index.html", text.encode())
        tick(total)
    if all(result.record is None for result in results.values()):
        raise MuslinError(
            f"None of {len(found)} submissions could be graded. The first: {one_line(rows[0].error, 400)}",
            f"{paths.shown(ledger.folder / 'grades.csv')} names the reason for each.",
        )
    return Class(rows, taken, ledger.folder, tuple(notes), tuple(cpu))


def _collected(found: Sequence[finding.Submission], table: tasks.Assignment) -> dict[str, Handed]:
    """What everybody handed in, by key; each is read in a process of its own."""

    def read(submission: finding.Submission) -> Handed:
        handed = gather(submission.sources, submission.name, table)
        return handed if submission.sources else replace(handed, unreadable=NOT_THERE)

    with ThreadPoolExecutor(runtime.usable_cores()) as pool:
        return dict(zip([s.key for s in found], pool.map(read, found), strict=True))


def _row(
    submission: finding.Submission,
    handed: Handed,
    result: Result,
    set_by_hand: tuple[overrides.Override, ...],
    table: tasks.Assignment,
) -> Row:
    """A submission's line in every report; words that no verdict depends on are those of today."""
    notes = (*handed.about.notes, *handed.refused.values())
    if result.record is None:
        return Row(submission, None, result.error, set_by_hand, () if handed.unreadable else notes)
    record = from_json(result.record)
    named = [table.tasks[task.name] for task in record]
    record = replace(
        record,
        assignment={**record.assignment, "title": table.title, "version": table.version},
        submission=handed.about,
        tasks=tuple(
            replace(task, title=today.title, section=today.section)
            for task, today in zip(record, named, strict=True)
        ),
    )
    return Row(submission, record, "", set_by_hand, notes)


def _hidden(folder: Path | str | None, table: tasks.Assignment) -> tuple[tuple[str, bytes], ...]:
    """The files of the instructor's hidden data, which go to wherever is graded."""
    if folder is None:
        return ()
    instructors_data(folder, table)  # says what is wrong with them, before all else
    try:
        return tuple((f.name, f.read_bytes()) for f in sorted(Path(folder).iterdir()) if f.is_file())
    except OSError as error:
        raise MuslinError(f"{paths.shown(folder)} cannot be read: {error.strerror}.") from None


def _text(files: Mapping[str, bytes]) -> dict[str, str]:
    return {file: data.decode("utf-8", "replace")[:LONGEST_SOURCE] for file, data in files.items()}


def _stubs(table: tasks.Assignment) -> dict[str, str]:
    folder = paths.assignment(table.name)
    return _text({file: (folder / file).read_bytes() for file in table.files})


def _solution(table: tasks.Assignment) -> dict[str, str]:
    """The published solution, where it is at hand."""
    try:
        folder = paths.solution(table.name)
        return _text({file: (folder / file).read_bytes() for file in table.files})
    except (MuslinError, OSError):
        return {}
