"""The kinds of values that tasks take and give: a grammar, as the manifest writes it."""

from __future__ import annotations

import functools
import math
import re

from muslin.base.errors import MuslinError

#: The kinds of values, for people: what `form` reads.
GRAMMAR = "scalar, int, vecN, matN or matRxC"

#: Largest number of entries a value may have: a 12x12 matrix has 144.
LARGEST = 256

#: Shape of one sample, and whether it is an integer.
Form = tuple[tuple[int, ...], bool]


@functools.cache
def form(kind: str) -> Form:
    """Shape of a value of some kind, and whether it is an integer.

    Parameters
    ----------
    kind : str
        scalar, int, vecN, matN or matRxC: "vec12", "mat9", "mat4x3".

    Raises
    ------
    MuslinError
        If there is no such kind.
    """
    if kind in ("scalar", "int"):
        return (), kind == "int"
    shape: tuple[int, ...] = ()
    if match := re.fullmatch(r"vec([1-9]\d?\d?)", kind):
        shape = (int(match[1]),)
    elif match := re.fullmatch(r"mat([1-9]\d?)(?:x([1-9]\d?))?", kind):
        shape = (int(match[1]), int(match[2] or match[1]))
    if not shape or math.prod(shape) > LARGEST:
        raise MuslinError(f"There is no kind {kind!r} of values.", f"There is: {GRAMMAR}.")
    return shape, False


def kind_of(shape: tuple[int, ...], integer: bool) -> str | None:
    """The kind of a value by its form; None for what no kind has."""
    if not shape:
        return "int" if integer else "scalar"
    if integer or len(shape) > 2 or not 0 < math.prod(shape) <= LARGEST:
        return None
    if len(shape) == 1:
        return f"vec{shape[0]}"
    return f"mat{shape[0]}" if shape[0] == shape[1] else f"mat{shape[0]}x{shape[1]}"
