"""Whatever a download holds: every student has a line, every missing score a reason, and a stop changes no byte."""

from __future__ import annotations

import contextlib
import csv
import html
from concurrent.futures import ThreadPoolExecutor

import class_mess as mess
import grading_samples as samples
import pytest

from muslin.classes import engines, reports
from muslin.classes.reports import Printed
from muslin.classes.run import grade_class
from muslin.classes.work import Result


@pytest.fixture
def quick(monkeypatch):
    """Gradings and drawings take no time; `stop` says after how many the run is killed, `count` how many there were."""

    class Quick:
        stop, count = None, 0

        @contextlib.contextmanager
        def local(self, jobs):
            with ThreadPoolExecutor(1) as pool:
                yield pool, 1, self.graded

        def graded(self, terms, job):
            if self.stop == self.count:
                raise KeyboardInterrupt
            self.count += 1
            assert job.handed.files
            return Result(job.key, samples.mixed().as_json(), cpu=1.0)

    quick = Quick()
    monkeypatch.setattr(engines, "local", quick.local)
    monkeypatch.setattr(
        reports, "make", lambda folder, rows, tick: {r.key: Printed(b"", "") for r in rows if r.record}
    )
    return quick


def lines(report):
    with open(report / "grades.csv", encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize("layout", mess.LAYOUTS)
def test_every_student_has_a_line_and_every_missing_score_a_reason(layout, quick, tmp_path):
    if layout == "gradescope":
        pytest.importorskip("yaml")
    expected = mess.LAYOUTS[layout](tmp_path / "class")
    assert len(expected) >= len(mess.EVERYTHING) >= 27
    graded = grade_class(tmp_path / "class", tmp_path / "whole")
    rows = {row["id"] or row["student"]: row for row in lines(tmp_path / "whole")}
    assert rows.keys() == expected.keys()
    page = (tmp_path / "whole/index.html").read_text(encoding="utf-8")
    failed = {
        row.submission.students[0].id or row.submission.name: row.error for row in graded.rows if row.error
    }
    for id, kind in expected.items():
        words = mess.MORE.get(kind) or mess.EVERYTHING[kind][1]
        assert words in rows[id]["notes"], (kind, rows[id]["notes"])
        assert (rows[id]["score"] != "") == (kind in mess.GRADED), (kind, rows[id])
        assert (id in failed) == (kind not in mess.GRADED)
        assert html.escape(words) in page
    if layout == "gradescope":
        assert all("handed in 2026-01-02 10:30 UTC" in row["notes"] for row in rows.values())
    assert f"{quick.count} graded, {len(failed)} could not be." in graded.told()

    quick.stop = quick.count + 5  # a run that is killed after five, and one that goes on
    with pytest.raises(KeyboardInterrupt):
        grade_class(tmp_path / "class", tmp_path / "killed")
    quick.stop = None
    again = grade_class(tmp_path / "class", tmp_path / "killed")
    assert again.taken == 5
    for name in ("grades.csv", "index.html"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
