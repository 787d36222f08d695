"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError, of_system


def write(path: Path, data: bytes, *, private: bool = False) -> None:
    """Write a file so that, whatever happens, there is the old one or the new one, whole.

    A link of that name is replaced, not followed.

    Parameters
    ----------
    path : Path
        Its folder is made if need be.
    data : bytes
    private : bool
        Whether only this user may read it; else whoever may read new files here.

    Raises
    ------
    MuslinError
        If it cannot be written.
    """
    part = path.with_name(f".{path.name[:40]}{secrets.token_hex(4)}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(
            part, "xb", opener=lambda name, flags: os.open(name, flags, 0o600 if private else 0o666)
        ) as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
        _keep_name(path.parent)
    except OSError as error:
        why = error.strerror or error
        raise MuslinError(f"{paths.shown(path)} cannot be written: {why}.", of_system(error).hint) from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _keep_name(folder: Path) -> None:
    """Have a folder's new names on the disk too; Windows does so by itself."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
