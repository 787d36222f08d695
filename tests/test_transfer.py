"""What refinement and coarsening keep: mass, momentum, angular momentum; and where nothing is to be lost, energy."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.mesh import Refinement, area_and_normal, grid
from muslin.physics.transfer import Exchange, Sheet


def sheet(refined: Refinement, X: np.ndarray, density: float = 0.3) -> Sheet:
    return Sheet(refined.triangles, density * area_and_normal(X, refined.triangles)[0])


def momenta(of: Sheet, x, v):
    return [total.sum(axis=0) for total in of.momenta(x, v)]


def by_matrix(of: Sheet, x, v):
    """Both momenta by the mass matrix, entry by entry."""
    M = np.zeros((len(x), len(x)))
    for corners, mass in zip(of.triangles, of.masses, strict=True):
        M[np.ix_(corners, corners)] += mass / 12 * (1 + np.eye(3))
    return (M @ v).sum(axis=0), np.cross(x, M @ v).sum(axis=0)


class Moving:
    """A crumpled cloth on the fly, that is refined and coarsened at random."""

    def __init__(self, seed: int = 0, size: int = 6):
        self.rng = np.random.default_rng(seed)
        mesh = grid(size, size)
        self.refined = Refinement.of(mesh)
        self.X = mesh.vertices.copy()
        self.x = self.X + 0.05 * self.rng.standard_normal(self.X.shape) + (3.0, -2.0, 1.0)
        self.v = self.rng.standard_normal(self.X.shape)

    @property
    def sheet(self) -> Sheet:
        return sheet(self.refined, self.X)

    def refine(self, rows) -> None:
        before, old = self.sheet, self.refined
        self.refined = old.refine(rows)
        self.X, x, v = (self.refined.spread(values) for values in (self.X, self.x, self.v))
        exchange = Exchange(before, self.sheet, len(x))
        self.x = exchange.recentred(x)
        self.v = exchange.conserved(x, self.x, v, v)

    def coarsen(self, vertices) -> None:
        before, old = self.sheet, self.v
        self.refined, kept = self.refined.coarsen(vertices)
        self.X = self.X[kept]
        after = Sheet(kept[self.refined.triangles], self.sheet.masses)
        exchange = Exchange(before, after, len(old))
        x = exchange.recentred(self.x)
        self.x, self.v = x[kept], exchange.conserved(self.x, x, old, old)[kept]

    def change(self) -> None:
        there = np.flatnonzero(self.refined.removable())
        if len(there) and self.rng.random() < 0.5:
            self.coarsen(self.rng.permutation(there)[: 1 + len(there) // 4])
        else:
            self.refine(self.rng.integers(0, len(self.refined.triangles), 4))


def test_momenta_are_those_of_the_mass_matrix():
    cloth = Moving()
    cloth.refine([0, 3, 12])
    for found, expected in zip(
        momenta(cloth.sheet, cloth.x, cloth.v), by_matrix(cloth.sheet, cloth.x, cloth.v), strict=True
    ):
        assert np.allclose(found, expected, rtol=0, atol=1e-14)


def test_five_hundred_adaptations_keep_mass_centre_momentum_and_angular_momentum():
    cloth = Moving(1)
    mass, (p, L) = cloth.sheet.masses.sum(), momenta(cloth.sheet, cloth.x, cloth.v)
    centre = momenta(cloth.sheet, cloth.x, cloth.x)[0]
    changed = 0
    for _ in range(500):
        rows = len(cloth.refined.triangles)
        cloth.change()
        changed += rows != len(cloth.refined.triangles)
    now = momenta(cloth.sheet, cloth.x, cloth.v)
    assert changed > 400
    assert cloth.sheet.masses.sum() == pytest.approx(mass, rel=1e-13)
    assert np.abs(momenta(cloth.sheet, cloth.x, cloth.x)[0] - centre).max() < 1e-12
    assert np.abs(now[0] - p).max() < 1e-12
    assert np.abs(now[1] - L).max() < 1e-12


def test_a_crumpled_cloth_that_only_moves_on_goes_on_so():
    cloth = Moving(2)
    cloth.v[:] = (100.0, -30.0, 7.0)
    for _ in range(100):
        cloth.change()
    assert np.abs(cloth.v - (100.0, -30.0, 7.0)).max() < 1e-10


def test_a_flat_stretched_cloth_that_turns_goes_on_so():
    cloth = Moving(3)
    cloth.x = cloth.X @ np.array([[1.3, 0.2, 0.1], [0.0, 0.9, 0.4], [0.0, 0.0, 1.0]])

    def turning(x):
        return np.array([1.0, 2.0, 3.0]) + np.cross([0.3, -1.0, 0.5], x)

    cloth.v = turning(cloth.x)
    for _ in range(100):
        cloth.change()
    assert np.abs(cloth.v - turning(cloth.x)).max() < 1e-11


def test_what_is_refined_and_coarsened_at_once_is_where_it_was_and_as_fast():
    cloth = Moving(7)
    x, v = cloth.x.copy(), cloth.v.copy()
    cloth.refine(np.arange(0, len(cloth.refined.triangles), 2))
    cloth.refine(np.arange(0, len(cloth.refined.triangles), 3))
    while cloth.refined.added:
        cloth.coarsen(np.flatnonzero(cloth.refined.removable()))
    assert np.abs(cloth.x - x).max() < 0.02
    assert np.abs(cloth.v - v).max() < 0.5


def test_a_split_alone_keeps_velocities_and_energy_and_moves_no_other_vertex():
    cloth = Moving(3)
    v, energy = cloth.v.copy(), cloth.sheet.kinetic_energy(cloth.v)
    cloth.refine([10])
    assert cloth.refined.added == 1
    assert np.abs(cloth.v[: len(v)] - v).max() < 1e-13
    assert cloth.sheet.kinetic_energy(cloth.v) == pytest.approx(energy, rel=1e-13)


def test_only_vertices_near_a_change_take_part_in_it():
    cloth = Moving(4, size=10)
    v = cloth.v.copy()
    row = len(cloth.refined.triangles) // 2
    cloth.refine([row])
    cloth.refine([row])
    moved = np.abs(cloth.v[: len(v)] - v).max(axis=1) > 1e-12
    assert 0 < moved.sum() < 12


def test_pinned_vertices_stay_and_keep_their_velocities():
    cloth = Moving(5)
    free = np.ones(len(cloth.x), dtype=bool)
    free[:6] = False
    refined = cloth.refined.refine(np.arange(len(cloth.refined.triangles)))
    X, x, v = (refined.spread(values) for values in (cloth.X, cloth.x, cloth.v))
    free = ~refined.all_of(~free)
    before, after = cloth.sheet, sheet(refined, X)
    exchange = Exchange(before, after, len(x), free)
    moved = exchange.recentred(x)
    new = exchange.conserved(x, moved, v, v)
    assert np.array_equal(moved[~free], x[~free])
    assert np.array_equal(new[~free], v[~free])
    assert not np.array_equal(moved[free], x[free])
    for one, other in zip(momenta(before, x, v), momenta(after, moved, new), strict=True):
        assert np.abs(one - other).max() < 1e-13


def test_where_nothing_is_free_nothing_changes():
    cloth = Moving(6)
    refined = cloth.refined.refine([0, 1])
    X, x, v = (refined.spread(values) for values in (cloth.X, cloth.x, cloth.v))
    exchange = Exchange(cloth.sheet, sheet(refined, X), len(x), np.zeros(len(x), dtype=bool))
    assert np.array_equal(exchange.recentred(x), x)
    assert np.array_equal(exchange.conserved(x, x, v, v), v)
