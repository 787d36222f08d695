"""Tasks in plain Python: a function over NumPy arrays, called once per case.

An argument may itself be a function. It is built from the arrays of the case, by the assignment's own file, where
the task runs: between processes go arrays only.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np

from muslin.base import paths
from muslin.base.errors import MuslinError, StudentCodeError
from muslin.tasks import alone
from muslin.tasks.authored import AuthorError, guarded, imported, place
from muslin.tasks.manifest import Assignment, Task, Value

Arrays = Mapping[str, np.ndarray]

#: What to do about the file that builds functions: its author, and a student who is given it.
GIVEN = "Correct it there. Where it was given to you: copy it back from the assignment."


#: Number of a case -> the functions its task's function is given.
Given = Callable[[int], Mapping[str, Any]]


def evaluate(function: Callable[..., Any], task: Task, arrays: Arrays, given: Given | None = None) -> Any:
    """Call a task's function on every sample of a batch.

    Parameters
    ----------
    function : callable
        From `muslin.load`.
    task : Task
    arrays : dict of ndarray, (b, ...)
        The task's inputs by name. One without the leading axis is used for every sample.
    given : callable, optional
        The functions of each case, built elsewhere: then the arrays of the problem are none of the inputs.

    Returns
    -------
    ndarray, (b, ...) or tuple of ndarray
        A tuple where the function returns several values.

    Raises
    ------
    StudentCodeError
        If the function raises an exception, or returns something else than its task says.
    MuslinError
        If an argument is missing, unknown, or has the wrong shape.
    """
    inputs = task.inputs if given is None else task.seen
    names = [value.name for value in inputs]
    if set(arrays) != set(names):
        raise MuslinError(f"{task.name} takes ({', '.join(names)}), not ({', '.join(arrays)}).")
    sizes = {}
    for value in inputs:
        array, shape = arrays[value.name], value.shape
        if array.ndim not in (len(shape), len(shape) + 1) or array.shape[array.ndim - len(shape) :] != shape:
            expected = f"(b, {', '.join(map(str, shape))})" if shape else "(b,)"
            raise MuslinError(
                f"{task.name}: {value.name} is a {value.kind} and needs shape {expected}, not {array.shape}."
            )
        if array.ndim > len(shape):
            sizes[value.name] = len(array)
    if len(set(sizes.values())) > 1:
        raise MuslinError(f"{task.name}: the arguments have different numbers of samples: {sizes}.")
    batch = next(iter(sizes.values()), 1)
    spread = {value.name: np.broadcast_to(arrays[value.name], (batch, *value.shape)) for value in inputs}
    outputs = tuple(np.zeros((batch, *v.shape), np.int32 if v.integer else np.float64) for v in task.results)
    for case in range(batch):
        own = {name: array[case] for name, array in spread.items()}
        here = arguments(function, task, own) if given is None else {**_own(task.seen, own), **given(case)}
        here = {value.name: here[value.name] for value in task.arguments}
        with alone.in_python(function):
            results = call(function, task, here)
        for output, found in zip(outputs, results, strict=True):
            output[case] = found
    return outputs[0] if len(outputs) == 1 else outputs


def arguments(function: Callable[..., Any], task: Task, case: Arrays) -> dict[str, Any]:
    """What a task's function takes in one case: arrays of its own, and functions built from arrays."""
    build: Callable[..., Mapping[str, Any]] | None = getattr(function, "build", None)
    given = _own(task.inputs, case) | (dict(functions(build, task, case)) if build is not None else {})
    return {value.name: given[value.name] for value in task.arguments}


def functions(build: Callable[..., Mapping[str, Any]], task: Task, case: Arrays) -> Mapping[str, Any]:
    """The functions that are built from the arrays of one case, by name.

    Raises
    ------
    AuthorError
        If what builds them fails, or gives others than the task takes.
    """
    found = build(**_own(task.inputs, case))
    wanted = [value.name for value in task.arguments if value.is_function]
    given = dict(found) if isinstance(found, Mapping) else {}
    if absent := [name for name in wanted if not callable(given.get(name))]:
        gives = ", ".join(map(str, given)) or f"a {type(found).__name__}"
        what = f"{task.name} gives {gives}, and no function {absent[0]}, which the manifest asks for"
        raise AuthorError(place(build), what, GIVEN)
    return given


def _own(values: Iterable[Value], case: Arrays) -> dict[str, Any]:
    """Arrays of one case as a function's own: nobody else sees what it writes into them."""
    return {v.name: np.array(case[v.name]) if v.shape else np.array(case[v.name]).item() for v in values}


def call(function: Callable[..., Any], task: Task, given: Mapping[str, Any]) -> tuple[Any, ...]:
    """What a function returns, as the task says it: arrays and numbers in order.

    Raises
    ------
    StudentCodeError
        If it raises an exception, returns something else, or changes an array that it was given.
    """
    before = {name: value.copy() for name, value in given.items() if isinstance(value, np.ndarray)}
    found = returned(function, task, given)
    for name, array in before.items():
        if not np.array_equal(array, given[name], equal_nan=True):
            raise StudentCodeError(
                f"{task.name} changes {name}, an array of whoever calls it.",
                f"Write {name} = {name} + ... where {name} += ... stands, or begin with {name} = {name}.copy().",
            )
    several = found if isinstance(found, tuple) else (found,)
    if len(several) != len(task.results):
        raise StudentCodeError(
            f"{task.name} returns {len(several)} values where {len(task.results)} are asked.",
            f"Return {', '.join(value.name for value in task.results)}.",
        )
    results = []
    for value, part in zip(task.results, several, strict=True):
        try:
            if part is None or isinstance(part, (str, bytes)):  # NumPy would take them for numbers
                raise TypeError
            array = np.asarray(part, dtype=np.float64)
        except (TypeError, ValueError):
            what = "nothing" if part is None else f"a {type(part).__name__}"
            raise StudentCodeError(
                f"{task.name} returns {what} for {value.name}; asked is {_words(value.shape)}."
            ) from None
        if array.shape != value.shape:
            raise StudentCodeError(
                f"{task.name} returns {_words(array.shape)} for {value.name}; asked is {_words(value.shape)}."
            )
        if value.integer and not (np.isfinite(array) and array == np.trunc(array)):
            raise StudentCodeError(f"{task.name} returns {part} for {value.name}; asked is a whole number.")
        results.append(array)
    return tuple(results)


def returned(function: Callable[..., Any], task: Task, given: Mapping[str, Any]) -> Any:
    """What a function returns, whatever that is; its exceptions, and None, become a `StudentCodeError`.

    A `MuslinError` of the functions that it is given passes through.
    """
    try:
        with np.errstate(all="ignore"):
            found = function(**given)
    except MuslinError:
        raise
    except RecursionError:
        raise StudentCodeError(f"{task.name} calls itself without end.") from None
    except Exception as error:
        raise _raised(error, function, task) from None
    if found is None:
        raise StudentCodeError(
            f"{task.name} returns nothing.", "End it with return and the result, on every way."
        )
    return found


def _words(shape: tuple[int, ...]) -> str:
    """A shape in words."""
    if not shape:
        return "a number"
    if len(shape) == 1:
        return f"an array of {shape[0]} numbers"
    return f"an array of {' x '.join(map(str, shape))} numbers"


def _raised(error: Exception, function: Callable[..., Any], task: Task) -> StudentCodeError:
    """An exception of the student's function, with the line of their file where it came up."""
    code = function.__code__
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == code.co_filename
    ]
    where = Path(code.co_filename.split(" (version ")[0])
    place = f"{paths.shown(where)}, line {lines[-1]}" if lines and lines[-1] else paths.shown(where)
    said = f": {error}" if str(error) else ""
    return StudentCodeError(f"{place}: {task.name} raises {type(error).__name__}{said}.")


def builder(task: Task, table: Assignment, folder: Path) -> Callable[..., Any] | None:
    """The function that builds a task's functions from the arrays of a case; None if it takes none.

    Parameters
    ----------
    task : Task
    table : Assignment
    folder : Path
        Where the task files are; a builder beside them is used before the assignment's own.

    Raises
    ------
    AuthorError
        If its file is missing or broken.
    """
    if not task.builder:
        return None
    places = [folder / task.builder, paths.assignment(table.name) / task.builder]
    path = next((place for place in places if place.is_file()), places[-1])
    module = ModuleType(f"muslin_builder_{path.stem}")
    try:
        exec(compile(path.read_text(encoding="utf-8"), str(path), "exec", dont_inherit=True), module.__dict__)
    except Exception as error:
        raise imported(error, path, GIVEN) from None
    found = getattr(module, task.name, None)
    if not callable(found):
        raise AuthorError(paths.shown(path), f"there is no function {task.name}", GIVEN)
    return cast(Callable[..., Any], guarded(found, task.name, str(path), GIVEN))
