"""Colliders are drawn where they are: no cloth is under their surface, and no gap is left that anybody would see."""

import numpy as np
import pytest

import muslin
from muslin.physics.colliders import Sphere
from muslin.physics.meeting import nearest_weights
from muslin.present.exporting import animation
from muslin.present.pictures import Show
from muslin.render import stage
from muslin.simulation.runs import RunFolder


def nearest(x, triangles):
    """Distance of triangles from the origin."""
    corners = x[triangles]
    weights = nearest_weights(np.zeros((len(corners), 3)), corners)
    return np.linalg.norm(np.einsum("tk,tki->ti", weights, corners), axis=1).min()


@pytest.mark.parametrize("resolution", [24, 12])
def test_a_sphere_is_drawn_just_below_the_cloth_that_lies_on_it(tmp_path, resolution):
    run = muslin.simulate(
        "drape", resolution=resolution, start_at=(0.003, 0.31, 0.005), steps=60, out=tmp_path / "r"
    )
    show = Show(RunFolder(tmp_path / "r"), (96, 64), "draft")
    body = show.surfaces(len(show.times) - 1)[1]
    drawn = np.linalg.norm(np.asarray(body.vertices), axis=1).max()
    cloth = nearest(run.x, run.mesh.triangles)
    assert drawn < cloth
    assert cloth - drawn < 0.3 / resolution**2 * 12, "a share of what a triangle cuts off, no more"
    exported = np.linalg.norm(np.reshape(animation(tmp_path / "r").props[0].frames, (-1, 3)), axis=1).max()
    assert exported == pytest.approx(0.3)


def test_at_the_resolution_of_the_demo_what_is_missing_is_less_than_a_pixel():
    mesh = muslin.simulation.scenes.get("drape").load_mesh()
    longest = stage.longest_edge(mesh.vertices, mesh.triangles)
    ball = Sphere((0.0, 0.0, 0.0), 0.3)
    assert 0.3 - stage.drawn_radius(ball, "solve", longest) < 1e-3


def test_how_large_a_sphere_is_drawn_does_not_depend_on_how_deep_a_run_sank_into_it(tmp_path):
    radii = []
    for speed in (0.0, -20.0):
        muslin.simulate("drape", contact="filter", resolution=8, steps=12, start_velocity=(0, speed, 0),
                        start_at=(0, 0.4, 0), out=tmp_path / "r")  # fmt: skip
        run = RunFolder(tmp_path / "r")
        radii.append(np.linalg.norm(np.asarray(Show(run, (96, 64)).surfaces(0)[1].vertices), axis=1).max())
    assert run.energies.penetration.max() > 0.02
    assert radii[0] == radii[1] == pytest.approx(0.975 * 0.3)


def test_the_ground_that_is_drawn_is_exported_wide_around_all_that_moves(tmp_path):
    muslin.simulate("drape", resolution=8, steps=8, out=tmp_path / "r")
    given = animation(tmp_path / "r")
    *_, ground = given.props
    corners = ground.at(0)
    assert ground.name == "ground"
    assert set(corners[:, 1]) == {RunFolder(tmp_path / "r").scene.ground}
    a, b, c = corners[ground.triangles[0]]
    assert np.cross(b - a, c - a)[1] > 0, "it is seen from above"
    for k in range(len(given)):
        for x in (given.at(k), given.props[0].at(k)):
            room = np.stack([x.min(axis=0) - corners.min(axis=0), corners.max(axis=0) - x.max(axis=0)])
            assert (room[:, [0, 2]] > 0.5 * np.ptp(x[:, [0, 2]])).all()
    assert np.ptp(corners[:, 0]) < 10 * np.ptp(given.at(0)[:, 0])

    muslin.simulate("hang", resolution=4, steps=4, out=tmp_path / "h")
    assert animation(tmp_path / "h").props == ()


def test_the_wall_that_holds_a_bar_is_exported(tmp_path):
    muslin.simulate("twist", resolution=2, steps=4, out=tmp_path / "r")
    assert [prop.name for prop in animation(tmp_path / "r").props] == ["wall"]
