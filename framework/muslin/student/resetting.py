"""Back to what was given: one function, or a whole file; a copy of what was there is kept, and put back on request."""

from __future__ import annotations

import json
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import source, syntax
from muslin.student.workspace import Workspace, checksum

#: Beside the copy of a file that was reset: what was reset, and the checksum of what the file was then.
NOTE = "reset.json"


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
        backup = workspace.back_up(path, label=name)
        kept = f"\nWhat you had is kept in {paths.shown(backup / file)}.bak; to have it back: muslin reset --undo"
    source.write(path, text)
    if kept:
        note = {"word": name, "file": file, "left": checksum(path.read_bytes())}
        (backup / NOTE).write_text(json.dumps(note) + "\n", encoding="utf-8")
    return f"{word} is back to the stub.{kept}"


def undo(workspace: Workspace) -> str:
    """Put back what the latest reset that still stands took away.

    What was written into the file since then stays where it is another function's, and is kept in any case.

    Returns
    -------
    str
        What was done, for people.

    Raises
    ------
    MuslinError
        If no reset is left to undo, or the copy is gone.
    """
    notes = sorted(
        (workspace.hidden / "backup").glob(f"*/{NOTE}"), key=lambda path: (path.stat().st_mtime_ns, path)
    )
    if not notes:
        raise MuslinError(f"There is no reset to undo in {paths.shown(workspace.folder)}.")
    note = notes[-1]
    about = json.loads(note.read_text(encoding="utf-8"))
    word, file = about["word"], about["file"]
    path, copy = workspace.folder / file, note.parent / f"{file}.bak"
    if not copy.is_file():
        raise MuslinError(f"{paths.shown(copy)} is gone, so the reset of {word} cannot be undone.")
    kept = ""
    if path.is_file() and checksum(path.read_bytes()) != about["left"]:
        backup = workspace.back_up(path, label=f"undo-{word}")
        kept = f"\nWhat you wrote since is kept in {paths.shown(backup / file)}.bak."
    piece = _piece(copy, word) if kept and word != file else None
    if piece is None:
        path.write_bytes(copy.read_bytes())
    else:
        source.write(path, _with(workspace, word, piece))
    note.rename(note.with_name("undone.json"))
    return f"{word} is what it was before it was reset.{kept}"


def _piece(copy: Path, task: str) -> str | None:
    """The text of a task's function in a file; None if it cannot be told where it is."""
    rows = syntax.lines(source.read(copy))
    cut = _cut(rows, task)
    return None if cut is None else "".join(rows[cut.start : cut.stop])


def _without(workspace: Workspace, task: str) -> str:
    """The file's text with the function as it was given."""
    file = workspace.table.tasks[task].file
    given = source.Source(workspace.given(file), f"{file} as given")
    if not (workspace.folder / file).is_file():
        return given.text
    return _with(workspace, task, given.piece(given.functions[task].lines))


def _with(workspace: Workspace, task: str, piece: str) -> str:
    """The text of a task's file with another text of its function."""
    file = workspace.table.tasks[task].file
    path = workspace.folder / file
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
