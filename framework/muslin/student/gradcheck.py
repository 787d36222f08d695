"""Derivatives against differences: the error as a function of the step, and what its slope says.

A difference quotient of step t has two errors: what it leaves out, which shrinks like t (forward) or t^2
(central), and rounding, which grows like 1/t. Together they are a V. A wrong derivative shows no V: its error
stays where it is however small the step. `curves` runs in a worker, as student code does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.judging import Derivative, Line, judge
from muslin.judging.differences import CASES
from muslin.judging.told import Told
from muslin.tasks import manifest as tables
from muslin.tasks.wiring import results_called, to_called, to_own

Array = np.ndarray

#: Steps, in units of the size of what is moved.
STEPS = 10.0 ** np.linspace(-0.5, -12, 47)

ORDERS = {"forward": 1, "central": 2}


@dataclass(frozen=True)
class Curve:
    """What came of one derivative.

    `errors` and `reference` belong to `STEPS`: the student's and the right derivative against the differences,
    relative, the worst of the cases. `slope` is None where there is none: the difference is exact.
    """

    task: str
    words: str
    scheme: str
    errors: Array
    reference: Array
    slope: float | None
    right: bool


class Inputs:
    """Public cases, and functions: the student's where they are right, else the truth.

    Asked, and answering, as Muslin would call the functions, whatever the assignment's own convention.

    Parameters
    ----------
    functions : Functions, optional
        The student's; without, the truth answers for all of them.
    assignment : str
    told : Told
        What is true.
    """

    def __init__(self, functions: Any, assignment: str, told: Told):
        self.functions, self.assignment, self.told = functions, assignment, told
        self.table = tables.assignment(assignment).tasks
        self.whose: dict[str, str] = {}
        self.rng = np.random.default_rng(1)

    def cases(self, task: str) -> dict[str, Array]:
        """Inputs of a task's public cases."""
        from muslin.judging import reference

        return to_called(self.table[task], reference.cases(self.assignment, task)[0])

    def yours(self, task: str, **values: Array) -> Array:
        """The student's answer."""
        if self.functions is None:
            return self.true(task, **values)
        self.told.answer(task, values, wanted=False)
        return self._evaluated(task, values)

    def _evaluated(self, task: str, values: dict[str, Array]) -> Array:
        from muslin.tasks.batch import evaluate

        entry = self.table[task]
        found = evaluate(self.functions[task], **dict[str, Any](to_own(entry, values)))
        return np.asarray(results_called(entry, (found,))[0], dtype=float)

    def _told(self, task: str, values: dict[str, Array]) -> Array:
        entry = self.table[task]
        return results_called(entry, self.told.answer(task, to_own(entry, values)))[0].astype(float)

    def true(self, task: str, **values: Array) -> Array:
        """The right answer."""
        return self._told(task, values)

    def best(self, task: str, **values: Array) -> Array:
        """The student's answer if that function passes the public cases, else the right one."""
        if task not in self.whose:
            self.whose[task] = "your" if self._right(task) else "Muslin's"
        own = self.whose[task] == "your"
        if own:
            self.told.answer(task, values, wanted=False)
            return self._evaluated(task, values)
        return self._told(task, values)

    def _right(self, task: str) -> bool:

        if self.functions is None:
            return False
        from muslin.judging import checking

        (verdict,) = checking.check(self.functions, [task])
        return verdict.ok

    def direction(self, *shape: int) -> Array:
        """Random directions of length one."""
        d = self.rng.normal(size=(CASES, *shape))
        return d / np.linalg.norm(d.reshape(CASES, -1), axis=1).reshape(-1, *[1] * len(shape))


def derivatives(assignment: str) -> dict[str, Derivative]:
    """Derivatives of an assignment that can be checked, by task."""
    from muslin import tasks

    known = {name: judge(assignment, name).derivative for name in tasks.assignment(assignment).tasks}
    return {name: derivative for name, derivative in known.items() if derivative is not None}


def chosen(asked: list[str] | None, table: tables.Assignment) -> tuple[str, ...]:
    """The tasks to check of those asked for, or of all.

    Raises
    ------
    MuslinError
        If some were asked for, and none of them is a derivative.
    """
    known = derivatives(table.name)
    wanted = tables.chosen_tasks(asked, table)
    names = tuple(name for name in wanted or table.tasks if name in known)
    if wanted and not names:
        there = ", ".join(known) or "none"
        raise MuslinError(f"Nothing says of what {', '.join(wanted)} is a derivative.", f"There is: {there}.")
    return names


def record(assignment: str) -> dict[str, Array]:
    """The right answers that checking each derivative asks for, by key."""
    found: dict[str, Array] = {}
    for name, derivative in derivatives(assignment).items():
        line = derivative.line(Inputs(None, assignment, Told(assignment, f"gradcheck {name}", found)))
        _differences(line, derivative.scheme)
    return found


def curves(folder: Path, assignment: str, names: tuple[str, ...]) -> Iterator[Curve | tuple[str, str]]:
    """Curves of derivatives; (task, why not) for a function that cannot be run."""
    from muslin import tasks

    functions = tasks.load(folder, tasks.assignment(assignment))
    for name in names:
        derivative = judge(assignment, name).derivative
        assert derivative is not None
        scheme = derivative.scheme
        io = Inputs(functions, assignment, Told(assignment, f"gradcheck {name}"))
        try:
            line = derivative.line(io)
        except MuslinError as error:
            yield name, str(error)
            continue
        differences = _differences(line, scheme)
        errors, right = (_error(differences, value) for value in (line.yours, line.right))
        slope = slope_of(errors)
        good = bool(errors.min() <= 10 * right.min() + 1e-9)
        yield Curve(
            name, derivative.words.format(**io.whose), scheme, errors, right, slope if good else None, good
        )


def _differences(line: Line, scheme: str) -> Array:
    """Difference quotients, (c, k, ...)."""
    t = np.repeat(STEPS[None], CASES, axis=0)
    ahead = line.at(t)
    back = line.at(-t) if scheme == "central" else line.at(0 * t)
    apart = (2 if scheme == "central" else 1) * t
    return (ahead - back) / apart.reshape(*t.shape, *[1] * (ahead.ndim - 2))


def _error(differences: Array, derivative: Array) -> Array:
    """Relative error of each step, the worst case, (k,)."""
    count = len(derivative)
    error = np.linalg.norm((differences - derivative[:, None]).reshape(count, len(STEPS), -1), axis=-1)
    scale = np.abs(differences).reshape(count, -1).max(axis=1)
    return np.nan_to_num((error / scale[:, None]).max(axis=0), nan=np.inf) + 1e-17


def slope_of(errors: Array) -> float | None:
    """Slope of the branch that falls with the step, on logarithmic axes; None if there is none."""
    best = int(errors.argmin())
    falling = np.arange(len(errors)) < best
    falling &= (errors > 20 * errors[best]) & (errors < 0.1)
    if falling.sum() < 4:
        return None
    return float(np.polyfit(np.log10(STEPS[falling]), np.log10(errors[falling]), 1)[0])


def told(curve: Curve) -> list[str]:
    """A curve in words."""
    order = ORDERS[curve.scheme]
    best = int(curve.errors.argmin())
    mark = "ok  " if curve.right else "FAIL"
    head = f"{mark} {curve.task}: compared with {curve.scheme} differences of {curve.words}"
    if not curve.right:
        return [
            head,
            f"     The error stays at {curve.errors.min():.1e} however small the step, where it should fall to "
            f"{curve.reference.min():.0e}: this is not the derivative.",
        ]
    if curve.slope is None:
        return [
            head,
            "     Right. No slope to see: what is differentiated is so simple that the difference is exact, "
            f"and only rounding is left (error {curve.errors.min():.0e}).",
        ]
    verdict = "as it should be" if abs(curve.slope - order) < 0.3 else f"where {order} was expected"
    return [
        head,
        f"     Right. The error falls with slope {curve.slope:.2f}, {verdict} ({curve.scheme} differences: {order}), "
        f"to {curve.errors.min():.0e} at a step of {STEPS[best]:.0e}; from there on rounding grows.",
    ]


def plot(curve: Curve, path: Path) -> Path:
    """Draw the V-curve as a PNG."""
    from muslin import render

    image = render.line_plot(
        lines(curve), f"{curve.task}: {'right' if curve.right else 'wrong'}", "step", "relative error",
        log_x=True, log_y=True, markers=True,
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    return Path(render.write_png(path, image))


def lines(curve: Curve) -> dict[str, tuple[Array, Array]]:
    """What is drawn: a right derivative only where yours does not hide it, a slope only where there is one."""
    ideal = curve.reference[0] * (STEPS / STEPS[0]) ** ORDERS[curve.scheme]
    seen = ideal > curve.reference.min() / 10
    drawn = {} if curve.right else {"a right derivative": (STEPS, curve.reference)}
    drawn["yours, as a right one" if curve.right else "yours"] = (STEPS, curve.errors)
    if seen.any() and np.ptp(np.log10(STEPS[seen])) >= 1:
        drawn[f"slope {ORDERS[curve.scheme]}"] = (STEPS[seen], ideal[seen] / 5)  # beside yours, not on it
    return drawn
