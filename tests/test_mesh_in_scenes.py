"""A mesh of one's own in a scene: its size, its pins, the numbers of its vertices, and what is said of them."""

import re
import sys

import numpy as np
import pytest

import muslin
from muslin import cli
from muslin.base.errors import MuslinError
from muslin.mesh import Mesh, grid, load, save
from muslin.simulation import scenes
from muslin.simulation.runs import RunFolder

#: A flag in millimetres; a cloth that lies on the ground; a kite with one highest corner.
FLAG = "v 0 0 0\nv 400 0 0\nv 400 300 0\nv 0 300 0\nf 1 2 3\nf 1 3 4\n"
CARPET = "v 0 2 0\nv 1 2 0\nv 1 2 1\nv 0 2 1\nf 1 3 2\nf 1 4 3\n"
KITE = "v 0 1 0\nv 1 0 0\nv 0 -1 0\nv -1 0 0\nf 1 4 2\nf 4 3 2\n"
#: A square whose file has a loose vertex before, among and after those of its triangles: 1, 2, 4 and 5 are used.
LOOSE = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 8 8 8\nv 1 1 0\nv 0 1 0\nv 7 7 7\nf 2 3 5\nf 2 5 6\n"


@pytest.fixture
def written(tmp_path):
    def write(name: str, text: str):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def remarks(scene: scenes.Scene) -> tuple[str, ...]:
    mesh = scene.load_mesh()
    return scene.remarks(mesh, scene.pinned_vertices(mesh))


@pytest.mark.parametrize("name", scenes.SCENES)
def test_a_scene_is_made_for_the_size_of_its_own_cloth_and_has_nothing_to_remark_on_it(name):
    scene = scenes.get(name, **({"cloths": "rest"} if name == "freefall" else {}))
    assert scene.load_mesh().extent == pytest.approx(scene.size, rel=0.01)
    assert remarks(scene) == ()


def test_a_mesh_in_other_units_is_remarked_upon_and_scaled_away(written):
    flag = str(written("flag.obj", FLAG))
    (remark,) = remarks(scenes.get("drape", mesh=flag))
    for word in ("'flag' is 400 m across", "one of 1 m", "radius is 0.3 m", "--scale 0.001", "--scale fit"):
        assert word in remark
    for scale, extent in (("0.001", 0.4), (1 / 400, 1.0), ("1/200", 2.0), ("fit", 1.0)):
        scene = scenes.get("drape", mesh=flag, scale=scale)
        assert scene.load_mesh().extent == pytest.approx(extent)
        assert remarks(scene) == ()
    assert "0.004 m across" in remarks(scenes.get("drape", mesh=flag, scale=1e-5))[0]


def test_a_budget_that_leaves_no_vertex_to_add_is_remarked_upon():
    few = {"adaptive": True, "resolution": 8}
    (remark,) = remarks(scenes.get("drape", budget=64, **few))
    assert "64 vertices to begin with, and budget = 64" in remark
    assert remarks(scenes.get("drape", budget=65, **few)) == ()
    assert remarks(scenes.get("drape", budget=64, resolution=8)) == ()


def test_both_cloths_fall_of_a_mesh_that_is_handed_over_as_of_one_that_is_read(written):
    flag = load(written("flag.obj", FLAG))
    runs = [
        muslin.simulate("freefall", mesh=each, scale="fit", steps=2)
        for each in (flag, str(written("flag.obj", FLAG)))
    ]
    assert len(runs[0].x) == 2 * len(flag.vertices)
    assert np.array_equal(runs[0].x, runs[1].x)


@pytest.mark.parametrize("scale", ["0", "-1", "big", "nan", "", "1e400"])
def test_a_scale_that_makes_no_sense_is_refused(scale):
    with pytest.raises(MuslinError, match="scale ="):
        scenes.get("drape", scale=scale)


def test_a_mesh_given_as_arrays_is_scaled_too():
    flag = Mesh.from_arrays(np.array([[0, 0, 0], [400, 0, 0], [400, 300, 0.0]]), [[0, 1, 2]])
    run = muslin.simulate("drape", mesh=flag, scale="fit", steps=0)
    assert run.mesh.extent == pytest.approx(1.0)
    np.testing.assert_allclose(np.ptp(run.x0, axis=0).max(), 1.0)


def test_a_display_mesh_is_scaled_with_the_cloth_it_lies_on(tmp_path):
    for name, n in (("coarse", 5), ("fine", 9)):
        cloth = grid(n, n)
        save(Mesh.from_arrays(1000 * cloth.vertices, cloth.triangles), tmp_path / f"{name}.obj")
    run = tmp_path / "run"
    muslin.simulate(
        "course", mesh=tmp_path / "coarse.obj", display=tmp_path / "fine.obj", scale="fit", steps=1, out=run
    )
    frame = RunFolder(run).frames[0]
    np.testing.assert_allclose(frame, grid(9, 9).vertices, atol=1e-12)


def test_pinning_every_vertex_is_refused_with_pins_that_work(written):
    carpet = str(written("carpet.obj", CARPET))
    with pytest.raises(MuslinError, match="holds all 4 vertices of 'carpet'") as caught:
        muslin.simulate("course", mesh=carpet, steps=1)
    assert "y is the same everywhere" in str(caught.value)
    suggested = re.findall(r"--set pinned=(corners|[\d,]*\d)", caught.value.hint)
    assert len(suggested) == 2
    for pinned in suggested:
        assert len(muslin.simulate("course", mesh=carpet, pinned=pinned, steps=1).x) == 4
    with pytest.raises(MuslinError, match="holds all 4 vertices"):
        muslin.simulate("course", mesh=carpet, pinned="0,1,2,3", steps=1)


def test_fewer_corners_than_a_scene_says_are_remarked_upon_with_pins_that_work(written):
    kite = str(written("kite.obj", KITE))
    scene = scenes.get("hang", mesh=kite)
    np.testing.assert_array_equal(scene.pinned_vertices(scene.load_mesh()), [0])
    (remark,) = remarks(scene)
    assert "holds 1 vertex of 'kite' (number 0), not two" in remark
    (pinned,) = re.findall(r"--set pinned=([\d,]*\d)", remark)
    better = scenes.get("hang", mesh=kite, pinned=pinned)
    assert len(better.pinned_vertices(better.load_mesh())) == 2
    assert remarks(better) == ()


def test_pins_and_the_mouse_take_the_numbers_of_the_file(written, tmp_path):
    loose = str(written("loose.obj", LOOSE))
    run = muslin.simulate(
        "hang", mesh=loose, pinned="1,5", drag_vertex=4, drag_to=(0, 3, 0), steps=8, frame_every=4,
        out=tmp_path / "run",
    )  # fmt: skip
    np.testing.assert_array_equal(run.mesh.vertices[[0, 3]], [[0, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(np.flatnonzero((run.v == 0).all(axis=1)), [0, 3])
    pulled = load(loose).find(4)[0]
    assert np.argmax(run.x[:, 1]) == pulled == 2
    again = muslin.simulate("hang", steps=12, out=tmp_path / "run", resume=True)
    np.testing.assert_array_equal(again.x[[0, 3]], run.x[[0, 3]])
    whole = muslin.simulate("hang", mesh=loose, pinned="1,5", drag_vertex=4, drag_to=(0, 3, 0), steps=12)
    np.testing.assert_allclose(again.x, whole.x, atol=1e-12)
    for parameters in ({"pinned": "1,3"}, {"drag_vertex": 3}):
        with pytest.raises(MuslinError, match="no vertex 3: it is in no triangle"):
            muslin.simulate("hang", mesh=loose, steps=1, **parameters)


def test_both_cloths_of_a_free_fall_keep_their_numbers(written):
    scene = scenes.get("freefall", mesh=str(written("loose.obj", LOOSE)))
    both = scene.load_mesh()
    assert both.called(np.arange(8)) == [1, 2, 4, 5, 7, 8, 10, 11]
    assert any("3 vertices in no triangle" in notice for notice in both.notices)


def test_what_there_is_to_say_of_a_mesh_is_said_once_on_the_error_stream(
    written, tmp_path, monkeypatch, capsys
):
    loose = written("loose.obj", LOOSE)
    monkeypatch.setattr(
        sys, "argv",
        ["muslin", "simulate", "drape", "--mesh", str(loose), "--scale", "100", "--steps", "1",
         "--out", str(tmp_path / "run")],
    )  # fmt: skip
    cli.main()
    out, err = capsys.readouterr()
    assert "note" not in out
    said = " ".join(err.split())
    assert said.count("note:") == 2
    assert "3 vertices in no triangle left out; the first is vertex 1 (line 1)" in said
    assert "100 m across" in said


@pytest.mark.parametrize(
    ("scene", "name", "is_", "needs", "formats"),
    [
        (
            "jelly",
            "cape.obj",
            "is a surface (OBJ)",
            "a solid needs tetrahedra",
            (".mesh", ".ele", "Gmsh", "run drape"),
        ),
        ("beam", "cape.stl", "is a surface (STL)", "a solid needs tetrahedra", (".mesh", ".vtu", "TetGen")),
        (
            "drape",
            "bear.mesh",
            "is a solid (a Medit mesh",
            "cloth is a surface",
            (".obj", ".ply", "run jelly"),
        ),
        (
            "course",
            "bear.ele",
            "is a solid (TetGen's tetrahedra)",
            "cloth is a surface",
            (".obj", "run jelly"),
        ),
    ],
)
def test_a_mesh_of_the_other_kind_is_told_from_an_unknown_format(written, scene, name, is_, needs, formats):
    mesh = written(name, FLAG)
    with pytest.raises(MuslinError) as caught:
        muslin.simulate(scene, steps=1, mesh=mesh)
    for word in (name, is_, needs, *formats):
        assert word in str(caught.value)
    assert "unknown" not in str(caught.value)


def test_a_list_of_other_files_is_no_mesh_of_the_other_kind(written):
    with pytest.raises(MuslinError, match="a list of other files"):
        muslin.simulate("jelly", steps=1, mesh=written("run.pvd", "<VTKFile/>"))
