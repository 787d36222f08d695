"""Other signs: what is not finite, huge, or nearly right; and what mistakes made beforehand come to."""

from __future__ import annotations

import ast

import numpy as np

from muslin.grading.diagnosis.own import agrees
from muslin.grading.diagnosis.partial import conditions, opposite, within
from muslin.grading.diagnosis.question import Diagnosis, Question, about
from muslin.grading.known import CHANGE, MISTAKE
from muslin.judging.arrays import lengths as norm


def not_finite(question: Question) -> Diagnosis | None:
    """Not finite: everywhere, or where."""
    broken = ~np.isfinite(question.seen(question.got)).all(axis=1)
    if not broken.any():
        return None
    found = about(question, "nan")
    if broken[question.wrong].mean() >= 0.9 and question.wrong.mean() >= 0.9:
        return found
    for words, holds in conditions(question):
        for phrase, where in ((words, holds), (opposite(words), ~holds)):
            if (where == broken).all():
                outer = about(question, f"where {phrase}", phrase, "where")
                return within(outer, found, f"where {phrase}", question.name)
    return found


def singular(question: Question) -> Diagnosis | None:
    """Huge or not finite nearly everywhere: something singular has been inverted."""
    came = np.abs(question.seen(question.got)).max(axis=1)
    huge = came > 1e7 * question.scale
    lost = ~np.isfinite(came)
    return about(question, "singular") if (huge & ~lost).any() and (huge | lost).mean() > 0.6 else None


def digits(question: Question) -> Diagnosis | None:
    """Right but for the last digits."""
    error = norm(question.seen(question.got - question.right))
    return about(question, "digits") if (error <= 1e-4 * question.scale).all() else None


def inexact(question: Question, allowed: float | np.ndarray, text: str) -> Diagnosis:
    """A derivative that is right but for more than rounding; only what looks like differences is called so.

    Their error is many times what rounding makes in most cases, and not in the hard ones alone; and there is a step.
    """
    error = norm(question.seen(question.got - question.right))
    relative = error / np.where(question.scale > 0, question.scale, np.inf)
    limits = np.broadcast_to(np.asarray(allowed, dtype=np.float64), relative.shape)
    case = int((relative / limits).argmax())
    of = f"its error in case {case} is {relative[case]:.0e}, where at most {limits[case]:.0e} is right"
    everywhere = np.mean(relative > 10 * limits) > 0.5
    return about(question, "digits", of, "differences" if everywhere and _has_a_step(text) else "rounding")


def _has_a_step(text: str) -> bool:
    """Whether a file holds a number that may be the step of a difference."""
    try:
        numbers = (node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant))
        return any(isinstance(number, float) and 0 < number <= LARGEST_STEP for number in numbers)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False


#: Steps of differences that make a derivative nearly right.
LARGEST_STEP = 1e-3


def known(question: Question) -> Diagnosis | None:
    """A mistake known from students."""
    for entry in question.known.of(question.index, MISTAKE):
        if question.explained(entry.made):
            return Diagnosis(entry.cause, entry.mistake, entry.advice)
    return None


def slipped(question: Question) -> Diagnosis | None:
    """One slip in a right formula: of those that come to the same, the plainest."""
    wrong = question.wrong
    if question.slips is None:
        return None
    alike = question.slips.like(question.index, question.got, question.scale, wrong)
    return next((Diagnosis(*words) for words in alike if agrees(words[0], question.repair)), None)


def changed(question: Question) -> Diagnosis | None:
    """The right answer to changed inputs."""
    for entry in question.known.of(question.index, CHANGE):
        if question.explained(entry.made):
            return about(question, entry.cause, entry.of, entry.head)
    return None
