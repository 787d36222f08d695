"""Task files are found under nearly right names, in archives in archives, and nothing is guessed between two."""

from __future__ import annotations

import csv
import shutil
import warnings
import zipfile

import pytest
from class_mess import STUBS, zipped

import muslin
from muslin import cli, tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes import meant, run
from muslin.grading import choosing, submission
from muslin.grading.submission import Unreadable, collect, gradable

TABLE = tasks.assignment("cloth")


def folder(home, files):
    for name, data in files.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_bytes(data)
    return collect(home, TABLE)


@pytest.mark.parametrize(
    "name",
    [
        "Stress.py", "STRESS.PY", "stress.py.txt", "stress.py.py", "stress .py", "stress (1).py", "stress(2).py",
        "stress-1.py", "stress_1.py", "stress 2.py", "stress copy.py", "stress copy 3.py", "stress - Copy.py",
        "stress - Kopie (2).py", "Copy of stress.py", "stress副本.py", "ｓｔｒｅｓｓ.py", "stres.py", "strress.py",
    ],
)  # fmt: skip
def test_the_only_file_whose_name_is_nearly_right_is_taken_and_named(name, tmp_path):
    others = {file: data for file, data in STUBS.items() if file != "stress.py"}
    handed = folder(tmp_path, {**others, name: b"x = 1\n"})
    assert handed.files["stress.py"] == b"x = 1\n"
    assert f"stress.py is missing; {name} was graded in its place." in handed.about.notes


@pytest.mark.parametrize(
    "name", ["stress.ipynb", "stress.pdf", "my stress final.txt", "stress_old.py", "test_stress.py"]
)
def test_what_only_reminds_of_a_task_file_is_named_and_not_read(name, tmp_path):
    handed = folder(tmp_path, {"collision.py": b"x = 1\n", name: b"x = 1\n"})
    assert list(handed.files) == ["collision.py"]
    assert f"there is {name}" in handed.refused["stress.py"]


@pytest.mark.parametrize("name", ["press.py", "distress.py", "strain.py", "stress2strain.ipynb", "utils.py"])
def test_other_names_mean_no_task_file(name):
    assert choosing.nearness(name, TABLE.files) == ("", choosing.UNREAD)


def test_numbers_in_the_names_of_task_files_are_no_copies():
    wanted = ("task1.py", "task2.py")
    assert choosing.nearness("task 2.py", wanted) == ("task2.py", choosing.CHANGED)
    assert choosing.nearness("task3.py", wanted)[1] == choosing.UNREAD
    assert choosing.nearness("task1 (1).py", wanted) == ("task1.py", choosing.CHANGED)


def test_between_two_candidates_nothing_is_guessed_unless_they_are_the_same(tmp_path):
    two = {"stress (1).py": b"x = 1\n", "stress (2).py": b"x = 2\n", "collision.py": b"x = 1\n"}
    assert "stress (1).py or stress (2).py may be meant" in folder(tmp_path / "a", two).refused["stress.py"]
    same = folder(tmp_path / "b", {**two, "stress (2).py": b"x = 1\n"})
    assert same.files["stress.py"] == b"x = 1\n"
    right = folder(tmp_path / "c", {**two, "stress.py": b"x = 3\n"})
    assert right.files["stress.py"] == b"x = 3\n"
    assert any("not from stress (1).py and stress (2).py" in note for note in right.about.notes)


def test_archives_beside_task_files_are_opened_for_what_is_missing_only(tmp_path):
    beside = {"cloth.zip": zipped({name: b"old = 1\n" for name in STUBS})}
    whole = folder(tmp_path / "a", {**STUBS, **beside})
    assert whole.files == STUBS
    assert whole.about.notes == ("Not opened, since there are task files beside: cloth.zip.",)
    part = folder(tmp_path / "b", {"stress.py": STUBS["stress.py"], **beside})
    assert part.files["stress.py"] == STUBS["stress.py"]
    assert part.files["collision.py"] == b"old = 1\n"


def test_a_whole_class_in_one_archive_is_no_submission(tmp_path):
    (tmp_path / "all.zip").write_bytes(
        zipped({f"{k}.zip": zipped({"stress.py": b"x = %d" % k}) for k in range(30)})
    )
    handed = collect(tmp_path / "all.zip", TABLE)
    assert "There are" in handed.unreadable
    assert not handed.files


def test_a_single_task_file_is_a_submission(tmp_path):
    (tmp_path / "stress.py").write_bytes(STUBS["stress.py"])
    assert collect(tmp_path / "stress.py", TABLE).files == {"stress.py": STUBS["stress.py"]}


def test_names_in_a_zip_that_nobody_declared_are_read_as_utf8(tmp_path):
    with zipfile.ZipFile(tmp_path / "s.zip", "w") as archive:
        archive.writestr("Zoë/x.py", "")
        archive.writestr("stress.py", "x = 1")
    data = bytearray((tmp_path / "s.zip").read_bytes())
    for mark, flags in ((b"PK\x03\x04", 7), (b"PK\x01\x02", 9)):
        data[data.find(mark) + flags] &= ~8
    (tmp_path / "s.zip").write_bytes(data)
    assert collect(tmp_path / "s.zip", TABLE).about.notes == ("Not task files, so not used: Zoë/x.py.",)


@pytest.mark.parametrize(("assignment", "given"), [("cloth", ()), ("solids", ("objectives.py",))])
def test_no_word_is_lost_about_a_file_that_was_given(assignment, given, tmp_path):
    table = tasks.assignment(assignment)
    shutil.copytree(paths.assignment(assignment), tmp_path / "work")
    assert (tmp_path / "work" / "experiments").is_dir()
    assert table.given == given
    assert collect(tmp_path / "work", table).about.notes == ()
    (tmp_path / "work" / "mine.py").touch()
    assert collect(tmp_path / "work", table).about.notes == ("Not task files, so not used: mine.py.",)


def test_what_cannot_be_graded_has_no_score_but_a_reason(tmp_path):
    (tmp_path / "work.rar").write_bytes(b"Rar!\x1a\x07\1\0")
    with pytest.raises(Unreadable, match=r"work\.rar cannot be graded\. .*it is a RAR archive"):
        gradable(tmp_path / "work.rar", TABLE)
    with pytest.raises(MuslinError, match="There is no submission"):
        gradable(tmp_path / "nothing.zip", TABLE)


def answering(home, name, file="kinetic_energy.py"):
    """A folder whose own manifest names an assignment, with a file of solids as it was given."""
    home.mkdir(parents=True)
    shutil.copy(paths.assignment("solids") / file, home)
    if name is not None:
        (home / "assignment.toml").write_text(
            f'schema = 1\nname = "{name}"  # mine\n[task.phi]\nname = "cloth"\n'
        )
    return home


@pytest.mark.parametrize("name", ["soldis", "my solids", "\x1b[31mred", "n" * 500])
def test_an_assignment_nobody_has_is_graded_as_no_other(tmp_path, name, monkeypatch, capfd):
    work = answering(tmp_path / "work", name)
    with pytest.raises(
        MuslinError, match=r"work names the assignment '.*', and there is none of that name"
    ) as told:
        muslin.grade(work)
    assert "There is: cloth, " in str(told.value)
    assert ("Did you mean solids?" in str(told.value)) == ("sol" in name)
    assert "\x1b" not in str(told.value)
    assert len(str(told.value)) < 300
    shutil.make_archive(str(work), "zip", work)
    for words in (
        ["grade", str(work)],
        ["grade", str(tmp_path / "work.zip")],
        ["check", "--functions", str(work)],
    ):
        monkeypatch.setattr("sys.argv", ["muslin", *words])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert ended.value.code not in (0, None)
        assert "there is none of that name here" in " ".join(capfd.readouterr().err.split())


@pytest.mark.parametrize(("name", "meant"), [("solids", "solids"), ("cloth", "cloth"), (None, "solids")])
def test_a_submission_says_which_assignment_it_answers_or_its_files_do(tmp_path, name, meant):
    work = answering(tmp_path / "work", name)
    assert submission.named_by([submission.Source(work)], "work") == name
    assert submission.answered(work) == meant


#: Files whose names are in both assignments.
SHARED = ("shape_functions.py", "deformation_gradient.py", "kinetic_energy.py")


@pytest.mark.parametrize("meant", ["cloth", "solids"])
@pytest.mark.parametrize("files", [SHARED, SHARED[:1], SHARED[2:]])
def test_where_names_do_not_tell_what_the_functions_take_does(tmp_path, meant, files):
    work = tmp_path / "work"
    work.mkdir()
    for file in files:
        shutil.copy(paths.solution(meant) / file, work)
    assert submission.answered(work) == meant
    text = (work / files[0]).read_text(encoding="utf-8")
    (work / files[0]).write_text(
        text.replace("return ", "return ((", 1), encoding="utf-8"
    )  # Python cannot read it
    assert submission.answered(work) == meant


def test_where_nothing_tells_it_is_asked(tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    (work / "kinetic_energy.py").write_text("def kinetic_energy(): ...\n", encoding="utf-8")
    with pytest.raises(MuslinError, match=r"work may answer cloth or solids: .* --assignment cloth"):
        muslin.grade(work)


def test_a_class_graded_as_another_assignment_is_told_so(tmp_path):
    """Three right submissions of solids, graded as cloth, were zeros without a word."""
    for student in ("ada", "bob", "cyd"):
        (tmp_path / "class" / student).mkdir(parents=True)
        for file in SHARED[1:]:
            shutil.copy(paths.solution("solids") / file, tmp_path / "class" / student)
    assert run._named(tmp_path / "class") == "solids"
    graded = run.grade_class(tmp_path / "class", tmp_path / "report", "cloth")
    (note,) = graded.notes
    assert note.startswith("ada, bob and cyd: by what the functions take, solids is answered")
    assert "graded as cloth" in note
    with open(tmp_path / "report" / "grades.csv", encoding="utf-8") as stream:
        assert all(
            "it answers solids, and it was graded as cloth" in row["notes"] for row in csv.DictReader(stream)
        )
    (note,) = gradable(tmp_path / "class" / "ada", TABLE).about.notes
    assert note == "By what its functions take it answers solids, and it was graded as cloth."
    table = tasks.assignment("solids")
    handed = gradable(tmp_path / "class" / "ada", table)
    assert handed.about.notes == ()
    assert meant.told({"ada": handed}, table) == []


def test_in_a_class_what_answers_another_assignment_has_no_score_but_a_reason(tmp_path):
    for student, name in {
        "ada": "solids",
        "bob": "soldis",
        "cyd": "cloth",
        "dan": "solids",
        "eve": None,
    }.items():
        answering(tmp_path / "class" / student, name)
    graded = run.grade_class(tmp_path / "class", tmp_path / "report")
    told = {row.submission.name: row for row in graded.rows}
    assert {name for name, row in told.items() if row.record is None} == {"cyd"}
    (note,) = told[
        "bob"
    ].record.submission.notes  # a slip in a file that he need not hand in costs him nothing
    assert "'soldis'" in note
    assert "Did you mean solids?" in note
    assert "It was graded as solids." in note
    assert "says that it answers cloth, and this class is graded as solids" in told["cyd"].error
    assert {row.record.assignment["name"] for row in told.values() if row.record} == {"solids"}


@pytest.mark.parametrize("same", [True, False])
def test_of_entries_of_one_path_the_last_counts_and_that_is_said(tmp_path, same):
    """As unpacking leaves it; two files of that path were named, with one name, and neither was taken."""
    first = STUBS["collision.py"]
    with zipfile.ZipFile(tmp_path / "work.zip", "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the name is there already
        archive.writestr("collision.py", first)
        archive.writestr("collision.py", first if same else first + b"\n# later\n")
    handed = collect(tmp_path / "work.zip", TABLE)
    assert handed.files["collision.py"] == (first if same else first + b"\n# later\n")
    told = [note for note in handed.about.notes if "collision.py" in note]
    last = "collision.py is in its archive 2 times; the last one counts, as when it is unpacked."
    assert len(told) == (0 if same else 1)
    assert all(note.endswith(last) for note in told)
