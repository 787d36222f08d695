"""SciPy's SuperLU, and the pivoted LU that others fall back on."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from muslin.base.errors import SimulationError
from muslin.physics.elements.layout import Layout
from muslin.solve import ordering


class Indefinite(ArithmeticError):
    """A matrix that was to be positive definite is not."""


class SuperLU:
    """SciPy's SuperLU in symmetric mode: no extra package.

    A `definite` matrix needs no pivoting, which keeps the ordering's sparsity.
    """

    only_definite = False

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        self.n, self.definite = graph.shape[0], definite
        order = ordering.nested_dissection(graph, points, np.arange(self.n))
        self.order, self.place = order, np.argsort(order)
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        layout = Layout.of(permuted)
        self.indptr, self.indices = layout.scalar(self.n)
        self.layout = Layout(order[layout.row], order[layout.col], layout.start, layout.stride, layout.size)
        self.data = np.zeros(layout.size)

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve."""
        k = 3 * self.n
        matrix = sp.csc_matrix((self.data, self.indices, self.indptr), shape=(k, k), copy=False)
        self._factors = factors(matrix, self.definite, "NATURAL")
        return self.again(b)

    def again(self, b: np.ndarray) -> np.ndarray:
        """Solve with the factors that there are."""
        y = self._factors.solve(b.take(self.order, axis=0).ravel())
        return y.reshape(-1, 3).take(self.place, axis=0)


def factors(matrix: sp.csc_matrix, definite: bool, order: str) -> Any:
    """Factors of a symmetric matrix, without pivoting if it is `definite`; `order` as SciPy calls it."""
    if definite:
        try:
            return splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:
            pass
    return pivoted(matrix)


def pivoted(matrix: sp.csc_matrix) -> Any:
    """LU with partial pivoting, for matrices that are not positive definite (`project=False`).

    Raises
    ------
    SimulationError
        If the matrix is singular.
    """
    try:
        return splu(matrix)
    except RuntimeError:
        raise SimulationError(
            "The system matrix is singular.", "Reduce dt, or leave the projection of the Hessian on."
        ) from None
