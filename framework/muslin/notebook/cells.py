"""`%%task` and `%muslin`: a cell that is a function of a task file, and the commands of the command line."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

from IPython.core.magic import Magics, cell_magic, line_magic, magics_class
from IPython.display import display

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.notebook import shows
from muslin.reading import source
from muslin.student.checking import Checker
from muslin.student.workspace import Workspace, find
from muslin.tasks.manifest import chosen_tasks


@magics_class
class Commands(Magics):
    """What a notebook can say to Muslin."""

    def __init__(self, shell: Any):
        super().__init__(shell)
        self._checker = Checker()
        shell.set_custom_exc((MuslinError,), _said)

    @cell_magic
    def task(self, line: str, cell: str) -> shows.Verdicts:
        """`%%task phi`: write the cell into phi's file, and check it."""
        workspace = find()
        names = chosen_tasks(line.split() or [""], workspace.table)
        if len(names) != 1:
            raise MuslinError("A %%task cell is for one task.", f"Write one of: {', '.join(names)}.")
        written(workspace, names[0], cell)
        return self._verdicts(workspace, names)

    @line_magic
    def muslin(self, line: str) -> Any:
        """`%muslin COMMAND ...`: as in a terminal; what it finds or draws shows itself."""
        words = shlex.split(line)
        if words[:1] == ["check"] and not any(word.startswith("-") for word in words):
            workspace = find()
            return self._verdicts(
                workspace, chosen_tasks(words[1:], workspace.table) or list(workspace.table.tasks)
            )
        return command(words)

    def _verdicts(self, workspace: Workspace, names: list[str]) -> shows.Verdicts:
        return shows.Verdicts(workspace, list(self._checker.check(workspace, names)))


def written(workspace: Workspace, task: str, text: str) -> Path:
    """Write a cell's functions into a task's file, each in its place; new ones go before the task's own.

    Parameters
    ----------
    workspace : Workspace
    task : str
    text : str
        The function of the task, perhaps with helpers; imports of Taichi and NumPy are passed over.

    Raises
    ------
    MuslinError
        If the cell, or the file, is not Python, the cell lacks the function, or holds something else.
    """
    cell = source.Source(text if text.endswith("\n") else text + "\n", f"the cell of {task}")
    if task not in cell.functions:
        there = ", ".join(cell.functions) or "no function"
        raise MuslinError(
            f"The cell of {task} holds {there}.", f"It must hold the function {task}, under this name."
        )
    taken = {k for function in cell.functions.values() for k in function.lines}
    for k, line in enumerate(cell.lines):
        if k not in taken and line.strip() and not line.lstrip().startswith(("#", "import ", "from ")):
            raise MuslinError(
                f"Line {k + 1} of the cell of {task} belongs to no function: {line.strip()}",
                "Put it into the function: only functions are written into the task file.",
            )
    path = workspace.folder / workspace.table.tasks[task].file
    file = source.Source(source.read(path) if path.is_file() else workspace.given(path.name), path.name)
    for name in sorted(cell.functions, key=lambda name: name == task):  # helpers first
        piece = cell.piece(cell.functions[name].lines).rstrip("\n") + "\n"
        file = source.Source(_placed(file, name, task, piece), path.name)
    source.write(path, file.text)
    return path


def _placed(file: source.Source, name: str, task: str, piece: str) -> str:
    """The file's text with a function in place of the one of its name, or before the task's, or at the end."""
    if name in file.functions:
        lines = file.functions[name].lines
        start, stop = lines.start, lines.stop
    elif task in file.functions:
        start = stop = file.functions[task].lines.start
        piece += "\n\n"
    else:
        start = stop = len(file.lines)
        piece = "\n\n" + piece
    return "".join(file.lines[:start]) + piece + "".join(file.lines[stop:])


def command(words: list[str]) -> Any:
    """Run a command as a terminal does, print what it says, and show what it has drawn."""
    before = _drawn()
    code = "import sys; from muslin.cli import main; sys.argv[0] = 'muslin'; main()"
    environment = {**os.environ, "NO_COLOR": "1", "PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8"}
    with subprocess.Popen(
        [sys.executable, "-c", code, *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, encoding="utf-8", errors="replace", env=environment,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
    for path in sorted(_drawn().items() - before.items(), key=lambda item: item[1]):
        display(shows.Drawn(path[0]))


def _drawn() -> dict[Path, int]:
    """The pictures and films of the workspace's runs, and when they were written."""
    try:
        folder = find().folder / "runs"
    except MuslinError:
        return {}
    found = (path for path in folder.rglob("*") if path.suffix in shows.DRAWN)
    return {path: path.stat().st_mtime_ns for path in found}


def _said(shell: Any, kind: type, error: Exception, trace: Any, tb_offset: Any = None) -> list[str]:
    """What Muslin has to say, without a traceback."""
    print(error, file=sys.stderr)
    return [str(error)]


def register(shell: Any) -> None:
    """Called by `%load_ext muslin`."""
    shell.register_magics(Commands(shell))
    print(f"Muslin is ready, in {paths.shown(Path.cwd())}.")
