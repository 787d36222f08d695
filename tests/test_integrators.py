"""What integrators keep, and how fast they converge."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import muslin
from muslin.base.errors import MuslinError
from muslin.mesh import grid
from muslin.physics.colliders import Plane
from muslin.simulation.integrators import INTEGRATORS, steps
from muslin.simulation.model import Model, Spring, State

#: Integrators, and the order of their errors.
ORDERS = {"linearly-implicit": 1, "backward-euler": 1, "symplectic-euler": 1, "midpoint": 2, "bdf2": 2}


def last(model, state, dt, name, count):
    *_, after = steps(model, state, dt, name, count)
    return after


def sheet(n=5, mu=20.0, **how):
    """A soft sheet and its undeformed positions."""
    cloth = grid(n, n, diagonals="zigzag")
    return muslin.Cloth(cloth, mu=mu, lam=mu, rho=0.2, **how), cloth.vertices


def swinging():
    """A sheet pinned at one corner, pulled at another, stretched and bent: smooth motion, no contact."""
    body, X = sheet(4, bending="quadratic", bending_stiffness=1e-2)
    model = Model(
        body,
        gravity=np.array([0, -9.81, 0]),
        pinned=np.array([12]),
        spring=Spring(3, (1.0, -0.5, 0.5), 2.0),
        tolerance=1e-10,
    )
    x = 1.05 * X + 0.05 * np.sin(2 * X[:, [1, 2, 0]])
    v = np.cross([0.5, 0.3, 1.0], X - X[12])
    v[12] = 0
    x[12] = X[12]
    return model, State(x, v)


def truth(model, state, time):
    """By a Runge-Kutta method of order eight, from the same forces."""
    M, n = model.body.mass.toarray(), len(state.x)
    free = np.repeat(~model.system.pinned, 3)
    inverse = np.linalg.inv(M[np.ix_(free, free)])

    def rate(t, y):
        x, v = y[: 3 * n].reshape(-1, 3), y[3 * n :]
        force = (model.conservative_force(x) - model.body.gradient(x)).ravel()
        a = np.zeros(3 * n)
        a[free] = inverse @ force[free]
        return np.concatenate([v, a])

    start = np.concatenate([state.x.ravel(), state.v.ravel()])
    return solve_ivp(rate, (0, time), start, "DOP853", rtol=1e-11, atol=1e-12).y[: 3 * n, -1].reshape(-1, 3)


def test_errors_shrink_as_the_order_says():
    assert set(ORDERS) == set(INTEGRATORS)
    model, start = swinging()
    time = 0.04
    there = truth(model, start, time)
    for name, order in ORDERS.items():
        off = [np.abs(last(model, start, time / n, name, n).x - there).max() for n in (160, 320, 640)]
        measured = np.log2(np.array(off[:-1]) / off[1:])
        np.testing.assert_allclose(measured, order, atol=0.12, err_msg=name)


def spinning(name, dt, time=1.0):
    """What is left of the angular momentum of a free sheet that spins, and of its energy, at most and at the end."""
    body, X = sheet(9, mu=2e3)
    model = Model(body, gravity=np.zeros(3))
    state = State(X.copy(), np.cross([0.0, 0.0, 5.0], X))
    body.update(X)

    def kept(s):
        p = (body.mass @ s.v.ravel()).reshape(-1, 3)
        return np.append(np.cross(s.x, p).sum(axis=0), body.kinetic_energy(s.v) + body.energy_here())

    return np.array([kept(s) for s in steps(model, state, dt, name, round(time / dt))])


def test_midpoint_keeps_a_spinning_sheet_s_angular_momentum_and_its_energy():
    for dt in (1 / 60, 1 / 240):
        kept = spinning("midpoint", dt)
        size = np.linalg.norm(kept[0, :3])
        assert np.abs(kept[:, :3] - kept[0, :3]).max() < 1e-10 * size
    assert np.abs(kept[:, 3] / kept[0, 3] - 1).max() < 0.01  # at 1/240 s


def test_euler_and_bdf2_lose_spin_the_longer_their_steps_the_more():
    left = {}
    for name in ("linearly-implicit", "backward-euler", "bdf2"):
        for dt in (1 / 60, 1 / 240):
            kept = spinning(name, dt)
            left[name, dt] = np.linalg.norm(kept[-1, :3]) / np.linalg.norm(kept[0, :3])
    assert left["linearly-implicit", 1 / 60] < 0.2 < 0.6 < left["linearly-implicit", 1 / 240] < 0.8
    assert left["backward-euler", 1 / 60] < 0.8 < 0.88 < left["backward-euler", 1 / 240] < 0.95
    assert 0.99 < left["bdf2", 1 / 60] < 0.999 < left["bdf2", 1 / 240] < 1


def test_pinned_vertices_end_each_step_where_they_are_carried():
    for name in INTEGRATORS:
        body, X = sheet(4)

        def carried(time, dt):
            return np.array([[np.sin(9 * (time + dt)) - np.sin(9 * time), 0.1 * dt, 0.0]]) / dt

        model = Model(body, gravity=np.array([0, -9.81, 0]), pinned=np.array([0]), pinned_velocity=carried)
        after = last(model, State(X.copy(), np.zeros_like(X)), 1e-3, name, 20)
        np.testing.assert_allclose(after.x[0] - X[0], [np.sin(9 * 0.02), 0.002, 0], atol=1e-12, err_msg=name)


def test_the_integrators_of_second_order_fall_onto_a_sphere_and_stay_outside():
    for name in ("midpoint", "bdf2"):
        run = muslin.simulate(
            "drape", resolution=12, steps=60, integrator=name, contact="filter", floor=False
        )
        assert run.energies.contacts.max() > 4
        assert np.linalg.norm(run.x, axis=1).min() > 0.29
        assert np.abs(run.v).max() < 10


def test_a_run_by_bdf2_goes_on_as_if_it_had_never_stopped(tmp_path):
    how = {"resolution": 6, "integrator": "bdf2", "frame_every": 5}
    whole = muslin.simulate("hang", steps=20, **how)
    muslin.simulate("hang", steps=10, out=tmp_path / "run", **how)
    resumed = muslin.simulate("hang", steps=20, out=tmp_path / "run", resume=True)
    np.testing.assert_array_equal(resumed.x, whole.x)


@pytest.mark.parametrize("name", ["midpoint", "bdf2"])
@pytest.mark.parametrize(
    "case", [{}, {"dt": 1 / 240}, {"start_velocity": (0, -20, 0)}, {"start_at": (0, 1.3, 0)}]
)
def test_contacts_that_are_solved_for_add_no_energy_in_steps_of_second_order(name, case):
    run = muslin.simulate(
        "drape", **{"resolution": 12, "steps": 60, "dt": 1 / 60, "integrator": name, **case}
    )
    energy = run.energies.total - run.energies.work
    assert run.energies.contacts.max() > 2
    assert run.energies.penetration.max() < 1e-6
    assert energy.max() <= energy[0] + 1e-9


def on_a_slope(name, friction, dt=1 / 240, tangent=0.5):
    """A patch that lies on a slope, and how fast it goes down, after each step for 0.2 s."""
    body, X = sheet(5, mu=2e3)
    across = np.array([tangent, 1.0, 0.0]) / np.hypot(1.0, tangent)
    floor = Plane(point=(0.0, 0.0, 0.0), normal=tuple(across))
    down = np.array([1.0, -tangent, 0.0]) / np.hypot(1.0, tangent)
    x = X[:, [0]] * down + X[:, [1]] * np.array([0.0, 0.0, 1.0])
    model = Model(
        body,
        gravity=np.array([0, -9.81, 0]),
        colliders=lambda time: (floor,),
        contact="solve",
        friction=friction,
    )
    states = list(steps(model, State(x, np.zeros_like(x)), dt, name, round(0.2 / dt)))
    return np.array([s.v.mean(axis=0) @ down for s in states]), np.array([s.x @ across for s in states])


@pytest.mark.parametrize("name", ["midpoint", "bdf2"])
@pytest.mark.parametrize("friction", [0.0, 0.4, 0.55])
def test_a_patch_slides_down_a_slope_as_coulomb_says_in_steps_of_second_order(name, friction):
    speeds, heights = on_a_slope(name, friction)
    expected = max(9.81 * (0.5 - friction) / np.hypot(1.0, 0.5), 0.0)
    assert (speeds[-1] - speeds[24]) / 0.1 == pytest.approx(expected, rel=0.02, abs=1e-3)
    assert np.abs(heights).max() < 1e-6


@pytest.mark.parametrize("name", ["midpoint", "bdf2"])
def test_what_falls_on_the_floor_stays_there(name):
    body, X = sheet(5, mu=2e3)
    floor = Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
    x = X[:, [0, 2, 1]] + np.array([0.0, 0.1, 0.0])
    model = Model(body, gravity=np.array([0, -9.81, 0]), colliders=lambda time: (floor,), contact="solve")
    states = list(steps(model, State(x, np.zeros_like(x)), 1 / 240, name, 60))
    height, speed = (np.array([getattr(s, what)[:, 1].mean() for s in states]) for what in "xv")
    time = np.arange(61) / 240
    falls = time < np.sqrt(0.2 / 9.81) - 1 / 240
    np.testing.assert_allclose(
        height[falls], 0.1 - 9.81 / 2 * time[falls] ** 2, atol=1e-9
    )  # a parabola, exactly
    assert np.abs(height[~falls][3:]).max() < 1e-9
    assert np.abs(speed[-1]) < 1e-9


def test_what_an_integrator_cannot_do_is_said():
    with pytest.raises(MuslinError, match=r"contact = 'solve' goes with implicit integrators only"):
        muslin.simulate("drape", resolution=6, steps=1, integrator="symplectic-euler", contact="solve")
