"""The picture of a scene: surfaces and a camera in, (height, width, 3) bytes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.base import runtime
from muslin.base.errors import MuslinError
from muslin.render.camera import Camera
from muslin.render.lettering import Image, Legend, draw_legend
from muslin.render.lighting import Light, Quality, Sun, light_vertices, sunlight
from muslin.render.materials import Colour, linear, srgb, strain_table
from muslin.render.shapes import Surface
from muslin.render.tables import Scene, buffer, gather, neighbours, workspace

QUALITIES = {
    "draft": Quality(1, 1, 1024, 0, 1),
    "good": Quality(2, 24, 352, 48, 112),
    "best": Quality(4, 48, 896, 128, 160),
}


BACKGROUND: tuple[Colour, Colour] = ("#eceef0", "#e6e4e1")
"""Top and bottom of the picture behind everything."""

_WHITEST = 3.0  # light this bright is shown as white
_BANDS = 12  # row bands per picture; any number gives the same picture


@runtime.shared_out()
def draw(
    surfaces: Sequence[Surface],
    camera: Camera,
    size: tuple[int, int] = (1280, 720),
    quality: str = "good",
    light: Light | None = None,
    background: Colour | tuple[Colour, Colour] = BACKGROUND,
    wireframe: bool = False,
    legend: Legend | None = None,
) -> Image:
    """Draw surfaces as a camera sees them.

    The same input gives the same bytes, run to run and with any number of threads.

    Parameters
    ----------
    surfaces : sequence of Surface
        May be empty.
    camera : Camera
    size : (width, height)
        In pixels.
    quality : {"draft", "good", "best"}
        Draft: one sample per pixel, one hard shadow, no occlusion of the sky. Good: 4 samples, soft shadows,
        sky occlusion. Best: 16 samples, smoother shadows.
    light : Light, optional
    background : colour, or (top, bottom) colours
    wireframe : bool
        Draw the triangles' edges over every surface that is not a prop.
    legend : Legend, optional
        The scale of the strain map.

    Returns
    -------
    (height, width, 3) uint8
        sRGB, first row on top.

    Raises
    ------
    MuslinError
        If a number is not finite, a shape is wrong, or the quality is unknown.
    """
    if quality not in QUALITIES:
        raise MuslinError(f'There is no quality "{quality}".', f"Choose from {', '.join(QUALITIES)}.")
    width, height = int(size[0]), int(size[1])
    if width < 1 or height < 1:
        raise MuslinError(f"A picture of {width} x {height} pixels cannot be drawn.")
    runtime.start()
    from muslin.render import shade

    settled, light = QUALITIES[quality], light or Light()
    scene = gather(surfaces, wireframe)
    to_sun, up = _unit(light.direction), _unit(camera.up)
    seen = _rasterised(scene, camera, (width, height), settled.samples)
    sun = sunlight(scene, settled, light, to_sun)
    light_vertices(scene, settled, up, seen.facing, seen.box)
    settings = _settings(camera, light, to_sun, _pair(background), sun)
    settings[shade.WIRE_WIDTH] = 0.45 * max(height / 720, 1)
    picture: Image = np.empty((height, width, 3), dtype=np.uint8)
    shade.shade(
        settled.samples, seen.jitter, seen.triangle, seen.sample, scene.vertex, scene.triangles, seen.facing,
        seen.edges, scene.surfaces, settings, strain_table(), sun.frames, sun.maps, settled.sun_texels, sun.roof,
        _encoding(), picture,
    )  # fmt: skip
    return picture if legend is None else draw_legend(picture, legend)


def _unit(direction: Sequence[float]) -> NDArray[np.float64]:
    d = np.asarray(direction, dtype=float)
    return d / np.linalg.norm(d)


@dataclass(frozen=True)
class _Seen:
    """What a camera sees of a scene: tables of `raster` by triangle, and the triangle at each pixel and sample."""

    edges: NDArray[np.float64]
    box: NDArray[np.int32]
    facing: NDArray[np.int32]
    triangle: NDArray[np.int32]
    sample: NDArray[np.int32]
    jitter: float


def _rasterised(scene: Scene, camera: Camera, size: tuple[int, int], samples: int) -> _Seen:
    """Find the triangle that each pixel, and each sample of a pixel at a rim, sees."""
    from muslin.render import raster

    width, height = size
    jitter = 0.25 if samples > 1 else 0.0
    edges, box, facing, outer, rim, seen, nearest, farthest, sample_seen, sample_depth = workspace(
        len(scene.triangles), width * height, samples * samples
    )
    raster.edge_functions(
        np.ascontiguousarray(camera.view(scene.points)), scene.triangles, camera.focal(size) * samples,
        camera.near, width * samples, height * samples, edges, box, facing,
    )  # fmt: skip
    if samples > 1:
        corner = buffer("corner", (len(scene.points),), np.int32)
        raster.find_outlines(scene.triangles, neighbours(scene), facing, corner, outer)
        raster.mark_rims(edges, box, outer, samples, width, height, _BANDS, rim)
    else:
        rim[:] = 0
    raster.rasterise(
        edges, box, camera.near, samples, jitter, width, height, _BANDS, rim, seen, nearest, farthest,
        sample_seen, sample_depth,
    )  # fmt: skip
    return _Seen(edges, box, facing, seen, sample_seen, jitter)


def _settings(
    camera: Camera, light: Light, to_sun: NDArray[np.float64], background: tuple[Colour, Colour], sun: Sun
) -> NDArray[np.float32]:
    """The table of settings of `shade`, but for the width of its lines."""
    from muslin.render import shade

    settings = np.zeros(shade.SETTINGS, dtype=np.float32)
    top, bottom = background
    for place, value in (
        (shade.EYE, camera.eye),
        (shade.TO_SUN, to_sun),
        (shade.SUN, light.sun_strength * linear(light.sun)),
        (shade.SKY, light.sky_strength * linear(light.sky)),
        (shade.FLOOR, light.floor_strength * linear(light.floor)),
        (shade.TOP, _untone(linear(top))),
        (shade.BOTTOM, _untone(linear(bottom))),
        (shade.WIRE_COLOUR, linear("#20262e")),
    ):
        settings[place : place + 3] = value
    settings[shade.OFFSET] = 1.6 * sun.texel
    settings[shade.WHITEST] = _WHITEST
    settings[shade.ROOF : shade.ROOF + 12] = sun.roof_frame
    settings[shade.LOWEST] = sun.lowest
    return settings


def write_png(path: str | Path, image: Image) -> Path:
    """Write a picture, making the folder if need be; returns the path.

    Raises
    ------
    MuslinError
        If the file cannot be written.
    """
    from PIL import Image as Pillow

    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        Pillow.fromarray(np.ascontiguousarray(image)).save(path, format="PNG")
    except OSError as error:
        raise MuslinError(f"The picture {path} cannot be written: {error.strerror or error}.") from None
    return path


def _tone(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear up to 0.7, then a gentle shoulder towards 1, so that nothing bright is cut off."""
    return np.where(light > 0.7, 1 - 0.3 * np.exp(-(np.maximum(light, 0.7) - 0.7) / 0.3), light)


def _untone(shown: NDArray[np.float64]) -> NDArray[np.float64]:
    """The light that `_tone` shows as `shown`, up to `_WHITEST`."""
    bright = 0.7 - 0.3 * np.log(np.maximum(1 - shown, 1e-9) / 0.3)
    return np.minimum(np.where(shown > 0.7, bright, shown), _WHITEST)


@lru_cache(maxsize=1)
def _encoding() -> NDArray[np.uint8]:
    """The picture's bytes for linear light from 0 to `_WHITEST`."""
    return np.rint(255 * srgb(_tone(np.linspace(0, _WHITEST, 1 << 16, dtype=np.float64)))).astype(np.uint8)


def _pair(background: Colour | tuple[Colour, Colour]) -> tuple[Colour, Colour]:
    """Top and bottom colour of the background."""
    if isinstance(background, str) or len(background) == 3:
        return background, background
    return background


def _ink(image: Image, x: float, y: float, w: float, h: float) -> tuple[int, int, int]:
    """Dark writing on a bright place, light on a dark one."""
    part = image[max(int(y), 0) : int(y + h) + 1, max(int(x), 0) : int(x + w) + 1]
    return (38, 42, 48) if part.size == 0 or part.mean() > 120 else (244, 244, 242)
