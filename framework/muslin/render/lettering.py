"""What is written into a picture: a caption, and the strain map's scale."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.render.materials import strain_colours

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Legend:
    """The strain map's scale, drawn in a corner of the picture.

    Parameters
    ----------
    lo, hi : float
        As in the material.
    title : str
    corner : {"bottom right", "bottom left", "top right", "top left"}
    """

    lo: float
    hi: float
    title: str = "principal stretch"
    corner: str = "bottom right"
    top: float | None = None

    def values(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is painted at places on the scale, from 0 to 1."""
        if self.top is not None:
            return 1 + t * (self.hi - 1)
        return np.where(t < 0.5, self.lo + 2 * t * (1 - self.lo), 1 + (2 * t - 1) * (self.hi - 1))

    def label(self, t: float) -> str:
        """The number at a place on the scale."""
        if self.top is not None:
            return f"{t * self.top:.3g}"
        digits = max(2, int(np.ceil(-np.log10(min(1 - self.lo, self.hi - 1) / 2) + 0.3)))
        return f"{float(self.values(np.array(t))):.{digits}f}".rstrip("0").rstrip(".")


def text_overlay(image: Image, text: str, corner: str = "top left") -> Image:
    """A small caption in a corner of the picture, for example the time; returns a new picture."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    height, width = image.shape[:2]
    unit = max(height / 720, 0.4)
    picture = Pillow.fromarray(image)
    pen = ImageDraw.Draw(picture)
    font = ImageFont.load_default(20 * unit)
    _, top, _, bottom = pen.textbbox((0, 0), text, font=font)
    wide = _width(text, font)
    x = 24 * unit if "left" in corner else width - 24 * unit - wide
    y = 20 * unit if "top" in corner else height - 20 * unit - (bottom - top)
    _write(pen, x, y - top, text, font, _ink(image, x, y, wide, bottom - top))
    return np.array(picture)


def draw_legend(image: Image, legend: Legend) -> Image:
    """The strain map's scale with ticks and a title in a corner of the picture; returns a new picture."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    height, width = image.shape[:2]
    unit = max(height / 720, 0.4)
    bar = (int(250 * unit), max(int(14 * unit), 3))
    pad, gap = 16 * unit, 6 * unit
    font, small = ImageFont.load_default(17 * unit), ImageFont.load_default(max(14 * unit, 8))
    panel = (int(bar[0] + 2 * pad + 18 * unit), int(82 * unit))
    edge = int(20 * unit)
    x0 = edge if "left" in legend.corner else width - edge - panel[0]
    y0 = edge if "top" in legend.corner else height - edge - panel[1]
    picture = Pillow.fromarray(image)
    veil = Pillow.new("RGBA", picture.size, (0, 0, 0, 0))
    ImageDraw.Draw(veil).rounded_rectangle(
        (x0, y0, x0 + panel[0], y0 + panel[1]), 8 * unit, fill=(255, 255, 255, 205)
    )
    picture = Pillow.alpha_composite(picture.convert("RGBA"), veil).convert("RGB")
    pen = ImageDraw.Draw(picture)
    ink = (38, 42, 48)
    pen.text((x0 + panel[0] / 2, y0 + 10 * unit), legend.title, font=font, fill=ink, anchor="mt")
    bx, by = int(x0 + (panel[0] - bar[0]) / 2), int(y0 + 36 * unit)
    t = (np.arange(bar[0]) + 0.5) / bar[0]
    strip = np.repeat(strain_colours(legend.values(t), legend.lo, legend.hi)[None], bar[1], axis=0)
    picture.paste(Pillow.fromarray(strip), (bx, by))
    pen.rectangle((bx - 1, by - 1, bx + bar[0], by + bar[1]), outline=(120, 124, 130))
    for where in (0, 0.25, 0.5, 0.75, 1):
        x = bx + where * (bar[0] - 1)
        pen.line((x, by + bar[1], x, by + bar[1] + gap * 0.7), fill=ink)
        label = legend.label(where)
        top = pen.textbbox((0, 0), "0", font=small)[1]
        _write(pen, x - _width(label, small) / 2, by + bar[1] + gap * 1.3 - top, label, small, ink)
    return np.array(picture)


_DOT = re.compile(r"(?<=\d)\.(?=\d)")


def _dot(font: Any) -> tuple[int, int]:
    """Width of a number's dot, and of the gap beside it: whole pixels, for a font's own dot fades in a small one."""
    return max(round(font.size / 8), 1), max(round(font.size / 12), 1)


def _width(text: str, font: Any) -> int:
    """What `_write` takes."""
    parts, (dot, gap) = _DOT.split(text), _dot(font)
    return sum(round(font.getlength(part)) for part in parts) + (len(parts) - 1) * (dot + 2 * gap)


def _write(pen: Any, x: float, y: float, text: str, font: Any, ink: tuple[int, int, int]) -> None:
    """Text from its upper left on, dots of numbers in full ink."""
    x, y, (dot, gap) = round(x), round(y), _dot(font)
    foot = y + pen.textbbox((0, 0), "1", font=font)[3] - 1
    for k, part in enumerate(_DOT.split(text)):
        if k:
            pen.rectangle((x + gap, foot - dot + 1, x + gap + dot - 1, foot), fill=ink)
            x += dot + 2 * gap
        pen.text((x, y), part, font=font, fill=ink)
        x += round(font.getlength(part))


def _ink(image: Image, x: float, y: float, w: float, h: float) -> tuple[int, int, int]:
    """Dark writing on a bright place, light on a dark one."""
    part = image[max(int(y), 0) : int(y + h) + 1, max(int(x), 0) : int(x + w) + 1]
    return (38, 42, 48) if part.size == 0 or part.mean() > 120 else (244, 244, 242)
