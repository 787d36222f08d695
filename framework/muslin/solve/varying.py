"""Systems whose pattern changes from one to the next: where surfaces touch, other vertices act on each other."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from muslin.physics.elements.layout import Layout
from muslin.solve.superlu import factors


class Varying:
    """SciPy's SuperLU for a fixed pattern of blocks and what is added to it, ordered again every time.

    Attributes
    ----------
    more : (3n, 3n) sparse matrix
        What to add to `data`.
    """

    only_definite = False

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        self.n, self.definite = graph.shape[0], definite
        graph = graph.sorted_indices()
        self.layout = Layout.of(graph)
        self._indptr, self._indices = self.layout.scalar(self.n)
        self.data = np.zeros(self.layout.size)
        self.more = sp.csc_matrix((3 * self.n, 3 * self.n))

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve."""
        shape = (3 * self.n, 3 * self.n)
        fixed = sp.csc_matrix((self.data, self._indices, self._indptr), shape=shape)  # symmetric
        y = factors(sp.csc_matrix(fixed + self.more), self.definite, "MMD_AT_PLUS_A").solve(b.ravel())
        return np.asarray(y).reshape(-1, 3)
