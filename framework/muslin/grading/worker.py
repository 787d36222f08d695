"""The other side of the sandbox: the fork server that forks workers, and the workers that run a submission.

The grader starts one fork server per submission, `python -I` with an empty environment. It encloses itself, imports
Taichi once, and forks a worker for every task file it is asked for. A worker receives the bytes of its files and
input arrays, and answers with raw arrays; neither process is ever sent an expected value. The fork server runs no
student code.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import select
import signal
import socket
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.base import engine, paths, scratch
from muslin.grading import filters, isolation, probe

#: How often the homes that lie on a shared disk are looked at [s].
WATCHED = 0.5

#: Longest error text a worker sends [characters].
LONGEST_MESSAGE = 4000


def fork_server(control_number: int) -> None:
    """Serve the grader until it closes the control channel, or ends.

    The first line on the channel is the configuration. Requests are JSON lines: {"spawn": n} with two
    descriptors, a channel and a pipe for what is printed, and {"end": n}, which kills worker n with all it has
    started and answers how it ended.
    """
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    isolation.die_with_parent(signal.SIGTERM)
    isolation.adopt_orphans()
    control = socket.socket(fileno=control_number)
    config = json.loads(_line(control))
    workers: dict[int, _Child] = {}
    above = os.open(os.path.dirname(config["scratch"]), os.O_RDONLY)  # to be reached from another root, too
    try:
        own_users = False
        taken = isolation.threads_of(os.getuid())
        if config["level"] == "namespace":
            own_users = isolation.enclose(config["view"], config["hidden"], config["scratch"])
        sys.path += [path for path in config["libraries"] if path not in sys.path]
        _import_everything()
        spare = _spare()
        control.sendall(b'{"ready": true}\n')
        while True:
            if config["level"] != "namespace":
                _watch(control, workers)
            data, descriptors, _, _ = socket.recv_fds(control, 1 << 16, 2)
            if not data:
                break
            request = json.loads(data)
            if "spawn" in request:
                request["covered"] = spare if request["bare"] else []
                child = workers[request["spawn"]] = _spawn(request, config, descriptors, taken, own_users)
                control.sendall(json.dumps({"spawned": child.pid}).encode() + b"\n")
            else:
                child = workers.pop(request["end"])
                status = _end(child, config["level"], [other.pid for other in workers.values()])
                control.sendall(json.dumps({"ended": status}).encode() + b"\n")
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        for number in list(workers):
            with contextlib.suppress(OSError):
                _end(workers.pop(number), config["level"], [other.pid for other in workers.values()])
        isolation.kill_orphans(spared=())
        if config["level"] != "namespace":
            scratch.remove(config["scratch"])
        with contextlib.suppress(OSError):
            os.rmdir(os.path.basename(config["scratch"]), dir_fd=above)


@dataclass(frozen=True)
class _Child:
    """A worker as its fork server knows it; `user` if it has one of its own, `home` if that is to be removed."""

    pid: int
    user: int | None
    home: str


def _line(control: socket.socket) -> bytes:
    data = b""
    while not data.endswith(b"\n"):
        piece = control.recv(1 << 16)
        if not piece:
            sys.exit()
        data += piece
    return data


def _watch(control: socket.socket, workers: dict[int, _Child]) -> None:
    """Wait for a request; meanwhile, kill workers that fill the disk."""
    while not select.select([control], [], [], WATCHED if workers else None)[0]:
        for child in workers.values():
            if isolation.overflows(child.home):
                with contextlib.suppress(OSError):
                    os.kill(child.pid, signal.SIGKILL)


def _spawn(
    request: dict[str, Any], config: dict[str, Any], descriptors: list[int], taken: int, own_users: bool
) -> _Child:
    """Fork a worker."""
    level = config["level"]
    user = config["user"] + request["spawn"] % config["users"] if config["user"] is not None else None
    home = isolation.HOME if level == "namespace" else tempfile.mkdtemp(dir=config["scratch"])
    if user is not None and level == "uid":
        os.chown(home, user, user)
    pid = isolation.fork_into_new_processes() if level == "namespace" else os.fork()
    if pid == 0:
        try:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            channel, printed = descriptors
            os.setsid()
            if level == "namespace":
                isolation.furnish(request["covered"], own_users)
            isolation.confine(user, isolation.PROCESSES if user else isolation.SHARED_PROCESSES + taken)
            _worker(channel, printed, home, request, config)
        except BaseException as error:
            os.write(2, f"{type(error).__name__}: {error}\n".encode())
        finally:
            os._exit(0)
    for descriptor in descriptors:
        os.close(descriptor)
    return _Child(pid, user if level == "uid" else None, home)


def _end(child: _Child, level: str, others: list[int]) -> int:
    """Kill a worker with all it has started, and remove its home; how it ended."""
    with contextlib.suppress(OSError):
        if level != "namespace":
            os.killpg(child.pid, signal.SIGKILL)
    with contextlib.suppress(OSError):
        os.kill(child.pid, signal.SIGKILL)
    _, status = os.waitpid(child.pid, 0)
    if child.user is not None:
        isolation.empty_user(child.user)
    isolation.kill_orphans(spared=others)
    if level != "namespace":
        scratch.remove(child.home)
    return os.waitstatus_to_exitcode(status)


def _import_everything() -> None:
    """All a worker needs before student code, so that forking is all it costs; not the native element."""
    engine.load()
    import muslin.given
    import muslin.grading.calls
    import muslin.grading.wire
    import muslin.reading
    import muslin.tasks.batch  # noqa: F401


def _spare() -> list[str]:
    """All of Muslin's package that has not been imported here.

    A worker that is to call one function needs none of it, and much of it computes what a task asks for.
    """
    known = [module for name, module in sys.modules.items() if name.partition(".")[0] == "muslin"]
    needed = {os.path.realpath(module.__file__) for module in known if module.__file__}
    spare, folders = [], [str(paths.PACKAGE)]
    while folders:
        for entry in os.scandir(folders.pop()):
            if entry.is_dir() and any(path.startswith(f"{entry.path}/") for path in needed):
                folders.append(entry.path)
            elif entry.path not in needed:
                spare.append(entry.path)
    return spare


def _worker(
    channel_number: int, printed: int, home: str, request: dict[str, Any], config: dict[str, Any]
) -> None:
    """Become the worker: its own home and environment, everything it prints into the pipe; then serve."""
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(printed, 1)
    os.dup2(printed, 2)
    isolation.keep_open((0, 1, 2, channel_number))
    channel = socket.socket(fileno=channel_number)
    os.chdir(home)
    os.environ.update(
        HOME=home, TMPDIR=home, **{engine.chosen().variable("OFFLINE_CACHE_FILE_PATH"): f"{home}/kernels"}
    )
    tempfile.tempdir = home
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if listener := request.get("probe"):
        probe.leave_a_process()
    about: dict[str, Any] = {}
    if config["filters"]:
        if config["level"] == "namespace":
            filters.keep_to_itself()
        else:
            filters.keep_to(config["view"], [*config["hidden"], *request["covered"]], home)
        filters.forbid()
    if listener:
        about["holds"] = probe.measure(channel, home, listener)
        about["user"] = os.getuid()
        about["exposed"] = [path for path in config["hidden"] if _can_read(path)]
    if request["bare"]:
        sys.meta_path.insert(0, _NotHere)
    bounded = config["filters"]
    config.clear()
    serve(channel, Path(home), bool(request.get("debug")), about, bounded)


class _NotHere:
    """Says of what a bare worker does not see that it is not there, instead of how it is hidden."""

    @staticmethod
    def find_spec(name: str, *_: Any) -> None:
        if name.startswith("muslin."):
            told = f"{name} is not there where a function is graded: take the import out"
            raise ModuleNotFoundError(told, name=name)


def _can_read(path: str) -> bool:
    """Whether anything in a file or folder can be read by this process."""
    try:
        if not os.path.isdir(path):
            with open(path, "rb") as stream:
                return bool(stream.read(1))
        return any(_can_read(entry.path) for entry in os.scandir(path))
    except OSError:
        return False


def serve(
    channel: socket.socket, home: Path, debug: bool, about: dict[str, Any], bounded: bool = True
) -> None:
    """Say what it is `about`, then answer requests until the grader closes the channel.

    "load" takes the manifest and the task files as bytes and tells what is wrong with each task's function;
    "evaluate" takes a task and its inputs, and asks back what the functions it is given make of their arguments;
    "simulate" is `muslin.grading.measuring.measure`; "kernels" ends Taichi and gives what it has compiled, for the
    next grading of the same submission.
    """
    import numpy as np

    from muslin import tasks
    from muslin.base.errors import MuslinError, NotImplementedYet, said
    from muslin.grading import calls, wire
    from muslin.tasks import batch, plain

    os.listdir(Path(os.__file__).parent)  # a user who may not read Python cannot run anything
    wire.send(channel, {"id": "ready", **about})
    functions: tasks.Functions | None = None
    kernels = home / "kernels"
    while True:
        try:
            header, arrays = wire.receive(channel)
        except wire.Gone:
            return
        reply: dict[str, Any] = {"id": header["id"]}
        results: dict[str, Any] = {}
        try:
            if header["do"] == "load":
                kernels.mkdir(exist_ok=True)
                for name, data in arrays.items():
                    (home / name).parent.mkdir(parents=True, exist_ok=True)
                    (home / name).write_bytes(data.tobytes())
                table = tasks.read_assignment(home)
                reset = _start(debug)
                if bounded:
                    filters.forbid_threads()
                functions = tasks.load(home, table)
                failures = {
                    task: _failure(tasks.failure_of(functions[task]))
                    for task in table.tasks
                    if tasks.failure_of(functions[task])
                }
                reply["failures"] = failures
            elif header["do"] == "evaluate":
                assert functions is not None
                task, function = table.tasks[header["task"]], functions[header["task"]]
                if task.builder:
                    given = calls.stand_ins(channel, header["id"], task)
                    got = plain.evaluate(tasks.usable(function), task, arrays, given)
                else:
                    arguments: dict[str, Any] = dict(arrays)
                    got = batch.evaluate(function, **arguments)
                got = got if isinstance(got, tuple) else (got,)
                results = {str(k): array for k, array in enumerate(got)}
            elif header["do"] == "kernels":
                reset()
                results = {
                    path.relative_to(home).as_posix(): np.frombuffer(path.read_bytes(), dtype=np.uint8)
                    for path in sorted(kernels.rglob("*"))
                    if path.is_file()  # Quadrants keeps them in a folder of its own
                }
            else:
                from muslin.grading import measuring

                assert functions is not None
                results = measuring.measure(functions, header["stand_ins"])
        except NotImplementedYet as error:
            reply["error"] = ["stub", str(error)]
        except MuslinError as error:
            reply["error"] = ["code", str(error)[:LONGEST_MESSAGE]]
        except BaseException as error:
            reply["error"] = ["python", said(error)[:LONGEST_MESSAGE]]
        _flush()
        wire.send(channel, reply, results)


def _failure(error: Any) -> list[str]:
    from muslin.base.errors import NotImplementedYet

    kind = "stub" if isinstance(error, NotImplementedYet) else "code"
    return [kind, str(error)[:LONGEST_MESSAGE]]


def _start(debug: bool) -> Callable[[], None]:
    """Start Taichi as grading pins it, and keep student code from starting it again; returns what ends it."""
    from muslin.base import runtime
    from muslin.base.errors import StudentCodeError

    ti: Any = runtime.start(threads=1, debug=debug)

    def forbidden(*_: Any, **__: Any) -> None:
        raise StudentCodeError("ti.init or ti.reset is called.", "Muslin starts Taichi itself: take it out.")

    reset: Callable[[], None] = ti.reset
    ti.init = ti.reset = forbidden
    return reset


def _flush() -> None:
    """What has been printed so far belongs to the request it was printed in."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    with contextlib.suppress(Exception):
        ctypes.CDLL(None).fflush(None)
