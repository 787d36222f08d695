"""Which of its kernels CHOLMOD's OpenBLAS computes with.

The OpenBLAS that cvxopt's wheels carry dates from 2021. On a processor that it does not know it falls back to the
kernels of a Pentium 4 ("Prescott"), a third as fast in a factorisation as those that the processor is really able to
run. It holds all of them, and one pointer says which are in use: `fast` turns it to Haswell's (AVX2 and FMA), and back.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

#: What OpenBLAS falls back to, what to take instead, and the flags of a processor that can run it.
FALLBACK, BETTER, FLAGS = "Prescott", "Haswell", frozenset({"avx2", "fma"})


def better(core: str, flags: Iterable[str]) -> str | None:
    """The kernels to take instead of these on a processor with these flags; None if they are as they should be."""
    return BETTER if core == FALLBACK and FLAGS.issubset(flags) else None


class _Switch(NamedTuple):
    pointer: ctypes.c_void_p
    own: int
    fast: int


@contextlib.contextmanager
def fast(blas: Any) -> Iterator[None]:
    """Compute with better kernels, where the library's own choice is a fallback.

    Parameters
    ----------
    blas : ctypes.CDLL or None
        OpenBLAS; None: nothing is done.
    """
    switch = None if blas is None else _switch(blas)
    if switch is None:
        yield
        return
    switch.pointer.value = switch.fast
    try:
        yield
    finally:
        switch.pointer.value = switch.own


@functools.cache
def _switch(blas: Any) -> _Switch | None:
    """Where the library keeps its choice, what that is, and the better one; None if there is no better one."""
    if "OPENBLAS_CORETYPE" in os.environ:  # somebody has chosen
        return None
    try:
        core = blas.openblas_get_corename
        pointer = ctypes.c_void_p.in_dll(blas, "gotoblas")
        leave, choose = blas.gotoblas_dynamic_quit, blas.gotoblas_dynamic_init
    except (AttributeError, ValueError):  # another build
        return None
    core.restype = ctypes.c_char_p
    wanted, own = better(core().decode(), _flags()), pointer.value
    if wanted is None or own is None:
        return None
    os.environ["OPENBLAS_CORETYPE"] = wanted
    try:
        leave()
        choose()
        chosen, name = pointer.value, core().decode()
    finally:
        del os.environ["OPENBLAS_CORETYPE"]
        pointer.value = own
    return _Switch(pointer, own, chosen) if chosen and name == wanted else None


def _flags() -> frozenset[str]:
    """What the processor can do, as Linux lists it."""
    try:
        found = re.search(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        return frozenset()
    return frozenset(found[1].split()) if found else frozenset()
