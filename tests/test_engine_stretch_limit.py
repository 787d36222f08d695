"""Strain limiting: no triangle ends a step beyond the limit, and nothing else changes."""

import numpy as np
import pytest
from scipy.optimize import minimize

import muslin
from muslin import mesh
from muslin.base import runtime
from muslin.base.errors import MuslinError
from muslin.mesh import principal_stretches
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.integrators import linearly_implicit_euler

runtime.start()
from muslin.physics.elements import limit as limits  # noqa: E402  (kernels need a Taichi that runs)
from muslin.physics.elements.limit_kernels import TOLERANCE  # noqa: E402

LIMIT = 1.02
DT = 0.01


def limiter(sheet, held=(), limit=LIMIT, mass=None):
    area, normal = mesh.area_and_normal(sheet.vertices, sheet.triangles)
    n = len(sheet.vertices)
    if mass is None:
        mass = np.bincount(sheet.triangles.ravel(), np.repeat(area, 3), minlength=n) / 3
    pinned = np.zeros(n, dtype=bool)
    pinned[list(held)] = True
    triangles = np.ascontiguousarray(sheet.triangles, dtype=np.int32)
    return limits.StretchLimit(sheet.vertices, triangles, normal, mass, pinned, limit), mass


def largest(sheet, x):
    return principal_stretches(sheet.vertices, x, sheet.triangles)[:, 0].max()


@pytest.fixture
def torn():
    """A crumpled sheet in which some vertices run away, far from one another."""
    rng = np.random.default_rng(3)
    sheet = mesh.grid(20, 20)
    x = sheet.vertices + 0.0001 * rng.normal(size=sheet.vertices.shape)
    v = 0.01 * rng.normal(size=x.shape)
    v[[45, 133, 270]] += [[2.0, 0.5, 1.0], [-1.0, 1.0, 2.0], [0.0, -3.0, 0.0]]
    return sheet, x, v


def test_no_triangle_ends_beyond_the_limit_and_momentum_stays(torn):
    sheet, x, v = torn
    limited, mass = limiter(sheet)
    before = v.copy()
    after = limited(x, v, DT)
    assert largest(sheet, x + DT * v) > 1.2
    assert largest(sheet, x + DT * after) <= LIMIT + 2 * TOLERANCE
    np.testing.assert_array_equal(v, before)  # what was given is not written over
    np.testing.assert_allclose(mass @ after, mass @ v, atol=1e-12)
    turning = mass[:, None] * np.cross(x + DT * (v + after) / 2, after - v)
    assert (np.abs(turning.sum(axis=0)) < 0.02 * np.abs(turning).sum(axis=0)).all(), "up to second order"
    moved = np.flatnonzero((after != v).any(axis=1))
    assert 3 < len(moved) < len(x) / 2, "only around what was too long"
    assert (mass * (after**2).sum(axis=1)).sum() < (mass * (v**2).sum(axis=1)).sum(), "energy is lost"
    np.testing.assert_array_equal(limited(x, v, DT), after)  # to the bit


def test_a_single_triangle_is_corrected_as_little_as_can_be():
    """Against the least 1/2 sum m |dv|^2 that takes the larger stretch to the limit, to first order."""
    X = np.array([[0, 0, 0], [0.1, 0, 0], [0.02, 0.09, 0]], dtype=float)
    sheet = mesh.Mesh.from_arrays(X, np.array([[0, 1, 2]]))
    mass = np.array([1.0, 2.0, 0.5])
    limited, _ = limiter(sheet, mass=mass)
    v = np.array([[0.0, 0.3, 0.0], [0.33, 0.1, 0.2], [0.05, -0.6, 0.3]])
    assert LIMIT + 20 * TOLERANCE < largest(sheet, X + DT * v) < LIMIT + 0.02
    after = limited(X, v, DT)
    found = minimize(
        lambda u: (mass[:, None] * (u.reshape(3, 3) - v) ** 2).sum(),
        v.ravel(),
        constraints={"type": "eq", "fun": lambda u: LIMIT - largest(sheet, X + DT * u.reshape(3, 3))},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert found.success
    assert abs(largest(sheet, X + DT * after) - LIMIT) <= TOLERANCE
    np.testing.assert_allclose(after, found.x.reshape(3, 3), atol=0.1 * np.abs(found.x - v.ravel()).max())


def test_what_is_not_too_long_is_left_alone_to_the_bit(torn):
    sheet, x, _ = torn
    limited, _ = limiter(sheet)
    v = 0.001 * np.random.default_rng(5).normal(size=x.shape)
    assert limited(x, v, DT) is v


def test_held_vertices_stay_and_the_others_give_way(torn):
    sheet, x, v = torn
    held = [44, 45, 46]
    v[held] = 0.15
    limited, _ = limiter(sheet, held)
    after = limited(x, v, DT)
    np.testing.assert_array_equal(after[held], v[held])
    assert largest(sheet, x + DT * after) <= LIMIT + 2 * TOLERANCE


def test_a_triangle_all_held_or_without_end_does_not_hang(torn):
    sheet, x, v = torn
    limited, _ = limiter(sheet, range(len(x)))
    np.testing.assert_array_equal(limited(x, v, DT), v)
    limited, _ = limiter(sheet)
    x = 3 * x  # every triangle is far too long: it gives up in time, with something finite and shorter
    after = limited(x, v, DT)
    middle = [np.median(principal_stretches(sheet.vertices, x + DT * u, sheet.triangles)) for u in (v, after)]
    assert LIMIT < middle[1] < middle[0]


def test_a_drape_with_the_limit_has_no_spikes():
    cotton = {
        "mu": 5e6,
        "lam": 5e6,
        "h": 4e-4,
        "rho": 500,
        "bending_stiffness": 1.6e-5,
        "damping": 0,
        "sag": 0,
    }
    held = {"floor": False, "pinned": "corners", "friction": 0}
    scene = {"resolution": 24, "dt": 1 / 60, "steps": 60, **held, **cotton}
    stored, longest = {}, {}
    for limit in (0, 1.01):
        chosen = scenes.get("drape", contact="solve", **scene, stretch_limit=limit)
        run = muslin.simulate(chosen)
        assert run.energies.contacts.max() > 20
        assert run.energies.approach.min() >= -1e-12, "contacts have the last word"
        assert run.body.stretches(run.x).max() <= 1.0105
        stored[limit] = run.energies.elastic.max()
        model, state = simulation.build(chosen)
        met = []
        for _ in range(60):
            model.body.update(state.x)
            state = linearly_implicit_euler(model, state, chosen.dt)
            met.append(model.body.stretches(state.x)[:, 0].max())
        np.testing.assert_array_equal(state.x, run.x)
        longest[limit] = max(met[30:])
    assert max(stored.values()) < 0.2, "of the 0.69 J there were: no spike, with or without a limit"
    assert max(longest.values()) < 1.0105, longest
    filtered = [
        muslin.simulate("drape", contact="filter", **scene, stretch_limit=limit).energies.elastic.max()
        for limit in (0, 1.01)
    ]
    assert filtered[1] < filtered[0] / 3, filtered


def test_a_loose_limit_changes_nothing():
    runs = [muslin.simulate("hang", resolution=12, steps=20, stretch_limit=limit) for limit in (0, 10)]
    np.testing.assert_array_equal(runs[0].x, runs[1].x)


@pytest.mark.parametrize("wrong", ["1", "0.9", "-2", "nan", "tight"])
def test_a_limit_that_makes_no_sense_is_refused(wrong):
    with pytest.raises(MuslinError, match="stretch_limit"):
        scenes.get("drape", stretch_limit=wrong)
