"""The framework's own tetrahedron: F from three edges, stress from F and its cofactors, stiffness from its modes.

The same physics as a student's functions in another form, so that each checks the other: no inverse of F, no 9x9
matrix, no 12x12 matrix. The Hessian is made positive semi-definite mode by mode (see `laws`): six numbers are
clamped, and one 3x3 matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.base.errors import Inverted, SimulationError
from muslin.base.launch import Launch, is_small
from muslin.physics.elements.element import PARTS, Element
from muslin.physics.elements.tetrahedron_kernels import native


@dataclass(frozen=True)
class RestSolid:
    """Undeformed tetrahedra: positions (n, 3) [m], vertices (m, 4) and volumes (m,) [m^3]."""

    X: np.ndarray
    cells: np.ndarray
    volume: np.ndarray

    def gradients(self) -> np.ndarray:
        """Gradient of each corner's shape function, (4 m, 3) [1/m]."""
        a, b, c = (self.X[self.cells[:, k]] - self.X[self.cells[:, 0]] for k in (1, 2, 3))
        across = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        g = across / (6 * self.volume)[:, None, None]
        return np.concatenate([-g.sum(axis=1, keepdims=True), g], axis=1).reshape(-1, 3)


class NativeTetrahedron(Element):
    """Energy, gradient and Hessian of every tetrahedron, by the framework's own closed forms.

    Parameters
    ----------
    rest : RestSolid
    law : str
        A name in `LAWS`.
    a, b : float
        Its constants [Pa].
    """

    def __init__(self, rest: RestSolid, law: str, a: float, b: float):
        m = len(rest.cells)
        super().__init__(rest.X, rest.cells, (16 * m, 3, 3))
        self._orders = np.zeros(3, dtype=np.int32)
        kernel = native(law, is_small(m, 400))
        at_rest = (rest.gradients(), np.ascontiguousarray(rest.volume), float(a), float(b))
        out = (self.energies, self.gradients, self.hessians)
        self._launch = Launch(kernel, self._orders, *self.at, *at_rest, *out)

    def _run(self, parts: int, project: bool) -> None:
        self._orders[:] = parts, project, 0
        self._launch()
        if self._orders[2] and parts != PARTS["energy"]:
            require_upright(self.x, self.cells)


def require_upright(x: np.ndarray, cells: np.ndarray) -> None:
    """Refuse positions in which a tetrahedron is flat or inverted, where its energy is infinite.

    Raises
    ------
    Inverted
        Naming the first such tetrahedron.
    """
    if not np.isfinite(x).all():
        raise SimulationError("A position is not a number.", "Reduce dt, or check force and Hessian.")
    a, b, c = (x[cells[:, k]] - x[cells[:, 0]] for k in (1, 2, 3))
    wrong = np.flatnonzero(np.einsum("ij,ij->i", np.cross(a, b), c) <= 0)
    if len(wrong):
        corners, more = ", ".join(map(str, cells[wrong[0]])), len(wrong) - 1
        raise Inverted(
            f"Tetrahedron {wrong[0]} (vertices {corners}) is inverted"
            + (f", and {more} more" if more else "")
            + ": its energy is infinite.",
            "Reduce dt.",
        )
