"""Taichi, started once, the way Muslin needs it: double precision on the CPU unless chosen otherwise, no fast maths,
quiet.

Nothing else in Muslin calls `ti.init`. A student's file must not either: a second `ti.init` destroys every
field and kernel already made, so `muslin.load` refuses files that try.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from muslin import complaints
from muslin.errors import MuslinError

#: Taichi's own passes that LLVM repeats behind it: without them kernels compile in two thirds of the time, run as
#: fast, and give the same bits.
_COMPILING = {"opt_level": 0, "cfg_optimization": False}

#: Where kernels can run, and in which numbers.
ARCHS, PRECISIONS = ("cpu", "cuda", "vulkan", "metal"), ("f64", "f32")

_chosen = {"arch": "cpu", "precision": "f64"}
_started: dict[str, Any] = {}
_lock = threading.RLock()


def choose(arch: str = "cpu", precision: str | None = None) -> str:
    """Choose where kernels run and their precision; before anything of Muslin has run.

    Parameters
    ----------
    arch : {"cpu", "cuda", "vulkan", "metal"}
        If there is no such device here, the CPU is taken.
    precision : {"f64", "f32"}, optional
        Default f64; on Metal f32, which has nothing else.

    Returns
    -------
    str
        A sentence for people if it could not be as chosen; else empty.

    Raises
    ------
    MuslinError
        If there is no such architecture or precision, or kernels have run already.
    """
    for what, value, known in (("architecture", arch, ARCHS), ("precision", precision or "f64", PRECISIONS)):
        if value not in known:
            raise MuslinError(f"There is no {what} {value!r}.", f"There is: {', '.join(known)}.")
    notice = ""
    ti = taichi()
    ti.set_logging_level(ti.CRITICAL)
    if arch != "cpu" and not ti.lang.misc.is_arch_supported(getattr(ti, arch)):
        arch, notice = "cpu", f"There is no {_NAMES[arch]} here: running on the CPU."
    if arch == "metal":
        if precision == "f64":
            notice = "Metal computes in single precision only: running in f32."
        precision = "f32"
    wanted = {"arch": arch, "precision": precision or "f64"}
    with _lock:
        if wanted != _chosen and "muslin.elements.arrays" in sys.modules:
            raise MuslinError(
                "Kernels have run already, and their numbers cannot change.", "Start Python anew."
            )
        _chosen.update(wanted)
    return notice


_NAMES = {"cuda": "CUDA", "vulkan": "Vulkan", "metal": "Metal"}


def real() -> Any:
    """Taichi's type of the numbers kernels compute in: f64, or f32 if chosen."""
    return getattr(taichi(), _chosen["precision"])


def plain() -> bool:
    """Whether kernels work on NumPy's own arrays of doubles: on the CPU, in double precision."""
    return _chosen == {"arch": "cpu", "precision": "f64"}


def single() -> bool:
    """Whether kernels compute in single precision."""
    return _chosen["precision"] == "f32"


def on_cpu() -> bool:
    """Whether kernels run on the CPU."""
    return _chosen["arch"] == "cpu"


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


def start(threads: int | None = None, debug: bool = False) -> ModuleType:
    """Start Taichi if it is not running as Muslin needs it; otherwise do nothing.

    If somebody else has called `ti.init` in the meantime, Taichi is started anew: what they made is lost, and
    a warning says so.

    Parameters
    ----------
    threads : int, optional
        CPU threads; default `$MUSLIN_THREADS`, else all cores this process may use.
    debug : bool
        Look for indices out of range while kernels run; about five times slower.

    Returns
    -------
    module
        The `taichi` module, started.

    Raises
    ------
    MuslinError
        If Taichi already runs with another number of threads, or in the parent of this forked process.
    """
    ti = taichi()
    with _lock:
        program = ti.lang.impl.get_runtime().prog
        if program is not None and program is _started.get("program"):
            if _started["process"] != os.getpid():
                raise MuslinError(
                    "Taichi was started before this process was forked, and does not survive that.",
                    'Start processes with multiprocessing.get_context("spawn").',
                )
            if threads and threads != _started["threads"]:
                raise MuslinError(
                    f"Taichi already runs with {_started['threads']} threads and cannot change to {threads}.",
                    "Call muslin.runtime.start(threads=...) before anything else, or set MUSLIN_THREADS.",
                )
            return ti
        if program is not None:
            warnings.warn("Muslin restarts Taichi: fields made after another ti.init are lost.", stacklevel=2)
        threads = threads or _wanted_threads()
        warnings.filterwarnings(
            "ignore", message=".*Calling non-taichi function"
        )  # `complaints` says it better
        with contextlib.redirect_stdout(io.StringIO()):  # "Starting on arch=..."
            ti.init(
                arch=getattr(ti, _chosen["arch"]),
                default_fp=real(),
                default_ip=ti.i32,
                fast_math=False,
                cpu_max_num_threads=threads,
                log_level=ti.CRITICAL,  # what is an error reaches us as an exception
                offline_cache=True,
                debug=debug,
                verbose=False,
                **_COMPILING,
            )
        complaints.refuse_bad_indices(ti, debug)
        _compile_faster()
        program = ti.lang.impl.get_runtime().prog
        _started.update(threads=threads, program=program, process=os.getpid())
    return ti


@contextlib.contextmanager
def shared_out() -> Iterator[None]:
    """Kernels compiled in here share their loops out as their `block_dim` says.

    Otherwise Taichi cuts a loop into one piece a thread, of 512 iterations at least: best where all take the same
    little time, but a loop over the rows of a picture would leave a thread idle half of the time.
    """
    config = start().lang.impl.current_cfg()
    before = config.make_cpu_multithreading_loop
    config.make_cpu_multithreading_loop = False
    try:
        yield
    finally:
        config.make_cpu_multithreading_loop = before


def call(kernel: Callable[..., None], *arguments: Any) -> None:
    """Run a kernel once, on arrays of doubles in whichever precision kernels compute.

    Entries a kernel leaves alone keep all their digits.
    """
    if plain():
        kernel(*arguments)
        return
    real = np.float32 if single() else np.float64
    doubles = [isinstance(value, np.ndarray) and value.dtype == np.float64 for value in arguments]
    sent = [value.astype(real) if double else value for value, double in zip(arguments, doubles, strict=True)]
    passed = [value.copy() if double else value for value, double in zip(sent, doubles, strict=True)]
    kernel(*passed)
    for value, before, after, double in zip(arguments, sent, passed, doubles, strict=True):
        if double and (changed := before != after).any():
            value[changed] = after[changed]


def _compile_faster() -> None:
    """Spare Taichi's compiler work it does over and over; what it makes and says stays the same.

    Each time a function is called in a kernel, it reads the function's source anew, and it prepares the text of an
    error for every expression it meets, wrapping the line that the expression is in. That is half of the time a
    kernel takes to compile.
    """
    import textwrap

    from taichi.lang import kernel_impl
    from taichi.lang.ast import ast_transformer_utils as utils

    class Wrapper(textwrap.TextWrapper):
        def wrap(self, text: str) -> list[str]:
            if len(text) > self.width or not text.isprintable():
                return super().wrap(text)
            return [text.rstrip()] if not text.isspace() and text else []

    context = utils.ASTTransformerContext
    if hasattr(context, "muslin"):
        return
    position = context.get_pos_info
    positions: dict[Any, str] = {}

    def get_pos_info(self: Any, node: Any) -> str:
        if node.lineno != node.end_lineno:
            return position(self, node)
        line = self.src[node.lineno - 1]
        where = (self.file, self.func.func.__name__, node.lineno + self.lineno_offset, self.indent)
        key = (*where, node.col_offset, node.end_col_offset, line)
        if key not in positions:
            positions[key] = position(self, node)
        return positions[key]

    context.muslin, context.get_pos_info = True, get_pos_info
    utils.TextWrapper = Wrapper
    kernel_impl.getsourcelines = functools.cache(kernel_impl.getsourcelines)
    kernel_impl.getsourcefile = functools.cache(kernel_impl.getsourcefile)
    kernel_impl.textwrap = SimpleNamespace(fill=functools.cache(textwrap.fill), dedent=textwrap.dedent)


def _wanted_threads() -> int:
    text = os.environ.get("MUSLIN_THREADS", "")
    if not text:
        return usable_cores()
    if not text.isdigit() or int(text) < 1:
        raise MuslinError(f"MUSLIN_THREADS={text!r} is not a number of threads.")
    return int(text)


def usable_cores() -> int:
    """Cores this process may run on; a container may be allowed fewer than the machine has."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text().split()
        cores = min(cores, max(1, round(int(quota) / int(period))))
    except (OSError, ValueError):  # no limit
        pass
    return cores
