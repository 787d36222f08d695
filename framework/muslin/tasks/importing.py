"""One student file, imported on its own, and what is wrong where that fails."""

from __future__ import annotations

import ast
import contextlib
import itertools
import linecache
import re
import sys
import traceback
from collections.abc import Collection, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from muslin.base import engine, paths
from muslin.base.engine import inside
from muslin.base.errors import MuslinError, StudentCodeError, said
from muslin.reading import page, source, syntax, vocabulary

#: Marks later versions of a file in the name its code goes by.
_VERSION = " (version "

#: Where an imported file keeps the text that was read of it, and what was left out.
_READ, _LEFT_OUT = "__read__", "__left_out__"

_versions = itertools.count(2)


def module(path: Path, names: Collection[str] = ()) -> ModuleType | MuslinError:
    """Import one student file, without letting it restart Taichi; or what keeps it from being imported.

    Functions of these `names` that Python cannot read are `left_out`, where they can be told from the rest.
    """
    where = paths.shown(path)
    if not path.is_file():
        return StudentCodeError(f"{where} is missing.", "Copy it back from the assignment.")
    engine.load()
    text = ""
    try:
        text = source.decoded(path.read_bytes(), where)
        if re.match(r'\s*\{\s*"(cells|metadata|nbformat)"', text):
            return StudentCodeError(f"{where} is a notebook, not a Python file.", "Export it as .py.")
        text, broken = source.legible(text, names, where)
        filename = _remembered(path, text)
        code = syntax.compiled(text, filename, where)
    except MuslinError as error:
        return error
    except OSError as error:
        return StudentCodeError(f"{where} cannot be read: {error.strerror}.")
    made = ModuleType(f"muslin_student_{path.stem}")
    made.__dict__[_READ] = text
    made.__file__ = filename
    known = engine.builtins_with()
    known = vars(known) if isinstance(known, ModuleType) else known
    made.__dict__["__builtins__"] = {**known, "input": _asked}
    try:
        with _locked():
            exec(code, made.__dict__)
    except KeyboardInterrupt:  # somebody does not want to wait for it
        raise
    except BaseException as error:
        # it may well be for want of what was left out
        return next(iter(broken.values()), None) or _trouble(error, path, text, made)
    made.__dict__.update({_READ: text, _LEFT_OUT: broken})  # whatever the file has made of them
    return made


def _remembered(path: Path, text: str) -> str:
    """Name under which Python and Taichi find this source again, whatever happens to the file.

    Taichi reads a function's source when it first compiles it, perhaps long after the file was loaded: each
    version of a file keeps its own. Nothing is read from or written to `__pycache__`.
    """
    filename = str(path)
    known = linecache.cache.get(filename)
    if known is not None and known[2] != source.rows(text):  # type: ignore[misc]
        filename = f"{filename}{_VERSION}{next(_versions)})"
    source.remember(filename, text)
    return filename


def _asked(*args: Any, **kwargs: Any) -> Any:
    raise StudentCodeError("stops the file while it is read.", "Take that line out.")


@contextlib.contextmanager
def _locked() -> Iterator[None]:
    """Forbid what a file must not do while it is imported: start Taichi, stop, ask someone."""
    ti = engine.load()

    def started(*args: Any, **kwargs: Any) -> None:
        raise StudentCodeError(
            "calls ti.init or ti.reset.", "Muslin starts Taichi itself: take that line out."
        )

    forbidden = [(ti, "init", started), (ti, "reset", started), (sys, "breakpointhook", _asked)]
    saved = [(place, name, getattr(place, name)) for place, name, _ in forbidden]
    try:
        for place, name, instead in forbidden:
            setattr(place, name, instead)
        yield
    finally:
        for place, name, function in saved:
            setattr(place, name, function)


def _trouble(error: BaseException, path: Path, text: str, made: ModuleType) -> StudentCodeError:
    """What is wrong with a file whose top level cannot be run, with its line."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if f.filename.split(_VERSION)[0] == str(path) and f.lineno]
    if not lines:
        return StudentCodeError(f"{paths.shown(path)}: {_said(error)}.")
    for statement in ast.parse(text).body:  # Python 3.10 says the line of def for one of its decorators
        if (
            isinstance(statement, ast.FunctionDef)
            and statement.decorator_list
            and lines == [statement.lineno]
        ):
            lines = [statement.decorator_list[0].lineno]
    place = f"{paths.shown(path)}, line {lines[-1]}"
    if isinstance(error, StudentCodeError) and error.message.startswith(("calls", "stops")):
        return StudentCodeError(f"{place} {error.message}", error.hint)
    what, advice = _words(error, text, lines[0], made)
    shown = syntax.bare_lines(text)[lines[-1] - 1].strip()
    return StudentCodeError("\n".join(part for part in (f"{place}: {what}.", f"    {shown}", advice) if part))


def _said(error: BaseException) -> str:
    return f"importing the file fails: {said(error).rstrip('.')}"


def _words(error: BaseException, text: str, line: int, made: ModuleType) -> tuple[str, str]:
    """What is wrong, and what to do, for an error while the top level of a file is run."""
    what = said(error)
    statement = next((s for s in ast.parse(text).body if _covers(s, line)), None)
    decorated = isinstance(statement, ast.FunctionDef)
    name = statement.name if isinstance(statement, ast.FunctionDef) else ""
    if isinstance(error, ImportError):
        return _not_imported(error, made)
    if decorated and ("annotated" in what or "kernel" in what):
        wrong = decorator(made, name)
        return (
            "a task is a Taichi function, not a kernel",
            f'Write "@ti.func" above def {name}, not "{wrong}".',
        )
    if decorated and "missing 1 required positional argument: 'fn'" in what:
        return "the decorator has brackets", 'Write "@ti.func" without brackets.'
    if isinstance(error, NameError) and re.search(r"'(ti|taichi)' is not defined", what):
        return "ti is not known yet", "Write import taichi as ti at the top of the file."
    if decorated and isinstance(error, (NameError, AttributeError)):
        return f"there is no such decorator ({error})", f"Write @ti.func above def {name}."
    called = _called(statement, made)
    if called and not decorated:
        return (
            f"{called} runs inside Taichi only, not while the file is read",
            f"Take this line out. To try {called}: muslin check {called}, or muslin.evaluate as the handout shows.",
        )
    if isinstance(error, MuslinError):
        return str(error).rstrip("."), "Take this line out: it runs whenever the file is read."
    if decorated:
        return _said(error), f"Taichi does not take {name} as it is written."
    return _said(
        error
    ), "Only imports, constants and functions belong into the file: take out what else stands there."


def _covers(statement: ast.stmt, line: int) -> bool:
    first = min([statement.lineno, *(d.lineno for d in getattr(statement, "decorator_list", []))])
    return first <= line <= (statement.end_lineno or first)


def _called(statement: ast.stmt | None, made: ModuleType) -> str:
    """The Taichi function that a statement calls."""
    for node in ast.walk(statement) if statement is not None else ():
        called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
        if called and inside.is_function(getattr(made, called, None)):
            return called
    return ""


def _not_imported(error: ImportError, made: ModuleType) -> tuple[str, str]:
    """What is said of an import that fails; the same whether the file lies in a workspace or was handed in."""
    name = error.name or ""
    if "relative import" in str(error):
        name = "another file"
    elif not isinstance(error, ModuleNotFoundError) and name:
        wanted = found[1] if (found := re.search(r"cannot import name '(\w+)'", str(error))) else "that"
        public = [n for n in dir(sys.modules.get(name)) if not n.startswith("_")]
        alike = vocabulary.near(wanted, public)
        known = "It has diag, svd, dsvd, split and tangents." if name == "muslin.given" else ""
        return f"{name} has no {wanted}", f"Did you mean {alike}?" if alike else known
    alike = vocabulary.near(name, ("taichi", "numpy", "math", "muslin"))
    if alike:
        return f"there is no module {name}", f"Did you mean {alike}?"
    own = Path(made.__file__ or "").name.split(_VERSION)[0]
    return (
        f"{name} cannot be imported: a task file is read alone, and only the task files are handed in",
        f"Put helper functions into {own} itself, above the task, each with @ti.func; other libraries than Taichi are "
        "not needed.",
    )


# --- what a file defines -------------------------------------------------------------------------------------


def _tree(made: ModuleType) -> ast.Module:
    return ast.parse(made.__dict__[_READ])


def left_out(made: ModuleType) -> dict[str, StudentCodeError]:
    """Functions of an imported file that Python cannot read, and what is wrong with them."""
    return dict(made.__dict__[_LEFT_OUT])


def needs(made: ModuleType, name: str) -> set[str]:
    """Names of the file that a function uses, or one that it uses."""
    functions = {node.name: node for node in _tree(made).body if isinstance(node, ast.FunctionDef)}
    found: set[str] = set()
    for one in page.used(functions, name):
        found |= {node.id for node in page.free(functions[one])}
    return found


def row(made: ModuleType, line: int) -> str:
    """A line of an imported file, without its indentation."""
    return linecache.getline(made.__file__ or "", line).strip()


def defined(made: ModuleType) -> dict[str, int]:
    """Functions of an imported file, also those inside something else: name -> line."""
    return {node.name: node.lineno for node in ast.walk(_tree(made)) if isinstance(node, ast.FunctionDef)}


def lines_of_def(made: ModuleType, name: str) -> list[int]:
    """Lines in which a function is defined at the top level."""
    return [
        node.lineno for node in _tree(made).body if isinstance(node, ast.FunctionDef) and node.name == name
    ]


def line_of_def(made: ModuleType, name: str) -> int:
    """The line of the definition that counts; 0 if there is none."""
    return lines[-1] if (lines := lines_of_def(made, name)) else 0


def decorator(made: ModuleType, name: str) -> str:
    """What stands above a function instead of @ti.func."""
    nodes = [node for node in _tree(made).body if isinstance(node, ast.FunctionDef) and node.name == name]
    return f"@{ast.unparse(nodes[-1].decorator_list[0])}" if nodes and nodes[-1].decorator_list else ""
