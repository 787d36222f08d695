"""The simulation as physics: free fall is free, energy is not made, contacts hold, runs can be repeated."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import colliders, integrators, mesh, scenes, simulation
from muslin.errors import MuslinError, SimulationError
from muslin.integrators import State, linearly_implicit_euler
from muslin.runs import RunFolder

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def solution():
    return muslin.load(ROOT / "solutions" / "cloth")


def centre_of_mass(cloth, x, part):
    weight = np.asarray(cloth.mass.sum(axis=1)).reshape(-1, 3)[part, :1]
    return (weight * x[part]).sum(axis=0) / weight.sum()


@pytest.mark.parametrize(
    ("integrator", "dt", "steps"),
    [("linearly-implicit", 1 / 60, 100), ("linearly-implicit", 1 / 240, 100), ("backward-euler", 1 / 60, 3)],
)
def test_free_fall_is_free(solution, integrator, dt, steps):
    run = muslin.simulate("freefall", functions=solution, steps=steps, dt=dt, integrator=integrator)
    n = len(run.x) // 2
    fall = -9.81 * dt * dt * steps * (steps + 1) / 2  # implicit Euler's own free fall
    for part in (slice(0, n), slice(n, None)):
        moved = centre_of_mass(run.cloth, run.x, part) - centre_of_mass(run.cloth, run.x0, part)
        np.testing.assert_allclose(moved, [0, fall, 0], rtol=1e-9, atol=1e-9 * abs(fall))
    # the second cloth is at rest shape: every vertex falls alike
    np.testing.assert_allclose(run.v[n:], np.tile([0, -9.81 * dt * steps, 0], (n, 1)), rtol=1e-9, atol=1e-8)


def test_the_curled_cloth_really_is_curled_and_stretched():
    run = muslin.simulate("freefall", steps=1)
    n = len(run.x) // 2
    assert np.ptp(run.x0[:n, 2]) > 0.2
    assert run.energies.elastic[0] > 1.0
    np.testing.assert_array_equal(run.x0[n:], run.mesh.vertices[n:])


def test_a_cloth_in_its_plane_stays_in_its_plane(solution):
    run = muslin.simulate("course", functions=solution)
    assert len(run.energies) == 301
    assert np.abs(run.x[:, 2]).max() < 1e-9
    assert run.energies.contacts.max() == 0
    top = run.mesh.vertices[:, 1] > 0.5 - 1e-9
    np.testing.assert_array_equal(run.x[top], run.x0[top])
    assert run.x[:, 1].min() < -0.505, "the cloth has stretched under its weight"


def test_both_roads_to_the_hessian_tell_the_same_story(solution):
    closed = muslin.simulate("course", functions=solution, steps=150).energies
    lecture = muslin.simulate("course", functions=solution, steps=150, hessian="lecture").energies
    scale = np.abs(closed.gravity - closed.gravity[0]).max()
    for name in ("kinetic", "elastic", "gravity"):
        np.testing.assert_allclose(lecture[name], closed[name], rtol=1e-6, atol=1e-6 * scale)


def test_student_functions_and_the_native_element_move_the_cloth_alike(solution):
    student = muslin.simulate("throw", functions=solution, steps=60)
    native = muslin.simulate("throw", steps=60)
    np.testing.assert_allclose(student.x, native.x, atol=1e-9)


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240, 1e-3])
@pytest.mark.parametrize(
    ("pinned", "energy"), [("none", "linearised"), ("none", "area"), ("highest-row", "linearised")]
)
def test_backward_euler_only_loses_energy(solution, dt, pinned, energy):
    """From a stretched start down to rest, where nothing is left but rounding: Newton must still say it is there."""
    run = muslin.simulate(
        "course", functions=solution, steps=40, integrator="backward-euler", tolerance=1e-10, energy=energy,
        gravity=(0, 0, 0), pinned=pinned, stretch=(1.02, 1.02, 1.0), dt=dt, sphere=False,
    )  # fmt: skip
    total = run.energies.kinetic + run.energies.elastic
    assert total[0] > 1.0
    assert (np.diff(total) <= 1e-14 * total[0]).all()
    assert total[-1] < 0.9 * total[0]


def test_linearly_implicit_euler_is_first_order_in_time(solution):
    scene = scenes.get("course", gravity=(0, -5, 0), stretch=(1.2, 1.2, 1.0), E=50, nu=0.3, sphere=False)
    small = replace(scene, mesh="grid", resolution=7)

    def end(steps):
        return muslin.simulate(replace(small, dt=0.04 / steps, steps=steps), functions=solution).x

    exact = end(1280)
    errors = [np.abs(end(steps) - exact).max() for steps in (40, 80, 160)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(slopes - 1) < 0.1), (errors, slopes)


def test_thrown_cloth_never_moves_into_the_sphere(solution):
    run = muslin.simulate("throw", functions=solution)
    assert run.energies.contacts.max() > 20
    assert run.energies.approach.min() >= -1e-12
    assert run.energies.penetration.max() <= 0.02
    assert np.isfinite(run.x).all()
    assert run.cloth.stretches(run.x).max() < 1.5, "folds, not spikes"


def test_draped_cloth_rests_on_the_sphere(solution):
    run = muslin.simulate("drape", functions=solution, steps=200)
    assert run.energies.contacts.max() > 500
    assert run.energies.approach.min() >= -1e-12
    assert run.energies.penetration.max() <= 0.015
    assert run.cloth.stretches(run.x).max() < 1.2, "folds, not spikes"
    assert run.x[:, 1].max() > 0.28, "it lies on top"
    assert run.x[:, 1].min() < -0.05, "it hangs down"


SPHERE_BELOW = {"resolution": 24, "dt": 1 / 60, "steps": 60, "floor": False, "pinned": "corners"}


def test_contacts_in_the_system_are_a_constrained_step():
    """Against the dense system with a multiplier for every vertex that presses."""
    scene = scenes.get("drape", contact="solve", resolution=9, dt=1 / 60, floor=False)
    model, state = simulation.build(scene)
    cloth, dt = model.cloth, scene.dt
    for _ in range(40):
        cloth.update(state.x)
        state, last = integrators.linearly_implicit_euler(model, state, dt), state
    (contact,) = model.contacts(last, dt)
    assert len(state.pressed) > 5
    speed = np.einsum("ij,ij->i", contact.normals, last.v[contact.vertices])
    presses = np.isin(contact.vertices, last.pressed) | (speed < 0)
    N = np.zeros((presses.sum(), 3 * len(last.x)))
    for row, (i, n) in zip(
        N, zip(contact.vertices[presses], contact.normals[presses], strict=True), strict=True
    ):
        row[3 * i : 3 * i + 3] = n
    M = cloth.mass.toarray()
    A = M + dt**2 * cloth.hessian(last.x, project=True).toarray()
    b = M @ last.v.ravel() + dt * (model.weight - cloth.gradient(last.x)).ravel()
    zero = np.zeros((len(N), len(N)))
    v = np.linalg.solve(np.block([[A, N.T], [N, zero]]), np.concatenate([b, np.zeros(len(N))]))[: b.size]
    v = colliders.respond(v.reshape(-1, 3), [contact])
    np.testing.assert_allclose(state.v, v, atol=1e-5 * np.abs(v).max())


def test_contacts_in_the_system_make_no_spikes():
    stretch = {}
    for contact in colliders.CONTACT:
        run = muslin.simulate("drape", contact=contact, **SPHERE_BELOW)
        assert run.energies.contacts.max() > 20
        assert run.energies.approach.min() >= -1e-12
        assert run.energies.penetration[30:].max() <= 0.05
        stretch[contact] = run.cloth.stretches(run.x).max()
    assert stretch["solve"] < 1.05 < stretch["filter"], stretch


def test_a_run_with_contacts_in_the_system_resumes_to_the_same_end(tmp_path):
    scene = SPHERE_BELOW | {"contact": "solve", "frame_every": 5}
    muslin.simulate("drape", out=tmp_path / "run", **scene | {"steps": 30})
    longer = muslin.simulate("drape", steps=40, out=tmp_path / "run", resume=True)
    whole = muslin.simulate("drape", out=tmp_path / "whole", **scene | {"steps": 40})
    np.testing.assert_array_equal(longer.x, whole.x)


def test_a_run_of_an_earlier_muslin_resumes(tmp_path):
    """Its checkpoint knows nothing of contacts that press, its description nothing of newer parameters."""
    scene = {"resolution": 6, "frame_every": 5}
    muslin.simulate("drape", steps=5, out=tmp_path / "run", **scene)
    with np.load(tmp_path / "run" / "checkpoint.npz") as saved:
        older = {name: saved[name] for name in saved if name != "pressed"}
    np.savez(tmp_path / "run" / "checkpoint.npz", **older)
    described = json.loads((tmp_path / "run" / "run.json").read_text())
    for name in ("contact", "stretch_limit"):
        del described["parameters"][name]
    (tmp_path / "run" / "run.json").write_text(json.dumps(described))
    longer = muslin.simulate("drape", steps=10, out=tmp_path / "run", resume=True)
    whole = muslin.simulate("drape", steps=10, **scene)
    np.testing.assert_array_equal(longer.x, whole.x)


def test_a_floor_holds_and_is_never_passed():
    run = muslin.simulate("drape", sphere=False, resolution=16, steps=240, start_at=(0, 0.1, 0))
    assert run.x[:, 1].min() >= run.scene.ground - 1e-9
    assert run.x[:, 1].max() < run.scene.ground + 0.01


def test_the_hanging_cloth_keeps_its_corners(solution):
    run = muslin.simulate("hang", functions=solution, steps=60)
    held = np.flatnonzero((run.v == 0).all(axis=1))
    assert len(held) == 2
    np.testing.assert_array_equal(run.x[held], run.x0[held])
    assert run.x[:, 1].min() < -0.5


def test_the_cape_rides_on_the_walking_figure():
    run = muslin.simulate("cape", steps=60)
    held = run.scene.pinned_vertices(run.mesh)
    assert len(run.mesh.vertices) >= 3000
    expected = run.scene.carried(run.scene, run.x0[held], 60 * run.scene.dt)
    np.testing.assert_allclose(run.x[held], expected, atol=1e-12)
    assert run.energies.elastic[0] < 1e-2 * run.energies.elastic.max(), "rolled up without strain"
    assert run.energies.contacts.max() > 0


def test_the_mouse_spring_pulls_its_vertex_to_the_target():
    scene = scenes.get(
        "hang",
        resolution=9,
        gravity=(0, 0, 0),
        drag_vertex=40,
        drag_to=(0, 0.2, 0),
        drag_stiffness=1e4,
        steps=200,
    )
    run = muslin.simulate(scene)
    np.testing.assert_allclose(run.x[40], [0, 0.2, 0], atol=5e-3)


def test_gravity_does_the_work_it_promises():
    """From rest in free fall kinetic + gravity energy changes only by the integrator's known first-order loss."""
    run = muslin.simulate("freefall", cloths="rest", steps=50, dt=1e-3)
    mass = run.cloth.mass.sum() / 3
    v = 9.81 * 1e-3 * np.arange(51)
    np.testing.assert_allclose(run.energies.kinetic, mass * v**2 / 2, rtol=1e-9, atol=1e-15)


def test_a_display_mesh_is_carried_exactly_by_an_affine_motion(solution):
    from muslin.skinning import bind

    coarse, fine = mesh.grid(5, 5), mesh.unstructured(0.99, 0.99, 0.07)
    A, b = np.array([[1.1, 0.2, 0.0], [-0.3, 0.8, 0.1], [0.2, 0.0, 1.0]]), np.array([0.3, -1.0, 2.0])
    for functions in (solution, None):
        skin = bind(fine, coarse, functions)
        np.testing.assert_allclose(skin.phi.sum(axis=1), 1.0, atol=1e-12)
        assert (skin.phi > -1e-9).all(), "every display vertex lies in its triangle"
        np.testing.assert_allclose(skin.carry(coarse.vertices @ A.T + b), fine.vertices @ A.T + b, atol=1e-12)


def test_a_display_mesh_is_what_a_run_shows(tmp_path):
    display = tmp_path / "fine.obj"
    mesh.save(mesh.unstructured(1.0, 1.0, 0.04), display)
    muslin.simulate("course", steps=10, display=display, out=tmp_path / "run")
    run = RunFolder(tmp_path / "run")
    assert len(run.frames) == 3
    assert len(run.frames[0]) == len(mesh.load(display).vertices) > len(run.simulated[0])
    np.testing.assert_allclose(run.frames[0], run.rest, atol=1e-9)


def test_an_interrupted_run_is_usable_and_resumes_to_the_same_end(tmp_path):
    def stop(step, steps):
        if step == 13:
            raise KeyboardInterrupt

    part = muslin.simulate("throw", steps=30, out=tmp_path / "run", on_step=stop)
    assert part.interrupted
    folder = RunFolder(tmp_path / "run")
    assert len(folder.frames) == 3
    assert folder.energies.step[-1] == 13
    resumed = muslin.simulate("throw", out=tmp_path / "run", resume=True)
    whole = muslin.simulate("throw", steps=30, out=tmp_path / "whole")
    np.testing.assert_array_equal(resumed.x, whole.x)
    np.testing.assert_array_equal(resumed.energies, whole.energies)
    for name in ("energies.csv", *(f"frames/{k:06d}.npy" for k in range(0, 31, 5))):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_run_can_be_repeated_from_its_own_record(tmp_path):
    first = muslin.simulate("throw", steps=5, E=2e4, sphere=False, out=tmp_path / "run")
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    again = muslin.simulate(record["scene"], **record["parameters"])
    np.testing.assert_array_equal(first.x, again.x)


def test_a_run_never_overwrites_what_is_not_a_run(tmp_path):
    (tmp_path / "thesis.txt").write_text("precious")
    with pytest.raises(MuslinError, match="not a run"):
        muslin.simulate("course", steps=1, out=tmp_path)
    assert (tmp_path / "thesis.txt").read_text() == "precious"


@pytest.mark.filterwarnings("ignore")
def test_an_explosion_is_reported_with_its_step(tmp_path):
    with pytest.raises(SimulationError, match=r"exploded at step \d+"):
        muslin.simulate("hang", resolution=8, start_velocity=(1e300, 0, 0), steps=20, out=tmp_path / "run")
    assert len(RunFolder(tmp_path / "run").frames) >= 1


def test_a_nan_in_a_student_function_names_function_and_triangle(tmp_path):
    for file in (ROOT / "solutions" / "cloth").glob("*.py"):
        (tmp_path / file.name).write_text(file.read_text())
    broken = (
        (tmp_path / "stiffness.py")
        .read_text()
        .replace("ti.Vector([flip,", "ti.Vector([(s_0 - s_0) / (s_1 - s_1),")
    )
    (tmp_path / "stiffness.py").write_text(broken)
    with pytest.raises(SimulationError, match=r"eigensystem returns .* in triangle 0"):
        muslin.simulate("course", functions=tmp_path, steps=1)


def test_a_stub_is_named_when_the_simulation_needs_it():
    with pytest.raises(MuslinError, match=r"not implemented yet: \w+ \("):
        muslin.simulate("course", functions=ROOT / "assignments" / "cloth", steps=1)


def test_every_parameter_can_be_overridden_and_nonsense_is_refused():
    scene = scenes.get(
        "drape", gravity="0,-1,0", dt="1/100", sphere="off", resolution="8", sphere_radius=".2"
    )
    assert scene.gravity == (0, -1, 0)
    assert scene.dt == 0.01
    assert scene.sphere is False
    assert scenes.get("drape", E=1e3, nu=0.3).lame == pytest.approx((1e3 / 2.6, 300 / (1.3 * 0.4)))
    assert scenes.get("course").lame == pytest.approx((1e5 / 2.8, 4e4 / (1.4 * 0.2)))
    assert scenes.get("course", swap_lame=True).lame == scenes.get("course").lame[::-1]
    nonsense = [
        {"gravity": "1,2"}, {"dt": "0"}, {"dt": "nan"}, {"sphere": "perhaps"}, {"colour": "red"}, {"steps": -5},
        {"resolution": "1.5"}, {"E": -1.0, "nu": 0.3}, {"pinned": "99999"}, {"solver": "magic"}, {"rho": 0},
        {"integrator": "guess"}, {"mesh": "nowhere.obj"}, {"drag_vertex": 10**6},
        {"contact": "guess"}, {"contact": "solve", "integrator": "backward-euler"},
    ]  # fmt: skip
    assert scenes.get("cape", walk_speed="2", **{"turn_period": 4}).walk_speed == 2.0
    for name in scenes.SCENES:  # what a run records can be read back
        scene = scenes.get(name)
        assert scenes.get(name, **json.loads(json.dumps(scene.parameters()))) == scene
    for wrong in nonsense:
        with pytest.raises(MuslinError):
            muslin.simulate("drape", steps=wrong.pop("steps", 1), **wrong)


def test_a_step_is_the_linear_system_of_the_lecture(solution):
    """Against a dense solve written down independently: pinning, drag spring and moving pins included."""
    scene = scenes.get(
        "hang",
        resolution=6,
        drag_vertex=20,
        drag_to=(0.1, 0.5, 0),
        drag_stiffness=50.0,
        stretch=(1.1, 1, 1.05),
    )
    model, state = simulation.build(scene, solution)
    rng = np.random.default_rng(3)
    state = State(state.x + 0.01 * rng.normal(size=state.x.shape), rng.normal(size=state.x.shape))
    carried = rng.normal(size=(2, 3))
    model.held_velocity = lambda time, dt: carried
    dt, n = 1 / 60, len(state.x)
    model.cloth.update(state.x)
    after = linearly_implicit_euler(model, state, dt)
    M = model.cloth.mass.toarray()
    K = model.cloth.hessian(state.x, project=True).toarray()
    K[60:63, 60:63] += 50.0 * np.eye(3)
    f = M @ np.tile([0, -9.81, 0], n) - model.cloth.gradient(state.x).ravel()
    f[60:63] += 50.0 * (np.array([0.1, 0.5, 0]) - state.x[20])
    held = np.zeros((n, 3), bool)
    held[model.held] = True
    held = held.ravel()
    A, b = M + dt**2 * K, M @ state.v.ravel() + dt * f
    v = np.zeros(3 * n)
    v[held] = carried.ravel()
    v[~held] = np.linalg.solve(A[np.ix_(~held, ~held)], b[~held] - A[np.ix_(~held, held)] @ carried.ravel())
    np.testing.assert_allclose(after.v.ravel(), v, atol=1e-10)
    np.testing.assert_allclose(after.x, state.x + dt * after.v, atol=1e-15)


def test_a_run_resumed_for_longer_is_the_run_made_in_one_go(tmp_path):
    muslin.simulate("throw", steps=12, out=tmp_path / "run")
    longer = muslin.simulate("throw", steps=20, out=tmp_path / "run", resume=True)
    whole = muslin.simulate("throw", steps=20, out=tmp_path / "whole")
    np.testing.assert_array_equal(longer.x, whole.x)
    np.testing.assert_array_equal(RunFolder(tmp_path / "run").times, RunFolder(tmp_path / "whole").times)
    assert RunFolder(tmp_path / "run").scene == RunFolder(tmp_path / "whole").scene
    for changed in ({"gravity": (0, 0, 0)}, {"hessian": "lecture"}, {"display": "fine.obj"}):
        with pytest.raises(MuslinError, match="cannot change"):
            muslin.simulate("throw", out=tmp_path / "run", resume=True, **changed)


def test_a_mistake_does_not_cost_the_last_run(tmp_path):
    muslin.simulate("throw", steps=10, out=tmp_path)
    for wrong in (
        {"integrator": "guess"},
        {"display": "nowhere.obj"},
        {"functions": ROOT / "assignments" / "cloth"},
    ):
        with pytest.raises(MuslinError):
            muslin.simulate("throw", steps=10, out=tmp_path, **wrong)
    assert len(RunFolder(tmp_path).frames) == 3


@pytest.mark.parametrize(
    "damage", ["run.json", "mesh.npz", "energies.csv", "frames/000005.npy", "checkpoint.npz"]
)
@pytest.mark.parametrize("content", [None, b"", b"{}", b"\x93NUMPY junk"])
def test_a_damaged_run_is_refused_in_one_sentence(damage, content, tmp_path):
    muslin.simulate("course", steps=5, out=tmp_path)
    (tmp_path / damage).unlink()
    if content is not None:
        (tmp_path / damage).write_bytes(content)

    def read_everything():
        run = RunFolder(tmp_path)
        run.checkpoint()
        assert [len(frame) for frame in run.frames] == [400, 400]
        assert len(run.energies) == 6

    with pytest.raises((MuslinError, AssertionError)) as caught:
        read_everything()
    assert "\n" not in str(caught.value).split("assert")[0]


def test_wind_pushes_a_sheet_with_the_drag_of_its_area():
    """A unit square across a wind of speed u feels drag/2 u^2 along its normal; along the wind it feels nothing."""
    model, state = simulation.build(scenes.get("hang", resolution=5, tilt=90, wind=(0, 0, 3), drag=2.0))
    force = model.wind_force(state.x, state.v)
    np.testing.assert_allclose(np.abs(force.sum(axis=0)), [0, 0, 2.0 / 2 * 9 * 1.0], atol=1e-12)
    assert force.sum(axis=0)[2] > 0
    model.wind = (4.0, 1.0, 0.0)
    np.testing.assert_allclose(model.wind_force(state.x, state.v), 0, atol=1e-12)


@pytest.mark.parametrize("scene", ["hang", "cape"])
def test_backward_euler_finds_its_minimum_in_the_wind(scene):
    run = muslin.simulate(scene, integrator="backward-euler", steps=2, wind=(3, 1, 2), drag=5.0, resolution=9)
    assert np.isfinite(run.x).all()


def test_without_gravity_a_cloth_at_rest_stays_at_rest(solution):
    for integrator in ("linearly-implicit", "backward-euler"):
        run = muslin.simulate(
            "hang", functions=solution, gravity=(0, 0, 0), steps=3, resolution=9, integrator=integrator
        )
        np.testing.assert_allclose(run.x, run.x0, atol=1e-10)


def test_a_line_search_keeps_newton_on_the_way_down():
    """A cloth flung at a hundred metres per second: the full first Newton step would go up."""
    run = muslin.simulate(
        "hang",
        integrator="backward-euler",
        steps=2,
        resolution=9,
        start_velocity=(0, 100, 100),
        gravity=(0, 0, 0),
    )
    total = run.energies.kinetic + run.energies.elastic
    assert (np.diff(total) <= 1e-9 * total[0]).all()


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
    from muslin.colliders import Capsule, approach, depth, detect, respond

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
    from muslin.colliders import Contacts, approach, respond

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


def test_a_collapsed_triangle_is_named_and_no_function_blamed(solution):
    with pytest.raises(SimulationError, match=r"Triangle 0 .* has collapsed"):
        muslin.simulate("course", functions=solution, stretch=(1, 0, 0), steps=1)


def test_a_scene_of_ones_own_is_simulated_but_not_written(tmp_path):
    own = replace(scenes.get("course"), name="mine", steps=1)
    assert len(muslin.simulate(own).energies) == 2
    with pytest.raises(MuslinError, match="not one of Muslin's"):
        muslin.simulate(own, out=tmp_path)
