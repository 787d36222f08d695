"""Reversible sqrt(3) refinement: whatever is done to a mesh it stays one, and all of it can be undone to the bit."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.base.errors import MeshError
from muslin.mesh import Mesh, Refinement, area_and_normal, grid, load
from muslin.mesh.refinement import euler, violations


def ring(around: int = 12, width: int = 3) -> Mesh:
    """An annulus."""
    angle = 2 * np.pi * np.arange(around) / around
    radius = 1 + np.arange(width) / 2
    X = np.stack([np.outer(radius, f(angle)).ravel() for f in (np.cos, np.sin)], axis=1)
    corner = np.arange(around * (width - 1)).reshape(width - 1, around)
    right = np.roll(corner, -1, axis=1)
    T = [(corner, corner + around, right), (right, corner + around, right + around)]
    return Mesh.from_arrays(X, np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in T]), "annulus")


MESHES = {
    "disk": lambda: grid(5, 5),
    "strip": lambda: grid(2, 8),
    "annulus": ring,
    "cape": lambda: load("data/meshes/cape.obj"),
    "triangle": lambda: Mesh.from_arrays([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "one"),
    "closed": lambda: Mesh.from_arrays(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    ),
}


@pytest.fixture(params=[*MESHES])
def mesh(request):
    """Each of them."""
    return MESHES[request.param]()


def coarsest(refined: Refinement) -> Refinement:
    """Everything undone."""
    while refined.added:
        refined, _ = refined.coarsen(np.flatnonzero(refined.removable()))
    return refined


def same(one: Refinement, other: Refinement) -> bool:
    names = ("triangles", "generation", "parents", "children", "born", "across")
    return all(getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in names)


def random_walk(mesh: Mesh, operations: int, most: int, seed: int) -> Refinement:
    """So many random refinements and coarsenings, up to `most` in a call, with the invariants asked after each."""
    rng, refined, characteristic = np.random.default_rng(seed), Refinement.of(mesh), euler(mesh)
    limit = len(mesh.vertices) + 600
    while operations > 0:
        at_once = min(operations, int(rng.integers(1, most + 1)))
        if rng.random() < 0.6 and refined.vertices < limit:
            refined = refined.refine(rng.integers(0, len(refined.triangles), at_once))
        else:
            there = np.flatnonzero(refined.removable())
            assert len(there) or not refined.added, "nothing can be undone"
            if len(there):
                refined, _ = refined.coarsen(rng.permutation(there)[:at_once])
        assert violations(refined, characteristic) == []
        operations -= at_once
    return refined


def test_ten_thousand_random_operations_leave_a_mesh_and_can_be_undone_to_the_bit(mesh):
    walked = random_walk(mesh, 10_000, most=60, seed=1)
    assert walked.added
    assert same(coarsest(walked), Refinement.of(mesh))


def test_operations_one_by_one_leave_a_mesh(mesh):
    random_walk(mesh, 150, most=1, seed=2)


def test_refining_everything_and_coarsening_everything_gives_the_bytes_one_began_with(mesh):
    refined = Refinement.of(mesh)
    for _ in range(2):
        refined = refined.refine(np.arange(len(refined.triangles)))
        assert violations(refined, euler(mesh)) == []
    assert (refined.generation == 4).all()
    assert len(refined.triangles) == 9 * len(mesh.triangles)
    again = coarsest(refined)
    assert same(again, Refinement.of(mesh))
    assert refined.spread(mesh.vertices)[: len(mesh.vertices)].tobytes() == mesh.vertices.tobytes()


def test_the_same_triangles_come_of_the_same_splits_in_another_order():
    mesh = grid(5, 5)
    one, other = Refinement.of(mesh), Refinement.of(mesh)
    for rows in ([3, 4, 20], [21, 5]):
        one = one.refine(rows)
    for rows in ([21], [20], [5], [4], [3]):
        other = other.refine(rows)
    assert one.vertices == other.vertices

    def centres(refined):
        X = refined.spread(mesh.vertices)[refined.triangles]
        return np.unique(np.round(X.mean(axis=1), 12), axis=0)

    assert np.array_equal(centres(one), centres(other))


def test_two_levels_cut_every_edge_in_three_and_keep_the_angles():
    X = np.array([[0, 0], [1, 0], [0.5, np.sqrt(0.75)]])
    mesh = Mesh.from_arrays(X, [[0, 1, 2]])
    refined = Refinement.of(mesh)
    for levels in (2, 4):
        for _ in range(2):
            refined = refined.refine(np.arange(len(refined.triangles)))
        x = refined.spread(mesh.vertices)[refined.triangles]
        sides = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2)
        assert np.allclose(sides, 3.0 ** (-levels / 2), rtol=1e-12)
    assert len(refined.triangles) == 81


def test_refinement_keeps_area_and_orientation_of_a_flat_mesh():
    mesh = grid(6, 4)
    refined = random_walk(mesh, 2000, most=20, seed=3)
    area, normal = area_and_normal(refined.spread(mesh.vertices), refined.triangles)
    whole, up = area_and_normal(mesh.vertices, mesh.triangles)
    assert area.sum() == pytest.approx(whole.sum(), rel=1e-13)
    assert area.min() > 0
    assert np.allclose(normal, up[0], atol=1e-12)


def test_new_vertices_come_after_their_parents_and_keep_their_bits_when_others_go():
    mesh = grid(4, 4)
    refined = Refinement.of(mesh).refine([0, 7, 9]).refine([2, 17])
    X = refined.spread(mesh.vertices)
    goes = np.flatnonzero(refined.removable())[:1]
    coarser, kept = refined.coarsen(goes)
    assert coarser.spread(mesh.vertices).tobytes() == X[kept].tobytes()


def test_growth_is_what_refine_adds():
    refined = random_walk(grid(4, 4), 300, most=5, seed=4)
    for row in range(0, len(refined.triangles), 7):
        assert refined.refine([row]).vertices - refined.vertices == refined.growth([row])


def test_what_is_true_of_all_parents_is_true_of_a_vertex():
    mesh = grid(3, 3)
    top = mesh.vertices[:, 1] == mesh.vertices[:, 1].max()
    refined = Refinement.of(mesh)
    for _ in range(4):
        refined = refined.refine(np.arange(len(refined.triangles)))
    X = refined.spread(mesh.vertices)
    assert np.array_equal(refined.all_of(top), np.isclose(X[:, 1], mesh.vertices[:, 1].max(), atol=1e-12))


def test_whole_numbers_are_spread_as_numbers_and_not_cut_off():
    refined = Refinement.of(grid(2, 2)).refine([0])
    found = refined.spread(np.array([1, 2, 4, 8]))
    assert found[4] == pytest.approx(np.array([1, 2, 4, 8])[refined.parents[4]].sum() / 3, rel=1e-15)
    assert found[4] % 1 != 0
    assert found.dtype == np.float64


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda r: r.refine([99]), "There is no triangle 99"),
        (lambda r: r.refine([-1]), "There is no triangle -1"),
        (lambda r: r.refine([0.5]), "not understood"),
        (lambda r: r.refine([[0, 1]]), "not understood"),
        (lambda r: r.coarsen([1000]), "There is no vertex 1000"),
        (lambda r: r.coarsen([2]), "was not added by refinement"),
        (lambda r: r.coarsen([16]), "refined further"),
        (lambda r: r.spread(np.zeros((r.vertices + 1, 3))), "values for 16 to"),
        (lambda r: r.spread(np.zeros((15, 3))), "There are 15 values"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_message(ask, said):
    refined = Refinement.of(grid(4, 4)).refine([0])
    for _ in range(3):
        refined = refined.refine([0])
    with pytest.raises(MeshError, match=said):
        ask(refined)


def test_a_refusal_changes_nothing():
    refined = Refinement.of(grid(4, 4)).refine([0])
    before = refined.triangles.tobytes()
    with pytest.raises(MeshError):
        refined.coarsen([16, 99])
    assert refined.triangles.tobytes() == before


def test_the_check_finds_what_is_wrong():
    from dataclasses import replace

    refined = Refinement.of(grid(4, 4)).refine([0, 5])
    turned = refined.triangles.copy()
    turned[3] = turned[3, ::-1]
    assert "an edge is in two triangles in the same direction" in violations(
        replace(refined, triangles=turned)
    )
    apart = refined.generation.copy()
    apart[0] = 4
    assert "neighbours are more than one generation apart" in violations(replace(refined, generation=apart))
    assert violations(refined, 7) == ["the Euler characteristic is 1, not 7"]
