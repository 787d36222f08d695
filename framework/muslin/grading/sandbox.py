"""The grader's side of the sandbox: start a nursery, ask workers, kill them on time.

Three levels, the strongest that the system can give is taken:

- ``namespace`` file system with nothing but Python and Muslin (read-only), no network, a process space per
  worker. Needs root with its rights, or user namespaces.
- ``uid`` a user of its own for every worker (root without namespaces, as on Gradescope).
- ``process`` a plain child: crashes, hangs and floods are dealt with, but what this user can read, the
  submission can read.
"""

from __future__ import annotations

import json
import os
import random
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import muslin
from muslin import paths
from muslin.errors import MuslinError
from muslin.grading import wire
from muslin.grading.record import Safety

LEVELS = ("namespace", "uid", "process")

#: What a submission may print per worker before the rest is dropped [bytes].
LONGEST_OUTPUT = 20_000
#: How long the nursery and a worker may take to start, on the slowest machine [s].
STARTING = 60.0

#: Users of the uid level, and of namespaces made by root: nobody's, a worker each.
_FIRST_USER, _USERS = 61_200, 3_000

_DEFENCES = {
    "deadlines from outside": LEVELS,
    "memory and file size limits": LEVELS,
    "left-over processes killed": LEVELS,
    "process limit": ("namespace", "uid"),
    "own user": ("namespace", "uid"),
    "own process space": ("namespace",),
    "solution and hidden data out of sight": ("namespace",),
    "no network": ("namespace",),
}


class Crashed(Exception):
    """The worker has ended: `status` is its exit code, or minus the signal that killed it."""

    def __init__(self, status: int):
        super().__init__(status)
        self.status = status


class Worker:
    """One process with one part of a submission. Ask it; it answers with plain data and raw arrays."""

    def __init__(self, sandbox: Sandbox, number: int, channel: socket.socket, printed: int):
        self._sandbox, self._number, self._channel = sandbox, number, channel
        self._output = bytearray()
        self._seen = 0
        self._reader = threading.Thread(target=self._listen, args=(printed,), daemon=True)
        self._reader.start()
        self.status: int | None = None

    def _listen(self, printed: int) -> None:
        with open(printed, "rb", buffering=0) as stream, suppress(OSError):
            while piece := stream.read(1 << 16):
                self._output += piece[: max(0, LONGEST_OUTPUT - len(self._output))]

    def ask(
        self, request: Mapping[str, Any], arrays: Mapping[str, np.ndarray], deadline: float
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Send a request and wait for its answer.

        Raises
        ------
        wire.TooLate
            If it has not come by `deadline` (of `time.monotonic`).
        wire.Garbled
            If something else came.
        Crashed
            If the worker has ended instead.

        After any of these the worker is dead.
        """
        nonce = secrets.token_hex(8)
        try:
            wire.send(self._channel, {**request, "id": nonce}, arrays, deadline)
            header, results = wire.receive(self._channel, deadline)
            if header.get("id") != nonce:
                raise wire.Garbled("an answer to no question")
            return header, results
        except wire.Gone:
            self.close()
            raise Crashed(self.status or 0) from None
        except (wire.TooLate, wire.Garbled):
            self.close()
            raise

    def printed(self) -> str:
        """What it has printed since the last call; escapes are the views' business."""
        deadline = time.monotonic() + 0.02  # what it wrote before answering may still be on its way
        while self.status is None and time.monotonic() < deadline:
            time.sleep(0.005)
        text = bytes(self._output[self._seen :]).decode("utf-8", "replace")
        if len(self._output) >= LONGEST_OUTPUT > self._seen:
            text += "\n(more was printed, and dropped)"
        self._seen = len(self._output)
        return text

    def close(self) -> None:
        """Kill it and everything it has started."""
        if self.status is None:
            self.status = self._sandbox.end(self._number)
            self._channel.close()
            self._reader.join(timeout=5)


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
        self._nursery: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Sandbox:
        self._scratch = tempfile.mkdtemp(prefix="muslin-grading-")
        os.chmod(self._scratch, 0o711)  # each worker's own folder inside is its own user's
        reasons = []
        for level in LEVELS if self.asked == "auto" else (self.asked,):
            try:
                self._start(level)
                self.worker().close()  # one, to see that it works
                break
            except (OSError, _NotGiven) as error:
                self._stop()
                reasons.append(f"{level}: {error}")
        else:
            shutil.rmtree(self._scratch, ignore_errors=True)
            raise MuslinError(
                f"No worker can be kept apart here ({'; '.join(reasons)}).",
                "Try --safety process, or run muslin doctor.",
            )
        self.safety = Safety(
            self.level,
            self.asked,
            {name: self.level in levels for name, levels in _DEFENCES.items()},
            tuple(f"Not available here: {reason}" for reason in reasons),
        )
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()
        shutil.rmtree(self._scratch, ignore_errors=True)

    def worker(self, covered: Sequence[Path] = (), debug: bool = False) -> Worker:
        """Start a worker; folders `covered` are out of its sight (level namespace)."""
        ours, theirs = socket.socketpair()
        reads, writes = os.pipe()
        with self._lock:
            if self._nursery is None or self._nursery.poll() is not None:
                self._stop()
                self._start(self.level)
            self._count += 1
            number = self._count
            request = {"spawn": number, "covered": [str(path) for path in covered], "debug": debug}
            try:
                socket.send_fds(self._control, [json.dumps(request).encode()], [theirs.fileno(), writes])
                self._answer()
            except (OSError, ValueError) as error:
                raise _NotGiven(f"no worker could be started ({error})") from None
            finally:
                theirs.close()
                os.close(writes)
        worker = Worker(self, number, ours, reads)
        try:
            header, _ = wire.receive(ours, time.monotonic() + STARTING)
        except (wire.Gone, wire.TooLate, wire.Garbled):
            worker.close()
            raise _NotGiven(f"a worker did not start. {worker.printed().strip()}".strip()) from None
        assert header["id"] == "ready"
        return worker

    def end(self, number: int) -> int:
        """Kill a worker; how it ended."""
        with self._lock:
            try:
                self._control.sendall(json.dumps({"end": number}).encode())
                return int(self._answer()["ended"])
            except (OSError, ValueError):
                self._stop()  # the nursery was killed: its children die with it
                return -9

    # the nursery --------------------------------------------------------------------------------------------

    def _start(self, level: str) -> None:
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        if level == "uid" and not root:
            raise _NotGiven("only root can change to another user")
        package = Path(muslin.__file__).resolve().parent
        users = random.SystemRandom().randrange(_FIRST_USER, _FIRST_USER + _USERS)
        config = {
            "level": level,
            "scratch": self._scratch if level != "namespace" else tempfile.mkdtemp(dir=self._scratch),
            "user": users if root and level != "process" else None,
            "view": _view(package),
            "hidden": [str(path) for path in [*self._secrets, *_answers(package)]],
        }
        ours, theirs = socket.socketpair()
        self._errors = tempfile.TemporaryFile(dir=self._scratch)  # noqa: SIM115  (closed with the nursery)
        code = (
            f"import sys; sys.path.insert(0, {str(package.parent)!r}); "
            "from muslin.grading.worker import nursery; import json; "
            f"nursery({theirs.fileno()}, json.loads({json.dumps(config)!r}))"
        )
        self._nursery = subprocess.Popen(
            [sys.executable, "-I", "-c", code],
            env=_ENVIRONMENT | {"HOME": self._scratch, "TMPDIR": self._scratch},
            cwd="/",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._errors,
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
        theirs.close()
        self._control, self.level = ours, level
        self._control.settimeout(STARTING)
        self._answer()

    def _answer(self) -> dict[str, Any]:
        data = b""
        while not data.endswith(b"\n"):
            piece = self._control.recv(4096)
            if not piece:
                raise _NotGiven(self._last_error())
            data += piece
        return dict(json.loads(data))

    def _last_error(self) -> str:
        with suppress(OSError, ValueError, IndexError):
            self._errors.seek(0)
            return self._errors.read().decode(errors="replace").strip().splitlines()[-1][:300]
        return "it ended"

    def _stop(self) -> None:
        if self._nursery is not None:
            with suppress(OSError):
                self._control.close()
            try:
                self._nursery.wait(timeout=5)
            except subprocess.TimeoutExpired:
                self._nursery.kill()
                self._nursery.wait()
            self._nursery = None


class _NotGiven(MuslinError):
    """The system does not give what a level needs."""


#: The whole environment of nursery and workers: nothing of the grader's own.
_ENVIRONMENT = {
    "PATH": "/usr/bin:/bin",
    "LANG": "C.UTF-8",
    "ENABLE_TAICHI_HEADER_PRINT": "0",
    "PYTHONDONTWRITEBYTECODE": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MUSLIN_THREADS": "1",
}


def _view(package: Path) -> list[str]:
    """What a worker needs to see: the system's libraries, this Python, this package."""
    system = ("/usr", "/lib", "/lib64", "/bin", "/etc/ld.so.cache", "/etc/ld.so.conf", "/etc/ld.so.conf.d")
    libraries = {str(Path(module.__file__).resolve().parent.parent) for module in (np,) if module.__file__}
    return sorted({*system, sys.prefix, sys.base_prefix, str(package), *libraries})


def _answers(package: Path) -> list[Path]:
    """Where answers can be read off or computed: solutions, reference data, the code that makes them."""
    return [
        paths.root() / "solutions",
        paths.root() / "data" / "reference",
        paths.root() / "tests",
        package / "authoring",
        *(package / "grading" / f"{name}.py" for name in ("diagnosis", "properties", "checks")),
    ]
