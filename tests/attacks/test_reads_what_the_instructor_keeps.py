"""Beyond the table: hidden data, other submissions and the report lie where a worker reads its libraries.

Defence: in a class all three are hidden wherever they lie, and a probe looks whether they are.
"""

import shutil
import sys
import tempfile
from pathlib import Path

import pytest
from attacking import BYSTANDER, TARGET, honest, needs, write

import muslin
from muslin.classes.run import grade_class
from muslin.grading import hiding

SPY = """
import os
seen = []
for folder, _, files in os.walk(PLACE):
    for name in files:
        try:
            seen.append(open(os.path.join(folder, name)).read(100))
        except OSError:
            pass
print("SEEN", [text for text in seen if "KEPT" in text])
"""


@pytest.fixture
def place():
    """A folder inside what every worker must see, as of an instructor who works inside a virtual environment."""
    folder = Path(tempfile.mkdtemp(prefix="muslin-kept-", dir=sys.prefix))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


def test_what_is_kept_is_out_of_sight_inside_the_libraries(attack, level, place, tmp_path):
    (place / "hidden").mkdir()
    for kept in (place / "hidden" / "answers", place / "grades.csv"):
        kept.write_text("KEPT")
        kept.chmod(0o644)
    (place / "open").write_text("this is KEPT from nobody")
    folder = write(tmp_path / "spy", {TARGET: SPY.replace("PLACE", repr(str(place))) + honest()})
    secrets = [place / "hidden", place / "grades.csv", place / "not there"]
    record = attack.grade(folder, level=level, secrets=secrets)
    needs(record, "solution and hidden data out of sight")
    assert "SEEN ['this is KEPT from nobody']" in record["sphere_contact"].output
    seeing = attack.grade(folder, level=level, fresh=True)
    assert seeing["sphere_contact"].output.count("KEPT") == 3


def test_a_class_keeps_submissions_and_report_to_itself(place, monkeypatch):
    spy = SPY.replace("PLACE", repr(str(place)))
    write(place / "subs" / "ada", {TARGET: spy + honest()})
    write(place / "subs" / "ben", {BYSTANDER: "# KEPT\n" + honest(BYSTANDER)})
    (place / "out").mkdir()
    (place / "out" / "grades.csv").write_text("KEPT")
    for path in [place, *place.rglob("*")]:
        path.chmod(0o755 if path.is_dir() else 0o644)
    graded = grade_class(place / "subs", place / "out", jobs=1)
    record = next(row.record for row in graded.rows if row.submission.name == "ada")
    needs(record, "solution and hidden data out of sight")
    assert "SEEN []" in record["sphere_contact"].output


def test_python_itself_is_never_hidden(monkeypatch):
    package = Path(muslin.__file__).parent
    view = [Path(sys.prefix), package]
    for above in (*package.parents, *Path(sys.prefix).parents, package):
        assert not any(path.is_relative_to(part) for part in hiding.hideable(above, view) for path in view)
    inside = package / "grading"
    assert list(hiding.hideable(inside, view)) == [inside]
    assert list(hiding.hideable(package.parent, [*view, package / "mesh"])) == []
    parts = list(hiding.hideable(inside, [*view, inside / "views"]))
    assert inside / "sandbox.py" in parts
    assert inside / "views" not in parts
