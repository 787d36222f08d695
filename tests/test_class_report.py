"""What a class's results become: the table, scores set by hand, who is alike, and the page in a real browser."""

from __future__ import annotations

import base64
import csv
import dataclasses
import errno
import io
import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "benchmarks"))
import class_of_200 as large  # type: ignore[import-not-found]
import grading_samples as samples
import pytest
from test_grading_html import Page, home, in_a_browser, opened  # noqa: F401  (home is a fixture)

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes import engines, gradebook, overrides, page, reports, similarity, work
from muslin.classes.finding import Student, Submission
from muslin.classes.gradebook import Row
from muslin.classes.ledger import Ledger
from muslin.classes.overrides import Override
from muslin.classes.reports import Printed
from muslin.classes.similarity import Alike, Pair
from muslin.classes.work import Job, Result, Terms

TABLE = tasks.assignment("cloth")
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg=="
)


def row(key, name, record=None, error="", set_by_hand=(), late=False, id=""):
    return Row(Submission(key, (Student(name, id),), (), late), record, error, tuple(set_by_hand))


def hostile_class(host="http://127.0.0.1:9"):
    evil = samples.hostile(host)
    nasty = samples.nasty(host)
    mistaken = dataclasses.replace(
        nasty.tasks[0],
        checks=tuple(
            dataclasses.replace(c, status="failed", cause="evil", diagnosis=evil, advice=evil)
            for c in nasty.tasks[0].checks
        ),
    )
    return [
        row("b", "Bea", samples.mixed(), id="2"),
        row("a", evil, dataclasses.replace(nasty, tasks=(mistaken, *nasty.tasks[1:])), id=evil),
        row("c", "Cy", samples.stubs(), set_by_hand=[Override("phi", 2.5, evil)], late=True, id="10"),
        row("d", "Di", samples.perfect(), set_by_hand=[Override("", 7, "dean")], id="9"),
        row("e", "=cmd|'calc'!A1", None, evil),
    ]


def rendered(rows):
    printed = {r.key: Printed(PNG if r.key != "c" else b"", "There was <b>no run</b>.") for r in rows[:4]}
    pairs = (Pair("a", "b", 12, 0.5, ("stress.py",)),)
    return page.render(rows, TABLE, printed, Alike(pairs, {"a": ("stress.py",)}), ["<b>: a link"])


# The table -------------------------------------------------------------------------------------------------


def test_the_table_is_stable_and_no_cell_is_a_formula():
    rows = hostile_class()
    text = gradebook.grades_csv(rows, TABLE)
    assert text == gradebook.grades_csv(rows[::-1], TABLE)
    header, *lines = csv.reader(io.StringIO(text))
    assert header == ["student", "id", "score", "max", *TABLE.tasks, "late", "notes"]
    assert len(lines) == len(rows)
    assert not any(cell.startswith(tuple("=+-@\t\r\n")) for line in lines for cell in line)
    assert not any(ord(letter) < 32 for line in lines for cell in line for letter in cell)


def test_every_member_of_a_group_has_a_line():
    group = Row(Submission("g", (Student("Ann", "1"), Student("Bob", "2")), ()), samples.perfect())
    lines = list(csv.DictReader(io.StringIO(gradebook.grades_csv([group], TABLE))))
    assert [(line["student"], line["id"], line["score"]) for line in lines] == [
        ("Ann", "1", "100"), ("Bob", "2", "100"),
    ]  # fmt: skip


def test_a_score_set_by_hand_counts_and_is_told_in_every_report():
    by_hand = row("c", "Cy", samples.stubs(), set_by_hand=[Override("phi", 2.5, "oral exam")])
    assert by_hand.total == 2.5
    assert by_hand.score("phi") == 2.5
    task = by_hand.as_it_counts()["phi"]
    assert (task.score, task.status) == (2.5, "failed")
    assert task.checks[0].message == "2.5 of 5 (graded: 0). oral exam"
    assert row("d", "Di", samples.perfect(), set_by_hand=[Override("", 7, "dean")]).total == 7
    assert row("e", "Eve", None, "unreadable", [Override("", 40, "on paper")]).total == 40


# Scores set by hand ----------------------------------------------------------------------------------------

ROSTER = [
    Submission("jane-doe-1", (Student("Jane Doe", "1"),), ()),
    Submission("jane-doe-2", (Student("Jane Doe", "2"),), ()),
    Submission("jim", (Student("Jim", ""),), ()),
]


def by_hand(tmp_path, text):
    path = tmp_path / "overrides.csv"
    path.write_text(text, encoding="utf-8-sig")
    return overrides.read(path, ROSTER, TABLE)


def test_students_are_meant_by_name_number_or_key(tmp_path):
    read = by_hand(
        tmp_path,
        'Student,Task,Score,Reason,more\njim,phi,5,late bus,x\n2,,30,"a, b"\n\njane-doe-1,psi,0,copied\n',
    )
    assert read == {
        "jim": (Override("phi", 5, "late bus", 5),),
        "jane-doe-2": (Override("", 30, "a, b", 100),),
        "jane-doe-1": (Override("psi", 0, "copied", 5),),
    }


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("Jane Doe,phi,5,x", "may be jane-doe-1, jane-doe-2"),
        ("Jin,phi,5,x", "line 2: there is no student 'Jin'; did you mean 'jim'"),
        ("jim,phy,5,x", "there is no task 'phy'; did you mean 'phi'"),
        ("jim,phi,nan,x", "no number from 0"),
        ("jim,phi,inf,x", "no number from 0"),
        ("jim,phi,-1,x", "no number from 0"),
        ("jim,phi,five,x", "no number from 0"),
        ("jim,phi,5,", "no reason"),
        ("jim,phi", "neither a score nor a comment"),
        ("jim,phi,5,x\njim,phi,4,y", "line 3: this score is set in an earlier line"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_its_line(line, said, tmp_path):
    with pytest.raises(MuslinError) as error:
        by_hand(tmp_path, f"student,task,score,reason\n{line}\n")
    assert said in str(error.value)


@pytest.mark.parametrize(
    "text",
    [
        "student;task;score;reason\njim;phi;2,5;spät\n",
        "sep=;\nstudent;task;score;reason\njim;phi;2,5;spät\n",
        "student\ttask\tscore\treason\njim\tphi\t2.5\tspät\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_tables_are_read_as_spreadsheets_write_them(text, encoding, tmp_path):
    (tmp_path / "overrides.csv").write_bytes(text.encode(encoding))
    read = overrides.read(tmp_path / "overrides.csv", ROSTER, TABLE)
    assert read == {"jim": (Override("phi", 2.5, "spät", 5),)}


def test_a_bonus_counts_and_is_said_and_a_comment_changes_no_score(tmp_path):
    read = by_hand(
        tmp_path, "student,task,score,reason\njim,phi,7,elegant\njim,phi,,read this\njim,,,see me\n"
    )
    bonus = row("jim", "Jim", samples.perfect(), set_by_hand=read["jim"])
    assert (bonus.score("phi"), bonus.total) == (7, 102)
    assert bonus.notes() == [
        "phi set by hand to 7 (graded: 5), above the 5 there are: elegant", "phi: read this", "see me",
    ]  # fmt: skip
    checks = bonus.as_it_counts()["phi"].checks
    assert [check.message for check in checks[:2]] == ["7 of 5 (graded: 5). elegant", "read this"]
    comment = row("jim", "Jim", None, "unreadable", set_by_hand=read["jim"][2:])
    assert comment.total is None
    assert comment.notes() == ["not graded: unreadable", "see me"]


def test_a_table_without_the_columns_is_refused(tmp_path):
    with pytest.raises(MuslinError, match="no column score and no reason"):
        by_hand(tmp_path, "student,task,points\n")
    with pytest.raises(MuslinError, match="no column reason"):
        by_hand(tmp_path, "student,task,score\n")


# Who is alike ----------------------------------------------------------------------------------------------

STUBS = {f: (paths.assignment("cloth") / f).read_text(encoding="utf-8") for f in TABLE.files}
ODD = """
def detour(a, b):
    total = 0.0
    for i in ti.static(range(3)):
        for j in ti.static(range(3)):
            if i != j:
                total += 3.25 * a[i, j] * b[j, i] - 0.125 * a[j, j]
            else:
                total -= a[i, i] / (1.0 + b[i, i] * b[i, i])
    return total * 0.5 + ti.sqrt(ti.abs(total)) - ti.max(a[0, 0], b[1, 1])
"""


def test_a_copy_with_other_names_stands_out_and_stubs_do_not():
    renamed = ODD.replace("total", "sum_").replace("detour", "mine").replace("(a, b)", "(u, w)  # my own")
    renamed = re.sub(r"\ba\[", "u[", re.sub(r"\bb\[", "w[", renamed))
    sources = {f"s{k}": dict(STUBS) for k in range(10)}
    sources["s3"]["stress.py"] += ODD
    sources["s7"]["collision.py"] = renamed + sources["s7"]["collision.py"]
    (pair,) = similarity.pairs(sources, STUBS)
    assert (pair.first, pair.second, pair.files) == ("s3", "s7", ("stress.py",))
    assert pair.share > 0.8


def test_what_many_have_says_nothing():
    sources = {f"s{k}": STUBS | {"stress.py": STUBS["stress.py"] + ODD} for k in range(10)}
    assert similarity.pairs(sources, STUBS) == []


SOLUTION = {f: (paths.solution("cloth") / f).read_text(encoding="utf-8") for f in TABLE.files}


def test_copies_of_the_published_solution_are_named_however_many_there_are():
    sources = {f"s{k:02}": dict(STUBS) for k in range(22)}
    renamed = {file: re.sub(r"\b(n|area|s0)\b", "my_name", text) for file, text in SOLUTION.items()}
    for key in ("s03", "s08", "s13"):
        sources[key] = dict(SOLUTION)
    sources["s17"] = STUBS | {"stiffness.py": "# all my own work\n" + renamed["stiffness.py"]}
    alike = similarity.compared(sources, STUBS, SOLUTION)
    assert alike.published.keys() == {"s03", "s08", "s13", "s17"}
    assert alike.published["s17"] == ("stiffness.py",)
    assert len(alike.published["s03"]) >= 5
    assert alike.pairs == ()
    assert similarity.compared(sources, STUBS, {}).published is None


def test_right_solutions_of_ones_own_do_not_resemble_the_published_one():
    variants = [variant for variant in large.VARIANTS if variant.verdict == "right"]
    written = {variant.task: variant for variant in variants}
    sources = {"a": large.with_variants(list(written.values()))}
    assert written.keys() == set(TABLE.tasks)
    assert similarity.compared(sources, STUBS, SOLUTION).published == {}


@pytest.mark.parametrize(
    "text", ["\n" * 50_000, " \n" * 25_000, "\t" * 50_000, "a\n\n" * 16_000, "(" * 50_000]
)
def test_nothing_takes_minutes_to_compare(text):
    began = time.process_time()
    similarity.pairs({"a": {"stress.py": text}, "b": {"stress.py": text}}, STUBS)
    assert time.process_time() - began < 20


@pytest.mark.parametrize("text", ["", "def (:\n", "\x00\xff", '"""', "x = " * 500])
def test_anything_can_be_compared_and_is_no_evidence(text):
    sources = {key: STUBS | {"stress.py": STUBS["stress.py"] + ODD} for key in "ab"}
    sources |= {key: {"stress.py": text} for key in "cd"}
    assert [(pair.first, pair.second) for pair in similarity.pairs(sources, STUBS)] == [("a", "b")]


# What is on disk -------------------------------------------------------------------------------------------


def test_a_full_disk_is_said_and_nothing_else(monkeypatch, tmp_path):
    ledger = Ledger(tmp_path)

    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    with ledger.locked():
        ledger.keep(Result("a"), {})
        monkeypatch.setattr("muslin.classes.ledger.os.fsync", full)
        with pytest.raises(MuslinError, match=r"cannot be written: No space left on device\. Make room"):
            ledger.keep(Result("a", error="new"), {})
    assert ledger.take("a", {}) == Result("a")
    assert not list(tmp_path.rglob("*.new"))


def test_words_of_the_manifest_regrade_nobody_and_what_a_verdict_depends_on_everybody(monkeypatch):
    def edition(**changes):
        phi = dataclasses.replace(TABLE.tasks["phi"], **changes)
        table = dataclasses.replace(TABLE, tasks={**TABLE.tasks, "phi": phi})
        monkeypatch.setattr(tasks, "assignment", lambda name: table)
        return work.edition.__wrapped__("cloth")

    now = edition()
    assert edition(hints=("think again",), title="New", section="S9") == now
    assert edition(points=6) != now
    assert edition(arguments=TABLE.tasks["psi"].arguments) != now


# Engines ---------------------------------------------------------------------------------------------------


def test_one_that_fails_never_stops_the_rest():
    def function(terms, job):
        if job.key == "2":
            raise RuntimeError("lost\nmore")
        return Result(job.key, error="fine")

    with engines.local(2) as (pool, width, _):
        jobs = (Job(str(k), None) for k in range(5))
        found = {r.key: r for r in engines.results(pool, width, function, Terms("cloth", ""), jobs)}
    assert found.keys() == set("01234")
    assert found["2"].error == "Its worker was lost: RuntimeError: lost"
    assert not found["2"].final


def test_no_scheduler_is_said_in_one_line(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(engines, "ANSWER", 1.0)
    with (
        pytest.raises(MuslinError, match=r"No Dask scheduler answers at tcp://127\.0\.0\.1:9"),
        engines.cluster("tcp://127.0.0.1:9"),
    ):
        pass


@pytest.mark.parametrize(
    "code", ["import time; time.sleep(60)", "import os; os._exit(3)", "print('no answer')"]
)
def test_a_drawing_that_hangs_or_dies_costs_a_picture_only(code, monkeypatch, tmp_path):
    monkeypatch.setattr(reports, "python", lambda module: [sys.executable, "-c", code])
    monkeypatch.setattr(reports, "FIRST", 1.0)
    rows = [row(str(k), "Jane", samples.mixed()) for k in range(4)]
    done = []
    made = reports.make(tmp_path, rows, done.append)
    assert done == [1, 2, 3, 4]
    for key, printed in made.items():
        assert printed == Printed(b"", "Drawing it took too long or failed.")
        assert not Page((tmp_path / f"reports/{key}.html").read_text(encoding="utf-8")).open
        assert not (tmp_path / f"pictures/{key}.png").exists()


# The page --------------------------------------------------------------------------------------------------


def test_the_page_is_closed_and_loads_nothing():
    text = rendered(hostile_class())
    parsed = Page(re.sub(r"<input[^>]*>", "", text))
    assert not parsed.open
    assert len(parsed.all("script")) == 1
    for tag, attributes in parsed.tags:
        assert not any(name.startswith("on") for name in attributes), tag
    for link in parsed.all("a"):
        assert re.fullmatch(r"#[a-z]+|reports/[a-z0-9-]+\.html", link["href"])
    assert all(image["src"].startswith("data:image/png;base64,") for image in parsed.all("img"))
    assert "resembles the published solution in stress.py" in text
    assert "&lt;b&gt;: a link" in text
    policy = parsed.all("meta")[1]["content"]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    ids = [attributes["id"] for _, attributes in parsed.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert {a["href"][1:] for a in parsed.all("a") if a["href"].startswith("#")} <= set(ids)


def test_a_class_without_anything_still_has_a_page():
    assert not Page(
        re.sub(r"<input[^>]*>", "", page.render([row("e", "Eve", None, "no")], TABLE, {}, Alike()))
    ).open


#: Presses headings and types into the filter when the page has loaded; says in which order students stand.
PROBE = """
addEventListener("load", () => {
  const order = () => [...document.querySelectorAll(".sortable tbody tr")].filter((r) => !r.hidden)
    .map((r) => (r.querySelector("th a")?.getAttribute("href") ?? "e").replace(/reports.(.).html/, "$1")).join("");
  const press = (k) => document.querySelectorAll(".sortable thead button")[k].click();
  const said = [order()];
  for (const k of [0, 0, 1, 2, 2]) { press(k); said.push(order()); }
  const fields = document.querySelector("#filter").elements;
  const ask = (name, value) => { fields[name].value = value; fields[name].dispatchEvent(new Event("input")); };
  ask("text", "BEA"); said.push(order()); ask("text", "");
  for (const kind of ["late", "hand", "failed", "whole"]) {
    ask("kind", kind); said.push(order() + "=" + fields.shown.value[0]);
  }
  ask("kind", ""); ask("task", "0"); ask("stand", "full"); said.push(order()); ask("task", ""); ask("stand", "");
  const grades = document.querySelector(".scroll.grades");
  grades.style.maxHeight = "80px"; const low = grades.clientHeight; grades.style.maxHeight = "";
  fields.tall.click();
  said.push("tall:" + (low <= 80 && grades.clientHeight >= grades.querySelector("table").offsetHeight));
  said.push("hacked:" + String(window.hacked), "scripts:" + document.scripts.length);
  said.push("pictures:" + [...document.images].filter((i) => i.complete && i.naturalWidth).length);
  said.push("wide:" + (document.documentElement.scrollWidth > innerWidth));
  document.documentElement.setAttribute("data-probe", said.join(" "));
});
"""


@in_a_browser
def test_in_a_browser_it_sorts_and_nothing_else_runs_or_loads(home, tmp_path):  # noqa: F811
    import hashlib

    address, requests = home
    text = rendered(hostile_class(address)).replace('loading="lazy" ', "")
    digest = base64.b64encode(hashlib.sha256(PROBE.encode()).digest()).decode()
    probed = text.replace("script-src ", f"script-src 'sha256-{digest}' ", 1)
    probed = probed.replace("</head>", f"<script>{PROBE}</script></head>", 1)
    dom, console = opened(probed, tmp_path)
    said = re.search(r'data-probe="([^"]*)"', dom)[1].split()
    names, backwards, again, by_id, by_points, most_first, found = said[:7]
    assert names == "bacde"  # as given
    assert backwards == again[::-1]  # the heading says ascending from the start
    assert by_id.index("b") < by_id.index("d") < by_id.index("c")  # 2, 9, 10: numbers within text
    assert by_points.endswith("e")  # without a score: last,
    assert most_first.endswith("e")  # either way
    assert by_points[:4] == most_first[:4][::-1]
    assert found == "b"
    assert [sorted(kind[:-2]) for kind in said[7:11]] == [["c"], ["c", "d"], ["e"], []]
    assert [kind[-1] for kind in said[7:11]] == ["1", "2", "1", "0"]
    assert sorted(said[11]) == ["b", "d"]  # the first task is right in these
    assert said[12] == "tall:true"
    assert said[13:] == ["hacked:undefined", "scripts:2", "pictures:3", "wide:false"]
    assert console == []
    assert requests == []


@in_a_browser
def test_the_page_as_it_is_has_no_error(home, tmp_path):  # noqa: F811
    address, requests = home
    dom, console = opened(rendered(hostile_class(address)), tmp_path)
    assert 'id="filter">' in dom  # the script ran: the filter is there
    assert console == []
    assert requests == []
