"""How far light gets: depth maps of the sun and of the sky, and what the vertices see of the sky and the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.render.materials import Colour
from muslin.render.tables import Scene, buffer


@dataclass(frozen=True)
class Quality:
    """Samples per pixel and side, depth maps of the sun and of the sky, and their resolutions."""

    samples: int
    sun_maps: int
    sun_texels: int
    sky_maps: int
    sky_texels: int


@dataclass(frozen=True)
class Light:
    """A sun, a sky and the floor's reflection.

    Parameters
    ----------
    direction : (3,) floats
        Towards the sun; any length.
    sun, sky, floor : sRGB colours
        Of the sunlight, of the sky's light and of what the floor throws back.
    sun_strength, sky_strength, floor_strength : float
        How bright a white surface facing them is: 1 is the white of the picture.
    softness : float
        Radius of the sun as seen from the scene [degrees]; the real one, 0.27, has hard shadows.
    """

    direction: tuple[float, float, float] = (-0.75, 0.9, 0.5)
    sun: Colour = "#fff4e6"
    sky: Colour = "#eaf1fa"
    floor: Colour = "#f2e6d8"
    sun_strength: float = 0.88
    sky_strength: float = 0.46
    floor_strength: float = 0.18
    softness: float = 2.6


@dataclass(frozen=True)
class Sun:
    """How far sunlight gets: depth maps over the sun's disc, and the roof above which it is everywhere."""

    frames: NDArray[np.float32]
    maps: NDArray[np.float32]
    texel: float
    roof_frame: NDArray[np.float32]
    roof: NDArray[np.float32]
    lowest: float


def sunlight(scene: Scene, settled: Quality, light: Light, to_sun: NDArray[np.float64]) -> Sun:
    """Depth maps over the sun's disc, and the roof, for a scene."""
    from muslin.render import depths

    count, texels = settled.sun_maps, settled.sun_texels
    frames, texel = _frames(_sun_disc(to_sun, light.softness, count), scene, texels)
    maps = buffer("sun", (count * texels**2,))
    bands = 8 if count < 4 else 1
    scratch = buffer("sun points", (count * bands * len(scene.points) * 3,))
    depths.depth_maps(scene.vertex, scene.casters, frames, 0, texels, bands, scratch, maps)
    return Sun(frames, maps, texel, *_roof(scene, to_sun, light.softness if count > 1 else 0.0, texel))


def light_vertices(
    scene: Scene,
    settled: Quality,
    up: NDArray[np.float64],
    facing: NDArray[np.int32],
    box: NDArray[np.int32],
) -> None:
    """Fill in what the vertices see of the sky and the floor, where it counts in the picture."""
    from muslin.render import depths, shade

    if settled.sky_maps == 0:  # nothing hides anything
        tilt = 0.5 * scene.vertex[:, shade.NORMAL : shade.NORMAL + 3] @ up
        for column, value in (
            (shade.SKY_FRONT, 0.5 + tilt), (shade.FLOOR_FRONT, 0.5 - tilt),
            (shade.SKY_BACK, 0.5 - tilt), (shade.FLOOR_BACK, 0.5 + tilt),
        ):  # fmt: skip
            scene.vertex[:, column] = value
        return
    directions = _hemisphere(up, settled.sky_maps)
    frames, texel = _frames(directions, scene, settled.sky_texels)
    maps = buffer("sky", (2 * settled.sky_maps * settled.sky_texels**2,))
    scratch = buffer("sky points", (settled.sky_maps * len(scene.points) * 3,))
    depths.depth_maps(scene.vertex, scene.casters, frames, 1, settled.sky_texels, 1, scratch, maps)
    height = directions @ up
    to_light = np.zeros((2 * settled.sky_maps, 5), dtype=np.float32)
    to_light[: settled.sky_maps, :3] = directions
    to_light[settled.sky_maps :, :3] = -directions
    # sum_k cos_k weight = 1 for a surface that faces up (down) and sees all of the sky (floor).
    to_light[: settled.sky_maps, 3] = 1 / height.sum()
    to_light[settled.sky_maps :, 4] = 1 / height.sum()
    passes = 3
    side = buffer("side", (len(scene.vertex), 2), np.int32)
    shade.sides_seen(scene.triangles, facing, box, passes, side)
    shade.sky_light(scene.vertex, side, frames, maps, settled.sky_texels, to_light, 1.5 * texel)
    shade.smooth_light(scene.triangles, passes, scene.vertex, buffer("sums", (len(scene.vertex), 5)))


def _frames(directions: NDArray[np.float64], scene: Scene, texels: int) -> tuple[NDArray[np.float32], float]:
    """Axes u, v (in texels) and height of the depth maps that look along `directions`, and the texel's size.

    The maps cover the sphere around everything that casts shadows. Its size goes in steps and its place in
    whole texels, so that shadows do not crawl while the scene moves.
    """
    half = 2.0 ** (np.ceil(np.log2(scene.radius * 1.02) * 8) / 8)
    texel = 2 * half / (texels - 4)
    w = np.asarray(directions)
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w), axis=1)])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    frames = np.zeros((len(w), 12), dtype=np.float32)
    for row, axis in ((0, u), (4, np.cross(w, u))):
        frames[:, row : row + 3] = axis / texel
        frames[:, row + 3] = texels / 2 - np.round(axis @ scene.center / texel)
    frames[:, 8:11] = w
    return frames, float(texel)


def _roof(
    scene: Scene, to_sun: NDArray[np.float64], softness: float, texel: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], float]:
    """A coarse map of what could stand before any part of the sun: most of a picture is above it, and lit.

    Returns
    -------
    frame : (12,) array
        As in `_frames`, for the middle of the sun.
    roof : array
        Each cell's greatest height above which no sunlight can be missing.
    lowest : float
        Height down to which that holds.
    """
    from muslin.render import depths

    cells, depth = 64, 4 * scene.radius
    frame, cell = _frames(to_sun[None], scene, cells)
    # As far aside as light from the sun's rim comes on its way down, or the depth maps' texels blur.
    around = int(np.ceil((depth * np.tan(np.radians(softness)) * 1.02 + 3 * texel) / cell))
    frame[0, [3, 7]] += around
    roof = buffer("roof", (cells + 2 * around, cells + 2 * around))
    depths.roof_heights(scene.vertex, scene.casters, frame, roof)
    wide = np.pad(roof, around, constant_values=-1e30)
    for axis in (0, 1):
        wide = np.lib.stride_tricks.sliding_window_view(wide, 2 * around + 1, axis).max(axis=-1)
    top = float(wide.max())
    return frame[0], np.ascontiguousarray(wide + np.float32(0.2 * texel)), max(top - depth, -1e30)


def _sun_disc(to_sun: NDArray[np.float64], softness: float, n: int) -> NDArray[np.float64]:
    """Directions over the sun's disc, (n, 3): eight on its rim, the rest inside like a sunflower's seeds."""
    if n == 1:
        return to_sun[None]
    u = np.cross(to_sun, np.eye(3)[np.argmin(np.abs(to_sun))])
    u /= np.linalg.norm(u)
    v = np.cross(to_sun, u)
    rim, inside = min(n, 8), np.arange(max(n - 8, 0))
    r = np.concatenate([np.full(rim, 0.95), 0.84 * np.sqrt((inside + 0.5) / max(len(inside), 1))])
    r *= np.tan(np.radians(softness))
    phi = np.concatenate([np.arange(rim) * 2 * np.pi / rim, inside * np.pi * (3 - np.sqrt(5)) + 0.4])
    d = to_sun + r[:, None] * (np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * v)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def _hemisphere(up: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Directions spread evenly over the hemisphere around `up`, (n, 3)."""
    u = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    u /= np.linalg.norm(u)
    v = np.cross(up, u)
    k = np.arange(n)
    z = (k + 0.5) / n
    phi = k * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return z[:, None] * up + r[:, None] * (np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * v)
