"""Generated meshes have the area, topology, angles and winding that their formulas promise."""

import subprocess
import sys
import time

import numpy as np
import pytest

from muslin.base.errors import MeshError
from muslin.mesh import (
    Mesh,
    area_and_normal,
    boundary,
    check,
    edges,
    grid,
    sector,
    unstructured,
    vertex_normals,
)

MAKERS = {
    "grid": lambda: grid(7, 5, 2.0, 1.0),
    "alternating grid": lambda: grid(7, 5, 2.0, 1.0, diagonals="alternating"),
    "unstructured": lambda: unstructured(2.0, 1.0, spacing=0.11),
    "coarsest": lambda: unstructured(1.0, 1.0, spacing=1.0),
    "sector": lambda: sector(0.3, 1.0, 1.7, spacing=0.08),
    "wide sector": lambda: sector(0.5, 1.0, 5.0, spacing=0.1),
}


def angles(mesh: Mesh) -> np.ndarray:
    x = mesh.vertices[mesh.triangles]
    after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    cross = np.linalg.norm(np.cross(after, before), axis=2)
    return np.degrees(np.arctan2(cross, np.einsum("mik,mik->mi", after, before)))


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_a_generated_mesh_passes_every_check(make):
    mesh = make()
    check(mesh)
    assert area_and_normal(mesh.vertices, mesh.triangles)[0].min() > 0


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_a_generated_mesh_is_one_disk(make):
    mesh = make()
    rim = boundary(mesh.triangles)
    e = len(edges(mesh.triangles))
    assert len(mesh.vertices) - e + len(mesh.triangles) == 1
    assert 3 * len(mesh.triangles) == 2 * e - len(rim), "the rim has as many edges as vertices"


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_a_generated_mesh_in_the_upright_plane_faces_along_z(make):
    mesh = make()
    assert (mesh.vertices[:, 2] == 0).all()
    _, normal = area_and_normal(mesh.vertices, mesh.triangles)
    np.testing.assert_allclose(normal, np.broadcast_to([0, 0, 1], normal.shape), atol=1e-15)


@pytest.mark.parametrize(
    "make", [lambda p: grid(4, 6, 1, 2, plane=p), lambda p: unstructured(1, 2, 0.2, plane=p)]
)
def test_a_level_mesh_faces_up(make):
    mesh = make("xz")
    assert (mesh.vertices[:, 1] == 0).all()
    area, normal = area_and_normal(mesh.vertices, mesh.triangles)
    assert area.sum() == pytest.approx(2, rel=1e-14)
    np.testing.assert_allclose(normal, np.broadcast_to([0, 1, 0], normal.shape), atol=1e-15)


@pytest.mark.parametrize("diagonals", ["uniform", "alternating", "zigzag"])
def test_a_grid_has_equal_right_triangles_that_fill_its_rectangle(diagonals):
    mesh = grid(9, 5, 2.0, 3.0, diagonals=diagonals)
    area, _ = area_and_normal(mesh.vertices, mesh.triangles)
    assert mesh.vertices.shape == (45, 3)
    assert mesh.triangles.shape == (64, 3)
    np.testing.assert_allclose(area, 6.0 / 64, rtol=1e-13)
    np.testing.assert_array_equal(mesh.vertices.min(axis=0), [-1, -1.5, 0])
    np.testing.assert_array_equal(mesh.vertices.max(axis=0), [1, 1.5, 0])
    np.testing.assert_allclose(angles(mesh).max(axis=1), 90)


def test_the_diagonals_of_a_grid_are_parallel_or_alternate():
    def slopes(mesh):
        pairs = mesh.vertices[edges(mesh.triangles)]
        step = pairs[:, 1] - pairs[:, 0]
        slanted = step[(np.abs(step[:, :2]) > 1e-9).all(axis=1)]
        return np.sign(slanted[:, 0] * slanted[:, 1])

    assert (slopes(grid(7, 5)) == -1).all()
    assert slopes(grid(7, 5, diagonals="alternating")).sum() == 0
    assert sorted(slopes(grid(7, 5, diagonals="zigzag"))) == [-1] * 12 + [1] * 12


def test_an_unstructured_rectangle_fills_it_with_its_rim_exactly_on_the_sides():
    mesh = unstructured(2.0, 1.0, spacing=0.11)
    area, _ = area_and_normal(mesh.vertices, mesh.triangles)
    assert area.sum() == pytest.approx(2.0, rel=1e-14)
    x, y, _ = np.abs(mesh.vertices.T)
    on_side = (x == 1.0) | (y == 0.5)
    np.testing.assert_array_equal(np.flatnonzero(on_side), boundary(mesh.triangles))
    assert (x <= 1.0).all()
    assert (y <= 0.5).all()


def test_a_sector_fills_its_polygon_with_its_rim_exactly_on_arcs_and_sides():
    inner, outer, angle = 0.18, 1.1, 2.2
    mesh = sector(inner, outer, angle, spacing=0.05)
    rim = mesh.vertices[boundary(mesh.triangles)]
    r, turn = np.hypot(rim[:, 0], rim[:, 1]), np.arctan2(rim[:, 0], -rim[:, 1])
    on_inner, on_outer = np.abs(r - inner) < 1e-15, np.abs(r - outer) < 1e-15
    on_side = np.abs(np.abs(turn) - angle / 2) < 1e-14
    assert (on_inner | on_outer | on_side).all()

    def polygon(radius, on):  # a fan of as many equal triangles as the arc has chords
        chords = on.sum() - 1
        return chords * radius**2 * np.sin(angle / chords) / 2

    area, _ = area_and_normal(mesh.vertices, mesh.triangles)
    assert area.sum() == pytest.approx(polygon(outer, on_outer) - polygon(inner, on_inner), rel=1e-13)
    assert area.sum() == pytest.approx((outer**2 - inner**2) * angle / 2, rel=1e-3)


def test_the_cape_pattern_has_at_least_3000_vertices():
    assert len(sector(0.18, 1.1, 2.2, spacing=0.022).vertices) >= 3000


@pytest.mark.parametrize("seed", range(8))
def test_unstructured_triangles_are_well_shaped_for_any_seed(seed):
    for mesh in (
        unstructured(1.0, 1.0, spacing=0.09, seed=seed),
        unstructured(2.0, 1.0, spacing=0.3, seed=seed),
        sector(0.2, 1.0, 2.2, spacing=0.08, seed=seed),
    ):
        assert angles(mesh).min() > 20


def test_the_spacing_is_the_typical_edge_length():
    mesh = unstructured(1.0, 1.0, spacing=0.05)
    pairs = mesh.vertices[edges(mesh.triangles)]
    length = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1)
    assert np.median(length) == pytest.approx(0.05, rel=0.1)
    assert length.max() < 0.1


def test_the_same_arguments_give_the_same_mesh_and_another_seed_another():
    for make in (lambda s: unstructured(1, 1, 0.1, seed=s), lambda s: sector(spacing=0.08, seed=s)):
        a, b, c = make(0), make(0), make(1)
        np.testing.assert_array_equal(a.vertices, b.vertices)
        np.testing.assert_array_equal(a.triangles, b.triangles)
        assert a.vertices.shape != c.vertices.shape or not np.array_equal(a.vertices, c.vertices)


@pytest.mark.parametrize(
    "make",
    [
        lambda: grid(1, 5),
        lambda: grid(5, 2.0),
        lambda: grid(3, 3, width=0),
        lambda: grid(3, 3, height=float("nan")),
        lambda: grid(3, 3, plane="yz"),
        lambda: grid(3, 3, diagonals="none"),
        lambda: unstructured(1, 1, spacing=2),
        lambda: unstructured(1, 1, spacing=-0.1),
        lambda: unstructured(1, 1, spacing=1e-6),
        lambda: unstructured(1, 1, spacing=0.1, plane="zx"),
        lambda: unstructured(1, 1, spacing=0.1, seed=-1),
        lambda: unstructured("wide", 1),
        lambda: sector(1.0, 0.5),
        lambda: sector(0.5, 1.0, angle=6.28, spacing=0.1),
        lambda: sector(0.5, 1.0, angle=7.0, spacing=0.1),
        lambda: sector(0.1, 1.0, angle=1.0, spacing=0.5),
    ],
)
def test_sizes_that_make_no_sense_are_refused_with_a_hint(make):
    with pytest.raises(MeshError) as caught:
        make()
    assert caught.value.hint


def test_edges_come_once_each_and_the_boundary_is_the_rim():
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(edges(triangles), [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]])
    np.testing.assert_array_equal(boundary(triangles), [0, 1, 2, 3])
    mesh = grid(5, 4)
    inner = np.setdiff1d(np.arange(20), boundary(mesh.triangles))
    np.testing.assert_array_equal(inner, [6, 7, 8, 11, 12, 13])


def test_a_closed_surface_has_no_boundary():
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    mesh = Mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], tetrahedron)
    assert boundary(mesh.triangles).size == 0
    assert len(edges(mesh.triangles)) == 6
    area, normal = area_and_normal(mesh.vertices, mesh.triangles)
    np.testing.assert_allclose(area @ normal, 0, atol=1e-15)


def test_vertex_normals_turn_with_the_mesh_and_vanish_on_a_collapsed_one():
    mesh = unstructured(1, 1, 0.2)
    Q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    Q *= np.linalg.det(Q)
    expected = np.broadcast_to(Q @ [0, 0, 1], mesh.vertices.shape)
    np.testing.assert_allclose(vertex_normals(mesh.vertices @ Q.T, mesh.triangles), expected, atol=1e-14)
    assert (vertex_normals(0 * mesh.vertices, mesh.triangles) == 0).all()
    area, normal = area_and_normal(0 * mesh.vertices, mesh.triangles)
    assert (area == 0).all()
    assert (normal == 0).all()


@pytest.mark.parametrize("diagonals", range(8))
def test_a_vertex_normal_does_not_depend_on_how_flat_sides_are_cut(diagonals):
    """The corner of a cube: all normals are its diagonals, whichever diagonals its sides have."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = []
    for side, flip in zip(sides, [bool(diagonals >> k & 1) for k in (0, 1, 2, 2, 1, 0)], strict=True):
        a, b, c, d = np.roll(side, flip)
        triangles += [[a, b, c], [a, c, d]]
    expected = (2 * corners - 1) / np.sqrt(3)
    np.testing.assert_allclose(vertex_normals(corners, np.array(triangles)), expected, atol=1e-15)


def test_a_hundred_thousand_disjoint_triangles_are_checked_within_a_second():
    rng = np.random.default_rng(0)
    vertices = rng.normal(size=(300_000, 3))
    triangles = np.arange(300_000).reshape(-1, 3)
    start = time.process_time()
    mesh = Mesh.from_arrays(vertices, triangles)
    assert time.process_time() - start < 1.0
    np.testing.assert_array_equal(mesh.vertices, vertices)


def test_a_mesh_keeps_private_arrays_that_cannot_be_overwritten():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = Mesh.from_arrays(vertices, [[0, 1, 2]])
    vertices[:] = 7
    assert mesh.vertices.max() == 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 1


def test_whole_numbers_in_floats_are_welcome_as_indices():
    mesh = Mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 1.0, 2.0]])
    assert mesh.triangles.dtype == np.int32


def test_importing_the_mesh_package_loads_neither_meshio_nor_scipy_nor_taichi():
    code = "import sys, muslin.mesh; print([m for m in ('meshio', 'scipy', 'taichi') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
