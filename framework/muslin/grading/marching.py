"""A student's function in plain Python on its cases, as it is read: where it ends, and which way it goes there."""

from __future__ import annotations

import ast
import contextlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import Property, Seen, Way, judge, properties
from muslin.judging.reference import TOLERANCE
from muslin.reading.bounds import Unclear
from muslin.reading.repairs.readable import ordinary
from muslin.reading.source import Source
from muslin.reading.stepping import STEPS, Asked, Stepping, TooLong
from muslin.tasks import Task
from muslin.tasks.plain import builder

#: Most cases that are tried of each change; the first few of them, and most steps these may take each.
CASES, FEW, BRIEF = 12, 3, 2000

#: Steps after which no further case is watched.
WATCHED = 120_000

#: What is so much larger than the right answer hangs on the rounding of every step.
FAR = 100

#: Units that have an energy in them, and what energies are multiplied with: a right function does not mind.
ENERGIES, WEIGHTS = ("J", "N", "N/m"), (1e4, 1e-4)

#: What the inputs of properties are drawn from.
SEED = "marching"

#: What NumPy raises where a run goes astray.
BROKEN = (ArithmeticError, np.linalg.LinAlgError)

FAILS = (
    Unclear,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    ArithmeticError,
    np.linalg.LinAlgError,
)


class Marching:
    """A function of a text on its cases, those that are wrong first.

    Parameters
    ----------
    text : str
    task : Task
    inputs : dict of ndarray, (b, ...)
    got : ndarray, (b, ...), or None
        What came; None where it is not known.
    expected : ndarray, (b, ...)
    scale : ndarray, (b,)
    assignment : str

    Raises
    ------
    Unclear
        If the text cannot be read.
    """

    def __init__(
        self,
        text: str,
        task: Task,
        inputs: Mapping[str, np.ndarray],
        got: np.ndarray | None,
        expected: np.ndarray,
        scale: np.ndarray,
        assignment: str,
    ) -> None:
        table = tasks.assignment(assignment)
        build = builder(task, table, paths.assignment(assignment))
        if build is None or not ordinary(text):
            raise Unclear
        self.build, self.task, self.assignment = build, task, assignment
        self.module = ast.parse(text)
        own = {key: f.node for key, f in Source(text).functions.items()}
        self.node: ast.FunctionDef = next(
            line
            for line in self.module.body
            if isinstance(line, ast.FunctionDef) and line.name == task.name and task.name in own
        )
        self.functions = [line for line in self.module.body if isinstance(line, ast.FunctionDef)]
        self.got, self.expected, self.scale, self.spent = got, expected, scale, 0
        right = np.zeros(len(expected), dtype=bool)
        if got is not None:
            error = np.abs(got - expected).reshape(len(expected), -1).max(axis=1)
            right = error <= TOLERANCE * scale
        self.right_ones = right
        self.cases = {
            k: self._case({key: array[k] for key, array in inputs.items()}) for k in range(len(right))
        }
        wrong = sorted(np.flatnonzero(~right), key=self._steps)  # what costs little is tried first
        self.order = [*wrong[:CASES], *np.flatnonzero(right)[: CASES // 2]]

    def _steps(self, k: int) -> int:
        """Steps one case takes."""
        stepping = Stepping(self.node, {}, None, BRIEF, self.module)
        with contextlib.suppress(*FAILS):
            stepping.run(_own(self.cases[k]))
        return stepping.steps

    def _case(self, case: Mapping[str, Any]) -> dict[str, Any]:
        given = self.build(**case)
        return {v.name: _plain(given.get(v.name, case.get(v.name))) for v in self.task.arguments}

    def run(
        self,
        changes: Mapping[int, Any],
        case: Mapping[str, Any],
        seen: dict[int, Any] | None = None,
        most: int = STEPS,
    ) -> tuple[np.ndarray, Stepping]:
        """Where it ends with changes, and the run."""
        stepping = Stepping(self.node, changes, seen, most, self.module)
        try:
            return np.asarray(stepping.run(_own(case)), dtype=np.float64), stepping
        finally:
            self.spent += stepping.steps

    def compared(self, seen: dict[int, Any]) -> bool:
        """Whether the text, as it is read here, comes to what came; values on the way are noted in `seen`.

        Raises
        ------
        Unclear
            If it comes to something else.
        """
        read = False
        for k in dict.fromkeys((*self.order[:3], self.order[-1])):
            try:
                came, _ = self.run({}, self.cases[k], seen)
            except TooLong:
                continue
            except BROKEN:
                if self.got is None:
                    continue
                raise
            read = True
            if self.got is None:
                continue
            tame = np.isfinite(self.got[k]).all() and np.abs(self.got[k]).max() < FAR * self.scale[k]
            if tame and not np.allclose(came, self.got[k], rtol=1e-6, atol=1e-9 * self.scale[k]):
                raise Unclear
        return read or bool(seen)

    def right(self, changes: Mapping[int, Any]) -> bool:
        """Whether changes make the cases right."""
        for n, k in enumerate(self.order):
            try:
                came, _ = self.run(changes, self.cases[k], most=BRIEF if n < FEW else STEPS)
            except FAILS:
                return False
            if came.shape != self.expected[k].shape:
                return False
            if not np.abs(came - self.expected[k]).max() <= TOLERANCE * self.scale[k]:
                return False
        return True

    def holds(self, prop: Property, inputs: Mapping[str, np.ndarray], changes: Mapping[int, Any]) -> bool:
        """Whether a property holds with changes."""
        ends = []
        for k in range(len(next(iter(inputs.values())))):
            case = self._case({key: array[k] for key, array in inputs.items()})
            try:
                ends.append(self.run(changes, case)[0])
            except FAILS:
                return False
        if len({end.shape for end in ends}) != 1:
            return False
        return properties.judge(prop, inputs, (np.array(ends),)) <= prop.tolerance

    def sound(self, changes: Mapping[int, Any]) -> bool:
        """Whether with changes that make the cases right every property holds, too, and the way there is right."""
        try:
            drawn = properties.draw(self.assignment, self.task.name, SEED)
            if not all(self.holds(prop, inputs, changes) for prop, inputs in drawn):
                return False
            for weight in WEIGHTS:
                for k in self.order:
                    came = self.run(changes, self._weighed(self.cases[k], weight))[0]
                    if not np.abs(came - self.expected[k]).max() <= TOLERANCE * self.scale[k]:
                        return False
            return not any(self.seen(changes, self.cases[k]) for k in self.order)
        except (MuslinError, *FAILS):
            return False

    def _weighed(self, case: Mapping[str, Any], weight: float) -> dict[str, Any]:
        """A case in which all energies are so many times as large."""

        def times(value: Any) -> Any:
            return (lambda *a: weight * value(*a)) if callable(value) else weight * value

        units = {v.name: v.unit for v in self.task.arguments}
        return {key: times(value) if units[key] in ENERGIES else value for key, value in case.items()}

    def seen(self, changes: Mapping[int, Any], case: Mapping[str, Any]) -> list[Seen]:
        """What is wrong with the way it takes in one case."""
        watched = judge(self.assignment, self.task.name).watched
        if watched is None:
            return []
        asked: list[Asked] = []
        stepping = Stepping(self.node, changes, None, STEPS, self.module, asked)
        end, broken = None, False
        try:
            end = stepping.run(_own(case))
        except TooLong:
            pass
        except BROKEN:
            broken = True
        finally:
            self.spent += stepping.steps
        return list(watched(Way(case, [tuple(call) for call in asked], end, broken)))

    def watched(self, numbered: bool = True) -> Seen | None:
        """What is seen first in most of the wrong cases, as it is in the first of them, by its number."""
        found: list[tuple[int, Seen]] = []
        began = self.spent
        for k in np.flatnonzero(~self.right_ones):
            if self.spent - began > WATCHED:
                break
            found += [(int(k), seen) for seen in self.seen({}, self.cases[int(k)])[:1]]
        if not found:
            return None
        cause = Counter(seen.cause for _, seen in found).most_common(1)[0][0]
        k, first = next((k, seen) for k, seen in found if seen.cause == cause)
        why = first.why if all(seen.why == first.why for _, seen in found) else ""
        words = f"in case {k}, {first.words.removeprefix('in ')}" if numbered else first.words
        return replace(first, words=f"{words}{why}")


def _own(case: Mapping[str, Any]) -> dict[str, Any]:
    """A case of which nobody else sees what is written into its arrays."""
    return {key: value.copy() if isinstance(value, np.ndarray) else value for key, value in case.items()}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
