"""Which assignment files answer, where nothing says so: by their names, and by what their functions take."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks.manifest import Assignment, assignment

#: What is assumed where names tell nothing.
USUAL = "cloth"

_DEF = re.compile(r"^def[ \t]+(\w+)[ \t]*\(([^()]*)\)", re.MULTILINE)


def known() -> dict[str, Assignment]:
    """Every assignment there is, but those whose manifest cannot be read."""
    found = {}
    for name in paths.assignments():
        with contextlib.suppress(MuslinError):
            found[name] = assignment(name)
    return found


def fitting(files: Mapping[str, str]) -> list[str]:
    """The assignments that files may answer: most task files are there, and of those most functions take what is asked.

    Parameters
    ----------
    files : dict of str
        Name of a file -> its text, which is read, not run.

    Returns
    -------
    list of str
        None where there is no task file of any; several where nothing tells them apart.
    """
    tables = known()
    there = {name: len({*table.files} & {*files}) for name, table in tables.items()}
    most = max(there.values(), default=0)
    named = [name for name in tables if most and there[name] == most]
    fit = {name: fits(files, tables[name]) for name in named}
    return [name for name in named if fit[name] == max(fit.values())]


def fits(files: Mapping[str, str], table: Assignment) -> int:
    """How many functions in files take the arguments that their tasks say."""
    said = {file: signatures(text) for file, text in files.items()}
    return sum(
        said.get(task.file, {}).get(task.name) == [argument.name for argument in task.arguments]
        for task in table.tasks.values()
    )


def another(files: Mapping[str, str], table: Assignment) -> str:
    """The assignment whose functions these are, where none takes what this one asks; empty if there is none."""
    if fits(files, table):
        return ""
    fit = {name: fits(files, other) for name, other in known().items()}
    best = max(fit, key=lambda name: fit[name], default="")
    return best if best and fit[best] else ""


def signatures(text: str) -> dict[str, list[str]]:
    """Functions that begin in the first column of a file, and what they take; also of one that Python cannot read."""
    found = {}
    for name, arguments in _DEF.findall(text):
        plain = re.sub(r"#[^\n]*", "", arguments)
        found[name] = [re.split(r"[:=]", part)[0].strip() for part in plain.split(",") if part.strip()]
    return found
