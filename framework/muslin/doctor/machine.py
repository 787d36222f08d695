"""Python, the system and what the machine has."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import platform
import sys
import sysconfig
from pathlib import Path

from muslin.base import child, runtime
from muslin.doctor.finding import GIBIBYTE, Finding

OLDEST, NEWEST = (3, 10), (3, 14)  # Python versions Muslin supports; an engine has a wheel for each
MEMORY = 2 * GIBIBYTE  # [bytes] the engine's compiler does not start with less address space

# Package -> module; the engine and ffmpeg have lines of their own.
PACKAGES = {n: n for n in ("numpy", "scipy", "meshio", "typer", "rich")} | {"pillow": "PIL"}
if sys.version_info < (3, 11):
    PACKAGES["tomli"] = "tomli"


def python() -> Finding:
    """Whether this is a Python that Taichi has a wheel for."""
    return judge_python(
        sys.version_info[:3],
        platform.python_implementation(),
        bool(sysconfig.get_config_var("Py_GIL_DISABLED")),
    )


def judge_python(version: tuple[int, ...], implementation: str, free_threaded: bool) -> Finding:
    """Judge a Python by its version, its maker and whether it is the free-threaded build."""
    name = f"{implementation} {'.'.join(map(str, version))}{' (free-threaded)' if free_threaded else ''}"
    ok = OLDEST <= tuple(version[:2]) <= NEWEST and implementation == "CPython" and not free_threaded
    supported = f"{'.'.join(map(str, OLDEST))} to {'.'.join(map(str, NEWEST))}"
    reason = "is newer than any wheel" if tuple(version[:2]) > NEWEST else "has no wheel"
    reason += " of Taichi or Quadrants"
    return Finding(
        "Python",
        ok,
        name if ok else f"{name} {reason}",
        f"Use the ordinary CPython {supported}, for example: uv venv --python {NEWEST[0]}.{NEWEST[1]}",
    )


def system() -> Finding:
    """Whether an engine has a wheel for this operating system and processor."""
    libc, libc_version = platform.libc_ver() if sys.platform == "linux" else ("", "")
    if not libc and any(Path("/lib").glob("ld-musl-*")):
        libc = "musl"
    translated = False
    if sys.platform == "darwin" and platform.machine() == "x86_64":
        asked = child.run(["sysctl", "-n", "sysctl.proc_translated"], limit=5)
        translated = asked.output.strip() == b"1"
    return judge_system(
        platform.system(), platform.machine(), libc, libc_version, sys.maxsize > 2**32, translated
    )


def judge_system(
    name: str,
    machine: str,
    libc: str = "",
    libc_version: str = "",
    wide: bool = True,
    translated: bool = False,
) -> Finding:
    """Judge an operating system and processor.

    Parameters
    ----------
    name, machine : str
        As `platform.system()` and `platform.machine()` say.
    libc, libc_version : str
        On Linux: "glibc" or "musl".
    wide : bool
        Whether Python is a 64-bit program.
    translated : bool
        On macOS: whether this is an Intel program on an Apple processor.
    """
    machine = machine.lower()
    intel, arm = machine in ("x86_64", "amd64"), machine in ("arm64", "aarch64")
    label = {"Darwin": "macOS"}.get(name, name)
    shown = " ".join(filter(None, [label, machine, libc, libc_version]))

    def no(reason: str, advice: str) -> Finding:
        return Finding("system", False, f"{shown}: {reason}", advice)

    container = (
        "Use a Linux x86-64 container, for example: docker run --platform linux/amd64 -it python:3.12-slim"
    )
    if not wide:
        return no("no engine has a wheel for 32-bit Python", "Install a 64-bit Python.")
    if name == "Linux":
        if not (intel or arm):
            return no("no engine has a wheel for this processor", "Use an x86-64 or 64-bit ARM computer.")
        if libc == "musl":
            return no(
                "no engine has a wheel for musl systems such as Alpine",
                "Use a system with glibc, for example the container image python:3.12-slim.",
            )
        numbers = tuple(int(n) for n in libc_version.split(".")[:2] if n.isdigit())
        if numbers and numbers < (2, 27):
            return no("the engines' wheels need glibc 2.27 or newer", "Use a Linux of 2018 or later.")
    elif name == "Darwin":
        if translated:
            return no(
                "this is an Intel Python on an Apple processor, and no engine has a wheel for Intel Macs",
                "Install a native arm64 Python.",
            )
        if not arm:
            return no("no engine has a wheel for Intel Macs", container)
    elif name == "Windows":
        if not intel:
            return no("no engine has a wheel for Windows on ARM", "Use a Windows x64 or Linux computer.")
    else:
        return no(
            "no engine has a wheel for this system", "Use Linux, macOS on Apple silicon or Windows x64."
        )
    return Finding("system", True, shown)


def packages() -> Finding:
    """Whether the Python packages Muslin needs are installed."""
    missing = [package for package, module in PACKAGES.items() if importlib.util.find_spec(module) is None]
    return Finding(
        "Python packages",
        not missing,
        f"missing: {', '.join(missing)}" if missing else ", ".join(PACKAGES),
        "Run: pip install muslin, or in a checkout: pip install -e .",
    )


def hardware() -> list[Finding]:
    """Cores and memory this process may use."""
    cores = runtime.usable_cores()
    memory, free = _memory()
    found = [Finding("cores", True, f"{cores} usable of {os.cpu_count() or '?'}")]
    if memory is None:
        return [*found, Finding("memory", None, "unknown", "Muslin needs 2 GiB.")]
    detail = f"{memory / GIBIBYTE:.1f} GiB" + (f", {free / GIBIBYTE:.1f} free" if free is not None else "")
    enough = memory >= 0.9 * MEMORY  # a "2 GiB" machine shows a little less
    found.append(Finding("memory", enough, detail, "Muslin needs 2 GiB: use a larger computer or container."))
    limit = _address_space()
    if limit is not None and limit < MEMORY:
        found.append(
            Finding(
                "address space",
                False,
                f"limited to {limit / GIBIBYTE:.1f} GiB",
                "The engine needs 2 GiB to start: raise the limit with ulimit -v unlimited.",
            )
        )
    return found


def _memory() -> tuple[int | None, int | None]:
    """Memory in all, and free; [bytes], None where the system does not say."""
    total = free = None
    if sys.platform == "win32":

        class Status(ctypes.Structure):
            _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong)] + [
                (name, ctypes.c_ulonglong) for name in ("total", "free", "a", "b", "c", "d", "e")
            ]

        status = Status(length=ctypes.sizeof(Status))
        if ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):
            total, free = status.total, status.free
    else:
        total = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        try:
            lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
            free = int(lines["MemAvailable"].split()[0]) * 1024
        except (OSError, ValueError, KeyError):  # macOS
            pass
        try:
            total = min(total, int(Path("/sys/fs/cgroup/memory.max").read_text()))
            free = None if free is None else min(free, total)
        except (OSError, ValueError):  # no limit
            pass
    return total, free


def _address_space() -> int | None:
    """The limit on this process's address space [bytes], if there is one."""
    if sys.platform == "win32":
        return None
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit
