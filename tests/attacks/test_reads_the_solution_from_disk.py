"""Attack 11: reads reference data and the solution from disk, or imports and calls them.

Defence: a file system without them (namespace), or no right to open them (landlock, another user). Where a
system gives neither, the record says so.
"""

from pathlib import Path

from attacking import SOLUTION, TARGET, honest, needs

import muslin
from muslin.base import paths
from muslin.grading import hiding

HOSTILE = """
import glob, os, sys
seen = []
for path in PATHS:
    for target in [path, *glob.glob(path + "/**", recursive=True)]:
        try:
            if os.path.isfile(target) and open(target, "rb").read(1):
                seen.append(target)
        except OSError:
            pass
for name in ("muslin.physics.elements.native", "muslin.physics.elements.student", "muslin.authoring.reference_data",
             "muslin.judging.properties", "muslin.grading.checks", "solutions.cloth.collision"):
    try:
        __import__(name)
        seen.append(name)
    except BaseException:
        pass
try:
    import muslin
    muslin.load(PATHS[0])
    seen.append("load")
except BaseException:
    pass
print("SEEN", seen)
"""


def test_the_solution_is_out_of_sight(attack, level, tmp_path):
    package = Path(muslin.__file__).parent
    hidden = tmp_path / "instructor"
    hidden.mkdir()
    (hidden / "answers.npz").write_text("secret")
    hidden.chmod(0o777)
    folders = [
        SOLUTION,
        paths.root() / "data" / "reference",
        hidden,
        package / "authoring",
        package / "elements",
    ]
    files = [p for n in ("properties", "checks") for p in (package / "grading").glob(f"**/{n}.*")]
    hostile = HOSTILE.replace("PATHS", repr([str(p) for p in [*folders, *files]]))
    record = attack({TARGET: hostile + honest()}, level=level)
    if not record.safety.defences["solution and hidden data out of sight"]:
        assert any("Not secret" in note for note in record.safety.notes)
    needs(record, "solution and hidden data out of sight")
    assert "SEEN []" in record["sphere_contact"].output


COPIES = """
import os, sys
seen = []
for place in sys.path:
    for folder, _, files in os.walk(os.path.join(place, "muslin", "_shipped")):
        for file in files:
            try:
                if open(os.path.join(folder, file), "rb").read(1):
                    seen.append(file)
            except OSError:
                pass
print("SEEN", seen)
"""


def test_nor_is_a_copy_of_it_read_where_libraries_lie(attack, level):
    """An editable installation leaves all that a wheel ships in site-packages, beside the package that runs."""
    record = attack({TARGET: COPIES + honest()}, level=level)
    needs(record, "solution and hidden data out of sight")
    assert "SEEN []" in record["sphere_contact"].output


def test_every_copy_on_the_path_is_hidden_but_not_the_package_that_runs(tmp_path, monkeypatch):
    (tmp_path / "muslin" / "_shipped").mkdir(parents=True)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(paths.PACKAGE.parent))
    hidden = hiding.answers(paths.PACKAGE)
    assert (tmp_path / "muslin").resolve() in hidden
    assert paths.PACKAGE not in hidden
