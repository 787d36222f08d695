"""Where element rows go in the vectors and sparse matrices of the whole cloth: a pattern fixed by the mesh.

The matrix is stored as scalar CSR in 3x3 blocks, in scipy's own order, so that handing it over copies nothing.
Every entry *gathers* its contributions in a fixed order: no atomics, and the same bits with any number of
threads.
"""

import functools
import itertools

import numpy as np
import scipy.sparse as sp

from muslin.base.launch import Launch, is_small
from muslin.physics.elements.layout import Incidence, Layout, chosen, find, grouped, pointers, whole
from muslin.physics.elements.pattern_kernels import (
    add_blocks,
    assemble_blocks,
    assemble_modes,
    gather_vector,
    impulse,
    kinetic_energy,
)

#: Arrays that a `Gather` stays bound to.
KEPT = 4


class Gather:
    """Sums rows of cells' corners into vertices.

    Parameters
    ----------
    cells : (m, k) int32
    n : int
        Number of vertices.
    corners : (order, pointers), optional
        The cells' corners `grouped` by vertices, if that is known.
    """

    def __init__(self, cells: np.ndarray, n: int, corners: tuple[np.ndarray, np.ndarray] | None = None):
        self.n = n
        # vertex i gathers rows k e + corner
        self.vertex_rows, self.vertex_ptr = corners or grouped(cells.ravel(), n)

        self._bound: dict[int, tuple[np.ndarray, np.ndarray, Launch]] = {}

    def vector(self, rows: np.ndarray) -> np.ndarray:
        """Sum rows (k m, 3), one per corner of a cell, into (n, 3).

        Fastest where the rows are in the same array every time.
        """
        if id(rows) not in self._bound:  # an array that is held here shares its id with no other
            if len(self._bound) == KEPT:
                self._bound.clear()
            out, kernel = np.empty((self.n, 3)), gather_vector(is_small(self.n, 20))
            self._bound[id(rows)] = rows, out, Launch(kernel, rows, self.vertex_ptr, self.vertex_rows, out)
        _, out, launch = self._bound[id(rows)]
        launch()
        return out.copy()


class Pattern(Gather):
    """Sparsity of a mesh with three unknowns per vertex.

    Parameters
    ----------
    cells : (m, k) int32
        Vertices of triangles (k = 3) or tetrahedra (k = 4).
    n : int
        Number of vertices.
    widened : (h, l) int32, optional
        More cells whose corners are to be neighbours; nothing is gathered from them.
    incidence : Incidence, optional
        Of `cells`, if that is known.

    Attributes
    ----------
    corners : int
        k.
    row, col : (blocks,) int32
        Every pair of vertices that share a cell, sorted.
    layout : Layout
        Of these.
    ptr : (n + 1,) int32
        Where each vertex' blocks begin.
    held : (blocks,) bool
        Whether a block's pair shares one of `cells`.
    """

    def __init__(
        self,
        cells: np.ndarray,
        n: int,
        widened: np.ndarray | None = None,
        incidence: Incidence | None = None,
    ):
        at = incidence or Incidence.of(cells, n)
        super().__init__(cells, n, (at.corners, at.ptr))
        self.corners = cells.shape[1]
        if widened is None:
            self.row, self.col, self.block_rows, self.block_ptr = at.row, at.col, at.numbers, at.begin
            self.ptr = at.rows
        else:
            keys = np.unique(np.concatenate([_pairs(cells, n), _pairs(widened, n)]))
            self.row, self.col = whole(keys // n), whole(keys % n)
            self.ptr = pointers(self.row, n)
            self.block_rows, self.block_ptr = self.gathering(cells)
        self.held = np.diff(self.block_ptr) > 0
        self.nnz = 9 * len(self.row)

    @functools.cached_property
    def layout(self) -> Layout:
        """In scipy's own order."""
        return Layout.csr(self.row, self.col, self.n, self.ptr)

    @functools.cached_property
    def diagonal(self) -> np.ndarray:
        """Position in `data` of entry (3 i + a, 3 i + a), (n, 3)."""
        own = self.row == self.col
        start, stride = self.layout.start[own], self.layout.stride[own]
        return np.stack([start + a * (stride + 1) for a in range(3)], axis=1)

    @functools.cached_property
    def mirrored(self) -> np.ndarray:
        """Number of each block's transpose."""
        return grouped(self.col, self.n)[0]  # by columns, as the transposes are by rows

    @functools.cached_property
    def scalar(self) -> tuple[np.ndarray, np.ndarray]:
        """`indptr` and `indices`, int32: the scalar CSR structure of a (3n, 3n) matrix, indices sorted."""
        return self.layout.scalar(self.n)

    def gathering(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which rows each block gathers from cells (m, k) within the pattern: their numbers, and where each begins.

        Block (i, j) gathers rows k k e + k corner_i + corner_j.
        """
        k = cells.shape[1]
        block = self.find(np.repeat(cells, k, axis=1).ravel(), np.tile(cells, k).ravel())
        return grouped(block, len(self.row))

    def blocks(self, factor: np.ndarray) -> np.ndarray:
        """Sum numbers (k k m,), one per pair of a cell's corners, into one for each block."""
        taken = factor.take(self.block_rows)
        if self.held.all():
            return np.asarray(np.add.reduceat(taken, self.block_ptr[:-1]))
        sums = np.zeros(len(self.held), dtype=factor.dtype)
        sums[self.held] = np.add.reduceat(taken, self.block_ptr[:-1][self.held])
        return sums

    def neighbours(self, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices that have mass in common: where each one's begin, which they are, and how much it is."""
        if self.held.all():
            return self.ptr, self.col, mass
        row, col = self.row[self.held], self.col[self.held]
        return pointers(row, self.n), col, mass[self.held]

    def find(self, row: np.ndarray, col: np.ndarray) -> np.ndarray:
        """Number of the block of each pair of vertices that are neighbours."""
        return find(self.ptr, self.col, row, col)

    def matrix(self, data: np.ndarray) -> sp.csr_matrix:
        """Scipy matrix (3n, 3n) around a data array, without a copy."""
        indptr, indices = self.scalar
        matrix = sp.csr_matrix((data, indices, indptr), shape=(3 * self.n, 3 * self.n), copy=False)
        matrix.has_sorted_indices = True
        return matrix


def _pairs(cells: np.ndarray, n: int) -> np.ndarray:
    """Every pair (i, j) of each cell's corners as one number, i n + j."""
    k = cells.shape[1]
    i = np.repeat(cells, k, axis=1).ravel().astype(np.int64)
    return i * n + np.tile(cells, k).ravel().astype(np.int64)


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
    constant : (blocks of the pattern,) array, optional
        Factor of the identity in each block, which belongs to the Hessian [N/m].
    more : (cells, rows), optional
        Other cells (l, c) within the pattern, and their Hessians (c c l, 3, 3).
    lasting : bool
        Whether many matrices will be assembled, so that much may be done to do that fast.
    """

    def __init__(
        self,
        pattern: Pattern,
        layout: Layout,
        mass: np.ndarray,
        rows: np.ndarray,
        data: np.ndarray | None = None,
        constant: np.ndarray | None = None,
        more: tuple[np.ndarray, np.ndarray] | None = None,
        lasting: bool = True,
    ):
        k = pattern.find(layout.row, layout.col) if layout.number is None else layout.number
        self.data = np.empty(layout.size) if data is None else data
        self._layout, self._vertices = layout, pattern.n
        self._own = np.flatnonzero(layout.row == layout.col)
        self._order: np.ndarray | None = None
        self._scale = np.zeros(1)
        self._mass = mass.take(k)
        self._varying = None if constant is None else (self._mass.copy(), constant.take(k))
        kernel = assemble_modes if rows.ndim == 2 else assemble_blocks
        gathered = _rows(pattern.block_ptr, pattern.block_rows, k, lasting)
        serial = is_small(len(layout.start), 50)
        out = (self._scale, self.data)
        self._launch = Launch(kernel(serial), rows, *gathered, layout.start, layout.stride, self._mass, *out)
        self._more = None
        if more is not None:
            numbers, ptr = pattern.gathering(more[0])
            others = _rows(ptr, numbers, k, lasting)
            self._more = Launch(add_blocks(serial), more[1], *others, layout.start, layout.stride, *out)

    def __call__(self, scale: float) -> np.ndarray:
        """Write the data array, and return it: the next call writes over it."""
        if self._varying and scale != self._scale[0]:
            mass, constant = self._varying
            self._mass[:] = mass + scale * constant
        self._scale[0] = scale
        self._launch()
        if self._more:
            self._more()
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

    def add(self, row: np.ndarray, col: np.ndarray, blocks: np.ndarray) -> None:
        """Add 3x3 blocks (k, 3, 3) to those of pairs of vertices that share a cell, where the layout has them."""
        layout, n = self._layout, np.int64(self._vertices)
        if self._order is None:
            keys = layout.row.astype(np.int64) * n + layout.col
            self._order = np.argsort(keys)
            self._keys = keys[self._order]
        wanted = row.astype(np.int64) * n + col
        first, last = np.searchsorted(self._keys, wanted), np.searchsorted(self._keys, wanted, "right")
        which = np.repeat(np.arange(len(wanted)), last - first)  # a layout may have a block in several places
        begin = np.repeat(np.cumsum(last - first) - (last - first), last - first)
        own, added = self._order[first[which] + np.arange(len(which)) - begin], blocks[which]
        for a, b in itertools.product(range(3), repeat=2):
            np.add.at(self.data, layout.start[own] + a * layout.stride[own] + b, added[:, a, b])


def _rows(
    ptr: np.ndarray, numbers: np.ndarray, which: np.ndarray, lasting: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Some rows of numbers (row k: from ptr[k] on): where each begins and ends, (k, 2) int32, and the numbers.

    If it is `lasting`, one behind the other: a large sheet is assembled a tenth faster then.
    """
    begin, end = ptr[:-1].take(which), ptr[1:].take(which)
    if lasting:
        begin, numbers = chosen(ptr, numbers, which)
        begin, end = begin[:-1], begin[1:]
    return np.stack([begin, end], axis=1), numbers


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
        self._launch = Launch(kinetic_energy(is_small(n, 12)), *pattern.neighbours(mass), self._v, self._out)

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
        neighbours = pattern.neighbours(mass)
        gather = (rows, pattern.vertex_ptr, pattern.vertex_rows)
        self._launch = Launch(
            impulse(is_small(n, 20)), *gather, *neighbours, self.v, self.force, self._dt, self.out
        )

    def __call__(self, v: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
        """(n, 3) [kg m/s]; the next call writes over it."""
        self.v[...], self.force[...], self._dt[0] = v, force, dt
        self._launch()
        return self.out
