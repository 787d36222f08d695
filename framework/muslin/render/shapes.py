"""Surfaces to draw: the cloth itself, and the props of a scene as light meshes with exact normals."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.base.errors import MuslinError
from muslin.render.materials import CLOTH, GROUND, PROP, Material


@dataclass
class Surface:
    """Triangles and what they are made of.

    Parameters
    ----------
    vertices : (n, 3) array [m]
    triangles : (m, 3) int array
    material : Material
    uv : (n, 2) array, optional
        Pattern coordinates [m], usually the undeformed positions in the cloth's plane; "weave" and "checker"
        follow them.
    values : (n,) array, optional
        The number that a "strain" material paints: a principal stretch, 1 at rest.
    smooth : bool
        Smooth normals, or flat triangles.
    name : str
        For messages.
    normals : (n, 3) array, optional
        Unit normals, if known better than from the triangles.
    prop : bool
        Part of the scenery: not drawn as wireframe.
    casts_shadow : bool
        Whether light is stopped by it.
    fade : bool
        `values` are opacities: 0 is lost in the background, 1 is solid.
    """

    vertices: Any
    triangles: Any
    material: Material = CLOTH
    uv: Any = None
    values: Any = None
    smooth: bool = True
    name: str = "cloth"
    normals: Any = None
    prop: bool = False
    casts_shadow: bool = True
    fade: bool = field(default=False)

    def checked(self) -> Surface:
        """The same surface as contiguous arrays of the right type, all attributes present.

        Raises
        ------
        MuslinError
            If a shape is wrong, an index out of range or a number not finite; the message names it.
        """
        x = np.ascontiguousarray(self.vertices, dtype=np.float64)
        t = np.ascontiguousarray(self.triangles, dtype=np.int32)
        if x.size == 0:
            x = x.reshape(0, 3)
        if t.size == 0:
            t = t.reshape(0, 3)
        if x.ndim != 2 or x.shape[1] != 3:
            raise MuslinError(f"The vertices of {self.name} have shape {x.shape} instead of (n, 3).")
        if t.ndim != 2 or t.shape[1] != 3:
            raise MuslinError(f"The triangles of {self.name} have shape {t.shape} instead of (m, 3).")
        if not np.isfinite(x).all():
            bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
            raise MuslinError(
                f"Vertex {bad[0]} of {self.name} is at {tuple(x[bad[0]])}, which is not a place"
                f" ({len(bad)} of {len(x)} vertices).",
                "The simulation has blown up before this frame: try a smaller time step.",
            )
        if t.size and (t.min() < 0 or t.max() >= len(x)):
            raise MuslinError(
                f"A triangle of {self.name} names vertex {t.max() if t.min() >= 0 else t.min()},"
                f" but there are {len(x)} vertices."
            )
        uv = self._attribute("uv", self.uv, (len(x), 2), self.material.kind in ("weave", "checker"))
        values = self._attribute(
            "values", self.values, (len(x),), self.material.kind == "strain" or self.fade
        )
        normals = None
        if self.normals is not None:
            normals = self._attribute("normals", self.normals, (len(x), 3), True)
        return Surface(
            x, t, self.material, uv, values, self.smooth, self.name, normals, self.prop, self.casts_shadow,
            self.fade,
        )  # fmt: skip

    def _attribute(
        self, what: str, given: ArrayLike | None, shape: tuple[int, ...], needed: bool
    ) -> NDArray[np.float64]:
        if given is None:
            if needed:
                raise MuslinError(
                    f'{self.name} has the material "{self.material.kind}" but no {what}.',
                    f"Give Surface(..., {what}=array of shape {shape}).",
                )
            return np.zeros(shape)
        a = np.ascontiguousarray(given, dtype=np.float64)
        if a.shape != shape:
            raise MuslinError(f"The {what} of {self.name} have shape {a.shape} instead of {shape}.")
        if not np.isfinite(a).all():
            raise MuslinError(f"The {what} of {self.name} contain a number that is not finite.")
        return a


def sphere_surface(center: ArrayLike, radius: float, material: Material = PROP, rings: int = 32) -> Surface:
    """A sphere of `rings` parallels and twice as many meridians, with exact normals.

    A cloth resting on a sphere touches it with its vertices while its triangles are chords: draw the sphere
    a little smaller than it collides (1% is plenty) so that it does not show through.
    """
    return _round("sphere", np.asarray(center, float), np.asarray(center, float), radius, material, rings)


def capsule_surface(
    a: ArrayLike, b: ArrayLike, radius: float, material: Material = PROP, rings: int = 24
) -> Surface:
    """A capsule around the segment from a to b [m]: a cylinder with two half-spheres, exact normals."""
    return _round("capsule", np.asarray(a, float), np.asarray(b, float), radius, material, rings)


def ground_surface(
    height: float = 0.0,
    extent: float = 6.0,
    up: str = "y",
    material: Material = GROUND,
    center: tuple[float, float] = (0.0, 0.0),
) -> Surface:
    """A floor that fades into the background: a disc of radius `extent` [m] without a visible edge.

    Parameters
    ----------
    height : float
        Along the up axis [m].
    extent : float
        Radius of the disc; it is solid in the middle and gone at the rim.
    up : {"x", "y", "z"}
        The axis that is up.
    center : (2,) floats
        The middle, in the other two axes in the order x, y, z.
    """
    axis = "xyz".index(up)
    sectors, rings = 96, 44
    # Fine in the middle, where objects stand and their soft shadows need vertices.
    radius = np.concatenate([[0.0], extent * np.sinh(np.linspace(0, 3.6, rings + 1)[1:]) / np.sinh(3.6)])
    angle = np.arange(sectors) * (2 * np.pi / sectors)
    r = np.concatenate([[0.0], np.repeat(radius[1:], sectors)])
    phi = np.concatenate([[0.0], np.tile(angle, rings)])
    others = [k for k in range(3) if k != axis]
    x = np.zeros((len(r), 3))
    x[:, axis] = height
    x[:, others[0]] = center[0] + r * np.cos(phi)
    x[:, others[1]] = center[1] + r * np.sin(phi)
    s = np.arange(sectors)
    triangles = [np.stack([np.zeros_like(s), 1 + s, 1 + (s + 1) % sectors], axis=1)]
    inner = 1 + sectors * np.arange(rings - 1)[:, None] + s
    inner_next = 1 + sectors * np.arange(rings - 1)[:, None] + (s + 1) % sectors
    triangles += _quads(inner, inner + sectors, inner_next + sectors, inner_next)
    t = np.concatenate(triangles)
    if axis == 1:  # x, z, y is left-handed
        t = t[:, ::-1]
    normal = np.zeros_like(x)
    normal[:, axis] = 1
    q = np.clip((r / extent - 0.3) / 0.7, 0, 1)
    fade = 1 - q * q * (3 - 2 * q)
    return Surface(
        x, t, material, values=fade, name="ground", normals=normal, prop=True, casts_shadow=False, fade=True
    )


def _round(
    name: str, a: NDArray[np.float64], b: NDArray[np.float64], radius: float, material: Material, rings: int
) -> Surface:
    """Two half-spheres of `rings` / 2 parallels each around a and b, joined by a tube."""
    if not (np.isfinite(a).all() and np.isfinite(b).all() and radius > 0):
        raise MuslinError(f"A {name} needs finite points and a positive radius, not {a}, {b}, {radius}.")
    length = np.linalg.norm(b - a)
    w = (b - a) / length if length > 0 else np.array([0.0, 1.0, 0.0])
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w))])
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    half = max(rings // 2, 2)
    sectors = 4 * half
    theta = np.linspace(0, np.pi / 2, half + 1)
    low = np.concatenate([-np.cos(theta[:-1]), [0.0]])  # from the south pole up to the equator
    height = (
        np.concatenate([low[1:], -low[::-1][:-1]])
        if length > 0
        else np.concatenate([low[1:], -low[::-1][1:-1]])
    )
    ends = np.concatenate([np.zeros(half), np.ones(len(height) - half)])
    phi = np.arange(sectors) * (2 * np.pi / sectors)
    across = np.sqrt(np.maximum(0, 1 - height**2))
    ring = across[:, None, None] * (np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * v)
    n = (ring + height[:, None, None] * w).reshape(-1, 3)
    base = np.repeat(a + ends[:, None] * (b - a), sectors, axis=0)
    normals = np.concatenate([[-w], n, [w]])
    vertices = np.concatenate([[a], base, [b]]) + radius * normals
    s = np.arange(sectors)
    following = (s + 1) % sectors
    last = 1 + sectors * (len(height) - 1)
    top = 1 + sectors * len(height)
    rows = 1 + sectors * np.arange(len(height) - 1)[:, None]
    triangles = [
        np.stack([np.zeros_like(s), 1 + following, 1 + s], axis=1),
        np.stack([np.full_like(s, top), last + s, last + following], axis=1),
        *_quads(rows + s, rows + following, rows + sectors + following, rows + sectors + s),
    ]
    return Surface(vertices, np.concatenate(triangles), material, name=name, normals=normals, prop=True)


def _quads(a: Any, b: Any, c: Any, d: Any) -> list[NDArray[np.int64]]:
    """Two triangles for each quadrilateral a, b, c, d."""
    return [np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)]
