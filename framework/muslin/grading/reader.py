"""Whoever reads a submission's text for the grader: a process of its own, which may take little time and memory.

A text is hostile like all that was handed in: a loop in it, a power, a long tuple may cost whoever reads it all
the time and memory there is. So the grader itself never reads one. What is asked here is an explanation, and no grade
hangs on it: a question that takes too much ends the process and is answered with nothing; the next goes to another.
Numbers go there as plain arrays, words come back as JSON (`muslin.grading.wire`).
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.base import child
from muslin.grading import wire
from muslin.grading.patience import Patience

if TYPE_CHECKING:
    from muslin.grading.diagnosis import Diagnosis
    from muslin.judging import Given, Outputs, Property

#: What it may take: time for a question, and to start [s]; memory beyond what it starts with, and a file [bytes].
SECONDS, STARTING, MEMORY, FILE = 10.0, 60.0, 2 << 30, 1 << 20

#: After so many questions that cost too much, a submission is asked about no more.
MOST_LOST = 2

#: Likely mistake: key, words, next step. None where nothing is found.
Said = tuple[str, str, str] | None


class Reader:
    """Reads the files of one submission; started when it is asked for the first time, by whichever thread.

    Leaving the `with` block ends it; who asks afterwards hears nothing.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: socket.socket | None = None
        self._lost, self._closed = 0, False

    def diagnose(
        self, task: str, got: Outputs, expected: Outputs, inputs: Given, assignment: str, data: bytes
    ) -> Said:
        """Name the mistake behind a wrong answer: `muslin.grading.diagnosis.diagnose`, of a file's bytes."""
        arrays = {**_listed("got", got), **_listed("expected", expected), **_named("in", inputs)}
        return self._said({"do": "diagnose", "task": task, "assignment": assignment}, arrays, data)

    def misfit(self, task: str, expected: Outputs, inputs: Given, assignment: str, data: bytes) -> Said:
        """Name what is wrong with the shapes in a function that does not compile: `diagnosis.misfit`."""
        arrays = {**_listed("expected", expected), **_named("in", inputs)}
        return self._said({"do": "misfit", "task": task, "assignment": assignment}, arrays, data)

    def upheld(
        self,
        task: str,
        expected: Outputs,
        inputs: Given,
        drawn: Sequence[tuple[Property, Given]],
        outputs: Sequence[Outputs],
        assignment: str,
        data: bytes,
    ) -> Said:
        """Name the mistake behind a property that does not hold: `muslin.grading.upheld.upheld`."""
        arrays = {**_listed("expected", expected), **_named("in", inputs)}
        for k, ((_, given), came) in enumerate(zip(drawn, outputs, strict=True)):
            arrays |= {**_named(f"drawn {k}", given), **_listed(f"came {k}", came)}
        names = [prop.name for prop, _ in drawn]
        asked = {"do": "upheld", "task": task, "assignment": assignment, "properties": names}
        return self._said(asked, arrays, data)

    def notes(self, task: str, assignment: str, data: bytes) -> list[str]:
        """What a reader notices in the text of a task's function, as it is shown."""
        notes = self._ask({"do": "notes", "task": task, "assignment": assignment}, {}, data).get("notes")
        return notes if isinstance(notes, list) and all(isinstance(note, str) for note in notes) else []

    def _said(self, question: Mapping[str, Any], arrays: Mapping[str, np.ndarray], data: bytes) -> Said:
        found = self._ask(question, arrays, data).get("found")
        if isinstance(found, list) and len(found) == 3 and all(isinstance(part, str) for part in found):
            return found[0], found[1], found[2]
        return None

    def _ask(
        self, question: Mapping[str, Any], arrays: Mapping[str, np.ndarray], data: bytes
    ) -> Mapping[str, Any]:
        """What it answers; nothing if it takes too much."""
        with self._lock:
            if self._closed or self._lost >= MOST_LOST:
                return {}
            try:
                if self._process is None or self._channel is None:
                    self._process, self._channel = _started()
                    wire.receive(self._channel, self._patience(STARTING), {})
                patience = self._patience(SECONDS)
                text = {"text": np.frombuffer(data, dtype=np.uint8)}
                wire.send(self._channel, question, {**arrays, **text}, patience)
                return wire.receive(self._channel, patience, {})[0]
            except (wire.Gone, wire.Garbled, wire.TooLate, OSError):
                self._lost += 1
                self._end()
                return {}

    def _patience(self, seconds: float) -> Patience:
        patience = Patience(seconds)
        if self._process is not None:
            patience.watch(self._process.pid)
        return patience

    def _end(self) -> None:
        if self._channel is not None:
            self._channel.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._process = self._channel = None

    def close(self) -> None:
        """End it, whatever it is doing."""
        self._closed = True
        if (process := self._process) is not None:
            process.kill()  # whoever waits for an answer hears that it has gone
        with self._lock:
            self._end()

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _started() -> tuple[subprocess.Popen[bytes], socket.socket]:
    ours, theirs = socket.socketpair()
    with theirs:
        process = subprocess.Popen(
            child.python("muslin.grading.reader:main"),
            env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            stdin=theirs.fileno(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
    return process, ours


def _listed(of: str, arrays: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{of} {k}": array for k, array in enumerate(arrays)}


def _named(of: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{of} {name}": array for name, array in arrays.items()}


# in the process that reads ----------------------------------------------------------------------------------


def main() -> None:
    """Answer questions on standard input, a socket, until it closes."""
    from muslin.grading import diagnosis, upheld  # noqa: F401 - before its memory is limited

    with socket.socket(fileno=os.dup(0)) as channel:
        _limit_memory()
        wire.send(channel, {})
        while True:
            try:
                question, arrays = wire.receive(channel)
            except wire.Gone:
                return
            _limit_time()
            reply: dict[str, Any] = {}
            with contextlib.suppress(Exception):  # a grade must never be lost for want of an explanation
                reply = _answered(question, arrays)
            wire.send(channel, reply)


def _answered(question: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    from muslin import reading, tasks
    from muslin.grading import diagnosis
    from muslin.grading.upheld import upheld
    from muslin.judging import judge
    from muslin.reading import source

    name, assignment = question["task"], question["assignment"]
    task = tasks.assignment(assignment).tasks[name]
    try:
        text = source.decoded(arrays["text"].tobytes())
    except Exception:  # an encoding of an odd kind
        text = ""
    if question["do"] == "notes":
        return {"notes": reading.told_of(text, task)}
    expected, inputs = _list(arrays, "expected"), _dict(arrays, "in")
    found: Diagnosis | None
    if question["do"] == "diagnose":
        found = diagnosis.diagnose(task, _list(arrays, "got"), expected, inputs, assignment, text)
    elif question["do"] == "misfit":
        found = diagnosis.misfit(task, expected, inputs, assignment, text)
    else:
        known = {prop.name: prop for prop in judge(assignment, name).properties}
        named = question["properties"]
        drawn = [(known[prop], _dict(arrays, f"drawn {k}")) for k, prop in enumerate(named)]
        outputs = [_list(arrays, f"came {k}") for k in range(len(named))]
        found = upheld(task, expected, inputs, drawn, outputs, assignment, text)
    return {"found": [found.cause, found.mistake, found.advice] if found else None}


def _list(arrays: Mapping[str, np.ndarray], of: str) -> tuple[np.ndarray, ...]:
    return tuple(_dict(arrays, of).values())


def _dict(arrays: Mapping[str, np.ndarray], of: str) -> dict[str, np.ndarray]:
    return {key.removeprefix(f"{of} "): a for key, a in arrays.items() if key.startswith(f"{of} ")}


def _limit_memory() -> None:
    """Take little memory from here on, and little of the disk, where the system can see to it."""
    import resource

    size = 0
    with contextlib.suppress(OSError, ValueError), open("/proc/self/statm", encoding="ascii") as stream:
        size = int(stream.read().split()[0]) * resource.getpagesize()
    for what, most in (
        (resource.RLIMIT_AS, size + MEMORY),
        (resource.RLIMIT_FSIZE, FILE),
        (resource.RLIMIT_CORE, 0),
    ):
        _limit(what, most)


def _limit_time() -> None:
    """Take little processor time for one question; the grader looks, too, but it may be busy."""
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    _limit(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime + SECONDS) + 2)


def _limit(what: int, most: int) -> None:
    import resource

    _, hard = resource.getrlimit(what)
    if hard == resource.RLIM_INFINITY or most < hard:
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(what, (most, hard))
