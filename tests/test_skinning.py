"""A display mesh on a simulation mesh: the nearest triangle, whatever the meshes are like."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.mesh import Mesh, TetMesh, ball, grid, unstructured
from muslin.physics.skinning import _distances, _nearest_triangle, bind


def graded(n=24):
    """A sheet whose triangles are a thousandth as wide at the left as at the right, and long."""
    cloth = grid(n, 5)
    x = np.geomspace(1e-3, 1.0, n)
    X = cloth.vertices.copy()
    X[:, 0] = x[np.round((X[:, 0] + 0.5) * (n - 1)).astype(int)]
    return Mesh.from_arrays(X, cloth.triangles)


def folded():
    """A sheet rolled up nearly onto itself."""
    cloth = unstructured(1, 1, 0.08)
    X = cloth.vertices
    radius = 0.05 + 0.01 * (X[:, 0] + 0.5)
    return Mesh.from_arrays(
        np.stack([radius * np.cos(7 * X[:, 0]), X[:, 1], radius * np.sin(7 * X[:, 0])], axis=1),
        cloth.triangles,
    )


@pytest.mark.parametrize("make", [graded, folded, lambda: grid(2, 2), lambda: unstructured(2, 1, 0.1)])
def test_the_nearest_triangle_is_the_nearest_of_all(make):
    mesh, rng = make(), np.random.default_rng(0)
    low, high = mesh.vertices.min(axis=0) - 0.2, mesh.vertices.max(axis=0) + 0.2
    points = np.concatenate(
        [rng.uniform(low, high, (200, 3)), mesh.vertices, mesh.vertices[mesh.triangles].mean(axis=1)]
    )
    corners = mesh.vertices[mesh.triangles]
    every = np.stack([_distances(points, *np.broadcast_to(t[:, None], (3, *points.shape))) for t in corners])
    found = every[_nearest_triangle(points, mesh), np.arange(len(points))]
    np.testing.assert_allclose(found, every.min(axis=0), atol=1e-12)


def test_the_distance_from_a_triangle_is_that_of_its_nearest_point():
    rng = np.random.default_rng(1)
    a, b, c, p = rng.standard_normal((4, 50, 3))
    s, t = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    s, t = s[s + t <= 1 + 1e-9], t[s + t <= 1 + 1e-9]
    on = a[:, None] + s[:, None] * (b - a)[:, None] + t[:, None] * (c - a)[:, None]
    sampled = np.linalg.norm(on - p[:, None], axis=2).min(axis=1)
    found = _distances(p, a, b, c)
    assert (found <= sampled + 1e-12).all()
    assert (sampled - found).max() < 0.02


def test_a_fine_mesh_on_a_graded_one_keeps_between_the_corners_of_its_triangles():
    mesh = graded()
    fine = grid(40, 40)
    shown = Mesh.from_arrays(fine.vertices * [0.999, 1, 1] + np.array([0.5005, 0, 0]), fine.triangles)
    skin = bind(shown, mesh)
    assert skin.phi.min() > -1e-9
    np.testing.assert_allclose(skin.carry(mesh.vertices), shown.vertices, atol=1e-12)


def test_a_point_in_a_large_tetrahedron_among_many_small_ones_is_found_in_it():
    small = ball(5, 0.02)
    corners = np.array([[-3, -1, -1], [1, -1, -1], [-1, 2, -1], [-1, -1, 4]], float)
    away = small.vertices + np.array([0.9, -0.95, -0.96]) - small.vertices.mean(axis=0) + [0.3, 0, 0]
    mesh = TetMesh.from_arrays(
        np.concatenate([corners, away]), np.concatenate([[[0, 1, 2, 3]], small.cells + 4])
    )
    inside = np.array([[0.8, -0.95, -0.96], [0.7, -0.9, -0.95], [0.85, -0.97, -0.97]])
    shown = Mesh.from_arrays(inside, [[0, 1, 2]])
    skin = bind(shown, mesh)
    assert skin.phi.min() > 0
