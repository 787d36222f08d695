"""The compiler behind every kernel: Taichi, or Quadrants, its maintained fork.

Taichi is taken where it is installed, else Quadrants; `MUSLIN_ENGINE` chooses where both are. The rest of Muslin
says ``from muslin.base.engine import ti`` and does not know which it is; students' files say ``import taichi as ti``
and run on either.

`choice` knows the two, and imports the one; `imports` lets a student's file find it; `inside`, and `binding` and
`entering` with it, are the only places that reach into what is not public.
"""

from typing import TYPE_CHECKING, Any

from muslin.base.engine.choice import (
    ENGINES,
    VARIABLE,
    Engine,
    chosen,
    import_quietly,
    imported,
    load,
    requirement,
    version,
)
from muslin.base.engine.imports import builtins_with

__all__ = [
    "ENGINES",
    "VARIABLE",
    "Engine",
    "builtins_with",
    "chosen",
    "import_quietly",
    "imported",
    "load",
    "requirement",
    "ti",
    "version",
]

if TYPE_CHECKING:
    ti: Any


def __getattr__(name: str) -> Any:
    if name == "ti":
        return load()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
