"""What surfaces are made of, and the colours of the strain map.

Colours are written as people write them: sRGB, three numbers in [0, 1] or a string such as "#b5483a". The
renderer computes in linear light and converts at its two ends only.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.base.errors import MuslinError

Colour = str | tuple[float, float, float]

KINDS = {"solid": 0, "weave": 1, "checker": 2, "strain": 3}

# Blue, white, red in steps of even lightness: told apart with every common colour blindness.
STRAIN_STOPS = ("#1f4e9c", "#3f83c4", "#8fbfe0", "#f3f1ec", "#f2a582", "#d4574a", "#96152b")


@dataclass(frozen=True)
class Material:
    """The look of a surface.

    Parameters
    ----------
    kind : {"solid", "weave", "checker", "strain"}
        "weave" and "checker" need a surface with `uv`, "strain" one with `values`.
    colour : sRGB colour
        Of the front. The front of a triangle is the side from which its vertices run anticlockwise.
    back : sRGB colour, optional
        Of the back; default as the front.
    second : sRGB colour, optional
        The other squares of "checker", the weft yarns of "weave"; default a darker `colour`.
    scale : float
        Side of a checker square or width of a yarn, in the units of `uv` [m].
    roughness : float
        1 is matt, 0.2 is glazed.
    sheen : float
        Soft light at grazing angles, as on velvet or felt.
    translucency : float
        Share of the sunlight that shines through to the other side, as through thin cloth.
    lo, hi : float
        Ends of the strain map: the stretches drawn in full blue and full red; 1 (rest) is white.
    """

    kind: str = "solid"
    colour: Colour = "#c9573f"
    back: Colour | None = None
    second: Colour | None = None
    scale: float = 0.008
    roughness: float = 1.0
    sheen: float = 0.0
    translucency: float = 0.0
    lo: float = 0.9
    hi: float = 1.1

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise MuslinError(f'There is no material "{self.kind}".', f"The kinds are {', '.join(KINDS)}.")
        if not self.lo < 1 < self.hi:
            raise MuslinError(
                f"The strain map runs from {self.lo} to {self.hi}, which does not contain 1,"
                " the stretch at rest."
            )
        if not self.scale > 0:
            raise MuslinError(f"A material's scale must be positive, not {self.scale}.")

    def row(self) -> NDArray[np.float32]:
        """The material as numbers for the shading kernel, shape (20,)."""
        front = linear(self.colour)
        back = front if self.back is None else linear(self.back)
        shade = 0.45 if self.kind == "checker" else 0.86
        second = front * shade if self.second is None else linear(self.second)
        # The back of a pattern keeps the ratio of its two colours.
        second_back = back * second / np.maximum(front, 1e-3)
        return np.array(
            [
                KINDS[self.kind], *front, *back, *second, *np.clip(second_back, 0, 1),
                self.scale, self.roughness, self.sheen, self.translucency, self.lo, self.hi, 0,
            ],
            dtype=np.float32,
        )  # fmt: skip


CLOTH = Material("weave", "#c04a35", back="#dfb48c", scale=0.005, sheen=0.3, translucency=0.12)
"""Madder-red cloth with a sand-coloured back: tells its two sides apart and stands out on light ground."""

MUSLIN = Material("weave", "#efe3cc", back="#e6d3b0", scale=0.005, sheen=0.3, translucency=0.2)
"""Unbleached muslin."""

PROP = Material("solid", "#9ca7b3", roughness=0.45)
"""Glazed grey, for spheres and capsules."""

GROUND = Material("solid", "#e4e5e7")
"""The studio floor."""


def linear(colour: Colour) -> NDArray[np.float64]:
    """Linear light of an sRGB colour, (3,) in [0, 1].

    Raises
    ------
    MuslinError
        If the colour is neither "#rrggbb" nor three numbers in [0, 1].
    """
    if isinstance(colour, str):
        c = np.array(srgb_bytes(colour)) / 255
    else:
        c = np.asarray(colour, dtype=float)
        if c.shape != (3,) or not (np.isfinite(c).all() and (c >= 0).all() and (c <= 1).all()):
            raise MuslinError(f"{colour} is not a colour.", "Use three numbers between 0 and 1.")
    return linear_array(c)


def srgb_bytes(colour: str) -> tuple[int, int, int]:
    """A colour written "#rrggbb" as three bytes, sRGB.

    Raises
    ------
    MuslinError
        If it is not so written.
    """
    if not re.fullmatch("#?[0-9a-fA-F]{6}", colour):
        raise MuslinError(f'"{colour}" is not a colour.', 'Write it as "#rrggbb".')
    r, g, b = bytes.fromhex(colour[-6:])
    return r, g, b


def srgb(light: ArrayLike) -> NDArray[np.float64]:
    """The sRGB values in [0, 1] of linear light, any shape."""
    c = np.clip(np.asarray(light, dtype=float), 0, 1)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)


def strain_table(n: int = 256) -> NDArray[np.float32]:
    """The strain map as linear light, (n, 3): blue (compressed), white (rest) in the middle, red."""
    stops = np.array([linear(c) for c in STRAIN_STOPS])
    t = np.linspace(0, len(stops) - 1, n)
    columns = [srgb(np.interp(t, np.arange(len(stops)), stops[:, k])) for k in range(3)]
    return linear_array(np.stack(columns, axis=1)).astype(np.float32)


def linear_array(c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light of an array of sRGB values in [0, 1]."""
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def strain_position(values: ArrayLike, lo: float, hi: float) -> NDArray[np.float64]:
    """Where stretches lie on the strain map: 0 at `lo`, 1/2 at rest (1), 1 at `hi`, clamped."""
    v = np.asarray(values, dtype=float)
    t = np.where(v < 1, 0.5 * (v - lo) / (1 - lo), 0.5 + 0.5 * (v - 1) / (hi - 1))
    return np.clip(t, 0, 1)


def strain_colours(values: ArrayLike, lo: float, hi: float) -> NDArray[np.uint8]:
    """The sRGB colours of stretches, (...) -> (..., 3) uint8."""
    table = strain_table(1024)
    index = np.rint(strain_position(values, lo, hi) * (len(table) - 1)).astype(int)
    return np.rint(srgb(table[index]) * 255).astype(np.uint8)
