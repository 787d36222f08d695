"""Contacts in the system: colliders at rest add nothing to the energy, and friction is Coulomb's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import muslin
from muslin.base.errors import MuslinError
from muslin.physics.colliders import Capsule, Plane, Sphere
from muslin.physics.meeting import STRIDE, Pairs, meet, nearest_weights
from muslin.simulation import guarded, integrators, scenes, simulating
from muslin.simulation.runs import COLUMNS, RunFolder
from muslin.simulation.touching import Pressed, Touching

SOLVED = {"contact": "solve", "resolution": 16, "bending": "off"}


def own_energy(run):
    """The total energy without what was put in."""
    return run.energies.total - run.energies.work


def assert_nothing_is_gained(run):
    energy = own_energy(run)
    assert energy.max() <= energy[0] + 0.01 * abs(energy[0])


@pytest.mark.parametrize(
    "case",
    [
        {"ground": -0.3, "steps": 120},
        {"ground": 0.05, "steps": 80},
        {"dt": 1 / 60, "steps": 60, "friction": 0.3},
        {"integrator": "backward-euler", "dt": 1 / 60, "steps": 30, "resolution": 10},
        {"sphere_velocity": (0, 1, 0), "friction": 0.3, "steps": 60},
    ],
    ids=["floor-at-the-sphere", "floor-through-the-sphere", "large-steps", "backward-euler", "moving"],
)
def test_contact_adds_no_energy(case):
    run = muslin.simulate("drape", **{**SOLVED, **case})
    assert run.energies.contacts.max() > 10
    assert run.energies.approach.min() >= -1e-9
    assert run.energies.penetration.max() < 1e-6
    assert_nothing_is_gained(run)


def test_backward_euler_ends_every_step_of_a_cloth_that_buckles_on_the_sphere():
    """Its residual is as small as contacts, a million times as hard as the cloth, let rounding make it."""
    run = muslin.simulate("drape", resolution=12, integrator="backward-euler", dt=1 / 60, steps=32)
    assert run.energies.contacts.max() > 4
    assert run.energies.penetration.max() < 1e-6
    assert_nothing_is_gained(run)


def test_a_step_in_which_newton_finds_no_end_is_taken_in_halves(monkeypatch):
    monkeypatch.setattr(guarded, "WHOLE", 6)
    how = {"resolution": 8, "integrator": "backward-euler", "dt": 1 / 60, "steps": 20}
    run = muslin.simulate("drape", **how)
    np.testing.assert_allclose(run.energies.time, np.arange(21) / 60, atol=1e-12)
    assert run.energies.contacts.max() > 0
    assert run.energies.penetration.max() < 1e-6
    assert_nothing_is_gained(run)
    monkeypatch.setattr(guarded, "HALVES", 0)
    with pytest.raises(MuslinError, match="did not converge in 6 iterations"):
        muslin.simulate("drape", **how)


@pytest.mark.parametrize("speed", [20.0, 120.0])
def test_a_fast_cloth_does_not_pass_the_sphere(speed):
    run = muslin.simulate("drape", **SOLVED, start_velocity=(0, -speed, 0), start_at=(0, 0.6, 0), steps=30)
    assert run.energies.penetration.max() < 1e-6
    middle = run.x[np.argmin(np.linalg.norm(run.x0[:, [0, 2]], axis=1))]
    assert middle[1] > 0.28, "it was caught on top"
    assert_nothing_is_gained(run)


def test_penetration_is_taken_back_without_making_speed():
    run = muslin.simulate("drape", **SOLVED, sphere=False, ground=0, start_at=(0, -0.01, 0), steps=30)
    assert run.energies.penetration[0] == pytest.approx(0.01)
    assert run.energies.penetration[-1] < 1e-9
    assert run.energies.kinetic.max() < 1e-15
    assert run.energies.work[-1] == pytest.approx(0.2 * 9.81 * 0.01, rel=1e-6), "lifting it took work"


@pytest.mark.parametrize(("height", "dt"), [(0.28, 1 / 240), (0.1, 1 / 60)], ids=["a-cap", "half"])
def test_what_begins_inside_a_sphere_comes_out_without_being_strained(height, dt):
    run = muslin.simulate(
        "drape", resolution=16, start_at=(0.003, height, 0.005), dt=dt, steps=round(0.75 / dt)
    )
    assert run.energies.penetration[0] > 0.01
    assert run.energies.penetration[-1] < 2e-3
    assert_nothing_is_gained(run)
    lifting = 0.2 * 9.81 * run.energies.penetration[0]
    assert run.energies.total.max() < run.energies.total[0] + lifting, "no more than lifting the cloth takes"


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
@pytest.mark.parametrize("gap", [0.0, -0.01], ids=["no-gap", "less-than-none"])
def test_a_cloth_between_two_spheres_is_held_without_gaining_energy(gap, dt):
    """Where the spheres overlap there is no place for it to be: it stays as it is."""
    middle = 0.3 + gap / 2
    spheres = Sphere((0.0, -middle, 0.0), 0.3), Sphere((0.0, middle, 0.0), 0.3)
    start = {"start_at": (0.003, 0.0, 0.005), "sag": 0.0}
    scene = scenes.get("drape", resolution=12, **start, dt=dt, steps=round(0.4 / dt))
    run = muslin.simulate(replace(scene, colliders=lambda *_: spheres))
    energy = own_energy(run)
    assert max(energy.max(), run.energies.total.max()) < 0.01 * 0.2 * 9.81 * 0.3
    assert run.energies.penetration.max() <= run.energies.penetration[0] + 2e-3
    assert np.ptp(run.x[:, 1]) > 0.2, "it hangs from where it is held"


@pytest.mark.parametrize("height", [1.3, 10.3])
def test_a_fall_of_metres_is_met_and_never_above_its_start(height):
    run = muslin.simulate("drape", resolution=16, start_at=(0.003, height, 0.005), dt=1 / 60, steps=150)
    assert run.energies.total.max() <= 1.01 * run.energies.total[0]
    assert run.energies.contacts.max() > 10
    assert run.energies.penetration.max() < 1e-6


def test_a_sphere_of_a_centimetre_under_large_triangles_stores_nothing():
    run = muslin.simulate(
        "drape", resolution=32, sphere_radius=0.01, start_at=(0.003, 0.05, 0.005), dt=1 / 60, steps=40
    )
    assert run.energies.contacts.max() > 0
    assert run.energies.total.max() <= 1.01 * run.energies.total[0]


def test_a_gale_stores_no_more_than_it_blows():
    run = muslin.simulate("hang", resolution=12, wind=(0, 0, -20), drag=1.2, steps=60)
    pressure = 1.2 / 2 * 20**2
    assert run.energies.elastic.max() < 0.05 * pressure, (
        "a fraction of pressure times a square metre times a metre"
    )
    assert np.abs(run.v).max() < 20, "nothing is faster than the wind"
    assert_nothing_is_gained(run)


@pytest.mark.parametrize("friction", [0.55, 0.4])
def test_a_patch_sticks_on_an_incline_or_slides_as_coulomb_says(friction):
    """tan(theta) = 0.5: it holds with friction 0.55; with 0.4 it goes with g (sin - 0.4 cos)."""
    theta, count = np.arctan(0.5), 60
    scene = scenes.get("drape", **SOLVED, sphere=False, friction=friction, start_at=(0, 0, 0), dt=1 / 240)
    model, state = simulating.build(scene)
    down = 9.81 * np.array([np.sin(theta), -np.cos(theta), 0.0])
    model.weight = (model.body.mass @ np.tile(down, len(state.x))).reshape(-1, 3)
    plane = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    model.colliders = lambda time: (plane,)
    speeds = []
    for now in integrators.steps(model, state, scene.dt, scene.integrator, count):
        speeds.append(now.v.mean(axis=0)[0])
    if friction > 0.5:
        assert abs(speeds[-1]) < 1e-6
    else:
        want = 9.81 * (np.sin(theta) - friction * np.cos(theta))
        assert (speeds[-1] - speeds[20]) / (40 * scene.dt) == pytest.approx(want, rel=0.01)


def test_a_cloth_on_the_floor_stays_at_rest():
    run = muslin.simulate(
        "drape", **SOLVED, sphere=False, ground=0, start_at=(0, 0, 0), friction=0.3, steps=40
    )
    assert np.abs(run.v).max() <= 1e-12


def test_where_a_way_touches_decides_and_not_where_it_ends():
    sphere, capsule = Sphere((0, 0, 0), 0.1), Capsule((-1, 0, 0), (1, 0, 0), 0.1)
    x = np.array([[0.0, 0.5, 0.0], [0.0, 0.5, 0.3], [0.5, 0.5, 0.0]])
    v = np.tile([0.0, -1.0, 0.0], (3, 1))
    assert meet([sphere], x, v, 1.0).hit.tolist() == [True, False, False]
    found = meet([capsule], x, v, 1.0)
    assert found.hit.tolist() == [True, False, True]
    np.testing.assert_allclose(found.gaps[[0, 2]], 0.4, atol=1e-3)


def test_the_nearest_point_of_a_triangle_is_nearer_than_any_other():
    rng = np.random.default_rng(3)
    corners, p = rng.normal(size=(40, 3, 3)), rng.normal(size=(40, 3))
    w = nearest_weights(p, corners)
    assert w.min() >= 0
    np.testing.assert_allclose(w.sum(axis=1), 1)
    best = np.linalg.norm(np.einsum("tk,tki->ti", w, corners) - p, axis=1)
    for other in rng.dirichlet(np.ones(3), size=200):
        assert (best <= np.linalg.norm(other @ corners - p, axis=1) + 1e-12).all()


def test_the_log_tells_momentum():
    run = muslin.simulate("freefall", resolution=6, steps=30, cloths="curled", gravity=(0, 0, 0),
                          start_velocity=(0.5, 0, -0.2))  # fmt: skip
    mass = run.body.mass.sum() / 3
    for name, speed in (("px", 0.5), ("py", 0.0), ("pz", -0.2)):
        np.testing.assert_allclose(run.energies[name], mass * speed, atol=1e-9 * mass)
    assert np.abs(run.energies.lx).max() < 1e-9
    about = np.cross(np.array([0.0, 0.0, 3.0]), run.x)
    _, spin = run.body.momenta(run.x, about)
    middle = run.x - run.x.mean(axis=0)
    assert spin[2] == pytest.approx(3 * mass * (middle[:, :2] ** 2).sum(axis=1).mean(), rel=0.2)


def test_a_resumed_run_goes_on_with_its_contacts(tmp_path):
    whole = muslin.simulate("drape", **SOLVED, friction=0.3, steps=60)
    muslin.simulate("drape", **SOLVED, friction=0.3, steps=40, out=tmp_path / "r")
    resumed = muslin.simulate("drape", steps=60, out=tmp_path / "r", resume=True)
    np.testing.assert_array_equal(resumed.x, whole.x)
    np.testing.assert_array_equal(resumed.energies.work, whole.energies.work)


def test_a_run_written_before_momentum_was_logged_can_be_read(tmp_path):
    muslin.simulate("drape", **SOLVED, steps=4, out=tmp_path / "r")
    log = tmp_path / "r" / "energies.csv"
    rows = [",".join(line.split(",")[:9]) for line in log.read_text().splitlines()]
    log.write_text("\n".join(rows) + "\n")
    table = RunFolder(tmp_path / "r").energies
    assert table.dtype.names == tuple(COLUMNS)
    assert np.isfinite(table.total).all()
    assert np.isnan(table.px).all()


def test_wind_slows_down_and_never_throws_back():
    run = muslin.simulate(
        "drape", resolution=8, sphere=False, floor=False, gravity=(0, 0, 0), drag=50, dt=1 / 60, steps=20,
        start_velocity=(0, -20, 0),
    )  # fmt: skip
    assert (np.diff(run.energies.kinetic) <= 0).all()
    assert run.v[:, 1].max() <= 1e-9
    assert run.v[:, 1].min() > -1


def test_friction_is_not_negative():
    with pytest.raises(MuslinError, match="friction"):
        scenes.get("drape", friction=-0.1)


def test_a_sphere_smaller_than_a_triangle_is_met():
    small = {
        "resolution": 12,
        "sphere_radius": 0.02,
        "start_at": (0.02, 0.06, 0.03),
        "floor": False,
        "steps": 90,
    }
    run = muslin.simulate("drape", **{**SOLVED, **small})
    corners = run.x[run.mesh.triangles]
    weights = nearest_weights(np.zeros((len(corners), 3)), corners)
    distance = np.linalg.norm(np.einsum("tk,tki->ti", weights, corners), axis=1)
    assert 0.02 - 1e-5 < distance.min() < 0.03
    assert_nothing_is_gained(run)


def test_a_step_that_is_not_solved_to_its_end_pushes_with_what_a_vertex_has_got():
    """A particle that falls at 1 m/s onto a floor gets m, however far its step was solved."""
    mass, stiffness, down = 0.2, 1e5, np.array([[0.0, -1.0, 0.0]])
    up, still = np.array([[0.0, 1.0, 0.0]]), np.zeros((1, 3))
    pairs = Pairs(
        key=np.zeros(1, np.int64), corners=np.zeros((1, 1), np.int64), weights=np.ones((1, 1)), normals=up,
        gaps=np.zeros(1), velocities=still, hit=np.ones(1, bool),
    )  # fmt: skip
    touching = Touching(pairs, Pressed(), 0.01, stiffness)
    for left in (1.0, 0.5, 0.1):
        solved = left * down
        presses = touching.pressing(solved.ravel())
        unbalanced = mass * (solved - down) + touching.gradient(solved.ravel()).reshape(-1, 3)
        push, _ = touching.impulses(solved, still, presses, np.array([mass]), unbalanced, np.array([mass]))
        assert push[0] == pytest.approx(mass, rel=1e-9)


def contradicting(lever: float) -> tuple[Pairs, np.ndarray]:
    """A corner and a point of its triangle, `lever` off it, where the floor is slower by 0.01 m/s."""
    up = np.tile([0.0, 1.0, 0.0], (2, 1))
    weights = np.array([[1.0, 0.0, 0.0], [1 - lever, lever, 0.0]])
    return Pairs(
        key=np.arange(2), corners=np.array([[0, 0, 0], [0, 1, 2]]), weights=weights, normals=up,
        gaps=np.zeros(2), velocities=[[0.01], [0.0]] * up, hit=np.ones(2, bool),
    ), up  # fmt: skip


@pytest.mark.parametrize("lever", [0.01, 0.1, 0.5])
def test_what_two_points_of_a_triangle_give_is_no_more_than_its_vertices_got(lever):
    """Held fast at both, the far corner is thrown; taken by itself each point would say it gave more than there is."""
    pairs, up = contradicting(lever)
    touching = Touching(pairs, Pressed(), 0.01, 1e5)
    got = np.array([[0.0, 0.3, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.0]])
    solved = np.array([[0.0, 0.01, 0.0], [0.0, -0.01 * (1 - lever) / lever, 0.0], [0.0, 0.0, 0.0]])
    unbalanced = got + touching.gradient(solved.ravel()).reshape(-1, 3)
    push, _ = touching.impulses(
        solved, solved, np.ones(2, bool), np.full(2, 0.1), unbalanced, np.full(3, 0.1)
    )
    assert (push >= 0).all()
    given = touching.spread(push[:, None] * up, 3)
    assert given.sum() <= 1.01 * got.sum()
    assert np.abs(given - got).sum() <= np.abs(got).sum()


def test_contacts_that_would_pull_are_let_go_where_points_of_triangles_hold_against_each_other():
    pairs, _ = contradicting(0.05)
    touching = Touching(pairs, Pressed(), 0.01, 1e5)
    rising = np.array(
        [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
    )  # off the floor, but for the corner
    assert touching.release(rising.ravel())
    assert touching.presses.tolist() == [True, False]
    assert not touching.release(rising.ravel())


def test_only_triangles_longer_than_a_collider_is_thick_are_watched_inside():
    sphere = Sphere((0.0, 0.0, 0.0), 0.05)
    triangle = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    x = np.concatenate([0.01 * triangle, 0.2 * triangle]) + np.array([0.0, 0.0501, 0.0])
    triangles, longest = np.array([[0, 1, 2], [3, 4, 5]]), np.array([0.023, 0.45])
    met = meet([sphere], x, np.zeros_like(x), 0.01, triangles=triangles, longest=longest)
    inside = (met.weights > 0).sum(axis=1) > 1
    assert met.corners[inside].tolist() == [[3, 4, 5]]
    assert met.key[inside].tolist() == [STRIDE + 1]
    assert met.corners[~inside, 0].tolist() == [0, 1, 2]
    found = meet([sphere], x, np.zeros_like(x), 0.01, triangles=triangles[:1], longest=longest[:1])
    assert found.corners.shape[1] == 1
