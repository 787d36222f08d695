"""Where element rows go in the vectors and sparse matrices of the whole cloth: a pattern fixed by the mesh.

The matrix is stored as scalar CSR in 3x3 blocks, in scipy's own order, so that handing it over copies nothing.
Every entry *gathers* its contributions in a fixed order: no atomics, and the same bits with any number of
threads.
"""

import itertools

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.base.launch import Launch, is_small
from muslin.physics.elements.layout import Layout, pointers
from muslin.physics.elements.pattern_kernels import (
    assemble_blocks,
    assemble_modes,
    gather_vector,
    impulse,
    kinetic_energy,
)


class Gather:
    """Sums rows of cells' corners into vertices.

    Parameters
    ----------
    cells : (m, k) int32
    n : int
        Number of vertices.
    """

    def __init__(self, cells: np.ndarray, n: int):
        self.n = n
        # vertex i gathers rows k e + corner
        self.vertex_rows = np.argsort(cells.ravel(), kind="stable").astype(np.int32)
        self.vertex_ptr = pointers(cells.ravel(), n)

    def vector(self, rows: np.ndarray) -> np.ndarray:
        """Sum rows (k m, 3), one per corner of a cell, into (n, 3)."""
        out = np.empty((self.n, 3))
        runtime.call(gather_vector, rows, self.vertex_ptr, self.vertex_rows, out)
        return out


class Pattern(Gather):
    """Sparsity of a mesh with three unknowns per vertex.

    Parameters
    ----------
    cells : (m, k) int32
        Vertices of triangles (k = 3) or tetrahedra (k = 4).
    n : int
        Number of vertices.

    Attributes
    ----------
    corners : int
        k.
    layout : Layout
        Every pair of vertices that share a cell.
    indptr, indices : int32 arrays
        Scalar CSR structure of a (3n, 3n) matrix, indices sorted.
    """

    def __init__(self, cells: np.ndarray, n: int):
        super().__init__(cells, n)
        m, k = cells.shape
        self.corners = k
        # block (i, j) gathers rows k k e + k corner_i + corner_j
        i = np.repeat(cells, k, axis=1).ravel().astype(np.int64)
        j = np.tile(cells, k).reshape(m, k * k).ravel().astype(np.int64)
        self._keys, inverse = np.unique(i * n + j, return_inverse=True)
        self.block_rows = np.argsort(inverse, kind="stable").astype(np.int32)
        self.block_ptr = pointers(inverse, len(self._keys))
        self.layout = Layout.csr(*np.divmod(self._keys, n), n)
        self.nnz = self.layout.size
        self.indptr, self.indices = self.layout.scalar(n)
        diagonal = self.layout.row == self.layout.col
        #: position in `data` of entry (3 i + a, 3 i + a), shape (n, 3)
        self.diagonal = _diagonal(self.layout, diagonal)

    def blocks(self, factor: np.ndarray) -> np.ndarray:
        """Sum numbers (k k m,), one per pair of a cell's corners, into one for each block."""
        return np.add.reduceat(factor[self.block_rows], self.block_ptr[:-1])

    def find(self, row: np.ndarray, col: np.ndarray) -> np.ndarray:
        """Number of the block of each pair of vertices."""
        return np.searchsorted(self._keys, row.astype(np.int64) * self.n + col)

    def matrix(self, data: np.ndarray) -> sp.csr_matrix:
        """Scipy matrix (3n, 3n) around a data array, without a copy."""
        matrix = sp.csr_matrix((data, self.indices, self.indptr), shape=(3 * self.n, 3 * self.n), copy=False)
        matrix.has_sorted_indices = True
        return matrix


class Assembly:
    """Sums mass and element Hessians into a data array: data = mass + scale * Hessian.

    Parameters
    ----------
    pattern : Pattern
    layout : Layout
        Which blocks, and where they go.
    mass : (blocks of the pattern,) array
        Factor of the identity in each block [kg].
    rows : (m, modes.LENGTH) or (k k m, 3, 3) array
        Element Hessians, as modes (of triangles) or as blocks; read again in every call.
    data : (layout.size,) array, optional
        Where to write.
    """

    def __init__(
        self,
        pattern: Pattern,
        layout: Layout,
        mass: np.ndarray,
        rows: np.ndarray,
        data: np.ndarray | None = None,
    ):
        k = pattern.find(layout.row, layout.col)
        count = np.diff(pattern.block_ptr)[k]
        ptr = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
        position = np.arange(ptr[-1]) + np.repeat(pattern.block_ptr[k] - ptr[:-1], count)
        self.data = np.empty(layout.size) if data is None else data
        self._layout, self._vertices = layout, pattern.n
        self._own = np.flatnonzero(layout.row == layout.col)
        self._scale = np.ones(1)
        kernel = assemble_modes if rows.ndim == 2 else assemble_blocks
        where = (layout.start, layout.stride, np.ascontiguousarray(mass[k]))
        contributions = (ptr, np.ascontiguousarray(pattern.block_rows[position]))
        self._launch = Launch(
            kernel(is_small(len(layout.start), 50)), rows, *contributions, *where, self._scale, self.data
        )

    def __call__(self, scale: float) -> np.ndarray:
        """Write the data array, and return it: the next call writes over it."""
        self._scale[0] = scale
        self._launch()
        return self.data

    def add_to_diagonal(self, vertices: np.ndarray, blocks: np.ndarray) -> None:
        """Add 3x3 blocks (k, 3, 3) to the blocks of distinct vertices (k,) with themselves, wherever those are."""
        layout, own = self._layout, self._own
        number = np.full(self._vertices, -1)
        number[vertices] = np.arange(len(vertices))
        own = own[number[layout.row[own]] >= 0]
        added = blocks[number[layout.row[own]]]
        for a, b in itertools.product(range(3), repeat=2):
            self.data[layout.start[own] + a * layout.stride[own] + b] += added[:, a, b]


def _diagonal(layout: Layout, blocks: np.ndarray) -> np.ndarray:
    """Positions of the three diagonal entries of each chosen block, (k, 3)."""
    start, stride = layout.start[blocks], layout.stride[blocks]
    return np.stack([start + a * (stride + 1) for a in range(3)], axis=1)


class KineticEnergy:
    """Kinetic energy 1/2 v_i^T (M v)_i, vertex by vertex.

    Parameters
    ----------
    pattern : Pattern
    mass : (blocks of the pattern,) array
        As for `Assembly`.
    """

    def __init__(self, pattern: Pattern, mass: np.ndarray):
        n = pattern.n
        self._v, self._out = np.zeros((n, 3)), np.zeros(n)
        neighbours = (pointers(pattern.layout.row, n), pattern.layout.col.astype(np.int32), mass)
        self._launch = Launch(kinetic_energy(is_small(n, 12)), *neighbours, self._v, self._out)

    def __call__(self, v: np.ndarray) -> np.ndarray:
        """(n,) [J] for velocities (n, 3)."""
        self._v[...] = v
        self._launch()
        return self._out


class Impulse:
    """Right-hand side of a step: M v + dt (external force - gradient), vertex by vertex.

    Parameters
    ----------
    pattern : Pattern
    mass : (blocks of the pattern,) array
        As for `Assembly`.
    rows : (k m, 3) array
        Gradient of each cell's energy in its corners; read again in every call.
    """

    def __init__(self, pattern: Pattern, mass: np.ndarray, rows: np.ndarray):
        n = pattern.n
        self.v, self.force, self.out = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        self._dt = np.zeros(1)
        neighbours = (pointers(pattern.layout.row, n), pattern.layout.col.astype(np.int32), mass)
        gather = (rows, pattern.vertex_ptr, pattern.vertex_rows)
        self._launch = Launch(
            impulse(is_small(n, 20)), *gather, *neighbours, self.v, self.force, self._dt, self.out
        )

    def __call__(self, v: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
        """(n, 3) [kg m/s]; the next call writes over it."""
        self.v[...], self.force[...], self._dt[0] = v, force, dt
        self._launch()
        return self.out
