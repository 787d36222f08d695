"""Cases of a task, made from its judge: inputs drawn from a seed, and what is true of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import exact, judge
from muslin.judging.draws import Draw


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
    drawn = [generate(draw, k) for k in range(cases)]
    arrays = {}
    for argument in tasks.assignment(assignment_name).tasks[task].inputs:
        shape, integer = argument.shape, argument.integer
        column = [case[argument.name] for case in drawn]
        array = np.array(column, dtype=np.int32) if integer else exact.rounded(column)
        arrays[argument.name] = array.reshape(cases, *shape)
    return arrays


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
    return exact.answers(function, inputs)


def make(assignment_name: str, task: str, seed: int | str, cases: int) -> dict[str, np.ndarray]:
    """All arrays of one task's file: its inputs, and its results as `expected_<name>`."""
    inputs = draw_inputs(assignment_name, task, seed, cases)
    results = tasks.assignment(assignment_name).tasks[task].results
    names = [f"expected_{value.name}" for value in results]
    return {**inputs, **dict(zip(names, truth(assignment_name, task, inputs), strict=True))}
