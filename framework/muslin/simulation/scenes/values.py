"""Values of parameters, read from text or passed through."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.base.errors import MuslinError


def converted(name: str, value: Any, kind: str) -> Any:
    """Read a parameter from text (or pass it through) according to its declared type."""
    try:
        if kind == "bool":
            words = {
                "true": True,
                "yes": True,
                "on": True,
                "1": True,
                "false": False,
                "no": False,
                "off": False,
                "0": False,
                "none": False,
            }
            return words[str(value).strip().lower()]
        if kind == "int":
            if float(value) != int(float(value)):
                raise ValueError
            return int(float(value))
        if kind == "Vec":
            parts = value.replace(",", " ").split() if isinstance(value, str) else list(value)
            vector = tuple(_number(part) for part in parts)
            if len(vector) != 3:
                raise ValueError
            return vector
        if kind.startswith("float"):
            return None if "None" in kind and (value is None or value == "none") else _number(value)
        if isinstance(value, (list, tuple, np.ndarray)):
            return ",".join(map(str, np.ravel(value).tolist())) or "none"
        return str(value)
    except (ValueError, TypeError, KeyError, OverflowError, ZeroDivisionError):
        wanted = {"bool": "on or off", "int": "a whole number", "Vec": "three numbers such as 0,-9.81,0"}
        raise MuslinError(f"{name} = {value!r} is not {wanted.get(kind, 'a number')}.") from None


def _number(text: Any) -> float:
    """A finite number; fractions such as 1/240 are read too."""
    if isinstance(text, str) and "/" in text:
        above, below = text.split("/")
        number = float(above) / float(below)
    else:
        number = float(text)
    if not np.isfinite(number):
        raise ValueError(text)
    return number
