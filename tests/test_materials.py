"""What E, nu, thickness and damping mean."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
from scipy.optimize import minimize_scalar

import muslin
from muslin.base.errors import MuslinError
from muslin.mesh import grid
from muslin.physics.material import PLANES, lame
from muslin.simulation import scenes
from muslin.simulation.incremental import IncrementalPotential
from muslin.simulation.integrators import steps
from muslin.simulation.model import Model, State
from muslin.simulation.simulating import build

E, NU, H = 2e6, 0.3, 5e-4


def pulled(plane):
    """Stress per strain of a strip pulled along, free to become narrower, and how much narrower it becomes."""
    mu, lam = lame(E, NU, plane=plane)
    cloth = grid(3, 5, 0.2, 0.4)
    body, X, strain = muslin.Cloth(cloth, mu=mu, lam=lam, h=H), cloth.vertices, 1e-4

    def energy(narrower, longer=strain):
        return body.energy(X * [1 - narrower, 1 + longer, 1])

    found = minimize_scalar(energy, bounds=(0, strain), method="bounded", options={"xatol": 1e-12}).x
    return 2 * energy(found) / (strain**2 * 0.2 * 0.4 * H), found / strain


def test_a_strip_in_plane_stress_has_the_modulus_and_the_contraction_it_was_given():
    assert pulled("stress") == pytest.approx((E, NU), rel=1e-3)
    # whose thickness is held: stiffer, and narrower
    assert pulled("strain") == pytest.approx((E / (1 - NU**2), NU / (1 - NU)), rel=1e-3)


def test_the_course_s_formula_has_mu_and_lambda_exchanged():
    assert lame(E, NU, plane="course") == lame(E, NU, swap=True) == lame(E, NU, plane="strain")[::-1]
    assert set(PLANES) == {"stress", "strain", "course"}
    with pytest.raises(MuslinError, match="plane = 'both' is not understood"):
        scenes.get("drape", plane="both")
    with pytest.raises(MuslinError, match="plane is for cloth"):
        muslin.simulate("beam", steps=0, plane="stress")


def test_sheets_are_in_plane_stress_but_where_something_was_published():
    for name in scenes.CLOTHS:
        published = name in ("course", "throw", "freefall")
        assert scenes.get(name).plane == ("strain" if published else "stress")
    assert scenes.get("drape", E=E, nu=NU).lame == lame(E, NU, plane="stress")


def test_the_scenes_of_a_real_fabric_have_a_real_thickness():
    for name in ("drape", "hang", "cape"):
        scene = scenes.get(name)
        assert scene.h * scene.rho == pytest.approx(0.2)
        assert 1e-4 < scene.h < 2e-3
        small = {} if name == "cape" else {"resolution": 5}
        body = muslin.simulate(scene, steps=0, **small).body
        assert body.mass.sum() / 3 == pytest.approx(0.2 * body.area.sum())


def swinging(damping, mode=-1):
    """A free sheet in one of its own oscillations, a little: what moves it, its start and its frequency."""
    cloth = grid(4, 4, diagonals="zigzag")
    body = muslin.Cloth(cloth, mu=100.0, lam=50.0, rho=0.2, bending="quadratic", bending_stiffness=1e-2)
    squares, modes = la.eigh(body.hessian(cloth.vertices).toarray(), body.mass.toarray())
    x = cloth.vertices + 1e-6 * modes[:, mode].reshape(-1, 3)
    model = Model(body, gravity=np.zeros(3), damping=damping, tolerance=1e-12)
    return model, State(x, np.zeros_like(x)), np.sqrt(squares[mode])


@pytest.mark.parametrize("mode", [-1, -12, 8])
def test_an_oscillation_dies_away_as_damping_says(mode):
    _, _, omega = swinging(0.0, mode)
    damping, dt = 0.02 / omega, 0.02 / omega
    model, state, _ = swinging(damping, mode)
    energies = [
        model.body.kinetic_energy(s.v) + model.body.energy_here()
        for s in steps(model, state, dt, "midpoint", 1000)
    ]
    assert energies[-1] / energies[0] == pytest.approx(np.exp(-damping * omega**2 * 1000 * dt), rel=0.05)


def moving(model, state):
    """Velocity of the centre of mass."""
    M = model.body.mass
    return (M @ state.v.ravel()).reshape(-1, 3).sum(axis=0) / (M.sum() / 3)


@pytest.mark.parametrize("integrator", ["linearly-implicit", "backward-euler", "bdf2", "symplectic-euler"])
def test_every_integrator_damps_and_none_slows_what_falls(integrator):
    left = []
    for damping in (0.0, 5e-4):
        model, state, omega = swinging(damping)
        state.v[:] = [0.5, 0.0, 0.0]
        dt = 0.01 / omega
        kept = [
            (moving(model, s), model.body.energy_here() + model.body.kinetic_energy(s.v - [0.5, 0, 0]))
            for s in steps(model, state, dt, integrator, 400)
        ]
        np.testing.assert_allclose(kept[-1][0], [0.5, 0, 0], atol=1e-9)
        left.append(kept[-1][1] / kept[0][1])
    # x'' + damping omega^2 x' + omega^2 x = 0, let go at 1
    zeta, turn = 5e-4 * omega / 2, 400 * 0.01
    root = np.sqrt(1 - zeta**2)
    x, v = np.cos(root * turn) + zeta / root * np.sin(root * turn), np.sin(root * turn) / root
    expected = np.exp(-2 * zeta * turn) * (x**2 + v**2)
    assert expected < 0.5
    assert left[1] / left[0] == pytest.approx(expected, rel=0.05)


def test_newtons_matrix_of_a_damped_step_is_the_derivative_of_its_gradient():
    """Damping is by the stiffness before the step, elasticity by that of where the cloth is."""
    scene = scenes.get("drape", resolution=6, damping=0.05, bending="off", sphere=False, dt=1 / 60)
    model, state = build(scene)
    state.x[:] *= 1 + 0.1 * np.sin(5 * state.x)
    problem = IncrementalPotential(model, state, scene.dt, whole=True)
    v = 0.5 * np.cos(7 * state.x).ravel()
    problem.value(v)
    assert problem.assemble(True), "with the exact Hessian"
    direction, h = np.sin(np.arange(v.size)), 1e-6
    slopes = []
    for side in (h, -h):
        problem.value(v + side * direction)
        slopes.append(problem.gradient()[0])
    change = (slopes[0] - slopes[1]) / (2 * h)
    problem.value(v)
    problem.assemble(True)
    np.testing.assert_allclose(problem.solve(change), direction, atol=1e-5)
    np.testing.assert_allclose(problem.matrix() @ direction, change, atol=1e-6 * np.abs(change).max())


def test_damping_is_never_negative():
    with pytest.raises(MuslinError, match=r"damping = -1\.0 must not be negative"):
        scenes.get("drape", damping=-1)


@pytest.mark.parametrize("name", ["drag", "drag_stiffness", "friction"])
def test_what_would_push_cloth_on_for_ever_is_refused(name):
    with pytest.raises(MuslinError, match=f"{name} = -5.0 must not be negative"):
        scenes.get("hang", **{name: -5.0})
