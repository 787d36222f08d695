"""The engine, started once, the way Muslin needs it: double precision on the CPU unless chosen otherwise, no fast
maths, quiet.

Nothing else in Muslin calls `ti.init`. A student's file must not either: a second `ti.init` destroys every
field and kernel already made, so `muslin.load` refuses files that try.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from muslin.base import engine
from muslin.base.engine import inside, loops
from muslin.base.errors import MuslinError

#: The engine's own passes that LLVM repeats behind it: without them kernels compile in two thirds of the time, run as
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
    ti = engine.load()
    ti.set_logging_level(ti.CRITICAL)
    if arch != "cpu" and not inside.runs_on(arch):
        arch, notice = "cpu", f"There is no {_NAMES[arch]} here: running on the CPU."
    if arch == "metal":
        if precision == "f64":
            notice = "Metal computes in single precision only: running in f32."
        precision = "f32"
    wanted = {"arch": arch, "precision": precision or "f64"}
    with _lock:
        if wanted != _chosen and "muslin.base.arrays" in sys.modules:
            raise MuslinError(
                "Kernels have run already, and their numbers cannot change.", "Start Python again."
            )
        _chosen.update(wanted)
    return notice


_NAMES = {"cuda": "CUDA", "vulkan": "Vulkan", "metal": "Metal"}


def real() -> Any:
    """The engine's type of the numbers kernels compute in: f64, or f32 if chosen."""
    return getattr(engine.load(), _chosen["precision"])


def plain() -> bool:
    """Whether kernels work on NumPy's own arrays of doubles: on the CPU, in double precision."""
    return _chosen == {"arch": "cpu", "precision": "f64"}


def single() -> bool:
    """Whether kernels compute in single precision."""
    return _chosen["precision"] == "f32"


def on_cpu() -> bool:
    """Whether kernels run on the CPU."""
    return _chosen["arch"] == "cpu"


def start(threads: int | None = None, debug: bool = False) -> ModuleType:
    """Start the engine if it is not running as Muslin needs it; otherwise do nothing.

    If somebody else has called `ti.init` in the meantime, it is started again: what they made is lost, and
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
        The engine, started.

    Raises
    ------
    MuslinError
        If it already runs with another number of threads, or in the parent of this forked process.
    """
    if threads is None and _started.get("process") == os.getpid() and inside.has("the running program"):
        program = inside.program()
        if program is not None and program is _started["program"]:
            return _started["engine"]
    ti, title = engine.load(), engine.chosen().title
    with _lock:
        program = inside.program() if inside.has("the running program") else _started.get("program")
        if program is not None and program is _started.get("program"):
            if _started["process"] != os.getpid():
                raise MuslinError(
                    f"{title} was started before this process was forked, and does not survive that.",
                    'Start processes with multiprocessing.get_context("spawn").',
                )
            if threads and threads != _started["threads"]:
                raise MuslinError(
                    f"{title} already runs with {_started['threads']} threads and cannot change to {threads}.",
                    "Call muslin.base.runtime.start(threads=...) before anything else, or set MUSLIN_THREADS.",
                )
            return ti
        if program is not None:
            warnings.warn(
                f"Muslin restarts {title}: fields made after another ti.init are lost.", stacklevel=2
            )
        threads = threads or _wanted_threads()
        warnings.filterwarnings(
            "ignore", message=".*Calling non-(taichi|quadrants) function"
        )  # `compile_errors` says it better
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
                **_COMPILING,
                **dict(engine.chosen().only_here),
            )
        inside.refuse_bad_indices(debug)
        inside.compile_faster()
        inside.tell_plainly()
        loops.nest()
        program = inside.program() if inside.has("the running program") else object()
        _started.update(engine=ti, threads=threads, program=program, process=os.getpid())
    return ti


def threads() -> int:
    """How many threads kernels use; starts the engine."""
    start()
    return int(_started["threads"])


@contextlib.contextmanager
def shared_out(**settings: Any) -> Iterator[None]:
    """Kernels compiled in here share their loops out as their `block_dim` says.

    Otherwise the engine cuts a loop into one piece a thread, of 512 iterations at least: best where all take the same
    little time, but a loop over the rows of a picture would leave a thread idle half of the time.

    Parameters
    ----------
    **settings
        Other settings of the engine, for these kernels only.
    """
    start()
    settings["make_cpu_multithreading_loop"] = False
    before = {name: inside.setting(name) for name in settings}
    for name, value in settings.items():
        inside.change(name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            inside.change(name, value)


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
