"""A student's functions against the reference data that ship with Muslin: no mpmath, no solution needed.

An answer is compared case by case: the Euclidean norm of the difference must not exceed `TOLERANCE` times the
*natural scale* of the case. That is the norm of the right answer or, where that is larger, the size of the
terms it is a sum of (`_terms`): near rest a stress is a small difference of large numbers, and its rounding
error is measured by those. Both are zero only where every term is, and then the answer must be exactly zero.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin import paths, tasks
from muslin.errors import MuslinError

#: Largest error of a right answer, relative to the natural scale of the case. Rounding alone makes up to
#: about 1e-12 on the thinnest triangles of the data; the mildest mistakes make 1e-3.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Verdict:
    """What came of one task: the worst relative `error`, and the `case` to look at, if it came that far."""

    task: str
    ok: bool
    message: str
    error: float | None = None
    case: int | None = None


def cases(
    assignment_name: str, task: str, folder: Path | None = None
) -> tuple[dict[str, np.ndarray], tuple[np.ndarray, ...]]:
    """Reference cases of a task.

    Parameters
    ----------
    assignment_name, task : str
        Which task.
    folder : Path, optional
        Where the data are; default the public ones.

    Returns
    -------
    inputs : dict of ndarray, (b, ...)
        The arguments by name.
    expected : tuple of ndarray, (b, ...)
        The results in order.

    Raises
    ------
    MuslinError
        If there are no such data, or the file is damaged.
    """
    entry = tasks.assignment(assignment_name).tasks.get(task)
    if entry is None:
        raise MuslinError(f"The assignment {assignment_name!r} has no task {task!r}.")
    path = (folder or paths.reference(assignment_name)) / f"{task}.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            inputs = {value.name: data[value.name] for value in entry.arguments}
            expected = tuple(data[f"expected_{value.name}"] for value in entry.results)
    except FileNotFoundError:
        raise MuslinError(
            f"There are no reference data for {task}: {paths.shown(path)} is missing."
        ) from None
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        hint = "Restore it, or install Muslin again."
        raise MuslinError(f"{paths.shown(path)} is damaged ({error}).", hint) from None
    return inputs, expected


def _size(array: np.ndarray) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    flat = np.abs(np.asarray(array, dtype=np.float64).reshape(len(array), -1))
    largest = flat.max(axis=1, initial=0.0)
    unit = flat / np.where(largest > 0, largest, 1.0)[:, None]  # squares must neither vanish nor overflow
    return largest * np.sqrt(np.sum(unit * unit, axis=1))


def _largest(inputs: Mapping[str, np.ndarray], *names: str) -> np.ndarray:
    return np.max([_size(inputs[name]) for name in names], axis=0)


#: Size of the terms an answer is a sum of, (b,), by task; 0 where the norm of the answer says enough.
_terms: Mapping[str, Callable[[Mapping[str, np.ndarray]], Any]] = {
    "phi": lambda a: 1.0,
    "dphi_dX": lambda a: 0.0,
    "interpolate": lambda a: _largest(a, "x0", "x1", "x2") * _size(a["phi"]),
    "deformation_gradient": lambda a: 1 + _largest(a, "x0", "x1", "x2") * _size(a["dphi_dX"]),
    "dn_dx": lambda a: 0.0,
    "mass_block": lambda a: 0.0,
    "kinetic_energy": lambda a: 0.0,
    "right_cauchy_green": lambda a: _size(a["F"]) ** 2,
    "psi": lambda a: 2 * a["mu"] + a["lam"],
    "dpsi_ds": lambda a: 2 * a["mu"] + a["lam"],
    "d2psi_ds2": lambda a: 0.0,
    "dpsi_dF": lambda a: _size(a["dpsi_ds"]),
    "nodal_force": lambda a: a["h"] * a["area"] * _size(a["P"]) * _size(a["grad_phi"]),
    "d2psi_dFij": lambda a: (
        _size(a["dpsi_ds"]) * (_size(a["dU"]) + _size(a["dV"])) + _size(a["d2psi_ds2"]) * _size(a["ds"])
    ),
    "eigensystem": lambda a: _size(a["d2psi_ds2"]),
    "sphere_contact": lambda a: 0.0,
    "filter_velocity": lambda a: _size(a["v"]),
}


def natural_scale(
    task: str, expected: np.ndarray, inputs: Mapping[str, np.ndarray], result: int = 0
) -> np.ndarray:
    """What errors of a case are measured against: the larger of the answer and the terms it sums, (b,)."""
    terms = _terms.get(task, lambda a: 0.0)(inputs) if result == 0 else 0.0
    return np.maximum(_size(expected), terms)


def compare(
    task: tasks.Task,
    got: np.ndarray | Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
    inputs: Mapping[str, np.ndarray],
    tolerance: float = TOLERANCE,
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
    tolerance : float
        Largest relative error of a right answer.

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
            _errors(task, k, out, right, inputs)
            for k, (out, right) in enumerate(zip(outputs, expected, strict=True))
        ]
    )
    which, worst = (int(k) for k in np.unravel_index(errors.argmax(), errors.shape))
    error = float(errors[which, worst])
    if error <= tolerance:
        message = f"{len(expected[0])} cases agree; worst relative error {error:.1e}."
        return Verdict(task.name, True, message, error, worst)
    wrong = np.flatnonzero((errors > tolerance).any(axis=0))
    case = min(wrong, key=lambda k: len("".join(_inputs(task, inputs, k))))  # what is shortest to read
    which = int(errors[:, case].argmax())
    name = "" if len(expected) == 1 else f" ({task.results[which].name})"
    among = f", the simplest of {len(wrong)} that are wrong" if len(wrong) > 1 else ""
    head = f"wrong in case {case}{name}{among}: relative error {errors[which, case]:.1e}"
    message = "\n".join(
        [
            head,
            *_inputs(task, inputs, case),
            *_block("yours", np.asarray(outputs[which])[case]),
            *_block("expected", expected[which][case]),
        ]
    )
    return Verdict(task.name, False, message, error, int(case))


def _errors(
    task: tasks.Task, which: int, output: np.ndarray, right: np.ndarray, inputs: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Relative error of each case in one result, (b,)."""
    error = _size(output.astype(np.float64) - right)
    if right.dtype.kind == "i":  # an integer is right or wrong
        return np.where(error == 0, 0.0, 1.0)
    scale = natural_scale(task.name, right, inputs, which)
    with np.errstate(over="ignore"):
        relative = np.where(error == 0, 0.0, error / np.where(scale > 0, scale, np.finfo(float).tiny))
    return np.nan_to_num(relative, nan=np.inf, posinf=np.inf)


def form(
    task: tasks.Task,
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


def check(
    functions: tasks.Functions, names: Iterable[str] | None = None, tolerance: float = TOLERANCE
) -> list[Verdict]:
    """Evaluate a folder's task functions on the public cases.

    A function that is missing, still the stub or broken gets a verdict with the reason; nothing is raised.

    Parameters
    ----------
    functions : Functions
        From `muslin.load`.
    names : iterable of str, optional
        Which tasks; default all, in the order of the task table.
    tolerance : float
        Largest relative error of a right answer.

    Returns
    -------
    list of Verdict
        One per task.
    """
    from muslin.batch import evaluate

    table = functions.assignment
    verdicts = []
    for name in table.tasks if names is None else names:
        inputs, expected = cases(table.name, name)
        try:
            arguments: dict[str, Any] = dict(inputs)
            got = evaluate(functions[name], **arguments)
        except MuslinError as error:
            verdicts.append(Verdict(name, False, str(error)))
        else:
            verdicts.append(compare(table.tasks[name], got, expected, inputs, tolerance))
    return verdicts


def shown(values: Mapping[str, Any]) -> list[str]:
    """Values by name, in lines, as a student would write them."""
    return [line for name, value in values.items() for line in _block(name, value)]


def _inputs(task: tasks.Task, inputs: Mapping[str, np.ndarray], case: int) -> list[str]:
    """The inputs of a case, by name, in lines."""
    return shown({value.name: inputs[value.name][case] for value in task.arguments})


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
