"""Exact numbers: what the right answers of a task are computed with, independently of any solution.

Everything here is computed with mpmath to about 110 digits, of which at least 45 survive. Derivatives are
central differences with a step of 1e-30: the truncation error is then about 1e-60 of the result and rounding
costs 1e-50, so nothing is ever differentiated by hand. A vector is a list and a matrix a list of rows.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError

#: Decimal digits carried.
DIGITS = 110

#: Results below this are rounding of an exact zero; nothing Muslin measures is so small.
NOTHING = 1e-45

Vector = list[Any]
Matrix = list[list[Any]]


@functools.cache
def precise() -> Any:
    """Our own mpmath context with `DIGITS` digits; the user's global one is left alone.

    Raises
    ------
    MuslinError
        If mpmath is not installed.
    """
    try:
        import mpmath
    except ImportError:
        raise MuslinError(
            "The truth behind reference data is computed with mpmath, which is not installed.",
            "Install it with: pip install mpmath",
        ) from None
    context = mpmath.mp.clone()
    context.dps = DIGITS
    return context


def exact(values: Any) -> Any:
    """Numbers, arrays or nested lists of them, taken over without rounding (as lists of mpf)."""
    if isinstance(values, (np.ndarray, np.generic)):
        values = values.tolist()
    if isinstance(values, (list, tuple)):
        return [exact(value) for value in values]
    return precise().mpf(values)


def rounded(values: Any) -> np.ndarray:
    """Nearest float64 of each number; noise around an exact zero becomes that zero."""
    array = np.array(values, dtype=object)
    flat = [0.0 if abs(value) <= NOTHING else float(value) for value in array.ravel()]
    return np.array(flat, dtype=np.float64).reshape(array.shape)


def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return [p + q for p, q in zip(a, b, strict=True)]


def sub(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return [p - q for p, q in zip(a, b, strict=True)]


def times(c: Any, a: Vector) -> Vector:
    """Vector times a number."""
    return [c * p for p in a]


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product."""
    return sum((p * q for p, q in zip(a, b, strict=True)), start=precise().zero)


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a: Vector) -> Any:
    """Euclidean length."""
    return precise().sqrt(dot(a, a))


def transpose(A: Matrix) -> Matrix:
    """Rows become columns."""
    return [list(column) for column in zip(*A, strict=True)]


def matmul(A: Matrix, B: Matrix) -> Matrix:
    """Product of two matrices."""
    columns = transpose(B)
    return [[dot(row, column) for column in columns] for row in A]


def apply(A: Matrix, a: Vector) -> Vector:
    """Matrix times a vector."""
    return [dot(row, a) for row in A]


def diagonal(a: Vector) -> Matrix:
    """Diagonal matrix."""
    zero = precise().zero
    return [[value if k == m else zero for m in range(len(a))] for k, value in enumerate(a)]


def unit_normal(x0: Vector, x1: Vector, x2: Vector) -> Vector:
    """Normal of length one of a triangle, counterclockwise side."""
    m = cross(sub(x1, x0), sub(x2, x0))
    return times(1 / norm(m), m)


def rotation(U: Matrix) -> Matrix:
    """Orthogonal matrix nearest to one that is so up to rounding: Newton's method for the polar factor."""
    half = precise().mpf(0.5)
    for _ in range(4):
        a, b, c = U
        cofactors = [cross(b, c), cross(c, a), cross(a, b)]
        det = dot(a, cofactors[0])
        U = [
            [half * (p + q / det) for p, q in zip(*rows, strict=True)]
            for rows in zip(U, cofactors, strict=True)
        ]
    return U


def _moved(x: Vector, *moves: tuple[int, Any]) -> Vector:
    x = list(x)
    for k, step in moves:
        x[k] += step
    return x


def derivative(f: Callable[[Vector], Any], x: Vector, k: int) -> Any:
    """Derivative of a number or a vector f(x) in component k of x."""
    step = precise().mpf("1e-30")
    plus, minus = f(_moved(x, (k, step))), f(_moved(x, (k, -step)))
    if isinstance(plus, list):
        return [(p - m) / (2 * step) for p, m in zip(plus, minus, strict=True)]
    return (plus - minus) / (2 * step)


def gradient(f: Callable[[Vector], Any], x: Vector) -> Vector:
    """Derivatives of a number f(x) in all components of x."""
    return [derivative(f, x, k) for k in range(len(x))]


def second(f: Callable[[Vector], Any], x: Vector, k: int, m: int) -> Any:
    """Second derivative of a number f(x) in the components k and m."""
    step = precise().mpf("1e-30")
    if k == m:
        return (f(_moved(x, (k, step))) - 2 * f(x) + f(_moved(x, (k, -step)))) / step**2
    corners = ((a, b, f(_moved(x, (k, a * step), (m, b * step)))) for a in (1, -1) for b in (1, -1))
    return sum(a * b * value for a, b, value in corners) / (4 * step**2)


def hessian(f: Callable[[Vector], Any], x: Vector) -> Matrix:
    """Second derivatives of a number f(x)."""
    H = [[precise().zero] * len(x) for _ in x]
    for k in range(len(x)):
        for m in range(k, len(x)):
            H[k][m] = H[m][k] = second(f, x, k, m)
    return H


def answers(function: Callable[..., Any], inputs: Mapping[str, np.ndarray]) -> tuple[np.ndarray, ...]:
    """The right answers of a task for a batch of inputs, rounded to float64.

    Parameters
    ----------
    function : callable
        What is true, on exact numbers.
    inputs : dict of ndarray, (b, ...)
        The task's inputs by name.

    Returns
    -------
    tuple of ndarray, (b, ...)
        One array per result of the task; an integer result as int32.

    Raises
    ------
    MuslinError
        If mpmath is not installed.
    """
    columns = []
    for sample in range(len(next(iter(inputs.values())))):
        found = function(**{name: exact(array[sample]) for name, array in inputs.items()})
        columns.append(found if isinstance(found, tuple) else (found,))
    return tuple(
        np.array(column, dtype=np.int32)
        if all(isinstance(value, int) for value in column)
        else rounded(list(column))
        for column in zip(*columns, strict=True)
    )
