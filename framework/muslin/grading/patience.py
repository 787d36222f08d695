"""How long a worker may take to answer: what it does is charged, what the machine keeps it from is not.

A worker is charged the processor time it uses, and the time in which it sleeps. Time in which it would run and
gets no core, because others use them all, is not charged; nor is time in which it waits for an answer to one of its
own calls, or in which the grader itself is stopped. So a deadline means the same on a busy machine as on a quiet one,
and a loop without end and a sleep without end both come to theirs. A generous cap on all the time that passes ends
what neither computes nor sleeps.
"""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

#: Time that may pass for every second a worker may use.
CAP = 10.0

#: Longest time between two looks at what the worker does [s].
LOOK = 0.2


class TooLate(Exception):
    """Nothing came in time."""


@dataclass(frozen=True)
class Sight:
    """A process at one moment: the processor time it has used [s], and whether it waits for a core or the disk."""

    used: float
    busy: bool


class Patience:
    """What is left of the time a worker may take.

    Parameters
    ----------
    seconds : float
        Processor time and sleep it may use.
    clock : callable, optional
        Time that passes [s].
    look : callable, optional
        Process number -> what it has used and does now; None where the system does not tell.
    """

    def __init__(
        self,
        seconds: float,
        clock: Callable[[], float] = time.monotonic,
        look: Callable[[int], Sight | None] | None = None,
    ):
        self._clock, self._look_at = clock, look or sight
        self._seconds, self._charged, self._passed, self._pending = seconds, 0.0, 0.0, 0.0
        self._process: int | None = None
        self._used = 0.0

    def watch(self, process: int) -> None:
        """Charge this process from now on; what was charged before stays."""
        seen = self._look_at(process)
        self._process, self._used = process, seen.used if seen else 0.0

    def wait(self, channel: socket.socket, writing: bool = False) -> None:
        """Wait until a channel can be read, or written.

        Raises
        ------
        TooLate
        """
        poll = select.poll()
        poll.register(channel, select.POLLOUT if writing else select.POLLIN)
        while True:
            since = self._clock()
            ready = bool(poll.poll(LOOK * 1000))
            # more than that, and the grader itself was kept from running
            span = min(self._clock() - since, 2 * LOOK)
            self._pending += span
            if not ready or self._pending >= LOOK:
                passed, self._pending = self._pending, 0.0
                self.charge(passed, 0.0 if ready else span, lambda: bool(poll.poll(0)))
            if ready:
                return

    def answered(self, seconds: float) -> None:
        """Count time that the grader has computed for the worker: not charged, only capped [s].

        Raises
        ------
        TooLate
            If that has become far too much.
        """
        self._passed += seconds
        self._end()

    def charge(self, passed: float, silent: float, ready: Callable[[], bool] = lambda: False) -> None:
        """Charge what the worker has had of the time that has passed since the last charge [s].

        Parameters
        ----------
        passed : float
            That time.
        silent : float
            Its last part, in which nothing came. Who has sent something sleeps until we answer.
        ready : callable, optional
            Whether something has come since.

        Raises
        ------
        TooLate
            If nothing is left.
        """
        self._passed += passed
        seen = self._look_at(self._process) if self._process is not None else None
        if seen is None:
            self._charged += passed
        else:
            computed, self._used = max(seen.used - self._used, 0.0), max(seen.used, self._used)
            asleep = 0.0 if seen.busy or ready() else silent
            self._charged += max(computed, asleep)
        self._end()

    def _end(self) -> None:
        if self._charged > self._seconds or self._passed > CAP * self._seconds:
            raise TooLate


def sight(process: int) -> Sight | None:
    """What a process has used, its own children that have ended included, and whether one of its threads would run.

    None where there is no `/proc` that tells.
    """
    try:
        fields = _fields(f"/proc/{process}/stat")
        used = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
        busy = fields[0] in _BUSY or any(
            _fields(f"/proc/{process}/task/{thread}/stat")[0] in _BUSY
            for thread in os.listdir(f"/proc/{process}/task")
        )
    except (OSError, ValueError, IndexError):
        return None
    return Sight(used, busy)


#: Runs or would run; waits for the disk.
_BUSY = (b"R", b"D")


def _fields(path: str) -> list[bytes]:
    """Fields of a stat file of proc(5), from the state on: the name before it may hold anything."""
    return Path(path).read_bytes().rpartition(b")")[2].split()
