"""Scenes: each shows what it promises, and every parameter can be given."""

import json
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import mesh
from muslin.base.errors import MuslinError
from muslin.physics.colliders import Capsule
from muslin.present import demo_cape
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def solution():
    return muslin.load(ROOT / "solutions" / "cloth")


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


def test_the_hanging_cloth_keeps_its_corners(solution):
    run = muslin.simulate("hang", functions=solution, steps=30)
    held = np.flatnonzero((run.v == 0).all(axis=1))
    assert len(held) == 2
    np.testing.assert_array_equal(run.x[held], run.x0[held])
    assert run.x[:, 1].min() < -0.6


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


def test_a_display_mesh_is_carried_exactly_by_an_affine_motion(solution):
    from muslin.physics.skinning import bind

    coarse, fine = mesh.grid(5, 5), mesh.unstructured(0.99, 0.99, 0.07)
    A, b = np.array([[1.1, 0.2, 0.0], [-0.3, 0.8, 0.1], [0.2, 0.0, 1.0]]), np.array([0.3, -1.0, 2.0])
    for functions in (solution, None):
        skin = bind(fine, coarse, functions)
        np.testing.assert_allclose(skin.phi.sum(axis=1), 1.0, atol=1e-12)
        assert (skin.phi > -1e-9).all(), "every display vertex lies in its triangle"
        np.testing.assert_allclose(skin.carry(coarse.vertices @ A.T + b), fine.vertices @ A.T + b, atol=1e-12)


def test_every_parameter_can_be_overridden_and_nonsense_is_refused():
    scene = scenes.get(
        "drape", gravity="0,-1,0", dt="1/100", sphere="off", resolution="8", sphere_radius=".2"
    )
    assert scene.gravity == (0, -1, 0)
    assert scene.dt == 0.01
    assert scene.sphere is False
    assert scenes.get("drape", E=1e3, nu=0.3).lame == pytest.approx((1e3 / 2.6, 300 / 0.91))  # plane stress
    assert scenes.get("course").lame == pytest.approx((1e5 / 2.8, 4e4 / (1.4 * 0.2)))
    assert scenes.get("course", swap_lame=True).lame == scenes.get("course").lame[::-1]
    nonsense = [
        {"gravity": "1,2"}, {"dt": "0"}, {"dt": "nan"}, {"sphere": "perhaps"}, {"colour": "red"}, {"steps": -5},
        {"resolution": "1.5"}, {"E": -1.0, "nu": 0.3}, {"pinned": "99999"}, {"solver": "magic"}, {"rho": 0},
        {"integrator": "guess"}, {"mesh": "nowhere.obj"}, {"drag_vertex": 10**6},
        {"contact": "guess"},
    ]  # fmt: skip
    assert scenes.get("cape", walk_speed="2", **{"turn_period": 4}).walk_speed == 2.0
    for name in scenes.SCENES:  # what a run records can be read back
        scene = scenes.get(name)
        assert scenes.get(name, **json.loads(json.dumps(scene.parameters()))) == scene
    for wrong in nonsense:
        with pytest.raises(MuslinError):
            muslin.simulate("drape", steps=wrong.pop("steps", 1), **wrong)


def test_what_is_for_cloth_is_refused_for_a_solid_and_what_is_meant_is_found_by_its_meaning():
    for name, value in (("bending", "quadratic"), ("swap_lame", "true"), ("h", "7"), ("adaptive", "on")):
        with pytest.raises(MuslinError, match=f"{name} is for cloth; the scene 'beam' is of a solid"):
            scenes.get("beam", **{name: value})
    solid = scenes.get("beam")
    assert scenes.get("beam", **solid.parameters()) == solid  # what it has anyway, as runs record it
    assert set(solid.parameters()) >= solid.FOREIGN
    for name, meant in (("Young", "E"), ("poisson", "nu"), ("density", "rho"), ("gravty", "gravity")):
        with pytest.raises(MuslinError, match=rf"Did you mean {meant}\?"):
            scenes.get("beam", **{name: "3"})


def test_wind_pushes_a_sheet_with_the_drag_of_its_area():
    """A unit square across a wind of speed u feels drag/2 u^2 along its normal; along the wind it feels nothing."""
    model, state = simulation.build(scenes.get("hang", resolution=5, tilt=90, wind=(0, 0, 3), drag=2.0))
    force = model.wind_force(state.x, state.v)
    np.testing.assert_allclose(np.abs(force.sum(axis=0)), [0, 0, 2.0 / 2 * 9 * 1.0], atol=1e-12)
    assert force.sum(axis=0)[2] > 0
    model.wind = (4.0, 1.0, 0.0)
    np.testing.assert_allclose(model.wind_force(state.x, state.v), 0, atol=1e-12)


def test_the_figure_under_a_cape_carries_what_touches_it_to_where_it_will_be():
    """The tangent of a way that turns would leave it inside."""
    scene = scenes.get("cape")
    dt, ends = scene.dt, 0
    for now, before in zip(scene.colliders(scene, 1.0), scene.colliders(scene, 1.0 - dt), strict=True):
        if isinstance(now, Capsule):
            ends += 1
            for end, velocity in (("a", now.velocity_a), ("b", now.velocity_b)):
                there = np.asarray(getattr(before, end)) + dt * np.asarray(velocity)
                np.testing.assert_allclose(there, getattr(now, end), atol=1e-12)
    assert ends > 6


def test_the_demo_of_a_cape_films_it_and_tells_its_energies(tmp_path):
    said = []
    demo_cape.run(tmp_path, "draft", lambda title: nullcontext(lambda done, total: None), said.append, 4, 0.1)
    for file in ("cape.mp4", "cape.png", "cape-energies.png", "run/energies.csv"):
        assert (tmp_path / file).is_file()
    assert "0.0333 s" in said[0]
    assert said[1].strip() == "Energies [J]"
    assert "kinetic" in said[2]
    assert demo_cape.SHOWN["steps"] * demo_cape.SHOWN["dt"] >= 8
