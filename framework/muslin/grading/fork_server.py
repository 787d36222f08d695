"""The process that forks workers, seen from the grader: started without anything of its own, asked, and ended."""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from muslin.base import engine, paths, scratch
from muslin.base.errors import MuslinError
from muslin.grading import hiding

#: How long the fork server and a worker may take to start, on the slowest machine [s].
STARTING = 180.0

#: Users of the uid level, and of namespaces made by root: nobody's, a block for each grading.
_FIRST_USER, _LAST_USER, _USERS = 61_200, 65_000, 60

#: Whether the kernel's filters are used; tests switch them off, to be on an older system.
FILTERS = True


class ForkServer:
    """The process that forks workers, and the channel to it.

    Parameters
    ----------
    level : str
    hidden : sequence of Path
        What no worker may read.
    """

    def __init__(self, level: str, hidden: Sequence[Path]):
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        if level == "uid" and not root:
            raise NotGiven("only root can change to another user")
        package = paths.PACKAGE
        libraries = hiding.libraries()
        view = hiding.view(package, libraries)
        self._lock = threading.Lock()
        self._users = _claim_users() if root and level != "process" else None
        self._folder = scratch.Scratch(scratch.GRADING)
        self._scratch = self._folder.path
        os.chmod(self._scratch, 0o711)  # each worker's own folder inside is its own user's
        self._errors = tempfile.TemporaryFile(dir=self._scratch)  # noqa: SIM115
        config = {
            "level": level,
            "scratch": self._scratch,
            "user": self._users[0] if self._users else None,
            "users": _USERS,
            "view": view,
            "libraries": libraries,
            "filters": FILTERS,
            "hidden": [str(part) for path in hidden for part in hiding.hideable(path, [*map(Path, view)])],
        }
        self._control, theirs = socket.socketpair()
        self._control.settimeout(STARTING)
        code = (
            f"import sys; sys.path.insert(0, {str(package.parent)!r}); "
            f"from muslin.grading.worker import fork_server; fork_server({theirs.fileno()})"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-B", "-c", code],
            env=ENVIRONMENT
            | {"HOME": self._scratch, "TMPDIR": self._scratch, engine.VARIABLE: engine.chosen().name},
            cwd="/",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._errors,
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
        theirs.close()
        try:
            self.request(config)
        except BaseException:
            self.stop()
            raise
        if level == "namespace":  # it has a root of its own by now, and if we were killed this would stay
            self._folder.close()

    def request(self, what: Mapping[str, Any], descriptors: Sequence[int] = ()) -> dict[str, Any]:
        """Ask the fork server; what it answers."""
        line = json.dumps(what).encode() + b"\n"
        with self._lock:
            if descriptors:
                socket.send_fds(self._control, [line], descriptors)
            else:
                self._control.sendall(line)
            data = b""
            while not data.endswith(b"\n"):
                piece = self._control.recv(4096)
                if not piece:
                    raise NotGiven(self.last_error())
                data += piece
        return dict(json.loads(data))

    @property
    def ended(self) -> bool:
        """Whether it has ended, and all its workers with it."""
        return self._process.poll() is not None

    def end(self, number: int) -> int:
        """Kill a worker; how it ended."""
        try:
            return int(self.request({"end": number})["ended"])
        except (OSError, ValueError, NotGiven):
            self.stop()  # it was killed, or hangs
            return -signal.SIGKILL

    def last_error(self) -> str:
        """The last line of its errors."""
        with suppress(OSError, ValueError, IndexError):
            self._errors.seek(0)
            return self._errors.read().decode(errors="replace").strip().splitlines()[-1][:300]
        return "it ended"

    def stop(self) -> None:
        """End it, its workers and what they have left behind."""
        with suppress(OSError):
            self._control.close()
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._errors.close()
        if self._users:
            self._users[1].close()
        self._folder.close()


class NotGiven(MuslinError):
    """The system does not give what a level needs."""


def _claim_users() -> tuple[int, socket.socket]:
    """The first of a block of users that no other grading has now; ours until the socket is closed."""
    blocks = list(range(_FIRST_USER, _LAST_USER, _USERS))
    random.SystemRandom().shuffle(blocks)
    for first in blocks:
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f"\0muslin-grading-users-{first}")
            return first, claim
        except OSError:
            claim.close()
    raise NotGiven("too many gradings run at once")


#: The whole environment of fork server and workers: nothing of the grader's own.
ENVIRONMENT = {
    "PATH": "/usr/bin:/bin",
    "LANG": "C.UTF-8",
    "PYTHONDONTWRITEBYTECODE": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MUSLIN_THREADS": "1",
}
