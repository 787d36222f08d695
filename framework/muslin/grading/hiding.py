"""What a worker may see: the system's libraries, Python and Muslin, but nothing that holds answers."""

from __future__ import annotations

import importlib.util
import site
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from muslin.base import engine, paths


def libraries() -> list[str]:
    """Folders the packages that workers import lie in."""
    found = (importlib.util.find_spec(name) for name in ("numpy", "scipy", engine.chosen().name, "tomli"))
    origins = {Path(spec.origin).resolve().parent.parent for spec in found if spec and spec.origin}
    return sorted(map(str, origins))


def view(package: Path, libraries: Sequence[str]) -> list[str]:
    """What a worker needs to see: the system's libraries, this Python, this package."""
    system = ("/usr", "/lib", "/lib64", "/bin", "/etc/ld.so.cache", "/etc/ld.so.conf", "/etc/ld.so.conf.d")
    return sorted({*system, sys.prefix, sys.base_prefix, str(package), *libraries})


def hideable(secret: Path, view: Sequence[Path]) -> Iterator[Path]:
    """What there is to hide of a folder: not Python or Muslin, should they lie in it."""
    real = [path.resolve() for path in view]
    if secret in real:
        return
    if not any(path.is_relative_to(secret) for path in real):
        yield secret
        return
    for part in sorted(secret.iterdir()):
        if any(part.is_relative_to(path) or path.is_relative_to(part) for path in real):
            yield from hideable(part, view)


def answers(package: Path) -> list[Path]:
    """Where answers can be read off or computed: what assignments say of themselves, and the code that makes data."""
    return [*paths.secrets(), package / "authoring", package / "judging", *_copies(package)]


def _copies(package: Path) -> list[Path]:
    """What lies of Muslin where Python looks for libraries, beside the package that runs.

    Of an editable installation that is a copy of all that a wheel ships: the public data, what is known of tasks.
    """
    places = {*libraries(), *sys.path, *site.getsitepackages([sys.prefix, sys.base_prefix])}
    found = {(Path(place) / package.name).resolve() for place in places if place}
    return sorted(path for path in found if path.is_dir() and path != package.resolve())
