"""Backward Euler with a barrier against self-collision: forces, momentum, energy, friction, and never a crossing."""

import dataclasses

import numpy as np
import pytest
from test_self_contact import crossings

import muslin
from muslin import mesh
from muslin.physics.barrier import Barrier
from muslin.simulation import scenes
from muslin.simulation.incremental import IncrementalPotential
from muslin.simulation.integrators import steps
from muslin.simulation.model import State
from muslin.simulation.simulating import build

pytest.importorskip("ipctk")

#: A woven cotton, softer in bending than what `drape` is of.
COTTON = {"mu": 5e6, "lam": 5e6, "h": 4e-4, "rho": 500.0, "bending_stiffness": 1.6e-5, "damping": 0.0}

#: A cloth alone in space, with the barrier.
ALONE = {**COTTON, "self_collision": "exact", "sphere": "off", "gravity": (0.0, 0.0, 0.0), "dt": 1 / 240}


def layers(friction=0.3, **more):
    """A model of two small sheets, one on the other within the gap, and their state."""
    sheet = mesh.grid(5, 5)
    n, flat = len(sheet.vertices), 0.2 * sheet.vertices
    ripples = 0.002 * np.sin(40 * flat[:, :1]) * [0, 0, 1]
    X = np.concatenate([flat, flat + ripples + [0.013, 0.017, 0.01]])
    both = mesh.Mesh.from_arrays(X, np.concatenate([sheet.triangles, sheet.triangles + n]), name="layers")
    scene = scenes.get("drape", **{**ALONE, "self_gap": 0.015, "friction": friction, **more})
    model, _ = build(scene, mesh=both, x=X)
    v = np.array([0.2, -0.1, 0.3]) + 0.05 * np.random.default_rng(3).standard_normal(X.shape)
    return model, State(X, v)


def hairpin(n=12, radius=0.06):
    """A sheet folded once, and where it lies."""
    sheet = mesh.grid(n, n)
    s = sheet.vertices[:, 0]
    angle = np.clip(s / radius, -np.pi / 2, np.pi / 2)
    straight = np.maximum(np.abs(s) - radius * np.pi / 2, 0.0)
    x = np.stack([radius * np.cos(angle) - straight, sheet.vertices[:, 1], radius * np.sin(angle)], axis=1)
    return sheet, x


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_the_gradient_of_a_step_with_barrier_and_friction_is_that_of_its_potential(friction):
    model, state = layers(friction)
    problem = IncrementalPotential(model, state, 1 / 240)
    v = state.v.ravel() + 0.01 * np.sin(np.arange(state.v.size))
    problem.value(v)
    gradient, _ = problem.gradient()
    barrier = model.barrier.gradient(state.x + v.reshape(-1, 3) / 240)
    assert np.abs(barrier).max() / 240 > 1e-3 * np.abs(gradient).max()
    assert (problem.rubbing is not None) == bool(friction)
    for direction in np.random.default_rng(4).standard_normal((6, v.size)):
        step = 1e-5 * direction
        slope = (problem.value(v + step) - problem.value(v - step)) / 2
        assert slope == pytest.approx(gradient @ step, rel=1e-6)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_the_matrix_of_a_step_with_barrier_and_friction_is_the_derivative_of_its_gradient(friction):
    model, state = layers(friction, project="off")
    problem = IncrementalPotential(model, state, 1 / 240)
    v = state.v.ravel() + 0.01 * np.sin(np.arange(state.v.size))

    def gradient(v):
        problem.value(v)
        return problem.gradient()[0]

    for direction in np.random.default_rng(5).standard_normal((4, v.size)):
        step = 1e-5 * direction
        change = (gradient(v + step) - gradient(v - step)) / 2
        problem.value(v)
        problem.assemble(exact=True)
        assert np.abs(problem.solve(change) - step).max() < 1e-4 * np.abs(step).max()
    assert model.system.more.nnz > 0


def test_friction_with_itself_takes_energy_and_zero_switches_it_off():
    model, state = layers(0.3)
    rubbing = model.barrier.rubbing(state.x)
    assert np.sum(rubbing.gradient(state.v) * state.v) > 0
    assert not rubbing.gradient(np.ones_like(state.v)).any()
    assert layers(0.0)[0].barrier.rubbing(state.x) is None


@pytest.mark.parametrize("slope", [0.2, 0.6])
def test_a_cloth_on_a_cloth_slides_down_a_slope_only_where_friction_does_not_hold_it(slope):
    along, across = 9.81 * np.array([slope, 1.0]) / np.hypot(1.0, slope)
    held = ",".join(map(str, range(25)))
    model, state = layers(0.3, gravity=(along, 0.0, -across), pinned=held, dt=1 / 120)
    state.v = np.zeros_like(state.x)
    state.x[25:, 2] = 0.0149  # where it lies
    speeds = [s.v[25:, 0].mean() for s in steps(model, state, 1 / 120, "backward-euler", 16)]
    expected = max(along - 0.3 * across, 0.0)
    assert (speeds[16] - speeds[4]) * 10 == pytest.approx(expected, rel=0.05, abs=1e-3)


def test_a_free_cloth_that_meets_itself_keeps_its_momentum_and_gains_no_energy():
    sheet, x = hairpin()
    model, _ = build(scenes.get("drape", **{**ALONE, "self_gap": 0.02, "friction": 0.3}), mesh=sheet, x=x)
    state = State(x, np.array([0.3, 0.2, 0.1]) - np.sign(x[:, 2:]) * [0.2, 0.1, 1.5])
    start, energies, pressed = model.body.momenta(state.x, state.v)[0], [], 0.0
    for after in steps(model, state, 1 / 240, "backward-euler", 14):
        model.body.update(after.x)
        energies.append(model.energy(after))
        pressed = max(pressed, np.abs(model.barrier.gradient(after.x)).max())
        assert np.abs(model.body.momenta(after.x, after.v)[0] - start).max() < 1e-10
        assert crossings(after.x, model.body.surface) == 0
    assert pressed > 1e-2
    assert (np.diff(energies) <= 1e-12).all()


def turning(scene, start, time):
    """Where pinned vertices are that turn about the x axis, one side against the other."""
    angle = np.sign(start[:, 0]) * 6.0 * time
    c, s = np.cos(angle), np.sin(angle)
    y, z = start[:, 1], start[:, 2]
    return np.stack([start[:, 0] * (1 - 0.3 * min(time, 1)), c * y - s * z, s * y + c * z], axis=1)


@pytest.mark.parametrize("kept", ["off", "exact"])
def test_a_cloth_that_is_wrung_never_crosses_itself_where_it_is_kept_from_it(kept):
    sheet = mesh.grid(11, 6)
    x = np.stack([sheet.vertices[:, 0], 0.5 * sheet.vertices[:, 1], np.zeros(len(sheet.vertices))], axis=1)
    sheet = mesh.Mesh.from_arrays(x, sheet.triangles, name="strip")
    settings = {
        **ALONE,
        "self_collision": kept,
        "integrator": "backward-euler",
        "dt": 1 / 60,
        "self_gap": 4e-3,
    }
    scene = dataclasses.replace(scenes.get("drape", **settings), carried=turning)
    ends = np.flatnonzero(np.abs(np.abs(x[:, 0]) - 0.5) < 1e-9)
    model, state = build(scene, mesh=sheet, x=x, pinned=ends)
    counts = [crossings(s.x, sheet.triangles) for s in steps(model, state, 1 / 60, "backward-euler", 22)]
    assert (sum(counts) == 0) == (kept == "exact")


#: A sheet that falls upright on the floor, and into folds.
PILE = {
    **COTTON, "resolution": 12, "sphere": "off", "ground": -0.6, "floor": True, "tilt": 88.0,
    "start_velocity": (0, -3, 0), "friction": 0.3, "dt": 1 / 60, "frame_every": 1, "contact": "solve",
    "integrator": "backward-euler",
}  # fmt: skip


def frames(folder):
    return [np.load(frame) for frame in sorted((folder / "frames").iterdir())]


def test_a_cloth_in_a_pile_never_crosses_itself_and_gains_no_energy_and_goes_on_where_it_stopped(tmp_path):
    run = muslin.simulate("drape", steps=14, out=tmp_path / "run", self_collision="exact", **PILE)
    ways = frames(tmp_path / "run")
    assert sum(crossings(x, run.mesh.triangles) for x in ways) == 0
    barrier = Barrier(run.body.X, run.body.surface, run.body.stiffness, run.scene.self_gap, 0.0)
    assert barrier.energy(ways[12]) > 0
    net = run.energies.total - run.energies.work
    assert np.diff(net).max() <= 1e-6 * abs(net[0])
    assert run.energies.penetration.max() < 1e-6
    muslin.simulate("drape", steps=11, out=tmp_path / "again", self_collision="exact", **PILE)
    resumed = muslin.simulate("drape", steps=13, out=tmp_path / "again", resume=True)
    assert np.array_equal(resumed.x, ways[13])


def test_exact_brings_along_what_it_needs():
    scene = scenes.get("drape", self_collision="exact")
    assert (scene.integrator, scene.contact) == ("backward-euler", "solve")
