"""What was found: one line of the examination, and what its checks are written with."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

from muslin.base import child

GIBIBYTE = 1 << 30


@dataclass(frozen=True)
class Finding:
    """One line of the examination.

    Parameters
    ----------
    what : str
        What was looked at.
    ok : bool or None
        None: absent, and Muslin's main work does not need it.
    detail : str
        What was found.
    advice : str
        What to do, if not ok.
    """

    what: str
    ok: bool | None
    detail: str
    advice: str = ""

    def __str__(self) -> str:
        mark = {True: "ok", False: "FIX", None: "-"}[self.ok]
        advice = f"  -> {self.advice}" if self.advice and self.ok is not True else ""
        return f"{mark:4}  {self.what:18}  {self.detail}{advice}"


def ending(done: child.Done) -> str:
    """How a process ended."""
    if name := child.killer(done.status):
        extra = ", an instruction this processor lacks" if name == "SIGILL" else ""
        return f"the process was killed by {name if name.startswith('signal') else f'signal {name}'}{extra}"
    last = child.last_line(done.errors)
    number = str(done.status) if done.status < 256 else hex(done.status)  # Windows names exceptions so
    return f"the process ended with status {number}" + (f" ({last[:200]})" if last else "")


def loads(library: str) -> bool:
    """Whether a library of the system can be loaded."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def one_line(error: object) -> str:
    """An error's words, on one line that is not too long."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 300 else f"{text[:297]}..."
