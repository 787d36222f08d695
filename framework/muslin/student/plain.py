"""A student's function run line by line in plain Python, to see its variables.

Taichi compiles a function whole, so nobody can look inside. But the text is Python too: with vectors and
matrices that are NumPy arrays with Taichi's methods, it runs, and Python tells every line. What differs is the
one thing worth knowing: Python's variables change their type, Taichi's do not.
"""

from __future__ import annotations

import builtins
import math
import operator
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

import numpy as np

from muslin.base import engine, paths
from muslin.reading import source, syntax

#: Values kept of one function's variables: loops may set many.
MOST = 3000


class Array(np.ndarray):
    """An array with the methods of Taichi's vectors and matrices."""

    def cross(self, other: Any) -> Any:
        """Cross product."""
        return matrix(np.cross(self, other))

    def dot(self, other: Any) -> Any:  # type: ignore[override]
        """Scalar product."""
        return float(np.asarray(self) @ np.asarray(other))

    def outer_product(self, other: Any) -> Any:
        """Product a b^T."""
        return matrix(np.outer(self, other))

    def norm(self, eps: float = 0.0) -> float:
        """Length."""
        return math.sqrt(self.norm_sqr() + eps)

    def norm_sqr(self) -> float:
        """Squared length."""
        return float(np.sum(np.asarray(self) ** 2))

    def normalized(self, eps: float = 0.0) -> Any:
        """Unit vector."""
        return self / np.float64(self.norm() + eps)

    def inverse(self) -> Any:
        """Inverse."""
        return matrix(np.linalg.inv(self))

    def determinant(self) -> float:
        """Determinant."""
        return float(np.linalg.det(self))

    def sum(self, *_: Any, **__: Any) -> Any:
        """Sum of all entries."""
        return np.asarray(self).sum()


for _k, _name in enumerate("xyzw"):
    setattr(Array, _name, property(operator.itemgetter(_k)))


def matrix(values: Any, *_: Any) -> Any:
    """An array of its own, as `ti.Vector` and `ti.Matrix` make one."""
    return np.array(values).view(Array)


class _Maker:
    """`ti.Vector` and `ti.Matrix`: called with numbers, or by one of their ways to make an array."""

    def __call__(self, values: Any, *_: Any, **__: Any) -> Any:
        return matrix(values)

    rows = staticmethod(lambda rows: matrix(rows))
    cols = staticmethod(lambda columns: matrix(np.array(columns).T))
    identity = staticmethod(lambda kind, n: matrix(np.eye(n)))
    zero = staticmethod(lambda kind, *shape: matrix(np.zeros(shape)))
    one = staticmethod(lambda kind, *shape: matrix(np.ones(shape)))
    unit = staticmethod(lambda n, i, kind=None: matrix(np.eye(n)[i]))
    diag = staticmethod(lambda dim, val: matrix(val * np.eye(dim)))


def _taichi() -> ModuleType:
    """What a student's file finds under the name `taichi` while it is looked at."""
    ti = ModuleType("taichi")
    names: dict[str, Any] = {
        name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "tanh", "floor")
    }
    names |= {
        "asin": np.arcsin,
        "acos": np.arccos,
        "atan2": np.arctan2,
        "sqrt": np.sqrt,
        "pow": pow,
        "ceil": np.ceil,
    }
    names |= {"abs": abs, "min": min, "max": max, "round": round, "rsqrt": lambda x: 1 / np.sqrt(x)}
    names |= {"f32": float, "f64": float, "i32": int, "i64": int, "u8": int, "pi": math.pi}
    names |= {"func": lambda f: f, "pyfunc": lambda f: f, "static": lambda *a: a[0] if len(a) == 1 else a}
    names |= {
        "cast": lambda value, kind: kind(value),
        "select": lambda c, a, b: a if c else b,
        "ndrange": _ndrange,
    }
    names |= {"Vector": _Maker(), "Matrix": _Maker(), "math": math}
    ti.__dict__.update(names)
    return ti


def _ndrange(*sizes: int) -> Iterator[Any]:
    return iter(np.ndindex(*sizes))


@contextmanager
def looked_at() -> Iterator[dict[str, Any]]:
    """Modules as a file should find them, Taichi and the given code in plain Python; and their names."""
    from muslin import given

    saved = {name: sys.modules.get(name) for name in ("taichi", "muslin.given")}
    import muslin

    sys.modules["taichi"] = engine.ti = _taichi()
    try:
        plain_given = ModuleType("muslin.given")
        text = Path(str(given.__file__)).read_text(encoding="utf-8")
        exec(compile(text, str(given.__file__), "exec"), plain_given.__dict__)
        sys.modules["muslin.given"] = plain_given
        muslin.given = plain_given
        yield {"ti": sys.modules["taichi"], "diag": plain_given.__dict__.get("diag")}
    finally:
        del engine.ti
        muslin.given = given
        for name, module in saved.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module


def values(
    path: Path, name: str, arguments: dict[str, Any], taichi: bool = True
) -> tuple[Any, list[tuple[int, str, Any]]]:
    """Result and variables of a function for one case.

    Parameters
    ----------
    path : Path
        The student's file.
    name : str
        The function.
    arguments : dict
        Numbers and arrays by name; functions, too, of one written in plain Python.
    taichi : bool
        Whether it is written for Taichi, so that arrays need the methods of Taichi's.

    Returns
    -------
    result
        What it returns.
    list of (line, variable, value)
        Every variable each time it got a value, in order; at most `MOST`.
    """
    code = syntax.compiled(source.read(path), str(path), paths.shown(path))
    module = ModuleType("muslin_plain")
    given = {key: own(value) for key, value in arguments.items()} if taichi else dict(arguments)
    with looked_at():
        exec(code, module.__dict__)
        function = getattr(module, name)
        return _traced(function, given)


def own(value: Any) -> Any:
    """A number, or an array of Taichi's kind."""
    if np.ndim(value):
        return matrix(value)
    return int(value) if np.asarray(value).dtype.kind == "i" else float(value)


def _traced(
    function: Callable[..., Any], arguments: dict[str, Any]
) -> tuple[Any, list[tuple[int, str, Any]]]:
    found: list[tuple[int, str, Any]] = []
    known = {key: np.array(value) for key, value in arguments.items() if not callable(value)}
    line = [function.__code__.co_firstlineno]

    def look(frame: FrameType, event: str, _: Any) -> Any:
        if frame.f_code is not function.__code__:
            return None
        for name, value in frame.f_locals.items():
            if not isinstance(value, (int, float, np.ndarray, np.generic)):
                continue
            if name not in known or not _same(known[name], value):
                known[name] = np.array(value)
                if len(found) < MOST:
                    found.append((line[0], name, known[name]))
        line[0] = frame.f_lineno
        return look

    before = sys.gettrace()
    sys.settrace(look)
    try:
        result = function(**arguments)
    finally:
        sys.settrace(before)
    return result, found


def _same(a: Any, b: Any) -> bool:
    return np.shape(a) == np.shape(b) and builtins.bool(np.array_equal(a, b, equal_nan=True))
