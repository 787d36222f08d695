"""Files that are either whole or not there."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from muslin.base.errors import MuslinError
from muslin.base.paths import shown

Notice = Any  # callable str -> object: `print`, a list's `append`, a console's `print`


@contextlib.contextmanager
def whole(path: Path, mode: str = "wb") -> Iterator[IO[Any]]:
    """Open a file that appears under its name only once it is complete.

    Raises
    ------
    MuslinError
        If the file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        text = "b" not in mode
        with open(part, mode, encoding="utf-8" if text else None, newline="\n" if text else None) as file:
            yield file
        os.replace(part, path)
    except OSError as error:
        if error.filename is not None and Path(error.filename) not in (part, path, *path.parents):
            raise  # a frame that could not be read, say: nothing to do with this file
        raise MuslinError(
            f"{shown(path)} cannot be written: {error.strerror or error}.",
            "Choose another place with enough room.",
        ) from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def numbered(path: Path, k: int, part: str = "") -> Path:
    """File of frame k in a series: `drape.ply` -> `drape_0012.ply`, of a prop `drape_sphere_0012.ply`."""
    return path.with_name(f"{path.stem}{'_' + part if part else ''}_{k:04d}{path.suffix}")


def warn_of_leftovers(written: list[Path], notice: Notice) -> None:
    """Say so if frames of an earlier, longer series lie beside the new ones."""
    ours = {file.name for file in written}
    series = {_series(name) for name in ours}
    old = [f for f in written[0].parent.iterdir() if f.name not in ours and _series(f.name) in series]
    if old:
        notice(
            f"{len(old)} files of an earlier export lie beside the new ones, such as {shown(min(old))}:"
            " delete them, or a viewer may show them as part of this series."
        )


def _series(name: str) -> str:
    """The name with its frame number replaced: `drape_0012.ply` -> `drape_#.ply`."""
    return re.sub(r"_\d{4,}(\.\w+)$", r"_#\1", name)
