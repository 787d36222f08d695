"""Grading end to end: right work gets full marks, unfinished work none, and one mistake costs one task."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tarfile
import time
import zipfile
from pathlib import Path

import pytest

import muslin
from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading.kernels import Store
from muslin.grading.record import from_json

TABLE = tasks.assignment("cloth")
SOLUTION = paths.solution("cloth")


def submission(folder: Path, **changes: str) -> Path:
    """The reference solution with the bodies of some tasks replaced."""
    folder.mkdir(parents=True)
    for file in TABLE.files:
        shutil.copy(SOLUTION / file, folder / file)
    for name, body in changes.items():
        path = folder / TABLE.tasks[name].file
        text = path.read_text(encoding="utf-8")
        pattern = rf"(def {name}\(.*?\n    \"\"\".*?\"\"\"\n).*?(?=\n\n\n@ti\.func|\Z)"
        replaced, count = re.subn(pattern, lambda m: m[1] + body, text, flags=re.S)  # noqa: B023
        assert count == 1
        path.write_text(replaced, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def perfect():
    return muslin.grade(SOLUTION)


@pytest.fixture(scope="module")
def stubs():
    return muslin.grade(paths.assignment("cloth"))


def test_the_reference_solution_gets_every_point(perfect):
    assert (perfect.score, perfect.max_score) == (100, 100)
    assert {task.status for task in perfect} == {"passed"}
    assert [task.name for task in perfect] == list(TABLE.tasks)
    layers = {check.layer for task in perfect for check in task.checks}
    assert layers == {"form", "public", "hidden", "properties"}
    assert all(check.status == "passed" for task in perfect for check in task.checks)


def test_the_solution_functions_work_together(perfect):
    simulation = perfect.simulation
    assert simulation.status == "passed"
    assert simulation.stand_ins == ()
    assert {check.status for check in simulation.checks} == {"passed"}
    assert len(simulation.energies) == len(simulation.reference_energies) > 30
    assert len(simulation.positions) == len(simulation.reference_positions) > 0


def test_the_untouched_stubs_get_nothing_and_say_so(stubs):
    assert stubs.score == 0
    for task in stubs:
        assert task.status == "not implemented"
        assert task.message == "not implemented yet"
    assert stubs.simulation.status == "skipped"


@pytest.mark.parametrize("fresh", [False, True])
def test_a_second_grading_says_the_same_to_the_last_byte(perfect, fresh):
    again = muslin.grade(SOLUTION, fresh=fresh)
    assert json.dumps(again.as_json(timing=False)) == json.dumps(perfect.as_json(timing=False))


def test_what_a_submission_compiles_is_kept_for_its_next_grading(perfect):
    kept = Store(perfect.submission.sha256)
    for part in (*TABLE.files, "simulation"):
        assert kept.load(part), f"nothing is kept of {part}"


def test_a_record_survives_json(perfect):
    assert from_json(json.loads(json.dumps(perfect.as_json()))) == perfect


def test_one_mistake_is_charged_once(tmp_path):
    wrong = submission(tmp_path / "s", psi="    return mu * s.norm_sqr() + lam\n")
    record = muslin.grade(wrong)
    assert record["psi"].status == "failed"
    assert record.score == 100 - TABLE.tasks["psi"].points
    assert {task.status for task in record if task.name != "psi"} == {"passed"}
    simulation = record.simulation
    assert simulation.status == "passed"
    assert simulation.stand_ins == ("psi",)
    by_name = {check.name: check.status for check in simulation.checks}
    assert by_name["force is minus the slope of the energy"] == "skipped"
    assert by_name["energies follow the reference"] == "passed"


def test_hang_crash_and_exit_cost_their_own_task_only(tmp_path):
    """An endless kernel, a segmentation fault and os._exit(0), each in another file."""
    deadline = 4.0
    hostile = submission(
        tmp_path / "s",
        right_cauchy_green="    k = 0\n    while F[0, 0] < 1e300:\n        k += 1\n    return F * k\n",
        nodal_force="    ti.static(fall())\n    return P @ grad_phi\n",
        sphere_contact="    ti.static(leave())\n    return 1, x\n",
    )
    with open(hostile / "stress.py", "a", encoding="utf-8") as file:
        file.write("\n\ndef fall():\n    import ctypes\n\n    ctypes.string_at(0)\n    return True\n")
    with open(hostile / "collision.py", "a", encoding="utf-8") as file:
        file.write("\n\ndef leave():\n    import os\n\n    os._exit(0)\n")
    began = time.monotonic()
    record = muslin.grade(hostile, deadline=deadline)
    assert time.monotonic() - began < deadline * len(TABLE.tasks) + 10
    broken = {"right_cauchy_green", "nodal_force", "sphere_contact"}
    assert {task.name for task in record if task.status == "error"} == broken
    assert {task.status for task in record if task.name not in broken} == {"passed"}
    assert record.score == 100 - sum(TABLE.tasks[name].points for name in broken)
    assert "took longer than 4 s" in record["right_cauchy_green"].message
    assert "segmentation fault" in record["nodal_force"].message
    assert "exit code 0" in record["sphere_contact"].message
    assert record.simulation.status == "passed"
    assert set(record.simulation.stand_ins) == broken


def test_an_index_out_of_range_is_named_by_a_second_look(tmp_path):
    body = "    k = int(h * 0) + 40_000_000\n    big[k] = 1.0\n    return P @ grad_phi\n"
    wrong = submission(tmp_path / "s", nodal_force=body)
    path = wrong / "stress.py"
    path.write_text(path.read_text().replace("import diag\n", "import diag\n\nbig = ti.field(float, 10)\n"))
    only = tmp_path / "only"
    only.mkdir()
    shutil.copy(path, only)
    record = muslin.grade(only)
    assert record["nodal_force"].status == "error"
    assert "segmentation fault" in record["nodal_force"].message
    assert "40000000 is not an index of a field of 10" in record["nodal_force"].message
    assert record["dpsi_dF"].status == "passed"


@pytest.fixture
def small(tmp_path):
    folder = tmp_path / "small"
    folder.mkdir()
    shutil.copy(SOLUTION / "collision.py", folder)
    return folder


def test_folder_zip_and_tar_are_the_same_submission(small, tmp_path):
    with zipfile.ZipFile(tmp_path / "s.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(small / "collision.py", "my cloth/collision.py")
        archive.writestr("__MACOSX/my cloth/._collision.py", b"\0\1")
    with tarfile.open(tmp_path / "s.tar.gz", "w:gz") as archive:
        archive.add(small, "s")
    records = [muslin.grade(path) for path in (small, tmp_path / "s.zip", tmp_path / "s.tar.gz")]
    assert len({record.submission.sha256 for record in records}) == 1
    assert len({json.dumps([t.checks[0].message for t in record]) for record in records}) == 1
    assert {record.score for record in records} == {10}
    assert "missing" in records[0]["phi"].message


def test_the_words_of_a_seed_are_in_no_view_and_the_same_words_give_the_same_record(small):
    from muslin.grading import views

    words = "six words that nobody would guess"
    record = muslin.grade(small, seed=words)
    again, other = muslin.grade(small, seed=words), muslin.grade(small, seed=f"{words}!")
    assert record.as_json(timing=False) == again.as_json(timing=False)
    assert record.seed.startswith("digest:")
    assert record.seed != other.seed
    for format in views.FORMATS:
        assert words not in views.render(record, format, **({"quality": "none"} if format == "html" else {}))


def test_the_instructors_hidden_cases_are_used_besides(small, tmp_path):
    from muslin.authoring import reference_data

    folder = reference_data.build("cloth", tmp_path / "hidden", "a secret", 4, hidden=True)
    record = muslin.grade(small, hidden=folder)
    assert record.score == 10
    assert record.hidden == {"cases": 20, "instructor": 4}
    assert "24 hidden cases agree" in str(record["filter_velocity"].checks)
    assert record.seed != muslin.grade(small).seed
    assert folder.stat().st_mode & 0o077 == 0
    assert "a secret" not in json.dumps(record.as_json())
    with pytest.raises(MuslinError, match="holds no hidden reference data"):
        muslin.grade(small, hidden=tmp_path)


def test_a_function_that_knows_only_the_public_cases_gets_nothing(tmp_path):
    """Outside the public cases it answers with something near."""
    body = "    d = n.dot(v)\n    w = v\n    if d < 0:\n        w = v - d * n\n"
    body += "    if abs(v[0] - ti.round(v[0] * 1e3) / 1e3) > 1e-12:\n        w *= keep(v)\n    return w\n"
    from muslin.judging import reference

    inputs, _ = reference.cases("cloth", "filter_velocity")
    known = [float(v[0]) for v in inputs["v"]]
    listed = "\n".join(f"    if v[0] == {value!r}:\n        factor = 1.0" for value in known)
    wrong = submission(tmp_path / "s", filter_velocity=body)
    with open(wrong / "collision.py", "a") as file:
        file.write(f"\n\n@ti.func\ndef keep(v):\n    factor = 1.1\n{listed}\n    return factor\n")
    only = tmp_path / "only"
    only.mkdir()
    shutil.copy(wrong / "collision.py", only)
    result = muslin.grade(only)["filter_velocity"]
    by_layer = {check.layer: check for check in result.checks}
    assert by_layer["public"].status == "passed"
    assert by_layer["hidden"].status == "failed"
    assert not re.search(r"\d", by_layer["hidden"].message)  # a category, no numbers
    assert result.score == 0


def test_printing_is_shown_for_public_cases_only(tmp_path):
    folder = tmp_path / "s"
    folder.mkdir()
    text = (SOLUTION / "collision.py").read_text()
    text = text.replace("    d = n.dot(v)\n", "    d = n.dot(v)\n    print('speed', v[0])\n")
    (folder / "collision.py").write_text(text)
    record = muslin.grade(folder)
    shown = record["filter_velocity"].output
    assert shown.count("speed") == 30
    assert record.score == 10


def test_empty_lines_that_the_engine_prints_are_not_the_students(small):
    path = small / "collision.py"
    text = path.read_text()
    assert "    d = n.dot(v)\n" in text
    path.write_text(text.replace("    d = n.dot(v)\n", "    d = ti.Matrix([v, v, v])\n"))
    result = muslin.grade(small)["filter_velocity"]
    assert (result.status, result.output) == ("error", "")


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "muslin.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_the_command_writes_the_reports_asked_for(small, tmp_path):
    out = tmp_path / "out"
    done = run("grade", small, "--format", "json", "--format", "gradescope", "--out", out)
    assert done.returncode == 0, done.stderr
    assert "10 of 100 points" in done.stdout
    assert sorted(path.name for path in out.iterdir()) == ["record.json", "results.json"]
    assert json.loads((out / "record.json").read_text())["score"] == 10
    printed = run("grade", small, "--format", "csv")
    assert printed.returncode == 0
    assert len(printed.stdout.splitlines()) == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "There is no submission nowhere"),
        ([__file__], "cannot be graded"),
        ([SOLUTION, "--assignment", "hair"], "There is no assignment 'hair'"),
        ([SOLUTION, "--hidden", "nowhere"], "holds no hidden reference data"),
        ([SOLUTION, "--format", "csv", "--format", "json"], "Add --out DIR"),
    ],
)
def test_what_cannot_be_graded_is_said_in_one_line(arguments, said):
    done = run("grade", *arguments)
    assert done.returncode == 1
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
