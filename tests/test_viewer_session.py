"""A session goes on stepping while somebody pulls at it; all of it without a window."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin.viewer import ACTIONS, begin, faults, scenery

ROOT = Path(__file__).resolve().parents[1]

#: A cloth that begins without strain, a little above the sphere.
LEVEL = {"resolution": 12, "start_at": (0.003, 0.31, 0.005), "sag": 0.0}


@pytest.fixture
def drape():
    return begin("drape", **LEVEL)


@pytest.fixture
def hang():
    return begin("hang", resolution=10)


def action(key):
    return next(a.do for a in ACTIONS if a.key == key)


def test_a_step_is_the_simulations_step(drape):
    for _ in range(7):
        drape.step()
    run = muslin.simulate("drape", **LEVEL, steps=7)
    np.testing.assert_array_equal(drape.state.x, run.x)
    assert drape.steps == 7


def test_reset_returns_exactly_and_repeats_exactly(drape):
    start = drape.state.x.copy()
    for _ in range(5):
        drape.step()
    once = drape.state.x.copy()
    drape.grab(3)
    drape.drag_to((1.0, 2.0, 0.0))
    drape.step()
    drape.reset()
    np.testing.assert_array_equal(drape.state.x, start)
    assert (drape.steps, drape.state.time, drape.grabbed) == (0, 0.0, None)
    for _ in range(5):
        drape.step()
    np.testing.assert_array_equal(drape.state.x, once)


def test_dragging_pulls_the_nearest_vertex_to_the_target_and_release_lets_it_go(hang):
    corner = hang.x[np.argmin(hang.x @ [0.3, 1.0, 0.2])]
    vertex = hang.nearest(corner + 0.01)
    np.testing.assert_array_equal(hang.x[vertex], corner)
    target = corner + np.array([0.1, 0.05, 0.2])
    hang.grab(vertex)
    hang.drag_to(target)
    distances = []
    for _ in range(60):
        distances.append(np.linalg.norm(hang.x[vertex] - target))
        hang.step()
    assert distances[-1] < 0.3 * distances[0]
    hang.release()
    for _ in range(20):
        hang.step()
    assert np.linalg.norm(hang.x[vertex] - target) > 2 * distances[-1]
    assert not hang.message


def test_the_front_of_the_cloth_is_picked_and_a_ray_beside_it_picks_nothing(drape):
    vertex = 40
    eye = np.array([0.0, 3.0, 0.5])
    assert drape.pick(eye, drape.x[vertex] - eye) == vertex
    assert drape.pick(eye, -(drape.x[vertex] - eye)) is None
    assert drape.pick(eye, [1.0, 0.0, 0.0]) is None
    folded = drape.state.x.copy()
    folded[:, 1] -= 0.2 * (folded[:, 0] > 0)
    folded[:, 0] = -np.abs(folded[:, 0])  # the right half lies under the left one
    drape.state.x[:] = folded
    above = drape.pick((-0.3, 3.0, 0.0), (0.0, -1.0, 0.0))
    assert folded[above, 1] == folded[:, 1].max()


def test_pinned_vertices_cannot_be_picked(hang):
    held = hang.model.pinned
    eye = np.array([0.0, 1.0, 5.0])
    for vertex in held:
        assert hang.nearest(hang.x[vertex]) not in held
        assert hang.pick(eye, hang.x[vertex] - eye) not in held


def test_a_drag_stays_in_the_plane_that_faces_the_camera(hang):
    eye, forward = np.array([0.0, 0.0, 4.0]), np.array([0.0, 0.0, -1.0])
    hang.grab(hang.nearest((0.0, 0.0, 0.0)))
    depth = hang.pull[1][2]
    hang.drag_along(eye, (0.1, 0.05, -1.0), forward)
    np.testing.assert_allclose(hang.pull[1], [0.1 * (4 - depth), 0.05 * (4 - depth), depth])
    hang.drag_along(eye, (1.0, 0.0, 1.0), forward)  # behind the camera: nothing
    assert hang.pull[1][2] == pytest.approx(depth)


def test_without_the_sphere_nothing_touches_it_and_the_cloth_falls_on(drape):
    for _ in range(30):
        drape.step()
    assert drape.contacts > 0
    top = drape.x[:, 1].max()
    action("c")(drape)
    assert drape.contacts == 0
    assert len(scenery.bodies(drape)[1]) == 0
    for _ in range(20):
        drape.step()
        assert drape.contacts == 0
    assert drape.x[:, 1].max() < top - 0.02
    action("c")(drape)
    drape.step()
    assert len(scenery.bodies(drape)[1]) > 0


def test_a_scene_without_a_sphere_gets_one(hang):
    assert not hang.sphere
    assert len(scenery.bodies(hang)[1]) == 0
    action("c")(hang)
    assert any(isinstance(c, muslin.physics.colliders.Sphere) for c in hang.colliders(0.0))


def test_paused_no_time_passes_and_a_step_is_one_step(drape):
    action("space")(drape)
    drape.advance(1.0)
    assert drape.steps == 0
    action("n")(drape)
    assert drape.steps == 1
    assert drape.state.time == drape.scene.dt
    action("space")(drape)
    drape.advance(3.2 * drape.scene.dt, budget=60)
    assert drape.steps == 4
    action("n")(drape)
    assert not drape.playing


def test_time_passes_as_on_the_clock_and_a_slow_machine_says_so(drape):
    for _ in range(8):
        drape.advance(0.1, budget=60)
    assert drape.state.time == pytest.approx(0.8, abs=1.01 * drape.scene.dt)
    assert drape.clock().endswith("real time")
    drape.reset()
    for _ in range(10):
        drape.advance(0.1, budget=0.0)  # no time to compute: one step a frame, none left out
    assert drape.steps == 10
    assert "slow motion: 0.042 of real time" in drape.clock()


def test_strain_colours_are_white_at_rest_red_where_stretched_blue_where_pressed(drape):
    values, reach = scenery.strain(drape)
    np.testing.assert_allclose(values, 1, atol=1e-12)
    middle = scenery.strain_light(np.array([1 - reach, 1.0, 1 + reach]), reach)
    blue, white, red = middle
    assert blue[2] > blue[0] + 0.1
    assert red[0] > red[2] + 0.1
    assert np.ptp(white) < 0.15
    assert white.min() > 0.7
    drape.state.x[:, 0] *= 1.08
    values, reach = scenery.strain(drape)
    np.testing.assert_allclose(values, 1.08)
    assert reach == 0.1


def test_strain_colours_of_a_solid_are_those_of_its_tetrahedra_and_nowhere_nothing():
    bar = begin("beam")
    body = bar.model.body
    assert len(set(body.surface.ravel())) < len(body.X), "there is a vertex that is on no triangle"
    bar.state.x[:] = body.X * (1.08, 1, 1)
    values, reach = scenery.strain(bar)
    np.testing.assert_allclose(values, 1.08, rtol=1e-12)
    assert reach == 0.1
    assert np.isfinite(scenery.strain_light(values, reach)).all()


def test_an_explosion_is_told_and_pauses_and_reset_goes_on(drape):
    drape.step()
    before = drape.state.x.copy()
    drape.state.v[5] = 1e14
    drape.playing = True
    drape.advance(0.1)
    assert "exploded" in drape.message or "Reduce dt" in drape.message
    assert not drape.playing
    assert np.isfinite(drape.x).all()
    np.testing.assert_array_equal(drape.state.x, before)
    drape.reset()
    assert drape.message == ""
    assert drape.playing
    drape.step()
    assert drape.message == ""


def with_filter(folder, returned):
    """The solution, but for what `filter_velocity` returns."""
    shutil.copytree(ROOT / "solutions" / "cloth", folder, dirs_exist_ok=True)
    path, head = folder / "collision.py", "def filter_velocity(v, n):"
    text = path.read_text(encoding="utf-8")
    assert head in text
    changed = f"{head}\n    return {returned}\n\n\n@ti.func\ndef unused(v, n):"
    path.write_text(text.replace(head, changed), encoding="utf-8")
    return folder


def test_a_function_that_returns_nan_does_not_end_the_session(tmp_path):
    folder = with_filter(tmp_path / "mine", "v * ti.sqrt(-1.0 - n.dot(n))")
    session = begin("drape", folder, stand_ins={}, resolution=8, start_at=(0.0, 0.3, 0.0))
    for _ in range(60):
        session.step()
    assert "not numbers" in session.message
    assert np.isfinite(session.x).all()


def test_functions_not_written_or_wrong_are_stood_in_for_and_named(tmp_path):
    written = with_filter(tmp_path / "solved", "-v")
    folder = tmp_path / "mine"
    shutil.copytree(ROOT / "assignments" / "cloth", folder)
    stubs = begin("drape", folder, resolution=8)
    assert stubs.faults["nodal_force"] == "is not written yet"
    assert stubs.credits()[0] == "Your functions compute: nothing yet."
    for file in ("kinetic_energy.py", "collision.py"):
        shutil.copy(written / file, folder)
    session = begin("drape", folder, resolution=8)
    assert session.faults["filter_velocity"] == "is wrong"
    assert "sphere_contact" not in session.faults
    yours, muslins, because = session.credits()
    assert yours == "Your functions compute: mass, contact detection."
    assert muslins == "Muslin stands in for: elastic force, Hessian, contact response."
    assert "filter_velocity is wrong" in because
    session.step()
    assert not session.message


def test_the_solution_is_not_stood_in_for():
    assert faults(muslin.load(ROOT / "solutions" / "cloth")) == {}


def test_the_camera_sees_all_of_the_cloth_and_turns_around_it(drape):
    camera = scenery.camera(drape, (800, 600))
    seen = camera.project(drape.x, (800, 600))
    assert (seen[:, :2] > 0).all()
    assert (seen[:, :2] < [800, 600]).all()
    orbit = scenery.Orbit(camera)
    middle = orbit.ray(0.5, 0.5, 4 / 3)
    np.testing.assert_allclose(middle, camera.axes()[2], atol=1e-12)
    turned = orbit.turned(0.4, 9.0).camera
    assert np.linalg.norm(np.subtract(turned.eye, turned.target)) == pytest.approx(
        np.linalg.norm(np.subtract(camera.eye, camera.target))
    )
    assert turned.eye[1] > camera.eye[1]
    assert np.isfinite(turned.axes()).all()


def test_a_followed_cape_stays_in_the_picture():
    session = begin("cape", dt=1 / 60)
    for _ in range(30):
        session.step()
    assert not session.message
    walked = session.state.x[session.model.pinned].mean(axis=0) - session.start.x[session.model.pinned].mean(
        axis=0
    )
    shown = session.x[session.model.pinned].mean(axis=0) - session.start.x[session.model.pinned].mean(axis=0)
    assert np.linalg.norm(walked) > 0.05
    assert np.linalg.norm(shown * [1, 0, 1]) < 1e-9


def test_a_session_adapts_its_mesh_as_a_simulation_does_and_begins_with_the_first_one_again():
    folds = {"resolution": 8, "adaptive": True, "adapt_every": 8, "start_at": "0,0.302,0", "frame_every": 8}
    session = begin("drape", **folds)
    first = len(session.x)
    for _ in range(32):
        session.step()
    run = muslin.simulate("drape", **folds, steps=32)
    assert len(run.x) > first
    np.testing.assert_array_equal(session.state.x, run.x)
    assert session.triangles.max() == len(run.x) - 1
    assert scenery.strain(session)[0].shape == (len(run.x),)
    session.reset()
    assert len(session.x) == first
    for _ in range(32):
        session.step()
    np.testing.assert_array_equal(session.state.x, run.x)


def test_a_hand_keeps_its_vertex_when_the_mesh_is_adapted_and_a_failed_step_leaves_the_last_mesh(monkeypatch):
    from muslin.base.errors import SimulationError
    from muslin.simulation import integrators

    folds = {"resolution": 8, "adaptive": True, "adapt_every": 8, "start_at": "0,0.302,0"}
    session = begin("drape", **folds)
    for _ in range(15):
        session.step()
    count = len(session.x)
    free = session.nearest(session.x[40])
    session.grab(free)
    before = session.x[free].copy()
    while len(session.x) == count and session.steps < 60:
        session.step()
    assert len(session.x) > count
    assert session.grabbed is not None
    assert np.abs(session.x[session.grabbed] - before).max() < 0.05
    count, steps = len(session.x), session.steps

    def broken(model, state, dt):
        raise SimulationError("no")

    monkeypatch.setitem(integrators.INTEGRATORS, "linearly-implicit", broken)
    session._go_on()
    for _ in range(9):
        session.step()
    assert "no" in session.message
    assert len(session.x) == count == len(session.model.body.X)
    assert session.steps == steps
