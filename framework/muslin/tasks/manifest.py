"""The task table of an assignment: the single list of what a student fills in.

A manifest (`assignment.toml`, beside the solution and in every released assignment) drives stub generation, loading,
checking, points, hints and the handout's tables.
"""

from __future__ import annotations

import functools
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError, choices
from muslin.base.text import one_line
from muslin.tasks.constants import OF, Constants, of, personal, read
from muslin.tasks.kinds import GRAMMAR, form
from muslin.tasks.wiring import Wiring

MANIFEST = "assignment.toml"

#: Folder of scripts that measure something with a student's functions, in an assignment and in a workspace.
EXPERIMENTS = "experiments"

#: Languages a task's function may be written in.
LANGUAGES = ("taichi", "python")


@dataclass(frozen=True)
class Value:
    """An argument or a result of a task: its kind (see `form`), unit and meaning."""

    name: str
    kind: str
    unit: str
    meaning: str = ""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one sample."""
        return form(self.kind)[0]

    @property
    def integer(self) -> bool:
        """Whether it is an integer."""
        return form(self.kind)[1]

    @property
    def is_function(self) -> bool:
        """Whether it is a function, which is built from the arrays of a case where the task runs."""
        return self.kind == FUNCTION


#: Kind of an argument that is a function.
FUNCTION = "function"


@dataclass(frozen=True)
class Task:
    """One function a student fills in.

    Attributes
    ----------
    arguments : tuple of Value
        What the function takes, in order.
    results : tuple of Value
        What it returns, in order.
    needs : tuple of str
        Tasks without which this one cannot be tried in the simulator; every task is checked on its own, whatever the
        state of the others.
    language : str
        "taichi": a `@ti.func` on small vectors and matrices; "python": a plain function on NumPy arrays.
    problem : tuple of Value
        Arrays of a case that the function does not see, but the functions it takes are built from.
    builder : str
        File of the assignment with a function of the task's name that builds them: arrays by name -> functions by name.
    called : Wiring
        How Muslin calls the function, where it is otherwise than the assignment asks for.
    """

    name: str
    file: str
    section: str
    title: str
    points: int
    arguments: tuple[Value, ...]
    results: tuple[Value, ...]
    needs: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()
    language: str = "taichi"
    problem: tuple[Value, ...] = ()
    builder: str = ""
    called: Wiring | None = None

    @property
    def inputs(self) -> tuple[Value, ...]:
        """The arrays that make a case: those the function sees, then those of the problem."""
        return (*self.seen, *self.problem)

    @property
    def seen(self) -> tuple[Value, ...]:
        """The arguments that are arrays."""
        return tuple(value for value in self.arguments if not value.is_function)

    @property
    def in_python(self) -> bool:
        """Whether it is written in plain Python over NumPy arrays."""
        return self.language == "python"


@dataclass(frozen=True)
class Grading:
    """How an assignment is graded: the manifest's `[grading]`.

    Attributes
    ----------
    deadline, simulation_deadline : float
        Processor time and sleep that a task may take for an answer, and the simulation, compilation included [s].
    hidden_cases : int
        Random cases drawn per task for every submission.
    credit : mapping
        Share of a task's points for each layer of its checks, earned only if all layers before it have passed.
    """

    deadline: float = 20.0
    simulation_deadline: float = 60.0
    hidden_cases: int = 20
    credit: Mapping[str, float] = field(default_factory=lambda: {"hidden": 0.7, "properties": 0.3})


@dataclass(frozen=True)
class Simulation:
    """The run that all functions of an assignment make together: the manifest's `[simulation]`.

    Attributes
    ----------
    scene : str
        One of Muslin's, small and short.
    compared_steps : int
        How many of its steps are held against the reference: what touches is chaotic after a while.
    parameters : mapping
        Of the scene.
    shown : mapping
        Parameters of whichever scene `muslin run` shows a student's functions in, unless they are set.
    """

    scene: str
    compared_steps: int = 30
    parameters: Mapping[str, Any] = field(default_factory=dict)
    shown: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Question:
    """A question that is answered in words and marked by hand, its points on top of the tasks': `[written.NAME]`."""

    name: str
    section: str
    title: str
    points: int


@dataclass(frozen=True)
class Assignment:
    """A manifest, read."""

    name: str
    title: str
    version: str
    tasks: Mapping[str, Task]
    grading: Grading = Grading()
    simulation: Simulation | None = None
    written: Mapping[str, Question] = field(default_factory=dict)
    energy: str = ""  # which of a body's energies its functions write; default the body's first
    constants: Constants | None = None  # each student's own, if it has such

    @property
    def student(self) -> str:
        """Whose it is, of an assignment with constants of each student's own."""
        return self.name.partition(OF)[2]

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files a student hands in, in the order of the handout."""
        return tuple(dict.fromkeys(task.file for task in self.tasks.values()))

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the files beside them that a student is given and hands back unread: what builds arguments."""
        return tuple(dict.fromkeys(task.builder for task in self.tasks.values() if task.builder))


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
            f'Write "kind [unit] meaning" with a kind from: {GRAMMAR}.',
        ) from None
    return Value(name, match[1], match[2], match[3] or "")


def _task(name: str, entry: Mapping[str, Any]) -> Task:
    """A task as the manifest says it."""
    task = Task(
        name=name,
        file=entry["file"],
        section=entry["section"],
        title=entry["title"],
        points=entry["points"],
        arguments=_values(entry["arguments"], functions=entry.get("language") == "python"),
        results=_values(entry["results"]),
        needs=tuple(entry.get("needs", ())),
        hints=tuple(entry.get("hints", ())),
        language=entry.get("language", "taichi"),
        problem=_values(entry.get("problem", {})),
        builder=entry.get("builder", ""),
        called=_wiring(entry["called"]) if "called" in entry else None,
    )
    if task.language not in LANGUAGES:
        raise MuslinError(
            f"{name}: there is no language {task.language!r}.", f"There is: {', '.join(LANGUAGES)}."
        )
    if any(value.is_function for value in task.arguments) != bool(task.builder):
        raise MuslinError(
            f"{name}: a task that takes functions names the file that builds them, and no other does.",
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
        tasks = {name: _task(name, entry) for name, entry in table["task"].items()}
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
        raise MuslinError(f"{paths.shown(path)} lacks the entry {error}.") from None


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
        If there is no such assignment; the message lists those there are.
    """
    for folder in (paths.assignment(name), paths.source(name)):
        if (folder / MANIFEST).is_file():
            return _of_student(folder, name) if OF in name else read_assignment(folder)
    raise MuslinError(f"There is no assignment {name!r}.", choices(name, paths.assignments()))


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
