"""What a submission's workers have compiled, kept for the next grading of the very same submission.

Every submission has a store of its own, found by its content: what one leaves there no other ever sees. The
grader only carries the bytes; they go back into the sandbox they came from.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import tempfile
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

import numpy as np

import muslin
from muslin import engine, paths

#: Largest store of one part of a submission, and of all submissions together [bytes].
LARGEST_PART, LARGEST_TOTAL = 20_000_000, 300_000_000


class Store:
    """The compiled kernels of one submission.

    Parameters
    ----------
    submission : str
        sha256 of its files; None keeps nothing.
    """

    def __init__(self, submission: str | None):
        compiler = f"{engine.chosen().name} {engine.version()}"
        versions = f"{muslin.__version__} {compiler} {metadata.version('numpy')} {submission}"
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
                return {name: data[name] for name in data.files}
        except (OSError, ValueError, EOFError):
            return {}

    def save(self, part: str, files: Mapping[str, np.ndarray]) -> None:
        """Keep the files of a part, if they are what they should be."""
        sound = all(
            name.startswith("kernels/")
            and name.count("/") == 1
            and ".." not in name
            and data.dtype == np.uint8
            for name, data in files.items()
        )
        if self._folder is None or not sound or sum(data.nbytes for data in files.values()) > LARGEST_PART:
            return
        with contextlib.suppress(OSError):
            descriptor, name = tempfile.mkstemp(dir=self._folder, suffix=".new")
            with os.fdopen(descriptor, "wb") as stream:
                np.savez(stream, **dict(files))  # type: ignore[arg-type]
            os.replace(name, self._folder / f"{part}.npz")


def tidy() -> None:
    """Drop the stores not used for longest, until all together are small enough."""
    with contextlib.suppress(OSError):
        stores = sorted(_home().iterdir(), key=lambda folder: folder.stat().st_mtime, reverse=True)
        total = 0
        for store in stores:
            total += sum(file.stat().st_size for file in store.iterdir())
            if total > LARGEST_TOTAL:
                shutil.rmtree(store, ignore_errors=True)


def _home() -> Path:
    return paths.cache("muslin", "grading")
