"""The picture of a scene: surfaces and a camera in, (height, width, 3) bytes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin import runtime
from muslin.errors import MuslinError
from muslin.render.camera import Camera
from muslin.render.materials import Colour, linear, srgb, strain_colours, strain_table
from muslin.render.shapes import Surface

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Quality:
    """Samples per pixel and side, depth maps of the sun and of the sky, and their resolutions."""

    samples: int
    sun_maps: int
    sun_texels: int
    sky_maps: int
    sky_texels: int


QUALITIES = {
    "draft": Quality(1, 1, 1024, 0, 1),
    "good": Quality(2, 24, 352, 48, 112),
    "best": Quality(4, 48, 896, 128, 160),
}


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
    scene = _gather(surfaces, wireframe)
    to_sun, up = _unit(light.direction), _unit(camera.up)
    seen = _rasterised(scene, camera, (width, height), settled.samples)
    sun = _sunlight(scene, settled, light, to_sun)
    _light_vertices(scene, settled, up, seen.facing, seen.box)
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


def _rasterised(scene: _Scene, camera: Camera, size: tuple[int, int], samples: int) -> _Seen:
    """Find the triangle that each pixel, and each sample of a pixel at a rim, sees."""
    from muslin.render import raster

    width, height = size
    jitter = 0.25 if samples > 1 else 0.0
    edges, box, facing, outer, rim, seen, nearest, farthest, sample_seen, sample_depth = _workspace(
        len(scene.triangles), width * height, samples * samples
    )
    raster.edge_functions(
        np.ascontiguousarray(camera.view(scene.points)), scene.triangles, camera.focal(size) * samples,
        camera.near, width * samples, height * samples, edges, box, facing,
    )  # fmt: skip
    if samples > 1:
        corner = _buffer("corner", (len(scene.points),), np.int32)
        raster.find_outlines(scene.triangles, _neighbours(scene), facing, corner, outer)
        raster.mark_rims(edges, box, outer, samples, width, height, _BANDS, rim)
    else:
        rim[:] = 0
    raster.rasterise(
        edges, box, camera.near, samples, jitter, width, height, _BANDS, rim, seen, nearest, farthest,
        sample_seen, sample_depth,
    )  # fmt: skip
    return _Seen(edges, box, facing, seen, sample_seen, jitter)


@dataclass(frozen=True)
class _Sun:
    """How far sunlight gets: depth maps over the sun's disc, and the roof above which it is everywhere."""

    frames: NDArray[np.float32]
    maps: NDArray[np.float32]
    texel: float
    roof_frame: NDArray[np.float32]
    roof: NDArray[np.float32]
    lowest: float


def _sunlight(scene: _Scene, settled: Quality, light: Light, to_sun: NDArray[np.float64]) -> _Sun:
    from muslin.render import raster

    count, texels = settled.sun_maps, settled.sun_texels
    frames, texel = _frames(_sun_disc(to_sun, light.softness, count), scene, texels)
    maps = _buffer("sun", (count * texels**2,))
    bands = 8 if count < 4 else 1
    scratch = _buffer("sun points", (count * bands * len(scene.points) * 3,))
    raster.depth_maps(scene.vertex, scene.casters, frames, 0, texels, bands, scratch, maps)
    return _Sun(frames, maps, texel, *_roof(scene, to_sun, light.softness if count > 1 else 0.0, texel))


def _settings(
    camera: Camera, light: Light, to_sun: NDArray[np.float64], background: tuple[Colour, Colour], sun: _Sun
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


def text_overlay(image: Image, text: str, corner: str = "top left") -> Image:
    """A small caption in a corner of the picture, for example the time; returns a new picture."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    height, width = image.shape[:2]
    unit = max(height / 720, 0.4)
    picture = Pillow.fromarray(image)
    pen = ImageDraw.Draw(picture)
    font = ImageFont.load_default(20 * unit)
    left, top, right, bottom = pen.textbbox((0, 0), text, font=font)
    x = 24 * unit if "left" in corner else width - 24 * unit - (right - left)
    y = 20 * unit if "top" in corner else height - 20 * unit - (bottom - top)
    pen.text((x - left, y - top), text, font=font, fill=_ink(image, x, y, right - left, bottom - top))
    return np.array(picture)


def draw_legend(image: Image, legend: Legend) -> Image:
    """The strain map's scale with ticks and a title in a corner of the picture; returns a new picture."""
    from PIL import Image as Pillow
    from PIL import ImageDraw, ImageFont

    height, width = image.shape[:2]
    unit = max(height / 720, 0.4)
    bar = (int(250 * unit), max(int(14 * unit), 3))
    pad, gap = 16 * unit, 6 * unit
    font, small = ImageFont.load_default(17 * unit), ImageFont.load_default(14 * unit)
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
    values = np.where(t < 0.5, legend.lo + 2 * t * (1 - legend.lo), 1 + (2 * t - 1) * (legend.hi - 1))
    strip = np.repeat(strain_colours(values, legend.lo, legend.hi)[None], bar[1], axis=0)
    picture.paste(Pillow.fromarray(strip), (bx, by))
    pen.rectangle((bx - 1, by - 1, bx + bar[0], by + bar[1]), outline=(120, 124, 130))
    quarter = (legend.lo, (legend.lo + 1) / 2, 1.0, (1 + legend.hi) / 2, legend.hi)
    digits = max(2, int(np.ceil(-np.log10(min(1 - legend.lo, legend.hi - 1) / 2) + 0.3)))
    for where, value in zip((0, 0.25, 0.5, 0.75, 1), quarter, strict=True):
        x = bx + where * (bar[0] - 1)
        pen.line((x, by + bar[1], x, by + bar[1] + gap * 0.7), fill=ink)
        label = f"{value:.{digits}f}".rstrip("0").rstrip(".")
        pen.text((x, by + bar[1] + gap * 1.3), label, font=small, fill=ink, anchor="mt")
    return np.array(picture)


class _Scene:
    """All surfaces as one set of arrays."""

    points: NDArray[np.float64]
    vertex: NDArray[np.float32]
    triangles: NDArray[np.int32]
    casters: NDArray[np.int32]
    surfaces: NDArray[np.float32]
    center: NDArray[np.float64]
    radius: float


def _gather(surfaces: Sequence[Surface], wireframe: bool) -> _Scene:
    from muslin.render import shade

    checked = [s.checked() for s in surfaces]
    counts = [len(s.vertices) for s in checked]
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    faces = np.concatenate([[0], np.cumsum([len(s.triangles) for s in checked])]).astype(np.int32)
    scene = _Scene()
    scene.points = np.zeros((first[-1], 3))
    scene.vertex = np.zeros((first[-1], shade.VERTEX_COLUMNS), dtype=np.float32)
    scene.triangles = np.zeros((faces[-1], 4), dtype=np.int32)
    scene.surfaces = np.zeros((max(len(checked), 1), shade.SURFACE_COLUMNS), dtype=np.float32)
    casters: list[NDArray[np.int32]] = [np.zeros((0, 4), dtype=np.int32)]
    standing = [np.zeros((0, 3))]
    for i, s in enumerate(checked):
        part, face = slice(first[i], first[i + 1]), slice(faces[i], faces[i + 1])
        scene.points[part] = s.vertices
        scene.vertex[part, shade.POSITION : shade.POSITION + 3] = s.vertices
        scene.vertex[part, shade.UV : shade.UV + 2] = s.uv
        scene.vertex[part, shade.VALUE] = s.values
        scene.triangles[face, :3] = s.triangles + first[i]
        scene.triangles[face, 3] = i
        if s.normals is None:
            shade.add_normals(scene.triangles, int(faces[i]), int(faces[i + 1]), scene.vertex)
        else:
            scene.vertex[part, shade.NORMAL : shade.NORMAL + 3] = s.normals
        material = s.material.row()
        scene.surfaces[i, : len(material)] = material
        scene.surfaces[i, shade.SMOOTH] = s.smooth
        scene.surfaces[i, shade.FADE] = s.fade
        scene.surfaces[i, shade.WIRE] = wireframe and not s.prop
        if s.casts_shadow and counts[i]:
            casters.append(scene.triangles[face])
            standing.append(s.vertices)
    normals = scene.vertex[:, shade.NORMAL : shade.NORMAL + 3]
    normals /= np.maximum(np.sqrt((normals * normals).sum(axis=1, keepdims=True)), 1e-30)
    scene.casters = np.concatenate(casters)
    corners = np.concatenate(standing)
    lo, hi = (corners.min(axis=0), corners.max(axis=0)) if len(corners) else (np.zeros(3), np.ones(3))
    scene.center = (lo + hi) / 2
    scene.radius = max(float(np.sqrt(((corners - scene.center) ** 2).sum(axis=1).max(initial=0))), 1e-6)
    return scene


def _light_vertices(
    scene: _Scene,
    settled: Quality,
    up: NDArray[np.float64],
    facing: NDArray[np.int32],
    box: NDArray[np.int32],
) -> None:
    """Fill in what the vertices see of the sky and the floor, where it counts in the picture."""
    from muslin.render import raster, shade

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
    maps = _buffer("sky", (2 * settled.sky_maps * settled.sky_texels**2,))
    scratch = _buffer("sky points", (settled.sky_maps * len(scene.points) * 3,))
    raster.depth_maps(scene.vertex, scene.casters, frames, 1, settled.sky_texels, 1, scratch, maps)
    height = directions @ up
    to_light = np.zeros((2 * settled.sky_maps, 5), dtype=np.float32)
    to_light[: settled.sky_maps, :3] = directions
    to_light[settled.sky_maps :, :3] = -directions
    # sum_k cos_k weight = 1 for a surface that faces up (down) and sees all of the sky (floor).
    to_light[: settled.sky_maps, 3] = 1 / height.sum()
    to_light[settled.sky_maps :, 4] = 1 / height.sum()
    passes = 3
    side = _buffer("side", (len(scene.vertex), 2), np.int32)
    shade.sides_seen(scene.triangles, facing, box, passes, side)
    shade.sky_light(scene.vertex, side, frames, maps, settled.sky_texels, to_light, 1.5 * texel)
    shade.smooth_light(scene.triangles, passes, scene.vertex, _buffer("sums", (len(scene.vertex), 5)))


def _frames(directions: NDArray[np.float64], scene: _Scene, texels: int) -> tuple[NDArray[np.float32], float]:
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
    scene: _Scene, to_sun: NDArray[np.float64], softness: float, texel: float
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
    from muslin.render import raster

    cells, depth = 64, 4 * scene.radius
    frame, cell = _frames(to_sun[None], scene, cells)
    # As far aside as light from the sun's rim comes on its way down, or the depth maps' texels blur.
    around = int(np.ceil((depth * np.tan(np.radians(softness)) * 1.02 + 3 * texel) / cell))
    frame[0, [3, 7]] += around
    roof = _buffer("roof", (cells + 2 * around, cells + 2 * around))
    raster.roof_heights(scene.vertex, scene.casters, frame, roof)
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


_buffers: dict[str, NDArray[Any]] = {}


def _buffer(name: str, shape: tuple[int, ...], dtype: Any = np.float32) -> NDArray[Any]:
    """A scratch array kept from frame to frame: fresh memory costs more than drawing into it."""
    old = _buffers.get(name)
    if old is None or old.shape != shape:
        old = _buffers[name] = np.empty(shape, dtype=dtype)
    return old


_known: list[Any] = []


def _neighbours(scene: _Scene) -> NDArray[np.int32]:
    """The triangle across each edge, opposite vertex 0, 1, 2, or -1 where a smooth surface ends, (m, 3)."""
    from muslin.render import shade

    t = scene.triangles
    smooth = scene.surfaces[:, shade.SMOOTH] > 0
    if _known and np.array_equal(_known[0], t) and np.array_equal(_known[1], smooth):
        return _known[2]  # of the frame before
    ends = np.sort(np.stack([t[:, [1, 2]], t[:, [2, 0]], t[:, [0, 1]]], axis=1).reshape(-1, 2), axis=1)
    key = ends[:, 0].astype(np.int64) * (len(scene.points) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))  # of each run of equal edges
    pairs = first[np.diff(first, append=len(key)) == 2]
    across = np.full(len(key), -1, dtype=np.int32)
    across[order[pairs]], across[order[pairs + 1]] = order[pairs + 1] // 3, order[pairs] // 3
    neighbours = across.reshape(-1, 3)
    neighbours[~smooth[t[:, 3]]] = -1
    _known[:] = [t, smooth, neighbours]
    return neighbours


def _workspace(triangles: int, pixels: int, samples: int) -> tuple[NDArray[Any], ...]:
    return (
        _buffer("edges", (triangles, 9), np.float64),
        _buffer("box", (triangles, 4), np.int32),
        _buffer("facing", (triangles,), np.int32),
        _buffer("outer", (triangles,), np.int32),
        _buffer("rim", (pixels,), np.int32),
        _buffer("seen", (pixels,), np.int32),
        _buffer("nearest", (pixels,)),
        _buffer("farthest", (pixels,)),
        _buffer("sample seen", (pixels * samples,), np.int32),
        _buffer("sample depth", (pixels * samples,)),
    )


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
