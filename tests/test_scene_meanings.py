"""What scenes' parameters mean: a table that is complete, and a page that says the same."""

from pathlib import Path

import numpy as np
import pytest

from muslin.simulation.scenes import SCENES, get, meanings
from muslin.simulation.simulating import build

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scenes.md"
KNOWN = [name for rows in meanings.MEANINGS.values() for name in rows]


def test_every_parameter_of_every_scene_has_one_meaning_and_nothing_else_has():
    assert len(KNOWN) == len(set(KNOWN))
    assert {name for scene in SCENES for name in get(scene).parameters()} == set(KNOWN)
    assert all(meaning.text for rows in meanings.MEANINGS.values() for meaning in rows.values())


def test_the_page_shows_the_table():
    assert PAGE.read_text(encoding="utf-8").endswith("\n\n" + meanings.tables()), (
        "Run: muslin scenes --markdown, and put it at the end of docs/scenes.md"
    )


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_says_all_its_parameters_with_values_that_can_be_set(name):
    scene = get(name)
    said = meanings.lines(scene)
    settings = dict(line.split()[0].split("=", 1) for line in said if line.startswith("  "))
    assert set(settings) == set(scene.parameters()) - scene.FOREIGN
    again = get(name, **settings)
    for parameter, value in scene.parameters().items():
        there = getattr(again, parameter)
        if isinstance(value, (float, tuple)):
            assert there == pytest.approx(value, rel=1e-5), parameter
        else:
            assert there == value, parameter


def test_the_page_s_formula_is_the_wind_s_force():
    drag, wind, v = 1.3, np.array([0.5, -2.0, 4.0]), np.array([0.1, 0.2, -0.3])
    scene = get("hang", resolution=4, drag=drag, wind=wind, tilt=25.0, bending="off")
    model, state = build(scene)
    force = model.wind_force(state.x, np.tile(v, (len(state.x), 1))).sum(axis=0)
    n = np.array([0.0, np.cos(np.radians(25)), np.sin(np.radians(25))])
    u = n @ (wind - v)  # of the whole sheet: it is flat, and a metre square
    np.testing.assert_allclose(force, 0.5 * drag * 1.0 * abs(u) * u * n, rtol=1e-12)


def test_a_mesh_is_laid_flat_with_its_middle_where_the_scene_says_wherever_its_file_had_it():
    scene = get("hang", resolution=5, tilt=0.0, start_at=(1.0, 2.0, 3.0))
    moved = scene.load_mesh()
    there = moved.vertices + np.array([7.0, 8.0, 9.0])
    _, state = build(scene, mesh=type(moved).from_arrays(there, moved.triangles))
    np.testing.assert_allclose((state.x.min(axis=0) + state.x.max(axis=0)) / 2, [1, 2, 3])
    assert np.ptp(state.x[:, 1]) < 1e-12


def test_pins_within_a_distance_of_a_side_are_chosen_by_scaled_coordinates():
    scene = get("hang", resolution=11, scale=2, pinned="left:0.2")
    mesh = scene.load_mesh()
    x = mesh.vertices[:, 0]
    assert scene.pinned_vertices(mesh).tolist() == np.flatnonzero(x < x.min() + 0.2 + 1e-6).tolist()
