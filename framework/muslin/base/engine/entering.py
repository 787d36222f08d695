"""Functions that a kernel must not enter while it is compiled, told by what they are and not by how they are called."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from muslin.base.engine import inside
from muslin.base.engine.choice import load


@contextlib.contextmanager
def refusing(functions: Mapping[str, Callable[..., Any]], refuse: Callable[[str], None]) -> Iterator[None]:
    """Have `refuse` called, which may raise, before one of these functions is entered.

    Parameters
    ----------
    functions : dict of taichi functions
        By whatever name `refuse` is to be told.
    refuse : callable
    """
    if not functions or not inside.has("seeing what a kernel enters"):
        yield
        return
    refused = {_code(function): name for name, function in functions.items()}
    kind = inside.own_module("lang.kernel_impl" if load().__name__ == "taichi" else "lang.func").Func
    original = kind.__call__

    def enter(self: Any, *args: Any, **kwargs: Any) -> Any:
        code = _code(self.func)
        if code is not None and code in refused:
            refuse(refused[code])
        return original(self, *args, **kwargs)

    kind.__call__ = enter
    try:
        yield
    finally:
        kind.__call__ = original


def _code(function: Any) -> Any:
    return getattr(inspect.unwrap(function), "__code__", None)
