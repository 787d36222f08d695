"""Modules that have moved: they are found under their old names, which say where they are now."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

#: Old names in `muslin`, and where what they name is now.
MOVED = {
    "batch": "tasks.batch",
    "body": "physics.body",
    "cloth": "physics.cloth",
    "colliders": "physics.colliders",
    "elements": "physics.elements",
    "engine": "base.engine",
    "errors": "base.errors",
    "film": "present.film",
    "integrators": "simulation.integrators",
    "material": "physics.material",
    "model": "simulation.model",
    "paths": "base.paths",
    "reference": "judging.reference",
    "runs": "simulation.runs",
    "runtime": "base.runtime",
    "scenes": "simulation.scenes",
    "show": "present.pictures",
    "skinning": "physics.skinning",
    "solvers": "solve.solvers",
}


def home(name: str) -> str | None:
    """Where a module of an old name is now; None for one that has not moved."""
    package, _, rest = name.partition(".")
    old, _, below = rest.partition(".")
    if package != "muslin" or old not in MOVED:
        return None
    return ".".join(filter(None, (package, MOVED[old], below)))


class _Finder(MetaPathFinder, Loader):
    """Makes of an old name a module that hands on what the new one has."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(fullname, self, is_package=True) if home(fullname) else None

    def exec_module(self, module: ModuleType) -> None:
        now = str(home(module.__name__))
        warnings.warn(f"{module.__name__} is now {now}.", DeprecationWarning, stacklevel=2)
        new = import_module(now)

        def of_new(name: str) -> Any:
            return getattr(new, name)

        module.__dict__.update(__doc__=f"Moved: `{now}`.", __getattr__=of_new, __all__=_public(new))


def _public(module: ModuleType) -> list[str]:
    return list(
        getattr(module, "__all__", None) or [name for name in vars(module) if not name.startswith("_")]
    )


def watch() -> None:
    """Find moved modules from now on."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())
