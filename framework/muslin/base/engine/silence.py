"""Nothing of what an engine prints while it compiles."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import sys
from collections.abc import Iterator
from typing import Any

from muslin.base.engine.choice import load
from muslin.base.engine.inside import has, own_module


def compile_in_silence() -> None:
    """Drop what the engine prints while it compiles: before some errors two empty lines, on descriptor 1.

    What functions print while they run is printed. For processes without other threads that print.
    """
    if not has("binding a kernel to its arrays"):
        return
    kernel = own_module("lang.kernel_impl" if load().__name__ == "taichi" else "lang.kernel").Kernel
    original = kernel.ensure_compiled

    @functools.wraps(original)
    def ensure_compiled(*arguments: Any, **options: Any) -> Any:
        with _silence():
            return original(*arguments, **options)

    kernel.ensure_compiled = ensure_compiled


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Nothing reaches descriptor 1, nor what C keeps for it."""

    def flush() -> None:
        with contextlib.suppress(Exception):
            ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)

    try:
        sys.stdout.flush()
        flush()
        kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    except (OSError, ValueError, AttributeError):  # there is no such descriptor to be silent on
        yield
        return
    os.dup2(nothing, 1)
    os.close(nothing)
    try:
        yield
    finally:
        flush()
        os.dup2(kept, 1)
        os.close(kept)
