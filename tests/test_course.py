"""An assignment is a folder: one the framework has never heard of, elsewhere, through every command.

Its tasks have names that cloth has, too, and other arguments; triangles and tetrahedra, a 9x9 and a 12-vector, a task
in plain Python with a function for an argument; terms, a property, mistakes, steps, a derivative and a law of its own.
"""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.authoring import mistakes, reference_data, release
from muslin.base import paths
from muslin.grading import diagnosis
from muslin.grading.submission import collect
from muslin.judging import checking, reference

TOY = Path(__file__).parent / "toy"


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A folder of one's own, with the toy released and its data made."""
    folder = tmp_path_factory.mktemp("course")
    shutil.copytree(TOY, folder / "solutions" / "toy", ignore=shutil.ignore_patterns("__pycache__"))
    before = os.environ.get(paths.COURSE)
    os.environ[paths.COURSE] = str(folder)
    release.release("toy")
    reference_data.build("toy", cases=10)
    list(mistakes.build("toy"))
    yield folder
    if before is None:
        del os.environ[paths.COURSE]


def told(*words: str, folder: Path, code: int = 0) -> str:
    """What a command says; it must end as expected, without a traceback."""
    done = subprocess.run(
        [sys.executable, "-c", "from muslin.cli import main; main()", *words],
        cwd=folder, capture_output=True, text=True, timeout=300,
        env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200"},
    )  # fmt: skip
    said = done.stdout + done.stderr
    assert "Traceback" not in said, said
    assert done.returncode == code, said
    return said


@pytest.fixture
def work(course, tmp_path):
    """A student's folder, with all answers."""
    folder = tmp_path / "work"
    told("start", "toy", str(folder), folder=tmp_path)
    for file in tasks.assignment("toy").files:
        shutil.copy(TOY / file, folder / file)
    return folder


def wrong(folder: Path, file: str, old: str, new: str) -> None:
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))


def test_the_data_are_what_the_seed_says_and_the_solution_is_right(course):
    assert reference_data.verify("toy").ok
    assert all(verdict.ok for verdict in checking.check(muslin.load(TOY, "toy")))
    stubs = checking.check(muslin.load(paths.assignment("toy"), "toy"))
    assert all("not implemented yet" in verdict.message for verdict in stubs)


def test_check_names_mistakes_and_calls_right_answers_right(work):
    assert "7 of 7 tasks" in told("check", folder=work)
    wrong(work, "energy.py", " - 3.0)", ")")
    said = told("check", "psi", folder=work, code=1)
    assert "the three is not subtracted" in said
    wrong(work, "descent.py", "x - way", "x + way")
    assert "You go uphill" in told("check", "descend", folder=work, code=1)
    wrong(work, "descent.py", "return x + way, np.linalg.norm(way)", "return None")
    assert "descend returns nothing" in told("check", "descend", folder=work, code=1)
    wrong(work, "descent.py", "way = step * gradient(x)", "way = step * gradient(x) * (1 / 0)")
    assert "line 9" in told("check", "descend", folder=work, code=1)


def test_explain_gradcheck_hint_and_list_know_it(work):
    said = told("explain", "psi", "--case", "0", folder=work)
    assert "tr(F^T F)" in said
    assert re.search(r"line 9 +way = \[", told("explain", "descend", folder=work))
    assert re.search(
        r"ok +dpsi_dF: compared with central differences of your psi", told("gradcheck", folder=work)
    )
    assert "squares of all entries" in told("hint", "psi", "--level", "2", folder=work)
    assert "descend" in told("list", folder=work)


def test_grade_gives_all_points_takes_them_task_by_task_and_holds_the_law(work):
    record = muslin.grade(work, "toy")
    assert record.score == record.max_score == 30
    assert [check.status for check in record.simulation.checks] == ["passed"]
    wrong(work, "energy.py", "return mu * F", "return 2.0 * mu * F")
    wrong(work, "tetrahedron.py", "q[3 * k + i]", "q[3 * k + j]")
    record = muslin.grade(work, "toy")
    assert record.score == 22
    assert "scaled:2" in {check.cause for check in record["dpsi_dF"].checks}
    assert record["psi"].score == 4
    assert muslin.grade(paths.assignment("toy"), "toy").score == 0


def test_the_solution_is_graded_without_a_word_about_what_judges_it(course):
    for name, folder in (("toy", course / "solutions" / "toy"), ("cloth", paths.source("cloth"))):
        handed = collect(folder, tasks.assignment(name))
        assert set(handed.files) == set(tasks.assignment(name).files)
        assert handed.about.notes == ()


def test_a_task_in_python_is_run_in_a_sandbox_and_costs_nobody_else_a_point(work):
    wrong(work, "descent.py", "way = step", "import os; os._exit(0)\n    way = step")
    record = muslin.grade(work, "toy")
    assert record.score == 24
    assert record["descend"].score == 0


def test_which_assignment_is_answered_a_submission_says_itself_and_nothing_else_of_it_is_believed(
    work, tmp_path
):
    assert muslin.grade(work).score == 30
    manifest = work / tasks.MANIFEST
    manifest.write_text(re.sub(r"points = \d+", "points = 1000", manifest.read_text()))
    with zipfile.ZipFile(tmp_path / "handed.zip", "w") as packed:
        for file in (manifest, *(work / name for name in tasks.assignment("toy").files)):
            packed.write(file, f"ada/{file.name}")
    record = muslin.grade(tmp_path / "handed.zip")
    assert (record.assignment["name"], record.score, record.max_score) == ("toy", 30, 30)
    assert "30 of 30 points" in told("grade", str(tmp_path / "handed.zip"), folder=tmp_path)
    manifest.write_text(re.sub(r'^name = "toy"', 'name = "../toy"', manifest.read_text(), flags=re.MULTILINE))
    with pytest.raises(muslin.MuslinError, match=r"names the assignment '\.\./toy', and there is none"):
        muslin.grade(work)
    assert muslin.grade(work, "toy").score == 30


def test_where_nothing_says_which_assignment_it_is_its_files_do(work, tmp_path):
    (work / tasks.MANIFEST).unlink()
    shutil.rmtree(work / ".muslin")
    assert "7 of 7 tasks" in told("check", "--functions", str(work), folder=tmp_path)
    assert muslin.grade(work).assignment["name"] == "toy"
    solids = tmp_path / "solids"
    solids.mkdir()
    for file in ("forces.py", "shape_functions.py"):  # the second is a file of cloth, too
        shutil.copy(paths.assignment("solids") / file, solids)
    assert muslin.grade(solids).assignment["name"] == "solids"
    (solids / "forces.py").unlink()
    assert muslin.grade(solids).assignment["name"] == "solids"  # by what its functions take
    (solids / "shape_functions.py").rename(solids / "essay.py")
    said = told("grade", str(solids), folder=tmp_path, code=1)
    assert "It was taken for cloth; --assignment names another: cloth, solids, toy." in " ".join(said.split())


def test_in_a_workspace_another_folder_is_taken_for_the_same_assignment(work, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(TOY / "energy.py", other)
    (other / "energy.py").rename(other / "shape_functions.py")  # a name of cloth's
    shutil.copy(TOY / "energy.py", other)
    assert "psi" in told("check", "psi", "--functions", "../other", folder=work)


def test_what_is_handed_in_says_what_it_answers(work):
    told("submit", "--out", "mine.zip", folder=work)
    record = muslin.grade(work / "mine.zip")
    assert record.assignment["name"] == "toy"
    assert record.score == 30
    assert record.submission.notes == ()


def test_an_assignment_without_a_simulation_promises_none(work):
    assert "Next: muslin submit packs your functions to hand in." in told("check", folder=work)
    said = told("run", folder=work, code=1)
    assert "toy has no simulation: no scene calls its functions. Instead: muslin submit" in " ".join(
        said.split()
    )
    assert "no simulation" in told("run", "drape", folder=work, code=1)
    (work / "experiments").mkdir()
    (work / "experiments" / "net.py").write_text('"""A net."""\nprint("a net")\n')
    assert "Next: muslin experiment shows what" in told("check", folder=work)
    assert "What to ask" not in told("experiment", folder=work)
    (work / "experiments" / "README.md").write_text("What does it weigh?\n")
    assert "What to ask of it: experiments/README.md" in told("experiment", folder=work)


@pytest.mark.parametrize("platform", ["students", "gradescope"])
def test_what_is_not_as_the_solution_gives_it_is_not_packed(platform, course, tmp_path):
    released = paths.assignment("toy")
    stub = (released / "energy.py").read_bytes()
    stray = released / "reference.py"
    try:
        shutil.copy(TOY / "energy.py", released)
        said = told("pack", platform, "--assignment", "toy", "--out", "out", folder=tmp_path, code=1)
        assert "energy.py" in said
        assert "Nothing was packed. See all with: muslin release toy --check" in " ".join(said.split())
        (released / "energy.py").write_bytes(stub)
        shutil.copy(TOY / "reference.py", stray)
        assert "reference.py is superfluous" in told(
            "pack", platform, "--assignment", "toy", "--out", "out", folder=tmp_path, code=1
        )
        assert not (tmp_path / "out").exists()
    finally:
        (released / "energy.py").write_bytes(stub)
        stray.unlink(missing_ok=True)


def test_watch_checks_what_was_saved(work):
    from muslin.student import watching, workspace

    said = []
    session = watching.Watch(workspace.find(work), said.append)
    try:
        session._look()
        session.keys = {"psi": session.workspace.key("psi", session.texts)}
        wrong(work, "energy.py", " - 3.0)", ")")
        session._look()
        session._check(["psi"])
        session.step()
        assert any("FAIL psi" in line and "not subtracted" in "".join(said) for line in said), said
        wrong(work, "energy.py", ")\n", " - 3.0)\n")
        session._look()
        session._check(["psi"])
        session.step()
    finally:
        session.checker.close()


def test_a_class_is_graded_and_packed(work, course, tmp_path):
    room = tmp_path / "class"
    for name, place in (("ada", work), ("ben", paths.assignment("toy"))):
        shutil.copytree(place, room / name)
    told("class", "grade", str(room), "--out", str(tmp_path / "out"), folder=tmp_path)
    table = next((tmp_path / "out").glob("*.csv")).read_text()
    assert re.search(r"ada.*\b30\b", table)
    told("pack", "gradescope", "--assignment", "toy", "--out", str(tmp_path / "pack"), folder=tmp_path)
    archive = next((tmp_path / "pack").rglob("*.zip"))
    with zipfile.ZipFile(archive) as packed:
        (inner,) = (name for name in packed.namelist() if name.endswith(".whl"))
        packed.extract(inner, tmp_path)
    with zipfile.ZipFile(tmp_path / inner) as wheel:
        names = wheel.namelist()
    assert "muslin/_shipped/judge/toy/reference.py" in names
    assert "muslin/_shipped/assignments/toy/assignment.toml" in names


def test_a_task_nobody_knows_and_a_folder_that_is_not_there_are_said_in_words(course, tmp_path, monkeypatch):
    said = told("reference", "mistakes", "toy", "--task", "psii", folder=tmp_path, code=1)
    assert "There is no task 'psii'. Did you mean psi?" in said
    monkeypatch.setenv(paths.COURSE, str(tmp_path / "nowhere"))
    assert "nowhere" in told("lint", "toy", folder=tmp_path, code=1)


def test_whose_assignment_is_meant_is_never_guessed_wrong(course, tmp_path, monkeypatch):
    assert paths.usual() == "toy"
    shutil.copytree(course / "solutions" / "toy", tmp_path / "solutions" / "toy")
    shutil.copytree(course / "solutions" / "toy", tmp_path / "solutions" / "other")
    monkeypatch.setenv(paths.COURSE, str(tmp_path))
    said = told("new", "task", "flux", folder=tmp_path, code=1)
    assert "Which assignment? There are 2 in" in said
    assert "--assignment other|toy" in said
    monkeypatch.delenv(paths.COURSE)
    assert paths.usual() == "cloth"
    said = " ".join(
        told(
            "check", "psi", "--functions", str(course / "assignments" / "toy"), folder=tmp_path, code=1
        ).split()
    )
    assert "there is none of that name here" in said
    said = " ".join(told("release", "toyy", folder=tmp_path, code=1).split())
    assert "One of your own is found in the folder that MUSLIN_COURSE names." in said


def test_lint_says_what_is_left_and_new_begins_another(course):
    said = told("lint", "toy", folder=course, code=1)
    assert "misconceptions" in said
    assert "error in Muslin" not in said
    told("new", "assignment", "other", folder=course)
    try:
        assert (course / "solutions" / "other" / "reference.py").is_file()
        assert muslin.grade(course / "solutions" / "other", "other").score == 5
    finally:
        for part in ("solutions", "assignments", "data/reference", "data/known", "tests/misconceptions"):
            shutil.rmtree(course / part / "other", ignore_errors=True)


def test_the_diagnosis_of_one_assignment_knows_nothing_of_another_with_the_same_names(course):
    inputs, expected = reference.cases("toy", "dpsi_dF")
    table = tasks.assignment("toy")
    swapped = (np.swapaxes(expected[0], 1, 2),)
    assert diagnosis.diagnose(table.tasks["dpsi_dF"], swapped, expected, inputs, "toy").cause == "transposed"


#: Where student functions are called by the physics: what stands behind each of its parts is said there.
ADAPTERS = ("physics/", "simulation/by_student.py", "simulation/model.py")

#: A table of Greek letters as they are called in code.
LETTERS = "reading/vocabulary.py"


def test_no_file_of_the_framework_but_the_adapters_names_a_task():
    names = {task for name in ("cloth", "solids") for task in tasks.assignment(name).tasks}
    package = Path(muslin.__file__).parent
    found = [
        f"{path.relative_to(package)}, line {node.lineno}: {node.value}"
        for path in sorted(package.rglob("*.py"))
        if not path.relative_to(package).as_posix().startswith((*ADAPTERS, LETTERS, "_shipped"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in names
    ]
    assert not found, "\n".join(found)
