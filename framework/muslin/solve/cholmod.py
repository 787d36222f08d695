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
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin.solve import kernels

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


SYSTEM_A, SYSTEM_L, SYSTEM_LT = 0, 4, 5


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


def blas() -> dict[str, Any]:
    """Routines of the library's BLAS, by name."""
    found: dict[str, Any] = _library().blas
    return found


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
        self.flops = float(np.frombuffer(self._common, dtype=np.float64)[_METHOD_FLOPS])
        self._b = np.zeros(n)
        self._B = _Dense(n, 1, n, n, self._b.ctypes.data, None, 1, 0)
        self._dense = tuple(ctypes.c_void_p() for _ in range(3))  # X, Y and E of cholmod_solve2
        self._x: np.ndarray | None = None
        weakref.finalize(self, _free, self._library, self._common, self._L, self._dense)

    @property
    def order(self) -> np.ndarray:
        """In which the unknowns are eliminated."""
        return _read(self._L.contents.Perm, self.n)

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

    def solve(self, b: np.ndarray, system: int = SYSTEM_A) -> np.ndarray:
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
        first, rows_at, x_at = (_read(getattr(L, name), L.nsuper + 1) for name in ("super", "pi", "px"))
        rows = _read(L.s, L.ssize)
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


def _read(address: int, count: int) -> np.ndarray:
    """A copy of the library's whole numbers."""
    return np.frombuffer(ctypes.string_at(address, 4 * count), dtype=np.int32)


def _write_out(library: Any, common: Any, L: _Factor) -> None:
    """Make of what was found of a matrix of 3x3 blocks what would be found of its entries."""

    def exchange(name: str, count: int, change: Callable[[np.ndarray], np.ndarray]) -> None:
        before = getattr(L, name)
        after = change(_read(before, count))
        address = library.cholmod_malloc(len(after), 4, common)
        if not address:
            raise MemoryError("CHOLMOD cannot analyse the matrix")
        ctypes.memmove(address, np.ascontiguousarray(after, dtype=np.int32).ctypes.data, 4 * len(after))
        library.cholmod_free(count, 4, before, common)
        setattr(L, name, address)

    def threefold(numbers: np.ndarray, step: int = 1) -> np.ndarray:
        three = np.empty((len(numbers), 3), dtype=np.int32)
        for k in range(3):
            three[:, k] = 3 * numbers + k * step
        return three.ravel()

    exchange("Perm", L.n, threefold)
    exchange("ColCount", L.n, lambda counts: threefold(counts, -1))
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
