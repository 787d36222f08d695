"""Constants of each student's own: in what they are given, in check, in grade, in a class; nobody else's pass."""

import re
from dataclasses import replace

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.authoring import variants
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes.finding import Student, Submission
from muslin.classes.roster import Person
from muslin.classes.whose import assigned
from muslin.grading.diagnosis import diagnose
from muslin.grading.submission import collect
from muslin.judging import cases, checking, properties, reference
from muslin.packing import grading, packs
from muslin.student import workspace
from muslin.tasks.batch import evaluate
from muslin.tasks.constants import of
from muslin.tasks.wiring import as_called

ADA, BOB = of("term", " Ada.L@x.EDU"), of("term", "1234567")
ENERGY = ("psi", "dpsi_ds", "d2psi_ds2")
LINE = re.compile(r"^# Constants of .*\nc_mu, c_lam = .*$", re.MULTILINE)


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A variant in which everybody has constants, and the workspaces of two who have solved it."""
    folder = tmp_path_factory.mktemp("course")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.COURSE, str(folder))
        choice = variants.picked(variants.Tables("cloth"), ["green", "young"])
        list(variants.write("cloth", "term", "a seed", choice, data=False, per_student=True))
        paths.reference("term").mkdir(parents=True)
        for task in tasks.assignment("term").tasks:
            made = cases.make("term", task, 1, 4)
            np.savez(paths.reference("term") / f"{task}.npz", **made)
        for name in (ADA, BOB):
            workspace.start(name, folder / name)
            fill(folder / name)
        yield folder


def fill(folder):
    """Solve it, with the constants that are in the folder."""
    own = LINE.search((folder / "strain_energy.py").read_text(encoding="utf-8"))[0]
    for file in tasks.assignment("term").files:
        text = (paths.solution("term") / file).read_text(encoding="utf-8")
        (folder / file).write_text(LINE.sub(own, text), encoding="utf-8")


def test_constants_are_drawn_from_who_one_is_and_stand_in_all_that_one_is_given(course):
    ada, bob = tasks.assignment(ADA), tasks.assignment(BOB)
    assert (ada.name, ada.student) == ("term@ada.l@x.edu", "ada.l@x.edu")
    said = ada.constants.said(ada.student)
    assert said != bob.constants.said(bob.student)
    for file in ("strain_energy.py", "README.md", "handout.html", ".muslin/given/strain_energy.py.given"):
        text = (course / ADA / file).read_text(encoding="utf-8")
        assert said in text
        assert "c_mu, c_lam = 1.0, 1.0" not in text
    assert workspace.find(course / ADA).table == ada
    every = {tuple(ada.constants.drawn(f"s{k}").values()) for k in range(1000)}
    assert len(every) > 995
    assert all(
        min(abs(value - 1), abs(value - 2), abs(value - 0.5)) > 0.1 for pair in every for value in pair
    )


def test_nobody_works_on_it_who_does_not_say_who_they_are(course, tmp_path):
    with pytest.raises(MuslinError, match="muslin start term --student ID"):
        workspace.start("term", tmp_path / "work")
    with pytest.raises(MuslinError, match="cannot be a student's id"):
        of("term", "../x")
    with pytest.raises(MuslinError, match="Everybody has the same cloth"):
        tasks.assignment(of("cloth", "ada"))


@pytest.mark.parametrize("task", ENERGY)
def test_what_is_true_of_a_student_is_the_energy_with_their_constants(course, task):
    plain, own = tasks.assignment("term"), muslin.load(course / ADA)
    solution = muslin.load(paths.solution("term"))
    inputs, expected = reference.cases(ADA, task)
    E, nu = inputs["E"], inputs["nu"]
    mu, lam = E / (2 * (1 + nu)), E * nu / (1 - nu**2)
    c = own.assignment.constants.drawn("ada.l@x.edu")
    mu, lam = c["c_mu"] * mu, c["c_lam"] * lam
    nu = lam / (lam + 2 * mu)
    right = evaluate(solution[task], s=inputs["s"], E=2 * mu * (1 + nu), nu=nu)
    scale = abs(right).max()
    assert np.allclose(expected[0], right, rtol=0, atol=1e-12 * scale)
    assert np.allclose(cases.truth(ADA, task, inputs)[0], right, rtol=0, atol=1e-12 * scale)
    assert np.allclose(evaluate(own[task], **inputs), right, rtol=0, atol=1e-12 * scale)
    assert plain.tasks["phi"] == own.assignment.tasks["phi"]
    for prop, drawn in properties.draw(ADA, task, "seed"):
        assert properties.judge(prop, drawn, (evaluate(own[task], **drawn),)) <= prop.tolerance, prop.name


def test_a_students_functions_are_right_by_their_own_constants_and_wrong_by_anothers(course):
    ada = muslin.load(course / ADA)
    assert [verdict.task for verdict in checking.check(ada) if not verdict.ok] == []
    as_bobs = muslin.load(course / ADA, tasks.assignment(BOB))
    assert {verdict.task for verdict in checking.check(as_bobs) if not verdict.ok} == set(ENERGY)
    inputs, expected = reference.cases(BOB, "psi")
    text = (course / ADA / "strain_energy.py").read_text(encoding="utf-8")
    got = (evaluate(ada.psi, **inputs),)
    found = diagnose(as_bobs.assignment.tasks["psi"], got, expected, inputs, BOB, text)
    assert found.mistake == "The constants in strain_energy.py are not those of 1234567."
    assert as_bobs.assignment.constants.said("1234567") in found.advice


def test_the_simulator_calls_a_students_functions_as_they_are_meant(course):
    inputs = {"s": np.array([[1.2, 0.9, 1.0]]), "mu": np.array([7.0]), "lam": np.array([4.0])}
    called = [
        as_called(muslin.load(folder)) for folder in (course / ADA, course / BOB, paths.solution("term"))
    ]
    one, other, solution = (evaluate(functions.psi, **inputs) for functions in called)
    assert one == pytest.approx(solution, rel=1e-13)
    assert other == pytest.approx(solution, rel=1e-13)


def test_a_submission_is_graded_with_the_constants_of_whose_it_is(course, tmp_path):
    def points(folder, **whose):
        record = muslin.grade(folder, **whose, only=["psi"], safety="process")
        assert record.assignment["name"] == "term"
        return record.score

    assert points(course / ADA) == 5
    with pytest.raises(MuslinError, match=r"constants of ada\.l@x\.edu, and this is 1234567's work"):
        points(course / ADA, student="1234567")
    bare = tmp_path / "bare"
    bare.mkdir()
    text = (course / ADA / "strain_energy.py").read_text(encoding="utf-8")
    (bare / "strain_energy.py").write_text(re.sub("# Constants of.*", "", text), encoding="utf-8")
    assert points(bare, assignment="term", student="1234567") == 0
    with pytest.raises(MuslinError, match="Add --student ID"):
        points(bare, assignment="term")
    assert points(paths.solution("term")) == 5


def test_in_a_class_constants_count_only_of_who_handed_them_in(course, tmp_path):
    table, handed = tasks.assignment("term"), collect(course / ADA, tasks.assignment("term"))

    def whose(*known, people=(), text=None):
        files = {**handed.files, **({"strain_energy.py": text} if text is not None else {})}
        one = Submission("key", tuple(Student(*words) for words in known), ())
        return assigned(replace(handed, files=files), one, people, table)

    roster = Person((1,), "Lovelace, Ada", ("77",), ("ada.l@x.edu",))
    assert whose(("ada.l@x.edu",)).student == "ada.l@x.edu"
    assert whose(("Ada Lovelace", "77"), people=[roster]).student == "ada.l@x.edu"
    text = re.sub(b"# Constants of.*", b"", handed.files["strain_energy.py"])
    assert whose(("Ada Lovelace", "77"), people=[roster], text=text).student == "ada.l@x.edu"
    refused = whose(("Bob", "1234567"))
    assert refused.student == ""
    assert "has the constants of ada.l@x.edu, and Bob is not known by that" in refused.unreadable
    assert "does not have the constants of Bob" in whose(("Bob", "1234567"), text=text).unreadable
    assert whose(("Bob", "1234567"), text=b"").unreadable


def test_what_students_install_has_no_workspace_yet_and_says_how_to_make_ones_own(course, tmp_path):
    files = packs._files("students", "term")
    assert not any(name.startswith("term/") for name in files)
    assert b"muslin start term --student YOUR-LOGIN\ncd term\n" in files["README.md"]


def test_gradescope_says_whose_it_is(course, tmp_path):
    metadata = tmp_path / "submission_metadata.json"
    metadata.write_text('{"users": [{"id": 5, "name": "Ada", "email": "Ada.L@x.edu"}]}')
    assert grading._handed(course / ADA, "term", metadata).student == "ada.l@x.edu"
    assert "not known by that" in grading._handed(course / BOB, "term", metadata).unreadable
