"""What known mistakes make of the public cases, as data: for machines that must know neither truth nor formula.

Of each task: mistakes known from students, the right answers to changed inputs, words of its own, and conditions by
which right and wrong cases may be told apart. `muslin.grading.known` reads them.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError, choices
from muslin.grading.known import CHANGE, MISTAKE, Entry, Known, save
from muslin.judging import Case, Given, Judge, Mistake, exact, judge, reference, told
from muslin.judging.arrays import transposed, unit
from muslin.tasks import Task
from muslin.tasks.authored import NUMERIC, AuthorError, place


def build(assignment: str, only: Collection[str] = ()) -> Iterator[str]:
    """Write what is known of the mistakes of tasks, by default of all, and what `explain` and `gradcheck` ask for.

    Yields
    ------
    str
        The name of each file, when it is written.
    """
    from muslin.student import explaining, gradcheck

    table = tasks.assignment(assignment)
    if unknown := [name for name in only if name not in table.tasks]:
        raise MuslinError(f"There is no task {unknown[0]!r}.", choices(unknown[0], list(table.tasks)))
    for name in only or table.tasks:
        save(assignment, name, make(table.tasks[name], assignment))
        yield paths.shown(paths.known(assignment) / f"{name}.npz")
    record = {**gradcheck.record(assignment), **explaining.record(assignment)}
    if record:
        yield paths.shown(told.save(assignment, record))


def make(task: Task, assignment: str) -> Known:
    """All that is known of one task's mistakes."""
    known = judge(assignment, task.name)
    inputs, expected = reference.cases(assignment, task.name)
    entries: list[list[Entry]] = [[] for _ in expected]
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for result, entry in (*_mistakes(known, inputs, expected), *_changed(known, task, inputs, expected)):
            entries[result].append(entry)
        conditions = tuple(known.conditions(inputs)) if known.conditions is not None else ()
    return Known(tuple(map(tuple, entries)), known.said, conditions)


def known_from_students(task: Task, assignment: str) -> tuple[list[list[Entry]], list[MuslinError]]:
    """What the mistakes an assignment names make of each result, and what goes wrong with those that fail."""
    known, failures = judge(assignment, task.name), []
    inputs, expected = reference.cases(assignment, task.name)
    entries: list[list[Entry]] = [[] for _ in expected]
    for mistake in known.mistakes:
        try:
            for result, entry in _mistaken(mistake, known, inputs, expected):
                entries[result].append(entry)
        except MuslinError as error:
            failures.append(error)
    return entries, failures


def _mistakes(known: Judge, inputs: Given, expected: tuple[np.ndarray, ...]) -> Iterator[tuple[int, Entry]]:
    for mistake in known.mistakes:
        try:
            yield from _mistaken(mistake, known, inputs, expected)
        except MuslinError as error:
            if _slip(error):
                raise


def _mistaken(
    mistake: Mistake, known: Judge, inputs: Given, expected: tuple[np.ndarray, ...]
) -> list[tuple[int, Entry]]:
    """What one mistake makes of the public cases, with the result that it is made in."""
    if not 0 <= mistake.result < len(expected):
        what = f"the mistake {mistake.cause!r} is in result {mistake.result} of {len(expected)}"
        raise AuthorError(place(mistake.makes), what, "Results are counted from 0.")
    right = np.asarray(expected[mistake.result], dtype=np.float64)

    def truth(result: int = mistake.result, **changed: np.ndarray) -> np.ndarray:
        return _answers(known, {**inputs, **changed})[result]

    made = mistake.makes(Case(right, truth, inputs))
    words = (MISTAKE, mistake.cause, "", "", mistake.mistake, mistake.advice)
    several = made if isinstance(made, tuple) else (made,)
    return [(mistake.result, Entry(*words, made=_like(right, array, mistake))) for array in several]


def _slip(error: Exception) -> bool:
    """Whether an author's function is to blame, and not inputs to which there is no right answer."""
    return isinstance(error, AuthorError) and not error.numeric


def _like(right: np.ndarray, made: Any, mistake: Mistake) -> np.ndarray:
    """What a mistake makes of the right answer, which it must be like."""
    try:
        return np.broadcast_to(np.asarray(made, dtype=np.float64), right.shape)
    except (TypeError, ValueError):
        what = f"the mistake {mistake.cause!r} makes {np.shape(made)} of the right answers, {right.shape}"
        raise AuthorError(place(mistake.makes), what, "It is given all cases at once, (b, ...).") from None


def _changed(
    known: Judge, task: Task, inputs: Given, expected: tuple[np.ndarray, ...]
) -> Iterator[tuple[int, Entry]]:
    """Right answers to changed inputs: those that differ from the right ones, and from each other."""
    seen = {np.asarray(right, dtype=np.float32).tobytes() for right in expected}
    for cause, head, of, changed in changes(task, inputs) if known.truth is not None else ():
        try:
            _answers(known, {name: array[:1] for name, array in {**inputs, **changed}.items()})
            answers = _answers(known, {**inputs, **changed})
        except (*NUMERIC, MuslinError) as error:
            if _slip(error):
                raise
            continue
        for result, made in enumerate(answers):
            key = np.asarray(made, dtype=np.float32).tobytes()
            if key not in seen:
                seen.add(key)
                yield result, Entry(CHANGE, cause, head, of, "", "", made)


def _answers(known: Judge, inputs: Given) -> list[np.ndarray]:
    if known.truth is None:
        raise MuslinError("Nobody has written what is true of this task.")
    return [array.astype(np.float64) for array in exact.answers(known.truth, inputs)]


def changes(task: Task, inputs: Given) -> Iterator[tuple[str, str, str, dict[str, np.ndarray]]]:
    """Inputs a student may have used for the right ones: (cause, head of its words, of what, changed inputs)."""
    kinds: dict[str, list[str]] = {}
    for value in task.inputs:
        kinds.setdefault(value.kind, []).append(value.name)
    scalars, integers = kinds.get("scalar", []), kinds.get("int", [])
    vectors = kinds.get("vec3", [])
    matrices = kinds.get("mat3", [])
    points = [v.name for v in task.inputs if v.kind == "vec3" and v.unit == "m"]

    for names in kinds.values():
        for a, b in itertools.combinations(names, 2):
            yield f"swapped:{a},{b}", "swapped", f"{a} and {b}", {a: inputs[b], b: inputs[a]}
    for name in matrices:
        yield f"transposed:{name}", "transposed argument", name, {name: transposed(inputs[name])}
    for name in [*vectors, *matrices, *scalars]:
        yield f"missing:{name}", "missing", name, {name: np.zeros_like(inputs[name])}
    for name in matrices:
        yield f"missing:{name}", "missing", name, {name: np.broadcast_to(np.eye(3), inputs[name].shape)}
    for name in [*vectors, *matrices, *scalars]:
        yield f"negated:{name}", "negated argument", name, {name: -inputs[name]}
    for a, b in itertools.combinations([*vectors, *matrices], 2):
        zeros = {name: np.zeros_like(inputs[name]) for name in (a, b)}
        yield f"missing:{a},{b}", "missing", f"{a} and {b}", zeros
    for a, b in itertools.combinations(matrices, 2):
        both = {name: transposed(inputs[name]) for name in (a, b)}
        yield f"transposed:{a},{b}", "transposed argument", f"{a} and {b}", both
    for name in [*scalars, *vectors, *matrices]:
        yield f"doubled:{name}", "doubled", name, {name: inputs[name] * 2}
        yield f"halved:{name}", "halved", name, {name: inputs[name] / 2}
    for name in [*scalars, *vectors]:
        yield f"squared:{name}", "squared argument", name, {name: inputs[name] ** 2}
    for name in vectors:
        yield f"normalised:{name}", "normalised argument", name, {name: unit(inputs[name])}
    for name in integers:
        for k in (1, 2):
            yield f"shifted:{name}", "shifted", name, {name: (inputs[name] + k) % 3}
        for k in range(3):
            yield f"ignored:{name}", "ignored", name, {name: np.full_like(inputs[name], k)}
    for name in matrices:
        yield f"diagonal:{name}", "diagonal argument", name, {name: inputs[name] * np.eye(3)}
    if len(points) > 2:
        flat = {name: inputs[name] * np.array([1.0, 1.0, 0.0]) for name in points}
        yield "in a plane", "in a plane", "", flat
    for names in (vectors, points):
        if len(names) > 2:
            rolled = dict(zip(names, [inputs[n] for n in (*names[1:], names[0])], strict=True))
            yield f"rolled:{','.join(names)}", "rolled", ", ".join(names), rolled
    for name in vectors:
        for k in range(3):
            cut = inputs[name] * (np.arange(3) != k)
            yield f"missing:{name}[{k}]", "missing", f"component {k} of {name}", {name: cut}
    for name in vectors:
        for p in _permutations(3):
            yield f"permuted:{name}", "permuted argument", name, {name: inputs[name][:, p]}


def _permutations(n: int) -> list[tuple[int, ...]]:
    return [p for p in itertools.permutations(range(n)) if p != tuple(range(n))]
