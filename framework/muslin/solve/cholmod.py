"""CHOLMOD, as the `cvxopt` wheel brings it along, called without its Python wrapper.

The wrapper copies and permutes the matrix in every factorisation and holds Python's lock. Called directly, on a
matrix that is assembled in the order of elimination, nothing is copied, and the two halves of a cloth are
factorised at the same time:

    the matrix of one half and of the separator, S last, [A_i B_i; B_i^T C] = L_i L_i^T, so L_i ends in a block
    with L_SS L_SS^T = C - B_i^T A_i^-1 B_i, and the separator's Schur complement is the sum of both minus C.

Both matrices are principal parts of the whole one, so they are positive definite if it is. CHOLMOD and cvxopt
are under the GPL (the `fast` extra). `available` says whether this very build of the library is there.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import glob
import importlib.util
import os
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin.solve import beside, kernels

#: Where CHOLMOD 3.0 keeps its settings in `cholmod_common`, and what they are to begin with: 4-byte words.
_DEFAULTS = {2: 858993459, 6: 5, 8: 8, 12: 1, 13: 1, 14: 1, 16: 1, 17: 1, 26: 4, 28: 16, 30: 48, 36: 3, 42: 0}
_SUPERNODAL, _QUICK_RETURN, _PRINT, _NMETHODS, _ORDERING, _POSTORDER = 12, 34, 36, 42, 79, 466
_METHOD_DEFAULTS = {64: 200, 74: 1, 76: 1, 77: 1, _ORDERING: 1, _POSTORDER: 1}

#: Columns up to which neighbouring supernodes are merged whatever it costs: twice CHOLMOD's own, for factors as
#: small as a cloth's (a tenth faster at 1,000 unknowns, a twentieth at 30,000).
_MERGED = {26: 8, 28: 32, 30: 96}


class _Sparse(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_size_t) for name in ("nrow", "ncol", "nzmax")),
        *((name, ctypes.c_void_p) for name in ("p", "i", "nz", "x", "z")),
        *((name, ctypes.c_int) for name in ("stype", "itype", "xtype", "dtype", "sorted", "packed")),
    ]


class _Dense(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_size_t) for name in ("nrow", "ncol", "nzmax", "d")),
        *((name, ctypes.c_void_p) for name in ("x", "z")),
        *((name, ctypes.c_int) for name in ("xtype", "dtype")),
    ]


class _Factor(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_size_t) for name in ("n", "minor")),
        *((name, ctypes.c_void_p) for name in ("Perm", "ColCount", "IPerm")),
        ("nzmax", ctypes.c_size_t),
        *((name, ctypes.c_void_p) for name in ("p", "i", "x", "z", "nz", "next", "prev")),
        *((name, ctypes.c_size_t) for name in ("nsuper", "ssize", "xsize", "maxcsize", "maxesize")),
        *((name, ctypes.c_void_p) for name in ("super", "pi", "px", "s")),
        *((name, ctypes.c_int) for name in ("ordering", "is_ll", "is_super", "is_monotonic")),
        *((name, ctypes.c_int) for name in ("itype", "xtype", "dtype")),
    ]


_SYSTEM_A, _SYSTEM_L, _SYSTEM_LT = 0, 4, 5


@functools.cache
def _library() -> Any:
    """The library, if it is the build this module was written for; None otherwise."""
    spec = importlib.util.find_spec("cvxopt")
    if spec is None or spec.origin is None or ctypes.sizeof(ctypes.c_void_p) != 8:
        return None
    libraries = Path(spec.origin).parent.parent / "cvxopt.libs"
    names = ("libcholmod-*.so.3.*", "libopenblas-*.so", "libamd-*.so.2.*")
    found = [glob.glob(str(libraries / name)) for name in names]
    if any(len(paths) != 1 for paths in found):
        return None
    try:
        import cvxopt.cholmod  # noqa: F401  (loads what the library needs)

        library, blas, amd = (ctypes.CDLL(paths[0]) for paths in found)
        library.kernels = blas  # type: ignore[attr-defined]
        library.minimum_degree = amd.amd_order  # type: ignore[attr-defined]
        # One thread's BLAS: NumPy's and SciPy's own spin while they wait for their threads.
        library.blas = {  # type: ignore[attr-defined]
            name: getattr(blas, name + "_") for name in ("dlauum", "dpotrf", "dpotrs", "dtrmv")
        }
        version = (ctypes.c_int * 3)()
        library.cholmod_version(version)
        words = np.frombuffer(_common(library), dtype=np.int32)
    except (ImportError, OSError, AttributeError):
        return None
    known = all(words[k] == value for k, value in (_DEFAULTS | _METHOD_DEFAULTS).items())
    if list(version)[:2] != [3, 0] or not known:
        return None
    library.cholmod_analyze_p.restype = ctypes.POINTER(_Factor)
    library.cholmod_malloc.restype = ctypes.c_void_p
    library.cholmod_malloc.argtypes = ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p
    library.cholmod_free.argtypes = ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p
    return library


def _common(library: Any) -> Any:
    common = ctypes.create_string_buffer(8192)
    library.cholmod_start(common)
    return common


def available() -> bool:
    """Whether `Domain` can be used: Linux, with the CHOLMOD that cvxopt's wheels carry."""
    return _library() is not None


def fast() -> contextlib.AbstractContextManager[None]:
    """While it lasts, factorise with the kernels that suit the processor (see `muslin.solve.kernels`)."""
    library = _library()
    return kernels.fast(None if library is None else library.kernels)


def analysed(indptr: np.ndarray, indices: np.ndarray) -> tuple[np.ndarray, float]:
    """Postorder of the elimination tree of a pattern, and the flops of its factorisation.

    Parameters
    ----------
    indptr, indices : int32 arrays
        As for `Domain`.
    """
    domain = Domain(indptr, indices, np.zeros(1), postorder=True)
    return domain.order, domain.flops


def minimum_degree(indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Order of elimination by (approximate) minimum degree of a symmetric pattern: CSR, int32."""
    order = np.empty(len(indptr) - 1, dtype=np.int32)
    address = [ctypes.c_void_p(array.ctypes.data) for array in (indptr, indices, order)]
    if _library().minimum_degree(len(order), *address, None, None) < 0:
        raise MemoryError("AMD cannot order the matrix")
    return order


class NotDefinite(ArithmeticError):
    """The matrix is not positive definite."""


class Domain:
    """Cholesky factorisation of matrices of one pattern, in a given order.

    Parameters
    ----------
    indptr, indices : int32 arrays
        Lower triangle by columns (more above the diagonal is ignored), already in the order of elimination.
    data : float64 array
        Its numbers, read again in every factorisation.
    postorder : bool
        Whether to look for a postorder.
    blocks : (indptr, indices), optional
        The same, of 3x3 blocks. With it they are analysed, and what is found is written out for their entries, in a
        third of the time. Supernodes may be others, and so the last bits.
    """

    def __init__(
        self,
        indptr: np.ndarray,
        indices: np.ndarray,
        data: np.ndarray,
        postorder: bool = False,
        blocks: tuple[np.ndarray, np.ndarray] | None = None,
    ):
        self._library, self.n = _library(), len(indptr) - 1
        self._common = _common(self._library)
        self._kept = indptr, indices, data
        words = np.frombuffer(self._common, dtype=np.int32)
        words[_SUPERNODAL], words[_NMETHODS], words[_PRINT], words[_QUICK_RETURN] = 2, 1, 0, 1
        words[_ORDERING], words[_POSTORDER] = 0, int(postorder)  # natural
        for place, columns in _MERGED.items():
            words[place] = columns if blocks is None else columns // 3
        n, nnz = self.n, len(indices)
        address = [array.ctypes.data for array in (indptr, indices)]
        self._A = _Sparse(n, n, nnz, *address, None, data.ctypes.data, None, -1, 0, 1, 0, 1, 1)
        analysed = self._A
        if blocks is not None:
            address = [array.ctypes.data for array in blocks]
            analysed = _Sparse(n // 3, n // 3, len(blocks[1]), *address, None, None, None, -1, 0, 0, 0, 1, 1)
        self._L = self._library.cholmod_analyze_p(ctypes.byref(analysed), None, None, 0, self._common)
        if not self._L:
            raise MemoryError("CHOLMOD cannot analyse the matrix")
        if blocks is not None:
            _write_out(self._library, self._common, self._L.contents)
        L = self._L.contents
        self.order = np.ctypeslib.as_array((ctypes.c_int32 * n).from_address(L.Perm)).copy()
        self.flops = float(np.frombuffer(self._common, dtype=np.float64)[_METHOD_FLOPS])
        self._b = np.zeros(n)
        self._B = _Dense(n, 1, n, n, self._b.ctypes.data, None, 1, 0)
        self._dense = tuple(ctypes.c_void_p() for _ in range(3))  # X, Y and E of cholmod_solve2
        self._x: np.ndarray | None = None
        weakref.finalize(self, _free, self._library, self._common, self._L, self._dense)

    def factorise(self) -> None:
        """Factorise the matrix with the numbers that are in `data` now.

        Raises
        ------
        NotDefinite
            If it is not positive definite.
        """
        done = self._library.cholmod_factorize(ctypes.byref(self._A), self._L, self._common)
        if not done or self._L.contents.minor < self.n:
            raise NotDefinite("not positive definite")

    def solve(self, b: np.ndarray, system: int = _SYSTEM_A) -> np.ndarray:
        """Solve A y = b, L y = b or L^T y = b; what is returned is written over by the next call."""
        self._b[:] = b
        X, Y, E = (ctypes.byref(dense) for dense in self._dense)
        self._library.cholmod_solve2(
            system, self._L, ctypes.byref(self._B), None, X, None, Y, E, self._common
        )
        x = ctypes.cast(self._dense[0], ctypes.POINTER(_Dense)).contents.x
        if self._x is None or self._x.ctypes.data != x:  # it keeps what it allocated in the first call
            self._x = np.ctypeslib.as_array((ctypes.c_double * self.n).from_address(x))
        return self._x

    def corner(self, size: int) -> list[_Panel]:
        """Where the last `size` columns of L are, supernode by supernode."""
        L = self._L.contents

        def read(address: int, count: int) -> np.ndarray:
            return np.ctypeslib.as_array((ctypes.c_int32 * count).from_address(address))

        first, rows_at, x_at = (read(getattr(L, name), L.nsuper + 1) for name in ("super", "pi", "px"))
        rows = read(L.s, L.ssize)
        begin, found = self.n - size, []
        for k in range(int(np.searchsorted(first, begin, side="right")) - 1, L.nsuper):
            here = rows[rows_at[k] : rows_at[k + 1]]
            column, at = max(int(first[k]), begin), int(x_at[k])
            source = slice(
                at + (column - int(first[k])) * len(here), at + int(first[k + 1] - first[k]) * len(here)
            )
            below = int(np.searchsorted(here, begin))
            to = slice(self.n - int(first[k + 1]), self.n - column)
            found.append(_Panel(source, len(here), below, to, self.n - 1 - here[below:]))
        return found

    @property
    def numbers(self) -> np.ndarray:
        """The numbers of L, as they lie in memory."""
        L = self._L.contents
        return np.ctypeslib.as_array((ctypes.c_double * L.xsize).from_address(L.x))


@dataclass
class _Panel:
    """Columns of one supernode: numbers of L, `height` of them each; from `below` on they are in the corner.

    In a dense U, Fortran order, the mirror image of the corner in both directions, they are in `columns`, and `rows`.
    What is below U's diagonal means nothing.
    """

    source: slice
    height: int
    below: int
    columns: slice
    rows: np.ndarray

    def copy(self, numbers: np.ndarray, dense: np.ndarray) -> None:
        """From the numbers of L into U^T (C order)."""
        panel = numbers[self.source].reshape(-1, self.height)[::-1, self.below :]
        dense[self.columns, self.rows] = panel


#: `cholmod_common` counts the flops of the chosen order in its first method.
_METHOD_FLOPS = 24


def _write_out(library: Any, common: Any, L: _Factor) -> None:
    """Make of what was found of a matrix of 3x3 blocks what would be found of its entries."""

    def exchange(name: str, count: int, change: Callable[[np.ndarray], np.ndarray]) -> None:
        before = getattr(L, name)
        after = change(np.ctypeslib.as_array((ctypes.c_int32 * count).from_address(before)))
        address = library.cholmod_malloc(len(after), 4, common)
        if not address:
            raise MemoryError("CHOLMOD cannot analyse the matrix")
        ctypes.memmove(address, np.ascontiguousarray(after, dtype=np.int32).ctypes.data, 4 * len(after))
        library.cholmod_free(count, 4, before, common)
        setattr(L, name, address)

    def threefold(numbers: np.ndarray) -> np.ndarray:
        return (3 * numbers[:, None] + np.arange(3, dtype=np.int32)).ravel()

    exchange("Perm", L.n, threefold)
    exchange("ColCount", L.n, lambda counts: (3 * counts[:, None] - np.arange(3, dtype=np.int32)).ravel())
    exchange("s", L.ssize, threefold)
    exchange("super", L.nsuper + 1, lambda first: 3 * first)
    exchange("pi", L.nsuper + 1, lambda first: 3 * first)
    exchange("px", L.nsuper + 1, lambda first: 9 * first)
    L.n, L.minor, L.ssize, L.maxesize = 3 * L.n, 3 * L.minor, 3 * L.ssize, 3 * L.maxesize
    L.xsize, L.maxcsize = 9 * L.xsize, 9 * L.maxcsize


def _free(library: Any, common: Any, factor: Any, dense: tuple[ctypes.c_void_p, ...]) -> None:
    for pointer in dense:
        library.cholmod_free_dense(ctypes.byref(pointer), common)
    library.cholmod_free_factor(ctypes.byref(ctypes.cast(factor, ctypes.c_void_p)), common)
    library.cholmod_finish(common)


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

    def __init__(self, domains: list[Domain], size: int, corner: tuple[np.ndarray, ...], parallel: bool):
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
            y[i] = domain.solve(np.concatenate([b[i], np.zeros(k)]), _SYSTEM_L)
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
            raise NotDefinite("not positive definite")
        self._factors = U, S
        return self._up(y, s)

    def solve(self, b: tuple[np.ndarray, np.ndarray], s: np.ndarray) -> list[np.ndarray]:
        """Solve for [one half, other half, separator] with the factors that there are.

        b, s: the right-hand sides of the halves' own unknowns, and of the separator.
        """
        y: list[Any] = [None, None]

        def down(i: int) -> None:
            y[i] = self.domains[i].solve(np.concatenate([b[i], np.zeros(self.size)]), _SYSTEM_L)

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
            y[i] = self.domains[i].solve(right, _SYSTEM_LT)

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
    _library().blas[name](*passed)


def _times(U: np.ndarray, vector: np.ndarray, transposed: bytes) -> np.ndarray:
    """U or U^T times a vector, U upper triangular."""
    out = vector.copy()
    _blas("dtrmv", b"U", transposed, b"N", len(out), U, len(out), out, 1)
    return out
