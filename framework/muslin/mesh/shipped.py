"""The meshes in data/meshes, as calls of the generators. `python -m muslin.mesh.shipped` writes them again."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from muslin.base.paths import meshes
from muslin.mesh.files import obj_text
from muslin.mesh.shapes import grid, sector, unstructured


def course_square() -> tuple[np.ndarray, np.ndarray]:
    """Unit square of the course scene: 400 vertices, 722 triangles."""
    mesh = grid(20, 20)
    return mesh.vertices, mesh.triangles


def cape() -> tuple[np.ndarray, np.ndarray]:
    """Sector of a ring: neck radius 0.18 m, hem radius 1.1 m, 2.2 rad."""
    mesh = sector(0.18, 1.1, 2.2, spacing=0.022)
    return mesh.vertices, mesh.triangles


def square_unstructured() -> tuple[np.ndarray, np.ndarray]:
    """Unit square of irregular triangles, about as fine as the course's."""
    mesh = unstructured(1.0, 1.0, spacing=0.05)
    return mesh.vertices, mesh.triangles


def quads() -> tuple[np.ndarray, np.ndarray]:
    """Unit square of 4 x 4 quads: `load` cuts them into 32 triangles and says so."""
    corners = grid(5, 5).vertices
    a = (np.arange(4) + 5 * np.arange(4)[:, None]).ravel()
    return corners, np.stack([a, a + 1, a + 6, a + 5], axis=1)


# File name -> maker of (vertices, faces).
SHIPPED = {
    "course-square.obj": course_square,
    "cape.obj": cape,
    "square-unstructured.obj": square_unstructured,
    "quads.obj": quads,
}


def write(folder: Path) -> None:
    """Write every shipped mesh into a folder."""
    for name, make in SHIPPED.items():
        vertices, faces = make()
        title = (make.__doc__ or "").strip()
        comment = f"{title} Made by muslin.mesh.shipped; MIT licence."
        (folder / name).write_text(obj_text(vertices, faces, comment), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write(meshes())
