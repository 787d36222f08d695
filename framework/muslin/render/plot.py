"""Line plots drawn with Pillow: energies over time, and any other curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.base.errors import MuslinError
from muslin.render.lettering import Image
from muslin.render.materials import Colour, linear, srgb
from muslin.render.picture import write_png

# Okabe and Ito's colours, distinct with every common colour blindness.
ENERGY_COLOURS: dict[str, Colour] = {
    "kinetic": "#d55e00",
    "elastic": "#0072b2",
    "gravity": "#009e73",
    "gravity and pull": "#009e73",
    "total": "#2b2e33",
}
COLOURS: tuple[Colour, ...] = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#2b2e33")

_PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "1e-6 ": 1e-6, "1e-9 ": 1e-9}
_FINE = 3  # drawn this many times larger, then averaged down
_INK, _PALE, _GRID, _PAPER = (43, 46, 51), (120, 124, 130), (228, 230, 233), (255, 255, 255)


def plot_energies(
    table: Mapping[str, ArrayLike],
    times: ArrayLike,
    path: str | Path | None = None,
    title: str = "Energy",
    size: tuple[int, int] = (960, 540),
) -> Image:
    """The energies of a run over time.

    Parameters
    ----------
    table : mapping of name to (n,) array [J]
        Usually kinetic, elastic, gravity and total, in the order of the legend.
    times : (n,) array [s]
    path : str or Path, optional
        Also write the picture there, as PNG.
    title : str
    size : (width, height) in pixels

    Returns
    -------
    (height, width, 3) uint8

    Raises
    ------
    MuslinError
        If a column's length differs from the number of times, or the file cannot be written.
    """
    t = np.asarray(times, dtype=float)
    curves = {name: (t, np.asarray(values, dtype=float)) for name, values in table.items()}
    colours = [ENERGY_COLOURS.get(name, COLOURS[i % len(COLOURS)]) for i, name in enumerate(curves)]
    image = line_plot(curves, title, "time", "energy", "s", "J", size=size, colours=colours)
    if path is not None:
        write_png(path, image)
    return image


#: Columns of a run's log with its linear momentum and its angular momentum about the centre of mass, and their units.
MOMENTA = {
    "linear momentum": (("px", "py", "pz"), "N s"),
    "angular momentum about the centre of mass": (("lx", "ly", "lz"), "N m s"),
}


def plot_momenta(
    table: Mapping[str, ArrayLike], times: ArrayLike, size: tuple[int, int] = (960, 360)
) -> list[Image]:
    """The linear and the angular momentum of a run over time, a picture of `size` each.

    Parameters
    ----------
    table : mapping of name to (n,) array
        Columns of `MOMENTA`; of what is not there at all, or nowhere a number, there is no picture.
    times : (n,) array [s]
    size : (width, height) in pixels

    Returns
    -------
    list of (height, width, 3) uint8
    """
    t = np.asarray(times, dtype=float)
    images = []
    for title, (names, unit) in MOMENTA.items():
        curves = {name: (t, table[name]) for name in names if name in table}
        if any(np.isfinite(np.asarray(y, dtype=float)).any() for _, y in curves.values()):
            images.append(line_plot(curves, title, "time", "momentum", "s", unit, size=size))
    return images


def line_plot(
    curves: Mapping[str, tuple[ArrayLike, ArrayLike]],
    title: str = "",
    x_label: str = "",
    y_label: str = "",
    x_unit: str = "",
    y_unit: str = "",
    log_x: bool = False,
    log_y: bool = False,
    markers: bool = False,
    size: tuple[int, int] = (960, 540),
    colours: Sequence[Colour] | None = None,
) -> Image:
    """Curves with axes, ticks, a grid and a legend, antialiased.

    Parameters
    ----------
    curves : mapping of name to (x, y), each (n,) arrays
        A point that is not finite, or not positive on a logarithmic axis, breaks its curve.
    title, x_label, y_label : str
    x_unit, y_unit : str
        Written behind the label with the SI prefix that gives short numbers.
    log_x, log_y : bool
        Logarithmic axes.
    markers : bool
        Also draw the points.
    size : (width, height) in pixels
    colours : sequence of colours, optional
        One per curve.

    Returns
    -------
    (height, width, 3) uint8
    """
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    data = {name: _curve(name, x, y, log_x, log_y) for name, (x, y) in curves.items()}
    ink = [_bytes(c) for c in (colours or [COLOURS[i % len(COLOURS)] for i in range(len(data))])]
    x_low, x_high = _range([x for x, _ in data.values()], 0.0)
    y_low, y_high = _range([y for _, y in data.values()], 0.05)
    x_ticks, x_text, x_prefix = _ticks(x_low, x_high, 8, log_x, x_unit)
    y_ticks, y_text, y_prefix = _ticks(y_low, y_high, 6, log_y, y_unit)

    width, height = size[0] * _FINE, size[1] * _FINE
    unit = _FINE * min(size[0] / 960, size[1] / 540)
    font, big = ImageFont.load_default(15 * unit), ImageFont.load_default(20 * unit)
    picture = Pillow.new("RGB", (width, height), _PAPER)
    pen = ImageDraw.Draw(picture)
    label_width = max([pen.textlength(s, font=font) for s in y_text], default=0)
    left, right = int(label_width + 58 * unit), int(width - 28 * unit)
    top, bottom = int(84 * unit), int(height - 62 * unit)

    def across(x: Any) -> Any:
        return left + (x - x_low) / (x_high - x_low) * (right - left)

    def down(y: Any) -> Any:
        return bottom - (y - y_low) / (y_high - y_low) * (bottom - top)

    thin = max(round(unit), 1)
    for value, label in zip(x_ticks, x_text, strict=True):
        x = across(value)
        pen.line((x, top, x, bottom), fill=_GRID, width=thin)
        pen.text((x, bottom + 9 * unit), label, font=font, fill=_INK, anchor="mt")
    for value, label in zip(y_ticks, y_text, strict=True):
        y = down(value)
        pen.line((left, y, right, y), fill=_GRID, width=thin)
        pen.text((left - 9 * unit, y), label, font=font, fill=_INK, anchor="rm")
    if not log_y and y_low < 0 < y_high:
        pen.line((left, down(0), right, down(0)), fill=_PALE, width=thin)
    pen.line((left, top, left, bottom, right, bottom), fill=_PALE, width=thin)

    pen.text((left, 20 * unit), title, font=big, fill=_INK, anchor="lt")
    pen.text(
        ((left + right) / 2, height - 14 * unit),
        _axis(x_label, x_prefix + x_unit),
        font=font,
        fill=_INK,
        anchor="mb",
    )
    _sideways(picture, _axis(y_label, y_prefix + y_unit), font, (16 * unit, (top + bottom) / 2))

    for (x, y), colour in zip(data.values(), ink, strict=True):
        points = np.stack([across(x), down(y)], axis=1)
        good = np.isfinite(points).all(axis=1)
        for run in np.split(np.arange(len(points)), np.flatnonzero(np.diff(good.astype(int))) + 1):
            if len(run) and good[run[0]]:
                _polyline(pen, points[run], colour, 2.2 * unit)
        if markers:
            for px, py in points[good]:
                r = 4 * unit
                pen.ellipse((px - r, py - r, px + r, py + r), fill=colour)

    x = left
    for name, colour in zip(data, ink, strict=True):
        middle = 63 * unit
        pen.line((x, middle, x + 26 * unit, middle), fill=colour, width=round(3 * unit))
        pen.text((x + 33 * unit, middle), name, font=font, fill=_INK, anchor="lm")
        x += 33 * unit + pen.textlength(name, font=font) + 26 * unit
    return np.array(picture.resize(size, Pillow.Resampling.BOX))


def _curve(
    name: str, x: ArrayLike, y: ArrayLike, log_x: bool, log_y: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b = np.asarray(x, dtype=float).ravel(), np.asarray(y, dtype=float).ravel()
    if a.shape != b.shape:
        raise MuslinError(f'The curve "{name}" has {len(a)} places but {len(b)} values.')
    with np.errstate(divide="ignore", invalid="ignore"):
        a = np.log10(np.where(a > 0, a, np.nan)) if log_x else a
        b = np.log10(np.where(b > 0, b, np.nan)) if log_y else b
    good = np.isfinite(a) & np.isfinite(b)
    return np.where(good, a, np.nan), np.where(good, b, np.nan)


def _range(columns: list[NDArray[np.float64]], pad: float) -> tuple[float, float]:
    values = np.concatenate([*columns, np.zeros(0)])
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        room = 0.5 * abs(high) or 0.5
        return low - room, high + room
    return low - pad * (high - low), high + pad * (high - low)


def _ticks(low: float, high: float, wanted: int, log: bool, unit: str) -> tuple[list[float], list[str], str]:
    """Places of the ticks, their labels, and the SI prefix of the labels."""
    if log:
        first, last = int(np.ceil(low - 1e-9)), int(np.floor(high + 1e-9))
        if last > first:
            step = max(1, int(np.ceil((last - first) / wanted)))
            decades = range(first, last + 1, step)
            return (
                [float(k) for k in decades],
                [f"1e{k}" if not -3 < k < 4 else f"{10.0**k:g}" for k in decades],
                "",
            )
        ticks = [t for t in _steps(10**low, 10**high, wanted) if t > 0]
        return [float(np.log10(t)) for t in ticks], [f"{t:.6g}" for t in ticks], ""
    ticks = _steps(low, high, wanted)
    largest = max((abs(t) for t in ticks), default=0.0)
    prefix = _prefix(largest) if unit else ""
    scale = _PREFIXES[prefix]
    apart = (ticks[1] - ticks[0]) / scale if len(ticks) > 1 else largest / scale
    if not 1e-4 < apart < 1e6:
        return ticks, [f"{t / scale:.4g}" for t in ticks], prefix
    digits = max(0, -int(np.floor(np.log10(apart) + 1e-9)))
    return ticks, [f"{t / scale + 0.0:.{digits}f}" for t in ticks], prefix


def _prefix(largest: float) -> str:
    """The SI prefix that makes the largest tick a short number; none for 0.1 to 10,000."""
    if largest == 0 or 0.1 <= largest < 1e4:
        return ""
    return next((p for p, scale in _PREFIXES.items() if largest >= scale), "1e-9 ")


def _steps(low: float, high: float, wanted: int) -> list[float]:
    """Round numbers between low and high, about `wanted` of them."""
    rough = (high - low) / wanted
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough * 0.999)
    return [
        float(k * step) for k in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)
    ]


def _polyline(pen: Any, points: NDArray[np.float64], colour: tuple[int, int, int], width: float) -> None:
    """A line with round joints and ends."""
    path = [(float(x), float(y)) for x, y in points]
    if len(path) > 1:
        pen.line(path, fill=colour, width=max(round(width), 1), joint="curve")
    r = width / 2
    for x, y in (path[0], path[-1]):
        pen.ellipse((x - r, y - r, x + r, y + r), fill=colour)


def _sideways(picture: Any, text: str, font: Any, place: tuple[float, float]) -> None:
    """Text that runs upwards, its left edge and middle at `place`."""
    from PIL import Image as Pillow
    from PIL import ImageDraw

    _, _, w, h = font.getbbox(text)
    note = Pillow.new("RGB", (int(w) + 4, int(h) + 4), _PAPER)
    ImageDraw.Draw(note).text((2, 2), text, font=font, fill=_INK)
    note = note.rotate(90, expand=True)
    picture.paste(note, (int(place[0]), int(place[1] - note.height / 2)))


def _axis(label: str, unit: str) -> str:
    return f"{label} [{unit}]" if unit else label


def _bytes(colour: Colour) -> tuple[int, int, int]:
    r, g, b = (round(255 * float(c)) for c in srgb(linear(colour)))
    return r, g, b
