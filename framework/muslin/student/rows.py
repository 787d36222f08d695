"""Numbers, vectors and matrices in lines that a terminal of 80 columns can show."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

#: Columns a line may have.
WIDTH = 79
#: Entries shown of two large matrices that differ.
ENTRIES = 9


def rows(value: Any, width: int = WIDTH) -> tuple[str, list[str]]:
    """A number, vector or matrix in lines, columns aligned.

    Parameters
    ----------
    value : array_like
    width : int
        Columns there are. Six digits are shown where they fit, fewer of all entries over one power of ten where not.

    Returns
    -------
    factor : str
        What all entries are multiplied with, "1e+06 * "; mostly nothing.
    lines : list of str
    """
    array = np.asarray(value)
    if array.ndim == 0:
        return "", [_number(array[()])]
    if array.size > 16 and (array == array.flat[0]).all():
        return "", [f"{' x '.join(map(str, array.shape))} entries, each {_number(array.flat[0])}"]
    table = array.reshape(-1, array.shape[-1]) if array.size else array.reshape(1, 0)
    lines = _aligned([[_number(entry) for entry in row] for row in table])
    finite = np.abs(table[np.isfinite(table)])
    if len(lines[0]) <= width or not finite.any():
        return "", lines
    power = math.floor(math.log10(finite.max()))
    for digits in (4, 3, 2, 1):
        lines = _aligned([[_part(entry / 10.0**power, digits) for entry in row] for row in table])
        if len(lines[0]) <= width:
            break
    return f"1e{power:+03d} * " if power else "", lines


def titled(title: str, values: Mapping[str, Any]) -> Iterator[str]:
    """Values by name, `s = [1  2]`, under a title; a large matrix begins on a line of its own."""
    if title and values:
        yield ""
        yield title
    for label, value in values.items():
        yield from named(f"  {label} = ", value)


def named(head: str, value: Any, note: str = "") -> Iterator[str]:
    """A value behind a head, `  line 9  x = `, and a note at its end."""
    lines = rows(value, 10**9)[1]
    if len(head) + len(lines[0]) > WIDTH:
        factor, lines = rows(value, WIDTH - 4)
        yield (head + factor).rstrip()
        yield from (f"    {line}" for line in lines[:-1])
        last = f"    {lines[-1]}"
    else:
        lines = [(head if k == 0 else " " * len(head)) + line for k, line in enumerate(lines)]
        yield from lines[:-1]
        last = lines[-1]
    if len(last) + len(note) <= WIDTH or not note:
        yield last + note
    else:
        yield last
        yield " " * min(len(head), 4) + note.strip()


def beside(label: str, mine: np.ndarray, right: np.ndarray, whole: bool = True) -> Iterator[str]:
    """Yours, expected and the difference: in columns, among each other, or by the entries that are farthest off.

    Of large ones both are shown in `whole`, too.
    """
    difference = np.asarray(mine, float) - right
    parts = {"yours": np.asarray(mine), "expected": np.asarray(right), "difference": difference}
    yield f"  {label}"
    columns = [rows(value, 10**9)[1] for value in parts.values()]
    wide = [max(len(head), *map(len, lines)) for head, lines in zip(parts, columns, strict=True)]
    if 4 + sum(wide) + 6 <= WIDTH:
        for line in zip(*([head, *lines] for head, lines in zip(parts, columns, strict=True)), strict=True):
            yield "    " + "   ".join(text.ljust(w) for text, w in zip(line, wide, strict=True)).rstrip()
    elif right.size <= 16:
        for head, value in parts.items():
            yield from named(f"    {head:10} = ", value)
    else:
        yield from _farthest(mine, right, difference)
        for head in ("yours", "expected") if whole else ():
            yield from named(f"    {head} = ", parts[head])


def _farthest(mine: np.ndarray, right: np.ndarray, difference: np.ndarray) -> Iterator[str]:
    """A table of the entries that differ most."""
    size = np.where(np.isfinite(difference), np.abs(difference), np.inf)
    off = size > 1e-8 * np.abs(right).max(initial=0.0)
    order = np.argsort(-size, axis=None, kind="stable")[: min(ENTRIES, int(off.sum()))]
    if not len(order):
        return
    yield f"    of {off.size} entries {off.sum()} differ{', most of all' if off.sum() > len(order) else ''}:"
    yield f"    {'entry':10}{'yours':>14}{'expected':>14}{'difference':>14}"
    for place in zip(*np.unravel_index(order, right.shape), strict=True):
        entry = "[" + ", ".join(str(int(k)) for k in place) + "]"
        numbers = (mine[place], right[place], difference[place])
        yield f"    {entry:10}" + "".join(f"{_number(value):>14}" for value in numbers)


def changed(head: str, before: np.ndarray, after: np.ndarray) -> Iterator[str] | None:
    """The entries of a matrix that a line set, `H[0, 3] = 5`; None if it is no matrix of which few changed."""
    if np.shape(before) != np.shape(after) or np.size(after) < 4:
        return None
    places = np.argwhere(np.asarray(before) != np.asarray(after))
    if not 0 < len(places) <= np.size(after) / 4:
        return None
    return (
        f"{head}[{', '.join(str(k) for k in place)}] = {_number(after[tuple(place)])}"
        for place in places.tolist()
    )


def _number(value: Any) -> str:
    return f"{value:.6g}" if np.asarray(value).dtype.kind == "f" else str(value)


def _part(value: float, digits: int) -> str:
    return "0" if value == 0 else f"{value:.{digits}f}"


def _aligned(texts: list[list[str]]) -> list[str]:
    wide = max((len(text) for row in texts for text in row), default=0)
    return ["[" + "  ".join(text.rjust(wide) for text in row) + "]" for row in texts]
