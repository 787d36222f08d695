"""What is exported: a moving surface, the props around it, and what every format needs to know of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from muslin.base.errors import MuslinError
from muslin.render.materials import linear

CLOTH_COLOUR, PROP_COLOUR = "#d9c7a6", "#8d99a6"  # sRGB
ROUGHNESS_CLOTH, ROUGHNESS_PROP = 0.9, 0.6
_FARTHEST = 1e30  # [m] beyond it a coordinate is no place, and squares of it no longer fit float32


class Frames(Protocol):
    """Anything with a length whose item k is frame k, (n, 3): a list, an array, a lazily read file."""

    def __len__(self) -> int: ...

    def __getitem__(self, k: int, /) -> Any: ...


@dataclass(frozen=True, eq=False)
class Prop:
    """A collider or other scenery, tessellated.

    Parameters
    ----------
    name : str
    triangles : (m, 3) int
    frames : (n, 3) float, or sequence of k arrays (n, 3)
        Positions [m]: one array if the prop stands still, one per frame of the animation if it moves.
    colour : str
        sRGB, "#rrggbb".

    Raises
    ------
    MuslinError
        If the triangles or the colour are malformed.
    """

    name: str
    triangles: np.ndarray
    frames: Any
    colour: str = PROP_COLOUR

    def __post_init__(self) -> None:
        _set(self, triangles=_triangles(self.triangles, self.name))
        linear(self.colour)
        if isinstance(self.frames, np.ndarray) and self.frames.ndim == 2:
            _set(self, frames=[self.frames])

    @property
    def moves(self) -> bool:
        """Whether the prop has a frame of its own for each frame of the animation."""
        return len(self.frames) > 1

    def at(self, k: int) -> np.ndarray:
        """Positions in frame k, (n, 3) float64 [m]."""
        return _positions(self.frames, k if self.moves else 0, self.triangles, self.name)


@dataclass(frozen=True, eq=False)
class Solid:
    """The tetrahedra inside a surface that moves; only formats for analysis take them.

    Parameters
    ----------
    frames : sequence of k arrays (n, 3)
        Positions [m].
    cells : (m, 4) int
    rest : (n, 3)
        Undeformed positions [m].
    stress : callable (n, 3) -> (m,), optional
        Von Mises stress of the tetrahedra [Pa].
    """

    frames: Frames
    cells: np.ndarray
    rest: np.ndarray
    stress: Callable[[np.ndarray], np.ndarray] | None = None


@dataclass(frozen=True, eq=False)
class Shape:
    """A cloth in one frame, on the mesh it has in that frame.

    Parameters
    ----------
    x, rest : (n, 3) float
        Positions, deformed and undeformed [m].
    triangles : (m, 3) int
    strain : (n,) float
        A number per vertex to colour it by [1].
    """

    x: np.ndarray
    rest: np.ndarray
    triangles: np.ndarray
    strain: np.ndarray


@dataclass(frozen=True, eq=False)
class Animation:
    """A cloth in motion. Y is up.

    Parameters
    ----------
    times : (k,) float
        Time of each frame [s], increasing from 0 or later.
    frames : sequence of k arrays (n, 3)
        Positions [m]. Each writer asks for each frame once, in order, and keeps none, so that `frames` may
        read them from disk.
    triangles : (m, 3) int
    rest : (n, 3) float
        Undeformed positions [m]: texture coordinates and displacements refer to them.
    name : str
        Of the cloth: names objects, and files where the path names only a folder.
    props : tuple of Prop
    strain : callable k -> (n,) float or None, optional
        A number per vertex to colour frame k by [1], where there is one.
    colour : str
        sRGB, "#rrggbb".
    solid : Solid, optional
        What is inside.
    adapted : callable k -> Shape, optional
        Where the cloth's mesh changes: what it is in frame k. Formats with a mesh for each frame that have a use for
        it take this; for others `frames` are the same cloth on one mesh.

    Raises
    ------
    MuslinError
        If shapes, counts or indices disagree, times do not increase, or a number is not finite.
    """

    times: np.ndarray
    frames: Frames
    triangles: np.ndarray
    rest: np.ndarray
    name: str = "cloth"
    props: tuple[Prop, ...] = ()
    strain: Callable[[int], Any] | None = None
    colour: str = CLOTH_COLOUR
    solid: Solid | None = None
    adapted: Callable[[int], Shape] | None = None

    def __post_init__(self) -> None:
        times = np.asarray(self.times, dtype=np.float64)
        if times.ndim != 1 or not len(times):
            raise MuslinError(f"There is nothing to export: the times have shape {times.shape}.")
        if len(self.frames) != len(times):
            raise MuslinError(f"There are {len(self.frames)} frames but {len(times)} times.")
        if not np.isfinite(times).all() or times[0] < 0 or (np.diff(times) <= 0).any():
            raise MuslinError("The times of the frames do not increase from 0 or later.")
        triangles = _triangles(self.triangles, self.name)
        rest = _positions([self.rest], 0, triangles, f"{self.name} (undeformed)")
        linear(self.colour)
        for prop in self.props:
            if len(prop.frames) not in (1, len(times)):
                raise MuslinError(
                    f"The prop {prop.name!r} has {len(prop.frames)} frames, the animation {len(times)}.",
                    "Give a prop one frame, or one for each frame of the animation.",
                )
        _set(self, times=times, triangles=triangles, rest=rest, props=tuple(self.props))

    def __len__(self) -> int:
        return len(self.times)

    def at(self, k: int) -> np.ndarray:
        """Positions in frame k, (n, 3) float64 [m].

        Raises
        ------
        MuslinError
            If the frame is not as large as the rest shape or holds numbers that are not places.
        """
        return _positions(self.frames, k, self.triangles, self.name, len(self.rest))

    def strain_at(self, k: int) -> np.ndarray | None:
        """Strain in frame k, (n,) float64 [1], or None."""
        values = None if self.strain is None else self.strain(k)
        if values is None:
            return None
        values = np.asarray(values, dtype=np.float64)
        if values.shape != (len(self.rest),):
            raise MuslinError(
                f"The strain of frame {k} has shape {values.shape} instead of ({len(self.rest)},)."
            )
        return values


@dataclass(frozen=True, eq=False)
class Body:
    """The cloth or a prop, as the scene formats see it: a name of its own, a motion, a colour."""

    name: str
    triangles: np.ndarray
    at: Callable[[int], np.ndarray]
    moves: bool
    colour: str
    rest: np.ndarray | None = None


def bodies(animation: Animation) -> Iterator[Body]:
    """The cloth, then the props, with names that differ and are identifiers."""
    taken: set[str] = set()
    things: list[Animation | Prop] = [animation, *animation.props]
    for thing in things:
        stem = identifier(thing.name)
        name = next(n for n in (stem, *(f"{stem}_{i}" for i in range(2, len(taken) + 3))) if n not in taken)
        taken.add(name)
        if isinstance(thing, Animation):
            yield Body(name, thing.triangles, thing.at, len(thing) > 1, thing.colour, thing.rest)
        else:
            yield Body(name, thing.triangles, thing.at, thing.moves, thing.colour)


def identifier(name: str) -> str:
    """The name with ASCII letters, digits and underscores only, not starting with a digit."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "cloth"
    return f"_{name}" if name[0].isdigit() else name


def unit_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normal at each vertex, (n, 3) float64; straight up where the surface has none."""
    from muslin.mesh.surface import vertex_normals

    n = vertex_normals(vertices, triangles)
    n[~n.any(axis=1)] = [0.0, 1.0, 0.0]
    return n


def _set(thing: Any, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(thing, name, value)  # the dataclasses are frozen


def _triangles(triangles: Any, name: str) -> np.ndarray:
    t = np.asarray(triangles)
    if t.ndim != 2 or t.shape[1] != 3 or not len(t) or t.dtype.kind not in "iu":
        raise MuslinError(
            f"The triangles of {name!r} are {t.dtype} {t.shape} instead of whole numbers (m, 3)."
        )
    if t.min() < 0:
        raise MuslinError(f"A triangle of {name!r} names vertex {t.min()}: vertices count from 0.")
    return np.ascontiguousarray(t, dtype=np.int32)


def _positions(frames: Any, k: int, triangles: np.ndarray, name: str, n: int | None = None) -> np.ndarray:
    x = np.asarray(frames[k], dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != 3 or (n is not None and len(x) != n):
        expected = f"({n if n is not None else 'n'}, 3)"
        raise MuslinError(f"Frame {k} of {name!r} has shape {x.shape} instead of {expected}.")
    if triangles.max() >= len(x):
        raise MuslinError(f"A triangle of {name!r} names vertex {triangles.max()}, but there are {len(x)}.")
    bad = ~(np.abs(x) < _FARTHEST).all(axis=1)
    if bad.any():
        i = int(np.argmax(bad))
        raise MuslinError(
            f"Vertex {i} of {name!r} is at {tuple(x[i].tolist())} in frame {k}, which is not a place"
            f" ({np.count_nonzero(bad)} of {len(x)} vertices).",
            "The simulation has blown up before this frame: export fewer frames, or try a smaller time step.",
        )
    return x
