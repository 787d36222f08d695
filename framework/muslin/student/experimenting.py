"""Experiments of an assignment: scripts in the workspace that measure something with the student's own functions."""

from __future__ import annotations

import ast
import os
import re
import runpy
import traceback
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError, choices, said
from muslin.student.workspace import Workspace
from muslin.tasks import EXPERIMENTS


def scripts(workspace: Workspace) -> dict[str, Path]:
    """The experiments there are, by name: the workspace's own, or else those of the assignment.

    Raises
    ------
    MuslinError
        If the assignment has none.
    """
    for folder in (workspace.folder / EXPERIMENTS, paths.assignment(workspace.table.name) / EXPERIMENTS):
        if found := sorted(folder.glob("*.py"), key=_place_in_handout):
            return {path.stem: path for path in found}
    raise MuslinError(f"The assignment {workspace.table.name!r} has no experiments.")


def _place_in_handout(script: Path) -> tuple[int, str]:
    """The number of the section an experiment belongs to, as its title says it, then its name."""
    section = re.match(r"S(\d+)", title(script))
    return int(section[1]) if section else 1000, script.stem


def title(script: Path) -> str:
    """What an experiment asks: the first line of its docstring, as far as it can be read."""
    try:
        text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    except (OSError, UnicodeDecodeError, SyntaxError, ValueError):
        text = ""
    return text.partition("\n")[0]


def run(workspace: Workspace, name: str) -> None:
    """Run an experiment in the workspace; it prints and draws for itself.

    Raises
    ------
    MuslinError
        If there is no such experiment, or it ended with an error; the message says at which line of it.
    """
    found = scripts(workspace)
    if name not in found:
        raise MuslinError(f"There is no experiment {name!r}.", choices(name, found))
    script, before = found[name].resolve(), Path.cwd()
    os.chdir(workspace.folder)
    try:
        runpy.run_path(str(script), run_name="__main__")
    except (MuslinError, SystemExit):
        raise
    except Exception as error:
        raise MuslinError(f"{_place(error, script)}: {said(error)}") from None
    finally:
        os.chdir(before)


def _place(error: BaseException, script: Path) -> str:
    """The last line of the script that an error came through."""
    if isinstance(error, SyntaxError):
        return f"{paths.shown(script)}:{error.lineno}"
    lines = [
        entry.lineno for entry in traceback.extract_tb(error.__traceback__) if entry.filename == str(script)
    ]
    return f"{paths.shown(script)}:{lines[-1]}" if lines else paths.shown(script)
