"""Check on save: see what changed, check it, say it, move on when it is green.

Saving is noticed by reading the few task files ten times a second. That needs no library, works on network
drives, in containers and with every editor (which may write in place or replace the file), and costs under a
thousandth of a core. A file counts as changed when a function in it does, not a comment.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from muslin.base.errors import MuslinError
from muslin.reading import source
from muslin.student import checking, editors, hints, problems, progress
from muslin.student.workspace import Workspace, find

#: How often files and keys are looked at [s].
PERIOD = 0.1

KEYS = {"h": "hint", "l": "list", "n": "next", "r": "run", "q": "quit"}


class Watch:
    """One session of watching.

    Parameters
    ----------
    workspace : Workspace
    say : callable
        Prints a line.
    scene : str, optional
        What the key r runs; default the assignment's own.
    problems : callable, optional
        Prints a line for editors, as it is.
    """

    def __init__(
        self,
        workspace: Workspace,
        say: Callable[[str], Any],
        scene: str | None = None,
        problems: Callable[[str], Any] | None = None,
    ):
        self.problems, self.reports = problems, dict[str, checking.Report]()
        self.workspace, self.say, self.scene = workspace, say, scene or workspace.scene
        self.checker = checking.Checker(ready=("muslin.grading.diagnosis", "muslin.judging.properties"))
        self.texts: dict[str, str] = {}
        self.keys: dict[str, str] = {}
        self.stamps: dict[str, tuple[int, int] | None] = {}
        self.current: str | None = None
        self.left: list[str] = []  # not checked to the end, since a file was saved meanwhile
        self.asked = ""  # what has to be asked for once more

    def begin(self) -> None:
        """Say where things stand; check what has been changed since the last time."""
        self.checker.warm()
        self._look()
        found = progress.standings(self.workspace)
        self.keys = {s.task.name: self.workspace.key(s.task.name, self.texts) for s in found}
        keys = "   ".join(f"{key} {word}" for key, word in KEYS.items())
        self.say(f"Watching {self.workspace.folder.resolve().name}/. Save a file and it is checked.   {keys}")
        open_ = (
            progress.UNCHECKED,
            *((progress.UNREADABLE, checking.WRONG, checking.ERROR) if self.problems else ()),
        )
        unsure = [s.task.name for s in found if s.status in open_]
        self._tell([])
        if unsure:
            self._check(unsure)
        else:
            self._where()

    def step(self) -> None:
        """Check what has been saved since the last step."""
        if not self._look() and not self.left:
            return
        began = time.monotonic()
        keys = {name: self.workspace.key(name, self.texts) for name in self.keys}
        changed = [name for name, key in keys.items() if key != self.keys[name] or name in self.left]
        self.keys = keys
        if not changed:
            self.say("Saved; no function has changed.")
            return
        if self.current in changed:  # what one works on comes first
            changed.sort(key=lambda name: name != self.current)
        self._check(changed, began)

    def press(self, key: str) -> bool:
        """Do what a key asks for; whether to go on."""
        word = KEYS.get(key.lower(), "")
        again, self.asked = self.asked == word, ""
        if word == "hint":
            self._lines(
                hints.shown(self.workspace, self.current) if self.current else ["Everything is green."]
            )
        elif word == "list":
            self._lines(progress.listed(self.workspace))
        elif word == "next":
            found = progress.open_task(progress.standings(self.workspace), self.current)
            self.current = found.task.name if found else None
            self._where()
        elif word == "run" and not self.scene:
            self.say(f"{self.workspace.table.name} has no simulation to run.")
        elif word == "run" and again:
            self._run()
        elif word == "run":
            self.asked = word
            self.say(f"Run {self.scene} with your functions? It takes a while: press r once more.")
        return word != "quit"

    def _look(self) -> bool:
        """Read the files that may have changed; whether any text has."""
        changed = False
        for file in self.workspace.table.files:
            path = self.workspace.folder / file
            try:
                status = path.stat()
                stamp: tuple[int, int] | None = (status.st_mtime_ns, status.st_size)
                if stamp == self.stamps.get(file, ()):
                    continue
                text = source.glimpse(path)
            except OSError:  # between the two halves of a save, or deleted
                stamp, text = None, ""
                if self.stamps.get(file, ()) is None:
                    continue
            self.stamps[file] = stamp
            if self.texts.get(file) != text:
                self.texts[file], changed = text, True
        return changed

    def _saved(self) -> bool:
        """Whether a file has another time or size than when it was read."""
        return any(_stamp(self.workspace.folder / file) != stamp for file, stamp in self.stamps.items())

    def _check(self, names: list[str], began: float | None = None) -> None:
        began = time.monotonic() if began is None else began
        width = max(map(len, names))
        self.say("")
        reports = []
        self.left = list(names)
        for report in self.checker.check(self.workspace, names, self._saved):
            self.left.remove(report.task)
            brief = report.task != (self.current or report.task) and len(names) > 1
            self._lines(checking.told(self.workspace, report, width, brief))
            reports.append(report)
        self._tell(reports)
        if self.left:
            self.say("Saved again: what has changed is checked once more.")
            return
        took = time.monotonic() - began
        turned_green = [r.task for r in reports if r.status == checking.GREEN]
        if self.current in turned_green or self.current is None:
            found = progress.open_task(progress.standings(self.workspace), self.current)
            self.current = found.task.name if found else None
        self._where(f"   ({took:.1f} s)")
        self.checker.warm()  # a new worker gets ready while the student thinks

    def _tell(self, reports: list[checking.Report]) -> None:
        """What fails, for editors: all of it, since they forget what was said before."""
        self.reports |= {report.task: report for report in reports}
        if self.problems:
            told = problems.lines(self.workspace, self.reports.values())
            for line in (editors.BEGINS, *told, editors.ENDS):
                self.problems(line)

    def _where(self, note: str = "") -> None:
        found = progress.standings(self.workspace)
        if self.current is None and (first := progress.open_task(found)) is not None:
            self.current = first.task.name
        self.say(progress.bar(found) + note)
        if self.current is None:
            run = "r runs a scene with your functions, or " if self.scene else ""
            self.say(f"Everything is green. Next: {run}{self.workspace.next_step(self.scene)}")
            return
        entry = self.workspace.table.tasks[self.current]
        self.say(
            f"Now: {self.current}, {entry.title}, {entry.points} points, "
            f"at {self.workspace.place(self.current)}; read {self.workspace.chapter(self.current)}"
        )

    def _run(self) -> None:
        self.say(f"Running {self.scene} with your functions (Ctrl-C stops it) ...")
        command = [sys.executable, "-m", "muslin.cli", "run", self.scene]
        with contextlib.suppress(KeyboardInterrupt):
            subprocess.run([*command, "--functions", str(self.workspace.folder)], check=False)
        self._where()

    def _lines(self, lines: list[str]) -> None:
        for line in lines:
            self.say(line)


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def watch(
    workspace: Workspace,
    say: Callable[[str], Any],
    scene: str | None = None,
    problems: Callable[[str], Any] | None = None,
) -> None:
    """Watch until q is pressed, Ctrl-C comes, or the workspace is gone."""
    session = Watch(workspace, say, scene, problems)
    try:
        session.begin()
        with _keys() as pressed:
            while True:
                key = pressed(PERIOD)
                if key and not session.press(key):
                    break
                if not workspace.folder.is_dir():
                    raise MuslinError("The workspace is gone.")
                session.step()
    except KeyboardInterrupt:
        pass
    finally:
        session.checker.close()
    say("Watching has ended. " + progress.bar(progress.standings(find(workspace.folder))))


@contextlib.contextmanager
def _keys() -> Iterator[Callable[[float], str]]:
    """A function that waits at most so many seconds for a key and gives it, or ""; the terminal is put back."""
    if not sys.stdin.isatty():

        def none(seconds: float) -> str:
            time.sleep(seconds)
            return ""

        yield none
    elif sys.platform == "win32":
        import msvcrt

        def pressed(seconds: float) -> str:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                if msvcrt.kbhit():
                    return msvcrt.getwch()
                time.sleep(0.02)
            return ""

        yield pressed
    else:
        import os
        import select
        import termios
        import tty

        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)

        def pressed(seconds: float) -> str:
            ready, _, _ = select.select([descriptor], [], [], seconds)
            return os.read(descriptor, 1).decode("ascii", "ignore") if ready else ""

        try:
            tty.setcbreak(descriptor)
            yield pressed
        finally:
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
