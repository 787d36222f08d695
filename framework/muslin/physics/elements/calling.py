"""An element that calls a folder's functions: many in one kernel, and one by one where something goes wrong in it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from muslin.base.errors import SimulationError
from muslin.base.launch import Launch
from muslin.physics.elements.element import PARTS, Element
from muslin.tasks import failure_of, usable
from muslin.tasks.batch import kept, run


class CallingElement(Element):
    """Energy, gradient and Hessian by the functions `f`.

    Parameters
    ----------
    f : namespace
        The functions by name.
    needs : mapping
        What this element will be asked for, of "energy", "gradient" and "hessian", and the tasks behind each: no
        other function is called.
    X, cells, hessians
        See `Element`.
    """

    #: Task -> what makes a kernel that calls its function alone, on all cells.
    kernels: Mapping[str, Callable[[Callable[..., Any]], Callable[..., None]]] = {}

    #: What messages call a cell.
    cell = "cell"

    def __init__(
        self,
        f: SimpleNamespace,
        needs: Mapping[str, tuple[str, ...]],
        X: np.ndarray,
        cells: np.ndarray,
        hessians: tuple[int, ...],
    ):
        super().__init__(X, cells, hessians)
        self.f = f
        self._orders = np.zeros(3, dtype=np.int32)
        self._able = sum(PARTS[part] for part, names in needs.items() if self._can(part, names))
        self._launch: Launch | None = None

    def _can(self, part: str, names: tuple[str, ...]) -> bool:
        """Whether the fused kernel can compute a part: all functions it needs may be called."""
        return all(failure_of(getattr(self.f, name)) is None for name in names)

    def _run(self, parts: int, project: bool) -> None:
        if parts & ~self._able:
            self._explain(parts)
            self._able, self._launch = parts, None
        self._orders[:] = parts, project, 0
        try:
            if self._launch is None:
                self._launch = self._fused(self._able)
            self._launch()
        except Exception:
            self._explain(parts)  # says better what is wrong, and where
            if self._able == parts:
                raise
            self._able, self._launch = parts, None  # what is wrong belongs to another part
            return self._run(parts, project)
        if self._orders[2]:
            self._explain(parts)

    @abstractmethod
    def _fused(self, able: int) -> Launch:
        """The kernel of these parts; the third of its orders answers 1 if something is not finite."""

    @abstractmethod
    def _explain(self, parts: int) -> None:
        """Call the functions behind these parts one by one, until one fails: its name is in the exception."""

    def _single(self, name: str, *arguments: Any) -> None:
        """Run the kernel around function `name`, made on first use, and look at what it returned."""
        function = usable(getattr(self.f, name))
        run(kept(function, name, lambda: self.kernels[name](function)), function, *arguments)
        result = arguments[-1]
        if not np.isfinite(result).all():
            self._complain(name, result)

    def _complain(self, name: str, result: np.ndarray) -> None:
        bad = ~np.isfinite(result).reshape(len(result), -1).all(axis=1)
        e = int(np.flatnonzero(bad)[0]) * len(self.cells) // len(result)
        corners = ", ".join(map(str, self.cells[e]))
        raise SimulationError(
            f"{name} returns a number that is not finite (NaN or infinity) in {self.cell} {e} "
            f"(vertices {corners}).",
            f"Look for a division by zero or a square root of something negative. Try: muslin check {name}",
        )
