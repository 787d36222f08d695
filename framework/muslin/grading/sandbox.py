"""The grader's side of the sandbox: start a fork server, ask workers, kill them on time.

Three levels, the strongest that the system can give is taken:

- ``namespace`` file system with nothing but Python and Muslin (read-only), no network, a process space per
  worker. Needs root with its rights, or user namespaces.
- ``uid`` a user of its own for every worker (root without namespaces, as on Gradescope).
- ``process`` a plain child: crashes, hangs and floods are dealt with, but what this user can read, the
  submission can read.
"""

from __future__ import annotations

import os
import secrets
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import hiding, wire
from muslin.grading.fork_server import STARTING, ForkServer, NotGiven
from muslin.grading.patience import Patience
from muslin.grading.record import Safety

LEVELS = ("namespace", "uid", "process")

#: What a submission may print per worker before the rest is dropped [bytes].
LONGEST_OUTPUT = 20_000
#: What it may say of an error [characters].
LONGEST_TEXT = 4_000


class Crashed(Exception):
    """The worker has ended: `status` is its exit code, or minus the signal that killed it."""

    def __init__(self, status: int):
        super().__init__(status)
        self.status = status


class _Orphaned(Exception):
    """The worker has ended because its fork server has."""


#: Header and arrays of what a worker asks -> those of the answer.
Answer = Callable[
    [Mapping[str, Any], Mapping[str, np.ndarray]], tuple[dict[str, Any], Mapping[str, np.ndarray]]
]


class Worker:
    """One process with one part of a submission. Ask it; it answers with plain data and raw arrays.

    It runs only while it is asked: between two questions it is stopped, so that what it has started takes no time
    from others, and sees nothing of what they do.
    """

    def __init__(self, sandbox: Sandbox, bare: bool, debug: bool, probe: str = ""):
        self._sandbox = sandbox
        self._wish = {"bare": bare, "debug": debug, "probe": probe}
        self._load: tuple[Mapping[str, Any], Mapping[str, np.ndarray]] | None = None
        self._output = bytearray()
        self._seen = 0
        self._begin()

    def _begin(self) -> None:
        """Have a fork server fork the process, and wait until it is ready."""
        ours, theirs = socket.socketpair()
        reads, writes = os.pipe()
        self.status: int | None = None
        self._channel = ours
        self._reader = threading.Thread(target=self._listen, args=(reads,), daemon=True)
        self._reader.start()
        try:
            self._server, self._number, self._process = self._sandbox.spawn(
                self._wish, theirs.fileno(), writes
            )
        except BaseException:
            self.status = -signal.SIGKILL
            ours.close()
            raise
        finally:
            theirs.close()
            os.close(writes)
        try:
            self.about, _ = wire.receive(ours, Patience(STARTING), {})
        except (wire.Gone, wire.TooLate, wire.Garbled):
            why = self._server.last_error()
            self.close()
            why = self.printed().strip() or why
            raise NotGiven(f"a worker did not start. {why}".strip()) from None

    def _listen(self, printed: int) -> None:
        with open(printed, "rb", buffering=0) as stream, suppress(OSError):
            while piece := stream.read(1 << 16):
                room = LONGEST_OUTPUT - len(self._output)
                self._output += piece[: max(0, room)]
                if room <= 0:
                    time.sleep(1e-3)  # a flood is drained, but not at our cost

    def ask(
        self,
        request: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
        patience: Patience,
        expected: Mapping[str, wire.Form] | None = None,
        answer: Answer | None = None,
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Send a request and wait for its answer.

        If its fork server ends, which takes all workers along, who did it cannot be said. The request is made
        once more, to a worker with a fork server of its own.

        Parameters
        ----------
        request : dict
        arrays : dict of ndarray
        patience : Patience
            What the answer may still take.
        expected : dict of (type, shape), optional
            The arrays that must come; without it any may.
        answer : callable, optional
            Answers what the worker asks before it answers itself; the time that takes is not the worker's.

        Raises
        ------
        wire.TooLate
            If there is no more patience.
        wire.Garbled
            If something else came.
        Crashed
            If the worker has ended instead.

        After any of these the worker is dead.
        """
        if request["do"] == "load":
            self._load = request, arrays
        try:
            return self._ask(request, arrays, patience, expected, answer)
        except _Orphaned:
            pass
        try:
            self._begin()
            if self._load is not None and request["do"] != "load":
                self._ask(*self._load, Patience(STARTING), {})
            return self._ask(request, arrays, patience, expected, answer)
        except (_Orphaned, NotGiven):
            raise Crashed(-signal.SIGKILL) from None

    def _ask(
        self,
        request: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
        patience: Patience,
        expected: Mapping[str, wire.Form] | None,
        answer: Answer | None = None,
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        nonce = secrets.token_hex(8)
        patience.watch(self._process)
        self._signal(signal.SIGCONT)
        try:
            wire.send(self._channel, {**request, "id": nonce}, arrays, patience)
            while True:
                began = time.thread_time()
                header, results = wire.receive(self._channel, patience, expected, calls=answer is not None)
                if header.get("id") != nonce:
                    raise wire.Garbled("an answer to no question")
                if answer is None or "call" not in header:
                    return _shortened(header), results
                reply, values = answer(header, results)
                wire.send(self._channel, reply, values, patience)
                patience.answered(time.thread_time() - began)
        except wire.Gone:
            self.close()
            if self.status is None or self._server.ended:
                raise _Orphaned from None
            raise Crashed(self.status) from None
        except (wire.TooLate, wire.Garbled):
            self.close()
            raise
        finally:
            self._signal(signal.SIGSTOP)

    def _signal(self, number: int) -> None:
        """Send it a signal, if nobody has waited for it yet: until then its number is its own."""
        if self.status is None and not self._server.ended:
            with suppress(OSError):
                os.kill(self._process, number)

    def printed(self) -> str:
        """What it has printed since the last call; escapes are the views' business."""
        deadline = time.monotonic() + 0.02  # what it wrote before answering may still be on its way
        while self.status is None and time.monotonic() < deadline:
            time.sleep(0.005)
        text = bytes(self._output[self._seen :]).decode("utf-8", "replace")
        if len(self._output) >= LONGEST_OUTPUT > self._seen:
            text += "\n(more was printed, and dropped)"
        self._seen = len(self._output)
        return text if text.strip() else ""  # before some errors the engine prints empty lines

    def close(self) -> None:
        """Kill it and everything it has started."""
        if self.status is None:
            self.status = self._server.end(self._number)
            self._channel.close()
            self._reader.join(timeout=5)

    @property
    def outlived(self) -> bool:
        """Whether something it has started lives on: it still holds what the worker printed to."""
        return self.status is not None and self._reader.is_alive()


def _shortened(value: Any) -> Any:
    """A header without long text; an honest worker sends none."""
    if isinstance(value, dict):
        return {key[:LONGEST_TEXT]: _shortened(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_shortened(entry) for entry in value]
    return value[:LONGEST_TEXT] if isinstance(value, str) else value


class Sandbox:
    """Where submissions run; a context manager.

    Parameters
    ----------
    safety : str
        One of `LEVELS`, or "auto".
    secrets : sequence of Path
        Folders no worker may read.

    Raises
    ------
    MuslinError
        If the level asked for cannot be had, or no worker can be started at all.
    """

    def __init__(self, safety: str = "auto", secrets: Sequence[Path] = ()):
        if safety not in (*LEVELS, "auto"):
            raise MuslinError(
                f"There is no safety level {safety!r}.", f"There is: auto, {', '.join(LEVELS)}."
            )
        if not hasattr(os, "fork"):
            raise MuslinError(
                "Grading needs Linux or macOS: this system cannot fork processes.",
                "On Windows, grade in WSL; `muslin check` works everywhere.",
            )
        self.asked, self._secrets = safety, [path.resolve() for path in secrets]
        self._lock = threading.Lock()
        self._count = 0
        self._servers: list[ForkServer] = []
        self._closed = self._one_has_ended = False

    def __enter__(self) -> Sandbox:
        reasons: list[str] = []
        for level in LEVELS if self.asked == "auto" else (self.asked,):
            self.level = level
            try:
                self.safety = self._measured(level, reasons)
                break
            except (OSError, NotGiven) as error:
                self._stop()
                reasons.append(f"{level}: {error}")
        else:
            raise MuslinError(
                f"No worker can be kept apart here ({'; '.join(reasons)}).",
                "Try --safety process, or run muslin doctor.",
            )
        return self

    def _measured(self, level: str, reasons: Sequence[str]) -> Safety:
        """What a first worker finds out about its walls, and what becomes of it when it is ended."""
        name = f"muslin-probe-{secrets.token_hex(8)}"
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
            if sys.platform.startswith("linux"):
                listener.bind(f"\0{name}")
            first = Worker(self, True, False, probe=name)
            first.close()
        exposed = first.about["exposed"]
        defences = {
            "deadlines from outside": first.status == -signal.SIGKILL,
            "left-over processes killed": not first.outlived,
            "own user": first.about["user"] != os.getuid(),
            "solution and hidden data out of sight": not exposed,
            **first.about["holds"],
        }
        notes = (*(f"Not available here: {reason}" for reason in reasons), *self._exposed(exposed))
        return Safety(level, self.asked, defences, notes)

    def _exposed(self, found: Sequence[str]) -> Iterator[str]:
        """What the worker could read and should not, for the record."""
        names = {str(path): "the instructor's files" for path in self._secrets}
        told = sorted({names.get(path, Path(path).name) for path in found})
        if told:
            yield f"Not secret on this level here, a submission can read: {', '.join(told)}."

    def __exit__(self, *_: object) -> None:
        self._closed = True
        self._stop()

    def worker(self, bare: bool = True, debug: bool = False) -> Worker:
        """Start a worker; a `bare` one sees no more of Muslin than it needs to call one function."""
        return Worker(self, bare, debug)

    def spawn(self, wish: Mapping[str, Any], channel: int, printed: int) -> tuple[ForkServer, int, int]:
        """Have a fork server fork a worker; all share one, until one has ended of itself.

        The fork server, and the worker's number there and in the system.
        """
        with self._lock:
            if self._closed:
                raise NotGiven("grading has been stopped")
            for server in list(self._servers):
                if server.ended:
                    server.stop()
                    self._servers.remove(server)
                    self._one_has_ended = True
            if not self._servers or self._one_has_ended:
                package = paths.PACKAGE
                self._servers.append(ForkServer(self.level, [*self._secrets, *hiding.answers(package)]))
            self._count += 1
            server, number = self._servers[-1], self._count
        try:
            answer = server.request({**wish, "spawn": number}, (channel, printed))
        except (OSError, ValueError) as error:
            raise NotGiven(f"no worker could be started ({error})") from None
        return server, number, int(answer["spawned"])

    def _stop(self) -> None:
        for server in self._servers:
            server.stop()
        self._servers.clear()
