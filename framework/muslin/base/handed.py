"""What a caller hands over, checked before anything is made of it: numbers, arrays and paths.

Whatever is something else is refused in a sentence that names it. (Meshes: `muslin.mesh.handing`; a folder's
functions: `muslin.tasks.loading`.)
"""

from __future__ import annotations

import os
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError


def number(name: str, value: Any) -> float:
    """A finite number: neither text nor complex, nor an array of several.

    Raises
    ------
    MuslinError
    """
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    if not isinstance(value, Real):
        raise MuslinError(f"{name} = {short(value)} is not a number.")
    found = float(value)
    if not np.isfinite(found):
        raise MuslinError(f"{name} = {value} is not finite.")
    return found


def positive(name: str, value: Any) -> float:
    """A number above 0.

    Raises
    ------
    MuslinError
    """
    found = number(name, value)
    if not found > 0:
        raise MuslinError(f"{name} = {value} must be positive.")
    return found


def real(what: str, values: Any) -> np.ndarray:
    """An array of real numbers, of whatever shape.

    Raises
    ------
    MuslinError
        If it is one of text, of complex numbers, or of rows of different lengths.
    """
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = array.astype(np.float64)
    except (ValueError, TypeError):
        raise MuslinError(f"{what}: {short(values)} is not an array of numbers.") from None
    if array.dtype.kind not in "biuf":
        kind = "complex numbers" if array.dtype.kind == "c" else "no numbers"
        raise MuslinError(f"{what}: {short(values)} is an array of {kind}; real ones are needed.")
    return array


def path(name: str, value: Any) -> Path:
    """A path.

    Raises
    ------
    MuslinError
    """
    if not isinstance(value, (str, os.PathLike)):
        raise MuslinError(f"{name} = {short(value)} is not a path.", "Give it as text, or as a Path.")
    return Path(value)


def short(value: Any) -> str:
    """A value as a message quotes it."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
