"""A published erratum reaches half-finished work, and not one line of the student's is lost."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.student import upgrading, workspace

ROOT = Path(__file__).resolve().parent.parent

MY_PHI = """    # first the edges, as in the handout
    D = edges(X0, X1, X2)
    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
    return ti.Vector([1.0 - p[0] - p[1], p[0], p[1]])   # sum is one!
"""
MY_HELPER = """

@ti.func
def edges(X0, X1, X2):
    return ti.Matrix.cols([X1 - X0, X2 - X0])
"""
MY_ENERGY = """    total = 0.0   # TODO
    total += v0.dot(v0)
    raise NotImplementedError  # not finished, it is midnight
"""


@pytest.fixture
def published(tmp_path, monkeypatch):
    """Muslin's files as installed, in a copy that can be given errata."""
    root = tmp_path / "installed"
    shutil.copytree(ROOT / "assignments", root / "assignments")
    shutil.copytree(ROOT / "data" / "reference", root / "data" / "reference")
    monkeypatch.setattr(paths, "root", lambda: root)
    return root


def replaced(path, *pairs):
    text = path.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def stub_of(path, name):
    """Words and raise of a stub, as they stand in a file."""
    text = path.read_text(encoding="utf-8")
    start = text.index("    # Your code here", text.index(f"def {name}("))
    return text[start : text.index("raise NotImplementedError\n", start) + len("raise NotImplementedError\n")]


def make_mistaken(root):
    """Version 1.0 as it was published: a factor 1/2 is missing in a docstring and in a datum."""
    cloth = root / "assignments" / "cloth"
    replaced(cloth / "kinetic_energy.py", ("T = 1/2 qdot^T", "T = qdot^T"))
    replaced(cloth / "README.md", ("## S4 Kinetic energy", "## S4 Kinetic energy, wrongly"))
    data = root / "data" / "reference" / "cloth" / "kinetic_energy.npz"
    with np.load(data) as arrays:
        arrays = dict(arrays)
    np.savez(data, **{**arrays, "expected_T": 2 * arrays["expected_T"]})


def publish_erratum(root):
    """Version 1.0.1: what is in the repository, with its number and a few more changes of all kinds."""
    shutil.rmtree(root / "assignments")
    shutil.copytree(ROOT / "assignments", root / "assignments")
    shutil.rmtree(root / "data")
    shutil.copytree(ROOT / "data" / "reference", root / "data" / "reference")
    cloth = root / "assignments" / "cloth"
    replaced(cloth / "assignment.toml", ('version = "1.0"', 'version = "1.0.1"'))
    for file in workspace.assignment("cloth").files:
        replaced(cloth / file, ("# cloth 1.0:", "# cloth 1.0.1:"))
    replaced(
        cloth / "collision.py", ("import taichi as ti\n", "import taichi as ti\n\nUP = (0.0, 1.0, 0.0)\n")
    )


@pytest.fixture
def half_finished(published, tmp_path):
    """A workspace of the mistaken version, in the middle of the work."""
    make_mistaken(published)
    folder = tmp_path / "my-cloth"
    workspace.start("cloth", folder)
    shapes, energy = folder / "shape_functions.py", folder / "kinetic_energy.py"
    replaced(
        shapes,
        (stub_of(shapes, "phi"), MY_PHI),
        ("import taichi as ti\n", "import math\n\nimport taichi as ti\n"),
    )
    shapes.write_text(shapes.read_text(encoding="utf-8") + MY_HELPER, encoding="utf-8")
    stub = stub_of(energy, "kinetic_energy")
    replaced(energy, (stub, stub.replace("    raise NotImplementedError\n", MY_ENERGY)))
    (folder / "notes.txt").write_text("mine\n")
    publish_erratum(published)
    return folder


def test_an_erratum_reaches_half_finished_work(half_finished):
    found = workspace.find(half_finished)
    assert (found.version, found.table.version) == ("1.0", "1.0.1")
    done = upgrading.upgrade(found)
    energy = (half_finished / "kinetic_energy.py").read_text(encoding="utf-8")
    assert "T = 1/2 qdot^T" in energy
    assert MY_ENERGY in energy
    shapes = (half_finished / "shape_functions.py").read_text(encoding="utf-8")
    assert MY_PHI in shapes
    assert MY_HELPER in shapes
    assert "import math\n" in shapes
    assert shapes.startswith("# cloth 1.0.1:")
    for untouched in ("README.md", "collision.py", "stress.py"):
        today = paths.assignment("cloth") / untouched
        assert (half_finished / untouched).read_bytes() == today.read_bytes()
    assert (half_finished / "notes.txt").read_text() == "mine\n"
    assert done.changed == ("kinetic_energy",)
    assert done.backup is not None
    assert (done.backup / "kinetic_energy.py.bak").is_file()
    assert not done.left
    assert workspace.find(half_finished).version == "1.0.1"
    again = upgrading.upgrade(workspace.find(half_finished))
    assert not again.brought
    assert not again.left


def test_saying_what_would_be_done_does_nothing(half_finished):
    before = {p: p.read_bytes() for p in half_finished.rglob("*") if p.is_file()}
    done = upgrading.upgrade(workspace.find(half_finished), really=False)
    assert any("docstring" in what for what in done.brought)
    assert before == {p: p.read_bytes() for p in half_finished.rglob("*") if p.is_file()}


def test_what_cannot_be_merged_is_left_and_said(half_finished):
    energy = half_finished / "kinetic_energy.py"
    replaced(energy, ("T = qdot^T", "My own words about qdot^T"))
    handout = half_finished / "README.md"
    handout.write_text("My notes.\n" + handout.read_text(encoding="utf-8"), encoding="utf-8")
    (half_finished / "stress.py").write_text("def dpsi_dF(:\n", encoding="utf-8")
    done = upgrading.upgrade(workspace.find(half_finished))
    left = "\n".join(done.left)
    assert "My own words" in energy.read_text(encoding="utf-8")
    assert "you changed its docstring" in left
    assert handout.read_text(encoding="utf-8").startswith("My notes.")
    assert (half_finished / "README-1.0.1.md").is_file()
    assert "stress.py" in left
    assert (half_finished / "stress.py").read_text() == "def dpsi_dF(:\n"
    # once the file can be read again, the rest comes
    given = (half_finished / ".muslin" / "given" / "stress.py.given").read_text(encoding="utf-8")
    assert "# cloth 1.0:" in given
    (half_finished / "stress.py").write_text(given, encoding="utf-8")
    upgrading.upgrade(workspace.find(half_finished))
    assert (half_finished / "stress.py").read_text(encoding="utf-8").startswith("# cloth 1.0.1:")


def test_a_file_with_windows_line_ends_keeps_them(half_finished):
    energy = half_finished / "kinetic_energy.py"
    energy.write_bytes(energy.read_bytes().replace(b"\n", b"\r\n"))
    upgrading.upgrade(workspace.find(half_finished))
    assert b"T = 1/2 qdot^T" in energy.read_bytes()
    assert energy.read_bytes().count(b"\n") == energy.read_bytes().count(b"\r\n")


GIVEN = '''# cloth 1.0: fill in
"""About."""

import taichi as ti


@ti.func
def f(a, b):
    """Half of a."""
    # Your code here: one
    # line or two
    raise NotImplementedError
'''


@pytest.mark.parametrize(
    ("mine", "new", "inside", "left"),
    [
        # signature: today's, with a warning, since the body may use the old names
        (("raise NotImplementedError", "return a"), ("(a, b)", "(a, c)"), ["def f(a, c)", "return a"], "(a, c)"),
        # the words of the stub, where they still stand; the body stays
        (
            ("raise NotImplementedError", "x = 1.0  # ?\n    return x"),
            ("one\n    # line or two", "a better word"),
            ["# Your code here: a better word\n    x = 1.0  # ?\n    return x"],
            "",
        ),
        # the student's own words inside the stub's
        (
            ("# line or two\n    raise NotImplementedError", "return a"),
            ("one\n    # line or two", "a better word"),
            ["# Your code here: one\n    return a"],
            "",
        ),
        # an untouched stub is today's stub, whatever it is
        (("About.", "About."), ("Half of a.", "Twice a."), ["Twice a."], ""),
        # a new given import, a changed one
        (("raise NotImplementedError", "return a"), ("as ti\n", "as ti\n\nfrom muslin.given import svd\n"),
         ["from muslin.given import svd\n", "return a"], ""),
        # a function of the student's that today's release has too
        (("@ti.func\ndef f", "def g(x):\n    return x\n\n\n@ti.func\ndef f"), ("Half of a.", "Twice a."),
         ["def g(x):\n    return x\n", "Twice a."], ""),
        # a new task
        (("raise NotImplementedError", "return a"),
         ("NotImplementedError\n", "NotImplementedError\n\n\n@ti.func\ndef h(a):\n    raise NotImplementedError\n"),
         ["return a\n\n\n@ti.func\ndef h(a):"], ""),
        # a comment at the end of the body belongs to it
        (("raise NotImplementedError\n", "return a\n    # done?\n"), ("Half of a.", "Twice a."),
         ["return a\n    # done?\n", "Twice a."], ""),
        # the function was renamed by the student
        (("def f(", "def my_f("), ("Half of a.", "Twice a."), ["def my_f(a, b)", "Half of a."], "not in your file"),
    ],
)  # fmt: skip
def test_pieces_are_merged_one_by_one(mine, new, inside, left):
    theirs, today = GIVEN.replace(*mine), GIVEN.replace(*new)
    done = upgrading.merge(GIVEN, theirs, today)
    for text in inside:
        assert text in done.text
    assert left in "\n".join(done.left)
    assert bool(left) == bool(done.left)


def test_a_body_is_never_touched_whatever_changes():
    """Bodies written by students, every combination: after the merge each is there, byte for byte."""
    bodies = [
        "return a",
        "x = a\n    return x",
        "pass  # nothing yet",
        "if a > 0:\n        a = 1.0\n    return a",
    ]
    today = GIVEN.replace("Half", "Twice").replace("(a, b)", "(a, b, c)").replace("one\n", "two\n")
    for body in bodies:
        for keep in (True, False):
            stub = "    # Your code here: one\n    # line or two\n    raise NotImplementedError"
            theirs = GIVEN.replace(stub if not keep else "    raise NotImplementedError", f"    {body}")
            assert f"    {body}\n" in upgrading.merge(GIVEN, theirs, today).text


def test_only_a_started_workspace_can_be_upgraded(tmp_path):
    shutil.copytree(ROOT / "assignments" / "cloth", tmp_path / "copy")
    with pytest.raises(MuslinError, match="was not made by muslin start"):
        upgrading.upgrade(workspace.find(tmp_path / "copy"))
