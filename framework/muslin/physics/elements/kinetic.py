"""Kinetic energy, cell by cell, by the student's function."""

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.base.launch import Launch, is_small
from muslin.tasks import usable
from muslin.tasks.batch import kept, run


class KineticEnergy:
    """Kinetic energy of every cell, by the student's function.

    Parameters
    ----------
    function : taichi function
    kernel : callable
        Makes of the function, and of whether the loop is serial, the kernel that calls it in every cell.
    work : int
        What a call costs, see `is_small`.
    n : int
        Number of vertices.
    cells : (m, k)
    *rest
        What the kernel takes besides: the size of the cells, the density.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        kernel: Callable[[Callable[..., Any], bool], Callable[..., None]],
        work: int,
        n: int,
        cells: np.ndarray,
        *rest: Any,
    ):
        self.function = usable(function)
        self._v, self._out = np.zeros((n, 3)), np.zeros(len(cells))
        serial = is_small(len(cells), work)
        made = kept(function, ("kinetic_energy", serial), lambda: kernel(function, serial))
        self._launch = Launch(made, self._v, cells, *rest, self._out)

    def __call__(self, v: np.ndarray) -> np.ndarray:
        """(m,) [J] for velocities (n, 3)."""
        self._v[...] = v
        run(self._launch, self.function)
        return self._out
