"""The tasks of one file, asked of the worker that runs it; and what its answers mean.

What a worker says is either what was asked for or an `Outcome` with the kind of trouble and its text.
"""

from __future__ import annotations

import signal
from collections.abc import Mapping
from typing import Any

import numpy as np

from muslin.base import paths
from muslin.grading import calls, wire
from muslin.grading.checks import Outcome
from muslin.grading.kernels import sound
from muslin.grading.patience import Patience
from muslin.grading.sandbox import Answer, Crashed, Sandbox, Worker
from muslin.grading.submission import Handed
from muslin.tasks import MANIFEST, Assignment, Task
from muslin.tasks.constants import personal

#: Compiled kernels, by name of the file.
Kernels = Mapping[str, np.ndarray]


class Part:
    """The tasks of one file, and the worker that runs it; a worker that dies costs the task it was at.

    Parameters
    ----------
    sandbox : Sandbox
    table : Assignment
    handed : Handed
    file : str
    deadline : float
        Time a task may take for an answer, compilation included [s].
    kernels : dict
        What an earlier grading of the same bytes compiled.

    Attributes
    ----------
    tasks : list of Task
    kernels : dict
        What is compiled so far, for the next worker.
    data : bytes
        The file, as it was handed in; empty if it was not.
    """

    def __init__(
        self,
        sandbox: Sandbox,
        table: Assignment,
        handed: Handed,
        file: str,
        deadline: float,
        kernels: Kernels,
    ):
        self._sandbox, self._table, self._deadline = sandbox, table, deadline
        self.file, self.tasks = file, [task for task in table.tasks.values() if task.file == file]
        self.kernels = kernels
        self._missing = handed.refused.get(file)
        self._files = {file: handed.files[file]} if file in handed.files else {}
        self.data = handed.files.get(file, b"")
        self._worker: Worker | None = None
        self._failures: dict[str, list[str]] = {}
        self._loaded = False
        self._broken: Outcome | None = None  # the file itself cannot be loaded

    def ask(self, task: Task, inputs: Mapping[str, np.ndarray], shown: bool = False) -> Outcome:
        """What a task's function makes of inputs (b, ...).

        Where all is `shown`, with what it prints, and a crash is looked at once more by a worker that notices
        indices out of range.
        """
        outcome = self._ask(task, inputs, shown)
        if shown and outcome.kind == "crash":
            again = self._ask(task, inputs, shown, debug=True)
            self.close()
            if again.kind in ("code", "python"):
                return Outcome(kind="crash", text=f"{outcome.text} {again.text}", printed=outcome.printed)
        return outcome

    def _ask(self, task: Task, inputs: Mapping[str, np.ndarray], shown: bool, debug: bool = False) -> Outcome:
        if self._missing:
            return Outcome(kind="file", text=self._missing)
        if self._broken:
            return self._broken
        patience = Patience(self._deadline)
        if (trouble := self._load(patience, debug)) is not None:
            return trouble
        if task.name in self._failures:
            return Outcome(kind=self._failures[task.name][0], text=self._failures[task.name][1])
        assert self._worker is not None
        request = {"do": "evaluate", "task": task.name}
        expected = _forms(task, len(next(iter(inputs.values()))))
        seen = {value.name: inputs[value.name] for value in task.seen}
        answer = calls.Answers(self._table, task, inputs) if task.builder else None
        _, results, trouble = ask(self._worker, request, seen, patience, self._deadline, expected, answer)
        printed = self._worker.printed() if shown else ""
        if trouble is not None:
            return Outcome((), trouble.kind, trouble.text, printed)
        return Outcome(tuple(results[key] for key in expected), printed=printed)

    def _load(self, patience: Patience, debug: bool) -> Outcome | None:
        """A worker with the file loaded; what went wrong, if anything did."""
        if self._worker is not None and self._worker.status is None:
            return None
        self._worker = self._sandbox.worker(debug=debug)
        kernels = {} if debug else self.kernels
        failures, trouble = load(self._worker, self._table, self._files, kernels, patience, self._deadline)
        if trouble is None:
            self._failures, self._loaded = failures, True
        elif not self._loaded:  # so it never will be
            self._broken = trouble
        return trouble

    def forgive(self) -> None:
        """Let a file that could not be loaded try once more."""
        self._broken = None

    def rest(self, apart: bool) -> bool:
        """Keep what its worker has compiled, which ends it; whether that is new.

        If all is known, the worker ends too, unless it is `apart` from every other: then it stays, and is stopped.
        """
        new = self._worker is not None and not self.kernels
        if new and self._worker is not None:
            self.kernels = compiled(self._worker)
        if new or not apart:
            self.close()
        return new and bool(self.kernels)

    def close(self) -> None:
        """End its worker; the next question goes to another."""
        if self._worker:
            self._worker.close()
            self._worker = None


def _forms(task: Task, samples: int) -> dict[str, wire.Form]:
    """Type and shape of every result of a task."""
    return {
        str(k): ("<i4" if value.integer else "<f8", (samples, *value.shape))
        for k, value in enumerate(task.results)
    }


def load(
    worker: Worker,
    table: Assignment,
    files: Mapping[str, bytes],
    kernels: Kernels,
    patience: Patience,
    allowed: float,
) -> tuple[dict[str, list[str]], Outcome | None]:
    """Load task files into a worker: what is wrong with which function, or why it failed."""
    given = paths.assignment(table.name)
    manifest = (given / MANIFEST).read_bytes()
    if table.student:
        manifest = personal(manifest.decode("utf-8"), table.name).encode("utf-8")
    contents = {**files, MANIFEST: manifest, **{name: (given / name).read_bytes() for name in table.given}}
    arrays = {name: np.frombuffer(data, dtype=np.uint8) for name, data in contents.items()}
    header, _, trouble = ask(worker, {"do": "load"}, {**kernels, **arrays}, patience, allowed, {})
    if trouble is not None:
        prefix = "" if trouble.kind in ("code", "stub") else "While the file is imported: "
        return {}, Outcome((), trouble.kind, prefix + trouble.text, worker.printed())
    failures = header.get("failures")
    if not isinstance(failures, dict) or not all(_is_error(entry) for entry in failures.values()):
        return {}, Outcome(kind="garbled", text=_GARBLED)
    return failures, None


def ask(
    worker: Worker,
    request: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
    patience: Patience,
    allowed: float,
    expected: Mapping[str, wire.Form] | None = None,
    answer: Answer | None = None,
) -> tuple[dict[str, Any], dict[str, np.ndarray], Outcome | None]:
    """Ask a worker: its answer, or what went wrong."""
    try:
        header, results = worker.ask(request, arrays, patience, expected, answer)
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
    return {}, {}, Outcome(kind=kind, text=text)


_GARBLED = "It answered with something else than the arrays that were asked for."


def compiled(worker: Worker) -> Kernels:
    """What a worker has compiled, if it has come through; it ends Taichi there."""
    if worker.status is not None:
        return {}
    _, files, trouble = ask(worker, {"do": "kernels"}, {}, Patience(5.0), 5.0)
    return files if trouble is None and sound(files) else {}


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
