"""The question a diagnosis answers: one array that came beside the right one; and the answer it gives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from muslin.grading.diagnosis.words import WORDS
from muslin.grading.known import Known
from muslin.grading.slips import Slips
from muslin.judging.arrays import lengths as norm
from muslin.judging.reference import TOLERANCE
from muslin.reading.repairs import Repair
from muslin.tasks import Task

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Diagnosis:
    """The most likely mistake.

    Attributes
    ----------
    cause : str
        Stable key: what, then which: "negated", "scaled:2", "missing:area", "transposed:dV", "row 0: zeros",
        "where i = j: scaled:1/2".
    mistake : str
        The mistake in words.
    advice : str
        One next step.
    """

    cause: str
    mistake: str
    advice: str


@dataclass(frozen=True)
class Question:
    """One result of a task: what came, what is right, and for which inputs. What mistake makes it so?

    Attributes
    ----------
    index : int
        Which result of the task.
    got, right : ndarray, (b, ...)
    inputs : dict of ndarray, (b, ...)
    scale : ndarray, (b,)
        What errors are measured against.
    entries : ndarray of bool, (...)
        Which entries of the answer are asked about.
    known : Known
        What mistakes known from students make of the cases.
    slips : Slips, optional
        What one slip in a right formula makes of the public cases.
    repair : Repair, optional
        The one change of the student's own text that makes all of it right.
    """

    task: Task
    index: int
    got: np.ndarray
    right: np.ndarray
    inputs: Arrays
    scale: np.ndarray
    entries: np.ndarray
    known: Known
    slips: Slips | None = None
    repair: Repair | None = None

    @property
    def name(self) -> str:
        """What the answer is called: by its name only if there are several."""
        return self.task.results[self.index].name if len(self.task.results) > 1 else "result"

    @property
    def whole(self) -> bool:
        """Whether the result is an integer."""
        return self.task.results[self.index].kind == "int"

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one answer."""
        return self.right.shape[1:]

    @property
    def wrong(self) -> np.ndarray:
        """Which cases are wrong, (b,)."""
        return ~(norm(self.seen(self.got - self.right)) <= TOLERANCE * self.scale)

    def seen(self, array: np.ndarray) -> np.ndarray:
        """The entries that are asked about, (b, n)."""
        return array[:, self.entries]

    def at(self, cases: np.ndarray) -> Question:
        """The same question about some of the cases."""
        picked = {name: array[cases] for name, array in self.inputs.items()}
        got, right, scale = (array[cases] for array in (self.got, self.right, self.scale))
        slipped = self.slips.at(cases) if self.slips is not None else None
        known = self.known.at(cases)
        return replace(self, got=got, right=right, inputs=picked, scale=scale, slips=slipped, known=known)

    def explained(self, candidate: Any, share: float = 0.9) -> bool:
        """Whether a candidate is what came, in nearly all cases and in nearly all of the wrong ones."""
        wrong, came = self.wrong, self.seen(self.got)
        candidate = self.seen(np.broadcast_to(np.asarray(candidate, dtype=np.float64), self.got.shape))
        broken = beyond(came)
        if broken.all(axis=1).mean() > 0.5:
            return False  # nothing in common with anything
        alike = (broken == beyond(candidate)).all(axis=1)
        came, candidate = (np.where(broken, 0.0, array) for array in (came, candidate))
        bound = 1e-6 * norm(candidate) + 1e-10 * self.scale
        same = alike & (norm(came - candidate) <= bound)
        # A mistake that changes nothing explains nothing.
        changed = ~(norm(candidate - self.seen(self.right)) <= bound) | broken.any(axis=1)
        mistaken = same & wrong & changed
        # Where what came is so nearly right that it is as near to both, a case speaks for neither.
        speaks = wrong & (changed | ~same)
        enough = mistaken.sum() >= share * speaks.sum() and mistaken.sum() > wrong.sum() / 2
        return bool(enough and same.mean() >= share)

    def factor(self) -> np.ndarray | None:
        """Number of each case by which the right answer must be multiplied, NaN where it is zero, (b,)."""
        came, right = self.seen(self.got), self.seen(self.right)
        squares = np.sum(right * right, axis=1)
        number = np.where(squares > 0, np.sum(came * right, axis=1) / squares, 0.0)
        bound = 1e-6 * norm(came) + 1e-10 * self.scale
        if not (norm(came - number[:, None] * right) <= bound).all():
            return None
        vanishing = norm(right) <= 1e-9 * self.scale
        return np.where(vanishing, np.nan, number)


def beyond(array: np.ndarray) -> np.ndarray:
    """Where numbers are not finite, or larger than any that the data on mistakes hold."""
    return ~(np.abs(array) <= np.finfo(np.float32).max)


#: Looks for a mistake.
Search = Callable[[Question], "Diagnosis | None"]


def first(question: Question, searches: tuple[Search, ...]) -> Diagnosis | None:
    """What the first search finds that finds anything."""
    return next((found for search in searches if (found := search(question)) is not None), None)


def about(question: Question, cause: str, of: str = "", words: str = "") -> Diagnosis:
    """A diagnosis in the words of `WORDS`."""
    head = words or cause.split(":")[0]
    mistake, advice = WORDS[head]
    return Diagnosis(
        cause, mistake.format(name=question.name, of=of), advice.format(name=question.name, of=of)
    )
