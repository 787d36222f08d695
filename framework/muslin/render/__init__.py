"""Off-screen pictures on the CPU, in Taichi kernels: surfaces and a camera in, an array of bytes out.

Imported when first used; `import muslin.render` starts nothing.
"""

from __future__ import annotations

from muslin.render.camera import Camera, fit_camera
from muslin.render.materials import CLOTH, GROUND, PROP, Material
from muslin.render.picture import Legend, Light, draw, text_overlay, write_png
from muslin.render.shapes import Surface, capsule_surface, ground_surface, sphere_surface

__all__ = [
    "CLOTH",
    "GROUND",
    "PROP",
    "Camera",
    "Legend",
    "Light",
    "Material",
    "Surface",
    "capsule_surface",
    "draw",
    "fit_camera",
    "ground_surface",
    "sphere_surface",
    "text_overlay",
    "write_png",
]
