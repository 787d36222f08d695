"""The optional part: experiments measure what their text says, and written questions are marked on top."""

import csv
import io
import json
import re
import shutil

import grading_samples as samples
import jsonschema
import pytest

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes import gradebook, overrides
from muslin.classes.finding import Student, Submission
from muslin.classes.gradebook import Row
from muslin.grading import record, views
from muslin.student import experimenting, workspace
from muslin.tasks import read_assignment

TABLE = tasks.assignment("cloth")
SOURCE = paths.solution("cloth")

#: What each experiment says, with numbers between bounds: (text with {}, lowest, highest).
CLOTH = {
    "needles": [("The error grows like the height to the power {}.", -2.1, -1.9), ("1e\\+00 +{}", 0, 1e-15)],
    "normal": [("K without dn/dx: off by {}", 0.1, 0.5), ("K with dn/dx +: off by {}", 0, 1e-8)],
    "mass": [("edge to the power {}.", 1.98, 2.02), (" +1 +{} +2.0e", 0, 1e-15), (" +32 +{}", 0, 1e-14)],
    "energies": [("by a power {} of", 2.97, 3.03)],
    "pull": [("1000 +1000 +{}", 2666.66, 2666.67), ("400 +1500 +1321.\\d+ +1321.\\d+ +{}", 0.6521, 0.6522)],
    "singularity": [
        ("1.0e-13 +{}", 1e-5, 1e-1), ("1.0e-13 +\\S+ +{}", 1e-13, 1e-8), ("1.0e-13 +\\S+ +\\S+ +{}", 0, 1e-15),
    ],
    "contact": [("filter: at most {} J", 0.1, 10), ("solve: at most {} J", 0, 1e-3)],
    "order": [("0.00156 +\\S+ +{}", 0.93, 1.03)],
}  # fmt: skip
SOLIDS = {
    "slivers": [
        ("The error grows like the height to the power {}.", -1.1, -0.9), ("1e\\+00 +{}", 0, 1e-15),
        ("1e-06 +\\S+ +{}", 9.99e5, 1.001e6),
    ],
    "twist": [("0.0312 +\\S+ +{}", 1.95, 2.02), ("0.0312 +\\S+ +\\S+ +\\S+ +{}", 0.98, 1.02)],
    "tone": [("0.0625 +\\+{} %", 0.16, 0.162), ("0.0625 +\\S+ % +{} %", -0.162, -0.16)],
    "squeeze": [
        ("E = {} Pa", 99999, 100001), ("nu = {} of", 0.44999, 0.45001),
        ("pushes back with {} times", 0.9999, 1), ("0.20 +{} ", 0.99, 0.993),
    ],
    "locking": [("0.3 +\\S+ +\\S+ +{}", 0.9, 0.95), ("0.499 +\\S+ +\\S+ +{}", 0.1, 0.2), ("0.499 +{}", 0.03, 0.1)],
    "descent": [
        ("Hessian of each step: {} steps", 4, 6), ("the order at the end is {}.", 1.8, 2.2),
        ("leaves {} of", 0.24, 0.31),
    ],
    "damping": [("0.00104 +\\S+ % +{}", 0.68, 0.73), ("0.00833 +\\S+ % +{}", 0.68, 0.74)],
}  # fmt: skip
MEASURED = {"cloth": CLOTH, "solids": SOLIDS}
EVERY = [(assignment, name) for assignment, found in MEASURED.items() for name in found]


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Workspaces with the reference solutions in them, by assignment."""
    made = {}
    for assignment in MEASURED:
        folder = tmp_path_factory.mktemp("w") / assignment
        workspace.start(assignment, folder)
        for file in tasks.assignment(assignment).files:
            shutil.copy(paths.solution(assignment) / file, folder / file)
        made[assignment] = workspace.find(folder)
    return made


@pytest.fixture(scope="module")
def solved(both):
    return both["cloth"]


@pytest.mark.parametrize(("assignment", "name"), EVERY)
def test_an_experiment_measures_what_is_true(both, capsys, assignment, name):
    experimenting.run(both[assignment], name)
    said = capsys.readouterr().out
    for text, low, high in MEASURED[assignment][name]:
        match = re.search(
            text.replace(".", r"\.").replace(r"\\.", ".").replace("{}", r"(-?[\d.]+(?:e[-+]\d+)?)"), said
        )
        assert match, (text, said)
        assert low <= float(match[1].rstrip(".")) <= high, said
    if name not in ("normal", "pull"):
        assert (both[assignment].folder / "runs" / "experiments" / f"{name}.png").stat().st_size > 5000


def test_a_forgotten_normal_is_seen_in_the_students_own_function(solved, tmp_path, capsys):
    folder = tmp_path / "wrong"
    shutil.copytree(solved.folder, folder)
    file = folder / "deformation_gradient.py"
    text = file.read_text(encoding="utf-8")
    answer = re.search(r"    return (.*)\n", text[text.index("def dn_dx") :])[1]
    file.write_text(text.replace(answer, f"0.0 * ({answer})"), encoding="utf-8")
    experimenting.run(workspace.find(folder), "normal")
    without, with_it = re.findall(r"off by (\S+),", capsys.readouterr().out)
    assert without == with_it


@pytest.mark.parametrize("assignment", MEASURED)
def test_every_experiment_has_a_section_a_question_and_a_row_in_the_rubric(assignment):
    names, table, source = set(MEASURED[assignment]), tasks.assignment(assignment), paths.solution(assignment)
    assert {path.stem for path in (source / "experiments").glob("*.py")} == names == set(table.written)
    text = (source / "experiments" / "README.md").read_text(encoding="utf-8")
    parts = dict(re.findall(r"^## S\d+(?:, S\d+)?: (\w+)\n(.*?)(?=^## |\Z)", text, re.M | re.S))
    rubric = (source / "rubrics.md").read_text(encoding="utf-8")
    assert set(parts) == names
    for name, part in parts.items():
        for word in ("**Measure.**", "**Derive.**", f"**Explain.** ({table.written[name].points} points)"):
            assert word in part
        assert f"muslin experiment {name}" in part
        assert f"| `{name}` | (1)" in rubric


@pytest.mark.parametrize("assignment", MEASURED)
def test_every_section_with_tasks_has_an_experiment(assignment):
    text = (paths.solution(assignment) / "experiments" / "README.md").read_text(encoding="utf-8")
    covered = {section for line in re.findall(r"^## (S.*):", text, re.M) for section in line.split(", ")}
    assert {task.section for task in tasks.assignment(assignment).tasks.values()} <= covered


@pytest.mark.parametrize("assignment", MEASURED)
def test_experiments_are_listed_in_the_order_of_the_handout(both, assignment):
    sections = [experimenting.title(path) for path in experimenting.scripts(both[assignment]).values()]
    numbers = [int(re.match(r"S(\d+)", title)[1]) for title in sections]
    assert numbers == sorted(numbers)
    assert numbers[0] == 1


def test_what_goes_wrong_is_said_in_a_sentence(solved, tmp_path):
    with pytest.raises(MuslinError, match=r"no experiment 'pul'\. Did you mean pull"):
        experimenting.run(solved, "pul")
    workspace.start("cloth", tmp_path / "stubs")
    stubs = workspace.find(tmp_path / "stubs")
    with pytest.raises(MuslinError, match="not implemented yet: dpsi_ds"):
        experimenting.run(stubs, "pull")
    script = stubs.folder / "experiments" / "pull.py"
    script.write_text("x = 1\ny = x / 0\n", encoding="utf-8")
    with pytest.raises(MuslinError, match=r"pull\.py:2: ZeroDivisionError"):
        experimenting.run(stubs, "pull")
    script.write_text("x = (\n", encoding="utf-8")
    with pytest.raises(MuslinError, match=r"pull\.py:1: SyntaxError"):
        experimenting.run(stubs, "pull")


# --- written questions -------------------------------------------------------------------------------------------

ROOM = [Submission("ada", (Student("Ada Lovelace"),), ()), Submission("bo", (Student("Bo Chen"),), ())]


def marked(tmp_path, text):
    path = tmp_path / "by hand.csv"
    path.write_text("student,task,score,reason\n" + text, encoding="utf-8")
    return overrides.read(path, ROOM, TABLE)


def test_marks_of_written_questions_come_on_top_and_have_their_columns(tmp_path):
    by_hand = marked(tmp_path, "Ada Lovelace,needles,1.5,no QR\nAda Lovelace,order,2,well said\n")
    rows = [Row(one, samples.perfect(), "", by_hand.get(one.key, ())) for one in ROOM]
    assert [row.counts for row in rows] == [103.5, 100]
    lines = list(csv.DictReader(io.StringIO(gradebook.grades_csv(rows, TABLE))))
    assert [(x["score"], x["needles"], x["order"], x["mass"]) for x in lines] == [
        ("103.5", "1.5", "2", ""), ("100", "", "", ""),
    ]  # fmt: skip
    assert "needles set by hand to 1.5: no QR" in lines[0]["notes"]
    plain = gradebook.grades_csv([Row(ROOM[0], samples.perfect())], TABLE)
    assert "needles" not in plain


def test_who_handed_in_words_only_has_their_points(tmp_path):
    by_hand = marked(tmp_path, "Bo Chen,mass,2,right\n")
    assert Row(ROOM[1], None, "no file", by_hand["bo"]).counts == 2


def test_the_record_and_the_report_show_what_was_marked(tmp_path):
    by_hand = marked(tmp_path, "Ada Lovelace,needles,1.5,no <QR>\n")
    told = Row(ROOM[0], samples.perfect(), "", by_hand["ada"]).as_it_counts()
    assert told.score == 101.5
    data = json.loads(views.render(told, "json"))
    jsonschema.validate(data, views.schema("record"))
    assert record.from_json(data).written == told.written
    assert "written" not in json.loads(views.render(samples.perfect(), "json"))
    page = views.render(told, "html")
    assert "Why a needle is worse than its rounding: 1.5 of 2. no &lt;QR&gt;" in page


@pytest.mark.parametrize(
    ("line", "problem"),
    [("Ada Lovelace,needle,1,x", "did you mean 'needles'"), ("Ada Lovelace,mass,-1,x", "no number")],
)
def test_a_wrong_line_is_named(tmp_path, line, problem):
    with pytest.raises(MuslinError, match=problem):
        marked(tmp_path, line)


def test_a_question_is_not_called_like_a_task(tmp_path):
    text = (SOURCE / "assignment.toml").read_text(encoding="utf-8")
    (tmp_path / "assignment.toml").write_text(text.replace("\nneedles = {", "\nphi = {"), encoding="utf-8")
    with pytest.raises(MuslinError, match="both called 'phi'"):
        read_assignment(tmp_path)
