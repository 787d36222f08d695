"""The task table of an assignment, and any folder of student functions read against it.

A manifest (`assignment.toml`, beside the solution and in every released assignment) is the single list of what
a student fills in: it drives stub generation, loading, checking, points and the handout's tables. `load` reads
a folder by path, so any folder with those files is a submission. One broken file costs only its own tasks, and one
function that Python cannot read only itself, where it can be told from the others.
"""

from __future__ import annotations

import ast
import contextlib
import inspect
import re
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from muslin import importing, paths, reading
from muslin.engine import inside
from muslin.errors import MuslinError, NotImplementedYet, StudentCodeError, choices
from muslin.reading import vocabulary
from muslin.reading.page import sentence

MANIFEST = "assignment.toml"

#: What an argument or result may be: name -> (shape of one sample, is it an integer).
KINDS: Mapping[str, tuple[tuple[int, ...], bool]] = MappingProxyType(
    {
        "scalar": ((), False),
        "int": ((), True),
        "vec2": ((2,), False),
        "vec3": ((3,), False),
        "vec4": ((4,), False),
        "mat2": ((2, 2), False),
        "mat3": ((3, 3), False),
    }
)


@dataclass(frozen=True)
class Value:
    """An argument or a result of a task: its kind (a key of `KINDS`), unit and meaning."""

    name: str
    kind: str
    unit: str
    meaning: str = ""


@dataclass(frozen=True)
class Task:
    """One function a student fills in.

    `needs` names the tasks without which this one cannot be tried in the simulator; every task is checked on
    its own, whatever the state of the others.
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
class Assignment:
    """A manifest, read."""

    name: str
    title: str
    version: str
    tasks: Mapping[str, Task]
    grading: Grading = Grading()

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files a student hands in, in the order of the handout."""
        return tuple(dict.fromkeys(task.file for task in self.tasks.values()))


def _value(name: str, text: str) -> Value:
    match = re.fullmatch(r"(\w+) \[([^\]]*)\](?: (.*))?", text)
    if not match or match[1] not in KINDS:
        raise MuslinError(
            f"{name} = {text!r} does not describe a value.",
            f'Write "kind [unit] meaning" with a kind from: {", ".join(KINDS)}.',
        )
    return Value(name, match[1], match[2], match[3] or "")


def read_assignment(folder: Path | str) -> Assignment:
    """Read the manifest in a folder.

    Raises
    ------
    MuslinError
        If there is no manifest or it cannot be understood.
    """
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib

    path = Path(folder) / MANIFEST
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        tasks = {
            name: Task(
                name=name,
                file=entry["file"],
                section=entry["section"],
                title=entry["title"],
                points=entry["points"],
                arguments=tuple(_value(key, text) for key, text in entry["arguments"].items()),
                results=tuple(_value(key, text) for key, text in entry["results"].items()),
                needs=tuple(entry.get("needs", ())),
                hints=tuple(entry.get("hints", ())),
            )
            for name, entry in table["task"].items()
        }
        grading = _grading(table.get("grading", {}), path)
        return Assignment(table["name"], table["title"], table["version"], MappingProxyType(tasks), grading)
    except FileNotFoundError:
        raise MuslinError(f"There is no {MANIFEST} in {paths.shown(folder)}.") from None
    except tomllib.TOMLDecodeError as error:
        raise MuslinError(f"{paths.shown(path)} is not valid TOML: {error}.") from None
    except KeyError as error:
        raise MuslinError(f"{paths.shown(path)} lacks the entry {error}.") from None


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
    folder = paths.assignment(name)
    if (folder / MANIFEST).is_file():
        return read_assignment(folder)
    if paths.in_repository() and (paths.root() / "solutions" / name / MANIFEST).is_file():
        return read_assignment(paths.solution(name))
    known = sorted(path.parent.name for path in (paths.root() / "assignments").glob(f"*/{MANIFEST}"))
    raise MuslinError(f"There is no assignment {name!r}.", choices(name, known))


class Functions:
    """Namespace of an assignment's task functions, as found in one folder: `functions.phi` and so on.

    Every task of the manifest has an attribute. Where the function is still the stub, is missing, or its file
    cannot be imported, the attribute is a function that raises that error when it is called.
    """

    def __init__(self, folder: Path, table: Assignment, found: dict[str, Callable[..., Any]]):
        self.folder = folder
        self.assignment = table
        self._found = found
        self.__dict__.update(found)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        raise AttributeError(f"the assignment {self.assignment.name!r} has no task {name!r}")

    def __iter__(self) -> Iterator[Callable[..., Any]]:
        return iter(self._found.values())

    def __getitem__(self, name: str) -> Callable[..., Any]:
        return self._found[name]

    def __repr__(self) -> str:
        return f"<functions of {paths.shown(self.folder)}>"


def load(folder: Path | str, table: Assignment | str = "cloth") -> Functions:
    """Read the task functions of any folder.

    Parameters
    ----------
    folder : path
        A folder with (some of) the assignment's files.
    table : Assignment or str
        Which assignment it answers, or its name.

    Returns
    -------
    Functions
        One attribute per task.

    Raises
    ------
    MuslinError
        If the folder does not exist. Faults inside the files are kept for the tasks they concern.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise MuslinError(
            f"There is no folder {paths.shown(folder)}.", "Name a folder with the assignment's files."
        )
    table = assignment(table) if isinstance(table, str) else table
    if not any((folder / file).exists() for file in table.files):
        raise MuslinError(
            f"There are no task files in {paths.shown(folder)}.",
            f"Go to the folder with {table.files[0]}, or name it with --functions.",
        )
    modules = {file: importing.module(folder / file, table.tasks) for file in table.files}
    return Functions(
        folder, table, {task.name: _find(task, modules[task.file], folder) for task in table.tasks.values()}
    )


def failure_of(function: Callable[..., Any]) -> MuslinError | None:
    """Why a task function cannot be used (still the stub, missing, file broken), or None if it can."""
    return getattr(function, "failure", None)


def usable(function: Callable[..., Any]) -> Callable[..., Any]:
    """Pass a task function through, or raise what keeps it from being used."""
    if (failure := failure_of(function)) is not None:
        raise failure
    return function


def _find(task: Task, module: ModuleType | MuslinError, folder: Path) -> Callable[..., Any]:
    where = paths.shown(folder / task.file)
    if isinstance(module, MuslinError):
        return _failing(task, module)
    try:
        function = _sound(task, module, where)
    except MuslinError as error:
        return _failing(task, error)
    function.task = task  # type: ignore[attr-defined]
    fatal = next((note for note in reading.of(function) if note.fatal), None)
    if fatal is not None:
        row = importing.row(module, fatal.line)
        words = f"{where}, line {fatal.line}: {task.name} cannot be run as it is.\n    {row}"
        return _failing(task, StudentCodeError(f"{words}\n{sentence(fatal.words, row)}"))
    return function


def _sound(task: Task, module: ModuleType, where: str) -> Callable[..., Any]:
    """A task's function, if it is one of Taichi with the arguments asked for, and is filled in.

    Raises
    ------
    MuslinError
        With what is wrong, and the line.
    """
    left_out = importing.left_out(module)
    if task.name in left_out:
        raise left_out[task.name]
    function = getattr(module, task.name, None)
    if not callable(function):
        if left_out:  # it may stand in what could not be read
            raise next(iter(left_out.values()))
        raise _absent(task, module, where)
    place = f"{where}, line {line}" if (line := importing.line_of_def(module, task.name)) else where
    if not inside.is_function(function):
        instead = f" instead of {found}" if (found := importing.decorator(module, task.name)) else ""
        raise StudentCodeError(
            f"{place}: {task.name} is not a Taichi function.",
            f"Write @ti.func on the line above def {task.name}{instead}.",
        )
    expected = [argument.name for argument in task.arguments]
    given = list(inspect.signature(function).parameters)
    if given != expected:
        order = ", in this order" if sorted(given) == sorted(expected) else ""
        raise StudentCodeError(
            f"{place}: {task.name} takes ({', '.join(given)}).",
            f"It must take ({', '.join(expected)}){order}.",
        )
    tree = _text(function, task.name, place)
    if is_stub(tree):
        raise NotImplementedYet(
            f"not implemented yet: {task.name} ({where}){_left_over(tree, module, task.name)}"
        )
    for name in sorted(importing.needs(module, task.name) & left_out.keys()) if left_out else ():
        raise StudentCodeError(
            f"{place}: {task.name} uses {name}, which Python cannot read.\n{left_out[name].message}"
        )
    if not any(isinstance(node, ast.Return) and node.value is not None for node in ast.walk(tree)):
        raise StudentCodeError(f"{place}: {task.name} returns nothing.", "End it with return and the result.")
    return function


def _text(function: Callable[..., Any], name: str, place: str) -> ast.Module:
    """The text of a function, which Taichi needs to compile it.

    Raises
    ------
    StudentCodeError
        If it has none of its own: it was made by exec, eval or lambda.
    """
    with contextlib.suppress(OSError, TypeError, SyntaxError):
        tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(function))))
        if isinstance(tree.body[0], (ast.FunctionDef, ast.AsyncFunctionDef)):
            return tree
    raise StudentCodeError(
        f"{place}: {name} has no text that Taichi could read.",
        f"Write it as the handout does: @ti.func, and def {name}(...): on the line below.",
    )


def _absent(task: Task, module: ModuleType, where: str) -> StudentCodeError:
    """What is said of a function that is not there under its name."""
    names = importing.defined(module)
    signature = f"def {task.name}({', '.join(argument.name for argument in task.arguments)}):"
    if task.name in names:  # in a class, or in another function
        return StudentCodeError(
            f"{where}, line {names[task.name]}: {task.name} stands inside something else, so {where} has no function "
            f"{task.name} of its own.",
            "Let its def begin in the first column.",
        )
    if alike := vocabulary.near(task.name, names):
        return StudentCodeError(
            f"{where} has no function {task.name}, but {alike} in line {names[alike]}.",
            f"If that is it, name it as it was: {signature}",
        )
    return StudentCodeError(
        f"{where} has no function {task.name}.", f"Copy its first lines back: @ti.func and {signature}"
    )


def _left_over(tree: ast.Module, module: ModuleType, name: str) -> str:
    """What is said of a stub that has been filled in all the same, or is there a second time."""
    body = tree.body[0].body if isinstance(tree.body[0], ast.FunctionDef) else []
    lines = importing.lines_of_def(module, name)
    if len(lines) > 1:
        numbers = " and ".join(map(str, lines))
        return f". It is defined in lines {numbers}, and Python takes the last: delete the stub"
    done = [s for s in body if not isinstance(s, (ast.Raise, ast.Pass)) and not _is_docstring(s)]
    return ". Take the line raise NotImplementedError out when your code is there" if done else ""


def _is_docstring(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _failing(task: Task, failure: MuslinError) -> Callable[..., Any]:
    def function(*args: Any, **kwargs: Any) -> Any:
        raise failure

    function.__name__ = task.name
    function.task = task  # type: ignore[attr-defined]
    function.failure = failure  # type: ignore[attr-defined]
    return function


def is_stub(tree: ast.AST) -> bool:
    """Whether the body still says `raise NotImplementedError`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            exc = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            if isinstance(exc, ast.Name) and exc.id == "NotImplementedError":
                return True
    return False
