"""A cloth does not pass through itself, counted by code that is not the simulator's."""

import sys

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial import cKDTree

import muslin
from muslin import mesh
from muslin.base.errors import MuslinError
from muslin.physics import selfcontact
from muslin.physics.selfcontact import SelfContact
from muslin.simulation import scenes
from muslin.simulation.integrators import steps
from muslin.simulation.model import State
from muslin.simulation.simulating import build
from muslin.simulation.uncrossing import uncrossed
from muslin.solve import nonnegative

pytest.importorskip("ipctk")


def crossings(x, triangles):
    """Number of (edge, triangle) pairs of x (n, 3) that cross, by plane sides and signed volumes.

    What is as good as in the plane (a flat sheet, to rounding) is on no side of it.
    """
    pairs = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    edges = np.unique(pairs, axis=0)
    middle, centre = x[edges].mean(axis=1), x[triangles].mean(axis=1)
    far = np.linalg.norm(x[edges[:, 0]] - middle, axis=1).max()
    far += np.linalg.norm(x[triangles] - centre[:, None], axis=2).max()
    near = cKDTree(middle).sparse_distance_matrix(cKDTree(centre), far, output_type="ndarray")
    (p, q), corners = edges[near["i"]].T, triangles[near["j"]]
    apart = (corners != p[:, None]).all(axis=1) & (corners != q[:, None]).all(axis=1)
    P, Q, (a, b, c) = x[p[apart]], x[q[apart]], x[corners[apart]].transpose(1, 0, 2)

    def volume(u, v, w, at):
        return np.einsum("ij,ij->i", np.cross(v - u, w - u), at - u)

    one, two = volume(a, b, c, P), volume(a, b, c, Q)
    rounding = 16 * np.finfo(float).eps * np.abs(x).max() * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    sides = (one * two < 0) & (np.minimum(np.abs(one), np.abs(two)) > rounding)
    around = np.sign([volume(P, Q, a, b), volume(P, Q, b, c), volume(P, Q, c, a)])
    return int((sides & (np.abs(around.sum(axis=0)) == 3)).sum())


def roll(n=17, pitch=0.03):
    """A sheet rolled up one and a half times, and its triangles."""
    sheet = mesh.grid(n, n)
    angle = 9.5 * (sheet.vertices[:, 0] + 0.5)
    r = 0.08 + pitch * angle / (2 * np.pi)
    return sheet, np.stack([r * np.cos(angle), sheet.vertices[:, 1], r * np.sin(angle)], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_quadratic_functions_of_what_is_not_negative_are_least_where_nnls_finds_them(seed):
    rng = np.random.default_rng(seed)
    A, c = rng.standard_normal((2, 60, 40))
    W, b = A.T @ A, -A.T @ c[:, 0]
    y = nonnegative.minimise(lambda p: W @ p, b, np.zeros(40), np.full(40, 1e-10), 500)
    expected, _ = nnls(A, c[:, 0])
    assert np.abs(y - expected).max() < 1e-8
    assert 0 < np.count_nonzero(expected) < 40


def contact_of(sheet, gap=1e-3):
    return SelfContact(sheet.vertices, sheet.triangles, np.ones(len(sheet.vertices)), gap)


def test_the_counter_of_these_tests_counts():
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, -1], [0.2, 0.2, 1], [5, 5, 5]], dtype=float)
    triangles = np.array([[0, 1, 2], [3, 4, 5]])
    assert crossings(x, triangles) == 2  # an edge of each crosses the other
    assert crossings(x + (x[:, [2]] != 0) * [2.0, 0, 0], triangles) == 0


def stepped(sheet, x, goal, gap=1e-3, dt=1 / 240, **more):
    """Where a step ends that would go from x to a goal, and the model."""
    settings = {"self_collision": "fast", "self_gap": gap, "sphere": "off", "floor": False, "dt": dt, **more}
    model, _ = build(scenes.get("drape", **settings), mesh=sheet, x=x)
    state, following = State(x, (goal - x) / dt), State(goal, (goal - x) / dt, dt)
    model.body.update(x)
    return uncrossed(model, state, following, dt, model.energy(state)), following, model


@pytest.mark.parametrize("seed", range(4))
def test_no_way_however_wild_ends_in_a_crossing(seed):
    sheet, x = roll()
    rng = np.random.default_rng(seed)
    assert crossings(x, sheet.triangles) == 0
    met = 0
    for _ in range(4):
        wave, drift = rng.standard_normal((3, 3)), rng.standard_normal(3)
        goal = x + 0.04 * np.sin(14 * x @ wave) + 0.3 * drift
        met += crossings(goal, sheet.triangles) > 0
        x = stepped(sheet, x, goal)[0].x
        assert crossings(x, sheet.triangles) == 0
    assert met


def test_where_nothing_is_met_the_goal_is_reached_to_the_bit():
    sheet, x = roll()
    goal = x + [0.0, -0.2, 0.1] + 1e-3 * np.sin(3 * x)
    after, following, _ = stepped(sheet, x, goal)
    assert after is following


def test_what_is_too_near_is_brought_apart_without_speed_or_a_change_of_momentum():
    sheet, X = two_layers(7)
    x = X.copy()
    x[49:, 2] = 0.002
    gaps = []
    for _ in range(12):
        before, (after, following, model) = x, stepped(sheet, x, x.copy(), 0.01)
        x = after.x
        assert np.abs(model.lumped @ (x - before)).max() < 1e-12
        assert np.array_equal(after.v, following.v)
        gaps.append((x[49:, 2] - x[:49, 2]).min())
    assert gaps[-1] > selfcontact.NEAREST * 0.01
    assert gaps[0] > 0.002


def two_layers(n):
    """A sheet 1 m above another, as one mesh, and its vertices."""
    sheet = mesh.grid(n, n)
    X = np.concatenate([sheet.vertices, sheet.vertices + np.array([0, 0, 1])])
    return mesh.Mesh.from_arrays(
        X, np.concatenate([sheet.triangles, sheet.triangles + n * n]), name="layers"
    ), X


def test_layers_that_meet_go_on_together_with_the_momentum_that_they_had():
    sheet, X = two_layers(6)
    x = X.copy()
    x[36:] = X[:36] + np.array([0.03, 0.02, 0.004])
    settings = {"self_collision": "fast", "sphere": "off", "floor": False, "gravity": (0.0, 0.0, 0.0)}
    model, state = build(scenes.get("drape", **settings), mesh=sheet, x=x)
    state.v = np.where(np.arange(72)[:, None] < 36, [0.1, 0.0, 0.5], [0.1, 0.0, -0.3])
    start, energies = model.body.momenta(x, state.v)[0], []
    for after in steps(model, state, 1 / 240, "linearly-implicit", 12):
        energies.append(model.energy(after))
        assert np.abs(model.body.momenta(after.x, after.v)[0] - start).max() < 1e-10
        assert crossings(after.x, sheet.triangles) == 0
    upper, lower = after.v[36:, 2].mean(), after.v[:36, 2].mean()
    assert upper == pytest.approx(lower, abs=0.05)
    assert max(energies) <= energies[0] * (1 + 1e-9)


def test_a_cloth_that_falls_in_folds_crosses_itself_only_where_nothing_keeps_it_from_that():
    scene = {
        "resolution": 20,
        "steps": 150,
        "sphere_radius": 0.12,
        "start_at": (0.0, 0.15, 0.0),
        "ground": -0.15,
    }
    alone = muslin.simulate("drape", **scene)
    assert crossings(alone.x, alone.mesh.triangles) > 0
    kept = muslin.simulate("drape", self_collision="fast", **scene)
    assert crossings(kept.x, kept.mesh.triangles) == 0
    net = kept.energies.total - kept.energies.work
    assert net.max() <= 1.001 * net[0]
    fallen = alone.energies.gravity[0] - alone.energies.gravity[-1]
    assert kept.energies.gravity[0] - kept.energies.gravity[-1] > 0.8 * fallen  # nothing holds it in the air


def test_a_cloth_dropped_in_a_pile_neither_crosses_itself_nor_gains_energy():
    scene = scenes.get(
        "drape",
        sphere="off",
        ground=-0.6,
        tilt=88.0,
        start_at=(0.0, 0.0, 0.0),
        resolution=20,
        self_collision="fast",
    )
    model, state = build(scene)
    net, crossed = [], 0
    for after in steps(model, state, scene.dt, scene.integrator, 90):
        net.append(model.energy(after) - after.work)
        crossed += crossings(after.x, model.body.surface)
    assert crossed == 0
    assert max(net) <= net[0]
    assert after.work < 0.01 * (net[0] - net[-1])  # of moving apart what is too near
    assert after.x[:, 1].min() > scene.ground - 5e-3


def test_a_run_that_was_stopped_goes_on_to_the_same_end(tmp_path):
    scene = {"resolution": 12, "self_collision": "fast", "sphere_radius": 0.12, "start_at": (0.0, 0.15, 0.0)}
    whole = muslin.simulate("drape", steps=80, **scene)
    muslin.simulate("drape", steps=50, out=tmp_path / "run", **scene)
    resumed = muslin.simulate("drape", steps=80, out=tmp_path / "run", resume=True)
    assert np.array_equal(whole.x, resumed.x)


@pytest.mark.parametrize("kept", ["fast", "exact"])
def test_without_ipctk_the_extra_is_named(monkeypatch, kept):
    monkeypatch.setitem(sys.modules, "ipctk", None)
    with pytest.raises(MuslinError, match=r"muslin\[contact\].*self_collision=off"):
        muslin.simulate("drape", resolution=4, steps=1, self_collision=kept)


def test_a_start_that_crosses_itself_is_refused():
    sheet, x = roll(pitch=0.0)
    assert selfcontact.SELF_COLLISION[0] == "off"
    assert contact_of(sheet).crosses(x)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"self_collision": "maybe"}, "off, fast or exact"),
        ({"self_collision": "exact", "integrator": "midpoint"}, "integrator = backward-euler, not midpoint"),
        ({"self_collision": "exact", "contact": "filter"}, "contact = solve, not filter"),
        ({"self_collision": "fast", "self_gap": 0.0}, "self_gap = 0.0 must be positive"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(parameters, said):
    with pytest.raises(MuslinError, match=said):
        muslin.simulate("drape", resolution=4, steps=1, **parameters)


def test_a_solid_has_no_self_collision_and_says_so():
    with pytest.raises(MuslinError, match="is for cloth"):
        muslin.simulate("beam", steps=1, self_collision="fast")
