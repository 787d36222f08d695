"""Where the 3x3 blocks of a sparse matrix are stored.

What takes a loop over rows is done by kernels on one thread, and by NumPy and SciPy where kernels run elsewhere than
on the CPU: the same numbers, in three times the time. Nothing here starts the engine before something is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.base.launch import once


@dataclass
class Layout:
    """Where 3x3 blocks of a matrix are stored: entry (a, b) of block k at `start[k] + a * stride[k] + b`.

    row, col : (k,) int arrays
        Vertices of each block.
    start, stride : (k,) int32 arrays
    size : int
        Length of the data array.
    number : (k,) int array, optional
        Which each block is of those of the pattern that the layout was made for.
    """

    row: np.ndarray
    col: np.ndarray
    start: np.ndarray
    stride: np.ndarray
    size: int
    number: np.ndarray | None = None

    @classmethod
    def csr(cls, row: np.ndarray, col: np.ndarray, n: int, ptr: np.ndarray | None = None) -> Layout:
        """Blocks, sorted by row and column, in the order of a scalar CSR matrix with 3 n rows.

        `ptr`: where each row begins, if that is known.
        """
        ptr = pointers(row, n) if ptr is None else ptr
        stride = (3 * np.diff(ptr)).take(row)
        start = 6 * ptr.take(row) + 3 * np.arange(len(row), dtype=np.int32)  # 9 ptr + 3 (number - ptr)
        return cls(row, col, start, stride, 9 * len(row))

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
        if runtime.on_cpu():
            _run("columns", whole(self.col), self.start, self.stride, indices)
            return indptr, indices
        for a in range(3):
            for b in range(3):
                indices[self.start + a * self.stride + b] = 3 * self.col + b
        return indptr, indices


def grouped(labels: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of integer labels 0..count-1 in the order of the labels, those of one label ascending: (order, pointers).

    In linear time: a tenth of a sort's.
    """
    if runtime.on_cpu():
        order, ptr = np.empty(len(labels), dtype=np.int32), np.zeros(count + 1, dtype=np.int32)
        _run("grouped", whole(labels), np.empty(count, dtype=np.int32), order, ptr)
        return order, ptr
    zeros, numbers = np.zeros(len(labels), np.int32), np.arange(len(labels), dtype=np.int32)
    matrix = sp.coo_matrix((numbers, (labels, zeros)), shape=(count, 1))
    matrix.has_canonical_format = True  # nothing is to be added up
    rows = matrix.tocsr()
    return rows.data, rows.indptr.astype(np.int32)


def pointers(labels: np.ndarray, count: int) -> np.ndarray:
    """CSR row pointers of integer labels 0..count-1."""
    return np.concatenate([[0], np.cumsum(np.bincount(labels, minlength=count))]).astype(np.int32)


def whole(numbers: np.ndarray) -> np.ndarray:
    """Numbers as kernels take them: int32, one behind the other."""
    return np.ascontiguousarray(numbers, dtype=np.int32)


def inverse(order: np.ndarray) -> np.ndarray:
    """Where each number is in an order of all of them."""
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return place


def pairs(cells: np.ndarray, ptr: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, ...]:
    """Every pair (i, j) of each cell's corners, sorted, and once.

    Parameters
    ----------
    cells : (m, k) int32
    ptr, rows : int32 arrays
        `grouped` corners: which each vertex is.

    Returns
    -------
    row, col : (blocks,) int32
        i and j.
    numbers : (k k m,) int32
        Of pairs, k k e + k corner_i + corner_j, those of one block ascending.
    begin : (blocks + 1,) int32
        Where those of each block begin.
    first : (n + 1,) int32
        The first block of each vertex i.
    """
    (m, k), n = cells.shape, len(ptr) - 1
    if not runtime.on_cpu():
        i, j = np.repeat(cells, k, axis=1).ravel(), np.tile(cells, k).ravel()
        by_j, _ = grouped(j, n)
        numbers = by_j[grouped(i[by_j], n)[0]]
        keys = i[numbers].astype(np.int64) * n + j[numbers]
        begin = np.flatnonzero(np.diff(keys, prepend=-1))
        row, col = whole(keys[begin] // n), whole(keys[begin] % n)
        return row, col, numbers, np.append(begin, len(keys)).astype(np.int32), pointers(row, n)
    first = np.empty(n + 1, dtype=np.int32)
    numbers, others, row, col = np.empty((4, k * k * m), dtype=np.int32)
    begin = np.empty(k * k * m + 1, dtype=np.int32)
    _run(f"pairs_of_{k}", whole(cells).ravel(), ptr, rows, first, numbers, others, row, col, begin)
    found = first[n]
    return row[:found].copy(), col[:found].copy(), numbers, begin[: found + 1].copy(), first


@dataclass(frozen=True)
class Incidence:
    """Which corners of cells each vertex is, and which vertices share a cell: found once, for all that asks.

    Attributes
    ----------
    corners, ptr : int32 arrays
        The cells' corners, `grouped` by vertices.
    row, col, numbers, begin, rows : int32 arrays
        Of `pairs`.
    """

    corners: np.ndarray
    ptr: np.ndarray
    row: np.ndarray
    col: np.ndarray
    numbers: np.ndarray
    begin: np.ndarray
    rows: np.ndarray

    @classmethod
    def of(cls, cells: np.ndarray, n: int) -> Incidence:
        """Of cells (m, k) and n vertices."""
        corners, ptr = grouped(cells.ravel(), n)
        return cls(corners, ptr, *pairs(cells, ptr, corners))


def find(ptr: np.ndarray, col: np.ndarray, row: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Number of the entry (row, wanted) of a sparse matrix (CSR: ptr, col), int32; -1 where there is none."""
    if not runtime.on_cpu():
        shape = (len(ptr) - 1, int(max(col.max(initial=0), wanted.max(initial=0))) + 1)
        numbers = sp.csr_matrix((np.arange(1, len(col) + 1), col, ptr), shape=shape)
        return (
            whole(np.asarray(numbers[row, wanted]).ravel() - 1) if len(row) else np.zeros(0, dtype=np.int32)
        )
    found = np.empty(len(row), dtype=np.int32)
    if len(row):
        _run("find", ptr, col, whole(row), whole(wanted), found)
    return found


def permuted(graph: sp.csr_matrix, order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A symmetric graph in another order, or a part of it: (indptr, indices), int32, sorted."""
    n = len(order)
    if not runtime.on_cpu():
        inner = graph[order][:, order].tocsr()
        inner.sort_indices()
        return whole(inner.indptr), whole(inner.indices)
    begin, end = np.empty((2, n + 1), dtype=np.int32)
    col = np.empty(len(graph.indices), dtype=np.int32)
    _run("permuted", *_as_kernels_take(graph, order), begin, end, col)
    return begin, col[: begin[n]].copy()


def ordered(
    graph: sp.csr_matrix, order: np.ndarray
) -> tuple[Layout, tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """The blocks of a symmetric matrix on and above the diagonal, row by row, in an order of elimination.

    Returns
    -------
    layout : Layout
        Its vertices and blocks are those of the graph.
    blocks, entries : (indptr, indices), int32
        In that order, of the blocks and of all their entries.
    """
    n = len(order)
    if not runtime.on_cpu():
        numbers = np.arange(1, len(graph.indices) + 1)
        inner = sp.csr_matrix((numbers, graph.indices, graph.indptr), shape=graph.shape)[order][:, order]
        inner = sp.triu(inner, format="csr")
        inner.sort_indices()
        there = Layout.of(inner)
        vertices = whole(order[there.row]), whole(order[there.col])
        where = Layout(*vertices, there.start, there.stride, there.size, whole(inner.data - 1))
        return where, (whole(inner.indptr), whole(inner.indices)), there.scalar(n)
    most = (int(np.diff(graph.indptr).take(order).sum()) + n) // 2
    row, to, start, stride, number, col = np.empty((6, most), dtype=np.int32)
    ptr, indptr = np.empty(n + 1, dtype=np.int32), np.empty(3 * n + 1, dtype=np.int32)
    indices = np.empty(9 * most, dtype=np.int32)
    out = row, to, start, stride, number, ptr, col, indptr, indices
    _run("ordered", *_as_kernels_take(graph, order), *out)
    k = ptr[n]
    where = Layout(row[:k], to[:k], start[:k], stride[:k], 9 * int(k), number[:k])
    return where, (ptr, col[:k]), (indptr, indices[: 9 * k])


def _as_kernels_take(graph: sp.csr_matrix, order: np.ndarray) -> tuple[np.ndarray, ...]:
    """A graph's rows, an order, and where each row is in that: -1 for those that are left out."""
    order, place = whole(order), np.full(graph.shape[0], -1, dtype=np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    return whole(graph.indptr), whole(graph.indices), order, place


def chosen(ptr: np.ndarray, numbers: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Some rows of numbers (row k: from ptr[k] on), one behind the other: where each begins, and the numbers."""
    begin = np.zeros(len(which) + 1, dtype=np.int32)
    np.cumsum(np.diff(ptr).take(which), out=begin[1:])
    if not runtime.on_cpu():
        position = np.arange(begin[-1]) + np.repeat(ptr[which] - begin[:-1], np.diff(begin))
        return begin, np.ascontiguousarray(numbers[position])
    out = np.empty(begin[-1], dtype=np.int32)
    if len(out):
        _run("chosen", ptr, numbers, whole(which), begin, out)
    return begin, out


def _run(kernel: str, *arguments: Any) -> None:
    runtime.start()
    from muslin.physics.elements import layout_kernels

    once(getattr(layout_kernels, kernel), *arguments)
