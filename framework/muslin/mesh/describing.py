"""What a mesh is, in a few lines for a person."""

from __future__ import annotations

import os

import numpy as np

from muslin.mesh.surface import Mesh, area_and_normal, boundary, edges
from muslin.mesh.tetfiles import load_any
from muslin.mesh.tets import TetMesh


def describe(path: str | os.PathLike[str]) -> list[str]:
    """Lines about the solid or the surface in a file: how many of what, how large, in what shape, and its notices.

    Raises
    ------
    MeshError
        If it cannot be read, or is neither.
    """
    mesh = load_any(path)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    box = " x ".join(f"{side:.4g}" for side in high - low)
    lines = _solid(mesh) if isinstance(mesh, TetMesh) else _surface(mesh)
    return [*lines, f"box: {box} m, from {_point(low)} to {_point(high)}", *mesh.notices]


def _solid(mesh: TetMesh) -> list[str]:
    shell, volume = mesh.shell(), mesh.volumes
    area, _ = area_and_normal(shell.vertices, shell.triangles)
    # three of a tetrahedron's faces have all its edges
    faces = np.concatenate([mesh.cells[:, [0, 1, 2]], mesh.cells[:, [1, 2, 3]], mesh.cells[:, [0, 1, 3]]])
    return [
        f"{mesh.name}: a solid of {len(mesh.vertices)} vertices and {len(mesh.cells)} tetrahedra",
        f"volume: {volume.sum():.4g} m^3; a tetrahedron's: {volume.min():.3g} to {volume.max():.3g}",
        f"surface: {len(shell.vertices)} vertices, {len(shell.triangles)} triangles, {area.sum():.4g} m^2",
        f"edges: {_lengths(mesh.vertices, faces)}",
    ]


def _surface(mesh: Mesh) -> list[str]:
    area, _ = area_and_normal(mesh.vertices, mesh.triangles)
    rim = len(boundary(mesh.triangles))
    closed = f"{rim} vertices on its boundary" if rim else "closed"
    return [
        f"{mesh.name}: a surface of {len(mesh.vertices)} vertices and {len(mesh.triangles)} triangles, {closed}",
        f"area: {area.sum():.4g} m^2; a triangle's: {area.min():.3g} to {area.max():.3g}",
        f"edges: {_lengths(mesh.vertices, mesh.triangles)}",
    ]


def _lengths(X: np.ndarray, triangles: np.ndarray) -> str:
    a, b = edges(triangles).T
    length = np.linalg.norm(X[a] - X[b], axis=1)
    return f"{len(length)}, {length.min():.3g} to {length.max():.3g} m long"


def _point(x: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in x) + ")"
