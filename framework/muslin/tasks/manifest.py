"""The task table of an assignment: the single list of what a student fills in.

A manifest (`assignment.toml`, beside the solution and in every released assignment) drives stub generation, loading,
checking, points, hints and the handout's tables.
"""

from __future__ import annotations

import functools
import re
import sys
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError, choices, near
from muslin.base.text import one_line
from muslin.tasks.authored import AuthorError
from muslin.tasks.constants import OF, of, personal, read
from muslin.tasks.kinds import GRAMMAR
from muslin.tasks.kinds import form as form
from muslin.tasks.table import FUNCTION, LANGUAGES, Assignment, Grading, Question, Simulation, Task, Value
from muslin.tasks.wiring import Wiring

MANIFEST = "assignment.toml"

#: Folder of scripts that measure something with a student's functions, in an assignment and in a workspace.
EXPERIMENTS = "experiments"

#: What is said of it after all other kinds: where a task is in Python, and where it is not.
_OF_PYTHON = (f'; {FUNCTION} where language = "python"', f", {FUNCTION}")


def _values(entries: Mapping[str, str], functions: bool = False) -> tuple[Value, ...]:
    return tuple(_value(name, text, functions) for name, text in entries.items())


def _value(name: str, text: str, functions: bool) -> Value:
    match = re.fullmatch(r"(\w+) \[([^\]]*)\](?: (.*))?", text)
    try:
        if not match or not ((functions and match[1] == FUNCTION) or form(match[1])):
            raise MuslinError("")
    except MuslinError:
        raise MuslinError(
            f"{name} = {text!r} does not describe a value.",
            f'Write "kind [unit] meaning" with a kind from: {GRAMMAR}{_OF_PYTHON[functions]}.',
        ) from None
    return Value(name, match[1], match[2], match[3] or "")


def _task(name: str, entry: Mapping[str, Any], where: str) -> Task:
    """A task as the manifest says it; errors say `where` it stands."""
    try:
        return _entry(name, entry)
    except KeyError as error:
        asked = {field.name for field in fields(Task)}
        alike = near(str(error.args[0]), [key for key in entry if key not in asked])
        hint = f"There is {alike!r}: rename it." if alike else "Add it."
        raise MuslinError(f"{where}, {name}: it lacks the entry {error}.", hint) from None
    except MuslinError as error:
        raise MuslinError(f"{where}, {name}: {error.message}", error.hint) from None


def _entry(name: str, entry: Mapping[str, Any]) -> Task:
    """What an entry of the table says."""
    language = entry.get("language", LANGUAGES[0])
    if language not in LANGUAGES:
        raise MuslinError(f"there is no language {language!r}.", choices(str(language), LANGUAGES))
    task = Task(
        name=name,
        file=entry["file"],
        section=entry["section"],
        title=entry["title"],
        points=entry["points"],
        arguments=_values(entry["arguments"], functions=language == "python"),
        results=_values(entry["results"]),
        needs=tuple(entry.get("needs", ())),
        hints=tuple(entry.get("hints", ())),
        language=language,
        problem=_values(entry.get("problem", {})),
        builder=entry.get("builder", ""),
        called=_wiring(entry["called"]) if "called" in entry else None,
    )
    if any(value.is_function for value in task.arguments) != bool(task.builder):
        raise MuslinError(
            "a task that takes functions names the file that builds them, and no other does.",
            f'Write builder = "problems.py" beside its arguments, and def {name} in that file.',
        )
    return task


def _question(name: str, entry: Mapping[str, Any], tasks: Mapping[str, Task]) -> Question:
    if name in tasks:
        raise MuslinError(f"A task and a written question are both called {name!r}.", "Rename the question.")
    return Question(name, entry["section"], entry["title"], entry["points"])


def _wiring(entry: Mapping[str, Any]) -> Wiring:
    expressions = {name: entry.get(name, {}) for name in ("give", "take", "back", "send")}
    return Wiring(_values(entry["arguments"]), _values(entry["results"]), **expressions)


#: What a manifest holds at its top.
_ENTRIES = {"schema", "task", "student", *(field.name for field in fields(Assignment))} - {"tasks"}


def read_assignment(folder: Path | str) -> Assignment:
    """Read the manifest in a folder.

    Raises
    ------
    MuslinError
        If there is no manifest or it cannot be understood.
    """
    path = Path(folder) / MANIFEST
    try:
        return _read(path, path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise MuslinError(f"There is no {MANIFEST} in {paths.shown(folder)}.") from None


@functools.lru_cache(maxsize=32)
def _read(path: Path, text: str) -> Assignment:
    """The assignment a manifest describes; what it says is read once."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib

    try:
        table = tomllib.loads(text)
        tasks = {name: _task(name, entry, paths.shown(path)) for name, entry in table["task"].items()}
        grading = _grading(table.get("grading", {}), path)
        simulation = _simulation(table["simulation"], path) if "simulation" in table else None
        written = {name: _question(name, entry, tasks) for name, entry in table.get("written", {}).items()}
        named, questions = (table["name"], table["title"], table["version"]), MappingProxyType(written)
        energy, constants = table.get("energy", ""), None
        if "constants" in table:
            constants = read(table["constants"], paths.shown(path))
            if student := table.get("student"):
                named = (of(named[0], str(student)), *named[1:])
                whose = named[0].partition(OF)[2]
                tasks = {name: constants.apply(task, whose) for name, task in tasks.items()}
        return Assignment(*named, MappingProxyType(tasks), grading, simulation, questions, energy, constants)
    except tomllib.TOMLDecodeError as error:
        raise MuslinError(f"{paths.shown(path)} is not valid TOML: {error}.") from None
    except KeyError as error:
        alike = near(str(error.args[0]), [key for key in table if key not in _ENTRIES])
        hint = f"There is {alike!r}: rename it." if alike else "Add it."
        raise MuslinError(f"{paths.shown(path)}: it lacks the entry {error}.", hint) from None


def _simulation(table: Mapping[str, Any], path: Path) -> Simulation:
    try:
        found = Simulation(**table)
        sound = (
            isinstance(found.scene, str)
            and isinstance(found.parameters, Mapping)
            and isinstance(found.shown, Mapping)
            and found.compared_steps > 0
        )
    except TypeError:
        sound = False
    if not sound:
        raise MuslinError(
            f"The table [simulation] in {paths.shown(path)} cannot be understood.",
            "It takes scene, compared_steps, parameters of the scene, and shown: those of muslin run.",
        )
    return found


def _grading(table: Mapping[str, Any], path: Path) -> Grading:
    try:
        grading = Grading(**table)
        shares = grading.credit.values()
        sound = all(share >= 0 for share in shares) and abs(sum(shares) - 1) < 1e-9
        sound = sound and set(grading.credit) <= {"form", "public", "hidden", "properties"}
        sound = sound and min(grading.deadline, grading.simulation_deadline) > 0 and grading.hidden_cases > 0
    except (TypeError, AttributeError):
        sound = False
    if not sound:
        raise MuslinError(
            f"The table [grading] in {paths.shown(path)} cannot be understood.",
            "It takes deadline, simulation_deadline, hidden_cases, and credit: shares of the layers form, "
            "public, hidden and properties that sum to 1.",
        )
    return grading


def assignment(name: str = "cloth") -> Assignment:
    """Assignment by name, from Muslin's own files.

    Raises
    ------
    MuslinError
        If there is no such assignment; the message lists those there are. Or if it has been changed since its release:
        everything else is asked of what students have.
    """
    for folder in (paths.assignment(name), paths.source(name)):
        if (folder / MANIFEST).is_file():
            _require_in_step(folder, paths.source(name), paths.bare(name))
            return _of_student(folder, name) if OF in name else read_assignment(folder)
    raise paths.unknown(name, paths.assignments())


def _require_in_step(released: Path, source: Path, name: str) -> None:
    """Refuse a released manifest that is no longer the solution's, where there is a solution."""
    try:
        texts = [(folder / MANIFEST).read_text(encoding="utf-8") for folder in (released, source)]
    except OSError:  # none here, or out of sight while a submission is graded
        return
    if texts[0] != texts[1] and read_assignment(released) != read_assignment(source):
        what = f"it has been changed since {name} was released"
        raise AuthorError(paths.shown(source / MANIFEST), what, f"Run: muslin release {name}")


def _of_student(folder: Path, name: str) -> Assignment:
    """A student's own assignment, from the manifest of everybody's."""
    path = folder / MANIFEST
    return _read(path, personal(path.read_text(encoding="utf-8"), name))


#: Most of an unknown assignment's name that is told [characters].
LONGEST_NAME = 60


def named_in(text: str, where: str) -> str | None:
    """The assignment that a manifest says it is of, if it says that; nothing else in it is believed.

    Parameters
    ----------
    text : str
        Anybody's `assignment.toml`.
    where : str
        What it lies in, for people.

    Raises
    ------
    MuslinError
        If there is no assignment of that name here.
    """
    before_tables = re.split(r"^\s*\[", text, maxsplit=1, flags=re.MULTILINE)[0]
    entry = r"""^%s *= *(["'])(.*?)\1 *(#.*)?$"""
    said = re.search(entry % "name", before_tables, re.MULTILINE)
    if said is None:
        return None
    if said[2] in (known := paths.assignments()):
        whose = re.search(entry % "student", before_tables, re.MULTILINE)
        return of(said[2], whose[2]) if whose and assignment(said[2]).constants else said[2]
    name = one_line(said[2], LONGEST_NAME)
    raise MuslinError(
        f"The {MANIFEST} of {where} names the assignment {name!a}, and there is none of that name here.",
        choices(name, known),
    )


def chosen_tasks(words: list[str] | None, assignment: Assignment) -> list[str]:
    """Tasks meant by words: each a task, a section of the handout (S7), or a file."""
    chosen: list[str] = []
    for word in words or ():
        file = Path(word).name
        found = [t.name for t in assignment.tasks.values() if word in (t.name, t.section) or file == t.file]
        if not found:
            raise MuslinError(f"There is no task {word!r}.", choices(word, assignment.tasks))
        chosen += [name for name in found if name not in chosen]
    return chosen
