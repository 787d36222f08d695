"""Functions that a student's function is given, answered by the grader.

A task may take functions: Newton's method its objective. What they are built from can hold the answer itself, and code
finds whatever lies in its own process: in closures, in the frames of who calls it, in memory. So it never goes there. A
worker is given stand-ins, each of which asks the grader what the function makes of its arguments, over the channel on
which the worker is asked itself.
"""

from __future__ import annotations

import builtins
import socket
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from muslin.base import paths
from muslin.grading import wire
from muslin.tasks import Assignment, Task, plain

Arrays = Mapping[str, np.ndarray]

#: Most numbers in all arguments of a call, and most arguments: what is asked costs the grader's own time.
LARGEST, MOST = 4096, 8


class Answers:
    """The grader's side: what the functions of each case of a task make of what a worker calls them with.

    Parameters
    ----------
    table : Assignment
    task : Task
    inputs : dict of ndarray, (b, ...)
        All arrays of the cases, those of the problem included.
    """

    def __init__(self, table: Assignment, task: Task, inputs: Arrays):
        build = plain.builder(task, table, paths.assignment(table.name))
        assert build is not None
        self._build, self._task, self._inputs = build, task, inputs
        self._case, self._functions = -1, dict[str, Callable[..., Any]]()

    def __call__(self, header: Mapping[str, Any], given: Arrays) -> tuple[dict[str, Any], Arrays]:
        """Header and arrays of the answer.

        Raises
        ------
        wire.Garbled
            If there is no such function or case, or there are too many numbers.
        """
        name, case = header["call"], header.get("case")
        known = {value.name for value in self._task.arguments if value.is_function}
        cases = len(next(iter(self._inputs.values())))
        if not isinstance(name, str) or name not in known or type(case) is not int or not 0 <= case < cases:
            raise wire.Garbled("a call of no function")
        if len(given) > MOST or sum(array.size for array in given.values()) > LARGEST:
            raise wire.Garbled("a call with too many numbers")
        if case != self._case:
            arrays = {key: array[case] for key, array in self._inputs.items()}
            functions = plain.functions(self._build, self._task, arrays)
            self._case, self._functions = case, dict(functions)
        in_order = [given[key] for key in sorted(filter(str.isdecimal, given), key=int)]
        by_name = {key: array for key, array in given.items() if not key.isdecimal()}
        try:
            with np.errstate(all="ignore"):
                found = self._functions[name](*in_order, **by_name)
            return {"plain": type(found) is float}, {"value": np.asarray(found, dtype=np.float64)}
        except Exception as error:  # of what it was called with: it belongs to the caller
            return {"raised": [type(error).__name__, str(error)]}, {}


def stand_ins(channel: socket.socket, question: str, task: Task) -> Callable[[int], dict[str, Any]]:
    """The worker's side: the functions of a case, which ask the grader.

    Parameters
    ----------
    channel : socket
    question : str
        Which the worker is answering.
    task : Task
    """

    def of(case: int) -> dict[str, Any]:
        return {v.name: _stand_in(channel, question, v.name, case) for v in task.arguments if v.is_function}

    return of


def _stand_in(channel: socket.socket, question: str, name: str, case: int) -> Callable[..., Any]:
    def function(*in_order: Any, **by_name: Any) -> Any:
        given = {**{str(k): value for k, value in enumerate(in_order)}, **by_name}
        arrays = {key: np.asarray(value, dtype=np.float64) for key, value in given.items()}
        if len(arrays) > MOST or sum(array.size for array in arrays.values()) > LARGEST:
            raise ValueError(f"{name} is called with far more numbers than it takes")
        wire.send(channel, {"id": question, "call": name, "case": case}, arrays)
        header, results = wire.receive(channel)
        if "raised" in header:
            kind, text = header["raised"]
            raise getattr(builtins, kind, RuntimeError)(text)
        value = results["value"]
        return float(value) if header["plain"] else value if value.shape else value[()]

    function.__name__ = function.__qualname__ = name
    return function
