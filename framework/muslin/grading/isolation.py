"""What the operating system does to keep a worker in: namespaces, users, limits. Elsewhere, limits only.

Runs in the worker's side only, before any student code: `enclose` once in the fork server, from which workers are
forked, `confine` in every worker. Nothing here is heavy to import. There is no library for this that comes as a
wheel; the calls are those of unshare(1), mount(8), pivot_root(8) and setpriv(1). What the kernel refuses besides is
in `filters`.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import signal
import sys
from collections.abc import Iterable
from pathlib import Path

LINUX = sys.platform.startswith("linux")

_NEWNS, _NEWUTS, _NEWIPC = 0x00020000, 0x04000000, 0x08000000
_NEWUSER, _NEWPID, _NEWNET = 0x10000000, 0x20000000, 0x40000000
_MS_RDONLY, _MS_NOSUID, _MS_NODEV, _MS_NOEXEC, _MS_REMOUNT = 1, 2, 4, 8, 32
_MS_BIND, _MS_REC, _MS_PRIVATE = 4096, 16384, 1 << 18
_MNT_DETACH = 2
_PR_SET_PDEATHSIG, _PR_CAPBSET_DROP, _PR_SET_SECUREBITS = 1, 24, 28
_PR_SET_CHILD_SUBREAPER, _PR_SET_NO_NEW_PRIVS = 36, 38
_SYS_PIVOT_ROOT = {"x86_64": 155, "aarch64": 41}
_SYS_CAPSET = {"x86_64": 126, "aarch64": 91}

#: The only folder a worker can write to.
HOME = "/submission"

#: Limits of a worker: address space, one file, open files.
MEMORY, FILE, OPEN = 4 << 30, 64 << 20, 256
#: Processes and threads of a worker's user: Taichi starts six. A user it shares may start others meanwhile.
PROCESSES, SHARED_PROCESSES = 20, 96
#: What its home may hold: bytes, and files and folders. A tmpfs takes a kilobyte of memory for an empty file.
DISK, FILES = 128 << 20, 4096

_libc = ctypes.CDLL(None, use_errno=True)


def call(name: str, *arguments: object) -> int:
    """Call a function of the C library; OSError with its name if it fails."""
    converted = [a.encode() if isinstance(a, str) else a for a in arguments]
    result = getattr(_libc, name)(*converted)
    if result < 0:
        code = ctypes.get_errno()
        raise OSError(code, f"{name}: {os.strerror(code)}")
    return int(result)


def _system_call(table: dict[str, int], *arguments: object) -> None:
    call("syscall", ctypes.c_long(table[os.uname().machine]), *arguments)


def _mount(source: str, target: str, kind: str | None, flags: int, options: str | None = None) -> None:
    call("mount", source, target, kind, ctypes.c_ulong(flags), options)


def _prctl(option: int, value: int) -> None:
    call("prctl", option, ctypes.c_ulong(value), ctypes.c_ulong(0), ctypes.c_ulong(0), ctypes.c_ulong(0))


def adopt_orphans() -> None:
    """Become the parent of every descendant whose own parent dies, so that none can get away."""
    if LINUX:
        _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def die_with_parent(by: int = signal.SIGKILL) -> None:
    """Be sent a signal when the parent dies."""
    if LINUX:
        _prctl(_PR_SET_PDEATHSIG, by)


# namespaces -------------------------------------------------------------------------------------------------


def enclose(view: Iterable[str], hidden: Iterable[str], scratch: str) -> bool:
    """Move this process to a file system that holds `view`, read-only, and no network.

    Parameters
    ----------
    view : iterable of str
        Absolute paths of files and folders that stay visible.
    hidden : iterable of str
        Files and folders inside them that must not be.
    scratch : str
        An empty folder, to build the new root on.

    Returns
    -------
    bool
        Whether the rights to do so came from a user space of its own.

    Raises
    ------
    OSError
        If the system does not allow it.
    """
    try:
        call("unshare", _NEWNS | _NEWNET | _NEWIPC | _NEWUTS)
        own_users = False
    except OSError:
        _new_users(_NEWNS | _NEWNET | _NEWIPC | _NEWUTS)
        own_users = True
    _mount("none", "/", None, _MS_REC | _MS_PRIVATE)
    _mount("muslin", scratch, "tmpfs", _MS_NOSUID | _MS_NODEV, "size=16m,mode=755")
    for path in outermost(view):
        _show(scratch, path)
    for device in ("null", "zero", "random", "urandom"):
        _show(scratch, f"/dev/{device}", read_only=False)
    for path in hidden:
        hide(scratch + path)
    for folder in (HOME, "/proc", "/old"):
        os.makedirs(scratch + folder, exist_ok=True)
    if not os.path.lexists(f"{scratch}/tmp"):
        os.symlink(HOME, f"{scratch}/tmp")
    _system_call(_SYS_PIVOT_ROOT, scratch.encode(), f"{scratch}/old".encode())
    os.chdir("/")
    # the old /proc stays with this process only, until workers have one of their own
    _mount("/old/proc", "/proc", None, _MS_BIND | _MS_REC)
    call("umount2", "/old", _MNT_DETACH)
    os.rmdir("/old")
    _remount_read_only("/")
    _mount("muslin", HOME, "tmpfs", _MS_NOSUID | _MS_NODEV, "size=16m,mode=755")
    os.environ.update(HOME=HOME, TMPDIR=HOME)
    return own_users


def _new_users(more: int = 0) -> None:
    """Enter a user space with this process's own user in it, and every right inside."""
    user, group = os.getuid(), os.getgid()
    call("unshare", _NEWUSER | more)
    Path("/proc/self/setgroups").write_text("deny")
    Path("/proc/self/uid_map").write_text(f"{user} {user} 1")
    Path("/proc/self/gid_map").write_text(f"{group} {group} 1")


def outermost(paths: Iterable[str]) -> list[str]:
    """Paths that do not lie in one another, folders first named by links kept as they are."""
    chosen: list[str] = []
    for path in sorted(set(paths), key=len):
        if not any(path == kept or path.startswith(kept + "/") for kept in chosen):
            chosen.append(path)
    return chosen


def _show(root: str, path: str, read_only: bool = True) -> None:
    target = root + path
    if not os.path.lexists(path):
        return
    os.makedirs(os.path.dirname(target), exist_ok=True)
    if os.path.islink(path):
        os.symlink(os.readlink(path), target)
        return
    if os.path.isdir(path):
        os.makedirs(target, exist_ok=True)
    else:
        Path(target).touch()
    _mount(path, target, None, _MS_BIND | _MS_REC)
    if read_only:
        _remount_read_only(target)


def _remount_read_only(target: str) -> None:
    kept = os.statvfs(target).f_flag & (_MS_NOSUID | _MS_NODEV | _MS_NOEXEC)
    times = os.statvfs(target).f_flag & (1024 | 2048 | 4096)  # noatime, nodiratime, relatime
    flags = kept | (times & 3072) | ((1 << 21) if times & 4096 else 0)
    _mount("none", target, None, _MS_REMOUNT | _MS_BIND | _MS_RDONLY | flags)


def hide(path: str) -> None:
    """Cover a file or folder with nothing; needs `enclose` to have been called, or its rights."""
    if os.path.isdir(path):
        _mount("muslin", path, "tmpfs", _MS_RDONLY | _MS_NOSUID | _MS_NODEV, "size=4k,mode=555")
    elif os.path.exists(path):
        _mount("/dev/null", path, None, _MS_BIND)


def fork_into_new_processes() -> int:
    """Fork; the child is the first process of a process space of its own, and all in it die with it.

    A process can make one such space only, so another is forked in between; `adopt_orphans` makes the child
    ours when that one ends, which the child waits for.
    """
    told, tell = os.pipe()
    wait, go = os.pipe()
    between = os.fork()
    if between == 0:
        try:
            call("unshare", _NEWPID)
            child = os.fork()
        except OSError as error:
            child = -(error.errno or 1)
        if child == 0:
            for descriptor in (told, tell, go):
                os.close(descriptor)
            os.read(wait, 1)
            os.close(wait)
            return 0
        os.write(tell, str(child).encode())
        os._exit(0)
    os.close(tell)
    os.close(wait)
    os.waitpid(between, 0)
    child = int(os.read(told, 20) or -1)
    os.close(told)
    os.close(go)
    if child < 0:
        raise OSError(-child, f"unshare: {os.strerror(-child)}")
    return child


def furnish(covered: Iterable[str], own_users: bool) -> None:
    """Give a worker in a namespace its own /proc, its own empty, writable home, and hide more from it.

    With `own_users` also a user space, so that processes are counted for each worker alone.
    """
    call("unshare", _NEWNS | _NEWIPC)
    try:
        _mount("proc", "/proc", "proc", _MS_NOSUID | _MS_NODEV | _MS_NOEXEC)
    except OSError:  # some containers do not allow it: then there is none
        _mount("muslin", "/proc", "tmpfs", _MS_RDONLY | _MS_NOSUID | _MS_NODEV, "size=4k")
    _mount("muslin", HOME, "tmpfs", _MS_NOSUID | _MS_NODEV, f"size={DISK},nr_inodes={FILES},mode=777")
    for path in covered:
        hide(path)
    if own_users and os.path.exists("/proc/self/uid_map"):
        _new_users()


# rights and limits ------------------------------------------------------------------------------------------


def confine(user: int | None, processes: int) -> None:
    """Give up every right and accept the limits, for good.

    Parameters
    ----------
    user : int, optional
        User and group to become.
    processes : int
        Most processes and threads that user may have, those it has already included.
    """
    _limit(resource.RLIMIT_FSIZE, FILE)
    _limit(resource.RLIMIT_NOFILE, OPEN)
    _limit(resource.RLIMIT_CORE, 0)
    if LINUX:
        _limit(resource.RLIMIT_AS, MEMORY)
        _limit(resource.RLIMIT_NPROC, processes)
        with contextlib.suppress(OSError):  # when memory runs out, this process goes first
            Path("/proc/self/oom_score_adj").write_text("1000")
        for capability in range(64):
            with contextlib.suppress(OSError):
                _prctl(_PR_CAPBSET_DROP, capability)
    if user is not None:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    if LINUX:
        _drop_capabilities()
        _prctl(_PR_SET_NO_NEW_PRIVS, 1)
        die_with_parent()  # setresuid forgets it


def keep_open(descriptors: Iterable[int]) -> None:
    """Close every descriptor but these."""
    kept = sorted(descriptors)
    for low, high in zip([-1, *kept], [*kept, 1 << 16], strict=True):
        if low + 1 < high:  # an empty range is everything to some versions
            os.closerange(low + 1, high)


def _drop_capabilities() -> None:
    header = (ctypes.c_uint32 * 2)(0x20080522, 0)
    data = (ctypes.c_uint32 * 6)()
    with contextlib.suppress(OSError, KeyError):
        _system_call(_SYS_CAPSET, ctypes.byref(header), ctypes.byref(data))


def _limit(kind: int, value: int) -> None:
    _, hard = resource.getrlimit(kind)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(kind, (value, value))


def kill_orphans(spared: Iterable[int]) -> None:
    """Kill every child of this process but the spared ones, and theirs, until none is left."""
    if not LINUX:
        return
    spared = set(spared)
    for _ in range(1000):
        found = set(children()) - spared
        if not found:
            return
        for pid in found:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        for pid in found:
            with contextlib.suppress(OSError):
                os.waitpid(pid, 0)


def children() -> list[int]:
    """Processes whose parent is this one."""
    own, found = str(os.getpid()), []
    for entry in os.listdir("/proc") if LINUX else ():
        if entry.isdigit():
            with contextlib.suppress(OSError, IndexError):
                stat = Path(f"/proc/{entry}/stat").read_text(errors="replace")
                if stat.rpartition(")")[2].split()[1] == own:
                    found.append(int(entry))
    return found


#: From how many characters on a path goes on from a handle; a name has at most 255 bytes more.
LONG_PATH = 900


def overflows(home: str) -> bool:
    """Whether a folder holds more than a worker's home may; where that is no disk of its own, we must look.

    Folders that cannot be listed count as more. Where a path gets long, it goes on from a handle: no system call takes
    a path of more than 4096 bytes, but folders go deeper.
    """
    files, size, waiting, handles = 0, 0, [home], []
    try:
        while waiting:
            try:
                with os.scandir(waiting.pop()) as entries:
                    for entry in entries:
                        files += 1
                        if files > FILES or size > DISK:
                            return True
                        if not entry.is_dir(follow_symlinks=False):
                            size += entry.stat(follow_symlinks=False).st_blocks * 512
                        elif len(entry.path) < LONG_PATH:
                            waiting.append(entry.path)
                        else:
                            handles.append(os.open(entry.path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW))
                            waiting.append(f"/proc/self/fd/{handles[-1]}")
            except FileNotFoundError:
                continue
            except OSError:
                return True
        return size > DISK
    finally:
        for handle in handles:
            os.close(handle)


def threads_of(user: int) -> int:
    """How many processes and threads a user has now."""
    count = 0
    for entry in os.listdir("/proc") if LINUX else ():
        if entry.isdigit():
            with contextlib.suppress(OSError):
                if os.stat(f"/proc/{entry}").st_uid == user:
                    count += len(os.listdir(f"/proc/{entry}/task"))
    return count


def empty_user(user: int) -> None:
    """Kill every process of a user (uid level: each worker has a user of its own)."""
    pid = os.fork()
    if pid == 0:
        try:
            os.setresuid(user, user, user)
            os.kill(-1, signal.SIGKILL)
        except OSError:
            pass
        finally:
            os._exit(0)
    os.waitpid(pid, 0)
