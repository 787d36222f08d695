"""The engine, in a process of its own: whether it imports, compiles and runs a kernel, and keeps it."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from muslin.base import child, engine, paths, runtime
from muslin.base.engine import inside
from muslin.base.errors import MuslinError
from muslin.doctor.finding import Finding, ending, loads, one_line
from muslin.doctor.places import refuses

PATIENCE = 60  # [s] for the engine to start and run a kernel
LIBX11 = (
    "Install it: apt-get install -y libx11-6 (Debian, Ubuntu) or dnf install -y libX11 (Fedora, RHEL);"
    " put sudo in front unless you are root."
)


def x11() -> list[Finding]:
    """Whether libX11, which Taichi's library is linked to on Linux, can be loaded; other engines do without."""
    if sys.platform != "linux" or not _is_taichi():
        return []
    if loads("libX11.so.6"):
        return [Finding("libX11", True, "libX11.so.6")]
    return [
        Finding("libX11", False, "libX11.so.6 is missing, and Taichi cannot be imported without it", LIBX11)
    ]


def _is_taichi() -> bool:
    try:
        return engine.chosen().name == "taichi"
    except MuslinError:
        return False


def compiler() -> list[Finding]:
    """Whether the engine imports, and compiles and runs a kernel; in another process, so that it may crash."""
    try:
        chosen = engine.chosen()
    except MuslinError as error:
        return [Finding("engine", False, error.message.rstrip("."), error.hint)]
    told, ending = _probe_outside()
    found = [judge_import(chosen, told, ending)]
    if "version" in told:
        found.append(_judge_kernel(chosen, told, ending))
    found.append(_kernel_cache(chosen, told.get("cache")))
    return found


def judge_import(chosen: engine.Engine, told: dict[str, Any], ending: str) -> Finding:
    """Judge what the other process told of the import of an engine, and how it ended."""
    if "version" in told:
        detail = f"{told['version']}, imported in {told['import_s']:.1f} s"
        return Finding(chosen.title, True, detail)
    reason = told.get("error", ending)
    if "libX11" in reason:
        return Finding(chosen.title, False, "cannot be imported: libX11.so.6 is missing", LIBX11)
    wanted = engine.requirement(chosen)
    if not wanted:
        return Finding(
            chosen.title, False, f"cannot be imported: {reason}", "See the lines Python and system."
        )
    if told.get("kind") == "ModuleNotFoundError" and f"'{chosen.name}'" in reason:
        return Finding(chosen.title, False, "not installed", f"Run: pip install '{wanted}'")
    return Finding(
        chosen.title,
        False,
        f"cannot be imported: {reason}",
        f"Install it again: pip install --force-reinstall --no-deps '{wanted}'",
    )


def _judge_kernel(chosen: engine.Engine, told: dict[str, Any], ending: str) -> Finding:
    if "kernel_s" in told:
        return Finding(
            f"{chosen.title} kernel", True, f"compiled and run in {told['kernel_s']:.1f} s, double precision"
        )
    return Finding(
        f"{chosen.title} kernel",
        False,
        f"cannot be compiled and run: {told.get('error', ending)}",
        "Check memory and limits (ulimit -a); try pip install --force-reinstall --no-deps '"
        f"{engine.requirement(chosen)}'",
    )


def probe() -> None:
    """Run in the other process: print what works as lines of JSON. Compiles afresh, past the kernel cache."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # engines print on the real standard output

    def tell(**facts: Any) -> None:
        print(json.dumps(facts), file=out, flush=True)

    try:
        start = time.perf_counter()
        ti = engine.import_quietly(engine.chosen())
        version: Any = getattr(ti, "__version__", "?")
        version = ".".join(map(str, version)) if isinstance(version, tuple) else str(version)
        tell(version=version, import_s=time.perf_counter() - start)
        tell(cache=inside.setting("offline_cache_file_path"))

        start = time.perf_counter()
        runtime.start(threads=2)
        inside.change("offline_cache", False)
        x = ti.field(ti.f64, shape=1000)

        @ti.kernel
        def square():  # type: ignore[no-untyped-def]  # an engine takes no "-> None"
            for i in x:
                x[i] = ti.cast(i, ti.f64) * i

        square()
        if x[999] != 999.0**2:
            raise ArithmeticError(f"999 squared came out as {x[999]}")
        tell(kernel_s=time.perf_counter() - start)
    except BaseException as error:
        tell(error=one_line(error), kind=type(error).__name__)


def _probe_outside() -> tuple[dict[str, Any], str]:
    """What `probe` told, and how its process ended."""
    done = child.run(child.python("muslin.doctor.compiling:probe"), limit=PATIENCE)
    told: dict[str, Any] = {}
    for line in done.output.decode(errors="replace").splitlines():
        try:
            told |= json.loads(line)
        except (ValueError, TypeError):  # not ours
            continue
    return told, f"no answer in {PATIENCE} s" if done.late else ending(done)


def _kernel_cache(chosen: engine.Engine, told: str | None) -> Finding:
    given = os.environ.get(chosen.variable("OFFLINE_CACHE_FILE_PATH"))
    folder = Path(given or told or paths.cache(chosen.name, chosen.kernels))
    reason = refuses(folder)
    if reason is None and paths.is_private(folder):
        return Finding(
            "kernel cache", None, f"{folder}, since there is no home that can be written",
            "Kernels are compiled again once the temporary folder is emptied; set HOME or XDG_CACHE_HOME.",
        )  # fmt: skip
    return Finding(
        "kernel cache",
        True if reason is None else None,
        str(folder) if reason is None else f"{folder} cannot be written: {reason}",
        "Muslin works but compiles every kernel on every run; set XDG_CACHE_HOME to a folder of yours.",
    )
