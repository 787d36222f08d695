"""What derivatives are checked with: functions along a line, for several cases at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Array = np.ndarray

#: Cases of each task: few, and good ones, since thin triangles make every difference quotient poor.
CASES = 4


def stepped(base: Array, t: Array, d: Array) -> Array:
    """`base + t d`, (c, k, ...)."""
    grown = t.reshape(*t.shape, *[1] * (base.ndim - 1))
    return base[:, None] + grown * d[:, None]


def flat(function: Callable[..., Array], count: int, **values: tuple[Array, bool]) -> Array:
    """Call a batch function on values, (c, k, ...) if marked as moving, else (c, ...) and the same for all k."""
    flat = {}
    for name, (value, moving) in values.items():
        value = value if moving else np.repeat(value[:, None], count, axis=1)
        flat[name] = value.reshape(-1, *value.shape[2:])
    out = function(**flat)
    return out.reshape(-1, count, *out.shape[1:])


def longest(*vectors: Array) -> Array:
    """Length of the longest of several vectors, (b,)."""
    return np.max([np.linalg.norm(v, axis=-1) for v in vectors], axis=0)


def dot(a: Array, b: Array) -> Array:
    """A . b."""
    return np.asarray(np.sum(a * b, axis=-1))
