"""Back to what was given: one function, or a whole file; a copy of what was there is kept."""

from __future__ import annotations

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import source, syntax
from muslin.student.workspace import Workspace


def reset(workspace: Workspace, word: str) -> str:
    """Put a task's function, or a file, back to the stub.

    Parameters
    ----------
    workspace : Workspace
    word : str
        A task or a task file.

    Returns
    -------
    str
        What was done, for people.

    Raises
    ------
    MuslinError
        If there is no such task or file, or the file cannot be read as Python.
    """
    tasks, name = workspace.table.tasks, word.rsplit("/", 1)[-1]
    if name in workspace.table.files:
        file, text = name, workspace.given(name)
    elif word in tasks:
        file = tasks[word].file
        text = _without(workspace, word)
    else:
        from muslin.tasks.manifest import chosen_tasks

        near = chosen_tasks([word], workspace.table)
        raise MuslinError(f"{word} has several tasks.", f"Name one: {', '.join(near)}.")
    path = workspace.folder / file
    kept = ""
    if path.is_file():
        if source.read(path) == text:
            return f"{word} is as it was given; nothing was changed."
        backup = workspace.back_up(path, label=word.rsplit("/", 1)[-1])
        kept = f" What you had is in {paths.shown(backup / file)}.bak."
    source.write(path, text)
    return f"{word} is back to the stub.{kept}"


def _without(workspace: Workspace, task: str) -> str:
    """The file's text with the function as it was given."""
    file = workspace.table.tasks[task].file
    path = workspace.folder / file
    given = source.Source(workspace.given(file), f"{file} as given")
    piece = given.piece(given.functions[task].lines)
    if not path.is_file():
        return given.text
    try:
        mine = source.Source(source.read(path), paths.shown(path))
    except MuslinError as error:
        rows = syntax.lines(source.read(path))
        cut = _cut(rows, task)
        if cut is None:
            raise MuslinError(
                f"{error.message}\nSo it cannot be told where {task} begins and ends; nothing was changed.",
                f"Fix that line, or start the whole file again: muslin reset {file} (what you have is kept beside it)",
            ) from None
        return "".join(rows[: cut.start]) + piece.rstrip("\n") + "\n" + "".join(rows[cut.stop :])
    if task not in mine.functions:
        return mine.text.rstrip("\n") + f"\n\n\n{piece}"
    where = mine.functions[task].lines
    after = "".join(mine.lines[where.stop :])
    return "".join(mine.lines[: where.start]) + (piece if piece.endswith("\n") else piece + "\n") + after


def _cut(rows: list[str], task: str) -> range | None:
    """Lines of a function in a file that Python cannot read; None if it cannot be told where they are."""
    found = [lines for name, lines in source.pieces(rows) if name == task]
    if len(found) != 1:
        return None
    (lines,) = found
    stop = lines.stop
    while stop > lines.start + 1 and (not rows[stop - 1].strip() or rows[stop - 1][0] == "#"):
        stop -= 1  # blank lines and comments in front of the next function are not its own
    return range(lines.start, stop)
