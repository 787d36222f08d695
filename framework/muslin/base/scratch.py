"""Temporary folders: made, removed whatever is in them, and swept when whoever made them has died.

A folder is locked for as long as its maker lives; the system lets go of the lock however that one ends. What bears
a name of ours and is not locked is nobody's any more.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import secrets
import stat
import tempfile
import time
from pathlib import Path
from typing import Any, ClassVar

#: How names of our temporary folders begin: a grading's, and a student's of a class.
GRADING, CLASS = "muslin-grading-", "muslin-class-"

#: How long a folder is removed again and again while others write into it [s].
PATIENCE = 5.0

_FOLDER = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)


class Scratch:
    """A temporary folder; a context manager. What earlier processes have left behind is swept first.

    Parameters
    ----------
    prefix : str
        `GRADING` or `CLASS`.

    Attributes
    ----------
    path : str
    """

    _living: ClassVar[set[Scratch]] = set()

    def __init__(self, prefix: str):
        sweep()
        while True:
            self.path = tempfile.mkdtemp(prefix=prefix)
            lock = _locked(self.path)
            if lock is not None:  # else it was swept between the two lines
                self._lock = lock
                self._living.add(self)
                return

    def __enter__(self) -> Scratch:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder. Two threads may do so at once: one of them lets go of the lock."""
        if self in self._living:
            remove(self.path)
            with contextlib.suppress(KeyError):
                self._living.remove(self)
                os.close(self._lock)

    @classmethod
    def close_all(cls) -> None:
        """Remove every folder of this process, before it ends at once.

        Whoever works in one of them may be writing still: then once more, for `PATIENCE` seconds.
        """
        until = time.monotonic() + PATIENCE
        while not all([remove(living.path) for living in list(cls._living)]) and time.monotonic() < until:
            time.sleep(0.02)
        for living in list(cls._living):
            living.close()


def sweep(prefixes: tuple[str, ...] = (GRADING, CLASS)) -> list[str]:
    """Remove the temporary folders of this user whose makers are dead; which those were."""
    swept = []
    with contextlib.suppress(OSError), os.scandir(tempfile.gettempdir()) as entries:
        for entry in entries:
            if entry.name.startswith(prefixes) and (lock := _locked(entry.path)) is not None:
                remove(entry.path)
                os.close(lock)
                swept.append(entry.path)
    return swept


def _locked(path: str) -> int | None:
    """A lock on a folder of ours: the descriptor that holds it; None if somebody else has it, or it is gone."""
    import fcntl  # not on Windows, where nothing is graded

    try:
        folder = os.open(path, _FOLDER)
    except OSError:
        return None
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        ours, there = os.fstat(folder), os.lstat(path)
        if ours.st_uid == os.geteuid() and os.path.samestat(ours, there):
            return folder
    except OSError:
        pass
    os.close(folder)
    return None


def remove(path: Path | str) -> bool:
    """Remove a file or a folder with all that is in it, however deep, and whether or not it may be listed.

    Links are not followed. It never raises: what cannot be removed stays.

    Returns
    -------
    bool
        Whether it is gone.
    """
    path = os.fspath(path)
    with contextlib.suppress(OSError):
        if stat.S_ISDIR(os.lstat(path).st_mode):
            os.chmod(path, 0o700)
            _empty(path)
            os.rmdir(path)
        else:
            os.unlink(path)
    return not os.path.lexists(path)


def _empty(path: str) -> None:
    """Remove what is in a folder.

    Folders further down are moved to the top before they are looked into: no path is ever longer than two names,
    and no more than two folders are open.
    """
    top = os.open(path, _FOLDER)
    waiting, fresh = [""], (f"{secrets.token_hex(8)}-{k}" for k in itertools.count())
    try:
        while waiting:
            name = waiting.pop()
            with contextlib.suppress(OSError):
                folder = os.open(name, _FOLDER, dir_fd=top) if name else os.dup(top)
                try:
                    for entry in _entries(folder):
                        moved = next(fresh) if name else entry.name
                        if entry.is_dir(follow_symlinks=False) and _taken_up(entry.name, folder, moved, top):
                            waiting.append(moved)
                        else:
                            with contextlib.suppress(OSError):
                                os.unlink(entry.name, dir_fd=folder)
                finally:
                    os.close(folder)
                if name:
                    os.rmdir(name, dir_fd=top)
    finally:
        os.close(top)


def _entries(folder: int) -> list[os.DirEntry[Any]]:
    with os.scandir(folder) as entries:
        return list(entries)


def _taken_up(name: str, folder: int, moved: str, top: int) -> bool:
    """Whether a folder could be opened up for us and moved to the top."""
    try:
        os.chmod(name, 0o700, dir_fd=folder)
        os.rename(name, moved, src_dir_fd=folder, dst_dir_fd=top)
    except OSError:
        return False
    return True
