"""What an assignment knows of its tasks: written for every task, by the right names, and run."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterator
from difflib import get_close_matches
from types import ModuleType
from typing import Any

import numpy as np

from muslin import tasks
from muslin.authoring import mistakes
from muslin.authoring.lint.finding import Finding, Subject, of_error
from muslin.base import paths
from muslin.base.errors import MuslinError, near
from muslin.grading.known import MISTAKE, Entry, current, load
from muslin.judging import Given, Judge, cases, judge, properties, reference
from muslin.judging.knowledge import known as said_by
from muslin.judging.knowledge import modules, secret
from muslin.judging.parts import PARTS
from muslin.tasks import Task
from muslin.tasks.authored import guarded, place

#: Parts that are of use on a student's machine only, where `reference.py` and `judge/` are not: what misses them.
WITH_STUDENTS = {
    "properties": "a student's check is green where they do not hold",
    "steps": "muslin explain shows none",
    "derivative": "muslin gradcheck knows none",
}

#: How alike a part's name, and a task's, must be to a right one to be taken for it, of 1.
CLOSE_PART, CLOSE_TASK = 0.75, 0.8

#: Seed of the inputs that properties are tried on.
SEED = "lint"


def check_names(subject: Subject) -> Iterator[Finding]:
    """Every task has cases and a truth; nothing is said of a task that does not exist, or by a name nobody asks for."""
    files = modules(subject.name)
    for file in files:
        yield from (
            _misnamed(file, name, subject) for name in sorted(_unknown(file, list(subject.table.tasks)))
        )
    for task in subject.table.tasks:
        where = paths.shown(paths.generator(subject.name))
        for part, what in (("draw", "its cases cannot be drawn"), ("truth", "nobody says what is true")):
            if not any(hasattr(file, f"{part}_{task}") for file in files):
                yield Finding(where, f"there is no {part}_{task}: {what}", "write it")
        for part, missing in WITH_STUDENTS.items():
            name = f"{part}_{task}"
            if secret(subject.name, name):
                where = next(paths.shown(str(f.__file__)) for f in reversed(files) if hasattr(f, name))
                do = f"move it to {paths.shown(subject.source / 'practice' / subject.table.tasks[task].file)}"
                yield Finding(where, f"students do not get {name}: {missing}", do)


def _unknown(file: ModuleType, known: list[str]) -> set[str]:
    """Names of a file that are nearly a part of what is known of a task."""
    right = {f"{part}_{task}" for part in PARTS for task in known}
    own = [
        name
        for name, value in vars(file).items()
        if not name.startswith("_") and getattr(value, "__module__", file.__name__) == file.__name__
    ]
    return {name for name in own if name not in right and _nearly(name, known)}


def _nearly(name: str, known: list[str]) -> bool:
    """Whether a name is a part of a judge and nearly a task, or nearly a part and a task."""
    part, _, task = name.partition("_")
    if part in PARTS:
        return bool(get_close_matches(task, known, 1, CLOSE_TASK))
    parts = [name.removesuffix(f"_{task}") for task in known if name.endswith(f"_{task}")]
    return any(get_close_matches(part, PARTS, 1, CLOSE_PART) for part in parts)


def _misnamed(file: ModuleType, name: str, subject: Subject) -> Finding:
    every = [f"{part}_{task}" for part in PARTS for task in subject.table.tasks]
    do = f"did you mean {near(name, every)}? Else begin its name with _"
    return Finding(paths.shown(str(file.__file__)), f"nobody asks for {name}", do)


def check_judges(subject: Subject) -> Iterator[Finding]:
    """All that is known of each task runs, and agrees with the solution."""
    functions = tasks.load(subject.source, subject.table)
    for task in subject.table.tasks.values():
        known = judge(subject.name, task.name)
        for look in (_terms, _made, _said, _held):
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                try:
                    yield from look(subject, task, known, functions)
                except MuslinError as error:
                    yield of_error(subject.where(task.file, task.name), error)


def _terms(subject: Subject, task: Task, known: Judge, functions: tasks.Functions) -> Iterator[Finding]:
    inputs, _ = reference.cases(subject.name, task.name)
    if known.terms is not None and secret(subject.name, f"terms_{task.name}"):
        cases.sizes_of(subject.name, task.name, inputs)
    yield from ()


def _made(subject: Subject, task: Task, known: Judge, functions: tasks.Functions) -> Iterator[Finding]:
    """Mistakes run on the public cases, and are those on record."""
    made, failures = mistakes.known_from_students(task, subject.name)
    for error in failures:
        yield of_error(subject.where(task.file, task.name), error)
    if not current(subject.name, task.name):
        return  # said of the reference data
    recorded = load(subject.name, task.name, len(task.results))
    for k, entries in enumerate(made):
        there = list(recorded.of(k, MISTAKE))
        same = [(e.cause, e.mistake, e.advice) for e in entries] == [
            (e.cause, e.mistake, e.advice) for e in there
        ]
        if not (same and all(_alike(*pair) for pair in zip(entries, there, strict=True))):
            where = paths.shown(paths.known(subject.name) / f"{task.name}.npz")
            do = f"run: muslin reference mistakes {subject.name} --task {task.name}"
            yield Finding(where, f"it is older than mistakes_{task.name}", do)
            return


def _alike(made: Entry, recorded: Entry) -> bool:
    a, b = (np.asarray(entry.made, dtype=np.float32) for entry in (made, recorded))
    return bool(np.allclose(a, b, rtol=1e-5, atol=0, equal_nan=True))


def _said(subject: Subject, task: Task, known: Judge, functions: tasks.Functions) -> Iterator[Finding]:
    """Conditions are of the cases, and what lies on the way can be worked out."""
    inputs, _ = reference.cases(subject.name, task.name)
    count = len(next(iter(inputs.values())))
    for words, holds in known.conditions(inputs) if known.conditions else ():
        if np.shape(holds) != (count,):
            what = f"the condition {words!r} has shape {np.shape(holds)}, not ({count},)"
            yield Finding(place(known.conditions), what, "say of each case whether it holds")
    for case in range(count) if known.steps else ():
        known.steps({name: array[case] for name, array in inputs.items()})  # type: ignore[misc]


def _held(subject: Subject, task: Task, known: Judge, functions: tasks.Functions) -> Iterator[Finding]:
    """Properties draw what the task takes, and the solution has them."""
    from muslin.tasks.batch import evaluate

    for prop, inputs in properties.draw(subject.name, task.name, SEED):
        where, words = place(prop.inputs), f"the property {prop.name!r} of {task.name}"
        if set(inputs) != {value.name for value in task.inputs}:
            asked = ", ".join(value.name for value in task.inputs)
            yield Finding(where, f"{words} draws {', '.join(inputs)}", f"draw {asked}")
            continue
        got = evaluate(functions[task.name], **dict[str, Any](inputs))
        errors = properties.errors(prop, inputs, got if isinstance(got, tuple) else (got,))
        if np.ndim(errors) != 1:
            yield Finding(where, f"{words} gives {np.shape(errors)} errors", "give one of each sample, (b,)")
        elif (error := float(errors.max(initial=0.0))) > prop.tolerance:
            what = f"the solution breaks {words}: it is off by {error:.1e}"
            yield Finding(place(prop.judge), what, "correct the property, or the solution")


def check_laws(subject: Subject) -> Iterator[Finding]:
    """The laws of all functions together name tasks, and the solution obeys them."""
    from muslin.tasks.batch import evaluate
    from muslin.tasks.wiring import asked

    laws = said_by(subject.name, "laws") or ()
    for law in laws:
        for need in law.needs:
            if need not in subject.table.tasks:
                where, do = place(law.error), near(need, subject.table.tasks)
                what = f"the law {law.name!r} needs {need!r}, which is no task"
                yield Finding(where, what, f"did you mean {do}?" if do else "correct its needs")
                return
    if not laws or not subject.thorough:
        return
    functions = tasks.load(subject.source, subject.table)

    def ask(task: str, inputs: Given) -> tuple[np.ndarray, ...]:
        found = evaluate(functions[task], **dict[str, Any](inputs))
        return found if isinstance(found, tuple) else (found,)

    called, specimen = asked(subject.table.tasks, ask), said_by(subject.name, "specimen")
    together = specimen(called) if specimen is not None else called
    for law in laws:
        error, tolerance = guarded(law.error, f"the law {law.name!r}", inspect.getfile(law.error))(together)
        if not error <= tolerance:
            what = f"the solution breaks the law {law.name!r}: it is off by {error:.1e}"
            yield Finding(place(law.error), what, "correct the law, or the solution")
