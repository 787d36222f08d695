"""What this computer has of what Muslin needs, line by line: `examine` finds out, `report` prints.

Nothing here may fail because something is missing: the engine runs in a process of its own, and whatever goes
wrong inside a check becomes its finding.
"""

from __future__ import annotations

import ctypes
import importlib.util
import json
import os
import platform
import shutil
import sys
import sysconfig
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.base import child, engine, paths, runtime
from muslin.base.engine import inside
from muslin.base.errors import MuslinError

OLDEST, NEWEST = (3, 10), (3, 14)  # Python versions Muslin supports; an engine has a wheel for each
GIBIBYTE = 1 << 30
MEMORY = 2 * GIBIBYTE  # [bytes] the engine's compiler does not start with less address space
DISK = GIBIBYTE // 2  # [bytes] a run of a few hundred frames, its video and the kernel cache
# Package -> module; the engine and ffmpeg have lines of their own.
PACKAGES = {n: n for n in ("numpy", "scipy", "meshio", "typer", "rich")} | {"pillow": "PIL"}
if sys.version_info < (3, 11):
    PACKAGES["tomli"] = "tomli"
PATIENCE = 60  # [s] for the engine to start and run a kernel
LIBX11 = (
    "Install it: apt-get install -y libx11-6 (Debian, Ubuntu) or dnf install -y libX11 (Fedora, RHEL);"
    " put sudo in front unless you are root."
)


@dataclass(frozen=True)
class Finding:
    """One line of the examination.

    Parameters
    ----------
    what : str
        What was looked at.
    ok : bool or None
        None: absent, and Muslin's main work does not need it.
    detail : str
        What was found.
    advice : str
        What to do, if not ok.
    """

    what: str
    ok: bool | None
    detail: str
    advice: str = ""

    def __str__(self) -> str:
        mark = {True: "ok", False: "FIX", None: "-"}[self.ok]
        advice = f"  -> {self.advice}" if self.advice and self.ok is not True else ""
        return f"{mark:4}  {self.what:18}  {self.detail}{advice}"


def examine() -> list[Finding]:
    """Look at everything Muslin needs or can use. Takes a few seconds.

    Returns
    -------
    list of Finding
        Never empty; no error of a check gets out.
    """
    findings: list[Finding] = []
    for what, check in _CHECKS:
        try:
            found = check()
            findings += [found] if isinstance(found, Finding) else found
        except Exception as error:  # a doctor who falls ill helps nobody
            findings.append(
                Finding(
                    what,
                    False,
                    f"could not be examined: {_one_line(error)}",
                    "Please report this line as a bug.",
                )
            )
    return findings


def report(
    findings: Iterable[Finding], say: Callable[[str, str], None] = lambda line, _: print(line)
) -> bool:
    """Tell the findings, one line each.

    Parameters
    ----------
    findings : iterable of Finding
    say : callable
        Prints a line in an ANSI style, where there are colours.

    Returns
    -------
    bool
        True if nothing essential is missing.
    """
    findings = list(findings)
    for finding in findings:
        say(str(finding), {True: "32", False: "1;31", None: "2"}[finding.ok])
    missing = [f.what for f in findings if f.ok is False]
    if missing:
        say(f"\nTo fix before Muslin works fully: {', '.join(missing)}.", "1;31")
    else:
        say("\nMuslin has everything it needs here.", "32")
    return not missing


# --- Python and the system ----------------------------------------------------------------------------------


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


# --- the engine ---------------------------------------------------------------------------------------------


def x11() -> list[Finding]:
    """Whether libX11, which Taichi's library is linked to on Linux, can be loaded; other engines do without."""
    if sys.platform != "linux" or not _is_taichi():
        return []
    if _loads("libX11.so.6"):
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
        def square() -> None:
            for i in x:
                x[i] = ti.cast(i, ti.f64) * i

        square()
        if x[999] != 999.0**2:
            raise ArithmeticError(f"999 squared came out as {x[999]}")
        tell(kernel_s=time.perf_counter() - start)
    except BaseException as error:
        tell(error=_one_line(error), kind=type(error).__name__)


def _probe_outside() -> tuple[dict[str, Any], str]:
    """What `probe` told, and how its process ended."""
    done = child.run(child.python("muslin.doctor:probe"), limit=PATIENCE)
    told: dict[str, Any] = {}
    for line in done.output.decode(errors="replace").splitlines():
        try:
            told |= json.loads(line)
        except (ValueError, TypeError):  # not ours
            continue
    return told, f"no answer in {PATIENCE} s" if done.late else _ending(done)


def _ending(done: child.Done) -> str:
    if name := child.killer(done.status):
        extra = ", an instruction this processor lacks" if name == "SIGILL" else ""
        return f"the process was killed by {name if name.startswith('signal') else f'signal {name}'}{extra}"
    last = child.last_line(done.errors)
    number = str(done.status) if done.status < 256 else hex(done.status)  # Windows names exceptions so
    return f"the process ended with status {number}" + (f" ({last[:200]})" if last else "")


def _kernel_cache(chosen: engine.Engine, told: str | None) -> Finding:
    given = os.environ.get(chosen.variable("OFFLINE_CACHE_FILE_PATH"))
    folder = Path(given or told or paths.cache(chosen.name, chosen.kernels))
    reason = _refuses(folder)
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


# --- pictures, windows, solvers -----------------------------------------------------------------------------


def video() -> Finding:
    """Whether the bundled ffmpeg encodes a clip of two frames."""
    what, again = "video encoder", "Run: pip install --force-reinstall imageio-ffmpeg"
    try:
        import imageio_ffmpeg

        program = imageio_ffmpeg.get_ffmpeg_exe()
    except ImportError as error:
        return Finding(what, False, f"imageio-ffmpeg cannot be imported ({_one_line(error)})", again)
    except RuntimeError as error:
        return Finding(what, False, _one_line(error), again)
    try:
        reason = _encode(program)
    except OSError as error:
        return Finding(what, False, f"ffmpeg does not run: {_one_line(error)}", again)
    if reason:
        return Finding(what, False, f"ffmpeg failed: {reason}", again)
    version = getattr(imageio_ffmpeg, "__version__", "?")
    return Finding(what, True, f"imageio-ffmpeg {version} wrote a test clip")


def _encode(ffmpeg: str) -> str:
    """Encode two frames; return what went wrong, or nothing."""
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "64x64", "-r", "2", "-i", "-"]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        clip = Path(folder) / "clip.mp4"
        done = child.run(
            [ffmpeg, "-y", "-v", "error", *raw, "-c:v", "libx264", "-pix_fmt", "yuv420p", str(clip)],
            bytes(2 * 64 * 64 * 3),
            limit=20,
        )
        written = clip.stat().st_size if clip.is_file() else 0
    if done.late:
        return "no answer in 20 s"
    return "" if done.status == 0 and written else _ending(done)


def graphics() -> list[Finding]:
    """What the interactive window and computing on a graphics card would need; Muslin needs neither."""
    if sys.platform == "darwin":
        wants = ["a desktop session"] if os.environ.get("SSH_CONNECTION") else []
    else:
        wants = [] if _vulkan() else ["a Vulkan driver (Debian, Ubuntu: libvulkan1 and mesa-vulkan-drivers)"]
        if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            wants.append("a display")
    cards = [name for name, there in (("CUDA", _cuda()), ("Metal", _metal())) if there]
    return [
        Finding(
            "interactive window",
            None if wants else True,
            f"would need {' and '.join(wants)}" if wants else "graphics driver and display found",
            "Nothing to do: pictures and videos work without.",
        ),
        Finding(
            "GPU computing",
            True if cards else None,
            f"{', '.join(cards)} found" if cards else "would need an NVIDIA card with its driver",
            "Nothing to do: Muslin computes on the CPU.",
        ),
    ]


def _vulkan() -> bool:
    """Whether a Vulkan loader and at least one driver are registered."""
    if sys.platform == "win32":
        return _loads("vulkan-1.dll")
    if not (_loads("libvulkan.so.1") or _loads("libvulkan.so")):
        return False
    for variable in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES"):
        if os.environ.get(variable):
            return any(Path(p).is_file() for p in os.environ[variable].split(os.pathsep))
    data = [
        Path(p) for p in (os.environ.get("XDG_DATA_DIRS") or "/usr/local/share:/usr/share").split(":") if p
    ]
    folders = [Path("/etc"), Path("/usr/local/etc"), *data, Path(os.path.expanduser("~/.local/share"))]
    return any(True for folder in folders for _ in (folder / "vulkan" / "icd.d").glob("*.json"))


def _cuda() -> bool:
    if sys.platform == "win32":
        return _loads("nvcuda.dll")
    devices = (Path("/dev/nvidiactl"), Path("/dev/dxg"))
    return sys.platform == "linux" and any(d.exists() for d in devices) and _loads("libcuda.so.1")


def _metal() -> bool:
    return sys.platform == "darwin" and platform.machine() == "arm64"


def fast_solver() -> Finding:
    """Whether CHOLMOD, the fast sparse solver, is there."""
    advice = 'To solve several times faster: pip install "muslin[fast]" (CHOLMOD in cvxopt, under the GPL).'
    try:
        import cvxopt
        import cvxopt.cholmod
    except ImportError as error:
        missing = isinstance(error, ModuleNotFoundError)
        return Finding("fast solver", None, "not installed" if missing else _one_line(error), advice)
    return Finding("fast solver", True, f"CHOLMOD in cvxopt {cvxopt.__version__}")


# --- files --------------------------------------------------------------------------------------------------


def shipped() -> list[Finding]:
    """Whether Muslin's own meshes, assignments and reference data are where they belong."""
    if paths.in_repository():
        advice = "Restore the checkout: git checkout -- data assignments"
    else:
        advice = "Install Muslin afresh: pip install --force-reinstall --no-deps muslin"
    reference = paths.reference("cloth").parent
    found = []
    for what, folder in (
        ("meshes", paths.meshes()),
        ("assignments", paths.assignment("cloth").parent),
        ("reference data", reference),
    ):
        count = _content(folder)
        detail = f"{count or 'none'} in {folder}"
        found.append(Finding(what, count > 0, detail, advice))
    return found


def _content(folder: Path) -> int:
    """Visible entries of a folder; empty folders do not count."""
    if not folder.is_dir():
        return 0
    visible = [p for p in folder.iterdir() if not p.name.startswith((".", "__"))]
    return sum(p.is_file() or any(p.iterdir()) for p in visible)


def folders() -> list[Finding]:
    """Whether the working and temporary folders can be written, and the room there."""
    found, places = [], []
    try:
        here = Path.cwd()
    except OSError:
        found.append(Finding("working folder", False, "no longer exists", "Change to a folder that does."))
    else:
        found.append(_writable("working folder", here, "Change to a folder of yours."))
        places.append(here)
    try:
        temporary = Path(tempfile.gettempdir())
    except OSError as error:
        advice = "Set TMPDIR to a folder of yours."
        found.append(Finding("temporary folder", False, f"none can be written: {_one_line(error)}", advice))
    else:
        found.append(_writable("temporary folder", temporary, "Set TMPDIR to a folder of yours."))
        places.append(temporary)
    tight = {place: shutil.disk_usage(place).free for place in places}
    if not tight:
        return found
    place = min(tight, key=lambda p: tight[p])
    found.append(
        Finding(
            "disk space",
            tight[place] >= DISK,
            f"{tight[place] / GIBIBYTE:.1f} GiB free" + (f" in {place}" if tight[place] < DISK else ""),
            "Runs and videos take some hundred MiB: make room.",
        )
    )
    return found


def _writable(what: str, folder: Path, advice: str) -> Finding:
    reason = _refuses(folder)
    return Finding(what, reason is None, str(folder) if reason is None else f"{folder}: {reason}", advice)


def _refuses(folder: Path) -> str | None:
    """Why no file can be written in a folder, or, if it does not exist, in the nearest that does."""
    try:
        while not folder.exists() and folder != folder.parent:
            folder = folder.parent
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".muslin-") as file:
            file.write(b"x")
            file.flush()
    except OSError as error:
        return error.strerror or _one_line(error)
    return None


# --- helpers ------------------------------------------------------------------------------------------------


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _one_line(error: object) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 300 else f"{text[:297]}..."


# In the order a person should see to them.
_CHECKS: tuple[tuple[str, Callable[[], Finding | list[Finding]]], ...] = (
    ("Python", python),
    ("system", system),
    ("Python packages", packages),
    ("libX11", x11),
    ("engine", compiler),
    ("video encoder", video),
    ("hardware", hardware),
    ("folders", folders),
    ("shipped data", shipped),
    ("fast solver", fast_solver),
    ("graphics", graphics),
)
