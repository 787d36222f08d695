"""One triangle or tetrahedron under somebody's hands: what a folder's functions say of it, and what the framework says.

No window is needed for a `Play`; `play_page` is its face in a browser.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError, choices
from muslin.judging.checking import check
from muslin.judging.reference import cases
from muslin.physics import alone
from muslin.physics.alone import Alone
from muslin.physics.body import Body
from muslin.physics.roles import unusable
from muslin.tasks import Functions, load
from muslin.tasks.following import follow
from muslin.tasks.wiring import as_called, case_called

#: Share of a quantity's size from which on two values are said to be apart.
APART = 1e-9


@dataclass(frozen=True)
class Row:
    """A quantity: its symbol, unit and meaning, by whom it is computed, and its values.

    `yours` is None where the function cannot be called (`trouble` says why), `framework` where the framework has no
    such quantity of its own.
    """

    symbol: str
    unit: str
    meaning: str
    task: str = ""
    yours: np.ndarray | None = None
    framework: np.ndarray | None = None
    trouble: str = ""
    scale: float = 0.0

    @property
    def apart(self) -> bool:
        """Whether the two differ by more than rounding."""
        if self.yours is None or self.framework is None:
            return False
        size = max(float(np.abs(self.framework).max()), self.scale)
        return not np.allclose(self.yours, self.framework, rtol=0, atol=APART * size)


class Play:
    """A cell somebody pulls at.

    Parameters
    ----------
    cell : Alone
    functions : Functions, optional
        Whose functions are shown beside the framework's.

    Attributes
    ----------
    x : (k, 3) array
        Corners [m].
    rows : list of Row
        What is known at x.
    modes : dict
        Whose ("yours", "framework") -> eigenvalues (3k,) of the energy's Hessian [N/m] and eigenvectors (3k, 3k).
    """

    def __init__(self, cell: Alone, functions: Functions | None = None):
        self.functions = functions
        self._called = as_called(functions) if functions is not None else None
        energy = functions.assignment.energy if functions is not None else ""
        self.take(replace(cell, energy=energy), cell.X)

    def take(self, cell: Alone, x: np.ndarray) -> None:
        """Another cell, or another place for its corners."""
        self.cell = cell
        self._native = cell.body()
        self._own: Body | None = None
        if self.functions is not None:
            self._own = cell.body(self._called, unusable(self.functions))
        self.move(x)

    def move(self, x: np.ndarray) -> None:
        """Put the corners somewhere (k, 3) [m]; a place that is no place changes nothing."""
        x = np.array(x, dtype=np.float64)
        if x.shape != self.cell.X.shape or not np.isfinite(x).all() or _flat(x):
            return
        self.x = x
        self._look()

    def drag(self, corner: int, to: np.ndarray) -> None:
        """Move one corner."""
        x = self.x.copy()
        x[corner] = to
        self.move(x)

    def _look(self) -> None:
        cell, x = self.cell, self.x
        with np.errstate(all="ignore"):
            known = {symbol: value + 0.0 for symbol, value in cell.framework(x).items()}
        self.forces = {"framework": known["f"]}
        scales = cell.scales()

        def row(
            symbol: str, unit: str, meaning: str, mine: np.ndarray | None, task: str = "", trouble: str = ""
        ) -> Row:
            beside = known.get(symbol)
            return Row(symbol, unit, meaning, task, mine, beside, trouble, scales.get(symbol, 1.0))

        self.rows, own = [], dict[str, np.ndarray]()
        if self._called is not None:
            instead = {symbol: known[symbol][None] for symbol in ("F", "P")}
            calls, own = follow(self._called, cell.known(x), cell.following, instead)
            for call in calls:
                for k, value in enumerate(call.task.results):
                    mine = _plain(call.results[k]) if call.results else None
                    self.rows.append(
                        row(value.name, value.unit, value.meaning, mine, call.task.name, call.trouble)
                    )
            if any(row.symbol == "f" and row.yours is not None for row in self.rows):
                self.forces["yours"] = np.asarray(own["f"])
        shown = {row.symbol for row in self.rows}
        for symbol, (unit, meaning) in alone.QUANTITIES.items():
            if symbol not in shown:
                self.rows.append(
                    row(symbol, unit, meaning, _plain(own[symbol]) if symbol == "s" and "s" in own else None)
                )
        self._find_modes()

    def _find_modes(self) -> None:
        self.modes: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self.trouble = ""
        for whose, body in (("framework", self._native), ("yours", self._own)):
            if body is None or (whose == "yours" and body.by_student("hessian") is None):
                continue
            try:
                K = body.hessian(self.x).toarray()
                self.modes[whose] = tuple(np.linalg.eigh((K + K.T) / 2))  # type: ignore[assignment]
            except (MuslinError, np.linalg.LinAlgError) as error:
                self.trouble = str(error)

    # What it can be set to -----------------------------------------------------------------------------------

    def pose(self, name: str) -> None:
        """Take one of `POSES`."""
        if name not in POSES:
            raise MuslinError(f"There is no pose {name!r}.", choices(name, POSES))
        self.move(POSES[name](self.cell))

    def nearly_equal(self, gap: float, middle: float = 1.2) -> None:
        """Two principal stretches that differ by `gap`: where formulas that divide by it come to grief."""
        self.move(self.cell.at_stretches(np.array([middle + gap / 2, middle - gap / 2, 1.0])))

    def case(self, task: str, number: int) -> None:
        """The cell that a public case is about.

        Raises
        ------
        MuslinError
            If there is no such case, or it is about no cell.
        """
        if self.functions is None:
            raise MuslinError("Cases belong to the functions of an assignment.", "Give --functions.")
        table = self.functions.assignment
        if task not in table.tasks:
            raise MuslinError(f"There is no task {task!r}.", choices(task, table.tasks))
        inputs, expected = cases(table.name, task)
        if not 0 <= number < len(expected[0]):
            raise MuslinError(f"{task} has public cases 0 to {len(expected[0]) - 1}, not {number}.")
        own = {name: value[number] for name, value in inputs.items()}
        found = self.cell.case(case_called(table.tasks[task], own))
        if found is None:
            raise MuslinError(f"A case of {task} is about no triangle or tetrahedron that could be shown.")
        self.take(*found)

    def failing(self) -> list[tuple[str, int]]:
        """Public cases that fail and can be shown: (task, number), the simplest wrong one of each task."""
        if self.functions is None:
            return []
        found = []
        for verdict in check(self.functions, list(self.functions.assignment.tasks)):
            if verdict.ok or verdict.case is None:
                continue
            table = self.functions.assignment
            inputs, _ = cases(table.name, verdict.task)
            own = {name: value[verdict.case] for name, value in inputs.items()}
            if self.cell.case(case_called(table.tasks[verdict.task], own)) is not None:
                found.append((verdict.task, verdict.case))
        return found


def _plain(value: np.ndarray) -> np.ndarray:
    """A quantity without the axis of samples, where there is one sample only."""
    value = np.asarray(value) + 0.0  # no minus before a zero
    return value[0] if value.ndim and len(value) == 1 else value


def _flat(x: np.ndarray) -> bool:
    """Whether corners span no triangle, or no tetrahedron."""
    edges = x[1:] - x[0]
    measure = np.linalg.norm(np.cross(*edges)) if len(x) == 3 else abs(np.linalg.det(edges))
    return not measure > 1e-12 * max(float(np.abs(edges).max()), 1e-300) ** (len(x) - 1)


def _turned(cell: Alone) -> np.ndarray:
    axis, angle = np.array([1.0, 2.0, 0.5]) / np.linalg.norm([1.0, 2.0, 0.5]), 1.0
    K = np.cross(np.eye(3), axis)
    return cell.X @ (np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def _sheared(cell: Alone) -> np.ndarray:
    F = np.eye(3)
    F[0, 1] = 0.6
    return cell.X @ F.T


#: Named places for the corners.
POSES: Mapping[str, Callable[[Alone], np.ndarray]] = {
    "at rest": lambda cell: cell.X.copy(),
    "turned": _turned,
    "stretched along one axis": lambda cell: cell.at_stretches(np.array([1.5, 1.0, 1.0])),
    "stretched, both alike": lambda cell: cell.at_stretches(np.array([1.3, 1.3, 1.0])),
    "sheared": _sheared,
    "pressed together": lambda cell: cell.at_stretches(np.array([1.0, 0.5, 1.0])),
}


def begin(what: str | None, functions: Path | str | None, case: str | None = None, **material: Any) -> Play:
    """Something to play with.

    Parameters
    ----------
    what : str, optional
        A name in `muslin.physics.alone.CELLS`; default the one the functions are about, or a triangle.
    functions : path, optional
    case : str, optional
        "task:number", a public case to begin with.
    **material
        mu, lam [Pa].

    Raises
    ------
    MuslinError
        If there is no such thing.
    """
    loaded = None if functions is None else load(functions)
    own = alone.of_assignment(loaded.assignment.tasks) if loaded else next(iter(alone.CELLS))
    what = what or own
    if what not in alone.CELLS:
        raise MuslinError(f"There is no {what!r} to play with.", choices(what, alone.CELLS))
    if loaded is not None and what != own:
        raise MuslinError(
            f"The functions of the assignment {loaded.assignment.name!r} are about a {own}, not a {what}.",
            f"Leave {what!r} out, or play without functions elsewhere.",
        )
    for name, value in material.items():
        if not (np.isfinite(value) and value > (0 if name == "mu" else -material.get("mu", 1.0))):
            raise MuslinError(f"{name} = {value} gives no stable material.", "For example: --mu 1 --lam 1")
    made, _ = alone.CELLS[what]
    play = Play(made(**material), loaded)
    if case is not None:
        task, colon, number = case.partition(":")
        if not colon or not number.isdigit():
            raise MuslinError(f"--case {case!r} is not TASK:NUMBER.", "For example: --case psi:3")
        play.case(task, int(number))
    return play
