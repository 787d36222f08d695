"""The tables that the kernels of `raster` and `shade` read: all surfaces as one set of arrays, and scratch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.render.shapes import Surface


class Scene:
    """All surfaces as one set of arrays."""

    points: NDArray[np.float64]
    vertex: NDArray[np.float32]
    triangles: NDArray[np.int32]
    casters: NDArray[np.int32]
    surfaces: NDArray[np.float32]
    center: NDArray[np.float64]
    radius: float


def gather(surfaces: Sequence[Surface], wireframe: bool) -> Scene:
    """Put surfaces, checked, into one scene; `wireframe`: draw the edges of those that are no props."""
    from muslin.render import shade

    checked = [s.checked() for s in surfaces]
    counts = [len(s.vertices) for s in checked]
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    faces = np.concatenate([[0], np.cumsum([len(s.triangles) for s in checked])]).astype(np.int32)
    scene = Scene()
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


_buffers: dict[str, NDArray[Any]] = {}


def buffer(name: str, shape: tuple[int, ...], dtype: Any = np.float32) -> NDArray[Any]:
    """A scratch array kept from frame to frame: fresh memory costs more than drawing into it."""
    old = _buffers.get(name)
    if old is None or old.shape != shape:
        old = _buffers[name] = np.empty(shape, dtype=dtype)
    return old


_known: list[Any] = []


def neighbours(scene: Scene) -> NDArray[np.int32]:
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


def workspace(triangles: int, pixels: int, samples: int) -> tuple[NDArray[Any], ...]:
    """Scratch of `raster`: edges, box, facing, outer, rim, seen, nearest, farthest; by sample: seen, depth."""
    return (
        buffer("edges", (triangles, 9), np.float64),
        buffer("box", (triangles, 4), np.int32),
        buffer("facing", (triangles,), np.int32),
        buffer("outer", (triangles,), np.int32),
        buffer("rim", (pixels,), np.int32),
        buffer("seen", (pixels,), np.int32),
        buffer("nearest", (pixels,)),
        buffer("farthest", (pixels,)),
        buffer("sample seen", (pixels * samples,), np.int32),
        buffer("sample depth", (pixels * samples,)),
    )
