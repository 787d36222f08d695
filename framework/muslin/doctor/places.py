"""Files: what Muslin brings along, and the folders work is done in."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from muslin.base import paths
from muslin.doctor.finding import GIBIBYTE, Finding, one_line

DISK = GIBIBYTE // 2  # [bytes] a run of a few hundred frames, its video and the kernel cache


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
        found.append(Finding("temporary folder", False, f"none can be written: {one_line(error)}", advice))
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
    reason = refuses(folder)
    return Finding(what, reason is None, str(folder) if reason is None else f"{folder}: {reason}", advice)


def refuses(folder: Path) -> str | None:
    """Why no file can be written in a folder, or, if it does not exist, in the nearest that does."""
    try:
        while not folder.exists() and folder != folder.parent:
            folder = folder.parent
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".muslin-") as file:
            file.write(b"x")
            file.flush()
    except OSError as error:
        return error.strerror or one_line(error)
    return None
