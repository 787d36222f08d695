"""A run as pictures and films: where runs meet rendering."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin import render
from muslin.base import handed, paths
from muslin.base.errors import MuslinError
from muslin.mesh.surface import frozen
from muslin.physics.colliders import Capsule, Sphere
from muslin.physics.skinning import Skin, bind
from muslin.render import stage
from muslin.simulation.runs import RunFolder

if TYPE_CHECKING:
    from muslin.present.pair import Pair
from muslin.present.naming import beside, placed
from muslin.present.strain import solid_strain, vertex_strain, vertex_stress

#: The cloth's back: a shade darker than its front, so that folds read as one cloth.
BACK = "#a63d2b"

#: What solids are made of: smooth, with highlights.
JELLY = render.Material("solid", "#c23b2e", roughness=0.35, translucency=0.1)


class Show:
    """What there is to see in a run, frame by frame.

    Parameters
    ----------
    run : RunFolder
    size : (width, height)
        Of the picture [pixels].
    quality : {"draft", "good", "best"}
    strain : bool
        Colour the cloth by its largest principal stretch, with a legend.
    stress : bool
        Colour a solid by its von Mises stress, with a legend.
    wireframe : bool
        Draw the triangles' edges.
    around : (k, 3) array, optional
        Points that the camera must see, for a run that is not there to the end yet [m]. Default: the cloth
        and the colliders in the whole run.
    """

    def __init__(
        self,
        run: RunFolder,
        size: tuple[int, int] = (1280, 720),
        quality: str = "good",
        strain: bool = False,
        wireframe: bool = False,
        stress: bool = False,
        around: Any = None,
    ):
        self.run, self.size, self.quality, self.wireframe = run, size, quality, wireframe
        self.scene = run.scene
        self.uv = stage.pattern(run.rest)
        self._longest = stage.longest_edge(run.X, run.triangles)
        self.cloth = replace(render.CLOTH, back=BACK) if run.cells is None else JELLY
        self.legend = None
        if strain:
            most = max(1.02, *(float(self.strain(k).max()) for k in _some(len(self.frames), 12)))
            reach = round(min(most - 1, 0.95) * 1.05, 2)
            self.cloth = render.Material("strain", lo=1 - reach, hi=1 + reach)
            self.legend = render.Legend(1 - reach, 1 + reach)
        self._top = 0.0
        if stress:
            if strain:
                raise MuslinError("A picture shows strain or stress, not both.", "Choose one.")
            highest = (np.percentile(self.stress(k), 99.5) for k in _some(len(self.frames), 12))
            self._top = max(1e-30, *map(float, highest))
            self.cloth = render.Material("strain", lo=0.0, hi=2.0)
            self.legend = render.Legend(0.0, 2.0, "von Mises stress [kPa]", top=self._top / 1e3)
        self._cameras: dict[int, render.Camera] = {}
        self._walls = [] if run.cells is None else stage.walls(run.X, run.pinned)
        self._ground = stage.ground(self.scene.ground or 0.0)
        self._fixed = None if around is None else render.fit_camera(around, self.scene.view, size)

    @property
    def times(self) -> np.ndarray:
        """Time of each frame, (k,) [s]."""
        return self.run.times

    @property
    def frames(self) -> Sequence[np.ndarray]:
        """Positions of what is shown, frame by frame."""
        return self.run.frames

    def strain(self, k: int) -> np.ndarray:
        """Principal stretch that is furthest from 1, averaged onto the vertices shown, (n,) [1]."""
        if self.run.cells is None:
            rest, triangles = self.run.mesh_of(k)
            return vertex_strain(rest, self.frames[k], triangles)
        inside = solid_strain(self.run.X, self.run.simulated[k], self.run.cells)
        return self._shown(inside)

    def stress(self, k: int) -> np.ndarray:
        """Von Mises stress of a solid, averaged onto the vertices shown, (n,) [Pa]."""
        return self._shown(self._stress(self.run.simulated[k]))

    @functools.cached_property
    def _stress(self) -> Callable[[np.ndarray], np.ndarray]:
        return vertex_stress(self.run)

    def _shown(self, inside: np.ndarray) -> np.ndarray:
        return inside if self._skin is None else self._skin.carry(inside[:, None])[:, 0]

    @functools.cached_property
    def _skin(self) -> Skin | None:
        """How the solid inside carries what is shown, if that is not its own surface."""
        solid = self.run.solid
        if solid is None or self.run.rest is self.run.X:
            return None
        return bind(frozen(self.run.rest, self.run.shown_triangles, "skin"), solid)

    @functools.cached_property
    def _creased(self) -> tuple[np.ndarray, np.ndarray] | None:
        """A solid's surface as it is drawn, with sharp edges."""
        return None if self.run.cells is None else stage.creased(*self.run.mesh_of(0))

    def surfaces(self, k: int) -> list[render.Surface]:
        """What moves, what holds it, colliders and ground in frame k."""
        values = (
            None if self.legend is None else 1 + self.stress(k) / self._top if self._top else self.strain(k)
        )
        rest, triangles = self.run.mesh_of(k)
        uv = self.uv if rest is self.run.rest else stage.pattern(rest)
        rows, triangles = self._creased or (slice(None), triangles)
        values = None if values is None else values[rows]
        cloth = render.Surface(self.frames[k][rows], triangles, self.cloth, uv[rows], values)
        drawn = ((c, stage.drawn_radius(c, self.scene.contact, self._longest)) for c in self.colliders(k))
        others = [*self._walls, *(stage.collider_surface(c, radius) for c, radius in drawn)]
        if self.scene.ground is not None:
            middle = self.frames[k].mean(axis=0) * (1, 0, 1)
            others.append(replace(self._ground, vertices=self._ground.vertices + middle))
        return [cloth, *others]

    def colliders(self, k: int) -> list[Sphere | Capsule]:
        """Colliders with a body, in frame k."""
        there = self.scene.colliders(self.scene, float(self.times[k]))
        return [c for c in there if isinstance(c, (Sphere, Capsule))]

    def camera(self, k: int) -> render.Camera:
        """Camera of frame k: the same for all, framing the whole motion, unless the scene wants it to follow."""
        if self._fixed is not None:
            return self._fixed
        if self.scene.camera != "follow":
            k = 0
        if k not in self._cameras:
            whole = self.whole + 1  # of an explosion one wants to see the start
            every = _some(whole, 60)
            middle = self._middles(every)
            points = [self._points(j) - (middle(j) if self.scene.camera == "follow" else 0.0) for j in every]
            fitted = render.fit_camera(np.concatenate(points), self.scene.view, self.size)
            shift = middle(k) if self.scene.camera == "follow" else np.zeros(3)
            eye, target = np.asarray(fitted.eye) + shift, np.asarray(fitted.target) + shift
            self._cameras[k] = render.Camera(_vec(eye), _vec(target), fitted.up, fitted.fov, fitted.near)
            if self.scene.camera == "follow":  # fitting looks at the whole motion: do it once
                for j in range(len(self.frames)):
                    eye, target = np.asarray(fitted.eye) + middle(j), np.asarray(fitted.target) + middle(j)
                    self._cameras[j] = render.Camera(
                        _vec(eye), _vec(target), fitted.up, fitted.fov, fitted.near
                    )
        return self._cameras[k]

    @functools.cached_property
    def whole(self) -> int:
        """The last frame before the cloth has come apart, if it has."""
        most = 5 * np.ptp(self.frames[0], axis=0).max()
        broken = (k for k, x in enumerate(self.frames) if not np.ptp(x, axis=0).max() <= most)
        return max(0, next(broken, len(self.frames)) - 1)

    def _middles(self, every: np.ndarray) -> Callable[[int], np.ndarray]:
        """Smooth path of what is pinned (or of the whole cloth), for a camera that follows."""
        pinned = self.run.pinned
        path = np.stack(
            [f[pinned].mean(axis=0) if len(pinned) else f.mean(axis=0) for f in self.run.simulated]
        )
        path[:, 1] = path[:, 1].mean()
        return lambda k: path[k]

    def _points(self, k: int) -> np.ndarray:
        bodies = [stage.collider_corners(c) for c in self.colliders(k)]
        return np.concatenate([self.frames[k], *bodies, *(wall.vertices for wall in self._walls)])

    def picture(self, k: int) -> np.ndarray:
        """Frame k as a picture, (height, width, 3) uint8."""
        return self._drawn(k, self.camera(k))

    def still(self, k: int) -> np.ndarray:
        """The same, framed by what has happened until then: a cloth that slides away later leaves it as it is."""
        if self._fixed is not None or self.scene.camera == "follow":
            return self.picture(k)
        points = np.concatenate([self._points(j) for j in _some(k + 1, 60)])
        return self._drawn(k, render.fit_camera(points, self.scene.view, self.size))

    def _drawn(self, k: int, camera: render.Camera) -> np.ndarray:
        return render.draw(
            self.surfaces(k),
            camera,
            self.size,
            self.quality,
            wireframe=self.wireframe,
            legend=self.legend,
        )


def render_run(
    folder: Path | str,
    out: Path | str | None = None,
    film: str | None = None,
    still: float | None = None,
    on_frame: Callable[[int, int], None] | None = None,
    every: int = 1,
    **options: Any,
) -> list[Path]:
    """Render a run: a film, a still, an energy plot.

    Parameters
    ----------
    folder : path
        A run.
    out : path, optional
        Name of the film, `fall.mp4`, or of film and pictures without their endings; a folder (one that is there,
        or a path that ends in a slash) gets files named like the scene. Default `folder/<scene>`.
    film : {"mp4", "webp", "gif", "frames", "none"}, optional
        Default: what the ending of `out` says (of `fall.png` no film), else mp4.
    still : float, optional
        Time of the still [s]; default the scene's, or the last frame's.
    on_frame : callable, optional
        Called as (frame, frames) after every frame of the film.
    every : int
        Film only every so many frames, at as many fewer frames per second.
    **options
        size, quality, strain, stress, wireframe: see `Show`.

    Returns
    -------
    list of Path
        Files written: still, energy plot, film.

    Raises
    ------
    MuslinError
        If the folder is not a run or a format is unknown.
    """
    run = RunFolder(folder)
    base, film = placed(out, film, run)
    show = Show(run, **options)
    base.parent.mkdir(parents=True, exist_ok=True)
    plots = energy_plot(run, base)
    still_, *films = _pictures(show, base, film, still, on_frame, every)
    return [still_, *plots, *films]


def render_pair(
    folder: Path | str,
    reference: Path | str,
    out: Path,
    film: str | None = "mp4",
    on_frame: Callable[[int, int], None] | None = None,
    **options: Any,
) -> list[Path]:
    """Render two runs of one scene side by side: a film and a still; see `render_run`.

    Parameters
    ----------
    folder, reference : path
        Runs: the one on the left, and the one beside it, whose camera and colours both have.
    out : path
        Path of film and still without their endings.
    film : {"mp4", "webp", "gif", "frames"}, optional
        None for no film.
    on_frame : callable, optional
        Called as (frame, frames).
    **options
        size, quality, strain, stress, wireframe: see `Show`.
    """
    from muslin.present.pair import Pair

    out.parent.mkdir(parents=True, exist_ok=True)
    return _pictures(Pair(RunFolder(folder), RunFolder(reference), **options), out, film, None, on_frame)


def _pictures(
    show: Show | Pair,
    base: Path,
    film: str | None,
    still: float | None,
    on_frame: Callable[[int, int], None] | None,
    every: int = 1,
) -> list[Path]:
    """Write a still and a film; returns the files."""
    still = show.scene.still if still is None else handed.number("still", still)
    if still is not None and still < 0:
        raise MuslinError(f"still = {still:g} s is before the run begins.", "It begins at 0.")
    k = len(show.times) - 1 if still is None else int(np.argmin(np.abs(show.times - still)))
    written = [render.write_png(beside(base, ".png"), show.still(min(k, show.whole)))]
    if film is not None:
        target = beside(base, "-frames" if film == "frames" else f".{film}")
        filmed = range(0, len(show.times), every)
        with render.Movie(target, show.size, max(1, show.scene.fps // every)) as movie:
            for number, frame in enumerate(filmed):
                movie.add(show.picture(frame))
                if on_frame:
                    on_frame(number + 1, len(filmed))
        written.append(target)
    return written


def energy_plot(run: RunFolder, base: Path) -> list[Path]:
    """Plot a run's energies and momenta beside `base`; returns the file, or nothing for a run of one row."""
    table = run.energies
    if len(table) < 2:
        return []
    energies = {name: table[column] for name, column in run.scene.energy_names.items()}
    image = render.plot_energies(energies, table["time"], title=run.scene.title)
    momenta = render.plot_momenta({name: table[name] for name in table.dtype.names}, table["time"])
    return [render.write_png(beside(base, "-energies.png"), np.concatenate([image, *momenta]))]


def _some(count: int, most: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def _vec(v: np.ndarray) -> tuple[float, float, float]:
    return (float(v[0]), float(v[1]), float(v[2]))


def shown(files: list[Path]) -> str:
    """Files as a list for people."""
    return ", ".join(paths.shown(file) for file in files)
