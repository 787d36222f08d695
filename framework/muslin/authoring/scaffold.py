"""A new task or a new assignment, that works at once: `templates` with the names filled in.

What a task needs in five places is written in all of them: the manifest, the solution, the handout, how its
reference cases come about (`reference.py`) and the misconception suite. Then it is released and its reference
data are made, so that `muslin check`, `muslin grade` and `muslin lint` can be asked about it from the start.
Nothing that exists is ever overwritten; if anything goes wrong, all files are as before.
"""

from __future__ import annotations

import keyword
import re
import shutil
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from muslin import tasks
from muslin.authoring import mistakes, reference_data
from muslin.authoring import release as releasing
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks import MANIFEST, Assignment


def new_assignment(name: str, task: str = "example") -> list[Path]:
    """Write an assignment with one task.

    Parameters
    ----------
    name : str
        Small letters, digits and hyphens; the folder in `solutions/` and `assignments/`.
    task : str
        Its first task.

    Returns
    -------
    list of Path
        The files to go on with.

    Raises
    ------
    MuslinError
        If the name cannot be used or is taken.
    """
    place = paths.new_home()
    if not re.fullmatch(r"[a-z][a-z0-9_-]*", name):
        raise MuslinError(
            f"{name!r} cannot be the name of an assignment.", "Use small letters, digits and -."
        )
    parts = (paths.source(name), paths.assignment(name), paths.reference(name), place / "solutions" / name)
    if taken := [folder for folder in parts if folder.exists()]:
        raise MuslinError(f"There already is {paths.shown(taken[0])}.", "Choose another name.")
    source = place / "solutions" / name
    source.mkdir(parents=True)  # so that all else finds its place beside it
    try:
        return _begun(name, task, source)
    finally:
        if source.is_dir() and not any(source.iterdir()):
            source.rmdir()


def _begun(name: str, task: str, source: Path) -> list[Path]:
    names = {"assignment": name}
    begun = {source / MANIFEST: _filled("assignment.toml", names)}
    begun[source / releasing.HANDOUT] = _filled("handout.md", names)
    return _write(name, begun, task, None, None)


def new_task(
    name: str, assignment: str = "cloth", file: str | None = None, section: str | None = None
) -> list[Path]:
    """Add a task to an assignment.

    Parameters
    ----------
    name : str
        The function's name.
    assignment : str
    file : str, optional
        The file it goes to, new or not; default one of its own.
    section : str, optional
        The handout's section it belongs to, new or not; default a new one.

    Returns
    -------
    list of Path
        The files to go on with.

    Raises
    ------
    MuslinError
        If the name cannot be used or is taken, or there is no such assignment.
    """
    paths.new_home()
    source = paths.source(assignment)
    if not (source / MANIFEST).is_file():
        tasks.assignment(assignment)  # says which there are
    texts = {
        path: path.read_text(encoding="utf-8") for path in (source / MANIFEST, source / releasing.HANDOUT)
    }
    return _write(assignment, texts, name, file, section, tasks.read_assignment(source))


def _write(
    assignment: str,
    texts: Mapping[Path, str],
    task: str,
    file: str | None,
    section: str | None,
    table: Assignment | None = None,
) -> list[Path]:
    """Write manifest and handout (`texts`, so far) with a task added, and everything else it needs."""
    known = table.tasks if table else {}
    file = file or f"{task}.py"
    section = section or _next_section([entry.section for entry in known.values()])
    _require_names(task, file, section, list(known))
    source = paths.source(assignment)
    names = {"assignment": assignment, "task": task, "file": file, "section": section}
    suite = paths.misconceptions(assignment) / f"{task}.py"
    if suite.exists():
        raise MuslinError(f"There already is {paths.shown(suite)}.", "Choose another name.")
    written = dict(texts)
    written[source / MANIFEST] += _filled("task.toml", names)
    handout = source / releasing.HANDOUT
    written[handout] = _taught(written[handout], names, [entry.section for entry in known.values()])
    for path, begin, more in (
        (source / file, "file.py.template", "function.py.template"),
        (paths.generator(assignment), "reference.py.template", "reference_task.py.template"),
    ):
        begun = path.read_text(encoding="utf-8") if path.is_file() else _filled(begin, names)
        written[path] = begun.rstrip("\n") + "\n" + _filled(more, names)
    written[suite] = _filled("misconceptions.py.template", names)
    folders = (
        source, paths.assignment(assignment), paths.reference(assignment), paths.known(assignment), suite.parent,
    )  # fmt: skip
    before = {folder: _contents(folder) for folder in folders}
    try:
        for path, text in written.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        releasing.release(assignment)
        reference_data.build(assignment, only=[task] if known else ())
        list(mistakes.build(assignment, [task]))
    except BaseException:
        for folder, contents in before.items():
            _restore(folder, contents)
        raise
    return sorted(written)


def _contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _restore(folder: Path, contents: Mapping[Path, bytes]) -> None:
    """Make a folder hold just what it held."""
    if not contents:
        shutil.rmtree(folder, ignore_errors=True)
    for path in _contents(folder).keys() - contents.keys():
        path.unlink()
    for path, content in contents.items():
        path.write_bytes(content)


def _taught(handout: str, names: Mapping[str, str], sections: list[str]) -> str:
    """The handout with a place for the task: in its section, or in a new one after the last with tasks."""
    place = _end_of(names["section"], handout)
    text = _filled("task.md", names)
    if place is None:
        places = [end for section in sections if (end := _end_of(section, handout)) is not None]
        place = max(places, default=len(handout))
        text = _filled("section.md", names) + text
    before, after = handout[:place].rstrip("\n"), handout[place:].lstrip("\n")
    return f"{before}\n{text}" + (f"\n{after}" if after else "")


def _end_of(section: str, handout: str) -> int | None:
    """Where a section of the handout ends; None if there is none."""
    begin = re.search(rf"^## +{re.escape(section)}\b.*$", handout, re.MULTILINE)
    if begin is None:
        return None
    following = re.compile(r"^## ", re.MULTILINE).search(handout, begin.end())
    return following.start() if following else len(handout)


def _next_section(sections: list[str]) -> str:
    numbers = [int(match[1]) for section in sections if (match := re.fullmatch(r"S(\d+)", section))]
    return f"S{max(numbers, default=0) + 1}"


def _require_names(task: str, file: str, section: str, known: list[str]) -> None:
    if not task.isidentifier() or keyword.iskeyword(task):
        raise MuslinError(f"{task!r} cannot be the name of a function.", "Use letters, digits and _.")
    if task in known:
        raise MuslinError(f"There already is a task {task}.", "Choose another name.")
    if not re.fullmatch(r"[A-Za-z_]\w*\.py", file) or file == "reference.py":
        raise MuslinError(f"{file!r} cannot be a file of tasks.", "Name it like kinetic_energy.py.")
    if not re.fullmatch(r"[A-Za-z]\w*", section):
        raise MuslinError(f"{section!r} cannot be a section.", "Name it like S3.")


def _filled(template: str, names: Mapping[str, str]) -> str:
    text = (resources.files("muslin.authoring") / "templates" / template).read_text(encoding="utf-8")
    for name, value in names.items():
        text = text.replace(f"@{name}@", value)
    return text
