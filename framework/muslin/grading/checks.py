"""The layers of a task's checks, judged by the grader: form, public cases, hidden cases, properties.

Three stages of questions go to a worker. The `public` cases, and everything about them is told. Then the inputs of
the properties, drawn from the submission's seed apart from the hidden cases: they give nothing away, and what came of
them may be told too. Only when all that a submission can show is in do the `hidden` cases follow, drawn from the same
seed, with the answers worked out here. Of these nothing is told but a category: right, wrong, not finite, no answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from muslin.grading.laws import extent
from muslin.grading.reader import Reader
from muslin.grading.record import ERROR, FAILED, LAYERS, NOT_IMPLEMENTED, PASSED, SKIPPED, Check
from muslin.judging import Property, judge, properties, reference
from muslin.tasks import Assignment, Task
from muslin.tasks.comparing import Limits, Terms

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
class Hidden:
    """The hidden cases of a task and their answers."""

    inputs: Arrays
    expected: tuple[np.ndarray, ...]
    terms: Terms = None
    limits: Limits = field(default_factory=Limits)


#: Properties of a task, each with the inputs drawn for it.
Drawn = Sequence[tuple[Property, Arrays]]


def hidden(table: Assignment, task: str, seed: str, folder: Path | None = None) -> Hidden:
    """Draw the hidden cases of a task.

    Parameters
    ----------
    table : Assignment
    task : str
    seed : str
        What they are drawn from; the same seed gives the same bytes.
    folder : Path, optional
        An instructor's hidden reference data, used besides.

    Raises
    ------
    MuslinError
        If the instructor's data are missing or damaged.
    """
    from muslin.judging import cases

    made = cases.make(table.name, task, f"hidden {seed}", table.grading.hidden_cases)
    inputs = {value.name: made[value.name] for value in table.tasks[task].inputs}
    expected = tuple(made[f"expected_{value.name}"] for value in table.tasks[task].results)
    if folder is not None:
        more, answers = reference.cases(table.name, task, folder)
        inputs = {name: np.concatenate([array, more[name]]) for name, array in inputs.items()}
        expected = tuple(np.concatenate(pair) for pair in zip(expected, answers, strict=True))
    own = judge(table.name, task)
    return Hidden(inputs, expected, own.terms, own.limits(inputs))


def instructors_cases(table: Assignment, folder: Path | None) -> int:
    """How many hidden cases per task an instructor's folder holds.

    Raises
    ------
    MuslinError
        If the data of a task are missing or damaged.
    """
    if folder is None:
        return 0
    counts = [len(reference.cases(table.name, task, folder)[1][0]) for task in table.tasks]
    return counts[0]


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
        """Take note of a check, in the order of the layers; the first that fails decides what the task is."""
        self.checks.append(check)
        self.checks.sort(key=lambda known: LAYERS.index(known.layer))
        if check.status == FAILED and self.status == PASSED:
            self.status = FAILED


#: Trouble that is not a wrong answer: kind -> status of the task.
_STATUS = {"": PASSED, "stub": NOT_IMPLEMENTED}


def judge_public(
    table: Assignment, verdict: Verdict, outcome: Outcome, reader: Reader, data: bytes = b""
) -> None:
    """Form and public cases, added to a verdict with everything there is to say about them.

    Parameters
    ----------
    table : Assignment
    verdict : Verdict
    outcome : Outcome
    reader : Reader
        Who looks for the mistake, and for more to notice, in the text where an answer is wrong.
    data : bytes
        The student's file; it is read, and never run.
    """
    _judge_public(table, verdict, outcome, reader, data)
    last = verdict.checks[-1]
    if last.status == FAILED and not outcome.kind:
        notes = reader.notes(verdict.task.name, table.name, data)
        verdict.checks[-1] = replace(
            last, message="\n".join([last.message, *(f"look: {note}" for note in notes)])
        )


def _judge_public(table: Assignment, verdict: Verdict, outcome: Outcome, reader: Reader, data: bytes) -> None:
    task, verdict.printed = verdict.task, outcome.printed
    if outcome.kind:
        verdict.status = _STATUS.get(outcome.kind, ERROR)
        text = "not implemented yet" if outcome.kind == "stub" else outcome.text
        likely = None
        if outcome.kind == "code" or (task.in_python and outcome.kind in ("late", "python")):
            inputs, expected = reference.cases(table.name, task.name)
            likely = reader.misfit(task.name, expected, inputs, table.name, data)
        verdict.checks.append(Check("runs", "form", FAILED, text, None, None, *(likely or ())))
        return
    inputs, expected = reference.cases(table.name, task.name)
    fault = reference.form(task, outcome.results, expected, inputs)
    if fault is not None:
        verdict.add(
            _told("form", "form", fault, table, task, outcome.results, expected, inputs, reader, data)
        )
        return
    verdict.add(Check("form", "form", PASSED, "The shape, type and finiteness of the results are right."))
    own = judge(table.name, task.name)
    limits = own.limits(inputs)
    compared = reference.compare(task, outcome.results, expected, inputs, own.terms, limits)
    verdict.add(
        _told(
            "public cases", "public", compared, table, task, outcome.results, expected, inputs, reader, data
        )
    )


def _told(
    name: str,
    layer: str,
    found: reference.Verdict,
    table: Assignment,
    task: Task,
    got: tuple[np.ndarray, ...],
    expected: tuple[np.ndarray, ...],
    inputs: Arrays,
    reader: Reader,
    data: bytes,
) -> Check:
    """A check on public cases: all of it is told, and what it looks like."""
    error = found.error if found.error is not None and np.isfinite(found.error) else None
    if found.ok:
        return Check(name, layer, PASSED, found.message, found.case, error)
    likely = None
    if len(got) == len(expected) and all(a.shape == b.shape for a, b in zip(got, expected, strict=True)):
        likely = reader.diagnose(task.name, got, expected, inputs, table.name, data)
    advice = f"Read section {task.section} of the handout again, or ask for a hint."
    return Check(name, layer, FAILED, found.message, found.case, error, *(likely or ("", "", advice)))


def judge_properties(
    table: Assignment,
    verdict: Verdict,
    drawn: Drawn,
    outcome: Outcome | None,
    reader: Reader,
    data: bytes = b"",
) -> None:
    """The properties, added to a verdict; without an outcome they are skipped.

    Parameters
    ----------
    table, verdict, drawn, outcome, reader
    data : bytes
        The student's file. Where all public cases are right, what is behind the first that fails is looked for in it.
    """
    reached = outcome is not None and not outcome.kind
    parts: list[tuple[np.ndarray, ...]] = []
    if outcome is not None and reached:
        parts = properties.apart(outcome.results, [inputs for _, inputs in drawn])
    for k, (prop, inputs) in enumerate(drawn):
        found = None
        if outcome is None:
            status, message = SKIPPED, "skipped: the function does not run yet."
        elif not reached and k == 0:
            status, message = FAILED, f"It gave no answer. {outcome.text}"
        elif not reached:
            status, message = SKIPPED, "skipped: it was not reached."
        else:
            error = properties.judge(prop, inputs, parts[k])
            status, message = PASSED, prop.statement
            if not error <= prop.tolerance:
                status, message = FAILED, f"Does not hold{extent(error)}: {prop.statement}"
                if verdict.status == PASSED:
                    cases, expected = reference.cases(table.name, verdict.task.name)
                    name = verdict.task.name
                    found = reader.upheld(name, expected, cases, drawn, parts, table.name, data)
        said = found or (prop.cause if reached and status == FAILED else "",)
        verdict.add(Check(prop.name, "properties", status, message, None, None, *said))


def judge_hidden(verdict: Verdict, cases: Hidden | None, outcome: Outcome | None) -> None:
    """The hidden cases, added to a verdict: a category, no more."""
    verdict.add(Check("hidden cases", "hidden", *_category(verdict, cases, outcome)))


def _category(verdict: Verdict, cases: Hidden | None, outcome: Outcome | None) -> tuple[str, str]:
    """What is told of the hidden cases: one of four words of a submission that has seen them.

    Whatever keeps it from an answer is one: an error, a crash, too much time are its own choice, and each that is told
    from the others would carry something of the inputs out.
    """
    if cases is None or outcome is None:
        runs = verdict.passed("form")
        why = "the public cases come first" if runs else "the function does not run yet"
        return SKIPPED, f"skipped: {why}."
    if outcome.kind:
        return FAILED, "It gave no answer on hidden inputs: it raised an error, crashed, or took too long."
    if not all(np.isfinite(array).all() for array in outcome.results):
        return FAILED, "In some hidden cases the result is not finite. Can a division be by zero?"
    given = cases.expected, cases.inputs, cases.terms, cases.limits
    if reference.compare(verdict.task, outcome.results, *given).ok:
        return PASSED, f"{len(cases.expected[0])} hidden cases agree."
    return FAILED, (
        "Wrong values in hidden cases, which are drawn like the public ones. Does the function rely on "
        "particular numbers instead of a formula?"
    )


def judge_not(verdict: Verdict, layer: str, error: Exception) -> None:
    """Note that what a function answered could not be judged: a fault of ours, most likely."""
    why = f"What it answered could not be judged ({type(error).__name__})."
    verdict.add(Check("judged", layer, FAILED, f"{why} Tell whoever grades this, if it looks right to you."))
