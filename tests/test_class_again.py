"""After an erratum one task is graded again: all other verdicts stay to the last byte, and changes are listed."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "benchmarks"))
import class_of_200 as large  # type: ignore[import-not-found]

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes import again


def corrected(manifest: Path, **points: int) -> None:
    """Give tasks other points in a manifest."""
    lines, task = manifest.read_text(encoding="utf-8").splitlines(keepends=True), ""
    for number, line in enumerate(lines):
        if line.startswith("[task."):
            task = line.split(".")[1].strip("]\n")
        if task in points and line.startswith("points ="):
            lines[number] = f"points = {points[task]}\n"
    manifest.write_text("".join(lines), encoding="utf-8")


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """An instructor's own copy of the assignment, and a class of two that is graded by it."""
    home = tmp_path_factory.mktemp("course")
    for part in ("solutions", "assignments", "data/reference", "data/known", "data/slips"):
        shutil.copytree(
            paths.root() / part / "cloth", home / part / "cloth", ignore=shutil.ignore_patterns("__pycache__")
        )
    for name, files in (("Right", ("kinetic_energy.py", "shape_functions.py")), ("Wrong", ())):
        folder = home / "submissions" / name
        folder.mkdir(parents=True)
        for file in large.TABLE.files:
            (folder / file).write_text(
                (large.SOLUTION if file in files else large.STUBS)[file], encoding="utf-8"
            )
    return home


def grade(home, *more):
    run = large.command(home / "submissions", home / "report", "--deadline", "10", *more)
    done = subprocess.run(
        run, capture_output=True, text=True, check=True, env=os.environ | {paths.COURSE: str(home)}
    )
    with open(home / "report/grades.csv", encoding="utf-8", newline="") as stream:
        return (
            {row["student"]: row for row in csv.DictReader(stream)},
            " ".join(done.stdout.split()),
            done.stderr,
        )


def test_only_the_task_that_was_corrected_is_graded_again_and_who_gains_is_listed(course):
    first, _, _ = grade(course)
    phi, mass = (large.MOST[name] for name in ("phi", "mass_block"))
    assert (first["Right"]["phi"], first["Right"]["mass_block"]) == (str(phi), str(mass))
    record = json.loads((course / "report/records/right.json").read_text())["result"]["record"]
    for part in ("solutions", "assignments"):
        corrected(course / part / "cloth" / "assignment.toml", phi=phi + 2, mass_block=mass + 2)
    second, said, _ = grade(course, "--regrade", "phi")
    assert (second["Right"]["phi"], second["Right"]["mass_block"]) == (str(phi + 2), str(mass))
    assert float(second["Right"]["score"]) == float(first["Right"]["score"]) + 2
    assert second["Wrong"]["score"] == "0"
    assert "Graded again: phi, of 2 students; 1 gain, 0 lose." in said
    table = (course / "report/regraded.csv").read_text(encoding="utf-8").splitlines()
    assert table == ["student,id,task,before,after", f"Right,,phi,{phi},{phi + 2}"]
    now = json.loads((course / "report/records/right.json").read_text())["result"]["record"]
    for old, new in zip(record["tasks"], now["tasks"], strict=True):
        assert old == new or old["name"] == "phi"
    assert now["simulation"] == record["simulation"]
    assert "it had 5 of 5" in (course / "report/reports/right.html").read_text(encoding="utf-8")
    journal = large.journal(course / "report")
    again_, _, told = grade(course, "--regrade", "phi")  # nothing is left to do
    assert again_ == second
    assert large.journal(course / "report") == journal
    assert "2 of them graded already" in told
    whole, _, _ = grade(course)  # and whoever leaves it out later grades nobody again either
    assert whole == second
    assert large.journal(course / "report") == journal


def test_a_task_that_is_none_is_said_before_anything():
    with pytest.raises(MuslinError, match="There is no task 'phy' in cloth"):
        again.named(["phy"], large.TABLE)
    assert again.named(["psi", "phi"], large.TABLE) == ("phi", "psi")
