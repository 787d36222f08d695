"""Where element rows go in the vectors and sparse matrices of the whole cloth: a pattern fixed by the mesh.

The matrix is stored as scalar CSR in 3x3 blocks, in scipy's own order, so that handing it over copies nothing.
Every entry *gathers* its contributions in a fixed order: no atomics, and the same bits with any number of
threads.
"""

import numpy as np
import scipy.sparse as sp
import taichi as ti

from muslin.elements.arrays import integers, mat3s, scalars, vec3s


class Pattern:
    """Sparsity of a triangle mesh with three unknowns per vertex.

    Parameters
    ----------
    triangles : (m, 3) int32
    n : int
        Number of vertices.

    Attributes
    ----------
    indptr, indices : int32 arrays
        Scalar CSR structure of a (3n, 3n) matrix, indices sorted.
    """

    def __init__(self, triangles: np.ndarray, n: int):
        m = len(triangles)
        self.n = n
        # vertex i gathers rows 3 e + corner
        order = np.argsort(triangles.ravel(), kind="stable")
        self.vertex_rows = order.astype(np.int32)
        self.vertex_ptr = _pointers(triangles.ravel(), n)
        # block (i, j) gathers rows 9 e + 3 corner_i + corner_j
        i = np.repeat(triangles, 3, axis=1).ravel().astype(np.int64)
        j = np.tile(triangles, 3).reshape(m, 9).ravel().astype(np.int64)
        keys, inverse = np.unique(i * n + j, return_inverse=True)
        self.block_rows = np.argsort(inverse, kind="stable").astype(np.int32)
        self.block_ptr = _pointers(inverse, len(keys))
        row, col = keys // n, keys % n
        row_ptr = _pointers(row, n).astype(np.int64)
        degree = np.diff(row_ptr)
        slot = np.arange(len(keys)) - row_ptr[row]
        self.start = (9 * row_ptr[row] + 3 * slot).astype(np.int32)
        self.stride = (3 * degree[row]).astype(np.int32)
        self.nnz = 9 * len(keys)
        self.indptr = np.concatenate([[0], np.cumsum(np.repeat(3 * degree, 3))]).astype(np.int32)
        self.indices = np.empty(self.nnz, dtype=np.int32)
        for a in range(3):
            for b in range(3):
                self.indices[self.start + a * self.stride + b] = 3 * col + b
        diagonal = np.flatnonzero(row == col)
        #: position in `data` of entry (3 i + a, 3 i + a), shape (n, 3)
        self.diagonal = np.stack(
            [self.start[diagonal] + a * (self.stride[diagonal] + 1) for a in range(3)], axis=1
        )

    def vector(self, rows: np.ndarray) -> np.ndarray:
        """Sum rows (3 m, 3), one per triangle corner, into (n, 3)."""
        out = np.empty((self.n, 3))
        _gather_vector(rows, self.vertex_ptr, self.vertex_rows, out)
        return out

    def data(self, blocks: np.ndarray) -> np.ndarray:
        """Sum blocks (9 m, 3, 3), corner by corner of each triangle, into the CSR data array (nnz,)."""
        out = np.empty(self.nnz)
        _gather_blocks(blocks, self.block_ptr, self.block_rows, self.start, self.stride, out)
        return out

    def matrix(self, data: np.ndarray) -> sp.csr_matrix:
        """Scipy matrix (3n, 3n) around a data array, without a copy."""
        matrix = sp.csr_matrix((data, self.indices, self.indptr), shape=(3 * self.n, 3 * self.n), copy=False)
        matrix.has_sorted_indices = True
        return matrix


def _pointers(labels: np.ndarray, count: int) -> np.ndarray:
    """CSR row pointers of sorted integer labels 0..count-1."""
    return np.concatenate([[0], np.cumsum(np.bincount(labels, minlength=count))]).astype(np.int32)


@ti.kernel
def _gather_vector(rows: vec3s, ptr: integers, index: integers, out: vec3s):
    for i in range(out.shape[0]):
        total = ti.Vector([0.0, 0.0, 0.0])
        for k in range(ptr[i], ptr[i + 1]):
            total += rows[index[k]]
        out[i] = total


@ti.kernel
def _gather_blocks(
    blocks: mat3s, ptr: integers, index: integers, start: integers, stride: integers, out: scalars
):
    for k in range(start.shape[0]):
        total = ti.Matrix.zero(float, 3, 3)
        for c in range(ptr[k], ptr[k + 1]):
            total += blocks[index[c]]
        for a, b in ti.static(ti.ndrange(3, 3)):
            out[start[k] + a * stride[k] + b] = total[a, b]
