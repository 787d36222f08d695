"""A matrix factorised in two halves at once, and the separator between them; see `cholmod`."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.solve import beside, cholmod


class Halves:
    """A matrix factorised in two halves at once, and the separator between them.

    Parameters
    ----------
    domains : pair of Domain
        Each half with the separator last, in the same order in both.
    size : int
        Unknowns of the separator.
    corner : (3, ...) arrays: positions in the first domain's `data` of C, rows, columns
    parallel : bool
        Use two threads. The result is the same.
    """

    def __init__(
        self, domains: list[cholmod.Domain], size: int, corner: tuple[np.ndarray, ...], parallel: bool
    ):
        self.domains, self.size = domains, size
        self._at, self._row, self._col = corner
        self._corners = [domain.corner(size) for domain in domains]
        self._dense = [np.zeros((size, size)) for _ in domains]
        self._factors: tuple[list[Any], np.ndarray] = ([], np.zeros(0))
        self.parallel = parallel

    def factorise_and_solve(self, b: tuple[np.ndarray, np.ndarray], s: np.ndarray) -> list[np.ndarray]:
        """Factorise, and `solve`."""
        k = self.size
        parts: list[list[Any]] = [[None, None] for _ in range(3)]
        U, complement, y = parts

        def down(i: int) -> None:
            domain = self.domains[i]
            domain.factorise()
            y[i] = domain.solve(np.concatenate([b[i], np.zeros(k)]), cholmod.SYSTEM_L)
            numbers = domain.numbers
            for panel in self._corners[i]:
                panel.copy(numbers, self._dense[i])
            U[i] = self._dense[i].T
            complement[i] = U[i].copy(order="F")
            _blas("dlauum", b"U", k, complement[i], k, ctypes.c_int(0))

        self._both(down)
        # mirrored: unknown j of the separator is k - 1 - j
        S = complement[0]
        S += complement[1]
        data = self.domains[0]._kept[2]
        S[k - 1 - self._col, k - 1 - self._row] -= data[self._at]
        info = ctypes.c_int(0)
        _blas("dpotrf", b"U", k, S, k, info)
        if info.value:
            raise cholmod.NotDefinite("not positive definite")
        self._factors = U, S
        return self._up(y, s)

    def solve(self, b: tuple[np.ndarray, np.ndarray], s: np.ndarray) -> list[np.ndarray]:
        """Solve for [one half, other half, separator] with the factors that there are.

        b, s: the right-hand sides of the halves' own unknowns, and of the separator.
        """
        y: list[Any] = [None, None]

        def down(i: int) -> None:
            y[i] = self.domains[i].solve(np.concatenate([b[i], np.zeros(self.size)]), cholmod.SYSTEM_L)

        self._both(down)
        return self._up(y, s)

    def _up(self, y: list[Any], s: np.ndarray) -> list[np.ndarray]:
        k, (U, S), info = self.size, self._factors, ctypes.c_int(0)
        middle = s[::-1].copy()
        for i in (0, 1):
            middle += _times(U[i], y[i][: -k - 1 : -1], b"N")
        _blas("dpotrs", b"U", k, 1, S, k, middle, k, info)

        def up(i: int) -> None:
            right = y[i].copy()
            right[-k:] = _times(U[i], middle, b"T")[::-1]
            y[i] = self.domains[i].solve(right, cholmod.SYSTEM_LT)

        self._both(up)
        return [y[0][:-k], y[1][:-k], middle[::-1]]

    def _both(self, task: Callable[[int], None]) -> None:
        helper = beside.helper(os.getpid()) if self.parallel else None
        if helper is None or not helper.free.acquire(blocking=False):
            task(0)
            task(1)
            return
        try:
            helper.start(lambda: task(1))
            try:
                task(0)
            finally:
                helper.wait()
        finally:
            helper.free.release()


def _blas(name: str, *arguments: Any) -> None:
    """Call a Fortran routine: texts, whole numbers, arrays and results by reference."""
    passed: list[Any] = []
    for argument in arguments:
        if isinstance(argument, np.ndarray):
            passed.append(ctypes.c_void_p(argument.ctypes.data))
        elif isinstance(argument, int):
            passed.append(ctypes.byref(ctypes.c_int(argument)))
        else:
            passed.append(argument if isinstance(argument, bytes) else ctypes.byref(argument))
    cholmod.blas()[name](*passed)


def _times(U: np.ndarray, vector: np.ndarray, transposed: bytes) -> np.ndarray:
    """U or U^T times a vector, U upper triangular."""
    out = vector.copy()
    _blas("dtrmv", b"U", transposed, b"N", len(out), U, len(out), out, 1)
    return out
