"""What is wrong, in lines that editors read (`muslin.student.editors`): `stress.py:12: error: dpsi_dF: ...`.

A task that fails has one line, never broken, beside what is said to people.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from muslin.base.errors import MuslinError
from muslin.base.text import one_line
from muslin.reading import source
from muslin.student.checking import ERROR, WRONG, Report
from muslin.student.workspace import Workspace

#: Longest message [characters].
LONGEST = 600


def line_of(workspace: Workspace, report: Report) -> int:
    """The line a report is about: the one that it names, else that of the function."""
    entry = workspace.table.tasks[report.task]
    for text in (report.message, report.mistake, *report.notes):
        named = re.search(rf"{re.escape(entry.file)}, line (\d+)", text) or re.search(
            r"\b[Ll]ine (\d+)\b", text
        )
        if named:
            return int(named[1])
    try:
        functions = source.Source(source.read(workspace.file(entry))).functions
    except MuslinError:
        return 1
    return int(functions[report.task].node.lineno) if report.task in functions else 1


def lines(workspace: Workspace, reports: Iterable[Report]) -> list[str]:
    """A line for each task that fails."""
    found = []
    for report in reports:
        if report.status in (WRONG, ERROR):
            told = " ".join(filter(None, (_said(report.message), report.mistake, report.advice)))
            file = workspace.table.tasks[report.task].file
            message = f"{report.task}: {one_line(told, LONGEST)}"
            found.append(f"{file}:{line_of(workspace, report)}: error: {message}")
    return found


def _said(message: str) -> str:
    """A message without the numbers and the code in it: the file is in view. What stands below the mark says why."""
    first, *more = message.split("\n")
    mark = next((k for k, line in enumerate(more, 1) if line.strip() and not line.strip(" ^")), len(more))
    return " ".join([first, *more[mark:]])
