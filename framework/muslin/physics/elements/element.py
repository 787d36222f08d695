"""What every finite element is to a body: positions in; energies, gradients and Hessians out, one row per cell."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from muslin.base import runtime

#: Parts of what an element computes, as bits.
PARTS = {"energy": 1, "gradient": 2, "hessian": 4}


@dataclass(frozen=True)
class Rest:
    """Undeformed triangles: positions (n, 3) [m], vertices (m, 3), areas (m,) [m^2] and unit normals (m, 3)."""

    X: np.ndarray
    triangles: np.ndarray
    area: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Membrane:
    """What a sheet is made of: Lamé parameters [Pa], thickness [m], and the name of its energy."""

    mu: float
    lam: float
    h: float
    energy: str


def apart(X: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and cells (m, k) as kernels may take them: in double precision just these.

    In single precision every cell has its own corners, relative to its first: rounded where they are, a metre away,
    they would be wrong by what a strain of some 1e-5 is in a cell of a centimetre, more than a cloth's weight makes.
    """
    if not runtime.single():
        return X, cells
    own = X[cells] - X[cells[:, :1]]
    return own.reshape(-1, 3), np.arange(cells.size, dtype=np.int32).reshape(cells.shape)


class Element(ABC):
    """Elements of cells with k corners.

    Parameters
    ----------
    X : (n, 3)
        Undeformed positions [m].
    cells : (m, k) int32
    hessians : tuple of int
        Shape of the element Hessians: (k k m, 3, 3), block by block, or (m, modes.LENGTH) for triangles.

    Attributes
    ----------
    corners : int
        k: 3 for triangles, 4 for tetrahedra.
    energies : (m,)
        Of each cell [J].
    gradients : (k m, 3)
        Of each cell's energy in its corners [N].
    at : (positions, cells)
        Where things are, as kernels take it: see `apart`.
    hessians
        See above [N/m]. These arrays stay where they are, and hold what `compute` was last asked for.
    """

    def __init__(self, X: np.ndarray, cells: np.ndarray, hessians: tuple[int, ...]):
        m, self.corners = cells.shape
        self.x, self.cells = X.copy(), cells
        self.at = apart(self.x, cells)
        self.energies, self.gradients = np.zeros(m), np.zeros((self.corners * m, 3))
        self.hessians = np.zeros(hessians)
        self._done, self._projected = 0, False

    def update(self, x: np.ndarray) -> None:
        """Take new positions (n, 3)."""
        self.x[...] = x
        if self.at[0] is not self.x:
            self.at[0][...] = apart(self.x, self.cells)[0]
        self._done = 0

    def compute(self, *parts: str, project: bool = True) -> None:
        """Compute parts ("energy", "gradient", "hessian") here, in one go, unless they are known already.

        With `project` the Hessian of each cell is made positive semi-definite.

        Raises
        ------
        SimulationError
            If a cell has collapsed, or a function returns what is not a finite number.
        StudentCodeError, NotImplementedYet
            If a function cannot be compiled or is still the stub.
        """
        if "hessian" in parts and project is not self._projected:
            self._done &= ~PARTS["hessian"]
        missing = sum(PARTS[part] for part in parts) & ~self._done
        if missing:
            self._run(missing, project)
            self._done |= missing
            if missing & PARTS["hessian"]:
                self._projected = project

    @abstractmethod
    def _run(self, parts: int, project: bool) -> None:
        """Fill the arrays of these parts, given as bits."""
