"""A cloth's matrix as one or two domains, each ordered for elimination, and factorised by CHOLMOD.

Two domains are the halves of a cloth; both end with the separator between them (see `cholmod`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.physics.elements.layout import Layout, inverse, ordered, permuted
from muslin.solve import cholmod, halves, ordering
from muslin.solve.superlu import Indefinite, pivoted


class _Triangle:
    """The blocks of a symmetric matrix on and below the diagonal, in an order of elimination.

    `by_blocks`: whether to analyse them instead of their entries (see `cholmod.Domain`).
    """

    def __init__(self, graph: sp.csr_matrix, order: np.ndarray, by_blocks: bool = False):
        self.order = order  # row by row above the diagonal is column by column below it
        self.layout, blocks, (self.indptr, self.indices) = ordered(graph, order)
        self.blocks = blocks if by_blocks else None

    def domain(self, data: np.ndarray) -> cholmod.Domain:
        """What factorises it."""
        return cholmod.Domain(self.indptr, self.indices, data, blocks=self.blocks)

    def full(self, data: np.ndarray) -> sp.csc_matrix:
        """The whole matrix, in the order of elimination."""
        k = 3 * len(self.order)
        upper = sp.triu(sp.csr_matrix((data, self.indices, self.indptr), shape=(k, k)))
        return (upper + sp.triu(upper, 1).T).tocsc()


class Cholmod:
    """CHOLMOD's supernodal Cholesky factorisation, analysed once: large cloths in two halves at once.

    Where the library cannot be called directly (see `muslin.solve.cholmod`), cvxopt's wrapper is.
    """

    only_definite = False

    def __init__(
        self,
        graph: sp.csr_matrix,
        points: np.ndarray,
        definite: bool,
        tolerance: float,
        triangle: Callable[..., _Triangle] | None = None,
    ):
        triangle = triangle or _best_triangle
        n = graph.shape[0]
        everything, nothing = np.arange(n), np.arange(0)
        parts, separator = [everything], nothing
        if n >= ordering.HALVES and cholmod.available():
            one, other, between = ordering.cut(graph, points, everything)
            if min(len(one), len(other)) > 2 * len(between) > 0:
                parts, separator = [one, other], between
        triangles = [triangle(graph, points, part, separator) for part in parts]
        if len(parts) == 2 and any((t.order[-len(separator) :] != separator).any() for t in triangles):
            triangles = [triangle(graph, points, everything, nothing)]
        ends = np.cumsum([0, *(each.layout.size for each in triangles)])
        self.data = np.zeros(ends[-1])
        pieces = [self.data[a:b] for a, b in itertools.pairwise(ends)]
        layouts = [each.layout for each in triangles]
        start = [layout.start + end for layout, end in zip(layouts, ends[:-1], strict=True)]
        self.layout = Layout(
            np.concatenate([layout.row for layout in layouts]),
            np.concatenate([layout.col for layout in layouts]),
            np.concatenate(start).astype(np.int32),
            np.concatenate([layout.stride for layout in layouts]),
            int(ends[-1]),
            np.concatenate([layout.number for layout in layouts]),
        )
        self._triangles, self._pieces = triangles, pieces
        self._solve: Callable[[np.ndarray], np.ndarray]
        if not cholmod.available():
            self._solve = _Wrapped(triangles[0], self.data)
        elif len(triangles) == 1:
            self._solve = _Direct(triangles[0], self.data)
        else:
            self._solve = _InHalves(triangles, pieces, len(separator))

    @classmethod
    def passing(cls, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float) -> Cholmod:
        """Solver for a pattern that will soon be another: ordered once, by minimum degree.

        On meshes that are finer here and there this is the better order of the two as often as not.
        """
        return cls(graph, points, definite, tolerance, _triangle)

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve; by pivoted LU if the matrix is not positive definite."""
        try:
            self._indefinite = False
            return self._solve(b)
        except ArithmeticError:
            self._indefinite = True
            if self.only_definite:
                raise Indefinite from None
        n = len(b)
        full, order = self._triangles[0].full(self._pieces[0]), self._triangles[0].order
        if len(self._triangles) == 2:
            full = self._joined()
            order = np.arange(n)
        y = np.empty_like(b)
        y[order] = pivoted(full).solve(b[order].ravel()).reshape(-1, 3)
        return y

    def again(self, b: np.ndarray) -> np.ndarray:
        """Solve with the factors that there are."""
        again = getattr(self._solve, "again", None)
        return self.solve(b, b) if again is None or self._indefinite else again(b)

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
    best, least = part, np.inf
    for order in (_minimum_degree(graph, part), ordering.nested_dissection(graph, points, part)):
        whole = np.concatenate([order, separator])
        triangle = _Triangle(graph, whole)
        post, flops = cholmod.analysed(triangle.indptr, triangle.indices)
        if flops < least:
            best, least = whole[post[::3] // 3], flops
    return _Triangle(graph, best)


def _triangle(graph: sp.csr_matrix, points: np.ndarray, part: np.ndarray, separator: np.ndarray) -> _Triangle:
    """Some vertices in an order of minimum degree, and then a separator."""
    if not cholmod.available():
        return _Triangle(graph, part)
    return _Triangle(graph, np.concatenate([_minimum_degree(graph, part), separator]), by_blocks=True)


def _minimum_degree(graph: sp.csr_matrix, part: np.ndarray) -> np.ndarray:
    """Some vertices in an order of minimum degree."""
    ptr, col = permuted(graph, part)
    return np.asarray(part[cholmod.minimum_degree(ptr, col)])


class _Direct:
    """One domain."""

    def __init__(self, triangle: _Triangle, data: np.ndarray):
        self._domain = triangle.domain(data)
        self._order, self._place = triangle.order, inverse(triangle.order)

    def __call__(self, b: np.ndarray) -> np.ndarray:
        self._domain.factorise()
        return self.again(b)

    def again(self, b: np.ndarray) -> np.ndarray:
        y = self._domain.solve(b.take(self._order, axis=0).ravel())
        return y.reshape(-1, 3).take(self._place, axis=0)


class _InHalves:
    """Two domains and the separator that both end with."""

    def __init__(self, triangles: list[_Triangle], pieces: list[np.ndarray], size: int):
        domains = [triangle.domain(piece) for triangle, piece in zip(triangles, pieces, strict=True)]
        self._orders = [triangle.order[:-size] for triangle in triangles]
        self._separator = triangles[0].order[-size:]
        self._place = inverse(np.concatenate([*self._orders, self._separator]))
        first = triangles[0]
        begin = len(first.indptr) - 1 - 3 * size
        at = np.arange(first.indptr[begin], first.indptr[-1])
        row = np.repeat(np.arange(3 * size), np.diff(first.indptr[begin:]))
        corner = at, row, first.indices[at] - begin
        parallel = runtime.threads() > 1
        self._halves = halves.Halves(domains, 3 * size, corner, parallel)

    def __call__(self, b: np.ndarray) -> np.ndarray:
        return self._solved(b, self._halves.factorise_and_solve)

    def again(self, b: np.ndarray) -> np.ndarray:
        return self._solved(b, self._halves.solve)

    def _solved(self, b: np.ndarray, solve: Callable[..., list[np.ndarray]]) -> np.ndarray:
        one, other = self._orders
        first, second, between = (b.take(part, axis=0).ravel() for part in (one, other, self._separator))
        y = np.concatenate(solve((first, second), between))
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
