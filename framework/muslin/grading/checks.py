"""The layers of a task's checks, judged by the grader: form, public cases, hidden cases, properties.

Two stages of questions go to a worker. `public` holds the public cases, and everything about them is told. Only
when all of a submission's public output is in does `private` follow: hidden cases, drawn for this submission
from its seed, with the answers worked out here, and the inputs of the properties. Of hidden cases nothing is
told but a category.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from muslin import reference
from muslin.grading import diagnosis, properties
from muslin.grading.laws import extent
from muslin.grading.record import ERROR, FAILED, LAYERS, NOT_IMPLEMENTED, PASSED, SKIPPED, Check
from muslin.tasks import Assignment, Task

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Outcome:
    """What a worker made of a question: the results, or the `kind` of trouble and its text.

    Kinds: "stub", "code" (does not compile, or not what the task asks), "python" (raises an exception), "file"
    (there is no such file to run), "late", "crash", "garbled".
    """

    results: tuple[np.ndarray, ...] = ()
    kind: str = ""
    text: str = ""
    printed: str = ""


@dataclass(frozen=True)
class Private:
    """The private stage of a task: hidden cases and their answers, and the inputs of the properties."""

    hidden: Arrays
    expected: tuple[np.ndarray, ...]
    properties: tuple[tuple[properties.Property, Arrays], ...]

    def inputs(self) -> dict[str, np.ndarray]:
        """All of it as one batch."""
        return properties.batch(self._parts())

    def split(self, results: tuple[np.ndarray, ...]) -> list[tuple[np.ndarray, ...]]:
        """Results of `inputs`, taken apart again."""
        return properties.apart(results, self._parts())

    def _parts(self) -> list[Arrays]:
        return [self.hidden, *(inputs for _, inputs in self.properties)]


def _count(inputs: Arrays) -> int:
    return len(next(iter(inputs.values())))


def private(table: Assignment, task: str, seed: str, folder: Path | None = None) -> Private:
    """Draw the private stage of a task.

    Parameters
    ----------
    table : Assignment
    task : str
    seed : str
        What it is drawn from; the same seed gives the same bytes.
    folder : Path, optional
        An instructor's hidden reference data, used besides.

    Raises
    ------
    MuslinError
        If the instructor's data are missing or damaged.
    """
    from muslin.authoring import reference_data

    made = reference_data.make(table.name, task, f"hidden {seed}", table.grading.hidden_cases)
    hidden = {value.name: made[value.name] for value in table.tasks[task].arguments}
    expected = tuple(made[f"expected_{value.name}"] for value in table.tasks[task].results)
    if folder is not None:
        more, answers = reference.cases(table.name, task, folder)
        hidden = {name: np.concatenate([array, more[name]]) for name, array in hidden.items()}
        expected = tuple(np.concatenate(pair) for pair in zip(expected, answers, strict=True))
    return Private(hidden, expected, properties.draw(table.name, task, seed))


@dataclass
class Verdict:
    """How a task fares, layer by layer."""

    task: Task
    checks: list[Check] = field(default_factory=list)
    status: str = PASSED
    printed: str = ""

    def passed(self, layer: str) -> bool:
        """Whether everything in a layer has passed."""
        return all(check.status == PASSED for check in self.checks if check.layer == layer)

    def credit(self, shares: Mapping[str, float]) -> float:
        """Share of the points earned."""
        earned = 0.0
        for layer in LAYERS:
            present = any(check.layer == layer for check in self.checks)
            if not (self.passed(layer) and (present or layer == "properties")):
                break
            earned += shares.get(layer, 0.0)
        return earned if self.status in (PASSED, FAILED) else 0.0

    def add(self, check: Check) -> None:
        """Take note of a check; the first that fails decides what the task is."""
        self.checks.append(check)
        if check.status == FAILED and self.status == PASSED:
            self.status = FAILED


#: Trouble that is not a wrong answer: kind -> status of the task.
_STATUS = {"": PASSED, "stub": NOT_IMPLEMENTED}


def judge_public(table: Assignment, task: Task, outcome: Outcome, notes: Sequence[str] = ()) -> Verdict:
    """Form and public cases, with everything there is to say about them.

    Parameters
    ----------
    table : Assignment
    task : Task
    outcome : Outcome
    notes : sequence of str
        What a reader notices in the function's text; told where an answer is wrong.
    """
    verdict = _judged(table, task, outcome)
    last = verdict.checks[-1]
    if notes and last.status == FAILED and not outcome.kind:
        verdict.checks[-1] = replace(
            last, message="\n".join([last.message, *(f"look: {note}" for note in notes)])
        )
    return verdict


def _judged(table: Assignment, task: Task, outcome: Outcome) -> Verdict:
    verdict = Verdict(task, printed=outcome.printed)
    if outcome.kind:
        verdict.status = _STATUS.get(outcome.kind, ERROR)
        text = "not implemented yet" if outcome.kind == "stub" else outcome.text
        verdict.checks.append(Check("runs", "form", FAILED, text))
        return verdict
    inputs, expected = reference.cases(table.name, task.name)
    fault = reference.form(task, outcome.results, expected, inputs)
    if fault is not None:
        verdict.add(_told("form", "form", fault, task, table, outcome.results, expected, inputs))
        return verdict
    verdict.add(Check("form", "form", PASSED, "The shape, type and finiteness of the results are right."))
    compared = reference.compare(task, outcome.results, expected, inputs)
    verdict.add(_told("public cases", "public", compared, task, table, outcome.results, expected, inputs))
    return verdict


def _told(
    name: str,
    layer: str,
    found: reference.Verdict,
    task: Task,
    table: Assignment,
    got: tuple[np.ndarray, ...],
    expected: tuple[np.ndarray, ...],
    inputs: Arrays,
) -> Check:
    """A check on public cases: all of it is told, and what it looks like."""
    error = found.error if found.error is not None and np.isfinite(found.error) else None
    if found.ok:
        return Check(name, layer, PASSED, found.message, found.case, error)
    likely = None
    if len(got) == len(expected) and all(a.shape == b.shape for a, b in zip(got, expected, strict=True)):
        likely = diagnosis.diagnose(task, got, expected, inputs, table.name)
    advice = f"Read section {task.section} of the handout again, or ask for a hint."
    return Check(
        name, layer, FAILED, found.message, found.case, error,
        likely.cause if likely else "", likely.mistake if likely else "", likely.advice if likely else advice,
    )  # fmt: skip


def category(kind: str) -> str:
    """What is told of trouble on inputs that are not to be known."""
    return {
        "late": "It took too long on hidden inputs.",
        "crash": "It crashed on hidden inputs.",
        "garbled": "It answered with something that is not an array.",
    }.get(kind, "It raised an error on hidden inputs.")


def judge_private(verdict: Verdict, stage: Private, outcome: Outcome | None) -> None:
    """Hidden cases and properties, added to a verdict; without an outcome they are skipped."""
    task = verdict.task
    names = [prop.name for prop, _ in stage.properties]
    if outcome is None or outcome.kind:
        if outcome is None:
            status, message = SKIPPED, "skipped: the function does not run yet."
        else:
            status, message = FAILED, category(outcome.kind)
        verdict.add(Check("hidden cases", "hidden", status, message))
        for name in names:
            verdict.add(Check(name, "properties", SKIPPED, "skipped: it was not reached."))
        return
    results, *rest = stage.split(outcome.results) if _shaped(task, stage, outcome) else [()]
    verdict.add(_hidden(verdict, stage, results))
    for (prop, inputs), part in zip(stage.properties, rest, strict=False):
        error = properties.judge(prop, inputs, part)
        if error <= prop.tolerance:
            verdict.add(Check(prop.name, "properties", PASSED, prop.statement))
        else:
            verdict.add(
                Check(
                    prop.name,
                    "properties",
                    FAILED,
                    f"Does not hold{extent(error)}: {prop.statement}",
                    cause=prop.cause,
                )
            )
    if not rest:
        for name in names:
            verdict.add(Check(name, "properties", FAILED, "The result has another shape than before."))


def _shaped(task: Task, stage: Private, outcome: Outcome) -> bool:
    """Whether the results are of the asked shapes and types, one row per input."""
    rows = len(next(iter(stage.inputs().values())))
    return len(outcome.results) == len(stage.expected) and all(
        got.shape == (rows, *right.shape[1:]) and got.dtype == right.dtype
        for got, right in zip(outcome.results, stage.expected, strict=True)
    )


def _hidden(verdict: Verdict, stage: Private, results: Sequence[np.ndarray]) -> Check:
    """The hidden cases: a category, no more."""
    name, layer = "hidden cases", "hidden"
    if not verdict.passed("public"):
        return Check(name, layer, SKIPPED, "skipped: the public cases come first.")
    if not results:
        return Check(name, layer, FAILED, "The result has another shape than before.")
    if not all(np.isfinite(array).all() for array in results):
        message = "In some hidden cases the result is not finite. Can a division be by zero?"
        return Check(name, layer, FAILED, message)
    found = reference.compare(verdict.task, tuple(results), stage.expected, stage.hidden)
    if found.ok:
        return Check(name, layer, PASSED, f"{_count(stage.hidden)} hidden cases agree.")
    message = (
        "Wrong values in hidden cases, which are drawn like the public ones. Does the function rely on "
        "particular numbers instead of a formula?"
    )
    return Check(name, layer, FAILED, message)
