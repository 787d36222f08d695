"""A notebook made from an assignment's handout: text and formulas as they are, a cell for each function."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import source
from muslin.tasks import assignment

#: What pip is asked for, unless a course names its own source.
REQUIREMENT = "muslin[notebook]"

PICTURES = {".png": "image/png", ".jpg": "image/jpeg", ".svg": "image/svg+xml"}

#: What the first code cell does where Muslin is not installed, as on Colab.
INSTALL = """\
# Run this cell first. On Colab, or wherever Muslin is not installed yet, it installs it and makes your workspace.
import importlib.util, pathlib

if importlib.util.find_spec("muslin") is None:
    %pip install --quiet "{requirement}"
if not pathlib.Path("assignment.toml").is_file():
    if not pathlib.Path("{name}").is_dir():
        !muslin start {name}
    %cd -q {name}
%load_ext muslin
"""

#: What the examples of the handout assume.
EXAMPLES = """\
import numpy as np
import muslin
from muslin import evaluate

np.set_printoptions(precision=4, suppress=True)
"""

#: A run to turn and zoom.
VIEW = """\
from muslin.notebook import view

view("runs/{scene}")
"""

#: Sections of the handout that speak of a terminal and an editor: what stands in the notebook instead.
INSTEAD = {
    "Setting up": "",
    "How to work": """\
1. Each function has a cell that begins with `%%task`. Replace what stands below the docstring, and run the cell
   (Shift-Enter). The function is written into its file in this folder and checked against cases computed with far more
   digits than yours; below the cell stands what is wrong, the likely mistake, and what to try. The cell after it is the
   example from the text: run it too.
2. {run}`%muslin` takes every command: `%muslin list`, `%muslin hint {task}`,
   `%muslin explain {task} --case 3`, `%muslin reset {task}`.
3. `%muslin submit` packs the task files into the zip to hand in. Notebook and editor may be used side by side: a cell
   shows what it was last run with, the file is what counts.
""",
}

#: What is said of running, in an assignment that has a simulation.
RUN = """\
`%muslin run {scene}` simulates with your functions and shows the film here; where one is not right yet, Muslin's own
   code stands in. """

_HEADING = re.compile(r"^(#{2,3}) +(.+?) *#*$")


def notebook(name: str, requirement: str = REQUIREMENT) -> dict[str, Any]:
    """The notebook of an assignment, in the format of Jupyter (nbformat 4).

    Parameters
    ----------
    name : str
        The assignment.
    requirement : str
        What the first cell asks pip for where Muslin is not installed: a course names its own source.

    Raises
    ------
    MuslinError
        If there is no such assignment, or it has no handout.
    """
    table, folder = assignment(name), paths.assignment(name)
    handout = folder / "README.md"
    if not handout.is_file():
        raise MuslinError(f"The assignment {name} has no handout to make a notebook from.")
    text = re.sub(r"\A(<!--.*?-->\s*)+", "", handout.read_text(encoding="utf-8"), flags=re.DOTALL)
    parts = [(title, part) for title, part in _parts(text) if part.strip()]
    places = {slug(title): _plain(title).replace(" ", "-") for title, _ in parts}
    stubs = _stubs(folder, table.files)
    scene = table.simulation.scene if table.simulation is not None else ""
    filled_in = {"task": next(iter(table.tasks)), "run": RUN.format(scene=scene) if scene else ""}
    cells = []
    for title, part in parts:
        words = _plain(title)
        if words in INSTEAD:
            part = f"## {title}\n\n{INSTEAD[words].format(**filled_in)}" if INSTEAD[words] else ""
        if part:
            cells.append(_text(part, folder, places))
        if not title:
            cells.append(_code(INSTALL.format(name=name, requirement=requirement)))
        if words == "How to work":
            cells.append(_code(EXAMPLES))
        elif words in table.tasks:
            cells.append(_code(f"%%task {words}\n{stubs[words]}"))
            cells += [_code('f = muslin.load(".")\n' + example) for example in _examples(part)]
    cells.append(_text("## See it, and hand it in\n", folder, places))
    shows = (f"%muslin run {scene}", VIEW.format(scene=scene)) if scene else ()
    cells += [_code(text) for text in ("%muslin list", *shows, "%muslin submit")]
    for k, cell in enumerate(cells):
        cell["id"] = f"cell-{k}"
    return {
        "cells": cells,
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
            "muslin": {"assignment": name, "version": table.version},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def _stubs(folder: Path, files: Iterable[str]) -> dict[str, str]:
    """The text of every function as it is given, by name."""
    read = [source.Source(source.read(folder / file), file) for file in files]
    return {key: each.piece(f.lines).strip("\n") for each in read for key, f in each.functions.items()}


def _examples(part: str) -> list[str]:
    """What is typed in the examples of a part, without what comes back."""
    typed = []
    for block in re.findall(r"^```pycon\n(.*?)^```$", part, re.MULTILINE | re.DOTALL):
        lines = [line[4:] for line in block.splitlines() if line.startswith((">>> ", "... "))]
        typed.append("\n".join(lines))
    return typed


def slug(title: str) -> str:
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", _plain(title).lower()).replace(" ", "-")


def _plain(title: str) -> str:
    return re.sub(r"[`*]", "", title)


def write(name: str, folder: Path, requirement: str = REQUIREMENT) -> Path:
    """Write an assignment's notebook into a workspace; returns its path.

    Raises
    ------
    MuslinError
        If it is there already, or cannot be written.
    """
    path = folder / f"{name}.ipynb"
    text = json.dumps(notebook(name, requirement), indent=1, ensure_ascii=False) + "\n"
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise MuslinError(
            f"{paths.shown(path)} is there already; nothing was written.", "Rename it to get a new one."
        ) from None
    except OSError as error:
        raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None
    return path


def _parts(text: str) -> Iterator[tuple[str, str]]:
    """The handout, cut before each heading of the second and third level: (heading, text with it)."""
    title, lines, fenced = "", list[str](), False
    for line in text.split("\n"):
        fenced ^= line.lstrip().startswith("```")
        if not fenced and (found := _HEADING.match(line)):
            yield title, "\n".join(lines)
            title, lines = found[2], []
        lines.append(line)
    yield title, "\n".join(lines)


def _text(markdown: str, folder: Path, places: Mapping[str, str]) -> dict[str, Any]:
    """A cell of text: formulas as Jupyter writes them, links to its headings, pictures in the cell itself."""
    markdown = re.sub(r"\*\*Contents\*\*\n\n(?:- .*\n)+", "", markdown)
    markdown = re.sub(
        r"^( *)```math\n(.*?)^ *```$", r"\1$$\n\2\1$$", markdown, flags=re.MULTILINE | re.DOTALL
    )
    markdown = re.sub(r"\]\(#([\w-]+)\)", lambda m: f"](#{places.get(m[1], m[1])})", markdown)
    attachments: dict[str, dict[str, str]] = {}

    def picture(match: re.Match[str]) -> str:
        path = folder / match[2]
        if path.suffix not in PICTURES or not path.is_file():
            return match[0]
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        attachments[path.name] = {PICTURES[path.suffix]: data}
        return f"![{match[1]}](attachment:{path.name})"

    markdown = re.sub(r"!\[([^\]]*)\]\(([^)\s]+)\)", picture, markdown)
    cell = _cell("markdown", markdown)
    return {**cell, "attachments": attachments} if attachments else cell


def _code(text: str) -> dict[str, Any]:
    return {**_cell("code", text), "execution_count": None, "outputs": []}


def _cell(kind: str, text: str) -> dict[str, Any]:
    return {"cell_type": kind, "metadata": {}, "source": text.strip("\n").splitlines(keepends=True)}
