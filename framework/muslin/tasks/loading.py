"""Any folder of student functions, read against the task table of its assignment.

`load` reads a folder by path, so any folder with those files is a submission. One broken file costs only its own tasks,
and one function that Python cannot read only itself, where it can be told from the others.
"""

from __future__ import annotations

import ast
import contextlib
import inspect
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from muslin import reading
from muslin.base import handed, paths
from muslin.base.engine import inside
from muslin.base.errors import MuslinError, NotImplementedYet, StudentCodeError
from muslin.reading import vocabulary
from muslin.reading.compile_errors import foreseen
from muslin.tasks import importing, plain
from muslin.tasks.manifest import Assignment, Task, assignment, read_assignment


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


def load(folder: Path | str, table: Assignment | str | None = None) -> Functions:
    """Read the task functions of any folder.

    Parameters
    ----------
    folder : path
        A folder with (some of) the assignment's files.
    table : Assignment or str, optional
        Which assignment it answers, or its name. Default: what the folder's own assignment.toml says, else cloth.

    Returns
    -------
    Functions
        One attribute per task.

    Raises
    ------
    MuslinError
        If the folder does not exist. Faults inside the files are kept for the tasks they concern.
    """
    folder = handed.path("functions", folder)
    if not folder.is_dir():
        raise MuslinError(
            f"There is no folder {paths.shown(folder)}.", "Name a folder with the assignment's files."
        )
    table = answered(folder) if table is None else table
    table = assignment(table) if isinstance(table, str) else table
    if not any((folder / file).exists() for file in table.files):
        raise MuslinError(
            f"There are no task files in {paths.shown(folder)}.",
            f"Go to the folder with {table.files[0]}, or name it with --functions.",
        )
    modules = {file: importing.module(folder / file, table.tasks) for file in table.files}
    return Functions(
        folder,
        table,
        {name: _find(task, modules[task.file], folder, table) for name, task in table.tasks.items()},
    )


def taken(functions: Any) -> Functions | None:
    """What was given as a folder's functions: loaded already, the folder's path, or none.

    Raises
    ------
    MuslinError
        If it is something else, or there is no such folder.
    """
    if functions is None or isinstance(functions, Functions):
        return functions
    if isinstance(functions, (str, Path)):
        return load(functions)
    raise MuslinError(
        f"{handed.short(functions)} has no task functions.",
        "Give what muslin.load returned, or the folder's path.",
    )


def answered(folder: Path) -> Assignment | str:
    """Which assignment a folder answers, by its own assignment.toml; cloth if it says nothing.

    Parameters
    ----------
    folder : Path
        It may be anything, also what is no folder.

    Returns
    -------
    str or Assignment
        The name of one that is known here, else the folder's own task table.
    """
    try:
        own = read_assignment(folder)
    except (MuslinError, OSError, ValueError, TypeError, AttributeError):  # none, or no such table
        return "cloth"
    return own.name if own.name in paths.assignments() else own


def failure_of(function: Callable[..., Any]) -> MuslinError | None:
    """Why a task function cannot be used (still the stub, missing, file broken), or None if it can."""
    return getattr(function, "failure", None)


def usable(function: Callable[..., Any]) -> Callable[..., Any]:
    """Pass a task function through, or raise what keeps it from being used."""
    if (failure := failure_of(function)) is not None:
        raise failure
    return function


def _find(
    task: Task, module: ModuleType | MuslinError, folder: Path, table: Assignment
) -> Callable[..., Any]:
    where = paths.shown(folder / task.file)
    if isinstance(module, MuslinError):
        return _failing(task, module)
    try:
        function = _sound(task, module, where)
        function.others = _others(task, module, table)  # type: ignore[attr-defined]
        if task.builder:
            function.build = plain.builder(task, table, folder)  # type: ignore[attr-defined]
    except MuslinError as error:
        return _failing(task, error)
    function.task = task  # type: ignore[attr-defined]
    if not task.in_python and reading.gives_none(function):  # the engine would end the whole process
        return _failing(
            task, foreseen(function, "") or StudentCodeError(f"{where}: {task.name} returns None.")
        )
    return function


def _sound(task: Task, module: ModuleType, where: str) -> Callable[..., Any]:
    """A task's function, if it is in its language, has the arguments asked for, and is filled in.

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
    if task.in_python and inside.is_function(function):
        raise StudentCodeError(
            f"{place}: {task.name} is a Taichi function.",
            f"This task is plain Python over NumPy arrays: take the line above def {task.name} away.",
        )
    if not task.in_python and not inside.is_function(function):
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


def _others(task: Task, module: ModuleType, table: Assignment) -> dict[str, Callable[..., Any]]:
    """What the file has of other tasks, which this one's function must not call; a helper of any name is none."""
    found = {}
    for name, other in table.tasks.items():
        function = getattr(module, name, None) if other.file == task.file and name != task.name else None
        if callable(function) and getattr(function, "__name__", "") == name:
            found[name] = function
    return found


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
    lines = signature if task.in_python else f"@ti.func and {signature}"
    return StudentCodeError(f"{where} has no function {task.name}.", f"Copy its first lines back: {lines}")


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
