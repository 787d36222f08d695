"""Friction of the cloth with itself in `fast`: forces against high precision, momenta, and sheets on a slope."""

import mpmath
import numpy as np
import pytest

from muslin import mesh
from muslin.physics.barrier import HOLDS
from muslin.physics.meeting import Pairs
from muslin.physics.nearness import Beside, turning
from muslin.simulation import scenes
from muslin.simulation.integrators import steps
from muslin.simulation.model import State
from muslin.simulation.rubbing import slowed, steepness
from muslin.simulation.simulating import build
from muslin.simulation.touching import Pressed, Touching


def rubbing(rng, c=6, n=13):
    """Pairs of points of a cloud of n vertices that only rub, where those are, and velocities."""
    x, v = rng.standard_normal((2, n, 3))
    v *= HOLDS * rng.choice([0.1, 1.0, 30.0], (n, 1))
    corners = np.array([rng.choice(n, 4, replace=False) for _ in range(c)])
    s, t = rng.random((2, c))
    weights = np.stack([1 - s, s, t - 1, -t], axis=1)
    normals = rng.standard_normal((c, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    turns = turning(corners, weights, x, 10.0)
    none = np.zeros((c, 3))
    pairs = Pairs(np.arange(c), corners, weights, normals, np.full(c, 1e3), none, np.zeros(c, bool), turns)
    return Touching(pairs, Pressed(), 0.01, 1.0), x, v


def coulomb(most, speed):
    """mu lambda s(y), from its definition, to 40 digits."""
    e = mpmath.mpf(HOLDS)
    return most * (speed**2 / e - speed**3 / (3 * e**2) if speed < e else speed - e / 3)


def friction(touching, most, v):
    """What pairs that may rub so hard add at v (n, 3) of mpmath numbers, pair by pair."""
    total = mpmath.mpf(0)
    for c, (corners, turn, n) in enumerate(
        zip(touching.pairs.corners, touching.pairs.turns, touching.pairs.normals, strict=True)
    ):
        u = [
            mpmath.fsum(turn[k, i, j] * v[corners[k]][j] for k in range(4) for j in range(3))
            for i in range(3)
        ]
        along = mpmath.fsum(n[i] * u[i] for i in range(3))
        across = [u[i] - along * n[i] for i in range(3)]
        total += coulomb(most[c], mpmath.sqrt(mpmath.fsum(a * a for a in across)))
    return total


@pytest.mark.parametrize("seed", range(3))
def test_friction_is_the_derivative_of_its_potential_and_its_paraboloid_lies_above(seed):
    rng = np.random.default_rng(seed)
    touching, _, v = rubbing(rng)
    most = rng.random(6)
    speeds = touching.slides(v.ravel())
    touching.grip = most * steepness(speeds)
    gradient, matrix = touching.gradient(v.ravel()), touching.matrix(np.zeros(6, bool), len(v))
    with mpmath.workdps(40):
        exact = [[mpmath.mpf(float(a)) for a in row] for row in v]
        here = friction(touching, most, exact)
        for direction in rng.standard_normal((4, *v.shape)):

            def along(t, d=direction):
                moved = [
                    [a + t * mpmath.mpf(float(b)) for a, b in zip(*rows, strict=True)]
                    for rows in zip(exact, d, strict=True)
                ]
                return friction(touching, most, moved)

            slope = float(mpmath.diff(along, 0, h=mpmath.mpf(10) ** -15))
            assert slope == pytest.approx(float(gradient @ direction.ravel()), rel=1e-12)
            for far in (1e-4, 1e-2, -3e-3):
                more = touching.value(v.ravel() + far * direction.ravel()) - touching.value(v.ravel())
                assert more >= float(along(far) - here) - 1e-15
                change = touching.gradient(v.ravel() + far * direction.ravel()) - gradient
                np.testing.assert_allclose(far * (matrix @ direction.ravel()), change, rtol=0, atol=1e-12)


def test_friction_neither_pushes_nor_turns_the_whole():
    rng = np.random.default_rng(7)
    touching, x, v = rubbing(rng)
    touching.grip = rng.random(6) * steepness(touching.slides(v.ravel()))
    force = touching.gradient(v.ravel()).reshape(-1, 3)
    assert np.abs(force).max() > 0.1
    assert np.abs(force.sum(axis=0)).max() < 1e-10
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-10
    assert np.sum(force * v) > 0  # it takes energy
    as_one = np.array([0.3, -0.2, 0.1]) + np.cross([1.0, 2.0, -0.5], x)
    assert touching.slides(as_one.ravel()).max() < 1e-12


def test_what_friction_slows_down_ends_where_its_force_is_in_balance():
    speed, most = np.meshgrid(
        HOLDS * np.array([0.0, 0.3, 1.0, 5.0, 300.0]), HOLDS * np.array([0.01, 1.0, 40.0])
    )
    y = slowed(speed, most)
    np.testing.assert_allclose(y + most * y * steepness(y), speed, rtol=1e-9, atol=1e-12)


def layers(friction, n=5, **more):
    """A model of a small sheet on one twice as large, their state, and which vertices are the small one's."""
    sheet = mesh.grid(n, n)
    flat = 0.2 * sheet.vertices
    X = np.concatenate([2 * flat, flat + np.array([0.013, 0.017, 5e-4])])
    both = mesh.Mesh.from_arrays(X, np.concatenate([sheet.triangles, sheet.triangles + n * n]), name="layers")
    settings = {"self_collision": "fast", "sphere": "off", "floor": False, "friction": friction, **more}
    model, _ = build(scenes.get("drape", **settings), mesh=both, x=X)
    return model, State(X, np.zeros_like(X)), slice(n * n, None)


@pytest.mark.parametrize("dt", [1 / 60, 1 / 240])
@pytest.mark.parametrize(
    ("slope", "friction"), [(0.2, 0.3), (0.28, 0.3), (0.32, 0.3), (0.6, 0.3), (0.6, 0.0)]
)
def test_a_sheet_on_a_sheet_slides_down_a_slope_only_where_friction_does_not_hold_it(slope, friction, dt):
    along, across = 9.81 * np.array([slope, 1.0]) / np.hypot(1.0, slope)
    held = ",".join(map(str, range(25)))
    model, state, upper = layers(friction, gravity=(along, 0.0, -across), pinned=held, dt=dt)
    count = round(0.2 / dt)
    speeds = [s.v[upper, 0].mean() for s in steps(model, state, dt, "linearly-implicit", count)]
    expected = max(along - friction * across, 0.0)
    measured = (speeds[-1] - speeds[count // 4]) / (dt * (count - count // 4))
    assert measured == pytest.approx(expected, rel=0.02, abs=2e-3)
    if not expected:
        assert max(map(abs, speeds[count // 4 :])) < HOLDS


def test_sheets_that_slide_on_each_other_keep_their_momentum_and_come_to_go_together():
    ends = {}
    for friction in (0.0, 0.5):
        model, state, upper = layers(friction, gravity=(0.0, 0.0, 0.0))
        state.v[upper] = [0.1, 0.0, -0.2]
        start, energies = model.body.momenta(state.x, state.v)[0], []
        for after in steps(model, state, 1 / 240, "linearly-implicit", 12):
            energies.append(model.energy(after))
            assert np.abs(model.body.momenta(after.x, after.v)[0] - start).max() < 1e-10
        assert max(energies) <= energies[0] * (1 + 1e-12)
        ends[friction] = after.v[upper, 0].mean() - after.v[:25, 0].mean()
    assert ends[0.0] > 0.04
    assert abs(ends[0.5]) < 0.25 * ends[0.0]


def test_what_is_beside_what_in_a_surface():
    beside = Beside(np.array([[0, 1, 2], [2, 1, 3]]), 5)
    assert beside.across.tolist() == [[3, -1, -1], [-1, -1, 0]]
    assert [sorted(row[row >= 0].tolist()) for row in beside.around] == [
        [1, 2],
        [0, 2, 3],
        [0, 1, 3],
        [1, 2],
        [],
    ]
