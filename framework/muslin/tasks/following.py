"""Call every function of a folder whose arguments are known, one after the other: what one gives, the next may take."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.tasks.batch import evaluate
from muslin.tasks.loading import Functions
from muslin.tasks.manifest import Task


@dataclass(frozen=True)
class Called:
    """A task whose function was called: its results, with a row for every sample, or why there are none."""

    task: Task
    results: tuple[np.ndarray, ...] = ()
    trouble: str = ""


def follow(
    functions: Functions,
    known: Mapping[str, np.ndarray],
    more: Callable[[str, np.ndarray], Mapping[str, np.ndarray]] = lambda name, value: {},
    instead: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> tuple[list[Called], dict[str, np.ndarray]]:
    """Call what can be called, by the names of arguments and results in the task table.

    Parameters
    ----------
    functions : Functions
    known : mapping
        Quantities by name, (1, ...) or (b, ...) arrays.
    more : callable
        What a result makes known besides: (name, value) -> quantities by name.
    instead : mapping
        Quantities to go on with where no function gives them.

    Returns
    -------
    calls : list of Called
        In the order of the calls.
    known : dict
        All that is known then.
    """
    now, calls = dict(known), list[Called]()
    left = [task for task in functions.assignment.tasks.values() if task.arguments]

    def learn(name: str, value: np.ndarray) -> None:
        if name not in now:
            now[name] = value
            now.update({other: there for other, there in more(name, value).items() if other not in now})

    while True:
        ready = next((task for task in left if all(value.name in now for value in task.arguments)), None)
        if ready is None:
            if not (missing := [name for name in instead if name not in now]):
                return calls, now
            learn(missing[0], instead[missing[0]])
            continue
        left.remove(ready)
        try:
            arguments = {value.name: _spread(now[value.name]) for value in ready.arguments}
            found = evaluate(functions[ready.name], **dict[str, Any](arguments))
        except MuslinError as error:
            calls.append(Called(ready, trouble=str(error)))
            continue
        results = found if isinstance(found, tuple) else (found,)
        calls.append(Called(ready, results))
        for value, result in zip(ready.results, results, strict=True):
            learn(value.name, result)


def _spread(value: np.ndarray) -> np.ndarray:
    """One row stands for every sample."""
    return value[0] if len(value) == 1 else value
