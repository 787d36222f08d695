"""Where pictures and films of a run go, and which films there are."""

from __future__ import annotations

import os
from pathlib import Path

from muslin.base.errors import MuslinError, choices
from muslin.simulation.runs import RunFolder

#: A film's file endings, and what else `render_run` can write.
FILMS = ("mp4", "webp", "gif", "frames")

#: Endings of films and pictures that Muslin does not write: no part of a name.
OTHERS = ("mov", "avi", "mkv", "webm", "m4v", "apng", "jpg", "jpeg", "bmp", "tif", "tiff")


def placed(out: Path | str | None, film: str | None, run: RunFolder) -> tuple[Path, str | None]:
    """Where pictures go, without an ending, and which film is made: None for none; see `render_run`.

    Raises
    ------
    MuslinError
        If there is no such format, or the ending of `out` says another one than `film`.
    """
    if film is not None and film not in (*FILMS, "none"):
        raise MuslinError(f"There is no film format {film!r}.", choices(film, (*FILMS, "none")))
    given = os.fspath(out) if out is not None else f"{run.folder}/"
    base = Path(given)
    if given.endswith(("/", os.sep)) or base.is_dir():
        return base / run.scene.name, None if film == "none" else film or "mp4"
    ending = base.suffix[1:].lower()
    if ending in OTHERS:
        raise MuslinError(
            f"{base.name}: there are no files of the kind {ending}.", choices(ending, (*FILMS, "png"))
        )
    if ending in ("mp4", "webp", "gif", "png"):
        meant = "none" if ending == "png" else ending
        if film is not None and meant not in ("none", film):
            raise MuslinError(f"{base.name} is no {film} file.", f"Leave out --to {film}, or the ending.")
        base, film = base.with_suffix(""), film or meant
    return base, None if film == "none" else film or "mp4"


def beside(base: Path, ending: str) -> Path:
    """The path `base` with an ending appended to its name."""
    return base.with_name(base.name + ending)
