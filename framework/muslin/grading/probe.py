"""What holds a worker in, measured: a first worker tries each defence as a submission would, and tells.

Nothing is claimed in a record that was not tried here, on this machine, with this user's rights. What is tried is
harmless where the defence fails.
"""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import signal
import socket
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Callable

from muslin.grading import filters, isolation

#: How long a process that nobody kills is there [s].
LEFT_OVER = 15.0


def leave_a_process() -> None:
    """Start a process as one does that wants to outlive its worker; it holds what the worker prints to."""
    if os.fork():
        return
    with contextlib.suppress(OSError):
        os.setsid()
    for ignored in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(ignored, signal.SIG_IGN)
    isolation.keep_open((1,))
    time.sleep(LEFT_OVER)
    os._exit(0)


def measure(channel: socket.socket, home: str, grader: str) -> dict[str, bool]:
    """Which defences hold, by name.

    Parameters
    ----------
    channel : socket
        The worker's, to the grader.
    home : str
        The folder it may write to.
    grader : str
        Name of an abstract socket the grader listens on.
    """
    return {
        "memory limit": _memory(),
        "file size limit": _refused(lambda: _file_of(home, isolation.FILE + 1)),
        "own disk": _own_disk(home),
        "own process space": os.getpid() == 1,
        "no other processes or programs": _refused(_fork, _execute),
        "no signals to others": _signals(channel),
        "no network": _network(grader),
        "nothing shared between workers": _refused(*_ways_between()),
        "process and thread limit": _threads(),  # the last: it ends with refusing them
    }


def _refused(*attempts: Callable[[], object]) -> bool:
    """Whether all of these fail; those that this system has never heard of do."""
    for attempt in attempts:
        try:
            attempt()
        except (OSError, MemoryError, AttributeError, ImportError):
            continue
        return False
    return True


def _memory() -> bool:
    return _refused(
        lambda: mmap.mmap(-1, isolation.MEMORY),
        lambda: os.close(os.memfd_create("muslin-probe")),
        lambda: tempfile.NamedTemporaryFile(dir="/dev/shm", prefix="muslin-probe-").close(),
    )


def _file_of(home: str, size: int) -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    with tempfile.TemporaryFile(dir=home) as stream:
        os.ftruncate(stream.fileno(), size)


def _own_disk(home: str) -> bool:
    disk = os.statvfs(home)
    return 0 < disk.f_files <= isolation.FILES and disk.f_blocks * disk.f_frsize <= isolation.DISK


def _fork() -> None:
    if os.fork() == 0:
        os._exit(0)
    os.wait()


def _execute() -> None:
    try:
        os.execv("/no/such/program", ["none"])
    except FileNotFoundError:
        return  # it was looked for, so one that is there would have been started


def _signals(channel: socket.socket) -> bool:
    parent = os.getppid()
    if parent == 0:
        return True  # whoever is outside has no number in here

    def owner() -> None:
        import fcntl

        set_owner = 0x8901  # FIOSETOWN
        fcntl.ioctl(channel.fileno(), set_owner, struct.pack("i", parent))
        fcntl.ioctl(channel.fileno(), set_owner, struct.pack("i", 0))

    return _refused(lambda: os.kill(parent, 0), owner)


def _network(grader: str) -> bool:
    def datagram() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
            opened.connect(("127.0.0.1", 9))  # sends nothing

    def connected() -> None:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as opened:
            opened.connect(f"\0{grader}")

    def pair() -> None:
        one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        with one, other:
            one.sendto(b"probe", f"\0{grader}")

    return _refused(datagram, connected, pair)


def _ways_between() -> list[Callable[[], object]]:
    """What two workers could talk by: locks on files, watches on them, and what the kernel keeps under a name."""

    def lock() -> None:
        import fcntl

        with open(os.__file__, "rb") as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)

    def record_lock() -> None:
        import fcntl

        with open(os.__file__, "rb") as stream:
            fcntl.lockf(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)

    ways: list[Callable[[], object]] = [lock, record_lock]
    if sys.platform.startswith("linux"):
        ways += [
            lambda: os.close(isolation.call("inotify_init")),
            lambda: _made("shmget", ctypes.c_size_t(4096), "shmctl", 0, None),
            lambda: _made("semget", 1, "semctl", 0, 0),
            lambda: _made("msgget", None, "msgctl", 0, None),
        ]
        if os.uname().machine == "x86_64":
            add_key, of_this_process = ctypes.c_long(248), -2
            ways.append(
                lambda: isolation.call("syscall", add_key, b"user", b"muslin", b"-", 1, of_this_process)
            )
    return ways


def _made(get: str, size: object, control: str, *remove: object) -> None:
    """Make what is shared by number, and remove it."""
    sizes = () if size is None else (size,)
    number = isolation.call(get, 0, *sizes, 0o1600)
    isolation.call(control, number, *remove)


def _threads() -> bool:
    """Whether new threads are refused, be it at once or at a number."""
    filters.forbid_threads()
    wait, started = threading.Event(), []
    try:
        for _ in range(2 * isolation.SHARED_PROCESSES):
            thread = threading.Thread(target=wait.wait, daemon=True)
            thread.start()
            started.append(thread)
    except RuntimeError:
        return True
    finally:
        wait.set()
        for thread in started:
            thread.join()
    return False
