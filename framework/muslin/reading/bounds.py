"""How much whoever reads a text takes upon themselves: asked of every value before it is made.

A text may hold a loop of ten million millions, a power of a power, a tuple of tuples of tuples. It is read, not run,
and none of that may cost more than a moment: what is larger than people need is `Unclear`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from typing import Any

import numpy as np

#: Longest loop; most rows and columns of a matrix.
PASSES, SIZE = 128, 12

#: Largest whole number that all cases share in a compiled function; in plain Python, whose numbers have no end.
LARGEST, WHOLE = 2**31, 2**63

#: Numbers in one value of many cases; in all values of one run; rows of passes beside cases.
NUMBERS, MADE, BESIDE_EACH_OTHER = 4_000_000, 32_000_000, 100_000

#: Numbers in an array of plain Python, and in a tuple with all that is in it.
ENTRIES, HELD = 64, 1024


class Unclear(Exception):
    """The text holds something that is not understood here, or too much."""


def passes(of: Sequence[Any]) -> list[Any]:
    """What a loop runs over, if it is not too long: a range is counted before it is gone through."""
    try:
        if len(of) <= PASSES:
            return list(of)
    except OverflowError:  # longer than anything that could be indexed
        pass
    raise Unclear


def together(loops: Sequence[Sequence[Any]]) -> None:
    """Refuse loops within each other that have too many passes together."""
    if math.prod(map(len, loops)) > PASSES:
        raise Unclear


def shared(value: int) -> int:
    """A whole number that all cases share, if it is one that a compiled function can hold."""
    if abs(value) > LARGEST:
        raise Unclear
    return value


def plain(value: Any) -> Any:
    """A value of plain Python, if it is not too large."""
    if isinstance(value, np.ndarray):
        fits = value.size <= ENTRIES
    elif isinstance(value, (tuple, list)):
        fits = _held(value) <= HELD
    elif isinstance(value, range):
        fits = len(value) <= ENTRIES
    else:
        fits = not isinstance(value, int) or abs(value) <= WHOLE
    if not fits:
        raise Unclear
    return value


def repeated(a: Any, b: Any) -> None:
    """Refuse what is put together of two values if one is a tuple and would become too long."""
    for one, other in ((a, b), (b, a)):
        if isinstance(one, (tuple, list)):
            try:
                times = abs(operator.index(other))
            except TypeError:
                times = 2
            if _held(one) * times > HELD:
                raise Unclear


def _held(value: Sequence[Any]) -> int:
    """How many numbers a tuple holds with all that is in it, as far as that is not too many."""
    found, todo = 0, list(value)
    while todo and found + len(todo) <= HELD:
        one = todo.pop()
        if isinstance(one, (tuple, list)):
            todo += one
            found += not one
        else:
            found += max(1, np.size(one))
    return found + len(todo)
