"""Taichi, started once, the way Muslin needs it: double precision, no fast maths, quiet.

Nothing else in Muslin calls `ti.init`. A student's file must not either: a second `ti.init` destroys every
field and kernel already made, so `muslin.load` refuses files that try.
"""

from __future__ import annotations

import contextlib
import io
import os
import warnings
from types import ModuleType
from typing import Any

from muslin.errors import MuslinError

_started: dict[str, Any] = {}


def taichi() -> ModuleType:
    """Import Taichi without its banner, or say exactly what the system lacks.

    Raises
    ------
    MuslinError
        If Taichi is not installed, has no wheel for this system, or cannot find libX11.
    """
    try:
        import taichi as ti
    except ImportError as error:
        if "libX11" in str(error):
            raise MuslinError(
                "Taichi cannot start because the system library libX11.so.6 is missing.",
                "Install it, on Debian or Ubuntu with: apt-get install -y libx11-6",
            ) from None
        raise MuslinError(
            f"Taichi cannot be imported ({error}).",
            "Wheels exist for Python 3.10-3.13 on Linux x86-64, macOS arm64 and Windows. Run: muslin doctor",
        ) from None
    return ti


def start(threads: int | None = None, arch: str = "cpu", precision: str = "f64") -> ModuleType:
    """Start Taichi if it is not running yet; later calls only check that they ask for the same.

    Parameters
    ----------
    threads : int, optional
        CPU threads; default `$MUSLIN_THREADS`, else all cores.
    arch : {"cpu", "cuda", "vulkan", "metal"}
        Where kernels run.
    precision : {"f64", "f32"}
        Floating-point type of kernels.

    Returns
    -------
    module
        The `taichi` module, started.
    """
    ti = taichi()
    if not _started or _lost(ti):
        threads = threads or int(os.environ.get("MUSLIN_THREADS", "0")) or os.cpu_count() or 1
        warnings.filterwarnings(
            "ignore", message=".*Calling non-taichi function"
        )  # `complaints` says it better
        with contextlib.redirect_stdout(io.StringIO()):  # "Starting on arch=..."
            ti.init(
                arch=getattr(ti, arch),
                default_fp=getattr(ti, precision),
                default_ip=ti.i32,
                fast_math=False,
                cpu_max_num_threads=threads,
                log_level=ti.WARN,
                offline_cache=True,
                verbose=False,
            )
        _started.update(threads=threads, arch=arch, precision=precision, program=_program(ti))
    elif threads and threads != _started["threads"]:
        raise MuslinError(
            f"Taichi already runs with {_started['threads']} threads and cannot change to {threads}.",
            "Call muslin.runtime.start(threads=...) before anything else, or set MUSLIN_THREADS.",
        )
    return ti


def _program(ti: ModuleType) -> Any:
    return ti.lang.impl.get_runtime().prog


def _lost(ti: ModuleType) -> bool:
    """Whether somebody else called `ti.init` or `ti.reset` since we started."""
    return _program(ti) is not _started["program"]
