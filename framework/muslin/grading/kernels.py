"""What a submission's workers have compiled, kept for the next grading of the very same submission.

Every submission has a store of its own, found by its content: what one leaves there no other ever sees. The
grader only carries the bytes; they go back into the sandbox they came from.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import re
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

import numpy as np

from muslin.base import engine, paths, scratch
from muslin.base.errors import MuslinError
from muslin.base.version import __version__
from muslin.base.writing import write

#: Largest store of one part of a submission, and of all submissions together [bytes].
LARGEST_PART, LARGEST_TOTAL = 20_000_000, 300_000_000

#: A file of compiled kernels, as a worker may call it: in the engine's folder or in one below, such as Quadrants'.
_NAME = re.compile(r"kernels/(?:\w+/)?\w[\w.-]*", re.ASCII)


class Store:
    """The compiled kernels of one submission.

    Parameters
    ----------
    submission : str
        sha256 of its files; None keeps nothing.
    """

    def __init__(self, submission: str | None):
        compiler = f"{engine.chosen().name} {engine.version()}"
        versions = f"{__version__} {compiler} {metadata.version('numpy')} {submission}"
        self._folder = None
        if submission is not None:
            with contextlib.suppress(OSError):
                folder = _home() / hashlib.sha256(versions.encode()).hexdigest()[:32]
                folder.mkdir(parents=True, exist_ok=True, mode=0o700)
                self._folder = folder

    @property
    def keeps(self) -> bool:
        """Whether anything is kept."""
        return self._folder is not None

    def load(self, part: str) -> dict[str, np.ndarray]:
        """Files of a part by name, as bytes; none if there are none."""
        if self._folder is None:
            return {}
        try:
            with np.load(self._folder / f"{part}.npz", allow_pickle=False) as data:
                files = {name: data[name] for name in data.files}
        except Exception:  # cut off, overwritten, no file of ours: as if it were not there
            return {}
        return files if sound(files) else {}

    def save(self, part: str, files: Mapping[str, np.ndarray]) -> None:
        """Keep the files of a part, if they are what they should be."""
        if self._folder is None or not sound(files):
            return
        packed = io.BytesIO()
        np.savez(packed, **dict(files))  # type: ignore[arg-type]
        with contextlib.suppress(MuslinError):
            write(self._folder / f"{part}.npz", packed.getvalue(), private=True)


def sound(files: Mapping[str, np.ndarray]) -> bool:
    """Whether files are what a worker's compiled kernels should be, in name, type and size."""
    named = all(_NAME.fullmatch(name) and data.dtype == np.uint8 for name, data in files.items())
    return named and sum(data.nbytes for data in files.values()) <= LARGEST_PART


def tidy() -> None:
    """Drop the stores not used for longest, until all together are small enough."""
    total = 0.0
    for _, store in sorted(((_of(store)[0], store) for store in _entries(_home())), reverse=True):
        total += sum(_of(file)[1] for file in _entries(store))
        if total > LARGEST_TOTAL:
            scratch.remove(store)


def _entries(folder: Path) -> list[Path]:
    """What lies in a folder; nothing, if it is none."""
    try:
        return list(folder.iterdir())
    except OSError:
        return []


def _of(path: Path) -> tuple[float, float]:
    """When something was changed last, and its size."""
    try:
        found = path.lstat()
    except OSError:  # another grading has dropped it
        return 0.0, 0.0
    return found.st_mtime, found.st_size


def _home() -> Path:
    return paths.cache("muslin", "grading")
