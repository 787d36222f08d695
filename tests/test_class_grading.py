"""A small class through the command line: killed twice, gone on, then on a cluster; nothing lost or repeated."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "benchmarks"))
import class_of_200 as large  # type: ignore[import-not-found]

from muslin.base.errors import MuslinError
from muslin.classes import work
from muslin.classes.ledger import Ledger

DEADLINE = ("--deadline", "10")


def partial(task: str, body: str = "", added: str = "", pack: str = "folder", gradable: bool = True):
    """The stubs with one file of the solution, and in that one function that may be wrong."""
    file = large.TABLE.tasks[task].file
    text, lost = large.SOLUTION[file], set(large.MOST) - large.of(file)
    if body:
        arguments = ", ".join(value.name for value in large.TABLE.tasks[task].arguments)
        text = large.suite.replaced(text, task, f"@ti.func\ndef {task}({arguments}):\n{body}") + added
        lost |= {task}
    kind = f"{task}: {body[:30] or pack}"
    return lambda draw: large.Made(kind, large.STUBS | {file: text}, lost, pack, gradable)


def unfolded(text):
    """What was printed, whatever the width."""
    return " ".join(text.split())


def stubs(draw):
    return large.Made("stubs", dict(large.STUBS), set(large.MOST))


def broken(draw):
    return large.Made("syntax", large.STUBS | {"stress.py": "def (:\n"}, set(large.MOST))


#: Small, so that a grading is quick: a class of one right file, mistakes and attacks.
MAKING = [
    partial("mass_block"),
    partial("interpolate", pack="cut", gradable=False),
    partial("right_cauchy_green", "    return F @ F.transpose()\n"),
    partial("sphere_contact", *large.ATTACKS["exit"][1:2], "\n\n" + large.ATTACKS["exit"][2]),
    partial("d2psi_dFij", "    return 0.0 * U\n", pack="zip"),
    broken,
    stubs,
    partial("nodal_force", "    return P @ grad_phi\n", pack="zip"),
]


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A class, its submissions and the report of a run that was killed twice."""
    home = tmp_path_factory.mktemp("class")
    (home / "submissions").mkdir()
    made = large.generate(home / "submissions", iter(MAKING))
    run = large.command(home / "submissions", home / "report", *DEADLINE)
    large.killed_after(2, run, home / "report", 200)
    half = large.journal(home / "report")
    large.killed_after(5, run, home / "report", 200)
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return home, made, half, done


def test_killed_twice_no_verdict_is_wrong_lost_or_repeated(room):
    home, made, half, done = room
    large.check(home / "report", made)
    assert large.journal(home / "report")[: len(half)] == half
    assert f"{len(made) - 1} graded, 1 could not be." in done.stdout
    assert "of them graded already" in done.stderr


def test_what_cannot_be_read_is_named_with_its_reason(room):
    home, _, _, done = room
    assert re.search(
        r" 002 [^:]*: 002 [^:]*\.zip cannot be opened: it is damaged or was cut off", unfolded(done.stdout)
    )
    page = (home / "report/index.html").read_text(encoding="utf-8")
    assert "Not graded" in page
    assert "damaged or was cut off" in page


def test_a_cluster_says_the_same_to_the_last_byte(room):
    pytest.importorskip("distributed")
    home, made, _, _ = room
    with large.cluster() as address:
        run = large.command(home / "submissions", home / "cluster", *DEADLINE, "--scheduler", address)
        done = subprocess.run(run, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    large.check(home / "cluster", made)
    assert (home / "cluster/grades.csv").read_bytes() == (home / "report/grades.csv").read_bytes()


def test_what_is_graded_is_not_graded_again_and_scores_set_by_hand_stay(room):
    home, made, _, _ = room
    before = (home / "report/grades.csv").read_bytes()
    student = next(name for name, submission in made.items() if submission.kind == "stubs")
    (home / "by hand.csv").write_text(
        f"student,task,score,reason\n{student},phi,2.5,shown in office hours <b>\n"
        f"{next(iter(made))},,50,agreed with the dean\n",
        encoding="utf-8",
    )
    run = large.command(home / "submissions", home / "report", *DEADLINE)
    for _ in range(2):
        subprocess.run([*run, "--overrides", str(home / "by hand.csv")], check=True, capture_output=True)
        with open(home / "report/grades.csv", encoding="utf-8", newline="") as stream:
            rows = {row["student"]: row for row in csv.DictReader(stream)}
        assert (rows[student]["phi"], rows[student]["score"]) == ("2.5", "2.5")
        assert "phi set by hand to 2.5 (graded: 0): shown in office hours" in rows[student]["notes"]
        assert rows[next(iter(made))]["score"] == "50"
    key = next(
        entry["key"] for entry in large.journal(home / "report") if entry["key"].startswith(student[:3])
    )
    for page in (home / "report/index.html", home / f"report/reports/{key}.html"):
        assert "set by hand" in page.read_text(encoding="utf-8")
        assert "office hours &lt;b&gt;" in page.read_text(encoding="utf-8")
    subprocess.run(run, check=True, capture_output=True)
    assert (home / "report/grades.csv").read_bytes() == before
    large.check(home / "report", made)


def test_the_roster_comes_back_and_the_rules_count_and_nobody_is_graded_again(room):
    home, made, _, _ = room
    students = list(made)
    lines = [
        "Name,Email,score",
        *(f'"{name}",s{k}@example.edu,' for k, name in enumerate(students)),
        "Absent,a@x,",
    ]
    (home / "roster.csv").write_text("\ufeff" + "\r\n".join(lines) + "\r\n", encoding="utf-8")
    zipped = next(name for name, submission in made.items() if submission.kind.startswith("mass_block"))
    (home / "class.toml").write_text(
        "[late]\ndeadline = 2026-03-02T23:59:00Z\npercent-per-day = 10\n"
        f"[late.handed-in]\n{json.dumps(zipped, ensure_ascii=False)} = 2026-03-04T12:00:00Z\n",
        encoding="utf-8",
    )
    before, journal = (home / "report/grades.csv").read_bytes(), large.journal(home / "report")
    graded = {row["student"]: row["score"] for row in csv.DictReader(before.decode().splitlines())}
    run = large.command(home / "submissions", home / "report", *DEADLINE)
    asked = ("--roster", str(home / "roster.csv"), "--rules", str(home / "class.toml"), "--missing", "0")
    done = subprocess.run([*run, *asked], capture_output=True, text=True, check=True)
    assert large.journal(home / "report") == journal
    expected = {**graded, zipped: f"{float(graded[zipped]) * 0.8:g}"}
    cells = [f'"{name}",s{k}@example.edu,{expected[name]}' for k, name in enumerate(students)]
    filled = "\ufeff" + "\r\n".join([lines[0], *cells, "Absent,a@x,0"]) + "\r\n"
    assert (home / "report/upload/roster.csv").read_bytes().decode() == filled
    assert "On the roster, handed in nothing: 1. Absent" in unfolded(done.stdout)
    assert "handed in, and has no score: 002" in unfolded(done.stdout)
    assert "roster.csv" in unfolded(done.stdout).split("Ready to upload: ")[1]
    rows = {
        row["student"]: row
        for row in csv.DictReader((home / "report/grades.csv").read_text("utf-8").splitlines())
    }
    assert rows[zipped]["before late"] == graded[zipped]
    assert "late by 1 day 12 h 1 min" not in rows[zipped]["notes"]  # two units are enough
    assert "late by 1 day 12 h (2 days at 10%)" in rows[zipped]["notes"]
    page = (home / "report/index.html").read_text(encoding="utf-8")
    assert "On the roster, handed in nothing: 1" in page
    assert "Before late" in page
    subprocess.run(run, check=True, capture_output=True)
    assert (home / "report/grades.csv").read_bytes() == before


def test_half_written_and_foreign_results_are_not_taken(room, tmp_path):
    home, *_ = room
    ledger = Ledger(home / "report")
    key = large.journal(home / "report")[0]["key"]
    path = home / f"report/records/{key}.json"
    whole = path.read_bytes()
    stamp = json.loads(whole)["stamp"]
    assert ledger.take(key, stamp) is not None
    assert ledger.take(key, stamp | {"submission": "other"}) is None
    other = Ledger(tmp_path)
    for text in (whole[: len(whole) // 2], b"", b"[]", whole.replace(b'"key"', b'"kez"', 1)):
        (tmp_path / f"records/{key}.json").write_bytes(text)
        assert other.take(key, stamp) is None


def test_two_runs_on_one_report_refuse_each_other_until_one_is_killed(tmp_path):
    report = tmp_path / "report"
    holder = subprocess.Popen(
        [sys.executable, "-c", "import sys, time, pathlib\nfrom muslin.classes.ledger import Ledger\n"
         "with Ledger(pathlib.Path(sys.argv[1])).locked():\n    print('held', flush=True)\n    time.sleep(60)",
         str(report)],
        stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(MuslinError, match=f"process {holder.pid}"), Ledger(report).locked():
            pass
    finally:
        holder.send_signal(signal.SIGKILL)
        holder.wait()
    with Ledger(report).locked():
        assert (report / ".lock").read_text() == str(os.getpid())


def test_what_lies_in_the_working_folder_is_not_imported(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("numpy", "muslin"):
        (tmp_path / f"{name}.py").write_text("import os\nos._exit(7)\n")
    *head, code = work.python("muslin.classes.work:main")
    code = code.replace("main()", "import numpy; print(numpy.__file__)")
    said = subprocess.run([*head, code], capture_output=True, text=True, check=True).stdout
    assert str(tmp_path) not in said


def test_a_worker_ends_with_whoever_started_it():
    code = (
        "import subprocess, time\nfrom muslin.base.child import python\n"
        "p = subprocess.Popen(python('muslin.classes.work:main'), stdin=subprocess.PIPE)\n"
        "print(p.pid, flush=True)\ntime.sleep(60)"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    worker = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    until = time.monotonic() + 20
    while time.monotonic() < until and Path(f"/proc/{worker}").exists():
        time.sleep(0.1)
    assert not Path(f"/proc/{worker}").exists()


def test_a_class_of_which_nothing_can_be_graded_is_an_error(tmp_path):
    (tmp_path / "class").mkdir()
    (tmp_path / "class/liar.zip").write_text("no zip")
    done = subprocess.run(
        large.command(tmp_path / "class", tmp_path / "report"), capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    said = "None of 1 submissions could be graded. The first: liar.zip cannot be opened: it is neither a zip nor a tar"
    assert f"muslin: {said}" in unfolded(done.stderr)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--jobs", "2", "--scheduler", "tcp://127.0.0.1:9"), "Leave out --jobs"),
        (("--hidden", "nowhere"), "holds no hidden reference data"),
        (("--overrides", "nowhere.csv"), "nowhere.csv cannot be read"),
        (("--assignment", "silk"), "silk"),
    ],
)
def test_what_a_person_got_wrong_is_said_before_anything_is_graded(more, said, tmp_path):
    (tmp_path / "class/Jane").mkdir(parents=True)
    run = large.command(tmp_path / "class", tmp_path / "report", *more)
    done = subprocess.run(run, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1
    assert said in unfolded(done.stderr)
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "report/journal.jsonl").exists()
