"""Views of a record: every format is valid, says the same, and is harmless whatever a submission wrote."""

import csv
import dataclasses
import html
import io
import json
import math
import re
import subprocess
import sys
import unicodedata
from xml.etree import ElementTree as xml

import grading_samples as samples
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.base.errors import MuslinError
from muslin.grading import views
from muslin.grading.record import FAILED, PASSED, Record, from_json
from muslin.grading.views import classroom50
from muslin.grading.views.grades_csv import cell
from muslin.grading.views.text import capped, half_up, one_line, points, visible

jsonschema = pytest.importorskip("jsonschema", reason="jsonschema, of the test extra, is not installed")

OPTIONS = {"html": {"quality": "none"}}
SCHEMA_OF = {
    "json": "record",
    "gradescope": "gradescope",
    "exercism": "exercism",
    "classroom50": "classroom50",
}


@pytest.fixture(scope="module", params=samples.SAMPLES)
def record(request) -> Record:
    return samples.SAMPLES[request.param]()


def rendered(record: Record, format: str, **options) -> str:
    return views.render(record, format, **(options or OPTIONS.get(format, {})))


def loaded(record: Record, format: str, **options):
    return json.loads(rendered(record, format, **options), parse_constant=pytest.fail)


def valid(data, name: str) -> None:
    schema = views.schema(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(data)


# All formats -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("format", SCHEMA_OF)
def test_every_format_obeys_its_schema(record, format):
    told = loaded(record, format)
    assert told
    valid(told, SCHEMA_OF[format])


@pytest.mark.parametrize("format", views.FORMATS)
def test_the_same_record_gives_the_same_text(record, format):
    options = {"context": {"datetime": "2026-01-02T03:04:05Z"}} if format == "classroom50" else {}
    assert rendered(record, format, **options) == rendered(record, format, **options)


@pytest.mark.parametrize("format", views.FORMATS)
def test_a_view_is_written_where_its_platform_looks_for_it(record, format, tmp_path):
    path = views.write(record, format, tmp_path / "new" / "folder", **OPTIONS.get(format, {}))
    assert path == tmp_path / "new" / "folder" / views.FORMATS[format][1]
    assert path.read_bytes().decode("utf-8")


@pytest.mark.parametrize("format", views.FORMATS)
def test_no_text_of_a_submission_brings_control_characters(format):
    text = rendered(samples.nasty(), format)
    bad = {c for c in text if c not in "\n\t" and unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp")}
    bad |= set(text) & set("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufffe\uffff")
    assert bad <= ({"\r"} if format == "csv" else set())
    assert text.replace("\r\n", "\n").count("\r") == 0


@pytest.mark.parametrize("format", ["terminal", "gradescope", "exercism", "junit", "html"])
def test_a_huge_output_does_not_make_a_huge_report(format):
    assert len(rendered(samples.nasty(), format)) < 1_500_000


@pytest.mark.parametrize("format", ["terminal", "gradescope", "junit", "html"])
def test_seed_safety_versions_and_notes_are_in_every_format_with_room_for_them(format):
    text = rendered(samples.mixed(), format)
    for said in (
        "5d41402abc4b2a76",
        "process",
        "1.7.4",
        "solution.pyc was in the archive",
        "no user namespaces",
    ):
        assert said in text


@pytest.mark.parametrize("format", ["terminal", "gradescope", "exercism", "junit", "html"])
def test_a_failed_public_check_shows_numbers_mistake_next_step_and_section(format):
    text = rendered(samples.mixed(), format).replace("\\n", "\n")
    for said in (
        "worst case 17", "relative error 1.0e+00", "yours    = [[-663.556", "expected = [[663.556",
        "the right one with the opposite sign", "The minus belongs to the force", "S7", "public cases",
    ):  # fmt: skip
        assert said in text


@pytest.mark.parametrize("format", ["terminal", "gradescope", "exercism", "junit", "html"])
def test_a_message_without_end_does_not_hide_the_advice(format):
    table = list(samples.ASSIGNMENT.tasks.values())
    task = samples.wrong(
        table[0], message="numbers " * 50_000, output="printed " * 50_000, advice="Look at the sign."
    )
    notes = tuple(f"left out file {k}" for k in range(5000))
    record = samples.record([task], samples.NO_SIMULATION, notes=notes)
    text = rendered(record, format)
    assert "Look at the sign." in text
    assert "printed printed" in text
    assert len(text) < 60_000


@pytest.mark.parametrize("format", ["terminal", "gradescope", "exercism", "junit", "html"])
def test_a_failed_hidden_check_shows_its_category(format):
    assert "wrong where two stretches are nearly equal" in rendered(samples.mixed(), format)


@pytest.mark.parametrize("format", ["terminal", "gradescope", "exercism", "junit", "html"])
def test_a_stub_is_said_calmly(format):
    text = rendered(samples.stubs(), format)
    assert text.lower().count("not implemented yet") >= 17
    assert not re.search(r"not right yet|cannot be run|<error|\"error\"", text)


def test_views_but_for_pictures_do_not_need_taichi():
    code = "import sys, muslin.grading.views; sys.exit('taichi' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_an_unknown_format_is_refused_with_a_list(tmp_path):
    with pytest.raises(MuslinError, match="There is: terminal, json, gradescope"):
        views.render(samples.stubs(), "pdf")
    with pytest.raises(MuslinError, match="no report format 'pdf'"):
        views.write(samples.stubs(), "pdf", tmp_path)
    with pytest.raises(MuslinError, match="no schema"):
        views.schema("junit")


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(MuslinError, match="cannot be written"):
        views.write(samples.stubs(), "csv", tmp_path / "file")


# The record ------------------------------------------------------------------------------------------------


def test_a_record_comes_back_from_its_json(record):
    again = from_json(json.loads(json.dumps(record.as_json())))
    assert again.as_json() == record.as_json() or "NaN" in json.dumps(record.as_json())
    if record.submission.name in ("ada.zip", "ada-lovelace.zip", "stubs"):
        assert from_json(loaded(record, "json")) == record


def test_the_json_is_ascii_without_infinities():
    text = rendered(samples.nasty(), "json")
    assert text.isascii()
    assert not re.search(r"\b(NaN|Infinity)\b", text)
    data = json.loads(text)
    assert data["tasks"][0]["checks"][1]["error"] is None
    assert data["simulation"]["energies"][-1] == [0.25, None, None, 1e300]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: data.pop("seed"),
        lambda data: data.update(extra=1),
        lambda data: data["tasks"][0].update(status="maybe"),
        lambda data: data["tasks"][0]["checks"][0].update(layer="secret"),
        lambda data: data["tasks"][0]["checks"][2].update(case=4),
        lambda data: data["simulation"]["positions"][0].pop(),
        lambda data: data["environment"].update(host="here"),
        lambda data: data.update(schema="muslin/record/v2"),
        lambda data: data["submission"].update(sha256="?"),
    ],
)
def test_the_record_schema_is_strict(spoil):
    data = loaded(samples.perfect(), "json")
    spoil(data)
    with pytest.raises(jsonschema.ValidationError):
        valid(data, "record")


# Gradescope ------------------------------------------------------------------------------------------------


def test_gradescope_gets_one_test_per_task_and_the_simulation_for_nothing(record):
    data = loaded(record, "gradescope")
    *tasks, simulation = data["tests"]
    assert [test["name"].split(":")[0] for test in tasks] == [task.name for task in record.tasks]
    assert (simulation["score"], simulation["max_score"], simulation["number"]) == (0, 0, "10.1")
    assert math.isclose(sum(test["score"] for test in data["tests"]), data["score"], abs_tol=1e-9)
    assert sum(test["max_score"] for test in data["tests"]) == record.max_score == 100
    numbers = [tuple(int(part) for part in test["number"].split(".")) for test in data["tests"]]
    assert numbers == sorted(set(numbers))
    assert numbers[0] == (1, 1)
    assert [test["status"] == "passed" for test in tasks] == [task.status == PASSED for task in record.tasks]
    assert data["extra_data"]["schema"] == "muslin/record/v1"
    assert data["extra_data"]["seed"] == one_line(record.seed)
    assert data["extra_data"]["sha256"] == record.submission.sha256


def test_gradescope_shows_student_text_as_text_only(record):
    data = loaded(record, "gradescope")
    formats = [data[key] for key in ("output_format", "test_output_format", "test_name_format")]
    formats += [test[key] for test in data["tests"] for key in ("output_format", "name_format")]
    assert set(formats) == {"text"}
    assert data["stdout_visibility"] == "hidden"
    assert all(len(test["output"]) <= 10_000 for test in data["tests"])


def test_gradescope_visibility_can_be_chosen():
    data = loaded(samples.mixed(), "gradescope", visibility="after_due_date")
    valid(data, "gradescope")
    assert {test["visibility"] for test in data["tests"]} == {"after_due_date"}


def test_a_skipped_simulation_is_not_failed_on_gradescope():
    data = loaded(samples.skipped(), "gradescope")
    assert data["tests"][-1]["status"] == "passed"
    assert data["tests"][-1]["output"].startswith("Skipped.")


# Exercism --------------------------------------------------------------------------------------------------


def test_exercism_links_each_test_to_its_task(record):
    data = loaded(record, "exercism")
    assert [test["task_id"] for test in data["tests"] if "task_id" in test] == list(range(1, 18))
    assert len(data["tests"]) == 17 + (record.simulation.status != "skipped")
    for test in data["tests"]:
        assert len(test.get("output", "")) <= 500
        assert len(test.get("message", "")) <= 65_535


def test_exercism_cuts_with_a_note():
    test = loaded(samples.nasty(), "exercism")["tests"][0]
    assert len(test["output"]) == 500
    assert test["output"].endswith("[Output was truncated. Please limit to 500 chars.]")


@pytest.mark.parametrize(
    ("sample", "status"), [("perfect", "pass"), ("stubs", "fail"), ("mixed", "fail"), ("skipped", "fail")]
)
def test_exercism_status(sample, status):
    assert loaded(samples.SAMPLES[sample](), "exercism")["status"] == status


def test_exercism_calls_it_an_error_only_if_nothing_ran():
    record = samples.record(
        [samples.broken(t) for t in samples.ASSIGNMENT.tasks.values()], samples.NO_SIMULATION
    )
    data = loaded(record, "exercism")
    valid(data, "exercism")
    assert data["status"] == "error"
    assert "Name 'cross' is not defined" in data["message"]


# Classroom 50 ----------------------------------------------------------------------------------------------


def test_classroom50_has_its_keys_and_no_others():
    asked = (
        "schema classroom assignment assignment_type owner submission commit release review datetime score max-score"
        " tests"
    )
    data = loaded(samples.mixed(), "classroom50")
    assert list(data) == asked.split()
    assert all(list(test) == ["test-name", "passed", "score", "max-score"] for test in data["tests"])


def test_classroom50_takes_what_only_the_platform_knows():
    runner = {
        "CLASSROOM": "geometry",
        "OWNER": "ada",
        "COMMIT_URL": "https://example.org/c/1",
        "HOME": "/root",
    }
    context = {**classroom50.context_of(runner), "graded_at": "2026-01-02T03:04:05Z"}
    data = loaded(samples.mixed(), "classroom50", context=context)
    valid(data, "classroom50")
    assert (data["classroom"], data["owner"], data["graded_at"]) == (
        "geometry",
        "ada",
        "2026-01-02T03:04:05Z",
    )
    assert data["review"] == data["commit"] == "https://example.org/c/1"
    assert "/root" not in data.values()


def test_classroom50_rounds_the_total_and_its_tests_sum_to_it(record):
    data = loaded(record, "classroom50")
    assert data["score"] == half_up(record.score) == sum(test["score"] for test in data["tests"])
    assert data["max-score"] == 100
    for test, task in zip(data["tests"], record.tasks, strict=True):
        assert abs(test["score"] - task.score) < 1
        assert test["passed"] == (task.status == PASSED)


@pytest.mark.parametrize(
    ("values", "whole"),
    [
        ([0.5], [1]), ([0.49], [0]), ([0.5, 0.5], [1, 0]), ([2.5, 3.0, 1.5], [3, 3, 1]), ([0.1] * 10, [1] + [0] * 9),
        ([], []),
    ],
)  # fmt: skip
def test_whole_points_keep_the_sum(values, whole):
    assert classroom50.whole(values) == whole


# JUnit -----------------------------------------------------------------------------------------------------

#: Element -> (its attributes, its children in order).
JUNIT = {
    "testsuites": ({"name", "tests", "failures", "errors", "skipped", "time"}, ["testsuite"]),
    "testsuite": ({"name", "tests", "failures", "errors", "skipped", "time"}, ["properties", "testcase"]),
    "properties": (set(), ["property"]),
    "property": ({"name", "value"}, []),
    "testcase": ({"classname", "name", "time"}, ["skipped", "error", "failure", "system-out"]),
    "failure": ({"message", "type"}, []),
    "error": ({"message", "type"}, []),
    "skipped": ({"message"}, []),
    "system-out": (set(), []),
}


def test_junit_has_the_shape_and_the_counts_ci_systems_expect(record):
    root = xml.fromstring(rendered(record, "junit").encode())
    for element in root.iter():
        attributes, children = JUNIT[element.tag]
        assert set(element.attrib) == attributes
        order = [children.index(child.tag) for child in element]
        assert order == sorted(order)
    (suite,) = root
    cases = suite.findall("testcase")
    assert len(cases) == int(suite.get("tests")) == int(root.get("tests")) == len(record.tasks) + 1
    for tag, count in (("failure", "failures"), ("error", "errors"), ("skipped", "skipped")):
        assert len(list(suite.iter(tag))) == int(suite.get(count)) == int(root.get(count))
    assert all(float(case.get("time")) >= 0 for case in cases)


def test_junit_carries_hostile_text_as_text():
    root = xml.fromstring(rendered(samples.nasty(), "junit").encode())
    failure = next(root.iter("failure"))
    assert "<script>window.hacked=1" in failure.text
    assert r"\x1b[2J" in failure.text
    assert r"\ud800" in failure.text


def test_a_skipped_simulation_is_skipped_in_junit():
    suite = xml.fromstring(rendered(samples.skipped(), "junit"))[0]
    assert (suite.get("skipped"), suite.get("failures"), suite.get("errors")) == ("1", "2", "0")


# CSV -------------------------------------------------------------------------------------------------------


def test_csv_is_a_header_and_one_row(record):
    rows = list(csv.reader(io.StringIO(rendered(record, "csv"))))
    assert len(rows) == 2
    header, row = rows
    assert header == ["name", "score", "max", *samples.ASSIGNMENT.tasks, "seed", "sha256"]
    assert len(row) == len(header)
    assert float(row[1]) == record.score
    assert [float(value) for value in row[3:-2]] == [task.score for task in record.tasks]
    assert not any(value.startswith(tuple("=+-@\t\r\n")) for value in row)


@pytest.mark.parametrize("begin", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", " =1", "＝1+1"])
def test_no_cell_begins_like_a_formula(begin):
    assert cell(begin).startswith("'")
    assert cell(f"a{begin}").startswith("a")


@pytest.mark.parametrize("text", ["late;=1+1", "a; b ; =1", 'a;"=1+1', 'a;" -1', ";＠SUM(A1)", "=1;+2;-3"])
def test_no_cell_begins_like_a_formula_where_semicolons_separate(text):
    row = io.StringIO()
    csv.writer(row).writerow(["first", cell(text), "last"])
    for split in (row.getvalue().split(";"), next(csv.reader([row.getvalue()], delimiter=";"))):
        assert not any(value.lstrip(' "').startswith(tuple("=+-@＝＋－＠")) for value in split)


def test_quotes_and_line_ends_stay_inside_their_cell():
    record = samples.stubs()
    name = 'Lovelace, "Ada";\r\nscore,100\n'
    record = dataclasses.replace(record, submission=dataclasses.replace(record.submission, name=name))
    header, row = csv.reader(io.StringIO(rendered(record, "csv")))
    assert row[0] == r'Lovelace, "Ada";\nscore,100\n'
    assert len(row) == len(header)


# Terminal --------------------------------------------------------------------------------------------------


def test_terminal_is_plain_unless_asked(record):
    plain, coloured = rendered(record, "terminal"), rendered(record, "terminal", colour=True)
    assert "\x1b" not in plain
    assert re.sub(r"\x1b\[\d+m", "", coloured) == plain
    assert re.sub(r"\x1b\[\d+m", "", coloured).count("\x1b") == 0


def test_no_line_of_a_submission_gives_orders_to_a_ci_system():
    orders = "first\n::error::forged\n  ::set-output name=a::b\n##[error]forged\n##vso[task.complete;]x"
    table = list(samples.ASSIGNMENT.tasks.values())
    record = samples.record(
        [samples.wrong(table[0], message=orders, output=orders)], samples.NO_SIMULATION, "::stop::x"
    )
    text = rendered(record, "terminal")
    assert not re.search(r"^\s*::|##\w*\[", text, re.MULTILINE)
    assert r"\x3a\x3aerror" in text


def test_a_submission_cannot_leave_its_margin():
    forged = "fine\r\n  1.1  passed   5 / 5  phi\n\x1b[1A\x1b[2K100 of 100 points"
    task = samples.wrong(samples.ASSIGNMENT.tasks["phi"], output=forged, message=f"x\n{forged}")
    lines = rendered(samples.record([task], samples.NO_SIMULATION), "terminal").split("\n")
    assert [line for line in lines if line.startswith("   1.1")] == [
        line for line in lines if "not right yet" in line and "phi" in line
    ]
    assert all(line.startswith("          ") for line in lines if " 5 / 5" in line or "100 of 100" in line)


# Text ------------------------------------------------------------------------------------------------------


def test_control_characters_are_written_out():
    assert visible("a\x1b[31m\x07\x9b\u202e\u2069\ud800\r\nb\rc\td") == (
        r"a\x1b[31m\x07\x9b\u202e\u2069\ud800" + "\n" + r"b\x0dc" + "\td"
    )
    assert visible("Ångström, 布, 🙂, λ = 1") == "Ångström, 布, 🙂, λ = 1"


def test_a_cut_text_says_so_and_keeps_the_limit():
    text = capped("x" * 1000, 100)
    assert len(text) == 100
    assert text.endswith("[cut here: 900 more characters]")
    assert capped("x" * 100, 100) == "x" * 100
    assert len(capped("\x1b" * 100, 100)) == 100
    assert len(one_line("\n" * 500)) == 200


#: Any text at all, halves of surrogate pairs included.
ANYTHING = st.text(st.characters(exclude_categories=()))


@given(ANYTHING, st.integers(60, 300))
def test_any_text_becomes_visible_short_and_legal(text, limit):
    shown = capped(text, limit)
    assert len(shown) <= limit
    assert shown == visible(shown)
    assert shown.encode("utf-8") is not None
    assert xml.fromstring(f"<a>{html.escape(shown)}</a>").text in (shown, None)


@given(ANYTHING)
def test_any_name_is_one_cell_that_is_no_formula(text):
    row = io.StringIO(newline="")
    csv.writer(row, quoting=csv.QUOTE_NONNUMERIC).writerow([cell(text), 1.0])
    ((name, one),) = csv.reader(io.StringIO(row.getvalue(), newline=""))
    assert one == "1.0"
    assert not name.lstrip(" ").startswith(tuple("=+-@\t\r\n"))


@pytest.mark.parametrize(
    ("value", "text"), [(5.0, "5"), (2.5, "2.5"), (0.75, "0.75"), (0.0, "0"), (100.0, "100")]
)
def test_points_are_written_as_people_do(value, text):
    assert points(value) == text


@pytest.mark.parametrize(("value", "whole"), [(0.5, 1), (1.5, 2), (2.5, 3), (2.4999, 2), (0.0, 0)])
def test_a_half_goes_up(value, whole):
    assert half_up(value) == whole


def test_samples_are_what_they_say():
    assert samples.perfect().score == 100
    assert samples.stubs().score == 0
    assert samples.mixed()["dpsi_dF"].status == FAILED
