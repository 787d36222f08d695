"""Kinetic energy, triangle by triangle, by the student's function."""

from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.base.launch import Launch, is_small
from muslin.physics.elements.fused import kinetic_energy
from muslin.tasks import usable
from muslin.tasks.batch import kept, run


class KineticEnergy:
    """Kinetic energy of every triangle, by the student's function.

    Parameters
    ----------
    function : taichi function
    n : int
        Number of vertices.
    triangles : (m, 3), area : (m,), rho, h
    """

    def __init__(
        self,
        function: Callable[..., Any],
        n: int,
        triangles: np.ndarray,
        area: np.ndarray,
        rho: float,
        h: float,
    ):
        self.function = usable(function)
        self._v, self._out = np.zeros((n, 3)), np.zeros(len(triangles))
        serial = is_small(len(triangles), 20)
        kernel = kept(function, ("kinetic_energy", serial), lambda: kinetic_energy(function, serial))
        self._launch = Launch(kernel, self._v, triangles, area, rho, h, self._out)

    def __call__(self, v: np.ndarray) -> np.ndarray:
        """(m,) [J] for velocities (n, 3)."""
        self._v[...] = v
        run(self._launch, self.function)
        return self._out
