"""Which mistake does a wrong answer look like?

The arrays that came are compared with what mistakes make of the right ones, the plainest first: the whole
answer transformed (`TRANSFORMS`), mistakes known from students (`muslin.grading.known`), a factor made of
the sizes of the inputs (`sized`), the right answer to changed inputs; then the same in a part of the answer (`parts`)
or in some of the cases (`conditions`); at last what one slip in a right formula makes of the public cases
(`muslin.grading.slips`). No solution is needed: what mistakes make of the cases is data. Where the student's text is
known, the one change of it that makes all cases right is told beside (`muslin.grading.repairing`).

Runs beside the grader, in the process of `muslin.grading.reader`, on plain arrays; the text is read, and never run.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from muslin import tasks
from muslin.grading import fitting, repairing, slips, stepped
from muslin.grading.diagnosis.factors import change_scaled, factor_of_each_case, scaled, sized
from muslin.grading.diagnosis.marched import watched
from muslin.grading.diagnosis.others import changed, digits, inexact, known, not_finite, singular, slipped
from muslin.grading.diagnosis.own import repaired
from muslin.grading.diagnosis.partial import conditions, parts, some, some_alike
from muslin.grading.diagnosis.question import Arrays, Diagnosis, Question, first
from muslin.grading.diagnosis.whole import by_transform, constant
from muslin.grading.diagnosis.words import WORDS
from muslin.grading.known import Known, load
from muslin.grading.slips import Slips
from muslin.judging import judge
from muslin.judging.arrays import lengths
from muslin.judging.reference import TOLERANCE, compare, natural_scale
from muslin.tasks import Task

__all__ = ["WORDS", "Diagnosis", "Question", "conditions", "diagnose", "misfit", "parts"]

#: The searches, in order: the plainest explanation wins.
SEARCHES = (
    by_transform,
    scaled,
    known,
    change_scaled,
    constant,
    singular,
    not_finite,
    digits,
    sized,
    changed,
    some_alike,
    slipped,
    some,
    factor_of_each_case,
)


#: Largest error, relative, of a derivative that is right but for what its differences leave out and rounding adds.
INEXACT = 2e-8


def diagnose(
    task: Task,
    got: tuple[np.ndarray, ...],
    expected: tuple[np.ndarray, ...],
    inputs: Mapping[str, np.ndarray],
    assignment: str = "cloth",
    text: str = "",
) -> Diagnosis | None:
    """Name the mistake behind a wrong answer.

    Parameters
    ----------
    task : Task
        Its entry in the task table.
    got, expected : tuple of ndarray, (b, ...)
        What came and what is right, one array per result of the task.
    inputs : dict of ndarray, (b, ...)
        The public cases.
    assignment : str
        Which assignment.
    text : str
        The student's file, where it is known: it is read, and never run.

    Returns
    -------
    Diagnosis or None
        None if nothing is wrong, shapes differ, or no known mistake looks like it.
    """
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _diagnose(task, got, expected, inputs, assignment, text)
    except Exception:  # a grade must never be lost for want of an explanation
        return None


def misfit(
    task: Task,
    expected: tuple[np.ndarray, ...],
    inputs: Mapping[str, np.ndarray],
    assignment: str,
    text: str,
) -> Diagnosis | None:
    """Name what is wrong where there is nothing to compare: the shapes in a function that does not compile.

    In a function in plain Python: what keeps it from coming to an end, be it an exception. Parameters
    are those of `diagnose`.
    """
    try:
        if task.in_python:
            scale = natural_scale(judge(assignment, task.name).terms, expected[0], inputs, 0)
            return watched(None, *stepped.stepped(text, task, inputs, None, expected[0], scale, assignment))
        terms = judge(assignment, task.name).terms
        scales = [natural_scale(terms, right, inputs, k) for k, right in enumerate(expected)]
        return repaired(None, fitting.fitting(text, task.name, inputs, expected, scales))
    except Exception:  # a grade must never be lost for want of an explanation
        return None


def _diagnose(
    task: Task,
    got: tuple[np.ndarray, ...],
    expected: tuple[np.ndarray, ...],
    inputs: Arrays,
    assignment: str,
    text: str,
) -> Diagnosis | None:
    if [np.shape(a) for a in got] != [np.shape(b) for b in expected]:
        return None
    # Integers last: so few values agree by chance with almost anything.
    entries = _of(assignment, task.name, len(expected), len(expected[0]))
    own = judge(assignment, task.name)
    scales = [natural_scale(own.terms, right, inputs, k) for k, right in enumerate(expected)]
    made = _slips(assignment, task.name, len(expected[0]))
    place = made.place if made is not None else lambda values, cases=None: ""

    def within(tolerance: float) -> bool:
        return all(_alike(a, b, scale, tolerance) for a, b, scale in zip(got, expected, scales, strict=True))

    limits = own.limits(inputs)
    right = compare(task, got, expected, inputs, own.terms, limits).ok
    nearly = own.derivative is not None and within(INEXACT) and not right
    wrong = not nearly and not within(TOLERANCE)  # no change of the text is to blame
    change = seen = None
    if text and wrong and (other := _other_constants(task, assignment, text)):
        return other
    if text and wrong and task.in_python:
        change, seen = stepped.stepped(text, task, inputs, got[0], expected[0], scales[0], assignment)
    elif text and wrong:
        change = repairing.looked_for(text, task.name, inputs, got, expected, scales, place)
    order = sorted(range(len(expected)), key=lambda k: expected[k].dtype.kind == "i")
    found: list[Diagnosis] = []
    for k in order:
        question = Question(
            task=task,
            index=k,
            got=np.asarray(got[k], dtype=np.float64),
            right=np.asarray(expected[k], dtype=np.float64),
            inputs=inputs,
            scale=scales[k],
            entries=np.ones(expected[k].shape[1:], dtype=bool),
            known=entries,
            slips=made,
            repair=change,
        )
        told = [] if nearly else list(_all(question))
        if nearly or (own.derivative is not None and [d.cause for d in told] == ["digits"]):
            told = [inexact(question, limits.each, text)]
        found += [_said(entries, d) for d in told]
    return watched(_joined(found), change, seen)


def _other_constants(task: Task, assignment: str, text: str) -> Diagnosis | None:
    """Where each student has constants of their own: that these are not theirs."""
    table = tasks.assignment(assignment)
    constants = table.constants
    if constants is None or not table.student or task.name not in constants.tasks:
        return None
    if (said := constants.said(table.student)) in text:
        return None
    return Diagnosis(
        "other constants",
        f"The constants in {constants.file} are not those of {table.student}.",
        f"Write yours at the top of it: {said}",
    )


def _alike(came: np.ndarray, right: np.ndarray, scale: np.ndarray, tolerance: float = TOLERANCE) -> bool:
    """Whether one result is right in all cases."""
    error = lengths((came - right).reshape(len(right), -1).astype(np.float64))
    return bool((error <= tolerance * scale).all())


def _slips(assignment: str, task: str, cases: int) -> Slips | None:
    """The slips of a task, if they were made of these cases."""
    found = slips.load(assignment, task)
    return found if found is not None and found.prints.shape[2] == cases else None


def _of(assignment: str, task: str, results: int, cases: int) -> Known:
    """What is known of a task's mistakes, if these are its public cases."""
    found = load(assignment, task, results)
    counts = {len(e.made) for entries in found.entries for e in entries}
    counts |= {len(holds) for _, holds in found.conditions}
    return found if counts <= {cases} else replace(found, entries=(), conditions=())


def _all(question: Question) -> Iterator[Diagnosis]:
    """What there is to say of one result: of what is not finite, and of wrong numbers beside it."""
    if not question.wrong.any():
        return
    found = first(question, SEARCHES)
    if found is not None:
        yield found
    finite = np.isfinite(question.seen(question.got)).all(axis=1)
    if found is not None and _not_finite(found) and (finite & question.wrong).any():
        beside = first(question.at(finite), SEARCHES)
        if beside is not None:
            yield beside


def _not_finite(found: Diagnosis) -> bool:
    return found.cause.split(": ")[-1] == "nan"


def _joined(found: list[Diagnosis]) -> Diagnosis | None:
    """The first thing to say; a division by zero hides no other mistake."""
    numbers = [d for d in found if not _not_finite(d)]
    broken = [d for d in found if _not_finite(d)]
    if numbers and broken:
        return replace(numbers[0], mistake=f"{numbers[0].mistake} Besides: {broken[0].mistake}")
    return found[0] if found else None


def _said(known: Known, found: Diagnosis) -> Diagnosis:
    """A diagnosis in this task's own words, if there are any."""
    mistake, advice = known.said.get(found.cause, ("", ""))
    return replace(found, mistake=mistake or found.mistake, advice=advice or found.advice)
