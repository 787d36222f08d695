"""Off-screen pictures on the CPU, in Taichi kernels: surfaces and a camera in, an array of bytes out.

    image = draw([cloth, sphere_surface((0, 0, 0), 0.29), ground_surface(-0.5)], fit_camera(cloth.vertices))

| file | what it holds |
|---|---|
| `camera`    | `Camera`, and `fit_camera`, the nearest one that sees every point |
| `materials` | `Material`: solid, weave, checker, strain map; colours |
| `shapes`    | `Surface`: triangles to draw; sphere, capsule, ground |
| `stage`     | colliders and ground around a cloth, its pattern: one look for pictures, exports and viewers |
| `picture`   | `draw`, its qualities; PNG |
| `tables`    | all surfaces as one set of arrays |
| `lighting`  | `Light`; depth maps of sun and sky |
| `lettering` | caption, legend |
| `raster`    | kernels: which triangle a sample sees, how far light gets |
| `colours`   | what a surface's own colour is: strain map, checker, weave |
| `shade`     | kernels: sky, sun, colour of every pixel |
| `movie`     | `Movie`: mp4, WebP, GIF or a folder of PNGs |
| `plot`      | `plot_energies`, `plot_momenta`, `line_plot` |

Importing this starts nothing; Taichi starts and kernels compile with the first picture.
"""

from __future__ import annotations

from muslin.render.camera import Camera, fit_camera
from muslin.render.lettering import Legend, text_overlay
from muslin.render.lighting import Light
from muslin.render.materials import CLOTH, GROUND, MUSLIN, PROP, Material, strain_colours
from muslin.render.movie import Movie, write_movie
from muslin.render.picture import draw, write_png
from muslin.render.plot import line_plot, plot_energies, plot_momenta
from muslin.render.shapes import Surface, capsule_surface, ground_surface, sphere_surface

__all__ = [
    "CLOTH",
    "GROUND",
    "MUSLIN",
    "PROP",
    "Camera",
    "Legend",
    "Light",
    "Material",
    "Movie",
    "Surface",
    "capsule_surface",
    "draw",
    "fit_camera",
    "ground_surface",
    "line_plot",
    "plot_energies",
    "plot_momenta",
    "sphere_surface",
    "strain_colours",
    "text_overlay",
    "write_movie",
    "write_png",
]
