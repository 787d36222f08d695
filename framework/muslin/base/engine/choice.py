"""Which engine it is, what each needs, and how it is imported: quietly, or with a sentence that says what to do."""

from __future__ import annotations

import contextlib
import functools
import importlib
import importlib.util
import inspect
import linecache
import os
import platform
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from muslin.base.errors import MuslinError

#: The environment variable that chooses.
VARIABLE = "MUSLIN_ENGINE"


@dataclass(frozen=True)
class Engine:
    """One of the compilers Muslin runs on.

    Parameters
    ----------
    name : str
        Of its package, for pip and for `import`.
    title : str
        As people call it.
    prefix : str
        What its environment variables begin with.
    requirements : tuple of (first Python, first Python too new, requirement)
        What pip should install, by Python.
    machines : frozenset of (system, processor)
        Where it has wheels, as `platform.system()` and `platform.machine()` say.
    kernels : str
        Folder of its compiled kernels, below its own in the user's cache.
    only_here : dict
        Arguments of `init` that the other does not know.
    """

    name: str
    title: str
    prefix: str
    requirements: tuple[tuple[tuple[int, int], tuple[int, int], str], ...]
    machines: frozenset[tuple[str, str]]
    kernels: str
    only_here: tuple[tuple[str, object], ...] = ()

    @property
    def installed(self) -> bool:
        """Whether its package is there; it may still not work."""
        return importlib.util.find_spec(self.name) is not None

    def variable(self, name: str) -> str:
        """Name of one of its environment variables."""
        return f"{self.prefix}_{name}"


_ANYWHERE = {("Linux", "x86_64"), ("Darwin", "arm64"), ("Windows", "AMD64")}

#: The engines, the one that is preferred first. pyproject.toml says the same in its own words; a test compares.
ENGINES = {
    "taichi": Engine(
        "taichi",
        "Taichi",
        "TI",
        (((3, 10), (3, 14), "taichi>=1.7.4,<1.8"),),
        frozenset(_ANYWHERE),
        "ticache",
        (("verbose", False),),
    ),
    "quadrants": Engine(
        "quadrants",
        "Quadrants",
        "QD",
        (((3, 10), (3, 12), "quadrants>=1.3.3,<1.4"), ((3, 12), (3, 15), "quadrants>=1.4,<1.5")),
        frozenset(_ANYWHERE | {("Linux", "aarch64")}),
        "qdcache",
    ),
}

LIBX11 = "Install it, on Debian or Ubuntu with: apt-get install -y libx11-6"


def chosen() -> Engine:
    """The engine of this process, without importing it.

    Raises
    ------
    MuslinError
        If `MUSLIN_ENGINE` names none or one that is not installed, or none is installed.
    """
    name = os.environ.get(VARIABLE, "").strip().lower()
    if not name:
        for engine in ENGINES.values():
            if engine.installed:
                return engine
        raise MuslinError(f"Neither {_titles(' nor ')} is installed.", _install())
    if name not in ENGINES:
        here = [engine.name for engine in ENGINES.values() if engine.installed]
        advice = f"Installed here: {', '.join(here)}." if here else _install()
        raise MuslinError(f"There is no engine {name!r} ({VARIABLE}): it is {' or '.join(ENGINES)}.", advice)
    engine = ENGINES[name]
    if not engine.installed:
        raise MuslinError(f"{VARIABLE} is {name}, but {engine.title} is not installed.", _install(engine))
    return engine


def kernels_below_a_cache() -> tuple[str, str]:
    """Where the engine of this process keeps its kernels, below the user's cache."""
    try:
        engine = chosen()
    except MuslinError:  # whoever needs one is told
        engine = next(iter(ENGINES.values()))
    return engine.name, engine.kernels


def version() -> str:
    """The version of the engine of this process, without importing it."""
    from importlib import metadata

    return metadata.version(chosen().name)


def imported() -> bool:
    """Whether this process has imported an engine."""
    return any(name in sys.modules for name in ENGINES)


def load() -> ModuleType:
    """Import the engine of this process, without its banner, or say exactly what is missing.

    Raises
    ------
    MuslinError
        If none is chosen, installed or whole.
    """
    return _imported(chosen())


@functools.cache
def _imported(engine: Engine) -> ModuleType:
    try:
        return import_quietly(engine)
    except ImportError as error:
        told, advice = _broken(engine, error)
    for other in ENGINES.values():
        if other is engine or not other.installed:
            continue
        try:
            import_quietly(other)
        except ImportError as error:
            also, more = _broken(other, error)
            raise MuslinError(f"{told} {also}", f"{advice}\n{more}") from None
        advice += f"\nOr use {other.title}, which is installed too: set {VARIABLE}={other.name}"
    raise MuslinError(told, advice) from None


def import_quietly(engine: Engine) -> ModuleType:
    """Import an engine without its banner, its word on the notebook it runs in, and Python's on the engine's texts."""
    with quiet(engine), _frames_seen_fast(), warnings.catch_warnings():
        # said where it is compiled first, after an installation that does not: of no use to who imports it
        for kind in (SyntaxWarning, DeprecationWarning):
            warnings.filterwarnings("ignore", "invalid escape sequence", kind)
        return importlib.import_module(engine.name)


def frame_info(frame: Any, context: int = 1) -> inspect.Traceback:
    """What `inspect.getframeinfo` says of a frame, with its one line.

    The engine asks for it whenever a function is decorated. The library goes through all modules for an answer: half
    of the time that importing an engine takes.
    """
    name, number = frame.f_code.co_filename, frame.f_lineno
    line = linecache.getline(name, number, frame.f_globals)
    return inspect.Traceback(name, number, frame.f_code.co_name, [line] if line else None, 0)


@contextlib.contextmanager
def _frames_seen_fast() -> Iterator[None]:
    """While an engine, which decorates a hundred functions of its own, is imported."""
    before = inspect.getframeinfo
    inspect.getframeinfo = frame_info
    try:
        yield
    finally:
        inspect.getframeinfo = before


@contextlib.contextmanager
def quiet(engine: Engine) -> Iterator[None]:
    """Silence what an engine says while it is imported."""
    variables = {f"ENABLE_{engine.name.upper()}_HEADER_PRINT": "0", engine.variable("LOG_LEVEL"): "error"}
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update({name: before[name] or value for name, value in variables.items()})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _broken(engine: Engine, error: ImportError) -> tuple[str, str]:
    """What is wrong with an engine that cannot be imported, and what to do."""
    if "libX11" in str(error):
        return f"{engine.title} cannot start because the system library libX11.so.6 is missing.", LIBX11
    again = requirement(engine)
    return (
        f"{engine.title} cannot be imported ({' '.join(str(error).split())}).",
        f"Install it again: pip install --force-reinstall --no-deps '{again}'" if again else _install(engine),
    )


def requirement(engine: Engine) -> str:
    """What pip should install of an engine on this machine; empty where it has no wheel."""
    if (platform.system(), platform.machine()) not in engine.machines:
        return ""
    here = sys.version_info[:2]
    return next((what for first, end, what in engine.requirements if first <= here < end), "")


def _install(engine: Engine | None = None) -> str:
    """What to install here: this engine, or the first that has a wheel."""
    here = "Python {}.{} on {} {}".format(*sys.version_info[:2], platform.system(), platform.machine())
    for candidate in [engine] if engine else ENGINES.values():
        if wanted := requirement(candidate):
            return f"Run: pip install '{wanted}'"
    if engine is not None:
        others = [other.name for other in ENGINES.values() if other is not engine and requirement(other)]
        if others:
            return f"It has no wheel for {here}: unset {VARIABLE}, or set it to {others[0]}."
    pythons = sorted(
        python
        for known in ENGINES.values()
        for first, end, _ in known.requirements
        for python in (first, end)
    )
    first, last = pythons[0], (pythons[-1][0], pythons[-1][1] - 1)
    return (
        f"Neither has a wheel for {here}: use Python {first[0]}.{first[1]}-{last[0]}.{last[1]} on Linux x86-64 or "
        "aarch64, macOS arm64 or Windows."
    )


def _titles(joint: str) -> str:
    return joint.join(engine.title for engine in ENGINES.values())
