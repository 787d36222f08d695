"""Cases of a task, made from its judge: inputs drawn from a seed, and what is true of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import exact, judge, measured
from muslin.judging.draws import Draw
from muslin.judging.knowledge import secret
from muslin.tasks import Value
from muslin.tasks.authored import AuthorError, place


def draw_inputs(assignment_name: str, task: str, seed: int | str, cases: int) -> dict[str, np.ndarray]:
    """Inputs of a task: case k of every kind in turn, drawn from a stream of the task's own.

    Parameters
    ----------
    assignment_name, task : str
        Which task.
    seed : int or str
        What the stream is drawn from.
    cases : int
        How many.

    Returns
    -------
    dict of ndarray, (cases, ...)
        float64, or int32 where the task takes an integer.

    Raises
    ------
    MuslinError
        If nobody has written how to draw inputs of this task.
    """
    generate = judge(assignment_name, task).draw
    if generate is None:
        raise _not_written(assignment_name, "draw", task)
    draw = Draw(f"{seed}/{assignment_name}/{task}")
    asked = tasks.assignment(assignment_name).tasks[task].inputs
    drawn = [_drawn(generate, draw, k, task, asked) for k in range(cases)]
    return {value.name: _column(generate, task, value, drawn) for value in asked}


def _drawn(
    generate: Callable[..., Any], draw: Draw, k: int, task: str, asked: Sequence[Value]
) -> Mapping[str, Any]:
    """Inputs of one case, which must be those of the task."""
    case, names = generate(draw, k), [value.name for value in asked]
    if not isinstance(case, Mapping):
        what = f"draw_{task} gives a {type(case).__name__} in case {k}"
        raise AuthorError(place(generate), what, f"Return the inputs by name: {', '.join(names)}.")
    if set(case) != set(names):
        what = f"draw_{task} gives {', '.join(map(str, case)) or 'nothing'} in case {k}"
        raise AuthorError(place(generate), what, f"The manifest asks for {', '.join(names)}.")
    return case


def _column(
    generate: Callable[..., Any], task: str, value: Value, drawn: Sequence[Mapping[str, Any]]
) -> np.ndarray:
    """One input of all cases."""
    size, do = math.prod(value.shape), f"The manifest says {value.kind}: draw so, or correct the manifest."
    for k, case in enumerate(drawn):
        try:
            numbers = exact.rounded(case[value.name])
        except (TypeError, ValueError):
            what = f"draw_{task} gives something else than numbers for {value.name} in case {k}"
            raise AuthorError(place(generate), what, do) from None
        if numbers.size != size or not np.isfinite(numbers).all():
            found = f"{numbers.size} number{'' if numbers.size == 1 else 's'}"
            what = f"draw_{task} gives {found if numbers.size != size else 'no finite number'}"
            raise AuthorError(place(generate), f"{what} for {value.name} in case {k}", do)
    column = [case[value.name] for case in drawn]
    array = np.array(column, dtype=np.int32) if value.integer else exact.rounded(column)
    return array.reshape(len(drawn), *value.shape)


def _not_written(assignment_name: str, part: str, task: str) -> MuslinError:
    """What is said where nobody has written a part of a judge."""
    if not paths.source(assignment_name).is_dir() and not paths.generator(assignment_name).parent.is_dir():
        return MuslinError(
            f"What is true of {assignment_name} is not here: an installation for students carries no answers.",
            "Run this from a checkout of Muslin, or from a pack for graders.",
        )
    where = paths.shown(paths.generator(assignment_name))
    return MuslinError(
        f"Nobody has written {part}_{task} for {assignment_name}.", f"Write {part}_{task} in {where}."
    )


def truth(assignment_name: str, task: str, inputs: Mapping[str, np.ndarray]) -> tuple[np.ndarray, ...]:
    """The right answers of a task for a batch of inputs, rounded to float64.

    Parameters
    ----------
    assignment_name, task : str
        Which task.
    inputs : dict of ndarray, (b, ...)
        Its inputs by name.

    Returns
    -------
    tuple of ndarray, (b, ...)
        One array per result of the task; an integer result as int32.

    Raises
    ------
    MuslinError
        If nobody has written what is true of this task, or it is not here.
    """
    function = judge(assignment_name, task).truth
    if function is None:
        raise _not_written(assignment_name, "truth", task)
    results = tasks.assignment(assignment_name).tasks[task].results
    try:
        answers = exact.answers(function, inputs)
    except (TypeError, ValueError):
        what = f"truth_{task} gives something else than numbers, or now more and now fewer of them"
        raise AuthorError(
            place(function), what, "A vector is a list of numbers, a matrix a list of rows."
        ) from None
    names = ", ".join(value.name for value in results)
    if len(answers) != len(results):
        what = f"truth_{task} gives {len(answers)} result{'' if len(answers) == 1 else 's'}"
        raise AuthorError(
            place(function),
            what,
            f"The manifest asks for {len(results)}: {names}. A vector is a list: a tuple is several results.",
        )
    return tuple(_answer(function, task, *pair) for pair in zip(results, answers, strict=True))


def _answer(function: Callable[..., Any], task: str, value: Value, answer: np.ndarray) -> np.ndarray:
    """One result of all cases, as the task says it."""
    if answer.shape[1:] != value.shape:
        numbers = " x ".join(map(str, answer.shape[1:])) or "one"
        do = f"The manifest says {value.kind}: give so, or correct the manifest."
        raise AuthorError(place(function), f"truth_{task} gives {numbers} numbers for {value.name}", do)
    if not (finite := np.isfinite(answer.reshape(len(answer), -1)).all(axis=1)).all():
        what = f"truth_{task} gives no finite number for {value.name} in case {int(np.argmin(finite))}"
        raise AuthorError(place(function), what, f"Draw no such case in draw_{task}, or correct the truth.")
    return answer.astype(np.int32 if value.integer else np.float64)


def make(assignment_name: str, task: str, seed: int | str, cases: int) -> dict[str, np.ndarray]:
    """All arrays of one task's file: its inputs, its results as `expected_<name>`, and what students measure by."""
    inputs = draw_inputs(assignment_name, task, seed, cases)
    results = tasks.assignment(assignment_name).tasks[task].results
    names = [f"expected_{value.name}" for value in results]
    found = {**inputs, **dict(zip(names, truth(assignment_name, task, inputs), strict=True))}
    if (sizes := sizes_of(assignment_name, task, inputs)) is not None:
        found[measured.TERMS] = sizes
    return found


def sizes_of(assignment_name: str, task: str, inputs: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Size of the terms of a task's answers, (b,); None where students have the function that says so, or nobody."""
    function = judge(assignment_name, task).terms
    if function is None or not secret(assignment_name, f"terms_{task}"):
        return None
    count = len(next(iter(inputs.values())))
    try:
        with np.errstate(all="ignore"):
            sizes = np.broadcast_to(np.asarray(function(inputs), dtype=np.float64), (count,))
    except (TypeError, ValueError):
        do = "It is given all cases at once, (b, ...), and gives the size of each, (b,)."
        raise AuthorError(
            place(function), f"terms_{task} does not give one number for each case", do
        ) from None
    if not (np.isfinite(sizes) & (sizes >= 0)).all():
        raise AuthorError(
            place(function),
            f"terms_{task} gives what is no size: {sizes.min()}",
            "A size is finite and not negative.",
        )
    return sizes
