"""Conjugate gradients, for systems whose factors are too large."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.base.errors import SimulationError
from muslin.physics.elements.layout import Layout, pointers
from muslin.solve import ordering
from muslin.solve.superlu import Indefinite

#: Least relative residual asked of conjugate gradients in single precision.
SINGLE = 1e-5


class ConjugateGradients:
    """Conjugate gradients in Taichi, preconditioned by the diagonal blocks, starting from a guess.

    It ends where |b - A y| <= tolerance |b| (in single precision never under `SINGLE`), and needs a positive definite
    matrix. No factors: memory grows like
    the mesh. The number of iterations, some hundreds to thousands on stiff cloth, decides its time.
    """

    only_definite = False

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        from muslin.base.launch import Launch
        from muslin.solve import conjugate_gradients_kernels as cg

        n = graph.shape[0]
        order = ordering.nested_dissection(graph, points, np.arange(n))  # neighbours lie near each other
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        layout = Layout.of(permuted)
        self.order, self.place = order, np.argsort(order)
        self.tolerance = max(tolerance, SINGLE if runtime.single() else 0.0)
        self.layout = Layout(order[layout.row], order[layout.col], layout.start, layout.stride, layout.size)
        self.data = np.zeros(layout.size)
        diagonal = np.flatnonzero(layout.row == layout.col).astype(np.int32)
        ptr, col = pointers(layout.row, n), layout.col.astype(np.int32)
        inverse = np.zeros((n, 3, 3))
        self._b, self._y, self._r, self._p, w = (np.zeros((n, 3)) for _ in range(5))
        part, self._sums = np.zeros((-(-n // cg.SPAN), 3)), np.zeros(5)
        matrix = (ptr, col, layout.start, layout.stride, self.data, inverse)
        self._invert = Launch(cg.invert_diagonal, self.data, layout.start, layout.stride, diagonal, inverse)
        self._begin = Launch(cg.begin, *matrix, self._b, self._y, self._r, self._p, self._sums)
        self._iterate = Launch(cg.iterate, *matrix, self._y, self._r, self._p, w, part, self._sums)
        self.iterations = 0

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Solve A y = b from a guess.

        Raises
        ------
        SimulationError
            If it does not converge: the matrix is not positive definite, or the tolerance below rounding.
        """
        self._b[...], self._y[...] = b[self.order], guess[self.order]
        self._invert()
        self._begin()
        enough = self.tolerance**2 * self._sums[2]
        self.iterations = 0
        while not self._sums[1] <= enough:
            if self.iterations >= 20 * len(b) + 1000 or not self._sums[0] > 0:
                if self.only_definite:
                    raise Indefinite
                size = np.sqrt(self._sums[1] / max(self._sums[2], 1e-300))
                raise SimulationError(
                    f"Conjugate gradients stopped at a residual of {size:.1e} after {self.iterations} iterations.",
                    "Reduce dt, raise tolerance, or take a direct solver.",
                )
            self._iterate()
            self.iterations += 1
        return self._y[self.place]
