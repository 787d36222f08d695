"""Sparse symmetric systems: one ordering per pattern, one numeric factorisation per step.

Sparse direct solvers only, since cloth is stiff: CHOLMOD through cvxopt where the `fast` extra is installed (the
package is under the GPL), else SuperLU, which comes with SciPy under a permissive licence.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from muslin.errors import MuslinError, SimulationError


class Factors(Protocol):
    """A factorised matrix."""

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solve A y = b for a vector (k,)."""
        ...


class Solver(Protocol):
    """A solver for all matrices of one symmetric sparsity pattern."""

    def factorise(self, data: np.ndarray) -> Factors:
        """Factorise the matrix with this CSR data array (nnz,)."""
        ...


class SuperLU:
    """SciPy's SuperLU in symmetric mode with a minimum-degree ordering: no extra package.

    A `definite` matrix needs no pivoting, which keeps the ordering's sparsity.
    """

    def __init__(self, indptr: np.ndarray, indices: np.ndarray, definite: bool = True):
        self.indptr, self.indices, self.definite = indptr, indices, definite

    def factorise(self, data: np.ndarray) -> Factors:
        """Factorise, with pivoting where the matrix is not known to be definite."""
        k = len(self.indptr) - 1
        matrix = sp.csc_matrix((data, self.indices, self.indptr), shape=(k, k), copy=False)
        if not self.definite:
            return pivoted(matrix)
        try:
            return splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError:
            return pivoted(matrix)


def pivoted(matrix: sp.csc_matrix) -> Factors:
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


class Cholmod:
    """CHOLMOD's supernodal Cholesky factorisation, analysed once (cvxopt)."""

    def __init__(self, indptr: np.ndarray, indices: np.ndarray, definite: bool = True):
        from cvxopt import cholmod, matrix, spmatrix

        self.indptr, self.indices = indptr, indices
        self._cholmod, self._matrix = cholmod, matrix
        k = len(indptr) - 1
        rows = np.repeat(np.arange(k), np.diff(indptr))
        # the upper triangle row by row is, by symmetry, the lower triangle column by column
        self._upper = np.flatnonzero(indices >= rows)
        i, j = indices[self._upper].astype(int), rows[self._upper].astype(int)
        self._A = spmatrix(1.0, matrix(i), matrix(j), (k, k))
        cholmod.options["supernodal"] = 2
        self._F = cholmod.symbolic(self._A)

    def factorise(self, data: np.ndarray) -> Factors:
        """Factorise; falls back to pivoted LU if the matrix is not positive definite."""
        self._A.V = self._matrix(data[self._upper])
        try:
            self._cholmod.numeric(self._A, self._F)
        except ArithmeticError:
            k = len(self.indptr) - 1
            return pivoted(sp.csc_matrix((data, self.indices, self.indptr), shape=(k, k)))
        return self

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solve A y = b with the last factorisation."""
        y = self._matrix(b)
        self._cholmod.solve(self._F, y)
        return np.array(y).ravel()


SOLVERS: Mapping[str, Callable[[np.ndarray, np.ndarray, bool], Solver]] = {
    "cholmod": Cholmod,
    "superlu": SuperLU,
}


def choose(name: str = "auto") -> str:
    """Name of the solver to use: the fastest installed for "auto".

    Raises
    ------
    MuslinError
        If the name is unknown or its package is not installed.
    """
    fast = importlib.util.find_spec("cvxopt") is not None
    if name == "auto":
        return "cholmod" if fast else "superlu"
    if name not in SOLVERS:
        raise MuslinError(f"There is no solver {name!r}.", f"There is: auto, {', '.join(SOLVERS)}.")
    if name == "cholmod" and not fast:
        raise MuslinError("The solver cholmod needs cvxopt.", 'Install it with: pip install "muslin[fast]"')
    return name


class FreeSystem:
    """Systems in which some vertices are held: pinning by projection.

    With P the projection onto the free unknowns, (P A P^T) (P y) = P (b - A y_held): held rows and columns
    leave the system, and what they are known to do moves to the right-hand side.

    Parameters
    ----------
    indptr, indices : int32 arrays
        CSR pattern of the whole symmetric matrix.
    held : (k,) bool array
        Which unknowns are held.
    solver : str
        "auto", "cholmod" or "superlu".
    definite : bool
        Whether the matrices will be positive definite.
    """

    def __init__(
        self,
        indptr: np.ndarray,
        indices: np.ndarray,
        held: np.ndarray,
        solver: str = "auto",
        definite: bool = True,
    ):
        self.indptr, self.indices, self.held = indptr, indices, held
        self.free = np.flatnonzero(~held)
        k = len(held)
        number = np.cumsum(~held) - 1
        rows = np.repeat(np.arange(k), np.diff(indptr))
        self._kept = np.flatnonzero(~held[rows] & ~held[indices])
        free_indices = number[indices[self._kept]].astype(np.int32)
        counts = np.bincount(number[rows[self._kept]], minlength=len(self.free))
        free_indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        self.solver = SOLVERS[choose(solver)](free_indptr, free_indices, definite) if len(self.free) else None

    def solve(self, data: np.ndarray, b: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Solve A y = b for the free unknowns, the held ones being `known`.

        Parameters
        ----------
        data : (nnz,) array
            CSR data of A.
        b, known : (k,) arrays
            Right-hand side; values of the held unknowns (others are ignored).

        Returns
        -------
        (k,) array
        """
        y = np.where(self.held, known, 0.0)
        if self.solver is None:
            return y
        if y.any():
            k = len(self.held)
            b = b - sp.csr_matrix((data, self.indices, self.indptr), shape=(k, k), copy=False) @ y
        if len(self._kept) != len(data):
            data = data[self._kept]
        y[self.free] = self.solver.factorise(data).solve(b[self.free])
        return y
