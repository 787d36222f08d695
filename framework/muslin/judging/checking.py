"""A student's functions against the reference data that ship with Muslin."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from muslin import tasks
from muslin.base.errors import MuslinError
from muslin.judging.judge import judge
from muslin.judging.reference import Verdict, cases, compare
from muslin.tasks.batch import evaluate
from muslin.tasks.comparing import Limits


def check(
    functions: tasks.Functions, names: Iterable[str] | None = None, tolerance: float | None = None
) -> list[Verdict]:
    """Evaluate a folder's task functions on the public cases.

    A function that is missing, still the stub or broken gets a verdict with the reason; nothing is raised.

    Parameters
    ----------
    functions : Functions
        From `muslin.load`.
    names : iterable of str, optional
        Which tasks; default all, in the order of the task table.
    tolerance : float, optional
        Largest relative error of a right answer; default each task's own.

    Returns
    -------
    list of Verdict
        One per task.
    """
    table = functions.assignment
    verdicts = []
    for name in table.tasks if names is None else names:
        inputs, expected = cases(table.name, name)
        try:
            arguments: dict[str, Any] = dict(inputs)
            got = evaluate(functions[name], **arguments)
        except MuslinError as error:
            verdicts.append(Verdict(name, False, str(error)))
        else:
            own = judge(table.name, name)
            limits = own.limits(inputs) if tolerance is None else Limits(tolerance)
            verdicts.append(compare(table.tasks[name], got, expected, inputs, own.terms, limits))
    return verdicts
