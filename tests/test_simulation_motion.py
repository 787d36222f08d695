"""The motion as physics: free fall is free, energy is not made, a step is the system of the lecture."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin.base.errors import MuslinError, SimulationError
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.integrators import State, linearly_implicit_euler, steps
from muslin.simulation.runs import RunFolder

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
        moved = centre_of_mass(run.body, run.x, part) - centre_of_mass(run.body, run.x0, part)
        np.testing.assert_allclose(moved, [0, fall, 0], rtol=1e-9, atol=1e-9 * abs(fall))
    # the second cloth is at rest shape: every vertex falls alike
    np.testing.assert_allclose(run.v[n:], np.tile([0, -9.81 * dt * steps, 0], (n, 1)), rtol=1e-9, atol=1e-8)


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


def test_gravity_does_the_work_it_promises():
    """From rest in free fall kinetic + gravity energy changes only by the integrator's known first-order loss."""
    run = muslin.simulate("freefall", cloths="rest", steps=50, dt=1e-3)
    mass = run.body.mass.sum() / 3
    v = 9.81 * 1e-3 * np.arange(51)
    np.testing.assert_allclose(run.energies.kinetic, mass * v**2 / 2, rtol=1e-9, atol=1e-15)


def test_a_velocity_for_each_vertex_starts_a_spin_that_keeps_its_angular_momentum(tmp_path):
    options = {"cloths": "rest", "gravity": (0, 0, 0), "steps": 16, "dt": 1e-3, "frame_every": 4}
    at_rest = muslin.simulate("freefall", **options | {"steps": 1})
    x = at_rest.body.X - at_rest.body.X.mean(axis=0)
    spin = 3.0 * np.cross(np.broadcast_to((0.0, 1.0, 0.0), x.shape), x)
    whole = muslin.simulate("freefall", start_velocity=spin, out=tmp_path / "whole", **options)
    m = at_rest.body.mass
    assert whole.energies.kinetic[0] == pytest.approx(0.5 * spin.ravel() @ (m @ spin.ravel()), rel=1e-12)
    L = np.stack([whole.energies[name] for name in ("lx", "ly", "lz")], axis=1)
    assert np.abs(L[0]).max() > 1e-4
    np.testing.assert_allclose(L, np.broadcast_to(L[0], L.shape), atol=1e-3 * np.abs(L[0]).max())

    muslin.simulate("freefall", start_velocity=spin, out=tmp_path / "part", **options | {"steps": 8})
    resumed = muslin.simulate("freefall", out=tmp_path / "part", resume=True, steps=16)
    np.testing.assert_array_equal(resumed.x, whole.x)


def test_a_velocity_for_each_vertex_that_is_the_same_for_all_is_the_scenes_parameter():
    one = muslin.simulate("hang", resolution=5, steps=3, start_velocity=(1, 2, 3))
    each = muslin.simulate("hang", resolution=5, steps=3, start_velocity=np.tile((1, 2, 3), (len(one.x), 1)))
    np.testing.assert_array_equal(each.x, one.x)
    for wrong in (np.zeros((3, 3)), np.full((len(one.x), 3), np.nan), np.zeros((len(one.x), 2))):
        with pytest.raises(MuslinError, match="start_velocity has"):
            muslin.simulate("hang", resolution=5, steps=3, start_velocity=wrong)


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


def test_a_step_is_the_linear_system_of_the_lecture(solution):
    """Against a dense solve written down independently: pinning, drag spring and moving pins included."""
    scene = scenes.get(
        "hang",
        resolution=6,
        drag_vertex=20,
        drag_to=(0.1, 0.5, 0),
        drag_stiffness=50.0,
        stretch=(1.1, 1, 1.05),
        bending="off",
    )
    model, state = simulation.build(scene, solution)
    rng = np.random.default_rng(3)
    state = State(state.x + 0.01 * rng.normal(size=state.x.shape), rng.normal(size=state.x.shape))
    carried = rng.normal(size=(2, 3))
    model.pinned_velocity = lambda time, dt: carried
    dt, n = 1 / 60, len(state.x)
    model.body.update(state.x)
    after = linearly_implicit_euler(model, state, dt)
    M = model.body.mass.toarray()
    K = model.body.hessian(state.x, project=True).toarray()
    K[60:63, 60:63] += 50.0 * np.eye(3)
    f = M @ np.tile([0, -9.81, 0], n) - model.body.gradient(state.x).ravel()
    f[60:63] += 50.0 * (np.array([0.1, 0.5, 0]) - state.x[20])
    held = np.zeros((n, 3), bool)
    held[model.pinned] = True
    held = held.ravel()
    A, b = M + dt**2 * K, M @ state.v.ravel() + dt * f
    v = np.zeros(3 * n)
    v[held] = carried.ravel()
    v[~held] = np.linalg.solve(A[np.ix_(~held, ~held)], b[~held] - A[np.ix_(~held, held)] @ carried.ravel())
    np.testing.assert_allclose(after.v.ravel(), v, atol=1e-10)
    np.testing.assert_allclose(after.x, state.x + dt * after.v, atol=1e-15)


@pytest.mark.parametrize("scene", ["hang", "cape"])
def test_backward_euler_finds_its_minimum_in_the_wind(scene):
    windy, calm = (
        muslin.simulate(scene, integrator="backward-euler", steps=2, wind=(3, 1, 2), drag=drag, resolution=9)
        for drag in (5.0, 0.0)
    )
    assert np.isfinite(windy.x).all()
    assert ((windy.x - calm.x) @ (3, 1, 2)).mean() > 1e-6, "it is carried along"


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


def test_a_collapsed_triangle_is_named_and_no_function_blamed(solution):
    with pytest.raises(SimulationError, match=r"Triangle 0 .* has collapsed"):
        muslin.simulate("course", functions=solution, stretch=(1, 0, 0), steps=1)


def test_steps_go_on_from_where_they_are_asked_and_the_body_is_there():
    scene = scenes.get("hang", resolution=5)
    model, start = simulation.build(scene)
    states = steps(model, start, scene.dt, scene.integrator, 4)
    x = [start.x]
    assert next(states) is start
    for k, state in enumerate(states, start=1):
        assert state.time == pytest.approx(k * scene.dt)
        assert model.body.energy_here() == model.body.energy(state.x)
        x.append(state.x)
    assert len(x) == 5
    again = steps(model, start, scene.dt, scene.integrator)  # without end
    np.testing.assert_array_equal([next(again).x for _ in range(5)], x)
