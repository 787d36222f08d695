"""A student's run: right functions alone, wrong ones as they are, and yours beside what it should be."""

import shutil
import sys

import numpy as np
import pytest
from PIL import Image

from muslin import cli
from muslin.base import paths
from muslin.base.errors import SimulationError
from muslin.simulation.runs import RunFolder

SMALL = ("--set", "resolution=8", "--size", "160x90", "--no-film")


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A workspace with everything right."""
    folder = tmp_path / "work"
    shutil.copytree(
        paths.solution("cloth"), folder, ignore=shutil.ignore_patterns("reference*", "__pycache__")
    )
    monkeypatch.chdir(folder)
    return folder


def change(folder, file, before, after):
    text = (folder / file).read_text()
    assert text.count(before) == 1
    (folder / file).write_text(text.replace(before, after))


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["muslin", "run", *words])
    try:
        cli.main()
        code = 0
    except SystemExit as ending:
        code = ending.code
    return code, *capsys.readouterr()


WEAK = ("stress.py", "return U @ diag(dpsi_ds)", "return 0.05 * U @ diag(dpsi_ds)")
REVERSED = ("stress.py", "return -h * area", "return h * area")


def test_a_wrong_function_is_replaced_unless_it_is_asked_for_as_it_is(work, monkeypatch, capsys):
    change(work, *WEAK)
    elastic = {}
    for words in ((), ("--as-is",)):
        code, out, err = run(monkeypatch, capsys, "hang", "--steps", "20", *SMALL, *words)
        assert code == 0, err
        assert ("Yours as it is, though wrong: dpsi_dF." in out) == bool(words)
        assert ("Muslin's own instead of yours: wrong: dpsi_dF." in out) != bool(words)
        elastic[words] = RunFolder("runs/hang").energies["elastic"][-1]
    assert elastic[("--as-is",)] > 3 * elastic[()]  # a twentieth of the force: it sags much further


def test_yours_stands_beside_what_it_should_be(work, monkeypatch, capsys):
    change(work, *WEAK)
    code, out, err = run(monkeypatch, capsys, "hang", "--steps", "20", *SMALL, "--compare")
    assert code == 0, err
    assert "runs/hang/compared.png" in out
    picture = np.array(Image.open("runs/hang/compared.png"))
    assert picture.shape == (90, 160, 3)
    yours, reference = picture[16:, :80].astype(int), picture[16:, 80:].astype(int)
    assert np.abs(yours - reference).max() > 50
    mine, theirs = RunFolder("runs/hang"), RunFolder("runs/hang-reference")
    assert np.abs(mine.frames[-1] - theirs.frames[-1]).max() > 0.01


def test_right_functions_look_like_the_reference(work, monkeypatch, capsys):
    code, _, err = run(monkeypatch, capsys, "hang", "--steps", "10", *SMALL, "--compare")
    assert code == 0, err
    picture = np.array(Image.open("runs/hang/compared.png")).astype(int)
    assert np.abs(picture[16:, :80] - picture[16:, 80:]).max() <= 8


def test_of_an_explosion_the_start_is_shown(work, monkeypatch, capsys):
    change(work, *REVERSED)
    code, out, err = run(monkeypatch, capsys, "drape", "--steps", "150", *SMALL, "--set", "sag=0", "--as-is")
    assert code == 0, err
    assert "It came apart: The cloth of 'drape' exploded at step" in out
    picture = np.array(Image.open("runs/drape/drape.png")).astype(int)
    red = (picture[..., 0] > picture[..., 1] + 60).mean()  # the cloth's colour
    assert red > 0.05


def test_of_a_solid_that_comes_apart_at_once_the_start_is_shown_and_the_wrong_function_named(
    tmp_path, monkeypatch, capsys
):
    """The solids handout's own example, with the sign of the force turned round, in backward Euler and without."""
    folder = tmp_path / "solid"
    shutil.copytree(
        paths.solution("solids"), folder, ignore=shutil.ignore_patterns("reference*", "__pycache__")
    )
    monkeypatch.chdir(folder)
    change(folder, "forces.py", "return -volume * P @ grad_phi", "return volume * P @ grad_phi")
    small = ("--set", "resolution=3", "--size", "160x90", "--no-film", "--steps", "20", "--as-is")
    code, out, err = run(monkeypatch, capsys, "beam", *small, "--compare")
    assert code == 0, err
    assert "Yours as it is, though wrong: nodal_force." in out
    assert "Right, but not called here: phi, interpolate, spring_force." in out
    assert "inverted" in out
    assert "It was simulated with your wrong nodal_force: muslin check nodal_force" in out
    assert "integrator=backward-euler" not in out  # it is
    assert len(RunFolder("runs/beam").frames) == 1
    for picture in ("beam.png", "compared.png"):
        assert (folder / "runs" / "beam" / picture).is_file()


def test_an_explosion_at_once_is_not_told_with_the_pictures_of_an_earlier_run(work, monkeypatch, capsys):
    code, _, err = run(monkeypatch, capsys, "hang", "--steps", "2", *SMALL)
    assert code == 0, err
    before = {path.name: path.stat().st_mtime_ns for path in (work / "runs" / "hang").iterdir()}
    change(work, *WEAK)

    def fails(*_, **__):
        raise SimulationError("The matrix is singular.")

    monkeypatch.setattr("muslin.simulation.simulating.simulate", fails)
    code, out, err = run(monkeypatch, capsys, "hang", "--steps", "2", *SMALL, "--as-is")
    assert code == 1, err
    assert "It came apart: The matrix is singular." in out
    assert "Wrote" not in out
    assert before == {path.name: path.stat().st_mtime_ns for path in (work / "runs" / "hang").iterdir()}


@pytest.mark.parametrize(
    ("words", "contact"), [((), "filter"), (("--set", "contact=solve"), "solve")], ids=["run", "asked"]
)
def test_a_students_own_filter_is_what_stops_the_cloth(work, monkeypatch, capsys, words, contact):
    """Here it leaves the cloth where it goes: through the sphere, which contacts in the system would not let it."""
    change(
        work, "collision.py", "    if d < 0:\n        v_new = v - d * n", "    if d < 0:\n        v_new = v"
    )
    from muslin.simulation import scenes

    assert scenes.get("drape").contact == "solve"
    near = ("--set", "start_at=0,0.3,0")
    code, _out, err = run(monkeypatch, capsys, "drape", "--steps", "30", *SMALL, *near, *words, "--as-is")
    assert code == 0, err
    assert RunFolder("runs/drape").scene.contact == contact
    assert (RunFolder("runs/drape").energies.penetration.max() > 0.03) == (contact == "filter")
