"""Where what is known of tasks is written: the files of an assignment, found by its name.

What students must not read (how cases are drawn, what is true, what mistakes make of it) lies in the assignment's
folder `judge/`; what they may read (what must hold for every input, what lies on the way, which derivative can be
checked) in `practice/`, which their installation carries. In both, and in an instructor's one file `reference.py`, a
name says what it is: `draw_x`, `truth_x`, `terms_x`, `properties_x`, and so on, for a task `x`.
"""

from __future__ import annotations

import functools
import importlib
import sys
import threading
from pathlib import Path
from types import ModuleType
from typing import Any

from muslin.base import paths
from muslin.tasks.authored import imported


def known(assignment: str, name: str) -> Any:
    """What an assignment's own files call by a name; None if none does.

    Raises
    ------
    AuthorError
        If one of the files cannot be run.
    """
    return said(modules(assignment), name)[1]


def secret(assignment: str, name: str) -> bool:
    """Whether an assignment says something by a name, and where students do not get it."""
    file, found = said(modules(assignment), name)
    return found is not None and file not in {
        str(path) for part, path in paths.knowledge(assignment) if part == "practice"
    }


def said(files: tuple[ModuleType, ...], name: str) -> tuple[str, Any]:
    """The file that says something last, and what it says; nothing if none does."""
    for file in reversed(files):
        if (found := getattr(file, name, None)) is not None:
            return str(file.__file__), found
    return "", None


def modules(assignment: str) -> tuple[ModuleType, ...]:
    """The modules of an assignment's `practice/`, `judge/` and `reference.py`, as far as they are here.

    Raises
    ------
    AuthorError
        If one cannot be run.
    """
    sources = paths.knowledge(assignment)
    with _importing:  # the grader asks from several threads
        return _modules(
            paths.bare(assignment), tuple((part, path, path.stat().st_mtime_ns) for part, path in sources)
        )


_importing = threading.RLock()


@functools.lru_cache(maxsize=16)
def _modules(assignment: str, sources: tuple[tuple[str, Path, int], ...]) -> tuple[ModuleType, ...]:
    """Import files; those of one part as the package it is, so that they may import each other."""
    packages = {part: f"muslin_{part}_{assignment.replace('-', '_')}" for part, _, _ in sources}
    folders = {part: path.parent for part, path, _ in sources}
    for part, package in packages.items():
        for old in [key for key in sys.modules if key.partition(".")[0] == package]:
            del sys.modules[old]
        sys.modules[package] = ModuleType(package)
        sys.modules[package].__path__ = [str(folders[part])]
    return tuple(_imported(f"{packages[part]}.{path.stem}", path) for part, path, _ in sources)


def _imported(name: str, path: Path) -> ModuleType:
    try:
        return importlib.import_module(name)
    except Exception as error:
        raise imported(error, path) from None
