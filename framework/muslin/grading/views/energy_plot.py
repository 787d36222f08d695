"""Energies and momenta over time: what is on one small plot for each, the submission's line over the reference's.

`energy_plot.html.j2` draws it as inline SVG.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

Rows = Sequence[Sequence[float]]

NAMES = ("kinetic", "elastic", "gravity")

#: What is drawn beside them: their sum.
TOTAL = "total"

#: The momenta of a record's rows, and their units.
MOMENTA = {f"p{axis}": "N s" for axis in "xyz"} | {f"l{axis}": "N m s" for axis in "xyz"}

#: What is not told apart of two momenta: this of the largest of its kind, for what should be zero is rounding.
FAINT = 1e-3


@dataclass(frozen=True)
class Frame:
    """Size of a plot, and where the field of its lines begins and ends [pixels]."""

    width: int = 340
    height: int = 220
    left: int = 52
    right: int = 330
    top: int = 14
    bottom: int = 184


@dataclass(frozen=True)
class Plot:
    """One energy's or momentum's plot.

    Attributes
    ----------
    name : str
        Of what is drawn, as an id on the page.
    title : str
        What is drawn, and its unit.
    note : str
        Where the submission's line leaves the plot; empty if it does not.
    said : str
        The plot in words; empty if there is nothing to draw.
    rows, columns : tuple of (str, str)
        Height (place across) of each round number, and the number.
    lines : tuple of (str, str)
        "reference" or "yours", and the points of its line.
    """

    name: str
    title: str
    note: str
    said: str = ""
    rows: tuple[tuple[str, str], ...] = ()
    columns: tuple[tuple[str, str], ...] = ()
    lines: tuple[tuple[str, str], ...] = ()
    frame: Frame = Frame()


#: Most points of a line, and how many times the reference's range a plot may show.
MOST, REACH = 300, 4.0


def plots(energies: Rows, reference: Rows) -> list[Plot]:
    """One plot per energy, and one of their sum.

    Parameters
    ----------
    energies, reference : rows of (time, kinetic, elastic, gravity)
        [s, J, J, J]; what is not a finite number is left out.
    """
    columns = [(name, (k,)) for k, name in enumerate(NAMES, 1)] + [(TOTAL, (1, 2, 3))]
    return [
        _plot(name, f"{name} energy", "J", _curve(energies, which), _curve(reference, which))
        for name, which in columns
    ]


def momenta(energies: Rows, momenta: Rows, reference: Rows, reference_momenta: Rows) -> list[Plot]:
    """One plot for each component of the linear and the angular momentum.

    Parameters
    ----------
    energies, reference : rows that begin with the time [s]
    momenta, reference_momenta : rows of (px, py, pz, lx, ly, lz), as many
        [N s and N m s].
    """
    yours, theirs = (
        [[row[0], *more] for row, more in zip(rows, table, strict=False)]
        for rows, table in ((energies, momenta), (reference, reference_momenta))
    )
    curves = [(_curve(yours, (k,)), _curve(theirs, (k,))) for k in range(1, len(MOMENTA) + 1)]
    drawn = []
    for k, ((name, unit), (mine, right)) in enumerate(zip(MOMENTA.items(), curves, strict=True)):
        kind = curves[3 * (k // 3) : 3 * (k // 3) + 3]
        least = FAINT * max((abs(y) for _, other in kind for _, y in other), default=0.0)
        word = "linear" if k < 3 else "angular"
        drawn.append(_plot(name, f"{word} momentum {name}", unit, mine, right, least))
    return drawn


def _curve(rows: Rows, columns: tuple[int, ...]) -> list[tuple[float, float]]:
    every = max(1, math.ceil(len(rows) / MOST))
    picked = [*rows[:-1:every], *rows[-1:]]
    numbers = [[row[0], *(row[k] for k in columns)] for row in picked if len(row) > max(columns)]
    whole = [row for row in numbers if None not in row and all(map(math.isfinite, row))]
    return [(float(row[0]), float(sum(row[1:]))) for row in whole]


def _plot(
    name: str,
    what: str,
    unit: str,
    yours: list[tuple[float, float]],
    reference: list[tuple[float, float]],
    least: float = 0.0,
) -> Plot:
    """`least`: how much the plot shows at least, above and below zero where it shows less."""
    title = f"{what[0].upper()}{what[1:]} [{unit}]"
    base = reference or yours
    if not base:
        return Plot(name, title, "Nothing was recorded.")
    heights = [y for _, y in base] + ([-least, least] if least else [])
    low, high = _padded(min(heights), max(heights))
    span = high - low
    low = max(min([low, *(y for _, y in yours)]), low - REACH * span)
    high = min(max([high, *(y for _, y in yours)]), high + REACH * span)
    start, end = _padded(min(t for t, _ in base), max(t for t, _ in base), 0.0)
    outside = [y for _, y in yours if not low <= y <= high]
    note = f"Your line leaves the plot: it reaches {outside[-1]:.3g} {unit}." if outside else ""
    frame = Frame()

    def across(t: float) -> str:
        part = (min(max(t, start), end) - start) / (end - start)
        return f"{frame.left + part * (frame.right - frame.left):.1f}"

    def height(y: float) -> str:
        part = (min(max(y, low - span), high + span) - low) / (high - low)
        return f"{frame.bottom - part * (frame.bottom - frame.top):.1f}"

    said = f"{what} over time"
    if yours and reference:
        said += (
            f": at the end yours is {yours[-1][1]:.4g} {unit}, the reference {reference[-1][1]:.4g} {unit}"
        )
    return Plot(
        name,
        title,
        note,
        said,
        tuple((height(y), _short(y)) for y in _round_numbers(low, high, 4)),
        tuple((across(t), _short(t)) for t in _round_numbers(start, end, 4)),
        tuple(
            (kind, " ".join(f"{across(t)},{height(y)}" for t, y in curve))
            for kind, curve in (("reference", reference), ("yours", yours))
            if curve
        ),
    )


def _padded(low: float, high: float, pad: float = 0.06) -> tuple[float, float]:
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-12):
        room = 0.5 * abs(high) or 0.5
        return low - room, high + room
    return low - pad * (high - low), high + pad * (high - low)


def _round_numbers(low: float, high: float, wanted: int) -> list[float]:
    rough = (high - low) / wanted
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)][: 4 * wanted]


def _short(value: float) -> str:
    for prefix, scale in (("G", 1e9), ("M", 1e6), ("k", 1e3)):
        if abs(value) >= 0.9999 * scale:
            return f"{value / scale:.4g}{prefix}"
    return f"{value + 0.0:.4g}" if abs(value) > 1e-12 else "0"
