"""Whether an answer is right: compared case by case with the truth.

The Euclidean norm of the difference must not exceed `TOLERANCE` times the *natural scale* of the case. That is the
norm of the right answer or, where that is larger, the size of the terms it is a sum of: near rest a stress is a small
difference of large numbers, and its rounding error is measured by those. Both are zero only where every term is, and
then the answer must be exactly zero.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from muslin.tasks.manifest import Task

#: Size of the terms an answer is a sum of: inputs (b, ...) -> (b,); None where the norm of the answer says enough.
Terms = Callable[[Mapping[str, np.ndarray]], Any] | None

#: Largest error of a right answer, relative to the natural scale of the case. Rounding alone makes up to
#: about 1e-12 on the thinnest triangles of the data; the mildest mistakes make 1e-3.
TOLERANCE = 1e-9

#: The same of a derivative, over how much rounding grows in a right formula (`loss_<task>`). Right formulas come to
#: 3e-15 in the worst of some ten arrangements of each, differences with steps up to 1e-5 to 5e-12 at least.
FORMULA = 1e-13

#: Below this the limit is told beside an error: both yours and what is expected look the same in six digits.
NEAR = 1e-5

#: Entries of a matrix that is shown whole, and how many are shown of a larger one.
LARGEST, ENTRIES = 36, 6


@dataclass(frozen=True)
class Limits:
    """Largest relative error of a right answer: of all cases or of each, (b,).

    Of the cases a share may be `spared`: those need only be right to `TOLERANCE`.
    """

    each: float | np.ndarray = TOLERANCE
    spared: float = 0.0

    def over(self, errors: np.ndarray) -> np.ndarray:
        """Which of the cases are wrong, errors (k, b) -> (b,)."""
        over = (errors > self.each).any(axis=0)
        if np.mean(over) <= self.spared:
            over &= (errors > TOLERANCE).any(axis=0)
        return np.asarray(over)


@dataclass(frozen=True)
class Verdict:
    """What came of one task: the worst relative `error`, and the `case` to look at, if it came that far."""

    task: str
    ok: bool
    message: str
    error: float | None = None
    case: int | None = None


_ORDINARY = Limits()


def size_of(array: np.ndarray) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    flat = np.abs(np.asarray(array, dtype=np.float64).reshape(len(array), -1))
    largest = flat.max(axis=1, initial=0.0)
    unit = flat / np.where(largest > 0, largest, 1.0)[:, None]  # squares must neither vanish nor overflow
    return largest * np.sqrt(np.sum(unit * unit, axis=1))


def largest_of(inputs: Mapping[str, np.ndarray], *names: str) -> np.ndarray:
    """Norm of the largest of several arguments, (b,)."""
    return np.max([size_of(inputs[name]) for name in names], axis=0)


def natural_scale(
    terms: Terms, expected: np.ndarray, inputs: Mapping[str, np.ndarray], result: int = 0
) -> np.ndarray:
    """What errors of a case are measured against: the larger of the answer and the terms it sums, (b,)."""
    summed = terms(inputs) if terms is not None and result == 0 else 0.0
    return np.maximum(size_of(expected), summed)


def compare(
    task: Task,
    got: np.ndarray | Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
    inputs: Mapping[str, np.ndarray],
    terms: Terms,
    limits: Limits = _ORDINARY,
) -> Verdict:
    """Compare the results of a task with the right ones.

    Shapes and types are checked first, then that every number is finite, then the error of every case.

    Parameters
    ----------
    task : Task
        Its entry in the task table.
    got : ndarray (b, ...), or a sequence of them
        What was computed.
    expected : sequence of ndarray, (b, ...)
        The truth.
    inputs : dict of ndarray, (b, ...)
        The arguments by name.
    terms : callable or None
        The task's own (see `natural_scale`).
    limits : Limits
        How far off a right answer may be.

    Returns
    -------
    Verdict
        With a message for people: the simplest wrong case, yours, expected, the error.
    """
    outputs = (got,) if isinstance(got, np.ndarray) else tuple(got)
    if (fault := form(task, outputs, expected, inputs)) is not None:
        return fault
    errors = np.stack(
        [
            _errors(terms, k, out, right, inputs)
            for k, (out, right) in enumerate(zip(outputs, expected, strict=True))
        ]
    )
    allowed = np.broadcast_to(np.asarray(limits.each, dtype=np.float64), errors.shape[1:])
    with np.errstate(over="ignore"):
        which, worst = (int(k) for k in np.unravel_index((errors / allowed).argmax(), errors.shape))
    error = float(errors[which, worst])
    wrong = np.flatnonzero(limits.over(errors))
    if not len(wrong):
        message = f"{len(expected[0])} cases agree; worst relative error {error:.1e}."
        return Verdict(task.name, True, message, error, worst)
    case = min(wrong, key=lambda k: len("".join(_inputs(task, inputs, k))))  # what is shortest to read
    which = int(errors[:, case].argmax())
    name = "" if len(expected) == 1 else f" ({task.results[which].name})"
    among = f", the simplest of {len(wrong)} that are wrong" if len(wrong) > 1 else ""
    head = f"wrong in case {case}{name}{among}: relative error {errors[which, case]:.1e}"
    if errors[which, case] < NEAR:
        head += f", where at most {allowed[case]:.0e} is right"
    both = _beside(np.asarray(outputs[which])[case], expected[which][case])
    return Verdict(task.name, False, "\n".join([head, *_inputs(task, inputs, case), *both]), error, int(case))


def _beside(yours: np.ndarray, right: np.ndarray) -> list[str]:
    """Both results, in lines; of a matrix too large for a terminal the entries that are farthest off."""
    if right.size <= LARGEST:
        return [*_block("yours", yours), *_block("expected", right)]
    off = np.abs(yours.astype(float) - right)
    order = np.argsort(-off, axis=None, kind="stable")[:ENTRIES]
    lines = [f"of {' x '.join(map(str, right.shape))} entries those that are farthest off:"]
    for at in (np.unravel_index(k, right.shape) for k in order):
        if off[at] > 0:
            place = ", ".join(str(int(i)) for i in at)
            lines.append(f"[{place}]   yours = {_text(yours[at])}   expected = {_text(right[at])}")
    return lines


def _errors(
    terms: Terms, which: int, output: np.ndarray, right: np.ndarray, inputs: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Relative error of each case in one result, (b,)."""
    error = size_of(output.astype(np.float64) - right)
    if right.dtype.kind == "i":  # an integer is right or wrong
        return np.where(error == 0, 0.0, 1.0)
    scale = natural_scale(terms, right, inputs, which)
    with np.errstate(over="ignore"):
        relative = np.where(error == 0, 0.0, error / np.where(scale > 0, scale, np.finfo(float).tiny))
    return np.nan_to_num(relative, nan=np.inf, posinf=np.inf)


def form(
    task: Task,
    outputs: Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
    inputs: Mapping[str, np.ndarray],
) -> Verdict | None:
    """What is wrong with the number, shapes, types or finiteness of results, before any value is compared."""
    if len(outputs) != len(expected):
        return Verdict(task.name, False, f"returns {len(outputs)} values where {len(expected)} are asked.")
    for value, output, right in zip(task.results, outputs, expected, strict=True):
        if output.shape != right.shape:
            message = f"{value.name} has shape {output.shape}; asked is {right.shape}."
            return Verdict(task.name, False, message)
        if output.dtype != right.dtype:
            message = f"{value.name} is of type {output.dtype}; asked is {right.dtype}."
            return Verdict(task.name, False, message)
        finite = np.isfinite(output.reshape(len(output), -1)).all(axis=1)
        if not finite.all():
            first = int(np.flatnonzero(~finite)[0])
            message = "\n".join(
                [
                    f"case {first}: {value.name} is not finite. Is something divided by zero?",
                    *_inputs(task, inputs, first),
                    *_block("yours", output[first]),
                ]
            )
            return Verdict(task.name, False, message, np.inf, first)
    return None


def shown(values: Mapping[str, Any]) -> list[str]:
    """Values by name, in lines, as a student would write them."""
    return [line for name, value in values.items() for line in _block(name, value)]


def _inputs(task: Task, inputs: Mapping[str, np.ndarray], case: int) -> list[str]:
    """The inputs of a case, by name, in lines."""
    return shown({value.name: inputs[value.name][case] for value in task.inputs})


def _block(label: str, value: np.ndarray) -> list[str]:
    """`label = value` in lines, a matrix row by row, as a student would write it."""
    rows = [_text(row) for row in value] if np.ndim(value) == 2 else [_text(value)]
    if len(rows) > 1:
        rows = [f"[{rows[0]},", *(f" {row}," for row in rows[1:-1]), f" {rows[-1]}]"]
    head = f"{label:8} = "
    return [head + rows[0], *(" " * len(head) + row for row in rows[1:])]


def _text(value: np.ndarray) -> str:
    """A number or a row of numbers, to six digits."""
    if np.asarray(value).dtype.kind == "i":
        return json.dumps(np.asarray(value).tolist())
    return json.dumps(np.vectorize(lambda number: float(f"{number:.6g}"), otypes=[object])(value).tolist())
