"""Processes of our own beside this one: started, fed, given a time limit, ended with all they started, collected.

`run` is for those that are asked one thing, `Child` for those that are spoken with, `forked` for those that take
Python objects. Each begins a group of its own, so that Ctrl-C is for whoever started it alone.
The process that runs a submission is not among them: see `grading.sandbox`.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from muslin.base import engine

#: How much of what a process complains about is kept: the end [bytes].
KEPT = 4096

#: The shortest time a task may be given for an answer [s].
SHORTEST = 0.5

#: How long to wait for what has been killed [s].
REST = 5.0


def python(entry: str) -> list[str]:
    """Command that calls a function of ours; what lies in the working folder is never imported.

    Parameters
    ----------
    entry : str
        "package.module:function".
    """
    module, function = entry.split(":")
    package = str(Path(__file__).resolve().parent.parent.parent)
    here = ("", os.getcwd())
    search = [package, *(path for path in sys.path if path not in here and path != package)]
    code = f"import sys; sys.path[:] = {search!r}; from {module} import {function}; {function}()"
    return [sys.executable, "-I", "-c", code]


@dataclass(frozen=True)
class Done:
    """What came of a process.

    Attributes
    ----------
    output, errors : bytes
        What it said, as far as it came.
    status : int
        Its exit code, or minus the signal that ended it.
    late : bool
        Whether it was ended because it took too long.
    """

    output: bytes
    errors: bytes
    status: int
    late: bool = False


def run(
    command: Sequence[str],
    given: bytes = b"",
    *,
    limit: float,
    environment: Mapping[str, str] | None = None,
    folder: Path | str | None = None,
) -> Done:
    """Run a command to its end, or to the limit.

    Parameters
    ----------
    command : sequence of str
    given : bytes
        For its standard input.
    limit : float
        How long it may take [s].
    environment, folder : optional
        Default: as here.

    Raises
    ------
    OSError
        If it cannot be started.
    """
    process = _started(command, environment, folder)
    late = False
    try:
        try:
            output, errors = process.communicate(given, timeout=limit)
        except subprocess.TimeoutExpired:
            late = True
            _kill(process)
            output, errors = _what_came(process)
    finally:
        _kill(process)
        process.wait()
    return Done(output, errors, process.returncode, late)


def _what_came(process: subprocess.Popen[bytes]) -> tuple[bytes, bytes]:
    try:
        return process.communicate(timeout=REST)
    except subprocess.TimeoutExpired as held:  # by something that has left the group
        return held.stdout or b"", held.stderr or b""


class Child:
    """A process to speak with; leaving the `with` block ends it.

    Parameters
    ----------
    command : sequence of str
    environment : mapping, optional
        Default: as here.

    Attributes
    ----------
    late : bool
        Whether it was ended by a limit.

    Raises
    ------
    OSError
        If it cannot be started.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] | None = None):
        self.late = False
        self._process = _started(command, environment)
        self._errors = bytearray()
        self._drain = threading.Thread(target=self._keep_errors, daemon=True)
        self._drain.start()

    def say(self, data: bytes | memoryview) -> bool:
        """Write to its standard input; whether it was there to take it."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(data)
            self._process.stdin.flush()
        except (OSError, ValueError):
            return False
        return True

    def said_all(self) -> None:
        """Close its standard input."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()

    def line(self) -> bytes:
        """The next line it says; empty when it has ended."""
        assert self._process.stdout is not None
        with contextlib.suppress(OSError, ValueError):
            return self._process.stdout.readline()
        return b""

    def rest(self) -> bytes:
        """All that it still says."""
        assert self._process.stdout is not None
        with contextlib.suppress(OSError, ValueError):
            return self._process.stdout.read()
        return b""

    @contextlib.contextmanager
    def limited(self, seconds: float) -> Iterator[None]:
        """End it if the block takes longer."""
        alarm = threading.Timer(seconds, self._end_late)
        alarm.start()
        try:
            yield
        finally:
            alarm.cancel()

    def wait(self, seconds: float | None = None) -> int | None:
        """Its exit code, or minus the signal that ended it; None if it is not over by then."""
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None

    def last_error(self) -> str:
        """The last line of its errors."""
        self._drain.join(REST)
        return last_line(bytes(self._errors))

    def kill(self) -> None:
        """End it, and what it has started, at once."""
        _kill(self._process)

    def close(self) -> int:
        """End it if it has not ended, and collect it; its exit code."""
        self.said_all()
        self.kill()
        assert self._process.stdout is not None
        self._process.stdout.close()
        return self._process.wait()

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _end_late(self) -> None:
        self.late = True
        self.kill()

    def _keep_errors(self) -> None:
        assert self._process.stderr is not None
        with contextlib.suppress(OSError), self._process.stderr as stream:
            while piece := os.read(stream.fileno(), 1 << 14):
                self._errors += piece
                del self._errors[:-KEPT]


def _started(
    command: Sequence[str], environment: Mapping[str, str] | None = None, folder: Path | str | None = None
) -> subprocess.Popen[bytes]:
    group: dict[str, Any] = (
        {"creationflags": 0x00000200} if sys.platform == "win32" else {"start_new_session": True}
    )
    return subprocess.Popen(
        list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=environment, cwd=folder, **group,
    )  # fmt: skip


def _kill(process: subprocess.Popen[bytes]) -> None:
    if process.returncode is not None:
        return  # it has been collected: its number may be another's by now
    with contextlib.suppress(OSError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)


def forked(
    serve: Callable[..., None], *arguments: Any
) -> tuple[multiprocessing.process.BaseProcess, Connection]:
    """A process that runs `serve(channel, *arguments)`, and our end of the channel.

    It stays in our group: what closes the terminal ends it too, even in a kernel that never returns.
    """
    # Forking is instant, and safe as long as this process has neither threads nor an engine.
    alone = threading.active_count() == 1 and not engine.imported()  # a notebook is not
    fork = sys.platform == "linux" and alone
    context = multiprocessing.get_context("fork" if fork else "spawn")
    ours, theirs = context.Pipe()
    process = context.Process(  # type: ignore[attr-defined]
        target=_serve, args=(serve, theirs, ours if fork else None, arguments), daemon=True
    )
    process.start()
    theirs.close()
    return process, ours


def _serve(
    serve: Callable[..., None], channel: Connection, other_end: Connection | None, arguments: tuple[Any, ...]
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if other_end is not None:
        other_end.close()  # else this process would never hear that the other has gone
    serve(channel, *arguments)


def stop(process: multiprocessing.process.BaseProcess) -> int:
    """End what `forked` has started, whatever it is doing; its exit code."""
    with contextlib.suppress(Exception):
        process.kill()
        process.join(REST)
    return process.exitcode or 0


def killer(status: int) -> str:
    """Name of the signal that ended a process, "SIGSEGV"; empty if it was none."""
    if status >= 0:
        return ""
    try:
        return signal.Signals(-status).name
    except ValueError:
        return f"signal {-status}"


def last_line(said: bytes) -> str:
    """The last line that a process said, cut to a length for messages."""
    return (said.decode(errors="replace").strip().splitlines() or [""])[-1][:300]
