"""Where the 3x3 blocks of a sparse matrix are stored.  (No Taichi here: solvers need it before anything runs.)"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp


@dataclass
class Layout:
    """Where 3x3 blocks of a matrix are stored: entry (a, b) of block k at `start[k] + a * stride[k] + b`.

    row, col : (k,) int arrays
        Vertices of each block.
    start, stride : (k,) int32 arrays
    size : int
        Length of the data array.
    """

    row: np.ndarray
    col: np.ndarray
    start: np.ndarray
    stride: np.ndarray
    size: int

    @classmethod
    def csr(cls, row: np.ndarray, col: np.ndarray, n: int) -> Layout:
        """Blocks, sorted by row and column, in the order of a scalar CSR matrix with 3 n rows."""
        ptr = pointers(row, n).astype(np.int64)
        degree = np.diff(ptr)[row]
        slot = np.arange(len(row)) - ptr[row]
        start, stride = 9 * ptr[row] + 3 * slot, 3 * degree
        return cls(row, col, start.astype(np.int32), stride.astype(np.int32), 9 * len(row))

    @classmethod
    def of(cls, graph: sp.csr_matrix) -> Layout:
        """Blocks where a graph (n, n) has entries, in the order of a scalar CSR matrix."""
        row = np.repeat(np.arange(graph.shape[0]), np.diff(graph.indptr))
        return cls.csr(row, graph.indices, graph.shape[0])

    def scalar(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """`indptr` and `indices` of the scalar CSR matrix with 3 n rows, where the layout came from `csr`."""
        degree = np.bincount(self.row, minlength=n)
        indptr = np.concatenate([[0], np.cumsum(np.repeat(3 * degree, 3))]).astype(np.int32)
        indices = np.empty(self.size, dtype=np.int32)
        for a in range(3):
            for b in range(3):
                indices[self.start + a * self.stride + b] = 3 * self.col + b
        return indptr, indices


def grouped(labels: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of integer labels 0..count-1 in the order of the labels, those of one label ascending: (order, pointers).

    In linear time: a tenth of a sort's.
    """
    zeros, numbers = np.zeros(len(labels), np.int32), np.arange(len(labels), dtype=np.int32)
    matrix = sp.coo_matrix((numbers, (labels, zeros)), shape=(count, 1))
    matrix.has_canonical_format = True  # nothing is to be added up
    rows = matrix.tocsr()
    return rows.data, rows.indptr.astype(np.int32)


def pointers(labels: np.ndarray, count: int) -> np.ndarray:
    """CSR row pointers of integer labels 0..count-1."""
    return np.concatenate([[0], np.cumsum(np.bincount(labels, minlength=count))]).astype(np.int32)
