"""Errors that speak to people.

Everything Muslin refuses is a `MuslinError`: one paragraph that says what is wrong, where, and what to do
next. The command line prints it without a traceback and exits non-zero.
"""

from __future__ import annotations

import difflib
import errno
import os
from collections.abc import Iterable

from muslin.base.text import visible


class MuslinError(Exception):
    """Something a person can put right.

    Parameters
    ----------
    message : str
        What is wrong and where, in one or two sentences.
    hint : str, optional
        What to do next.
    """

    def __init__(self, message: str, hint: str = ""):
        self.message = visible(message)  # it may quote a file's name, or a file
        self.hint = visible(hint)
        super().__init__(f"{self.message} {self.hint}".strip())


class MeshError(MuslinError):
    """A mesh that cannot be loaded or cannot be cloth."""


class NotImplementedYet(MuslinError):
    """A student function that is still the stub."""


class StudentCodeError(MuslinError):
    """A student's file that cannot be imported, compiled or called as the handout asks."""


class SimulationError(MuslinError):
    """A simulation that cannot start or has blown up."""


class Inverted(SimulationError):
    """Positions in which a tetrahedron is flat or inverted."""


def said(error: BaseException) -> str:
    """Kind and text of an error, also of one whose own text cannot be had."""
    try:
        text = str(error).strip()
    except Exception:  # a class of the student's own
        text = ""
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def near(word: str, known: Iterable[str]) -> str:
    """Which of the names is probably meant by a word; empty if none is."""
    folded = {name.lower(): name for name in reversed(list(known))}
    found = difflib.get_close_matches(str(word).lower(), folded, 1, 0.5)
    return folded[found[0]] if found else ""


def choices(word: str, known: Iterable[str]) -> str:
    """What there is where somebody asked for `word`: what was probably meant, and the list unless it is long."""
    names = list(known)
    alike = near(word, names)
    meant = f"Did you mean {alike}?" if alike else ""
    listed = f"There is: {', '.join(names)}."
    return meant if meant and len(names) > 8 else f"{meant} {listed}".strip()


#: What to do about what the system refuses, by the number of its error.
_NEXT = {
    errno.ENOSPC: "Make room, or write to another disk; then the same command again.",
    errno.EACCES: "Choose a place of your own.",
    errno.EPERM: "Choose a place of your own.",
    errno.EROFS: "Choose a place that can be written.",
    errno.ENOTDIR: "A part of that path is a file: choose another.",
    errno.EEXIST: "Choose another name.",
    errno.ENAMETOOLONG: "Choose a shorter name.",
    errno.EMFILE: "Close other programs, or raise the limit: ulimit -n 1024",
}
if hasattr(errno, "EDQUOT"):
    _NEXT[errno.EDQUOT] = "Make room within your quota; then the same command again."


def of_system(error: OSError) -> MuslinError:
    """What the system refused, for people: a full disk, a folder that is not theirs, a path below a file."""
    if (gone := no_folder()) is not None:
        return gone
    what = error.strerror or str(error) or type(error).__name__
    if error.errno == errno.ENOSPC:
        what = "No space left" + (f" for {error.filename}" if error.filename else "")
    elif error.errno == errno.EEXIST and os.path.isfile(error.filename or ""):
        what = f"{_name(error.filename)} is a file, not a folder"
    elif error.filename is not None:
        names = [os.fspath(name) for name in (error.filename, error.filename2) if name is not None]
        what = f"{' and '.join(map(_name, names))}: {what}"
    return MuslinError(f"{what}.", _NEXT.get(error.errno or 0, ""))


def no_folder() -> MuslinError | None:
    """What to say where the current folder has been removed: then anything fails, in words of its own."""
    try:
        os.getcwd()
    except OSError:
        return MuslinError("The folder you are in is there no longer.", "Go to another one: cd")
    return None


def _name(name: str | bytes | int) -> str:
    return os.fsdecode(name) if isinstance(name, (str, bytes)) else f"descriptor {name}"
