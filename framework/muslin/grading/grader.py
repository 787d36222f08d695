"""`grade`: a submission in, a record out."""

from __future__ import annotations

import hashlib
import json
import platform
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import muslin
from muslin import engine, paths, reading, runtime, tasks
from muslin.errors import MuslinError
from muslin.grading import checks, simulating, wire
from muslin.grading.checks import Outcome, Private, Verdict
from muslin.grading.kernels import Store, tidy
from muslin.grading.record import PASSED, Record, Simulation, TaskResult
from muslin.grading.sandbox import Crashed, Sandbox, Worker
from muslin.grading.submission import Handed, gradable
from muslin.tasks import MANIFEST, Assignment

#: Called as (done, total, what) while grading goes on.
Progress = Callable[[int, int, str], None]


def grade(
    submission: Path | str | Handed,
    assignment: str = "cloth",
    *,
    hidden: Path | str | None = None,
    seed: str | int | None = None,
    safety: str = "auto",
    deadline: float | None = None,
    fresh: bool = False,
    secrets: Sequence[Path | str] = (),
    on_progress: Progress | None = None,
) -> Record:
    """Grade a submission.

    Parameters
    ----------
    submission : path or Handed
        A folder, a zip or a tar with (some of) the assignment's files, or what was collected of one.
    assignment : str
    hidden : path, optional
        An instructor's hidden reference data, from `muslin reference build --hidden`; used besides the hidden
        cases drawn for every submission.
    seed : str or int, optional
        What those are drawn from; default the submission's own bytes and the instructor's secret, so that the
        same submission always meets the same cases.
    safety : {"auto", "namespace", "uid", "process"}
        How the submission is kept apart; see `muslin.grading.sandbox`.
    deadline : float, optional
        Time a task may take, compilation included [s]; default the manifest's.
    fresh : bool
        Compile everything anew, instead of taking over what an earlier grading of the same bytes compiled.
    secrets : sequence of path
        Files and folders besides that the submission must not see, such as those of others.
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
    table = tasks.assignment(assignment)
    handed = gradable(submission, table)
    folder, secret = instructors_data(hidden, table)
    drawn_from = _seed(seed, handed, secret)
    total = 2 * len(table.tasks) + 1
    done = 0

    def tick(what: str) -> None:
        nonlocal done
        done += 1
        if on_progress:
            on_progress(done, total, what)

    seconds = dict.fromkeys(table.tasks, 0.0)
    kept = [*map(Path, secrets), *([folder] if folder else [])]
    # the sandbox is left first: whatever interrupts us ends the workers, and with them what the pool waits for
    with ThreadPoolExecutor(max(2, runtime.usable_cores())) as pool, Sandbox(safety, kept) as sandbox:
        limit = deadline or table.grading.deadline
        store = Store(None if fresh else handed.about.sha256)
        parts = [_Part(sandbox, table, handed, file, limit, seconds, store) for file in table.files]
        asked = [(part, pool.submit(part.public, tick)) for part in parts]
        stages = {task: checks.private(table, task, drawn_from, folder) for task in table.tasks}
        verdicts: dict[str, Verdict] = {}
        for _, answer in asked:  # all public output is in before any hidden input goes out
            verdicts.update(answer.result())
        passing = _passing(verdicts)
        running = pool.submit(_run, sandbox, table, handed, passing, store)
        if not sandbox.safety.defences["no other processes or programs"]:
            running.result()  # it is shown, and workers that see hidden inputs could reach it
        private = [pool.submit(part.private, verdicts, stages, tick) for part in parts]
        run = running.result()
        for finished in private:
            finished.result()
        if _passing(verdicts) != passing:  # some did not stand the private stage
            passing = _passing(verdicts)
            run = _run(sandbox, table, handed, passing, store)
        simulation = _judge_simulation(table, parts, passing, *run)
        for part in parts:
            part.close()
        tick("simulation")
    tidy()
    results = tuple(_result(table, verdicts[name]) for name in table.tasks)
    return Record(
        assignment={"name": table.name, "title": table.title, "version": table.version},
        submission=handed.about,
        environment=_environment(),
        safety=sandbox.safety,
        seed=drawn_from,
        hidden={
            "cases": table.grading.hidden_cases,
            "instructor": len(next(iter(stages.values())).expected[0]) - table.grading.hidden_cases,
        },
        tasks=results,
        simulation=simulation,
        timing={
            "seconds": round(time.monotonic() - began, 3),
            "tasks": {name: round(spent, 3) for name, spent in seconds.items()},
        },
    )


class _Part:
    """The tasks of one file, and the worker that runs it; a worker that dies costs the task it was at."""

    def __init__(
        self,
        sandbox: Sandbox,
        table: Assignment,
        handed: Handed,
        file: str,
        deadline: float,
        seconds: dict[str, float],
        store: Store,
    ):
        self._sandbox, self._table, self._deadline, self._seconds = sandbox, table, deadline, seconds
        self._store = store
        self._file, self.tasks = file, [task for task in table.tasks.values() if task.file == file]
        self._missing = handed.refused.get(file)
        self._files = {file: handed.files[file]} if file in handed.files else {}
        self._worker: Worker | None = None
        self._failures: dict[str, list[str]] = {}
        self._notes: dict[str, list[str]] = {}  # what a reader notices in a function's text
        self._loaded = False
        self._known: Mapping[str, np.ndarray] = {}  # what an earlier grading had compiled
        self._broken: Outcome | None = None  # the file itself cannot be loaded

    def public(self, tick: Callable[[str], None]) -> dict[str, Verdict]:
        """The public stage of its tasks."""
        from muslin import reference

        verdicts = {}
        for task in self.tasks:
            inputs, _ = reference.cases(self._table.name, task.name)
            outcome = self.ask(task.name, inputs)
            if outcome.kind == "crash":
                outcome = self._explained(task.name, inputs, outcome)
            verdicts[task.name] = checks.judge_public(
                self._table, task, outcome, self._notes.get(task.name, ())
            )
            tick(task.name)
        if self._worker is not None and self._worker.status is None and self._store.keeps and not self._known:
            # now, because a worker that has seen hidden inputs could keep them for its next public stage
            _keep(self._worker, self._store, self._file)
            self._worker.close()
        return verdicts

    def private(
        self, verdicts: Mapping[str, Verdict], stages: Mapping[str, Private], tick: Callable[[str], None]
    ) -> None:
        """The private stage of those of its tasks that run."""
        for task in self.tasks:
            verdict, stage = verdicts[task.name], stages[task.name]
            runs = verdict.passed("form")
            outcome = self.ask(task.name, stage.inputs()) if runs else None
            checks.judge_private(verdict, stage, outcome)
            tick(task.name)

    def close(self) -> None:
        """End its worker."""
        if self._worker:
            self._worker.close()

    def ask(self, task: str, inputs: Mapping[str, np.ndarray], debug: bool = False) -> Outcome:
        if self._missing:
            return Outcome(kind="file", text=self._missing)
        if self._broken:
            return self._broken
        began = time.monotonic()
        spent = self._seconds[task]
        deadline = began + max(self._deadline - spent, 1.0)
        try:
            if (trouble := self._load(deadline, debug)) is not None:
                return trouble
            if task in self._failures:
                return Outcome(kind=self._failures[task][0], text=self._failures[task][1])
            assert self._worker is not None
            request = {"do": "evaluate", "task": task}
            _, results, trouble = _asked(self._worker, request, inputs, deadline, self._deadline)
            if trouble is not None:
                return trouble
            return Outcome(tuple(results[key] for key in sorted(results)), printed=self._worker.printed())
        finally:
            self._seconds[task] += time.monotonic() - began

    def _load(self, deadline: float, debug: bool) -> Outcome | None:
        """A worker with the file loaded; what went wrong, if anything did."""
        if self._worker is not None and self._worker.status is None:
            return None
        self._worker = self._sandbox.worker(_COVERED, debug)
        known = self._known = {} if debug else self._store.load(self._file)
        failures, notes, trouble = _load(
            self._worker, self._table, self._files, known, deadline, self._deadline
        )
        if trouble is None:
            self._failures, self._notes, self._loaded = failures, notes, True
        elif not self._loaded:  # so it never will be
            self._broken = trouble
        return trouble

    def _explained(self, task: str, inputs: Mapping[str, np.ndarray], crash: Outcome) -> Outcome:
        """Run a task that crashed once more, with Taichi looking for indices out of range."""
        again = self.ask(task, inputs, debug=True)
        if self._worker:
            self._worker.close()
        if again.kind in ("code", "python"):
            return Outcome(kind="crash", text=f"{crash.text} {again.text}", printed=crash.printed)
        return crash


#: What a worker with a single task's file need not see: the framework's own element.
_COVERED = (Path(muslin.__file__).resolve().parent / "elements",)


def _keep(worker: Worker, store: Store, part: str) -> None:
    """Keep what a worker has compiled, if it has come through."""
    if worker.status is None:
        _, files, trouble = _asked(worker, {"do": "kernels"}, {}, time.monotonic() + 5, 5)
        if trouble is None and files:
            store.save(part, files)


def _load(
    worker: Worker,
    table: Assignment,
    files: Mapping[str, bytes],
    kernels: Mapping[str, np.ndarray],
    deadline: float,
    allowed: float,
) -> tuple[dict[str, list[str]], dict[str, list[str]], Outcome | None]:
    """Load task files into a worker: what is wrong with which function, what is noticed in it, or why it failed."""
    manifest = paths.assignment(table.name) / MANIFEST
    contents = {MANIFEST: manifest.read_bytes(), **files}
    arrays = {name: np.frombuffer(data, dtype=np.uint8) for name, data in contents.items()}
    header, _, trouble = _asked(worker, {"do": "load"}, {**kernels, **arrays}, deadline, allowed)
    if trouble is not None:
        prefix = "" if trouble.kind in ("code", "stub") else "While the file is imported: "
        return {}, {}, Outcome((), trouble.kind, prefix + trouble.text, trouble.printed)
    failures = header.get("failures")
    if not isinstance(failures, dict) or not all(_is_error(entry) for entry in failures.values()):
        return {}, {}, Outcome(kind="garbled", text=_GARBLED)
    return failures, _notes(header.get("notes")), None


def _notes(found: Any) -> dict[str, list[str]]:
    """Notes on functions as a worker sends them; what does not look like that is left out."""
    if not isinstance(found, dict):
        return {}
    texts = {
        task: [note[: reading.LONGEST] for note in notes if isinstance(note, str)][: reading.MOST]
        for task, notes in found.items()
        if isinstance(notes, list)
    }
    return {task: notes for task, notes in texts.items() if notes}


def _asked(
    worker: Worker,
    request: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
    deadline: float,
    allowed: float,
) -> tuple[dict[str, Any], dict[str, np.ndarray], Outcome | None]:
    """Ask a worker: its answer, or what went wrong."""
    try:
        header, results = worker.ask(request, arrays, deadline)
    except wire.TooLate:
        kind, text = (
            "late",
            (
                f"It took longer than {allowed:g} s, compilation included, and was stopped. Is there an endless loop?"
            ),
        )
    except wire.Garbled:
        kind, text = "garbled", _GARBLED
    except Crashed as crash:
        kind, text = "crash", _crash(crash.status)
    else:
        error = header.get("error")
        if error is None:
            return header, results, None
        kind, text = error if _is_error(error) else ("garbled", _GARBLED)
    return {}, {}, Outcome(kind=kind, text=text, printed=worker.printed())


_GARBLED = "It answered with something that is not an array."


def _is_error(entry: Any) -> bool:
    """Whether what a worker says of an error is of the form [kind, text]."""
    return (
        isinstance(entry, list)
        and len(entry) == 2
        and entry[0] in ("stub", "code", "python")
        and isinstance(entry[1], str)
    )


def _crash(status: int) -> str:
    if status >= 0:
        return f"It ended the process it ran in (exit code {status}) instead of returning a result."
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    means = {
        "SIGSEGV": "a segmentation fault: it reads or writes where it may not, such as outside an array",
        "SIGABRT": "Taichi gave up",
        "SIGKILL": "it was killed: out of memory, too many files, or by itself",
        "SIGXFSZ": "it wrote too large a file",
    }.get(name, name)
    return f"It crashed ({means})."


def _run(
    sandbox: Sandbox, table: Assignment, handed: Handed, usable: frozenset[str], store: Store
) -> tuple[dict[str, np.ndarray], str]:
    """A simulation with the functions that passed, the framework's own element in place of the others.

    What it leaves, or nothing and why.
    """
    if not usable or simulating.reference(table.name) is None:
        return {}, ""
    stand_ins = tuple(name for name in table.tasks if name not in usable)
    allowed = table.grading.simulation_deadline
    # a file that kills its process, or brings nothing, is left out
    files = {file: data for file, data in handed.files.items() if usable & _tasks_of(table, file)}

    deadline = time.monotonic() + allowed
    worker = sandbox.worker()
    try:
        _, _, trouble = _load(worker, table, files, store.load("simulation"), deadline, allowed)
        run: dict[str, np.ndarray] = {}
        if trouble is None:
            request = {"do": "simulate", "stand_ins": stand_ins}
            _, run, trouble = _asked(worker, request, {}, deadline, allowed)
        if trouble is None:
            _keep(worker, store, "simulation")
        return run, trouble.text if trouble else ""
    finally:
        worker.close()


def _judge_simulation(
    table: Assignment,
    parts: Sequence[_Part],
    usable: frozenset[str],
    run: Mapping[str, np.ndarray],
    trouble: str,
) -> Simulation:
    """The functions that passed, put together; each is asked of the worker it passed in.

    These workers have seen hidden inputs: nothing they say is told, only what kind of trouble there was.
    """
    expected = simulating.reference(table.name)
    if expected is None:
        return simulating.skipped("This assignment has no simulation.")
    if not usable:
        return simulating.skipped("skipped: none of the functions works yet.")
    home = {task.name: part for part in parts for task in part.tasks}

    def ask(task: str, inputs: Mapping[str, np.ndarray]) -> tuple[np.ndarray, ...]:
        outcome = home[task].ask(task, inputs)
        if outcome.kind:
            raise simulating.Trouble(f"{task}: {checks.category(outcome.kind)}")
        return outcome.results

    stand_ins = tuple(name for name in table.tasks if name not in usable)
    return simulating.judge(ask, run, trouble, expected, usable, stand_ins)


def _tasks_of(table: Assignment, file: str) -> set[str]:
    return {name for name, task in table.tasks.items() if task.file == file}


def _passing(verdicts: Mapping[str, Verdict]) -> frozenset[str]:
    return frozenset(name for name, verdict in verdicts.items() if verdict.status == PASSED)


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
    if assignment != table.name:
        raise MuslinError(f"{paths.shown(folder)} holds data of {assignment!r}, not of {table.name!r}.")
    return folder, secret


def _seed(seed: str | int | None, handed: Handed, secret: str) -> str:
    if seed is not None:
        return str(seed)
    return hashlib.sha256(f"{secret}/{handed.about.sha256}".encode()).hexdigest()[:16]


def _environment() -> dict[str, Any]:
    """Versions, and the mode every grading is pinned to."""
    return {
        "muslin": muslin.__version__,
        **{name: metadata.version(name) for name in (engine.chosen().name, "numpy", "mpmath")},
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "precision": "f64",
        "threads": 1,
        "fast_math": False,
    }
