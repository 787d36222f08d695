"""What a function in plain Python may call and compute with, so that `muslin.reading.stepping` can work it out."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from muslin.reading.bounds import ENTRIES, Unclear

OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.MatMult: operator.matmul, ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Is: operator.is_, ast.IsNot: operator.is_not,
    ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_,
}  # fmt: skip

#: Operations that change an array in place.
IN_PLACE: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.iadd, ast.Sub: operator.isub, ast.Mult: operator.imul, ast.Div: operator.itruediv,
}  # fmt: skip


def _few(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that makes arrays of a size it is told, of small ones only."""

    def made(*arguments: Any, **others: Any) -> Any:
        sizes = [abs(n) for a in arguments for n in np.ravel(np.asarray(a, dtype=np.float64))]
        if others.keys() - {"dtype"} or not math.prod(max(n, 1.0) for n in sizes) <= ENTRIES**2:
            raise Unclear
        return function(*arguments, **others)

    return made


def _like(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that makes an array of another one's shape, and of no other."""
    return lambda of, dtype=None: function(of, dtype=dtype)


def _arange(*arguments: Any) -> np.ndarray:
    start, stop, step = (0.0, *arguments, 1.0) if len(arguments) == 1 else (*arguments, 1.0)[:3]
    if not step or not abs(stop - start) <= ENTRIES * abs(step):
        raise Unclear
    return np.arange(*arguments)


#: Functions of NumPy, and of Python; methods of arrays.
NUMPY: Mapping[str, Callable[..., Any]] = {
    "sqrt": np.sqrt, "abs": np.abs, "dot": np.dot, "inner": np.inner, "sum": np.sum, "max": np.max, "min": np.min,
    "isfinite": np.isfinite, "isinf": np.isinf, "isnan": np.isnan, "array": np.array, "copy": np.copy,
    "asarray": np.asarray, "zeros_like": _like(np.zeros_like), "exp": np.exp, "log": np.log,
    "all": np.all, "any": np.any,
    "norm": np.linalg.norm, "solve": np.linalg.solve, "inv": np.linalg.inv, "float64": np.float64,
    "amax": np.max, "amin": np.min, "absolute": np.abs, "fabs": np.abs, "square": np.square, "power": np.power,
    "vdot": np.vdot, "matmul": np.matmul, "maximum": np.maximum, "minimum": np.minimum, "mean": np.mean,
    "negative": np.negative, "where": np.where, "array_equal": np.array_equal, "hypot": np.hypot,
    "asfarray": np.asarray, "ones_like": _like(np.ones_like), "zeros": _few(np.zeros), "ones": _few(np.ones),
    "eye": _few(np.eye), "identity": _few(np.eye), "arange": _arange, "argmin": np.argmin, "argmax": np.argmax,
    "less_equal": np.less_equal, "multiply": np.multiply, "subtract": np.subtract, "add": np.add,
    "nan_to_num": np.nan_to_num, "isclose": np.isclose, "allclose": np.allclose,
}  # fmt: skip
PYTHON: Mapping[str, Callable[..., Any]] = {
    "abs": abs, "max": max, "min": min, "float": float, "len": len, "sum": sum, "int": int, "range": range,
    "bool": bool, "enumerate": enumerate, "reversed": reversed, "zip": zip, "all": all, "any": any,
    "isinstance": isinstance, "round": round,
}  # fmt: skip
METHODS = ("copy", "dot", "max", "min", "sum", "transpose", "mean", "item", "all", "any", "flatten", "ravel")
CONSTANTS = {"inf": np.inf, "nan": np.nan, "pi": np.pi, "float64": np.float64}
TYPES = {"float": float, "int": int, "bool": bool}
