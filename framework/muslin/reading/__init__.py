"""What a reader notices in a student's function, found in its text alone: nothing is compiled or run.

`notes` reads a function and what it uses of its file. The commonest mistakes are looked for one by one: where
Taichi is not Python (`traps`), habits of other languages and of the keyboard (`habits`), names that do not exist
(`names`, with the dictionary `vocabulary`).
"""

from __future__ import annotations

import ast
import inspect
import linecache
from collections.abc import Callable, Mapping
from typing import Any

from muslin.base.errors import MuslinError
from muslin.reading.habits import HABITS
from muslin.reading.names import NAMES
from muslin.reading.page import Note, Page, assignments, used
from muslin.reading.plain_habits import PLAIN
from muslin.reading.source import read_once
from muslin.reading.traps import TRAPS

__all__ = ["Note", "born", "notes", "of", "returned", "row", "told", "told_of"]

#: Most notes shown of a function, and the longest of them [characters].
MOST, LONGEST = 3, 400


def notes(
    text: str,
    name: str,
    asked: tuple[str, ...] = (),
    sizes: Mapping[str, int] | None = None,
    in_python: bool = False,
) -> list[Note]:
    """What is noticed in a function and in the functions of the file it uses, in order; [] if it is no Python.

    Parameters
    ----------
    text : str
        The file.
    name : str
        The function.
    asked : tuple of str
        Names of the results it must return, where that is known.
    sizes : dict, optional
        How many components its arguments have that are vectors.
    in_python : bool
        Whether it is run by Python: then nothing is noticed of where Taichi is another language.
    """
    try:
        source = read_once(text)
    except MuslinError:
        return []
    functions = {key: function.node for key, function in source.functions.items()}
    modules = _imported(source.tree)
    known = frozenset(functions) | frozenset(modules) | _assigned(source.tree)
    found: list[Note] = []
    for one in used(functions, name):
        arguments = frozenset(_arguments(functions[one]))
        results, vectors = (asked, sizes or {}) if one == name else ((), {})
        page = Page(text, functions[one], arguments, functions, modules, known, results, vectors)
        compiled = (
            one == name or functions[one].decorator_list
        )  # else Python runs it while the others compile
        notices = PLAIN if in_python else (*HABITS, *NAMES, *TRAPS) if compiled else (*NAMES, *TRAPS)
        found += [note for notice in notices for note in notice(page)]
    defined = [n for n in source.tree.body if isinstance(n, ast.FunctionDef) and n.name == name]
    if len(defined) > 1:
        lines = " and ".join(str(node.lineno) for node in defined)
        words = f"{name} is defined in lines {lines}, and Python takes the last; delete the others."
        found.append(Note(defined[-1].lineno, f"def {name}", words))
    return sorted(dict.fromkeys(found), key=lambda note: (not note.fatal, note.line))


def of(function: Callable[..., Any]) -> list[Note]:
    """What is noticed in a function that has been loaded; of a task that is known to fail, nothing more."""
    if getattr(function, "failure", None) is not None:
        return []
    task = getattr(function, "task", None)
    try:
        return _of(_text(function), inspect.unwrap(function).__code__.co_name, task)
    except Exception:  # a look at the text is a help: no odd text may keep a function from being run
        return []


def _of(text: str, name: str, task: Any) -> list[Note]:
    """What is noticed in a function of a file, and in view of its entry in the task table, if it has one."""
    if task is None:
        return notes(text, name)
    asked = tuple(value.name for value in task.results)
    sizes = {v.name: v.shape[0] for v in task.seen if len(v.shape) == 1}
    return notes(text, name, asked, sizes, task.in_python)


def _text(function: Callable[..., Any]) -> str:
    return "".join(linecache.getlines(inspect.unwrap(function).__code__.co_filename))


def row(function: Callable[..., Any], line: int) -> str:
    """A line of the file of a function that has been loaded, without its indentation."""
    return linecache.getline(inspect.unwrap(function).__code__.co_filename, line).strip()


def told(function: Callable[..., Any]) -> list[str]:
    """What is noticed in a function that has been loaded, as it is shown: the first few, shortened."""
    return _first(of(function))


def told_of(text: str, task: Any) -> list[str]:
    """What is noticed in a task's function that has not been loaded: in the text of its file alone."""
    return _first(_of(text, task.name, task))


def _first(found: list[Note]) -> list[str]:
    return [str(note)[:LONGEST] for note in found[:MOST]]


def returned(function: Callable[..., Any]) -> tuple[int, str] | None:
    """Line and text of the last return of a function that has been loaded."""
    code = inspect.unwrap(function).__code__
    try:
        source = read_once(_text(function))
    except MuslinError:
        return None
    if code.co_name not in source.functions:
        return None
    returns = [n for n in ast.walk(source.functions[code.co_name].node) if isinstance(n, ast.Return)]
    if not returns:
        return None
    last = max(returns, key=lambda node: node.lineno)
    return last.lineno, source.lines[last.lineno - 1].strip()


def gives_none(function: Callable[..., Any]) -> bool:
    """Whether all that a function that has been loaded ever returns is None, written out."""
    code = inspect.unwrap(function).__code__
    try:
        node = read_once(_text(function)).functions[code.co_name].node
    except (MuslinError, KeyError):
        return False
    returns = [n.value for n in ast.walk(node) if isinstance(n, ast.Return)]
    return bool(returns) and all(isinstance(v, ast.Constant) and v.value is None for v in returns)


def born(function: Callable[..., Any], which: int) -> ast.stmt | None:
    """The statement in which a result is born as a plain number, if it is a variable and that can be seen."""
    source = read_once(_text(function))
    name = inspect.unwrap(function).__code__.co_name
    if name not in source.functions:
        return None
    node = source.functions[name].node
    returns = [n for n in ast.walk(node) if isinstance(n, ast.Return) and n.value is not None]
    value = returns[-1].value if returns else None
    if isinstance(value, ast.Tuple) and which < len(value.elts):
        value = value.elts[which]
    for statement, target, first in sorted(assignments(node), key=lambda found: found[0].lineno):
        if isinstance(value, ast.Name) and isinstance(target, ast.Name) and target.id == value.id:
            return statement if isinstance(first, ast.Constant) else None
    return None


def _arguments(node: ast.FunctionDef) -> list[str]:
    every = node.args
    named = [*every.posonlyargs, *every.args, *every.kwonlyargs, every.vararg, every.kwarg]
    return [argument.arg for argument in named if argument is not None]


def _imported(tree: ast.Module) -> dict[str, str]:
    """Names that imports give a meaning, and what they mean; "*" if everything of a module was imported."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                found[alias.asname or alias.name.split(".")[0]] = (
                    alias.name if alias.asname else alias.name.split(".")[0]
                )
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                found[alias.asname or alias.name] = f"{node.module or ''}.{alias.name}"
    return found


def _assigned(tree: ast.Module) -> frozenset[str]:
    """Names that get a value at the top level of a file."""
    names: set[str] = set()
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        else:
            names |= {
                n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
            }
    return frozenset(names)
