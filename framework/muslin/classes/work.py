"""One submission graded in a process of its own: `graded` starts it, `main` is what runs in it.

The same function is called on this machine and on the workers of a cluster: everything it needs comes as bytes,
everything it finds goes back as plain data.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from muslin import tasks
from muslin.base import paths
from muslin.base.child import Child, python
from muslin.base.errors import MuslinError, of_system
from muslin.base.scratch import CLASS, GRADING, Scratch, remove, sweep
from muslin.base.version import __version__
from muslin.grading.record import digest
from muslin.grading.submission import Handed


@dataclass(frozen=True)
class Terms:
    """What all submissions of a class are graded by.

    Attributes
    ----------
    assignment : str
    edition : str
        What it is graded by here (see `edition`); a worker with another one refuses.
    hidden : tuple of (str, bytes)
        The files of the instructor's hidden data; empty if there are none.
    seed, safety, deadline
        As in `muslin.grade`.
    secrets : tuple of str
        Files and folders that no submission may see, wherever they lie; no verdict depends on them.
    """

    assignment: str
    edition: str
    hidden: tuple[tuple[str, bytes], ...] = ()
    seed: str | None = None
    safety: str = "auto"
    deadline: float | None = None
    secrets: tuple[str, ...] = ()

    def stamp(self, handed: Handed) -> dict[str, str]:
        """What a verdict depends on: a result is taken over only if all of this is the same."""
        hidden = hashlib.sha256()
        for name, data in self.hidden:
            hidden.update(f"{name} {len(data)}\n".encode() + data)
        contents: list[Any] = [handed.about.sha256, handed.refused]
        contents += [handed.student] if handed.student else []
        return {
            "submission": hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest(),
            "assignment": self.edition,
            "hidden": hidden.hexdigest() if self.hidden else "",
            "seed": digest(self.seed) if self.seed else "",
            "safety": self.safety,
            "deadline": "" if self.deadline is None else f"{self.deadline:g}",
        }


@dataclass(frozen=True)
class Job:
    """A submission on its way: its key, what was handed in, and the tasks to grade if not all."""

    key: str
    handed: Handed
    only: tuple[str, ...] = ()


@dataclass(frozen=True)
class Result:
    """What came of a submission: its record, or why there is none.

    Attributes
    ----------
    key : str
    record : dict, optional
        `Record.as_json`.
    error : str
        For people.
    final : bool
        Whether grading the same bytes again would end the same.
    cpu : float
        Processor time it took, all processes together [s].
    before : dict
        Points of tasks that were graded again, before that.
    """

    key: str
    record: dict[str, Any] | None = None
    error: str = ""
    final: bool = True
    cpu: float = 0.0
    before: Mapping[str, float] = field(default_factory=dict)


@cache
def edition(assignment: str) -> str:
    """Name of an assignment, with a fingerprint of what its verdicts depend on here.

    Titles, hints, units and meanings are not in it: who corrects a word in the manifest need not grade again.
    """
    table = tasks.assignment(assignment)
    tested = [
        (
            task.name,
            task.file,
            task.points,
            *((value.name, value.kind) for value in (*task.inputs, *task.results)),
        )
        for task in table.tasks.values()
    ]
    grading = {**vars(table.grading), "credit": sorted(table.grading.credit.items())}
    digest = hashlib.sha256(repr((__version__, tested, sorted(grading.items()))).encode())
    known = (path for _, path in paths.knowledge(assignment))
    for file in sorted({*paths.reference(assignment).rglob("*"), *known}):
        if file.is_file():
            digest.update(file.name.encode() + file.read_bytes())
    return f"{table.name} {digest.hexdigest()[:16]}"


def longest(terms: Terms) -> float:
    """How long grading one submission may take, everything included [s]; the grader's own limits are tighter."""
    table = tasks.assignment(terms.assignment)
    deadline = terms.deadline or table.grading.deadline
    return 180.0 + 2 * len(table.tasks) * (deadline + 5) + 4 * table.grading.simulation_deadline


def graded(terms: Terms, job: Job, on_start: Callable[[Child], None] | None = None) -> Result:
    """Grade a submission in a process of its own, and wait for it. Never raises on account of the submission."""
    try:
        with Scratch(CLASS) as scratch:  # ours, so that it goes however that process ends
            try:
                return _graded_apart(terms, job, scratch.path, on_start)
            finally:
                sweep((GRADING,))  # what that process has left, if it was ended
    except OSError as error:  # a full disk, too many processes
        return Result(job.key, error=str(of_system(error)), final=False)


def _graded_apart(terms: Terms, job: Job, folder: str, on_start: Callable[[Child], None] | None) -> Result:
    limit = longest(terms)
    with Child(python("muslin.classes.work:main")) as process:
        if on_start:
            on_start(process)
        with process.limited(limit):
            message = pickle.dumps((terms, job, folder))
            process.say(len(message).to_bytes(8, "big") + message)
            answer = process.rest()
            status = process.wait()
    if process.late:
        return Result(job.key, error=f"Grading it did not end within {limit:.0f} s.", final=False)
    try:
        return Result(**json.loads(answer))
    except (ValueError, TypeError):
        said = process.last_error() or "it said nothing"
        return Result(job.key, error=f"The grader ended early ({status}): {said}", final=False)


def main() -> None:
    """Grade what comes on standard input and say the result on standard output; end with whoever asked."""
    out = os.dup(1)
    os.dup2(2, 1)  # nothing else gets between
    size = int.from_bytes(sys.stdin.buffer.read(8), "big")
    terms, job, folder = pickle.loads(sys.stdin.buffer.read(size))
    threading.Thread(target=_end_with_parent, args=(folder,), daemon=True).start()
    result = _graded_here(terms, job, folder)
    with open(out, "w", encoding="utf-8") as stream:
        json.dump(asdict(replace(result, cpu=_processor_time())), stream)
    os._exit(0)  # the thread that watches the parent is reading still


def _end_with_parent(folder: str) -> None:
    os.read(0, 1)
    remove(folder)
    Scratch.close_all()
    os._exit(1)


def _processor_time() -> float:
    times = os.times()
    return round(times.user + times.system + times.children_user + times.children_system, 3)


def _graded_here(terms: Terms, job: Job, folder: str) -> Result:
    from muslin.grading.grader import grade

    if (here := edition(terms.assignment)) != terms.edition:
        text = f"This worker has another edition of the assignment ({here} instead of {terms.edition})."
        return Result(job.key, error=text, final=False)
    try:
        hidden = None
        if terms.hidden:
            hidden = Path(folder, "hidden data")
            hidden.mkdir()
            for name, data in terms.hidden:
                (hidden / name).write_bytes(data)
        record = grade(
            job.handed, terms.assignment, hidden=hidden, seed=terms.seed, safety=terms.safety,
            deadline=terms.deadline, secrets=terms.secrets, only=job.only,
            fresh=True,  # hardly any is graded twice, and keeping costs time
        )  # fmt: skip
    except MuslinError as error:
        return Result(job.key, error=str(error), final=False)
    except OSError as error:  # a full disk, too many processes
        return Result(job.key, error=str(of_system(error)), final=False)
    except Exception as error:
        text = f"An error in Muslin itself: {type(error).__name__}: {error}"
        return Result(job.key, error=text, final=False)
    return Result(job.key, record.as_json())
