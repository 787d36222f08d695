"""Sparse symmetric systems of a cloth: one order per pattern, one numeric factorisation per step.

A solver says where it wants every 3x3 block (`layout`), the cloth is assembled straight into its `data`, and
`solve` does the rest: no copy, no permutation. Direct solvers, since cloth is stiff: CHOLMOD through cvxopt where
the `fast` extra is installed (under the GPL), else a Cholesky factorisation of our own (`multifrontal`), or, where
kernels do not compute in double precision on the CPU, SciPy's SuperLU.
Conjugate gradients, in Taichi, need no more memory than the matrix itself: "auto" takes them from `LARGE`
vertices on, where factors of a sheet no longer fit into a few gigabytes.
"""

from __future__ import annotations

import importlib.util
import itertools
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from muslin.base import runtime
from muslin.base.errors import MuslinError, SimulationError
from muslin.physics.elements.layout import Layout, pointers
from muslin.solve import cholmod, multifrontal, ordering

#: Vertices from which on "auto" iterates instead of factorising.
LARGE = 300_000

#: Least relative residual asked of conjugate gradients in single precision.
SINGLE = 1e-5

#: Free vertices from which on two threads factorise the two halves of a cloth.
HALVES = 700

#: Largest piece of a cloth that is a front of its own, uncut [vertices].
FRONT = 5


class Solver(Protocol):
    """A solver for all matrices of one symmetric pattern of blocks.

    Constructed from the graph of the free vertices (CSR, diagonal included), their coordinates (n, 3), whether
    the matrices will be positive definite, and a tolerance that only iterative solvers use.
    """

    layout: Layout
    data: np.ndarray

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Solve A y = b, both (n, 3), for the matrix that is in `data` now."""
        ...


def _whole(graph: sp.csr_matrix) -> Layout:
    row = np.repeat(np.arange(graph.shape[0]), np.diff(graph.indptr))
    return Layout.csr(row, graph.indices, graph.shape[0])


class SuperLU:
    """SciPy's SuperLU in symmetric mode: no extra package.

    A `definite` matrix needs no pivoting, which keeps the ordering's sparsity.
    """

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        self.n, self.definite = graph.shape[0], definite
        order = ordering.nested_dissection(graph, points, np.arange(self.n))
        self.order, self.place = order, np.argsort(order)
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        layout = _whole(permuted)
        self.indptr, self.indices = layout.scalar(self.n)
        self.layout = Layout(order[layout.row], order[layout.col], layout.start, layout.stride, layout.size)
        self.data = np.zeros(layout.size)

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve."""
        k = 3 * self.n
        matrix = sp.csc_matrix((self.data, self.indices, self.indptr), shape=(k, k), copy=False)
        y = self._factors(matrix).solve(b.take(self.order, axis=0).ravel())
        return y.reshape(-1, 3).take(self.place, axis=0)

    def _factors(self, matrix: sp.csc_matrix) -> Any:
        if self.definite:
            try:
                return splu(
                    matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
                )
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


class Multifrontal:
    """Cholesky factorisation by dense fronts, in kernels of our own: see `muslin.solve.multifrontal`."""

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        from muslin.base.launch import Launch
        from muslin.solve.fronts import factorisation

        n = graph.shape[0]
        nodes, children = ordering.dissection(graph, points, np.arange(n), FRONT)
        order = np.concatenate(nodes)
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        self.plan, row, col = multifrontal.plan(
            permuted, [len(node) for node in nodes], children, n >= HALVES
        )
        self._order, self._place = order, np.argsort(order)
        start = 12 * np.arange(len(row), dtype=np.int32)
        self.layout = Layout(order[col], order[row], start, np.full(len(row), 4, np.int32), 12 * len(row))
        self.data = np.zeros(self.layout.size)
        self._y, self._bad = np.zeros(3 * self.plan.positions), np.zeros(1, np.int32)
        self._b = self._y[: 3 * n].reshape(n, 3)
        factor = np.zeros((self.plan.columns, 4))
        with runtime.shared_out(opt_level=1):  # without its own passes, four numbers are stored one by one
            kernel = factorisation(len(self.plan.tasks) == 3)
            arrays = (self.data.reshape(-1, 4), factor, self._y, self._bad)
            self._launch = Launch(kernel, *self.plan.arguments(), *arrays)
            self._launch()  # compiles

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve; by pivoted LU if the matrix is not positive definite."""
        np.take(b, self._order, axis=0, out=self._b, mode="clip")
        self._bad[0] = 0
        self._launch()
        if self._bad[0]:
            return pivoted(self._full()).solve(b.ravel()).reshape(-1, 3)
        return self._b.take(self._place, axis=0)

    def _full(self) -> sp.csc_matrix:
        """The whole matrix, in the order of the vertices."""
        blocks, row, col = self.data.reshape(-1, 3, 4)[:, :, :3], self.layout.row, self.layout.col
        off = row != col
        blocks = np.concatenate([blocks, blocks[off].transpose(0, 2, 1)])
        row, col = np.append(row, col[off]), np.append(col, row[off])
        order = np.lexsort((col, row))
        indptr = pointers(row, len(self._order))
        return sp.bsr_matrix((blocks[order], col[order], indptr)).tocsc()


class _Triangle:
    """The blocks of a symmetric matrix on and below the diagonal, in an order of elimination."""

    def __init__(self, graph: sp.csr_matrix, order: np.ndarray):
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        row = np.repeat(np.arange(len(order)), np.diff(permuted.indptr))
        kept = permuted.indices >= row  # row by row above the diagonal is column by column below it
        inner = Layout.csr(row[kept], permuted.indices[kept], len(order))
        self.order = order
        self.indptr, self.indices = inner.scalar(len(order))
        self.layout = Layout(order[inner.row], order[inner.col], inner.start, inner.stride, inner.size)

    def full(self, data: np.ndarray) -> sp.csc_matrix:
        """The whole matrix, in the order of elimination."""
        k = 3 * len(self.order)
        upper = sp.triu(sp.csr_matrix((data, self.indices, self.indptr), shape=(k, k)))
        return (upper + sp.triu(upper, 1).T).tocsc()


class Cholmod:
    """CHOLMOD's supernodal Cholesky factorisation, analysed once: large cloths in two halves at once.

    Where the library cannot be called directly (see `muslin.solve.cholmod`), cvxopt's wrapper is.
    """

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        n = graph.shape[0]
        everything, nothing = np.arange(n), np.arange(0)
        parts, separator = [everything], nothing
        if n >= HALVES and cholmod.available():
            one, other, between = ordering.cut(graph, points, everything)
            if min(len(one), len(other)) > 2 * len(between) > 0:
                parts, separator = [one, other], between
        triangles = [_best_triangle(graph, points, part, separator) for part in parts]
        if len(parts) == 2 and any((t.order[-len(separator) :] != separator).any() for t in triangles):
            triangles = [_best_triangle(graph, points, everything, nothing)]
        ends = np.cumsum([0, *(triangle.layout.size for triangle in triangles)])
        self.data = np.zeros(ends[-1])
        pieces = [self.data[a:b] for a, b in itertools.pairwise(ends)]
        layouts = [triangle.layout for triangle in triangles]
        start = [layout.start + end for layout, end in zip(layouts, ends[:-1], strict=True)]
        self.layout = Layout(
            np.concatenate([layout.row for layout in layouts]),
            np.concatenate([layout.col for layout in layouts]),
            np.concatenate(start).astype(np.int32),
            np.concatenate([layout.stride for layout in layouts]),
            int(ends[-1]),
        )
        self._triangles, self._pieces = triangles, pieces
        self._solve: Callable[[np.ndarray], np.ndarray]
        if not cholmod.available():
            self._solve = _Wrapped(triangles[0], self.data)
        elif len(triangles) == 1:
            self._solve = _Direct(triangles[0], self.data)
        else:
            self._solve = _InHalves(triangles, pieces, len(separator))

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve; by pivoted LU if the matrix is not positive definite."""
        try:
            return self._solve(b)
        except ArithmeticError:
            pass
        n = len(b)
        full, order = self._triangles[0].full(self._pieces[0]), self._triangles[0].order
        if len(self._triangles) == 2:
            full = self._joined()
            order = np.arange(n)
        y = np.empty_like(b)
        y[order] = pivoted(full).solve(b[order].ravel()).reshape(-1, 3)
        return y

    def _joined(self) -> sp.csc_matrix:
        """The whole matrix of two halves, in the order of the vertices."""
        n = int(self.layout.row.max()) + 1
        sets = []
        for triangle, piece in zip(self._triangles, self._pieces, strict=True):
            matrix = triangle.full(piece).tocoo()
            unknown = (3 * triangle.order[:, None] + np.arange(3)).ravel()
            sets.append((unknown[matrix.row], unknown[matrix.col], matrix.data))
        row, col, data = (np.concatenate(part) for part in zip(*sets, strict=True))
        _, first = np.unique(row * (3 * n) + col, return_index=True)  # the separator's blocks are in both
        return sp.csc_matrix((data[first], (row[first], col[first])), shape=(3 * n, 3 * n))


def _best_triangle(
    graph: sp.csr_matrix, points: np.ndarray, part: np.ndarray, separator: np.ndarray
) -> _Triangle:
    """Some vertices and then a separator, in the better of two orders: minimum degree, nested dissection."""
    if not cholmod.available():
        return _Triangle(graph, part)  # cvxopt's wrapper orders by minimum degree itself
    from cvxopt import amd, spmatrix

    inner = graph[part][:, part].tocoo()
    pattern = spmatrix(1.0, inner.row.astype(int).tolist(), inner.col.astype(int).tolist(), inner.shape)
    degree = np.array(amd.order(pattern)).ravel()
    best, least = part, np.inf
    for order in (part[degree], ordering.nested_dissection(graph, points, part)):
        whole = np.concatenate([order, separator])
        triangle = _Triangle(graph, whole)
        post, flops = cholmod.analysed(triangle.indptr, triangle.indices)
        if flops < least:
            best, least = whole[post[::3] // 3], flops
    return _Triangle(graph, best)


class _Direct:
    """One domain."""

    def __init__(self, triangle: _Triangle, data: np.ndarray):
        self._domain = cholmod.Domain(triangle.indptr, triangle.indices, data)
        self._order, self._place = triangle.order, np.argsort(triangle.order)

    def __call__(self, b: np.ndarray) -> np.ndarray:
        self._domain.factorise()
        y = self._domain.solve(b.take(self._order, axis=0).ravel())
        return y.reshape(-1, 3).take(self._place, axis=0)


class _InHalves:
    """Two domains and the separator that both end with."""

    def __init__(self, triangles: list[_Triangle], pieces: list[np.ndarray], size: int):
        domains = [
            cholmod.Domain(t.indptr, t.indices, piece) for t, piece in zip(triangles, pieces, strict=True)
        ]
        self._orders = [triangle.order[:-size] for triangle in triangles]
        self._separator = triangles[0].order[-size:]
        self._place = np.argsort(np.concatenate([*self._orders, self._separator]))
        first = triangles[0]
        begin = len(first.indptr) - 1 - 3 * size
        at = np.arange(first.indptr[begin], first.indptr[-1])
        row = np.repeat(np.arange(3 * size), np.diff(first.indptr[begin:]))
        corner = at, row, first.indices[at] - begin
        parallel = runtime.threads() > 1
        self._halves = cholmod.Halves(domains, 3 * size, corner, parallel)

    def __call__(self, b: np.ndarray) -> np.ndarray:
        one, other = self._orders
        first, second, between = (b.take(part, axis=0).ravel() for part in (one, other, self._separator))
        y = np.concatenate(self._halves.factorise_and_solve((first, second), between))
        return y.reshape(-1, 3).take(self._place, axis=0)


class _Wrapped:
    """cvxopt's own way to CHOLMOD."""

    def __init__(self, triangle: _Triangle, data: np.ndarray):
        from cvxopt import cholmod as wrapper
        from cvxopt import matrix, spmatrix

        self._cholmod, self._matrix, self._data = wrapper, matrix, data
        k = len(triangle.indptr) - 1
        col = np.repeat(np.arange(k), np.diff(triangle.indptr))
        self._lower = np.flatnonzero(triangle.indices >= col)
        i, j = triangle.indices[self._lower].astype(int), col[self._lower].astype(int)
        self._A = spmatrix(1.0, matrix(i), matrix(j), (k, k))
        wrapper.options["supernodal"] = 2
        self._F = wrapper.symbolic(self._A)
        self._order = triangle.order

    def __call__(self, b: np.ndarray) -> np.ndarray:
        self._A.V = self._matrix(self._data[self._lower])
        self._cholmod.numeric(self._A, self._F)
        x = self._matrix(b[self._order].ravel())
        self._cholmod.solve(self._F, x)
        y = np.empty_like(b)
        y[self._order] = np.array(x).reshape(-1, 3)
        return y


class ConjugateGradients:
    """Conjugate gradients in Taichi, preconditioned by the diagonal blocks, starting from a guess.

    It ends where |b - A y| <= tolerance |b| (in single precision never under `SINGLE`), and needs a positive definite
    matrix. No factors: memory grows like
    the mesh. The number of iterations, some hundreds to thousands on stiff cloth, decides its time.
    """

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        from muslin.base.launch import Launch
        from muslin.solve import conjugate_gradients as cg

        n = graph.shape[0]
        order = ordering.nested_dissection(graph, points, np.arange(n))  # neighbours lie near each other
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        layout = _whole(permuted)
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
                size = np.sqrt(self._sums[1] / max(self._sums[2], 1e-300))
                raise SimulationError(
                    f"Conjugate gradients stopped at a residual of {size:.1e} after {self.iterations} iterations.",
                    "Reduce dt, raise tolerance, or take a direct solver.",
                )
            self._iterate()
            self.iterations += 1
        return self._y[self.place]


SOLVERS: Mapping[str, Callable[[sp.csr_matrix, np.ndarray, bool, float], Solver]] = {
    "cholmod": Cholmod,
    "superlu": SuperLU,
    "multifrontal": Multifrontal,
    "cg": ConjugateGradients,
}


def choose(name: str = "auto", vertices: int = 0) -> str:
    """Name of the solver to use for a number of vertices: for "auto", conjugate gradients from `LARGE` on,
    else the fastest direct solver installed.

    Raises
    ------
    MuslinError
        If the name is unknown or its package is not installed.
    """
    fast = importlib.util.find_spec("cvxopt") is not None
    if name == "auto":
        direct = "cholmod" if fast else "multifrontal" if runtime.plain() else "superlu"
        return "cg" if vertices >= LARGE else direct
    if name not in SOLVERS:
        raise MuslinError(f"There is no solver {name!r}.", f"There is: auto, {', '.join(SOLVERS)}.")
    if name == "cholmod" and not fast:
        raise MuslinError("The solver cholmod needs cvxopt.", 'Install it with: pip install "muslin[fast]"')
    if name == "multifrontal" and not runtime.plain():
        raise MuslinError(
            "The solver multifrontal computes in double precision on the CPU only.",
            "Take superlu or cholmod.",
        )
    return name


class System:
    """Systems in which some vertices are held: pinning by projection.

    With P the projection onto the free unknowns, (P A P^T) (P y) = P (b - A y_held): held rows and columns
    leave the system, and what they are known to do moves to the right-hand side.

    Parameters
    ----------
    row, col : int arrays
        Blocks of the whole symmetric matrix, sorted by row and column, the diagonal included.
    held : (n,) bool array
        Which vertices are held.
    solver : str
        "auto" or a name in `SOLVERS`.
    definite : bool
        Whether the matrices will be positive definite.
    points : (n, 3) array, optional
        Coordinates of the vertices: a sheet is cut along them. Without, along distances in the graph.
    tolerance : float
        Of iterative solvers: |b - A y| <= tolerance |b|.

    Attributes
    ----------
    layout : Layout
        Where the blocks between free vertices go, in `data`.
    coupling : Layout
        Where those between a free and a held vertex go, in an array for `solve`.
    """

    def __init__(
        self,
        row: np.ndarray,
        col: np.ndarray,
        held: np.ndarray,
        solver: str = "auto",
        definite: bool = True,
        points: np.ndarray | None = None,
        tolerance: float = 1e-8,
    ):
        n = len(held)
        self.held, self.free = held, np.flatnonzero(~held)
        self._any_held = len(self.free) < n
        self._unknowns = (3 * self.free[:, None] + np.arange(3)).ravel()
        number = np.cumsum(~held) - 1
        kept = ~held[row] & ~held[col]
        k = len(self.free)
        indptr = pointers(number[row[kept]], k) if k else np.zeros(1, np.int32)
        graph = sp.csr_matrix((np.ones(int(kept.sum()), np.int8), number[col[kept]], indptr), shape=(k, k))
        self.name = choose(solver, k)
        self.solver: Solver | None = None
        self.layout = Layout(row[:0], col[:0], row[:0], row[:0], 0)
        self.data = np.zeros(0)
        if k:
            where = ordering.pseudo_points(graph) if points is None else points[self.free]
            self.solver = SOLVERS[self.name](graph, where, definite, tolerance)
            inner, self.data = self.solver.layout, self.solver.data
            self.layout = Layout(
                self.free[inner.row], self.free[inner.col], inner.start, inner.stride, inner.size
            )
        outside = ~held[row] & held[col]
        self.coupling = Layout.csr(row[outside], col[outside], n)

    def solve(
        self,
        b: np.ndarray,
        known: np.ndarray | None = None,
        coupling: np.ndarray | None = None,
        guess: np.ndarray | None = None,
    ) -> np.ndarray:
        """Solve A y = b for the matrix that is in `data` now.

        Parameters
        ----------
        b : (n, 3) array
            Right-hand side.
        known : (n, 3) array, optional
            Values of the held vertices (others are ignored); default zero.
        coupling : array, optional
            Data of `coupling`, where `known` is not zero.
        guess : (n, 3) array, optional
            Where iterative solvers start.

        Returns
        -------
        (n, 3) array
        """
        y = np.zeros_like(b)
        if known is not None:
            y[self.held] = known[self.held]
        if coupling is not None and self.coupling.size:
            n = len(b)
            indptr, indices = self.coupling.scalar(n)
            outer = sp.csr_matrix((coupling, indices, indptr), shape=(3 * n, 3 * n), copy=False)
            b = b - (outer @ y.ravel()).reshape(-1, 3)
        if self.solver is not None:
            guess = y if guess is None else guess
            if not self._any_held:
                return self.solver.solve(b, guess)
            found = self.solver.solve(b.take(self.free, axis=0), guess.take(self.free, axis=0))
            y.reshape(-1)[self._unknowns] = found.ravel()  # in half the time of y[self.free] = found
        return y
