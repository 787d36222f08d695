"""Students' files say `import taichi as ti`, whichever engine runs them.

A module's own ``__builtins__`` hold the function that its import statements call, those inside its functions
included. So a file can be given one that knows another name for a module, and nothing outside it sees that name.
"""

from __future__ import annotations

import builtins
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

from muslin.base.engine.choice import load

#: The name students' files know the engine by.
NAME = "taichi"


def builtins_with(modules: Mapping[str, ModuleType] | None = None) -> dict[str, Any] | ModuleType:
    """What to set as ``__builtins__`` of a module so that it finds other modules under these names.

    Parameters
    ----------
    modules : mapping of str to module, optional
        By default the engine of this process, as `taichi`.

    Returns
    -------
    dict or module
        Python's own where nothing has another name than it has anyway.
    """
    if modules is None:
        engine = load()
        if engine.__name__ == NAME:
            return builtins
        modules = {NAME: engine}
    known = dict(modules)

    def import_(
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        whole, _, rest = name.partition(".")
        if level == 0 and whole in known:
            module = found = known[whole]
            for part in rest.split(".") if rest else ():
                try:
                    found = getattr(found, part)
                except AttributeError:
                    raise ModuleNotFoundError(f"No module named {name!r}", name=name) from None
            return found if fromlist else module
        return builtins.__import__(name, globals, locals, fromlist or (), level)

    return {**vars(builtins), "__import__": import_}
