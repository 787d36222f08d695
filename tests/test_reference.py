"""Reference data: made again they are the same; right answers pass, wrong ones fail with a sentence."""

import builtins
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.authoring import reference_data
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import checking, exact, judge, reference

SOLUTION = Path(__file__).parents[1] / "solutions" / "cloth"
TASKS = tasks.assignment("cloth").tasks


@pytest.fixture(scope="module")
def functions():
    return muslin.load(SOLUTION)


@pytest.fixture
def copy(tmp_path):
    """A copy of the public data to spoil."""
    return Path(shutil.copytree(paths.reference("cloth"), tmp_path / "cloth"))


# --- the data ----------------------------------------------------------------------------------------------


def test_public_data_are_what_their_seed_gives():
    report = reference_data.verify("cloth")
    assert report.ok, report.problems
    assert set(report.errors) == set(TASKS)


def test_building_twice_gives_the_same_bytes(tmp_path):
    first, second = (reference_data.build("cloth", tmp_path / name, seed=5, cases=4) for name in "ab")
    for path in sorted(path for path in first.rglob("*") if path.is_file()):
        assert path.read_bytes() == (second / path.relative_to(first)).read_bytes(), path.name


def test_another_seed_gives_other_cases_that_a_right_solution_passes(functions):
    for name, task in TASKS.items():
        inputs = reference_data.draw_inputs("cloth", name, "a secret", 36)
        public, _ = reference.cases("cloth", name)
        assert any((inputs[key][:24] != public[key][:24]).any() for key in inputs)
        verdict = reference.compare(
            task,
            muslin.evaluate(functions[name], **inputs),
            reference_data.truth("cloth", name, inputs),
            inputs,
            terms=judge("cloth", name).terms,
        )
        assert verdict.ok, verdict
        assert verdict.error < 1e-11


def test_public_cases_cover_both_signs_of_every_input_and_all_vertices():
    positive = {"area", "rho", "h", "r", "mu", "lam", "s"}
    for name in TASKS:
        inputs, _ = reference.cases("cloth", name)
        for key, array in inputs.items():
            assert np.isfinite(array).all()
            assert 24 <= len(array) <= 32
            if array.dtype.kind == "i":
                assert set(array) == {0, 1, 2}
            elif key in positive:
                assert (array > 0).all()
            else:
                entries = array.reshape(len(array), -1)
                used = (entries != 0).any(axis=0)  # a third stress, say, is always 0
                assert (entries > 0).any(axis=0)[used].all(), (name, key)
                if key != "d2psi_ds2":
                    assert (entries < 0).any(axis=0)[used].all(), (name, key)


def test_public_cases_include_the_difficult_ones():
    s = reference.cases("cloth", "eigensystem")[0]["s"]
    gap = s[:, 0] - s[:, 1]
    assert (gap == 0).any()
    assert (gap[gap > 0] > 1e-2).all()  # between, the limit is only approximate: nobody is graded there
    assert (s[:, :2] == 1).all(axis=1).any()
    assert ((s[:, :2] == 1).sum(axis=1) == 1).any()
    assert s.min() < 0.3
    assert s.max() > 2
    contact, (hit, _) = reference.cases("cloth", "sphere_contact")
    distance = np.linalg.norm(contact["x"] - contact["c"], axis=1)
    assert (distance == 0).any()
    assert set(hit) == {0, 1}
    exact = distance == contact["r"]  # on the surface is no hit; only where every number is exact
    assert exact.any()
    assert not hit[exact].any()
    assert (contact["x"][exact] * 64 == np.rint(contact["x"][exact] * 64)).all()
    assert (np.abs(distance / contact["r"] - 1) > 0.04)[~exact].all()
    assert (reference.cases("cloth", "psi")[0]["s"][:, 2] != 1).any()
    velocity = reference.cases("cloth", "filter_velocity")[0]
    d = (velocity["v"] * velocity["n"]).sum(axis=1)
    assert (d < 0).any()
    assert (d > 0).any()
    assert (d == 0).any()
    blocks = reference.cases("cloth", "mass_block")[0]
    assert len(set(zip(blocks["i"], blocks["j"], strict=True))) == 9


def test_a_changed_number_a_missing_file_and_a_stranger_are_noticed(copy):
    with np.load(copy / "psi.npz") as data:
        arrays = dict(data)
    arrays["expected_psi"][3] *= 1 + 1e-14
    np.savez(copy / "psi.npz", **arrays)
    with np.load(copy / "phi.npz") as data:
        arrays = dict(data)
    arrays["X"][0, 0] += 1e-12
    np.savez(copy / "phi.npz", **arrays)
    (copy / "dn_dx.npz").unlink()
    (copy / "stress.npz").write_bytes(b"")
    (copy / "mass_block.npz").write_bytes(b"not a zip")
    record = json.loads((copy / reference_data.PROVENANCE).read_text())
    del record["files"]["eigensystem.npz"]
    (copy / reference_data.PROVENANCE).write_text(json.dumps(record))
    problems = "\n".join(reference_data.verify("cloth", copy).problems)
    for part in (
        "psi.npz: its content is not what the provenance says",
        "psi.npz: expected_psi differs from the truth",
        "phi.npz: X is not what the seed gives",
        "dn_dx.npz: cannot be read",
        "mass_block.npz: cannot be read",
        "eigensystem.npz: not on record",
    ):
        assert part in problems


def test_data_without_provenance_say_what_to_do(tmp_path):
    with pytest.raises(MuslinError, match="Build the reference data first"):
        reference_data.verify("cloth", tmp_path)


def test_without_mpmath_the_message_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def no_mpmath(name, *args, **kwargs):
        if name == "mpmath":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    exact.precise.cache_clear()
    monkeypatch.setattr(builtins, "__import__", no_mpmath)
    with pytest.raises(MuslinError, match="pip install mpmath"):
        reference_data.build("cloth", "nowhere")
    assert not Path("nowhere").exists()


# --- the check ---------------------------------------------------------------------------------------------


def test_the_solution_passes_every_task(functions):
    verdicts = checking.check(functions)
    assert [verdict.task for verdict in verdicts] == list(TASKS)
    for verdict in verdicts:
        assert verdict.ok, verdict
        assert verdict.error < 1e-11


def test_only_the_named_tasks_are_checked(functions):
    assert [verdict.task for verdict in checking.check(functions, ["psi", "phi"])] == ["psi", "phi"]


@pytest.mark.parametrize("name", TASKS)
def test_zeros_negatives_and_slightly_wrong_answers_fail(name):
    inputs, expected = reference.cases("cloth", name)
    task = TASKS[name]
    assert reference.compare(task, expected, expected, inputs, None).ok
    for wrong in (
        [np.zeros_like(array) for array in expected],
        [-array for array in expected],
        [array + 1e-6 * np.abs(array).max() if array.dtype.kind == "f" else array for array in expected],
        [array.astype(np.float32).astype(array.dtype) for array in expected],
    ):
        if all((a == b).all() for a, b in zip(wrong, expected, strict=True)):
            continue
        verdict = reference.compare(task, wrong, expected, inputs, None)
        assert not verdict.ok
        assert "yours" in verdict.message
        assert "expected" in verdict.message


def test_not_a_number_a_wrong_shape_and_a_wrong_type_are_named_before_any_error():
    inputs, (right,) = reference.cases("cloth", "dpsi_ds")
    task = TASKS["dpsi_ds"]
    for bad in (np.nan, np.inf):
        wrong = right.copy()
        wrong[7, 1] = bad
        verdict = reference.compare(task, wrong, (right,), inputs, None)
        assert not verdict.ok
        assert "case 7" in verdict.message
        assert "not finite" in verdict.message
    assert "shape" in reference.compare(task, right[:, :2], (right,), inputs, None).message
    assert "type" in reference.compare(task, right.astype(np.float32), (right,), inputs, None).message
    assert "returns 2 values" in reference.compare(task, (right, right), (right,), inputs, None).message
    assert reference.compare(task, right, (right,), inputs, None).ok


def test_an_exact_zero_must_stay_exactly_zero():
    inputs, (right,) = reference.cases("cloth", "kinetic_energy")
    still = int(np.flatnonzero(right == 0)[0])
    wrong = right.copy()
    wrong[still] = 1e-300
    verdict = reference.compare(TASKS["kinetic_energy"], wrong, (right,), inputs, None)
    assert not verdict.ok
    assert verdict.case == still


def test_swapped_lame_parameters_fail(functions):
    for name in ("psi", "dpsi_ds", "d2psi_ds2"):
        inputs, expected = reference.cases("cloth", name)
        swapped = {**inputs, "mu": inputs["lam"], "lam": inputs["mu"]}
        got = muslin.evaluate(functions[name], **swapped)
        assert not reference.compare(TASKS[name], got, expected, inputs, judge("cloth", name).terms).ok


def test_a_stub_a_missing_file_and_a_broken_function_get_a_verdict_each(tmp_path):
    folder = tmp_path / "mine"
    shutil.copytree(SOLUTION, folder)
    (folder / "collision.py").unlink()
    (folder / "stress.py").write_text(
        "import taichi as ti\n\n\n@ti.func\ndef dpsi_dF(U, dpsi_ds, V):\n    return U @ what\n"
    )
    text = (folder / "kinetic_energy.py").read_text(encoding="utf-8")
    body = text.index("    # begin solution"), text.index("    # end solution")
    (folder / "kinetic_energy.py").write_text(
        text[: body[0]] + "    raise NotImplementedError\n" + text[body[1] :], encoding="utf-8"
    )
    names = ["sphere_contact", "dpsi_dF", "nodal_force", "mass_block", "kinetic_energy", "psi"]
    verdicts = {verdict.task: verdict for verdict in checking.check(muslin.load(folder), names)}
    assert "missing" in verdicts["sphere_contact"].message
    assert "does not compile" in verdicts["dpsi_dF"].message
    assert "has no function nodal_force" in verdicts["nodal_force"].message
    assert "not implemented yet" in verdicts["mass_block"].message
    assert verdicts["kinetic_energy"].ok
    assert verdicts["psi"].ok
    assert not any(verdicts[name].ok for name in names[:4])


def test_an_unknown_task_and_damaged_data_are_refused(monkeypatch, tmp_path):
    with pytest.raises(MuslinError, match="no task 'love'"):
        reference.cases("cloth", "love")
    monkeypatch.setattr(paths, "reference", lambda name: tmp_path)
    with pytest.raises(MuslinError, match=r"psi\.npz is missing"):
        reference.cases("cloth", "psi")
    (tmp_path / "psi.npz").write_bytes(b"PK not a zip")
    with pytest.raises(MuslinError, match="damaged"):
        reference.cases("cloth", "psi")
