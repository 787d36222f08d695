"""A task is alone: while its function runs, it must not call that of another task.

What is really called counts, whatever it is called by: an alias, an attribute of a class. A helper of one's own never
does, also if it is named like a task; nor does what a function only mentions.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import sys
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import Any

from muslin.base.engine import entering
from muslin.reading.borrowed import Borrowed


def in_kernels(function: Callable[..., Any]) -> contextlib.AbstractContextManager[None]:
    """While a kernel around a task's function is compiled: `Borrowed` is raised inside where it calls another's."""

    def refuse(name: str) -> None:
        raise Borrowed(name)

    return entering.refusing(getattr(function, "others", {}), refuse)


@contextlib.contextmanager
def in_python(function: Callable[..., Any]) -> Iterator[None]:
    """While a task's function in plain Python runs.

    Raises
    ------
    StudentCodeError
        Where it calls another task's, also if it catches what is raised then.
    """
    found: list[Exception] = []

    def refuse(name: str) -> None:
        calls, frame = [], sys._getframe(2)
        while frame is not None and frame.f_code is not own.__code__:
            if frame.f_code.co_filename == own.__code__.co_filename and frame.f_code.co_name.isidentifier():
                calls.append((frame.f_code.co_name, frame.f_lineno))
            frame = frame.f_back  # type: ignore[assignment]
        if frame is not None:
            calls.append((own.__name__, frame.f_lineno))
        found.append(Borrowed(name).placed(own.__name__, own.__code__.co_filename, calls[:1]))
        raise found[0]

    own: Any = inspect.unwrap(function)
    others = {name: inspect.unwrap(other) for name, other in getattr(function, "others", {}).items()}
    kept: list[tuple[FunctionType, Any, Any, Any]] = []
    for name, other in others.items():
        if isinstance(other, FunctionType) and not other.__code__.co_freevars:
            kept.append((other, other.__code__, other.__defaults__, other.__kwdefaults__))
            other.__code__, other.__defaults__ = _instead.__code__, None
            other.__kwdefaults__ = {"_refuse": functools.partial(refuse, name)}
    try:
        yield
    finally:
        for changed, code, defaults, keywords in kept:
            changed.__code__, changed.__defaults__, changed.__kwdefaults__ = code, defaults, keywords
    if found:
        raise found[0]


def _instead(*_: Any, _refuse: Callable[[], None], **__: Any) -> None:
    """What another task's function does meanwhile."""
    _refuse()
