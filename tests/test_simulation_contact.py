"""What the cloth meets: nothing moves into a collider, nothing is pulled, folds are not spikes."""

from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin.physics import colliders
from muslin.simulation import integrators, scenes
from muslin.simulation import simulating as simulation

ROOT = Path(__file__).resolve().parent.parent

SPHERE_BELOW = {"resolution": 24, "dt": 1 / 60, "steps": 60, "floor": False, "pinned": "corners"}


@pytest.fixture(scope="module")
def solution():
    return muslin.load(ROOT / "solutions" / "cloth")


def test_thrown_cloth_never_moves_into_the_sphere(solution):
    run = muslin.simulate("throw", functions=solution)
    assert run.energies.contacts.max() > 20
    assert run.energies.approach.min() >= -1e-12
    assert run.energies.penetration.max() <= 0.02
    assert np.isfinite(run.x).all()
    assert run.body.stretches(run.x).max() < 1.5, "folds, not spikes"


def test_the_filter_drapes_the_cloth_over_the_sphere(solution):
    run = muslin.simulate("drape", functions=solution, contact="filter", steps=200)
    assert run.energies.contacts.max() > 500
    assert run.energies.approach.min() >= -1e-12
    assert run.energies.penetration.max() <= 0.015
    assert run.body.stretches(run.x).max() < 1.2, "folds, not spikes"
    assert run.x[:, 1].max() > 0.28, "it lies on top"
    assert run.x[:, 1].min() < -0.05, "it hangs down"


def test_contacts_in_the_system_are_a_constrained_step():
    """Against the dense system with a multiplier for every vertex that presses."""
    scene = scenes.get(
        "drape", contact="solve", friction=0, resolution=9, dt=1 / 60, floor=False, bending="off", damping=0
    )
    model, state = simulation.build(scene)
    cloth, dt = model.body, scene.dt
    for _ in range(40):
        cloth.update(state.x)
        state, last = integrators.linearly_implicit_euler(model, state, dt), state
    assert len(state.pressed) > 5
    cloth.update(last.x)
    touching = model.touching(last, dt)
    pressing = np.flatnonzero(touching.presses)
    N = np.zeros((len(pressing), 3 * len(last.x)))
    for row, i, n in zip(
        N, touching.pairs.corners[pressing, 0], touching.pairs.normals[pressing], strict=True
    ):
        row[3 * i : 3 * i + 3] = n
    M = cloth.mass.toarray()
    A = M + dt**2 * cloth.hessian(last.x, project=True).toarray()
    b = M @ last.v.ravel() + dt * (model.weight - cloth.gradient(last.x)).ravel()
    zero = np.zeros((len(N), len(N)))
    right = np.concatenate([b, touching.least[pressing]])
    v = np.linalg.solve(np.block([[A, N.T], [N, zero]]), right)[: b.size].reshape(-1, 3)
    v = colliders.respond(v, touching.contacts(np.ones(len(touching.pairs), bool), 1))
    np.testing.assert_allclose(state.v, v, atol=1e-5 * np.abs(v).max())


def test_contacts_in_the_system_make_no_spikes():
    stretch = {}
    for contact in colliders.CONTACT:
        run = muslin.simulate("drape", contact=contact, **SPHERE_BELOW)
        assert run.energies.contacts.max() > 20
        assert run.energies.approach.min() >= -1e-12
        assert run.energies.penetration[30:].max() <= 0.05
        stretch[contact] = run.body.stretches(run.x).max()
    assert stretch["solve"] < 1.05 < stretch["filter"], stretch


def test_a_floor_holds_and_is_never_passed():
    run = muslin.simulate("drape", sphere=False, resolution=16, steps=240, start_at=(0, 0.1, 0))
    assert run.x[:, 1].min() >= run.scene.ground - 1e-9
    assert run.x[:, 1].max() < run.scene.ground + 0.01


def test_a_moving_sphere_pushes_with_its_own_velocity():
    run = muslin.simulate(
        "drape",
        resolution=20,
        steps=60,
        gravity=(0, 0, 0),
        start_at=(0, 0.31, 0),
        sphere_velocity=(0, 1.0, 0),
    )
    assert run.energies.approach.min() >= -1e-12
    assert run.energies.contacts.max() > 0
    assert run.x[:, 1].max() > 0.5
    assert run.energies.penetration.max() < 0.02


def test_a_capsule_is_a_segment_with_a_radius():
    from muslin.physics.colliders import Capsule, approach, depth, detect, respond

    capsule = Capsule((0, 0, 0), (1, 0, 0), 0.5, velocity_a=(0, 0, 0), velocity_b=(0, 2, 0))
    x = np.array([[0.5, 0.4, 0], [-0.3, 0, 0], [1.6, 0, 0], [0.5, 0, 0.6]])
    found = detect(capsule, x, np.zeros_like(x), 0.01)
    assert found.vertices.tolist() == [0, 1]
    np.testing.assert_allclose(found.normals, [[0, 1, 0], [-1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(found.velocities, [[0, 1, 0], [0, 0, 0]], atol=1e-12)
    v = respond(np.zeros_like(x), [found])
    np.testing.assert_allclose(v[0], [0, 1, 0], atol=1e-12)
    assert approach(v, found).min() >= -1e-12
    assert depth(capsule, x) == pytest.approx(0.2)


def test_between_two_colliders_neither_wins():
    from muslin.physics.colliders import Contacts, approach, respond

    a, b = np.array([[1.0, 0, 0]]), np.array([[np.cos(2.2), np.sin(2.2), 0]])
    contacts = [Contacts(np.array([0]), n, np.zeros((1, 3))) for n in (a, b)]
    v = respond(np.array([[-1.0, -2.0, 0.5]]), contacts)
    assert min(approach(v, c).min() for c in contacts) > -1e-8
    assert v[0, 2] == 0.5


def test_a_floor_cannot_be_outrun():
    run = muslin.simulate("drape", sphere=False, resolution=8, steps=20, start_velocity=(0, -200, 0))
    assert run.x[:, 1].min() >= run.scene.ground - 1e-9
    assert run.energies.contacts[-1] > 0


def test_pinned_vertices_are_not_filtered():
    run = muslin.simulate("drape", resolution=12, pinned="66", start_at=(0, 0.29, 0), steps=20)
    np.testing.assert_array_equal(run.x[66], run.x0[66])
