"""A run on disk: written whole, read back, resumed, repeated; what is damaged is refused."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import mesh
from muslin.base.errors import MuslinError
from muslin.present import pictures as show
from muslin.simulation.runs import RunFolder

ROOT = Path(__file__).resolve().parent.parent

SPHERE_BELOW = {"resolution": 24, "dt": 1 / 60, "steps": 60, "floor": False, "pinned": "corners"}


def test_a_run_with_contacts_in_the_system_resumes_to_the_same_end(tmp_path):
    scene = SPHERE_BELOW | {"contact": "solve", "frame_every": 5}
    muslin.simulate("drape", out=tmp_path / "run", **scene | {"steps": 30})
    longer = muslin.simulate("drape", steps=40, out=tmp_path / "run", resume=True)
    whole = muslin.simulate("drape", out=tmp_path / "whole", **scene | {"steps": 40})
    np.testing.assert_array_equal(longer.x, whole.x)


def test_a_run_whose_active_set_knew_no_colliders_resumes(tmp_path):
    """It is found again from where the vertices are and how they move."""
    scene = SPHERE_BELOW | {"contact": "solve", "frame_every": 5}
    muslin.simulate("drape", out=tmp_path / "run", **scene | {"steps": 30})
    with np.load(tmp_path / "run" / "checkpoint.npz") as saved:
        older = {name: saved[name] for name in saved if name != "work" and not name.startswith("pressed_")}
    older["active"] = np.arange(4)
    np.savez(tmp_path / "run" / "checkpoint.npz", **older)
    longer = muslin.simulate("drape", steps=40, out=tmp_path / "run", resume=True)
    assert longer.energies.penetration.max() < 1e-6
    assert (np.diff(longer.energies.total) <= 0).all()


def test_a_run_of_an_earlier_muslin_resumes(tmp_path):
    """Its checkpoint has no active set, its mesh other names, its description nothing of newer parameters."""
    scene = {"resolution": 6, "frame_every": 5}
    muslin.simulate("drape", steps=5, out=tmp_path / "run", **scene)
    with np.load(tmp_path / "run" / "checkpoint.npz") as saved:
        older = {name: saved[name] for name in ("x", "v", "time", "step")}
    np.savez(tmp_path / "run" / "checkpoint.npz", **older)
    with np.load(tmp_path / "run" / "mesh.npz") as saved:
        older = {"held" if name == "pinned" else name: saved[name] for name in saved}
    assert "held" in older
    np.savez(tmp_path / "run" / "mesh.npz", **older)
    described = json.loads((tmp_path / "run" / "run.json").read_text())
    for name in ("contact", "stretch_limit"):
        del described["parameters"][name]
    (tmp_path / "run" / "run.json").write_text(json.dumps(described))
    longer = muslin.simulate("drape", steps=10, out=tmp_path / "run", resume=True)
    whole = muslin.simulate("drape", steps=10, **scene)
    np.testing.assert_array_equal(longer.x, whole.x)


def test_a_display_mesh_is_what_a_run_shows(tmp_path):
    display = tmp_path / "fine.obj"
    mesh.save(mesh.unstructured(1.0, 1.0, 0.04), display)
    muslin.simulate("course", steps=10, display=display, out=tmp_path / "run")
    run = RunFolder(tmp_path / "run")
    assert len(run.frames) == 3
    assert len(run.frames[0]) == len(mesh.load(display).vertices) > len(run.simulated[0])
    np.testing.assert_allclose(run.frames[0], run.rest, atol=1e-9)


def test_an_interrupted_run_is_usable_and_resumes_to_the_same_end(tmp_path):
    def stop(step, steps):
        if step == 13:
            raise KeyboardInterrupt

    part = muslin.simulate("throw", steps=30, out=tmp_path / "run", on_step=stop)
    assert part.interrupted
    folder = RunFolder(tmp_path / "run")
    assert len(folder.frames) == 3
    assert folder.energies.step[-1] == 13
    resumed = muslin.simulate("throw", out=tmp_path / "run", resume=True)
    whole = muslin.simulate("throw", steps=30, out=tmp_path / "whole")
    np.testing.assert_array_equal(resumed.x, whole.x)
    np.testing.assert_array_equal(resumed.energies, whole.energies)
    for name in ("energies.csv", *(f"frames/{k:06d}.npy" for k in range(0, 31, 5))):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_run_can_be_repeated_from_its_own_record(tmp_path):
    first = muslin.simulate("throw", steps=5, E=2e4, sphere=False, out=tmp_path / "run")
    record = json.loads((tmp_path / "run" / "run.json").read_text())
    again = muslin.simulate(record["scene"], **record["parameters"])
    np.testing.assert_array_equal(first.x, again.x)


def test_a_run_never_overwrites_what_is_not_a_run(tmp_path):
    (tmp_path / "thesis.txt").write_text("precious")
    with pytest.raises(MuslinError, match="not a run"):
        muslin.simulate("course", steps=1, out=tmp_path)
    assert (tmp_path / "thesis.txt").read_text() == "precious"


def test_a_run_resumed_for_longer_is_the_run_made_in_one_go(tmp_path):
    muslin.simulate("throw", steps=12, out=tmp_path / "run")
    longer = muslin.simulate("throw", steps=20, out=tmp_path / "run", resume=True)
    whole = muslin.simulate("throw", steps=20, out=tmp_path / "whole")
    np.testing.assert_array_equal(longer.x, whole.x)
    np.testing.assert_array_equal(RunFolder(tmp_path / "run").times, RunFolder(tmp_path / "whole").times)
    assert RunFolder(tmp_path / "run").scene == RunFolder(tmp_path / "whole").scene
    for changed in ({"gravity": (0, 0, 0)}, {"hessian": "lecture"}, {"display": "fine.obj"}):
        with pytest.raises(MuslinError, match="cannot change"):
            muslin.simulate("throw", out=tmp_path / "run", resume=True, **changed)


def test_a_mistake_does_not_cost_the_last_run(tmp_path):
    muslin.simulate("throw", steps=10, out=tmp_path)
    for wrong in (
        {"integrator": "guess"},
        {"display": "nowhere.obj"},
        {"functions": ROOT / "assignments" / "cloth"},
    ):
        with pytest.raises(MuslinError):
            muslin.simulate("throw", steps=10, out=tmp_path, **wrong)
    assert len(RunFolder(tmp_path).frames) == 3


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    muslin.simulate("course", steps=12, out=folder)
    return folder


def read(folder):
    run = RunFolder(folder)
    return [*run.frames, *run.simulated], run.energies, run.checkpoint()


PIECES = ("run.json", "mesh.npz", "energies.csv", "frames/000005.npy", "frames/000012.npy", "checkpoint.npz")


def damaged(whole, folder, piece, content):
    shutil.copytree(whole, folder)
    (folder / piece).unlink()
    if content is not None:
        (folder / piece).write_bytes(content)
    return folder


def test_a_run_that_is_whole_is_read(whole):
    frames, energies, (_, step) = read(whole)
    assert [x.shape for x in frames] == 2 * 4 * [(400, 3)]  # steps 0, 5, 10, 12
    assert energies.step.tolist() == list(range(13))
    assert step == 12


@pytest.mark.parametrize("content", [None, b"", b"{}", b"\x93NUMPY junk", b"null", b"step,time\n0,0\n"])
@pytest.mark.parametrize("piece", PIECES)
def test_a_damaged_run_is_refused_in_one_sentence(piece, content, whole, tmp_path):
    with pytest.raises(MuslinError) as caught:
        read(damaged(whole, tmp_path / "run", piece, content))
    name = "run" if piece == "run.json" and content is None else Path(piece).name
    assert name in caught.value.message
    assert "\n" not in caught.value.message
    assert caught.value.hint


@pytest.mark.parametrize("lost", ["the first row", "a row", "the last row", "a number", "the names"])
def test_a_log_that_lacks_something_is_refused(lost, whole, tmp_path):
    head, *rows = (whole / "energies.csv").read_text().splitlines()
    if lost == "a number":
        rows[3] = rows[3].rpartition(",")[0]
    elif lost == "the names":
        head = rows.pop(0)
    else:
        del rows[{"the first row": 0, "a row": 4, "the last row": -1}[lost]]
    folder = damaged(whole, tmp_path / "run", "energies.csv", "\n".join([head, *rows, ""]).encode())
    with pytest.raises(MuslinError, match=r"energies\.csv is missing or damaged"):
        _ = RunFolder(folder).energies


def test_a_row_that_is_being_written_is_left_for_later(whole, tmp_path):
    log = (whole / "energies.csv").read_bytes()
    folder = damaged(whole, tmp_path / "run", "energies.csv", log + b"13,0.2166,1.0,0.0,0.0,0.0,0,0.0,0.0")
    assert RunFolder(folder).energies.step[-1] == 12


def test_positions_of_another_mesh_are_no_frame(whole, tmp_path):
    folder = damaged(whole, tmp_path / "run", "frames/000005.npy", None)
    np.save(folder / "frames/000005.npy", np.zeros((399, 3)))
    with pytest.raises(MuslinError, match=r"000005\.npy is missing or damaged"):
        _ = RunFolder(folder).frames[1]


@pytest.mark.parametrize("content", [None, b"", b"{}"])
@pytest.mark.parametrize("piece", PIECES[:-1])
def test_pictures_of_a_damaged_run_are_refused_alike(piece, content, whole, tmp_path):
    folder = damaged(whole, tmp_path / "run", piece, content)
    with pytest.raises(MuslinError, match=r"is missing|is not a run"):
        show.render_run(folder, tmp_path / "film.gif", size=(64, 48), quality="draft")
    assert not (tmp_path / "film.png").exists() or piece.startswith("frames")


def test_a_run_stopped_while_it_goes_on_past_its_end_is_whole(tmp_path):
    """Its last frame is no longer one, and the checkpoint still that of it."""

    def stop(step, steps):
        raise KeyboardInterrupt

    muslin.simulate("course", steps=12, out=tmp_path)
    assert muslin.simulate("course", steps=20, out=tmp_path, resume=True, on_step=stop).interrupted
    frames, energies, (_, step) = read(tmp_path)
    assert (len(frames), energies.step[-1], step) == (2 * 3, 13, 12)
    muslin.simulate("course", steps=20, out=tmp_path, resume=True)
    assert sorted(path.stem for path in (tmp_path / "frames").iterdir()) == [
        f"{k:06d}" for k in range(0, 21, 5)
    ]
