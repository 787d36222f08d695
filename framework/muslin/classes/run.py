"""`grade_class`: find, grade what is not graded yet, and report."""

from __future__ import annotations

import contextlib
import statistics
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

from muslin import tasks
from muslin.base import paths, runtime
from muslin.base.errors import MuslinError
from muslin.classes import again, engines, finding, gradebook, meant, overrides, page, reports, similarity
from muslin.classes.gradebook import Row
from muslin.classes.ledger import Ledger, write
from muslin.classes.returning import Desk, Returned, Wanted
from muslin.classes.whose import assigned
from muslin.classes.work import Job, Result, Terms, edition
from muslin.grading.grader import instructors_data
from muslin.grading.record import from_json
from muslin.grading.submission import Handed, answered, gather, noted
from muslin.grading.views.text import one_line, points
from muslin.tasks.guessing import USUAL

#: How many submissions that could not be graded are named in the summary.
NAMED = 20

#: How many submissions are asked which assignment they answer.
ASKED = 20

#: Longest source of a task file that is compared with others [characters].
LONGEST_SOURCE = 50_000

#: What is said of a submission that a platform lists and that is not in its download.
NOT_THERE = "It is listed in the platform's metadata, but not in the download."

#: What grades: see `muslin.classes.engines`.
Engine = AbstractContextManager[tuple[Executor, int, Callable[..., Result]]]

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
    returned : Returned
        What is ready to upload, and who is who on the roster.
    changed : tuple of Change
        Tasks that were graded again after an erratum.
    """

    rows: tuple[Row, ...]
    taken: int
    folder: Path
    notes: tuple[str, ...]
    cpu: tuple[float, ...] = ()
    returned: Returned = field(default_factory=Returned)
    changed: tuple[again.Change, ...] = ()

    def told(self) -> str:
        """The class in a few lines."""
        totals = [row.counts for row in self.rows if row.counts is not None]
        failed = [row for row in self.rows if row.error]
        lines = [f"{len(self.rows) - len(failed)} graded, {len(failed)} could not be."]
        if totals:
            lines[0] += (
                f" Median {points(statistics.median(totals))} points, mean {points(statistics.fmean(totals))}."
            )
        lines += [f"  {one_line(row.submission.name)}: {one_line(row.error, 400)}" for row in failed[:NAMED]]
        if len(failed) > NAMED:
            lines.append(f"  and {len(failed) - NAMED} more; index.html names them all")
        bonus = [row for row in self.rows if any((o.score or 0) > o.most or o.bonus for o in row.overrides)]
        if bonus:
            lines.append(
                f"Given points on top by hand: {', '.join(one_line(r.submission.name) for r in bonus)}."
            )
        if self.changed:
            lines.append(again.told(self.changed))
        for what, whom in self.returned.told():
            lines.append(f"{what}: {len(whom)}.")
            lines += [f"  {one_line(text, 300)}" for text in whom[:NAMED]]
            if len(whom) > NAMED:
                lines.append(f"  and {len(whom) - NAMED} more; index.html names them all")
        if self.cpu:
            each = statistics.fmean(self.cpu)
            lines.append(
                f"{60 / each:.1f} submissions per minute and core ({each:.1f} s of processor time each)."
            )
        return "\n".join(lines)


def grade_class(
    submissions: Path | str,
    out: Path | str,
    assignment: str | None = None,
    *,
    hidden: Path | str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    by_hand: Path | str | None = None,
    back: Wanted | None = None,
    regrade: Sequence[str] = (),
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
    assignment : str, optional
        Default: the one that most of the submissions answer, by their own assignment.toml or their files; else cloth.
    hidden, seed, safety, deadline
        As in `muslin.grade`.
    jobs : int, optional
        Submissions at a time on this machine; default its usable cores.
    scheduler : str, optional
        Address of a Dask scheduler to grade on instead.
    by_hand : path, optional
        Overrides; see `muslin.classes.overrides`.
    back : Wanted, optional
        What goes back to the platform, and the late policy.
    regrade : sequence of str
        Where the assignment has changed since an earlier run: the tasks that are graded again. All else is taken over.
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
    asked_for, assignment = bool(assignment), assignment or _named(Path(submissions))
    table = tasks.assignment(assignment)
    only = again.named(regrade, table)
    found, notes = finding.find(submissions, table)
    set_by_hand = overrides.read(by_hand, found, table) if by_hand else {}
    desk = Desk(back or Wanted(), found, table)
    notes += desk.notes
    ours = (submissions, out, hidden, by_hand, *desk.files)
    secrets = tuple(str(Path(path).resolve()) for path in ours if path is not None)
    terms = Terms(assignment, edition(assignment), _hidden(hidden, table), seed, safety, deadline, secrets)
    ledger = Ledger(Path(out))
    with ledger.locked():
        collected = _collected(found, table, asked_for)
        notes += meant.told({s.name: collected[s.key] for s in found}, table)
        collected = {s.key: assigned(collected[s.key], s, desk.people(s), table) for s in found}
        results, waiting = _known(collected, terms, ledger)
        earlier = _earlier({key: collected[key] for key in waiting if only}, terms, ledger)
        taken = sum(not handed.unreadable for handed in collected.values()) - len(waiting)
        if on_find:
            on_find(len(found), taken)
        progress = _Progress(len(waiting), len(found), on_progress)
        where = engines.cluster(scheduler) if scheduler else engines.local(jobs or runtime.usable_cores())
        work = [Job(key, collected[key], only if key in earlier else ()) for key in waiting]
        fresh = _graded(work, earlier, terms, ledger, where, progress)
        results |= fresh
        rows = tuple(
            replace(
                _row(s, collected[s.key], results[s.key], set_by_hand.get(s.key, ()), table),
                late=desk.lateness(s),
            )
            for s in found
        )
        returned = _report(ledger.folder, rows, collected, table, notes, desk, progress)
        if changed := again.changes(rows, results):
            write(ledger.folder / again.TABLE, again.as_csv(changed).encode())
    if all(result.record is None for result in results.values()):
        raise MuslinError(
            f"None of {len(found)} submissions could be graded. The first: {one_line(rows[0].error, 400)}",
            f"{paths.shown(ledger.folder / 'grades.csv')} names the reason for each.",
        )
    cpu = tuple(result.cpu for result in fresh.values())
    if only and not changed:
        notes.append(f"nothing is to be graded again: {table.name} is as it was when this report was made")
    return Class(rows, taken, ledger.folder, tuple(notes), cpu, returned, tuple(changed))


def _named(submissions: Path) -> str:
    """The assignment that most submissions answer, of the first that are there."""
    there = sorted(submissions.iterdir())[:ASKED] if submissions.is_dir() else []
    names = Counter(filter(None, map(_name_of, there)))
    return paths.bare(names.most_common(1)[0][0]) if names else USUAL


def _name_of(submission: Path) -> str | None:
    with contextlib.suppress(MuslinError):  # what names none there is gets a reason of its own
        return answered(submission)
    return None


class _Progress:
    """Tells how far grading and reporting have come: a report costs a tenth of a grading."""

    def __init__(self, waiting: int, found: int, tick: Tick | None):
        self.waiting, self.total, self._tick = waiting, waiting + 1 + found // 10, tick

    def graded(self, count: int) -> None:
        self._tell(count)

    def reported(self, count: int, rows: int) -> None:
        self._tell(self.waiting + int((self.total - self.waiting) / max(1, rows) * count))

    def over(self) -> None:
        self._tell(self.total)

    def _tell(self, done: int) -> None:
        if self._tick and done:
            self._tick(done, self.total)


def _known(
    collected: Mapping[str, Handed], terms: Terms, ledger: Ledger
) -> tuple[dict[str, Result], list[str]]:
    """Results that need no grading: of what is unreadable, and of an earlier run; and the keys that do."""
    results: dict[str, Result] = {}
    for key, handed in collected.items():
        if handed.unreadable:
            results[key] = Result(key, error=handed.unreadable)
        elif (earlier := ledger.take(key, terms.stamp(handed))) is not None:
            results[key] = earlier
    return results, [key for key in collected if key not in results]


def _earlier(waiting: Mapping[str, Handed], terms: Terms, ledger: Ledger) -> dict[str, Result]:
    """What waits only because the assignment has changed: results of the same submissions by an earlier edition."""
    found = {k: ledger.take(k, terms.stamp(handed), "assignment") for k, handed in waiting.items()}
    return {key: result for key, result in found.items() if result is not None and result.record is not None}


def _graded(
    work: Sequence[Job],
    earlier: Mapping[str, Result],
    terms: Terms,
    ledger: Ledger,
    where: Engine,
    progress: _Progress,
) -> dict[str, Result]:
    """Grade what waits, in the order in which it is done; each result is on disk when the next one comes."""
    results: dict[str, Result] = {}
    if work:
        jobs = {job.key: job for job in work}
        with where as (pool, width, function):
            for result in engines.results(pool, width, function, terms, iter(work)):
                job = jobs[result.key]
                if job.only and result.record is not None:
                    result = again.merged(earlier[job.key], result, job.only)
                if (
                    not job.only or result.record is not None
                ):  # else the earlier one stays, to be tried once more
                    ledger.keep(result, terms.stamp(job.handed))
                results[result.key] = result
                progress.graded(len(results))
    return results


def _report(
    folder: Path,
    rows: Sequence[Row],
    collected: Mapping[str, Handed],
    table: tasks.Assignment,
    notes: Sequence[str],
    desk: Desk,
    progress: _Progress,
) -> Returned:
    """Write the table, each student's report, what goes back to the platform, and the page about the class."""
    write(folder / "grades.csv", gradebook.grades_csv(rows, table).encode())
    printed = reports.make(folder, rows, lambda done: progress.reported(done, len(rows)))
    sources = {key: _text(handed.files) for key, handed in collected.items() if handed.files}
    alike = similarity.compared(sources, _stubs(table), _solution(table))
    returned = desk.hand_back(folder, rows)
    write(folder / "index.html", page.render(rows, table, printed, alike, notes, returned.told()).encode())
    progress.over()
    return returned


def _collected(
    found: Sequence[finding.Submission], table: tasks.Assignment, asked_for: bool
) -> dict[str, Handed]:
    """What everybody handed in, by key; each is read in a process of its own.

    Unless the assignment was `asked_for`, what says itself that it answers another is not graded as this one.
    """

    def read(submission: finding.Submission) -> Handed:
        handed = gather(submission.sources, submission.name, table)
        if not submission.sources:
            return replace(handed, unreadable=NOT_THERE)
        if not (asked_for or handed.unreadable):
            handed = meant.believed(handed, submission, table)
        return noted(handed, table)

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
