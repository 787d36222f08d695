"""NumPy's BLAS, kept to one thread where its vectors are short.

From 10,000 numbers on OpenBLAS shares even a scalar product among all cores. It takes microseconds; the other thread
then spins for milliseconds, waiting for more, and takes a core from those who compute.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import sys
from collections.abc import Callable, Iterator
from typing import Any

#: Names that OpenBLAS's functions have in NumPy's wheels, by release.
PREFIXES = (("scipy_openblas_", "64_"), ("scipy_openblas_", ""), ("openblas_", "64_"), ("openblas_", ""))


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """While it lasts, NumPy's BLAS stays on the calling thread, where it is an OpenBLAS that lets itself be told."""
    threads = _threads()
    before = threads[0]() if threads else 1
    if not threads or before == 1:
        yield
        return
    threads[1](1)
    try:
        yield
    finally:
        threads[1](before)


@functools.cache
def _threads() -> tuple[Callable[[], int], Callable[[int], Any]] | None:
    """What asks for the number of threads, and what sets it; None if there is no such thing."""
    cores = "numpy._core._multiarray_umath", "numpy.core._multiarray_umath"  # of NumPy 2, and 1
    core = next((module for name in cores if (module := sys.modules.get(name))), None)
    if core is None or core.__file__ is None:
        return None
    try:  # it is loaded already; this looks for names in what it is linked with, too
        library = ctypes.CDLL(core.__file__)
    except OSError:
        return None
    for before, after in PREFIXES:
        names = (f"{before}{verb}_num_threads{after}" for verb in ("get", "set"))
        found = [getattr(library, name, None) for name in names]
        if all(found):
            return found[0], found[1]  # type: ignore[return-value]
    return None
