"""The grader's side of the sandbox: start a nursery, ask workers, kill them on time.

Three levels, the strongest that the system can give is taken:

- ``namespace`` file system with nothing but Python and Muslin (read-only), no network, a process space per
  worker. Needs root with its rights, or user namespaces.
- ``uid`` a user of its own for every worker (root without namespaces, as on Gradescope).
- ``process`` a plain child: crashes, hangs and floods are dealt with, but what this user can read, the
  submission can read.
"""

from __future__ import annotations

import importlib.util
import json
import os
import random
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base import engine, paths, scratch
from muslin.base.errors import MuslinError
from muslin.grading import wire
from muslin.grading.patience import Patience
from muslin.grading.record import Safety

LEVELS = ("namespace", "uid", "process")

#: What a submission may print per worker before the rest is dropped [bytes].
LONGEST_OUTPUT = 20_000
#: What it may say of an error [characters].
LONGEST_TEXT = 4_000
#: How long the nursery and a worker may take to start, on the slowest machine [s].
STARTING = 180.0

#: Users of the uid level, and of namespaces made by root: nobody's, a block for each grading.
_FIRST_USER, _LAST_USER, _USERS = 61_200, 65_000, 60

#: Whether the kernel's filters are used; tests switch them off, to be on an older system.
FILTERS = True


class Crashed(Exception):
    """The worker has ended: `status` is its exit code, or minus the signal that killed it."""

    def __init__(self, status: int):
        super().__init__(status)
        self.status = status


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
        """Have a nursery fork the process, and wait until it is ready."""
        ours, theirs = socket.socketpair()
        reads, writes = os.pipe()
        self.status: int | None = None
        self._channel = ours
        self._reader = threading.Thread(target=self._listen, args=(reads,), daemon=True)
        self._reader.start()
        try:
            self._nursery, self._number, self._process = self._sandbox.spawn(
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
            why = self._nursery.last_error()
            self.close()
            why = self.printed().strip() or why
            raise _NotGiven(f"a worker did not start. {why}".strip()) from None

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
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        """Send a request and wait for its answer.

        If its nursery ends, which takes all workers along, who did it cannot be said. The request is made
        once more, to a worker with a nursery of its own.

        Parameters
        ----------
        request : dict
        arrays : dict of ndarray
        patience : Patience
            What the answer may still take.
        expected : dict of (type, shape), optional
            The arrays that must come; without it any may.

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
            return self._ask(request, arrays, patience, expected)
        except _Orphaned:
            pass
        try:
            self._begin()
            if self._load is not None and request["do"] != "load":
                self._ask(*self._load, Patience(STARTING), {})
            return self._ask(request, arrays, patience, expected)
        except (_Orphaned, _NotGiven):
            raise Crashed(-signal.SIGKILL) from None

    def _ask(
        self,
        request: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
        patience: Patience,
        expected: Mapping[str, wire.Form] | None,
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        nonce = secrets.token_hex(8)
        patience.watch(self._process)
        self._signal(signal.SIGCONT)
        try:
            wire.send(self._channel, {**request, "id": nonce}, arrays, patience)
            header, results = wire.receive(self._channel, patience, expected)
            if header.get("id") != nonce:
                raise wire.Garbled("an answer to no question")
            return _shortened(header), results
        except wire.Gone:
            self.close()
            if self.status is None or self._nursery.ended:
                raise _Orphaned from None
            raise Crashed(self.status) from None
        except (wire.TooLate, wire.Garbled):
            self.close()
            raise
        finally:
            self._signal(signal.SIGSTOP)

    def _signal(self, number: int) -> None:
        """Send it a signal, if nobody has waited for it yet: until then its number is its own."""
        if self.status is None and not self._nursery.ended:
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
        return text

    def close(self) -> None:
        """Kill it and everything it has started."""
        if self.status is None:
            self.status = self._nursery.end(self._number)
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
        self._nurseries: list[_Nursery] = []
        self._closed = self._one_has_ended = False

    def __enter__(self) -> Sandbox:
        reasons: list[str] = []
        for level in LEVELS if self.asked == "auto" else (self.asked,):
            self.level = level
            try:
                self.safety = self._measured(level, reasons)
                break
            except (OSError, _NotGiven) as error:
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

    def spawn(self, wish: Mapping[str, Any], channel: int, printed: int) -> tuple[_Nursery, int, int]:
        """Have a nursery fork a worker; all share one, until one has ended of itself.

        The nursery, and the worker's number there and in the system.
        """
        with self._lock:
            if self._closed:
                raise _NotGiven("grading has been stopped")
            for nursery in list(self._nurseries):
                if nursery.ended:
                    nursery.stop()
                    self._nurseries.remove(nursery)
                    self._one_has_ended = True
            if not self._nurseries or self._one_has_ended:
                package = paths.PACKAGE
                self._nurseries.append(_Nursery(self.level, [*self._secrets, *_answers(package)]))
            self._count += 1
            nursery, number = self._nurseries[-1], self._count
        try:
            answer = nursery.request({**wish, "spawn": number}, (channel, printed))
        except (OSError, ValueError) as error:
            raise _NotGiven(f"no worker could be started ({error})") from None
        return nursery, number, int(answer["spawned"])

    def _stop(self) -> None:
        for nursery in self._nurseries:
            nursery.stop()
        self._nurseries.clear()


class _Nursery:
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
            raise _NotGiven("only root can change to another user")
        package = paths.PACKAGE
        libraries = _libraries()
        view = _view(package, libraries)
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
            "hidden": [str(part) for path in hidden for part in _hideable(path, [*map(Path, view)])],
        }
        self._control, theirs = socket.socketpair()
        self._control.settimeout(STARTING)
        code = (
            f"import sys; sys.path.insert(0, {str(package.parent)!r}); "
            f"from muslin.grading.worker import nursery; nursery({theirs.fileno()})"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-B", "-c", code],
            env=_ENVIRONMENT
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
        """Ask the nursery; what it answers."""
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
                    raise _NotGiven(self.last_error())
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
        except (OSError, ValueError, _NotGiven):
            self.stop()  # it was killed, or hangs
            return -signal.SIGKILL

    def last_error(self) -> str:
        """The last line it has complained with."""
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


class _NotGiven(MuslinError):
    """The system does not give what a level needs."""


class _Orphaned(Exception):
    """The worker has ended because its nursery has."""


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
    raise _NotGiven("too many gradings run at once")


#: The whole environment of nursery and workers: nothing of the grader's own.
_ENVIRONMENT = {
    "PATH": "/usr/bin:/bin",
    "LANG": "C.UTF-8",
    "PYTHONDONTWRITEBYTECODE": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MUSLIN_THREADS": "1",
}


def _libraries() -> list[str]:
    """Folders the packages that workers import lie in."""
    found = (importlib.util.find_spec(name) for name in ("numpy", "scipy", engine.chosen().name, "tomli"))
    origins = {Path(spec.origin).resolve().parent.parent for spec in found if spec and spec.origin}
    return sorted(map(str, origins))


def _view(package: Path, libraries: Sequence[str]) -> list[str]:
    """What a worker needs to see: the system's libraries, this Python, this package."""
    system = ("/usr", "/lib", "/lib64", "/bin", "/etc/ld.so.cache", "/etc/ld.so.conf", "/etc/ld.so.conf.d")
    return sorted({*system, sys.prefix, sys.base_prefix, str(package), *libraries})


def _hideable(secret: Path, view: Sequence[Path]) -> Iterator[Path]:
    """What there is to hide of a folder: not Python or Muslin, should they lie in it."""
    real = [path.resolve() for path in view]
    if secret in real:
        return
    if not any(path.is_relative_to(secret) for path in real):
        yield secret
        return
    for part in sorted(secret.iterdir()):
        if any(part.is_relative_to(path) or path.is_relative_to(part) for path in real):
            yield from _hideable(part, view)


def _answers(package: Path) -> list[Path]:
    """Where answers can be read off or computed: what assignments say of themselves, and the code that makes data."""
    return [*paths.secrets(), package / "authoring", package / "judging"]
