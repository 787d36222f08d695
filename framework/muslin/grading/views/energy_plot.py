"""Energies over time as inline SVG: one small plot for each, the submission's line over the reference's."""

from __future__ import annotations

import math
from collections.abc import Sequence

Rows = Sequence[Sequence[float]]

NAMES = ("kinetic", "elastic", "gravity")
WIDTH, HEIGHT = 340, 220
LEFT, RIGHT, TOP, BOTTOM = 52, 330, 14, 184

#: Most points of a line, and how many times the reference's range a plot may show.
MOST, REACH = 300, 4.0


def plots(energies: Rows, reference: Rows) -> list[tuple[str, str, str]]:
    """One plot per energy.

    Parameters
    ----------
    energies, reference : rows of (time, kinetic, elastic, gravity)
        [s, J, J, J]; what is not a finite number is left out.

    Returns
    -------
    list of (name, SVG, note)
        The note says where the submission's line leaves the plot; it is empty if it does not.
    """
    return [
        (name, *_plot(name, _curve(energies, k), _curve(reference, k))) for k, name in enumerate(NAMES, 1)
    ]


def _curve(rows: Rows, column: int) -> list[tuple[float, float]]:
    every = max(1, math.ceil(len(rows) / MOST))
    picked = [*rows[:-1:every], *rows[-1:]]
    pairs = [(row[0], row[column]) for row in picked if len(row) > column]
    return [
        (float(t), float(y)) for t, y in pairs if None not in (t, y) and math.isfinite(t) and math.isfinite(y)
    ]


def _plot(
    name: str, yours: list[tuple[float, float]], reference: list[tuple[float, float]]
) -> tuple[str, str]:
    base = reference or yours
    if not base:
        return "", "No energies were recorded."
    low, high = _padded(min(y for _, y in base), max(y for _, y in base))
    span = high - low
    low = max(min([low, *(y for _, y in yours)]), low - REACH * span)
    high = min(max([high, *(y for _, y in yours)]), high + REACH * span)
    start, end = _padded(min(t for t, _ in base), max(t for t, _ in base), 0.0)
    outside = [y for _, y in yours if not low <= y <= high]
    note = f"Your line leaves the plot: it reaches {outside[-1]:.3g} J." if outside else ""

    def place(t: float, y: float) -> str:
        across = LEFT + (min(max(t, start), end) - start) / (end - start) * (RIGHT - LEFT)
        up = BOTTOM - (min(max(y, low - span), high + span) - low) / (high - low) * (BOTTOM - TOP)
        return f"{across:.1f},{up:.1f}"

    def line(curve: list[tuple[float, float]], kind: str) -> str:
        return (
            f'<polyline class="{kind}" points="{" ".join(place(t, y) for t, y in curve)}"/>' if curve else ""
        )

    grid = []
    for y in _round_numbers(low, high, 4):
        height = place(start, y).split(",")[1]
        grid.append(f'<line class="grid" x1="{LEFT}" y1="{height}" x2="{RIGHT}" y2="{height}"/>')
        grid.append(f'<text x="{LEFT - 6}" y="{height}" dy="4" text-anchor="end">{_short(y)}</text>')
    for t in _round_numbers(start, end, 4):
        across = place(t, low).split(",")[0]
        grid.append(f'<text x="{across}" y="{BOTTOM + 16}" text-anchor="middle">{_short(t)}</text>')
    said = f"{name} energy over time"
    if yours and reference:
        said += f": at the end yours is {yours[-1][1]:.4g} J, the reference {reference[-1][1]:.4g} J"
    svg = (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{said}">'
        f'<clipPath id="clip-{name}"><rect x="{LEFT}" y="{TOP - 4}" width="{RIGHT - LEFT + 2}" '
        f'height="{BOTTOM - TOP + 8}"/></clipPath>'
        f"{''.join(grid)}"
        f'<line class="axis" x1="{LEFT}" y1="{BOTTOM}" x2="{RIGHT}" y2="{BOTTOM}"/>'
        f'<g clip-path="url(#clip-{name})">{line(reference, "reference")}{line(yours, "yours")}</g>'
        f'<text x="{(LEFT + RIGHT) // 2}" y="{HEIGHT - 4}" text-anchor="middle">time [s]</text>'
        "</svg>"
    )
    return svg, note


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
