"""Sparse symmetric systems of a cloth: one order per pattern, one numeric factorisation per step.

A solver says where it wants every 3x3 block (`layout`), the cloth is assembled straight into its `data`, and
`solve` does the rest: no copy, no permutation. Direct solvers, since cloth is stiff: CHOLMOD through cvxopt where
the `fast` extra is installed (under the GPL), else a Cholesky factorisation of our own (`multifrontal`), or, where
kernels do not compute in double precision on the CPU, SciPy's SuperLU.
Conjugate gradients, in Taichi, need no more memory than the matrix itself: "auto" takes them from `LARGE`
vertices on, where factors of a sheet no longer fit into a few gigabytes.
"""

from __future__ import annotations

import contextlib
import functools
import importlib.util
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.base.errors import MuslinError
from muslin.physics.elements.layout import Layout, pointers
from muslin.solve import cholmod, ordering
from muslin.solve.conjugate_gradients import ConjugateGradients
from muslin.solve.domains import Cholmod
from muslin.solve.multifrontal import Multifrontal
from muslin.solve.superlu import SuperLU
from muslin.solve.varying import Varying

#: Vertices from which on "auto" iterates instead of factorising.
LARGE = 300_000


class Solver(Protocol):
    """A solver for all matrices of one symmetric pattern of blocks.

    Constructed from the graph of the free vertices (CSR, diagonal included), their coordinates (n, 3), whether
    the matrices will be positive definite, and a tolerance that only iterative solvers use.
    """

    layout: Layout
    data: np.ndarray
    #: Whether a matrix that is not positive definite is refused (`Indefinite`), by those that notice, and not solved
    only_definite: bool

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Solve A y = b, both (n, 3), for the matrix that is in `data` now."""
        ...


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
    """Systems in which some vertices are pinned: pinning by projection.

    With P the projection onto the free unknowns, (P A P^T) (P y) = P (b - A y_pinned): pinned rows and columns
    leave the system, and what they are known to do moves to the right-hand side.

    Parameters
    ----------
    row, col : int arrays
        Blocks of the whole symmetric matrix, sorted by row and column, the diagonal included.
    pinned : (n,) bool array
        Which vertices are pinned.
    solver : str
        "auto" or a name in `SOLVERS`.
    definite : bool
        Whether the matrices will be positive definite.
    points : (n, 3) array, optional
        Coordinates of the vertices: a sheet is cut along them. Without, along distances in the graph.
    tolerance : float
        Of iterative solvers: |b - A y| <= tolerance |b|.
    solid : bool
        Whether it is a solid's: its fronts are large, and CHOLMOD is to take the kernels that suit the processor. A
        sheet is solved by those that OpenBLAS chooses, and ends at the same bits as ever.
    varying : bool
        Whether `more` is used, with a solver of its own.
    lasting : bool
        Whether many systems of this pattern will be solved. If not, a solver is made by its `passing`, if it has
        that: with less care for the order of elimination.
    ptr : (n + 1,) int32 array, optional
        Where each row begins, if that is known.

    Attributes
    ----------
    more : (3n, 3n) sparse matrix
        What is added to the blocks that are always there.
    layout : Layout
        Where the blocks between free vertices go, in `data`.
    coupling : Layout
        Where those between a free and a pinned vertex go, in an array for `solve`.
    """

    def __init__(
        self,
        row: np.ndarray,
        col: np.ndarray,
        pinned: np.ndarray,
        solver: str = "auto",
        definite: bool = True,
        points: np.ndarray | None = None,
        tolerance: float = 1e-8,
        solid: bool = False,
        varying: bool = False,
        lasting: bool = True,
        ptr: np.ndarray | None = None,
    ):
        n = len(pinned)
        self._kernels = cholmod.fast if solid else contextlib.nullcontext
        self.pinned, self.free = pinned, np.flatnonzero(~pinned)
        self._any_pinned = len(self.free) < n
        k = len(self.free)
        inner, outer = (row, col), (row[:0], col[:0])  # between free vertices; of a free one and a pinned one
        if self._any_pinned:
            number = np.cumsum(~pinned) - 1
            kept, outside = ~pinned[row] & ~pinned[col], ~pinned[row] & pinned[col]
            inner, outer = (number[row[kept]], number[col[kept]]), (row[outside], col[outside])
        if ptr is None or self._any_pinned:
            ptr = pointers(inner[0], k)
        graph = sp.csr_matrix((np.ones(len(inner[1]), np.int8), inner[1], ptr), shape=(k, k))
        self.name = choose(solver, k)
        self.solver: Solver | None = None
        self._varying: Varying | None = None
        self.layout = Layout(row[:0], col[:0], row[:0], row[:0], 0)
        self.data = np.zeros(0)
        if k:
            where = ordering.pseudo_points(graph) if points is None else points[self.free]
            if varying:
                self.solver = self._varying = Varying(graph, where, definite, tolerance)
            else:
                kind = SOLVERS[self.name]
                kind = kind if lasting else getattr(kind, "passing", kind)
                self.solver = kind(graph, where, definite, tolerance)
            self.layout, self.data = self.solver.layout, self.solver.data
            if self._any_pinned:
                there = self.layout
                ends = self.free[there.row], self.free[there.col]
                which = None if there.number is None else np.flatnonzero(kept).take(there.number)
                self.layout = Layout(*ends, there.start, there.stride, there.size, which)
        self._outer = outer

    @functools.cached_property
    def coupling(self) -> Layout:
        """Of blocks between a free and a pinned vertex."""
        return Layout.csr(*self._outer, len(self.pinned))

    @functools.cached_property
    def more(self) -> sp.spmatrix:
        """Nothing, until something is set."""
        n = len(self.pinned)
        return sp.csc_matrix((3 * n, 3 * n))

    @functools.cached_property
    def _unknowns(self) -> np.ndarray:
        """Numbers of the free vertices' coordinates."""
        return (3 * self.free[:, None] + np.arange(3)).ravel()

    def require_definite(self, required: bool) -> None:
        """From now on raise `Indefinite` for matrices that are not positive definite, where that is noticed, or not."""
        if self.solver is not None:
            self.solver.only_definite = required

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
            Values of the pinned vertices (others are ignored); default zero.
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
            y[self.pinned] = known[self.pinned]
        if coupling is not None and self.coupling.size:
            n = len(b)
            indptr, indices = self.coupling.scalar(n)
            outer = sp.csr_matrix((coupling, indices, indptr), shape=(3 * n, 3 * n), copy=False)
            b = b - (outer @ y.ravel()).reshape(-1, 3)
        if self.solver is not None:
            guess = y if guess is None else guess
            if self._varying is not None:
                more = self.more[self._unknowns][:, self._unknowns] if self._any_pinned else self.more
                self._varying.more = more
            with self._kernels():
                if not self._any_pinned:
                    return self.solver.solve(b, guess)
                found = self.solver.solve(b.take(self.free, axis=0), guess.take(self.free, axis=0))
            y.reshape(-1)[self._unknowns] = found.ravel()  # in half the time of y[self.free] = found
        return y

    def again(self, b: np.ndarray) -> np.ndarray:
        """Solve A y = b for the matrix that was solved with last, pinned vertices at rest: for its factors' sake."""
        again = getattr(self.solver, "again", None)
        if again is None:
            return self.solve(b)
        y = np.zeros_like(b)
        with self._kernels():
            y[self.free] = again(b[self.free])
        return y
