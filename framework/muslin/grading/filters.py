"""What the kernel refuses a worker: system calls that no formula needs (seccomp), files and signals (landlock).

Both are given up for good, by the worker itself, before any student code, and need no rights. There is no library
for this that comes as a wheel; the calls are those of seccomp(2) and landlock(7).
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import struct
import sys
from collections.abc import Iterable, Iterator

from muslin.grading.isolation import call, outermost

# system calls -----------------------------------------------------------------------------------------------

#: System calls of x86-64 (Taichi has no other Linux) that Python, NumPy, SciPy, Taichi and LLVM need to compute;
#: every other one is refused, those of kernels to come included. What is left out on purpose, and why:
#:
#: =============================================  ================================================================
#: fork, execve, ptrace, process_vm_*, pidfd_*    other processes and programs
#: tkill, rt_sigqueueinfo, setpriority, sched_set* signals to others, and their share of the processor
#: socket, socketpair, connect, bind, sendmsg      the network, and sockets of this machine
#: flock, inotify_*, fanotify_*, mincore, fadvise  files that others read too would carry messages to them
#: shm*, sem*, msg*, mq_*, add_key, keyctl         memory, queues and keys that are shared, and outlive us
#: memfd_*, splice, tee, vmsplice                  memory that no limit counts
#: chmod, chown, utime*, *xattr, link, truncate    what landlock, or its first versions, do not look at
#: mount, unshare, setns, chroot, open_by_handle   other file systems, and rights inside a user space
#: bpf, perf_event_open, userfaultfd, io_*         doors into the kernel
#: =============================================  ================================================================
_ALLOWED = {
    # memory
    "mmap": 9, "mprotect": 10, "munmap": 11, "brk": 12, "mremap": 25, "msync": 26, "madvise": 28, "mbind": 237,
    # files
    "read": 0, "write": 1, "pread64": 17, "pwrite64": 18, "readv": 19, "writev": 20, "preadv": 295, "pwritev": 296,
    "close": 3, "close_range": 436, "lseek": 8, "dup": 32, "dup2": 33, "dup3": 292,
    "stat": 4, "fstat": 5, "lstat": 6, "newfstatat": 262, "statx": 332, "statfs": 137, "fstatfs": 138,
    "access": 21, "faccessat": 269, "faccessat2": 439, "readlink": 89, "readlinkat": 267,
    "getdents": 78, "getdents64": 217, "getcwd": 79, "chdir": 80, "fchdir": 81, "umask": 95,
    "mkdir": 83, "mkdirat": 258, "rmdir": 84, "unlink": 87, "unlinkat": 263,
    "rename": 82, "renameat": 264, "renameat2": 316, "ftruncate": 77, "fallocate": 285,
    "fsync": 74, "fdatasync": 75, "sendfile": 40, "copy_file_range": 326,
    "pipe": 22, "pipe2": 293, "eventfd2": 290, "poll": 7, "ppoll": 271, "select": 23, "pselect6": 270,
    "epoll_create": 213, "epoll_create1": 291, "epoll_ctl": 233, "epoll_wait": 232, "epoll_pwait": 281,
    # the channel to the grader
    "recvfrom": 45, "shutdown": 48,
    # time
    "clock_gettime": 228, "clock_getres": 229, "clock_nanosleep": 230, "nanosleep": 35, "gettimeofday": 96,
    "time": 201, "times": 100, "getitimer": 36, "setitimer": 38, "alarm": 37, "pause": 34,
    # itself
    "getpid": 39, "getppid": 110, "gettid": 186, "getpgrp": 111, "getpgid": 121, "getsid": 124,
    "getuid": 102, "geteuid": 107, "getgid": 104, "getegid": 108, "getgroups": 115, "getresuid": 118,
    "getresgid": 120, "uname": 63, "sysinfo": 99, "getrusage": 98, "getrlimit": 97, "setrlimit": 160,
    "getcpu": 309, "sched_yield": 24, "sched_getaffinity": 204, "sched_getparam": 143, "sched_getscheduler": 145,
    "getpriority": 140, "getrandom": 318, "arch_prctl": 158, "seccomp": 317,
    "rt_sigaction": 13, "rt_sigprocmask": 14, "rt_sigreturn": 15, "rt_sigpending": 127, "rt_sigtimedwait": 128,
    "rt_sigsuspend": 130, "sigaltstack": 131, "wait4": 61, "waitid": 247, "restart_syscall": 219,
    "exit": 60, "exit_group": 231, "set_robust_list": 273, "get_robust_list": 274, "rseq": 334,
}  # fmt: skip

_CLONE, _SECCOMP = 56, 317

_LOAD, _AND, _JUMP_EQUAL, _JUMP_AT_LEAST, _JUMP_ANY, _RETURN = 0x20, 0x54, 0x15, 0x35, 0x45, 0x06
_ALLOW, _EPERM, _ENOSYS = 0x7FFF0000, 0x00050000 | 1, 0x00050000 | 38
_X86_64 = 0xC000003E
#: Numbers from here on are of kernels since 2019: libraries try these and take an older call on "no such call".
_NEW = 424

Step = tuple[int, int, int, int]


def _if(number: int, *steps: Step) -> list[Step]:
    """These steps for one system call; they return."""
    return [(_JUMP_EQUAL, 0, len(steps), number), *steps]


def _among(position: int, values: Iterable[int]) -> list[Step]:
    """Allow if (the low half of) an argument is one of these, else refuse."""
    steps = [_low(position)]
    for value in values:
        steps += [(_JUMP_EQUAL, 0, 1, value), (_RETURN, 0, 0, _ALLOW)]
    return [*steps, (_RETURN, 0, 0, _EPERM)]


def _low(position: int) -> Step:
    return (_LOAD, 0, 0, 16 + 8 * position)


def _high(position: int) -> Step:
    return (_LOAD, 0, 0, 20 + 8 * position)


def _by_argument(own: int) -> list[Step]:
    """The system calls whose arguments decide; `own` is this process."""
    thread, asynchronous, private = 0x10000, 0x2000, 128
    refused, allowed = (_RETURN, 0, 0, _EPERM), (_RETURN, 0, 0, _ALLOW)
    empties = 0x200  # O_TRUNC: with O_RDONLY, whoever may read a file of their own would empty it
    opened = ((_AND, 0, 0, empties | 3), (_JUMP_EQUAL, 0, 1, empties), refused, allowed)
    return [
        *_if(2, _low(1), *opened),  # open
        *_if(257, _low(2), *opened),  # openat
        *_if(_CLONE, _low(0), (_JUMP_ANY, 0, 1, thread), allowed, refused),  # threads, for Taichi to start
        *_if(62, *_among(0, [own])),  # kill
        *_if(234, *_among(0, [own])),  # tgkill
        *_if(302, *_among(0, [0, own])),  # prlimit64
        # ioctl: TCGETS, TIOCGWINSZ, FIONREAD, FIONBIO, FIOCLEX, FIONCLEX; not FIOSETOWN, FIOASYNC, SIOCSPGRP
        *_if(16, *_among(1, [0x5401, 0x5413, 0x541B, 0x5421, 0x5451, 0x5450])),
        # fcntl: F_SETFL without O_ASYNC; F_DUPFD, F_GETFD, F_SETFD, F_GETFL, F_DUPFD_CLOEXEC; no locks, no owners
        *_if(
            72, _low(1), (_JUMP_EQUAL, 0, 4, 4), _low(2), (_JUMP_ANY, 0, 1, asynchronous), refused, allowed,
            *_among(1, [0, 1, 2, 3, 1030]),
        ),
        # prctl: names of threads and mappings; not PR_SET_PDEATHSIG, PR_SCHED_CORE
        *_if(157, *_among(0, [3, 15, 16, 21, 23, 38, 39, 0x53564D41])),
        # sendto: to the other end only, never to an address
        *_if(44, _low(4), (_JUMP_EQUAL, 1, 0, 0), refused, _high(4), (_JUMP_EQUAL, 1, 0, 0), refused, allowed),
        # futex: of our own memory. Pages of a library are everybody's; to wait there is what joining a thread
        # does, to wake there would reach another process
        *_if(202, _low(1), (_JUMP_ANY, 0, 1, private), allowed, *_among(1, [0, 9, 256, 256 | 9])),
    ]  # fmt: skip


def forbid() -> bool:
    """Have the kernel refuse what no formula needs; threads are allowed still, and signals to this process itself.

    Returns
    -------
    bool
        Whether the system does it.
    """
    steps = [(_LOAD, 0, 0, 4), (_JUMP_EQUAL, 1, 0, _X86_64), (_RETURN, 0, 0, _ENOSYS)]  # no other machine's
    steps += [(_LOAD, 0, 0, 0)]
    for number in _ALLOWED.values():
        steps += [(_JUMP_EQUAL, 0, 1, number), (_RETURN, 0, 0, _ALLOW)]
    steps += _by_argument(os.getpid())
    steps += [(_JUMP_AT_LEAST, 0, 1, _NEW), (_RETURN, 0, 0, _ENOSYS), (_RETURN, 0, 0, _EPERM)]
    return _install(steps)


def forbid_threads() -> bool:
    """Have the kernel refuse new threads too, to all there are: Taichi has started its own by then.

    No limit of the system counts threads of one process, and limits of a user do not bind root.

    Returns
    -------
    bool
        Whether the system does it.
    """
    refused = (_RETURN, 0, 0, _EPERM)
    return _install(
        [(_LOAD, 0, 0, 0), *_if(_CLONE, refused), *_if(_SECCOMP, refused), (_RETURN, 0, 0, _ALLOW)]
    )


def _install(steps: list[Step]) -> bool:
    """Put a filter on every thread of this process."""
    if not sys.platform.startswith("linux") or os.uname().machine != "x86_64" or struct.calcsize("P") != 8:
        return False
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *step) for step in steps))
    program = struct.pack("HxxxxxxP", len(steps), ctypes.addressof(code))
    set_filter, all_threads = ctypes.c_ulong(1), ctypes.c_ulong(1)
    try:
        return call("syscall", ctypes.c_long(_SECCOMP), set_filter, all_threads, program) == 0
    except OSError:
        return False


# files and signals ------------------------------------------------------------------------------------------

#: Rights of landlock(7): read and list; list only; everything the first version knows.
_READ, _LIST, _ALL = 1 | 4 | 8, 8, (1 << 13) - 1
_ON_FILES = 1 | 2 | 4 | 1 << 14
_CREATE, _ADD, _RESTRICT = (ctypes.c_long(number) for number in (444, 445, 446))


def version() -> int:
    """Which version of landlock there is; 0 for none."""
    if not sys.platform.startswith("linux"):
        return 0
    try:
        return call("syscall", _CREATE, None, ctypes.c_size_t(0), 1)
    except OSError:
        return 0


def keep_to(view: Iterable[str], hidden: Iterable[str], home: str) -> bool:
    """Let this process read `view` without `hidden`, write below `home`, and open no other file.

    For levels without a file system of their own; it needs no rights, and Linux 5.13. From Linux 6.7 it opens no
    ports either, from 6.12 it reaches no abstract socket and signals no process outside.

    Returns
    -------
    bool
        Whether the system does it.
    """
    known = version()
    handled = _ALL | sum(1 << bit for bit, since in ((13, 2), (14, 3), (15, 5)) if known >= since)
    if not known:
        return False
    try:
        rules = _rules(known, handled)
    except OSError:
        return False
    allowed = [(home, handled), *((f"/dev/{name}", 2 | 4) for name in ("null", "zero", "random", "urandom"))]
    allowed += [(f"/proc/{name}", _READ) for name in (os.getpid(), "cpuinfo", "meminfo")]
    allowed += [("/sys/devices/system/cpu", _READ)]
    kept_out = {os.path.realpath(path) for path in hidden}
    for path in outermost(os.path.realpath(path) for path in view):
        allowed += _readable(path, kept_out)
    for path, rights in allowed:
        with contextlib.suppress(FileNotFoundError, PermissionError):
            target = os.open(path, os.O_PATH | os.O_CLOEXEC)
            rights &= handled if os.path.isdir(path) else _ON_FILES
            call("syscall", _ADD, rules, 1, struct.pack("=Qi", rights, target), 0)
            os.close(target)
    return _restrict(rules)


def keep_to_itself() -> bool:
    """What `keep_to` does besides files: no port, no abstract socket, no signal to a process outside."""
    known = version()
    if known < 6:
        return False
    try:
        return _restrict(_rules(known, 0))
    except OSError:
        return False


def _rules(known: int, files: int) -> int:
    """A set of rules that handles these rights to files, all of the network, and all that reaches outside."""
    handled = [files, *([3] if known >= 4 else []), *([3] if known >= 6 else [])]
    packed = struct.pack(f"{len(handled)}Q", *handled)
    return call("syscall", _CREATE, packed, ctypes.c_size_t(len(packed)), 0)


def _restrict(rules: int) -> bool:
    call("syscall", _RESTRICT, rules, 0)
    os.close(rules)
    return True


def _readable(path: str, hidden: set[str]) -> Iterator[tuple[str, int]]:
    """Files and folders that make up a path without what is hidden in it."""
    if path in hidden:
        return
    if not any(inside.startswith(path + "/") for inside in hidden) or not os.path.isdir(path):
        yield path, _READ
        return
    yield path, _LIST
    for entry in os.scandir(path):
        if not entry.is_symlink():
            yield from _readable(entry.path, hidden)
