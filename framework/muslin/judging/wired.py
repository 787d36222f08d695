"""What is known of a task, in the convention its assignment asks for: carried over from Muslin's own.

Cases, truth, properties, mistakes and all else of a judge are written once, for the arguments Muslin calls a function
with. A variant's manifest says how its own follow from them (`muslin.tasks.wiring`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from muslin.judging import exact
from muslin.judging.parts import Case, Judge, Mistake, Property
from muslin.tasks import Task
from muslin.tasks.wiring import one, results_called, to_called, to_own


def wired(known: Judge, task: Task) -> Judge:
    """A judge of Muslin's own convention in that of a task."""
    if task.called is None:
        return known
    return replace(
        known,
        draw=known.draw and _draw(known.draw, task),
        truth=known.truth and _truth(known.truth, task),
        terms=known.terms and _on_called(known.terms, task),
        loss=known.loss and _on_called(known.loss, task),
        properties=tuple(_property(prop, task) for prop in known.properties),
        mistakes=tuple(_mistake(mistake, known, task) for mistake in known.mistakes),
        conditions=known.conditions and _conditions(known.conditions, task),
        steps=known.steps and _steps(known.steps, task),
    )


def _draw(draw: Callable[..., Mapping[str, Any]], task: Task) -> Callable[..., dict[str, Any]]:
    assert task.called is not None
    give, names = task.called.give, [value.name for value in task.inputs]
    return lambda stream, k: one(give, names, draw(stream, k))


def _truth(truth: Callable[..., Any], task: Task) -> Callable[..., Any]:
    assert task.called is not None
    called, results = task.called, [value.name for value in task.results]

    def own(**inputs: Any) -> Any:
        found = truth(**one(called.back, [value.name for value in called.arguments], inputs))
        answers = found if isinstance(found, tuple) else (found,)
        values = dict(zip((value.name for value in called.results), answers, strict=True))
        sent = tuple(one(called.send, results, values).values())
        return sent if isinstance(found, tuple) else sent[0]

    return own


def _on_called(terms: Callable[..., Any], task: Task) -> Callable[..., Any]:
    return lambda a: terms(to_called(task, a))


def _conditions(conditions: Callable[..., Any], task: Task) -> Callable[..., Iterator[tuple[str, Any]]]:
    def own(a: Mapping[str, np.ndarray]) -> Iterator[tuple[str, Any]]:
        yield from conditions(to_called(task, a))

    return own


def _steps(steps: Callable[..., dict[str, Any]], task: Task) -> Callable[..., dict[str, Any]]:
    assert task.called is not None
    back, names = task.called.back, [value.name for value in task.called.arguments]
    return lambda a: steps(one(back, names, a))


def _property(prop: Property, task: Task) -> Property:
    return replace(
        prop,
        inputs=lambda rng: to_own(task, prop.inputs(rng)),
        judge=lambda a, out: prop.judge(to_called(task, a), results_called(task, out)),
    )


def _mistake(mistake: Mistake, known: Judge, task: Task) -> Mistake:
    """What a mistake makes of Muslin's own answer, in the task's convention."""
    assert task.called is not None
    called, k = task.called, mistake.result

    def carried(expressions: Mapping[str, str], values: Any, names: Any, array: np.ndarray) -> np.ndarray:
        rows = [one(expressions, [names[k].name], {values[k].name: row})[names[k].name] for row in array]
        return np.array(rows, dtype=np.float64)

    def makes(case: Case) -> Any:
        own = {value.name: np.asarray(case.__dict__[value.name]) for value in task.inputs}
        inputs = to_called(task, own)
        right = carried(called.take, task.results, called.results, case.right)

        def truth(**changed: np.ndarray) -> np.ndarray:
            assert known.truth is not None
            return exact.answers(known.truth, {**inputs, **changed})[k].astype(np.float64)

        made = mistake.makes(Case(right, truth, inputs))
        every = made if isinstance(made, tuple) else (made,)
        arrays = [np.broadcast_to(np.asarray(array, dtype=np.float64), right.shape) for array in every]
        return tuple(carried(called.send, called.results, task.results, array) for array in arrays)

    return replace(mistake, makes=makes)
