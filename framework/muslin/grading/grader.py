"""`grade`: a submission in, a record out. It goes through the `stages` in order, and the order is a defence."""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

from muslin import tasks
from muslin.base import engine, paths, runtime
from muslin.base import handed as handed_over
from muslin.base.child import SHORTEST
from muslin.base.errors import MuslinError, choices
from muslin.base.version import __version__
from muslin.grading import checks, simulating
from muslin.grading.checks import Verdict
from muslin.grading.kernels import Store, tidy
from muslin.grading.reader import Reader
from muslin.grading.record import Record, TaskResult, digest
from muslin.grading.sandbox import Sandbox
from muslin.grading.stages import Progress, Stages
from muslin.grading.submission import Handed, answered, gradable
from muslin.tasks import Assignment, constants
from muslin.tasks.guessing import USUAL


def grade(
    submission: Path | str | Handed,
    assignment: str | None = None,
    *,
    hidden: Path | str | None = None,
    seed: str | int | None = None,
    safety: str = "auto",
    deadline: float | None = None,
    fresh: bool = False,
    student: str | None = None,
    secrets: Sequence[Path | str] = (),
    only: Sequence[str] = (),
    on_progress: Progress | None = None,
) -> Record:
    """Grade a submission.

    Parameters
    ----------
    submission : path or Handed
        A folder, a zip or a tar with (some of) the assignment's files, or what was collected of one.
    assignment : str, optional
        Default: the one that its own assignment.toml names; else the one whose files it has; else cloth. Nothing
        else in that file is believed.
    hidden : path, optional
        An instructor's hidden reference data, from `muslin reference build --hidden`; used besides the hidden
        cases drawn for every submission.
    seed : str or int, optional
        What those are drawn from; default the submission's own bytes and the instructor's secret, so that the
        same submission always meets the same cases. Of a seed that is given the record has a digest only.
    safety : {"auto", "namespace", "uid", "process"}
        How the submission is kept apart; see `muslin.grading.sandbox`.
    deadline : float, optional
        Processor time a task may take for an answer, compilation included [s]; default the manifest's.
    fresh : bool
        Compile everything anew, instead of taking over what an earlier grading of the same bytes compiled.
    student : str, optional
        Whose it is, where each student has constants of their own; default what the submission says itself.
    secrets : sequence of path
        Files and folders besides that the submission must not see, such as those of others.
    only : sequence of str
        Tasks to grade; the record has these and no simulation. Default: all.
    on_progress : callable, optional

    Returns
    -------
    Record
        Whatever the submission does, every task of the table has its verdict.

    Raises
    ------
    MuslinError
        If the grading itself cannot be done: no such submission, nothing in it that can be graded, no such
        assignment, hidden data or safety level.
    """
    began = time.monotonic()
    deadline = _deadline(deadline)
    if not isinstance(submission, Handed):
        submission = handed_over.path("submission", submission)
    if assignment is None and not isinstance(submission, Handed):
        assignment = answered(submission)
    table = tasks.assignment(assignment or USUAL)
    handed = gradable(submission, table, supposed=assignment is None)
    if not isinstance(submission, Handed) and _is_ours(Path(submission), table):
        student = student or constants.NOBODY
    table = _of_student(table, handed, student or handed.student)
    if only:
        only = [only] if isinstance(only, str) else list(only)
        if unknown := [name for name in only if name not in table.tasks]:
            raise MuslinError(
                f"{paths.bare(table.name)} has no task {unknown[0]!r}.", choices(unknown[0], table.tasks)
            )
        table = replace(table, tasks={name: task for name, task in table.tasks.items() if name in only})
    folder, secret = instructors_data(hidden, table)
    drawn_from, told_of_seed = _seed(seed, handed, secret)
    of_instructor = checks.instructors_cases(table, folder)
    store = Store(None if fresh else handed.about.sha256)
    kept = [*map(Path, secrets), *([folder] if folder else [])]
    allowed = deadline or table.grading.deadline
    cores = max(2, runtime.usable_cores())
    # the pool is left last: whatever interrupts us ends reader and workers, and with them what the pool waits for
    with ThreadPoolExecutor(cores) as pool, Sandbox(safety, kept) as sandbox, Reader() as reader:
        stages = Stages(sandbox, reader, pool, table, handed, store, allowed, on_progress)
        stages.public()
        stages.properties(drawn_from)
        laws = () if only else stages.laws()
        stages.rest()
        run = None if only else stages.simulate()
        cases = {name: checks.hidden(table, name, drawn_from, folder) for name in stages.right_on("public")}
        simulation = (
            stages.judge(laws, run.result()) if run else simulating.skipped("Only some tasks were graded.")
        )
        told = time.monotonic() - began  # what is told of time could carry hidden inputs out, too
        stages.hidden(cases)
    tidy()
    return Record(
        assignment={"name": paths.bare(table.name), "title": table.title, "version": table.version},
        submission=handed.about,
        environment=_environment(),
        safety=sandbox.safety,
        seed=told_of_seed,
        hidden={"cases": table.grading.hidden_cases, "instructor": of_instructor},
        tasks=tuple(_result(table, stages.verdicts[name]) for name in table.tasks),
        simulation=simulation,
        timing={
            "seconds": round(told, 3),
            "tasks": {name: round(spent, 3) for name, spent in stages.seconds.items()},
        },
    )


def _deadline(deadline: float | None) -> float | None:
    """Processor time a task may take [s], if one was given."""
    if deadline is not None and handed_over.number("deadline", deadline) < SHORTEST:
        raise MuslinError(f"deadline = {deadline} s is too short.", f"Give at least {SHORTEST} s.")
    return deadline


def _is_ours(submission: Path, table: Assignment) -> bool:
    """Whether it is the solution, or what everybody is given."""
    return submission.resolve() in (
        paths.source(table.name).resolve(),
        paths.assignment(table.name).resolve(),
    )


def _of_student(table: Assignment, handed: Handed, student: str | None) -> Assignment:
    """The assignment as the student has it whose submission this is, where each has constants of their own.

    Raises
    ------
    MuslinError
        If nobody says whose it is, or it is somebody else's.
    """
    if table.constants is None:
        if student and student != constants.NOBODY:
            raise MuslinError(f"Everybody has the same {table.name}.", "Leave --student out.")
        return table
    if student == constants.NOBODY:
        return table
    said = table.constants.whose(handed.files)
    whose = constants.plain(student or table.student or said)
    if not whose:
        raise MuslinError(
            f"Everybody has constants of their own in {table.name}, and this submission does not say whose it is.",
            "Add --student ID.",
        )
    if said not in ("", whose):
        raise MuslinError(f"{table.constants.file} has the constants of {said}, and this is {whose}'s work.")
    return tasks.assignment(constants.of(table.name, whose))


def _result(table: Assignment, verdict: Verdict) -> TaskResult:
    task = verdict.task
    return TaskResult(
        name=task.name,
        title=task.title,
        file=task.file,
        section=task.section,
        status=verdict.status,
        score=round(task.points * verdict.credit(table.grading.credit), 2),
        max_score=float(task.points),
        checks=tuple(verdict.checks),
        output=verdict.printed,
    )


def instructors_data(hidden: Path | str | None, table: Assignment) -> tuple[Path | None, str]:
    """The folder of an instructor's hidden data, and the secret in it.

    Parameters
    ----------
    hidden : path, optional
    table : Assignment

    Returns
    -------
    folder : Path or None
    secret : str
        Empty without a folder.

    Raises
    ------
    MuslinError
        If it holds no hidden data, or those of another assignment.
    """
    if hidden is None:
        return None, ""
    folder = Path(hidden)
    try:
        provenance = json.loads((folder / "provenance.json").read_text(encoding="utf-8"))
        assignment, secret = provenance["assignment"], str(provenance["seed"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise MuslinError(
            f"{paths.shown(folder)} holds no hidden reference data (provenance.json: {why}).",
            "Make them with: muslin reference build --hidden --seed SECRET --out DIR",
        ) from None
    if assignment != paths.bare(table.name):
        raise MuslinError(f"{paths.shown(folder)} holds data of {assignment!r}, not of {table.name!r}.")
    return folder, secret


def _seed(seed: str | int | None, handed: Handed, secret: str) -> tuple[str, str]:
    """What cases are drawn from, and what the record says of it: of words that others are graded by only a digest."""
    if seed is not None:
        return str(seed), digest(str(seed))
    drawn_from = hashlib.sha256(f"{secret}/{handed.about.sha256}".encode()).hexdigest()[:16]
    return drawn_from, drawn_from


def _environment() -> dict[str, Any]:
    """Versions, and the mode every grading is pinned to."""
    return {
        "muslin": __version__,
        **{name: metadata.version(name) for name in (engine.chosen().name, "numpy", "mpmath")},
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "precision": "f64",
        "threads": 1,
        "fast_math": False,
    }
