"""Numbers, vectors and matrices of many cases at once: what Taichi's operators and methods make of them.

Values are arrays with the cases in front, (b,), (b, n), (b, n, m), or plain numbers where all cases share one.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from muslin.reading import bounds
from muslin.reading.bounds import Unclear


def rank(value: Any) -> int:
    """0 of a number, 1 of a vector, 2 of a matrix."""
    return max(np.ndim(value) - 1, 0)


def form(value: Any) -> tuple[int, ...]:
    """Shape of one value, without the inputs in front."""
    if isinstance(value, (list, tuple)):
        raise Unclear
    return np.shape(value)[1:]


def whole(value: Any) -> bool:
    """Whether a value is made of integers."""
    return isinstance(value, (bool, int)) or (isinstance(value, np.ndarray) and value.dtype.kind in "ib")


def aligned(a: Any, b: Any) -> tuple[Any, Any]:
    """Two values that can be combined entry by entry."""
    m, n = rank(a), rank(b)
    if m and n and form(a) != form(b):
        raise Unclear
    if m > n and isinstance(b, np.ndarray):
        b = b.reshape(b.shape + (1,) * (m - n))
    if n > m and isinstance(a, np.ndarray):
        a = a.reshape(a.shape + (1,) * (n - m))
    return a, b


def _power(a: Any, b: Any) -> Any:
    if whole(a) and whole(b):
        return np.power(np.asarray(a, dtype=np.float64), b).astype(np.int64)
    return np.power(np.asarray(a, dtype=np.float64), b)


def _product(a: Any, b: Any) -> Any:
    if rank(a) == 2 and rank(b) == 2:
        return checked(np.matmul, a, b)
    if rank(a) == 2 and rank(b) == 1:
        return checked(lambda p, q: np.matmul(p, q[..., None])[..., 0], a, b)
    if rank(a) == 1 and rank(b) == 2:
        return checked(lambda p, q: np.matmul(p[:, None, :], q)[:, 0], a, b)
    raise Unclear


def checked(function: Callable[..., Any], *values: Any) -> Any:
    """A call whose arguments may not fit."""
    try:
        return function(*values)
    except (ValueError, IndexError, TypeError):
        raise Unclear from None


_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.true_divide,
    ast.FloorDiv: np.floor_divide,
    ast.Mod: np.mod,
    ast.Pow: _power,
}
COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


def combined(op: ast.operator, a: Any, b: Any) -> Any:
    """Two values under an operator."""
    if isinstance(a, (list, tuple)) or isinstance(b, (list, tuple)):
        raise Unclear
    if isinstance(op, ast.MatMult):
        return _product(a, b)
    if type(op) not in _BINARY:
        raise Unclear
    made = _BINARY[type(op)](*aligned(a, b))
    return bounds.shared(made) if isinstance(made, int) else made


def vector(value: Any) -> np.ndarray:
    """The value, if it is a vector."""
    if rank(value) != 1:
        raise Unclear
    return value


def _matrix(value: Any) -> np.ndarray:
    if rank(value) != 2:
        raise Unclear
    return value


def _dot(a: Any, b: Any) -> Any:
    a, b = aligned(vector(a), vector(b))
    return (a * b).sum(axis=1)


def _cross(a: Any, b: Any) -> Any:
    if form(a) != (3,) or form(b) != (3,):
        raise Unclear
    x, y, z = a.T
    u, v, w = b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def _outer(a: Any, b: Any) -> Any:
    return vector(a)[:, :, None] * vector(b)[:, None, :]


def _squares(a: Any) -> Any:
    if not rank(a):
        raise Unclear
    return (a * a).reshape(len(a), -1).sum(axis=1)


def _norm(a: Any, eps: Any = 0) -> Any:
    return np.sqrt(_squares(a) + eps)


def _unit(a: Any, eps: Any = 0) -> Any:
    return np.true_divide(*aligned(vector(a), _norm(a) + eps))


def _determinant(a: Any) -> Any:
    if form(a) == (2, 2):
        return a[:, 0, 0] * a[:, 1, 1] - a[:, 0, 1] * a[:, 1, 0]
    if form(a) == (3, 3):
        return _dot(a[:, 0], _cross(a[:, 1], a[:, 2]))
    raise Unclear


def _inverse(a: Any) -> Any:
    """As Taichi does it: the adjugate over the determinant."""
    det = _determinant(a)
    if form(a) == (2, 2):
        rows = [[a[:, 1, 1], -a[:, 0, 1]], [-a[:, 1, 0], a[:, 0, 0]]]
        adjugate = np.stack([np.stack(row, axis=1) for row in rows], axis=1)
    else:
        columns = [_cross(a[:, 1], a[:, 2]), _cross(a[:, 2], a[:, 0]), _cross(a[:, 0], a[:, 1])]
        adjugate = np.stack(columns, axis=2)
    return adjugate / np.asarray(det)[:, None, None]


def _all(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda a: function(a.reshape(len(a), -1), axis=1)


METHODS: Mapping[str, Callable[..., Any]] = {
    "dot": _dot,
    "cross": _cross,
    "outer_product": _outer,
    "norm": _norm,
    "norm_sqr": _squares,
    "normalized": _unit,
    "transpose": lambda a: _matrix(a).swapaxes(1, 2),
    "inverse": _inverse,
    "determinant": _determinant,
    "trace": lambda a: np.trace(_matrix(a), axis1=1, axis2=2),
    "sum": _all(np.sum),
    "max": _all(np.max),
    "min": _all(np.min),
}

ELEMENTWISE: Mapping[str, Callable[[Any], Any]] = {
    "abs": np.abs,
    "sqrt": np.sqrt,
    "rsqrt": lambda a: 1 / np.sqrt(a),
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "tanh", "floor", "ceil")},
    "asin": np.arcsin,
    "acos": np.arccos,
}


def cast(value: Any, whole: bool) -> Any:
    """A value made integer, or made float."""
    if not whole:
        return np.asarray(value, dtype=np.float64) if isinstance(value, np.ndarray) else float(value)
    with np.errstate(all="ignore"):
        return value.astype(np.int64) if isinstance(value, np.ndarray) else bounds.shared(int(value))


def chosen(holds: np.ndarray, yes: Any, no: Any) -> Any:
    """Case by case one of two values; of the type of the second, which was there before."""
    if isinstance(yes, (list, tuple)) or isinstance(no, (list, tuple)):
        raise Unclear
    deep = max(rank(yes), rank(no))
    if rank(yes) and rank(no) and form(yes) != form(no):
        raise Unclear
    return np.where(holds.reshape(holds.shape + (1,) * deep), *aligned(yes, no))
