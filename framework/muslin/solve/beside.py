"""A thread that does one thing beside another, without the cost of making it."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable


class Helper:
    """One thread that does one task at a time."""

    def __init__(self) -> None:
        self.free = threading.Lock()
        self._go, self._done = threading.Lock(), threading.Lock()
        self._go.acquire()  # taken until there is something to do
        self._task: Callable[[], None] = lambda: None
        self._busy = False
        self._error: BaseException | None = None
        threading.Thread(target=self._work, daemon=True).start()

    def _work(self) -> None:
        while True:
            self._go.acquire()
            done = self._done
            try:
                self._task()
            except BaseException as error:
                self._error = error
            self._busy = False
            done.release()

    def start(self, task: Callable[[], None]) -> None:
        """Begin a task."""
        while self._busy:  # Ctrl-C has ended the wait for the last one, which goes on to its end all the same
            time.sleep(1e-4)
        self._task, self._error, self._busy = task, None, True
        self._done = threading.Lock()
        self._done.acquire()
        self._go.release()

    def wait(self) -> None:
        """Wait for it; what it raised is raised here."""
        self._done.acquire()
        if self._error is not None:
            raise self._error


@functools.cache
def helper(process: int) -> Helper:
    """The process's one helper (threads do not survive a fork)."""
    return Helper()
