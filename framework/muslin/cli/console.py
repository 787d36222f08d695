"""The terminal, in one place: how wide it is, whether it takes colours, and that no letter stops a command.

All that commands say goes through `say`. On a terminal, lines are broken between words; in a pipe or a file they
stay whole, so that `grep` finds them, unless `COLUMNS` is set.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import sys
import time
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

_ESCAPE = re.compile(r"\x1b\[[0-9;]*m|\x1b\]8;[^\x1b]*\x1b\\")
_LABEL = re.compile(r"\s*[\w-]+: +(?=\S)")


def prepare() -> None:
    """Make names and words of any language safe to read and to print; first of all that the command does.

    In a locale without an encoding of its own (`LC_ALL=C` in cron and some containers) Python would read names as
    bytes it cannot show; it is started again in UTF-8 mode, which Python 3.15 has by default.
    """
    if sys.getfilesystemencoding().lower().replace("-", "") == "ascii" and not sys.flags.utf8_mode:
        os.environ["PYTHONUTF8"] = "1"
        with contextlib.suppress(OSError):
            os.execv(sys.executable, [sys.executable, "-X", "utf8", *sys.orig_argv[1:]])
    for stream in (sys.stdout, sys.stderr):
        if getattr(stream, "errors", None) == "strict" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal that lacks a letter shows ?


def coloured(stream: TextIO | None) -> bool:
    """Whether escape codes are welcome: a terminal that has them, and nobody said NO_COLOR (https://no-color.org)."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return not plain and is_terminal(stream)


def is_terminal(stream: TextIO | None) -> bool:
    """Whether a stream is a terminal; False for one that is closed."""
    try:
        return stream is not None and stream.isatty()
    except ValueError:
        return False


def width(stream: TextIO | None) -> int | None:
    """Columns that lines have to keep to; None where they may be of any length."""
    given = os.environ.get("COLUMNS", "")
    if not (given.isdigit() and int(given)) and not is_terminal(stream):
        return None
    return max(20, shutil.get_terminal_size().columns)


def say(text: str = "", err: bool = False, style: str = "") -> None:
    """Print lines, broken between words to the terminal's width.

    Parameters
    ----------
    text : str
    err : bool
        To standard error.
    style : str
        Numbers of an ANSI style, for terminals with colours: "32" is green.
    """
    stream = sys.stderr if err else sys.stdout
    if stream is None:
        return
    text = folded(text, width(stream))
    if style and coloured(stream):
        text = f"\x1b[{style}m{text}\x1b[0m"
    stream.write(text + "\n")
    stream.flush()


def note(text: str) -> None:
    """Say what a person should know besides the result."""
    say(f"note: {text}", err=True)


def say_raw(text: str) -> None:
    """Print what programs read: as it is, in UTF-8 whatever the terminal has."""
    stream = getattr(sys.stdout, "buffer", None)
    if stream is None:
        print(text, flush=True)
        return
    sys.stdout.flush()
    stream.write(text.encode("utf-8", "surrogateescape") + b"\n")
    stream.flush()


def folded(text: str, columns: int | None) -> str:
    """Text whose lines fit into so many columns, broken between words; what follows is indented like its column."""
    if columns is None:
        return text
    return "\n".join(part for line in text.split("\n") for part in _folded(line, columns))


def _folded(line: str, columns: int) -> Iterator[str]:
    if _long(line) <= columns:
        yield line
        return
    hang, before = _hang(line, columns), ""
    for gap, word in re.findall(r"(\s*)(\S+)", line):
        if before.strip() and _long(before + gap + word) > columns:
            yield before
            before = hang + word
        else:
            before += gap + word
    yield before


def _hang(line: str, columns: int) -> str:
    """Indentation of the lines that go on with a line: that of its last column, as long as there is room."""
    plain = _ESCAPE.sub("", line)
    starts = [match.end() for match in re.finditer(r"(?:^|(?<=\S)) {2,}(?=\S)", plain)]
    if (label := _LABEL.match(plain)) is not None:
        starts.append(label.end())
    return " " * max((start for start in starts if start <= columns // 2), default=0)


def _long(text: str) -> int:
    """Columns that a text takes."""
    text = _ESCAPE.sub("", text)
    if text.isascii():
        return len(text)
    wide = sum(unicodedata.east_asian_width(letter) in "WF" for letter in text)
    return len(text) + wide - sum(unicodedata.combining(letter) != 0 for letter in text)


@contextmanager
def progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Progress bar with time left, on a terminal; now and then a line elsewhere."""
    if is_terminal(sys.stderr) and os.environ.get("TERM") != "dumb":
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        room = (width(sys.stderr) or 80) - len(title) - 34
        columns: list[Any] = [TextColumn("{task.description}")]
        columns += [BarColumn(bar_width=min(40, room))] if room >= 5 else []
        columns += [MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()]
        with Progress(*columns, console=Console(stderr=True)) as bar:
            task = bar.add_task(title, total=None)
            yield lambda done, total: bar.update(task, completed=done, total=total)
        return
    said = time.monotonic()
    first: tuple[float, int] | None = None

    def line(done: int, total: int) -> None:
        nonlocal said, first
        now = time.monotonic()
        first = first or (now, done)  # until then kernels were compiled: that says nothing of what is to come
        if now - said > 5 and done < total:
            said = now
            told = f"{title}: {done}/{total}"
            if done > first[1]:
                told += f", {(now - first[0]) / (done - first[1]) * (total - done):.0f} s left"
            say(told, err=True)

    yield line
