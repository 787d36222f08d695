"""Submissions are found in every platform's layout, and no two students are taken for one."""

import ast
import os
import subprocess
import sys
import zipfile

import pytest

from muslin import tasks
from muslin.base.errors import MuslinError
from muslin.classes import finding
from muslin.grading.submission import collect, gather

TABLE = tasks.assignment("cloth")


def put(path, text="x = 1\n"):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def packed(path, *names):
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "x = 1\n")
    return path


def found(folder):
    submissions, _ = finding.find(folder, TABLE)
    return {s.key: s for s in submissions}


def handed(submission):
    """The task files the grader sees."""
    return gather(submission.sources, submission.name, TABLE)


def test_a_folder_or_an_archive_per_student(tmp_path):
    put(tmp_path / "class/Jane Doe/cloth/stress.py")
    packed(tmp_path / "class" / "Zoë  Ångström.zip", "stress.py")
    put(tmp_path / "class/.DS_Store")
    put(tmp_path / "class/read me.txt")
    submissions, notes = finding.find(tmp_path / "class", TABLE)
    assert [(s.key, s.name) for s in submissions] == [
        ("jane-doe", "Jane Doe"),
        ("zoe-angstrom", "Zoë Ångström"),
    ]
    assert notes == ["read me.txt: neither a folder nor an archive"]
    for submission in submissions:
        assert list(handed(submission).files) == ["stress.py"]


def test_canvas_names(tmp_path):
    packed(tmp_path / "doejane_12345_67890_my cloth.zip", "stress.py")
    packed(tmp_path / "roejohn_LATE_222_333_cloth-1.zip", "stress.py")
    students = found(tmp_path)
    assert students.keys() == {"doejane-12345", "roejohn-222"}
    assert students["roejohn-222"].late
    assert not students["doejane-12345"].late
    assert students["doejane-12345"].students == (finding.Student("doejane", "12345"),)


def test_canvas_gives_each_upload_by_itself(tmp_path):
    put(tmp_path / "class/doejane_1_100_stress.py", "old = 1\n")
    put(tmp_path / "class/doejane_1_101_stress-1.py", "new = 1\n")
    put(tmp_path / "class/doejane_1_102_collision.py")
    put(tmp_path / "class/roe_2_103_collision.py")
    students = found(tmp_path / "class")
    assert students.keys() == {"doejane-1", "roe-2"}
    files = handed(students["doejane-1"]).files
    assert files == {"stress.py": b"new = 1\n", "collision.py": b"x = 1\n"}
    notes = handed(students["doejane-1"]).about.notes
    assert notes == ("stress.py was handed in 2 times; the newest was graded.",)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("team_red_11111_90001_cloth.zip", ("team_red", "11111", False)),
        ("group_1_LATE_11111_90001_cloth.zip", ("group_1", "11111", True)),
        ("group_2_22222_90002_cloth.zip", ("group_2", "22222", False)),
        ("team_2024_12345_67890_2_3_cloth.zip", ("team_2024", "12345", False)),
        ("doejane_12345_67890_12_34_cloth.zip", ("doejane", "12345", False)),
        ("doejane_LATE_12345_67890_my_99_cloth.zip", ("doejane", "12345", True)),
        ("anon_aB3dE_67890_cloth.zip", ("anon", "aB3dE", False)),
        ("anonymous_LATE_12345_67890_cloth.zip", ("anonymous", "12345", True)),
        ("roejim_LATE_55555_text.html", ("roejim", "55555", True)),
    ],
)
def test_canvas_names_are_read_where_groups_and_files_hold_numbers(name, said, tmp_path):
    packed(tmp_path / name, "stress.py")
    packed(tmp_path / "poe_77777_99999_cloth.zip", "stress.py")
    students = [(s.name, s.students[0].id, s.late) for s in found(tmp_path).values()]
    assert said in students


@pytest.mark.parametrize("deep", ["submissions", "Downloads/cloth submissions", "a/b/c"])
def test_the_folder_around_a_download_is_no_student(deep, tmp_path):
    for name in ("doejane_33333_90003_cloth.zip", "roeric_44444_90004_cloth.zip"):
        (tmp_path / "class" / deep).mkdir(parents=True, exist_ok=True)
        packed(tmp_path / "class" / deep / name, "stress.py")
    put(tmp_path / "class/roster.csv")
    submissions, notes = finding.find(tmp_path / "class", TABLE)
    assert [s.name for s in submissions] == ["doejane", "roeric"]
    assert any("taken for the download" in note for note in notes)


def test_two_downloads_and_what_they_came_in_are_one_class(tmp_path):
    for section in "ab":
        put(tmp_path / f"class/section {section}/Jane Doe_12_assignsubmission_file_/stress.py")
        put(tmp_path / f"class/section {section}/Jo Roe {section}_13_assignsubmission_file_/stress.py")
        packed(tmp_path / f"class/section {section}.zip", "x/stress.py")
    submissions, notes = finding.find(tmp_path / "class", TABLE)
    assert [s.name for s in submissions] == ["Jane Doe", "Jane Doe", "Jo Roe a", "Jo Roe b"]
    assert len({s.key for s in submissions}) == 4
    assert sum("the download, which is unpacked" in note for note in notes) == 2


def test_folders_of_plain_students_in_a_folder_are_recognised_and_one_students_folders_are_not(tmp_path):
    for name in ("cloth-ann", "cloth-bob"):
        put(tmp_path / "a/cloth-submissions" / name / "work/stress.py")
    assert [s.name for s in found(tmp_path / "a").values()] == ["ann", "bob"]
    put(tmp_path / "b/Jane/part 1/stress.py")
    put(tmp_path / "b/Jane/part 2/collision.py")
    assert [s.name for s in found(tmp_path / "b").values()] == ["Jane"]


def test_every_kind_of_file_that_a_student_may_have_handed_in_has_a_line(tmp_path):
    for name in ("ann.rar", "bob.7z", "cy.ipynb", "di.pdf", "ed.docx", "fay.zip", "flo.py"):
        put(tmp_path / name)
    for name in ("Thumbs.db", "grades.csv", "notes.txt", "desktop.ini"):
        put(tmp_path / name)
    submissions, notes = finding.find(tmp_path, TABLE)
    assert [s.name for s in submissions] == ["ann", "bob", "cy", "di", "ed", "fay", "flo"]
    assert notes == [f"{name}: neither a folder nor an archive" for name in ("grades.csv", "notes.txt")]


def test_a_folder_and_the_archive_it_came_in_are_one_student(tmp_path):
    put(tmp_path / "Jane/stress.py", "unpacked = 1\n")
    packed(tmp_path / "Jane.zip", "stress.py", "collision.py")
    (submission,) = found(tmp_path).values()
    assert handed(submission).files == {"stress.py": b"unpacked = 1\n", "collision.py": b"x = 1\n"}


def test_no_two_keys_are_the_same_even_where_case_does_not_count(tmp_path):
    for name in ("Alice", "alice"):
        put(tmp_path / name / "stress.py")
    hashed = [key for key in found(tmp_path) if key.startswith("alice-")]
    assert len(hashed) == 2
    for name in (*hashed, hashed[0].upper(), "alice-"):
        put(tmp_path / name / "stress.py")
    keys = list(found(tmp_path))
    assert len({key.lower() for key in keys}) == len(keys) == 6


@pytest.mark.skipif(
    os.name != "posix" or os.uname().sysname != "Linux", reason="names are bytes on Linux only"
)
def test_names_come_out_right_in_a_locale_that_is_not_utf8(tmp_path):
    put(tmp_path / "José Ñandú/stress.py")
    os.makedirs(os.fsencode(tmp_path) + b"/Bj\xf6rn")
    code = (
        "import sys; from muslin import tasks; from muslin.classes import finding;"
        "found, _ = finding.find(sys.argv[1], tasks.assignment('cloth'));"
        "print(ascii([(s.key, s.name) for s in found]))"
    )
    environment = {**os.environ, "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    said = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert ast.literal_eval(said.stdout) == [("bjorn", "Björn"), ("jose-nandu", "José Ñandú")]


def test_moodle_folders_and_files(tmp_path):
    put(tmp_path / "class/Jane Doe_12_assignsubmission_file_/stress.py")
    packed(tmp_path / "class" / "John Roe_13_assignsubmission_file_cloth.zip", "stress.py")
    (tmp_path / "class/Ann Poe_14_assignsubmission_file").mkdir()
    packed(tmp_path / "class/Ann Poe_14_assignsubmission_file" / "work.zip", "collision.py")
    students = found(tmp_path / "class")
    assert [(k, s.name) for k, s in students.items()] == [
        ("ann-poe-14", "Ann Poe"), ("jane-doe-12", "Jane Doe"), ("john-roe-13", "John Roe"),
    ]  # fmt: skip
    assert list(handed(students["ann-poe-14"]).files) == ["collision.py"]


def test_gradescope_takes_names_and_groups_from_the_metadata(tmp_path):
    pytest.importorskip("yaml")
    put(tmp_path / "submission_11/stress.py")
    put(tmp_path / "submission_12/stress.py")
    put(
        tmp_path / "submission_metadata.yml",
        "---\nsubmission_11:\n  :submitters:\n  - :name: Jane Doe\n    :sid: '0042'\n    :email: j@x.edu\n"
        "  - :name: 'Zoë: Roe'\n    :sid: \n    :email: z@x.edu\n  :created_at: 2026-01-01 10:00:00 Z\n",
    )
    students = found(tmp_path)
    assert students["jane-doe-zoe-roe-11"].students == (
        finding.Student("Jane Doe", "0042"),
        finding.Student("Zoë: Roe", "z@x.edu"),
    )
    assert students["submission-12"].students == (finding.Student("submission_12", "12"),)


def test_github_puts_the_assignment_before_the_name(tmp_path):
    for name in ("hw3-cloth-janedoe", "hw3-cloth-jim-roe"):
        put(tmp_path / "a" / name / "stress.py")
        (tmp_path / "a" / name / ".git").mkdir()
    assert [s.name for s in found(tmp_path / "a").values()] == ["janedoe", "jim-roe"]
    put(tmp_path / "b/cloth-ann/stress.py")
    put(tmp_path / "b/cloth-anna/stress.py")
    assert [s.name for s in found(tmp_path / "b").values()] == ["ann", "anna"]
    put(tmp_path / "c/team-a/stress.py")
    put(tmp_path / "c/team-b/stress.py")
    assert [s.name for s in found(tmp_path / "c").values()] == ["team-a", "team-b"]


def test_equal_names_are_kept_apart_and_keys_stay_the_same(tmp_path):
    for name in ("Jané Doe", "jane doe", "Jane_Doe", "李", "🧵"):
        put(tmp_path / name / "stress.py")
    keys = list(found(tmp_path))
    assert len(set(keys)) == 5
    assert keys == list(found(tmp_path))
    assert all(set(key) <= set("abcdefghijklmnopqrstuvwxyz0123456789-") for key in keys)


def test_the_same_files_give_the_same_bytes_whenever_and_wherever(tmp_path):
    for where in ("a", "b"):
        put(tmp_path / where / "Jane/stress.py")
        os.utime(tmp_path / where / "Jane/stress.py", (len(where), len(where)))
    (tmp_path / "b/Jane/stress.py").chmod(0o600)
    first, second = (found(tmp_path / where)["jane"] for where in ("a", "b"))
    assert handed(first) == handed(second)


def test_links_lead_nowhere(tmp_path):
    secret = put(tmp_path / "secret.py", "secret = 1\n")
    put(tmp_path / "class/Jane/collision.py")
    (tmp_path / "class/Jane/stress.py").symlink_to(secret)
    (tmp_path / "class/John").symlink_to(tmp_path)
    submissions, notes = finding.find(tmp_path / "class", TABLE)
    assert [s.name for s in submissions] == ["Jane"]
    assert notes == ["John: a link"]
    assert not any(b"secret" in data for data in handed(submissions[0]).files.values())
    assert "link" in handed(submissions[0]).refused["stress.py"]


def test_what_the_grader_would_refuse_it_still_refuses(tmp_path):
    put(tmp_path / "class/Jane/a/stress.py")
    put(tmp_path / "class/Jane/b/stress.py", "x = 2\n")
    put(tmp_path / "class/Jane/collision.py", "#" * 1_000_001)
    put(tmp_path / "class/Jane/numpy.py", "evil = 1\n")
    submission = found(tmp_path / "class")["jane"]
    direct, through = collect(tmp_path / "class/Jane", TABLE), handed(submission)
    assert through.refused == direct.refused
    assert through.about.notes == direct.about.notes
    assert not through.files


@pytest.mark.parametrize(
    ("made", "said"),
    [((), "no submission"), (("stress.py",), "one submission"), (None, "not a folder")],
)
def test_what_is_no_class_is_said_so(made, said, tmp_path):
    for name in made or ():
        put(tmp_path / "class" / name)
    if made == ():
        (tmp_path / "class").mkdir()
    with pytest.raises(MuslinError, match=said):
        finding.find(tmp_path / "class", TABLE)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes with names")
@pytest.mark.parametrize("beside", [True, False])
def test_a_pipe_is_named_also_beside_a_folder_of_its_name(tmp_path, beside):
    put(tmp_path / "class/Jane/collision.py")
    if beside:
        put(tmp_path / "class/fifo/stress.py")
    os.mkfifo(tmp_path / "class/fifo.zip")
    submissions, notes = finding.find(tmp_path / "class", TABLE)
    assert [s.name for s in submissions] == ["fifo"] * beside + ["Jane"]
    assert notes == ["fifo.zip: a pipe, a socket or a device, not a file"]
