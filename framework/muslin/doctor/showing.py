"""Pictures and what makes things faster: the encoder, graphics, the fast solver."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from pathlib import Path

from muslin.base import child
from muslin.doctor.finding import Finding, ending, loads, one_line


def video() -> Finding:
    """Whether the bundled ffmpeg encodes a clip of two frames."""
    what, again = "video encoder", "Run: pip install --force-reinstall imageio-ffmpeg"
    try:
        import imageio_ffmpeg

        program = imageio_ffmpeg.get_ffmpeg_exe()
    except ImportError as error:
        return Finding(what, False, f"imageio-ffmpeg cannot be imported ({one_line(error)})", again)
    except RuntimeError as error:
        return Finding(what, False, one_line(error), again)
    try:
        reason = _encode(program)
    except OSError as error:
        return Finding(what, False, f"ffmpeg does not run: {one_line(error)}", again)
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
    return "" if done.status == 0 and written else ending(done)


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
        return loads("vulkan-1.dll")
    if not (loads("libvulkan.so.1") or loads("libvulkan.so")):
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
        return loads("nvcuda.dll")
    devices = (Path("/dev/nvidiactl"), Path("/dev/dxg"))
    return sys.platform == "linux" and any(d.exists() for d in devices) and loads("libcuda.so.1")


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
        return Finding("fast solver", None, "not installed" if missing else one_line(error), advice)
    return Finding("fast solver", True, f"CHOLMOD in cvxopt {cvxopt.__version__}")
