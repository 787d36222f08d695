"""What is set and what comes of it: no parameter is ignored in silence, and a scene of one's own can be written."""

import dataclasses
import warnings

import numpy as np
import pytest

import muslin
from muslin import MuslinError
from muslin.mesh import grid
from muslin.present.demo import energy_lines
from muslin.present.exporting import export_run
from muslin.present.pictures import render_run
from muslin.simulation.runs import RunFolder
from muslin.simulation.scenes import SCENES, Scene, get, idle, override, rebuilt, recorded
from muslin.simulation.scenes.scene import lying
from muslin.simulation.simulating import build

IDLE = [
    ("course", {"friction": 0.5}, "friction has no effect in 'course': contact is filter"),
    ("drape", {"contact": "filter", "friction": 0.5}, "friction has no effect"),
    ("hang", {"sag": 0.3}, "sag has no effect in 'hang': it does not start so"),
    ("hang", {"wind": (5, 0, 0)}, "wind has no effect in 'hang': drag is 0"),
    ("hang", {"friction": 0.5}, "friction has no effect in 'hang': there is nothing to touch"),
    ("hang", {"sphere_radius": 0.5}, "sphere is off"),
    ("hang", {"budget": 100}, "adaptive is off"),
    ("hang", {"drag_to": (1, 0, 0)}, "nothing is pulled at"),
    ("hang", {"plane": "strain"}, "the scene has mu and lam"),
    ("cape", {"start_at": (1, 0, 0)}, "start_at has no effect in 'cape'"),
    ("cape", {"tilt": 20}, "tilt has no effect in 'cape'"),
    ("cape", {"resolution": 9}, "its mesh is no grid but cape"),
    ("cape", {"sphere": True}, "what it meets is its own"),
    ("jelly", {"resolution": 3}, "the creature has one mesh"),
    ("beam", {"start_at": (0, 1, 0)}, "start_at has no effect in 'beam'"),
]


@pytest.mark.parametrize(("name", "settings", "said"), IDLE)
def test_a_parameter_without_effect_is_said_and_really_has_none(name, settings, said):
    (remark,) = [text for text in idle.remarks(get(name, **settings), settings) if said in text]
    assert remark.endswith(".")
    if name in ("cape", "jelly", "drape"):
        return  # too large for a look at what comes of it, here
    small = {} if name == "course" else {"resolution": 4}
    left = {key: value for key, value in settings.items() if key == "contact"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one = muslin.simulate(name, steps=3, **small, **settings)
        two = muslin.simulate(name, steps=3, **small, **left)
    np.testing.assert_array_equal(one.x, two.x)


@pytest.mark.parametrize("name", SCENES)
def test_what_a_scene_has_set_itself_has_an_effect_in_it(name):
    scene = get(name)
    default = {f.name: f.default for f in dataclasses.fields(type(scene))}
    own = [key for key, value in scene.parameters().items() if value != default[key]]
    allowed = {"hang": {"friction"}, "course": set()}.get(name, set())  # of a sphere that may be switched on
    assert {remark.split()[0] for remark in idle.remarks(scene, own)} <= allowed


def test_parameters_with_an_effect_are_not_complained_of():
    there = {
        "friction": 0.2,
        "sag": 0.01,
        "start_at": (0, 1, 0),
        "tilt": 3,
        "sphere_radius": 0.2,
        "resolution": 9,
    }
    assert not idle.remarks(get("drape", **there), there)
    assert not idle.remarks(get("hang", wind=(0, 0, 3), drag=1.2), ("wind", "drag"))
    assert not idle.remarks(get("hang", self_collision="fast"), ("friction", "self_gap"))
    assert not idle.remarks(get("drape", contact="filter", friction=0.0), ("friction",))


def test_in_python_a_warning_says_so_and_whoever_asks_for_notices_gets_them_instead():
    with pytest.warns(UserWarning, match="wind has no effect"):
        muslin.simulate("hang", steps=0, resolution=3, wind=(5, 0, 0))
    heard = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        muslin.simulate("hang", steps=0, resolution=3, wind=(5, 0, 0), on_notice=heard.append)
    assert [text for text in heard if "wind has no effect" in text]


def test_two_materials_at_once_are_refused_unless_they_are_the_same():
    with pytest.raises(MuslinError, match="not the same material"):
        get("hang", E=1e5, nu=0.3, mu=1.0, lam=1.0)
    with pytest.raises(MuslinError, match="not the same material"):
        get("hang", E=1e5, mu=1.0)
    mu, lam = get("hang", E=1e5, nu=0.25).lame
    assert get("hang", E=1e5, nu=0.25, mu=mu, lam=lam).lame == pytest.approx((mu, lam))
    assert mu == pytest.approx(4e4)  # E / (2 (1 + nu))
    assert get("course", mu=1.0, lam=2.0).lame == (1.0, 2.0)
    assert get("drape", E=1e5, nu=0.25).lame == pytest.approx((mu, lam))


def test_a_run_with_another_pair_than_the_scene_s_is_read_back(tmp_path):
    muslin.simulate("course", steps=1, mu=100.0, lam=200.0, out=tmp_path / "run")
    assert RunFolder(tmp_path / "run").scene.lame == (100.0, 200.0)
    older = {"scene": "course", "parameters": get("course").parameters() | {"mu": 1.0, "lam": 2.0}}
    assert rebuilt(older).lame == (1.0, 2.0)


MINE = Scene(
    "mine", "A flag of mine", resolution=4, mu=1e3, lam=1e3, rho=100.0, h=1e-3, pinned="corners", start=lying,
    size=2.0, steps=4, frame_every=2,
)  # fmt: skip


def test_a_run_of_a_scene_of_one_s_own_is_written_read_back_and_resumed(tmp_path):
    whole = muslin.simulate(MINE, out=tmp_path / "whole")
    assert RunFolder(tmp_path / "whole").scene == MINE
    muslin.simulate(MINE, steps=2, out=tmp_path / "run")
    resumed = muslin.simulate("mine", steps=4, out=tmp_path / "run", resume=True)
    np.testing.assert_array_equal(resumed.x, whole.x)
    np.testing.assert_array_equal(RunFolder(tmp_path / "run").frames[-1], whole.x)


def test_a_run_of_a_scene_of_one_s_own_is_filmed_and_exported(tmp_path):
    muslin.simulate(MINE, out=tmp_path / "run")
    written = render_run(tmp_path / "run", film="none", size=(64, 48), quality="draft")
    written += export_run(tmp_path / "run", "obj", None)
    assert written
    assert all(path.is_file() for path in written)


@pytest.mark.parametrize("name", ["../mine", "a/b", "", "a.b"])
def test_a_scene_whose_name_is_no_file_s_is_not_written(name, tmp_path):
    with pytest.raises(MuslinError, match="cannot be named"):
        muslin.simulate(dataclasses.replace(MINE, name=name), out=tmp_path / "run")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_under_another_name_can_be_rebuilt(name):
    scene = dataclasses.replace(get(name), name="mine", title="Mine", gravity=(0.0, -1.0, 0.0))
    assert rebuilt(recorded(scene)) == scene


def test_a_scene_with_code_of_its_own_is_refused_before_it_is_simulated(tmp_path):
    scene = dataclasses.replace(MINE, start=lambda scene, mesh: mesh.vertices + 1.0)
    with pytest.raises(MuslinError, match=r"functions or parameters of its own.*muslin/simulation/scenes"):
        muslin.simulate(scene, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()
    assert len(muslin.simulate(scene, steps=1).x) == len(grid(4, 4).vertices)


def test_exact_self_collision_of_a_scene_object_says_what_to_set():
    scene = dataclasses.replace(get("drape"), self_collision="exact")
    with pytest.raises(MuslinError, match="Set integrator=backward-euler"):
        override(scene)
    assert build(override(get("drape", resolution=4), self_collision="exact"))[0].barrier is not None


def test_a_table_of_energies_says_what_pulls_and_its_columns_hold():
    run = muslin.simulate("hang", resolution=4, steps=3, drag_vertex=0, drag_to=(1, 1, 1))
    _, head, *rows = energy_lines(run)
    assert head.split() == ["time", "[s]", "kinetic", "elastic", "gravity", "and", "pull", "total"]
    assert {len(row) for row in rows} == {len(head)}
    np.testing.assert_allclose(float(rows[-1].split()[3]), run.energies[-1]["gravity"], atol=1e-4)
