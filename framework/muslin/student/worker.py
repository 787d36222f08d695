"""A process that may crash: student code runs there, and what happens is told.

A kernel can end its process (an index out of range) or never return; neither may take the command line with
it. `Worker` is also what makes watching cheap: Taichi stays started in it between checks, and since the
kernels of dropped functions are never freed, it is renewed now and then.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any

from muslin.base import child
from muslin.base.errors import MuslinError

#: What a process most often dies of, by the signal that ended it.
_OFTEN: dict[int, str] = {signal.SIGKILL: "the memory has run out"} if sys.platform != "win32" else {}


#: How often it is asked whether an answer is still wanted [s].
PERIOD = 0.1


class Crashed(MuslinError):
    """The worker has gone: it crashed, or it was ended because it took too long (`late`)."""

    def __init__(self, message: str, late: bool = False):
        super().__init__(message)
        self.late = late


class Stopped(Exception):
    """Nobody wants the answer any more; the worker has been ended."""


class Worker:
    """A process that runs generator functions and sends what they yield.

    Parameters
    ----------
    debug : bool
        Name indices that are out of range while kernels run; about five times slower.
    ready : tuple of str
        Modules to import before anything is asked.
    """

    def __init__(self, debug: bool = False, ready: tuple[str, ...] = ()):
        self._process, self._channel = child.forked(_serve, debug, ready)
        self.asked, self._ready = 0, False

    def ask(
        self,
        function: Callable[..., Iterator[Any]],
        *arguments: Any,
        deadline: float,
        stop: Callable[[], bool] | None = None,
    ) -> Iterator[Any]:
        """Run `function(*arguments)` there; gives what it yields, as it comes.

        Parameters
        ----------
        function : generator function
            At the top level of a module.
        *arguments
            Picklable.
        deadline : float
            Longest time between two things yielded [s]; where one has an `allowed`, after that one so long.
        stop : callable, optional
            Asked while waiting: whether the answer is not wanted any more.

        Raises
        ------
        Stopped
            If `stop` says so. The worker cannot be used again.
        Crashed
            If the process ends or is too late. The worker cannot be used again.
        MuslinError
            What the function raised.
        """
        self.asked += 1
        allowed = deadline
        try:
            self._channel.send((function, arguments))
            while True:
                if not self._heard(allowed, stop):
                    self.close()
                    raise Crashed(
                        f"Your code has not come to an end in {allowed:g} seconds. Is there a loop that never stops?",
                        late=True,
                    )
                kind, what = self._channel.recv()
                if kind == "ready":
                    self._ready = True
                    continue
                if kind == "end":
                    return
                if kind == "item":
                    allowed = getattr(what, "allowed", deadline)
                    yield what
                elif kind == "error":
                    raise what
                else:
                    if os.environ.get("MUSLIN_DEBUG"):
                        print(what, file=sys.stderr)
                    raise RuntimeError(what.strip().splitlines()[-1])
        except (EOFError, OSError):
            self._process.join(child.REST)
            code = self.close()
            name = child.killer(code) or f"exit code {code}"
            if not self._ready:
                raise MuslinError(
                    f"The process that runs your functions ends before it has read them ({name}): "
                    "the fault is not in your code.",
                    "See what this machine lacks: muslin doctor",
                ) from None
            most = _OFTEN.get(-code, "an index is out of range")
            raise Crashed(
                f"Your code has ended the whole Python process ({name}). Most often {most}."
            ) from None

    def _heard(self, deadline: float, stop: Callable[[], bool] | None) -> bool:
        """Wait for something to be said; False if it is too late."""
        if stop is None:
            return self._channel.poll(deadline)
        end = time.monotonic() + deadline
        while not self._channel.poll(PERIOD):
            if stop():
                self.close()
                raise Stopped
            if time.monotonic() > end:
                return False
        return True

    def close(self) -> int:
        """End the process, whatever it is doing; its exit code."""
        code = child.stop(self._process)
        self._channel.close()
        return code

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _serve(channel: Connection, debug: bool, ready: tuple[str, ...]) -> None:
    """Serve until the channel closes."""
    faulthandler.disable()  # a crash is told by the other side
    if debug:  # a second look at a crash: Taichi may print a line for every sample and loop
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, 1)
        os.dup2(nothing, 2)
    from muslin.base import runtime
    from muslin.base.engine import silence

    trouble: MuslinError | None = None
    try:
        import muslin.judging.reference
        import muslin.tasks.batch  # noqa: F401

        runtime.start(threads=1, debug=debug)
        silence.compile_in_silence()
        for module in ready:
            importlib.import_module(module)
    except MuslinError as error:
        trouble = error
    with contextlib.suppress(OSError):
        channel.send(("ready", None))
    while True:
        try:
            function, arguments = channel.recv()
        except (EOFError, OSError):
            return
        try:
            if trouble is not None:
                raise trouble
            for item in function(*arguments):
                channel.send(("item", item))
            answer: tuple[str, Any] = ("end", None)
        except MuslinError as error:
            answer = ("error", _plain(error))
        except Exception:
            answer = ("fault", traceback.format_exc())
        sys.stdout.flush()
        with contextlib.suppress(OSError):
            channel.send(answer)


def _plain(error: MuslinError) -> MuslinError:
    """The error without what cannot travel."""
    return MuslinError(error.message, error.hint)
