"""A student's folder: make one, find one, and what Muslin remembers in it.

`.muslin/` in the folder holds `workspace.json` (which assignment in which version, and the checksums of what
was given), `given/` (the task files as given, the base of every merge), `state.json` (verdicts, hints shown)
and `backup/`; copies have other names than task files, so that nobody takes one for the other. A folder with
task files but without `.muslin` works too; only nothing is remembered in it.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.version import __version__
from muslin.reading import source, syntax
from muslin.student import editors
from muslin.tasks import EXPERIMENTS, MANIFEST, Assignment, Task, assignment, named_in
from muslin.tasks.constants import personal
from muslin.tasks.guessing import USUAL, fitting

FOLDER = ".muslin"
HANDOUT, PAGE = "README.md", "handout.html"

#: Files in which a student's own constants are written.
PERSONAL = (".py", ".md", ".html", ".toml")


@dataclass(frozen=True)
class Workspace:
    """A folder with task files, and the assignment they answer.

    `started` says whether `muslin start` made it, so that things can be remembered in it; `forgotten` says why
    that could not be, and `aside` holds it meanwhile.
    """

    folder: Path
    table: Assignment
    started: bool
    forgotten: list[str] = field(default_factory=list, compare=False)
    aside: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def scene(self) -> str:
        """The scene that is run where none is named, in which all functions are graded; empty if there is none."""
        return self.table.simulation.scene if self.table.simulation is not None else ""

    def next_step(self, scene: str = "") -> str:
        """What comes when every task is green; `scene`: to be run in place of the usual one."""
        hand_in = "muslin submit packs them to hand in."
        if scene := scene or self.scene:
            return f"muslin run {scene} shows what your functions do; {hand_in}"
        if any((self.folder / EXPERIMENTS).glob("*.py")):
            return f"muslin experiment shows what can be tried with your functions; {hand_in}"
        return hand_in.replace("them", "your functions")

    @property
    def hidden(self) -> Path:
        """Where Muslin keeps what it remembers."""
        return self.folder / FOLDER

    def file(self, task: Task) -> Path:
        """Path of the file a task is in."""
        return self.folder / task.file

    def given(self, name: str) -> str:
        """Text of a task file as it was given."""
        kept = self.hidden / "given" / f"{name}.given"
        if kept.is_file():
            return source.read(kept)
        return given_files(self.table.name)[name].decode("utf-8")

    def described(self) -> dict[str, Any]:
        """The version file: assignment, version, checksums; empty where there is none."""
        return _json(self.hidden / "workspace.json")

    @property
    def version(self) -> str:
        """Version of what is in the folder."""
        return str(self.described().get("version", self.table.version))

    # --- what is remembered -----------------------------------------------------------------------------

    def memory(self) -> dict[str, Any]:
        """Verdicts, hints shown: {"verdicts": {task: ...}, "hints": {task: level}}."""
        return {"verdicts": {}, "hints": {}, **_json(self.hidden / "state.json"), **self.aside}

    def remember(self, kind: str, task: str, what: Any) -> bool:
        """Keep something about a task; whether it could be: not in a folder that was not started or is read-only."""
        if not self.started:
            return False
        state = self.memory()
        state[kind] = {**state[kind], task: what}
        try:
            source.write(self.hidden / "state.json", json.dumps(state, indent=1) + "\n")
        except MuslinError as error:  # what was asked for is more than the memory of it
            self.forgotten[:] = [f"What was found is forgotten again: {error}"]
            self.aside.update(state)
        return not self.forgotten

    def back_up(self, *files: Path, label: str = "") -> Path:
        """Keep copies of files as they are now; returns the folder they are in."""
        stamp = time.strftime("%Y-%m-%d-%H%M%S") + (f"-{label}" if label else "")
        folder, k = self.hidden / "backup" / stamp, 2
        while folder.exists():
            folder, k = folder.with_name(f"{stamp}-{k}"), k + 1
        try:
            for file in files:
                copy = folder / f"{file.relative_to(self.folder)}.bak"
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.write_bytes(file.read_bytes())
        except OSError as error:
            raise MuslinError(f"{paths.shown(folder)} cannot be written: {error.strerror}.") from None
        return folder

    def key(self, task: str, texts: Mapping[str, str] | None = None) -> str:
        """What the verdict on a task depends on: the function, and the reference data."""
        entry = self.table.tasks[task]
        file = self.file(entry)
        if texts is not None:
            text = texts.get(entry.file, "")
        else:
            text = source.glimpse(file)
        return f"{source.fingerprint(text, task)[:20]}-{reference_sum(self.table.name, task)[:12]}"

    def place(self, task: str) -> str:
        """Where a student finds a task's function: `file:line`."""
        entry = self.table.tasks[task]
        where = paths.shown(self.file(entry))
        try:
            functions = source.Source(source.read(self.file(entry))).functions
            return f"{where}:{functions[task].node.lineno}" if task in functions else where
        except MuslinError:
            return where

    def chapter(self, task: str) -> str:
        """Where the handout explains a task: `README.md:line (section), page`."""
        entry = self.table.tasks[task]
        handout = self.folder / HANDOUT
        where = f"section {entry.section}, {task}"
        if handout.is_file():
            lines = syntax.lines(handout.read_text(encoding="utf-8", errors="replace"))
            line = next(
                (k + 1 for k, text in enumerate(lines) if text.strip("# \r\n") == task and "#" in text), 1
            )
            where = f"{paths.shown(handout)}:{line} ({where})"
        page = self.page(task)
        return f"{where}, {page}" if page else f"{where} of the handout"

    def page(self, task: str | None = None) -> str:
        """Address of the handout as a page that a browser shows, at a task; empty if there is none."""
        here = [folder / PAGE for folder in (self.folder, paths.assignment(self.table.name))]
        found = next((page.resolve().as_uri() for page in here if page.is_file()), "")
        return f"{found}#{task.lower()}" if found and task else found


def find(folder: Path | None = None) -> Workspace:
    """The workspace in a folder; without one, in the working folder or the nearest above it.

    Raises
    ------
    MuslinError
        If there is none.
    """
    start = Path.cwd() if folder is None else folder
    if not start.is_dir():
        raise MuslinError(
            f"There is no folder {paths.shown(start)}.", f"Make a workspace with: {_starting()}"
        )
    for place in (start, *(start.resolve().parents if folder is None else ())):
        if (about := _json(place / FOLDER / "workspace.json")).get("assignment"):
            return Workspace(place, _somebodys(assignment(about["assignment"]), place), True)
        if place == start:
            table = assignment(_named(place, folder is not None))
            if any((place / file).is_file() for file in table.files):
                return Workspace(place, _somebodys(table, place), False)
    raise MuslinError(
        f"There are no task files in {paths.shown(start)}, and it is not in a workspace.",
        f"Go to your workspace, or make one with: {_starting()}",
    )


def _starting() -> str:
    """How a workspace is made, of any assignment there is."""
    return f"muslin start {'|'.join(paths.assignments())}"


def _somebodys(table: Assignment, folder: Path) -> Assignment:
    """An assignment, unless each student has constants of their own in it and nobody knows whose these are."""
    if table.constants is None or table.student or folder.resolve() == paths.source(table.name).resolve():
        return table
    raise MuslinError(
        f"Everybody has constants of their own in {table.name}, and {paths.shown(folder)} does not say whose.",
        f"Make a workspace that does: muslin start {table.name} --student ID",
    )


def _named(folder: Path, elsewhere: bool) -> str:
    """Which assignment a folder answers: by its manifest, the workspace one is in, or its files; else the usual one.

    `elsewhere`: it was named, so that what is asked of it may be asked in a workspace.

    Raises
    ------
    MuslinError
        If it names one that there is not.
    """
    try:
        text = (folder / MANIFEST).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        text = ""
    if said := named_in(text, paths.shown(folder)):
        return said
    here = _around(Path.cwd()) if elsewhere else None
    if here:
        return here
    found = fitting({path.name: _text(path) for path in folder.iterdir()})
    return USUAL if USUAL in found or not found else found[0]


def _text(path: Path) -> str:
    """A file as text; nothing where that cannot be read, or is no file of Python."""
    try:
        return path.read_text(encoding="utf-8", errors="replace") if path.suffix == ".py" else ""
    except OSError:
        return ""


def _around(place: Path) -> str | None:
    """The assignment of the workspace that a folder is in, if it is in one that there is."""
    about = (_json(folder / FOLDER / "workspace.json") for folder in (place, *place.parents))
    name = next(filter(None, (found.get("assignment") for found in about)), None)
    return name if name and paths.bare(name) in paths.assignments() else None


def given_files(name: str) -> dict[str, bytes]:
    """What an assignment gives a student, by relative path.

    Raises
    ------
    MuslinError
        If there is no such assignment.
    """
    table, folder = assignment(name), paths.assignment(name)
    found = {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith((".", "__pycache__")) for part in path.parts[-2:])
    }
    if not (table.constants and table.student):
        return found
    texts = {file: data.decode("utf-8") for file, data in found.items() if Path(file).suffix in PERSONAL}
    texts = {file: table.constants.written(text, table.student) for file, text in texts.items()}
    texts[MANIFEST] = personal(texts[MANIFEST], name)
    return found | {file: text.encode("utf-8") for file, text in texts.items()}


def start(name: str, folder: Path) -> list[str]:
    """Make a workspace; nothing that is there is overwritten.

    Parameters
    ----------
    name : str
        The assignment.
    folder : Path

    Returns
    -------
    list of str
        The files written, relative to the folder.

    Raises
    ------
    MuslinError
        If something that would be written is there already; then nothing is written.
    """
    given = given_files(name)
    table = _somebodys(assignment(name), folder)
    if folder.exists() and not folder.is_dir():
        raise MuslinError(f"{paths.shown(folder)} is a file.", "Name another folder.")
    if (about := _json(folder / FOLDER / "workspace.json")).get("assignment"):
        raise MuslinError(
            f"{paths.shown(folder)} is a workspace already ({about['assignment']} {about.get('version', '')}); "
            "nothing was changed.",
            "Go there and type: muslin list",
        )
    files = {**given, **{path: text.encode() for path, text in editors.settings(folder).items()}}
    files |= {f"{FOLDER}/given/{file}.given": given[file] for file in table.files}
    files[f"{FOLDER}/workspace.json"] = description(name).encode()
    if there := [file for file in files if (folder / file).exists()]:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise MuslinError(
            f"{paths.shown(folder / there[0])}{more} is there already; nothing was written.",
            f"Name a new folder: muslin start {name} DIR",
        )
    for file, content in files.items():
        path = folder / file
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as stream:
                stream.write(content)
        except OSError as error:
            raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None
    return sorted(file for file in files if not file.startswith(FOLDER))


def description(name: str, sums: Mapping[str, str] | None = None) -> str:
    """Text of the version file: what the workspace was last given.

    Parameters
    ----------
    name : str
        The assignment.
    sums : mapping, optional
        Checksums of files that are not as this Muslin gives them, by relative path.
    """
    table = assignment(name)
    return (
        json.dumps(
            {
                "assignment": name,
                "version": table.version,
                "muslin": __version__,
                "files": {**{f: checksum(data) for f, data in given_files(name).items()}, **(sums or {})},
                "reference": {task: reference_sum(name, task) for task in table.tasks},
            },
            indent=1,
        )
        + "\n"
    )


def checksum(data: bytes) -> str:
    """sha256 of a file's content; of text whatever its line ends."""
    return hashlib.sha256(data.replace(b"\r\n", b"\n")).hexdigest()


def reference_sum(name: str, task: str) -> str:
    """Checksum of a task's public cases; empty where there are none."""
    path = paths.reference(name) / f"{task}.npz"
    return checksum(path.read_bytes()) if path.is_file() else ""


def _json(path: Path) -> dict[str, Any]:
    """A JSON object, empty if the file is missing or damaged."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}
