"""What students are given holds no answer: searched for every line of the solutions and truths, and by calling it."""

from __future__ import annotations

import ast
import io
import json
import re
import subprocess
import sys
import tokenize
import zipfile
from pathlib import Path

import pytest

from muslin.authoring.leaks import answers
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.packing import packs

ROOT = Path(__file__).resolve().parent.parent

#: Fewest symbols of a line that says something: `return f` and `J = F.determinant()` stand in many a program.
LONG = 12

#: What stands in a solution and in any program with triangles and matrices.
ANYWHERE = {"(x1-x0).cross(x2-x0)", "ti.Matrix.zero(float,3,3)", "ti.Matrix.zero(float,9,9)"}


def symbols(line):
    """A line without blanks and comments, symbol by symbol."""
    try:
        read = list(tokenize.generate_tokens(io.StringIO(line).readline))
    except (tokenize.TokenError, IndentationError, SyntaxError):
        return re.findall(r"\w+|[^\w\s]", line)
    return [
        token.string
        for token in read
        if token.type not in (tokenize.COMMENT, tokenize.NL) and token.string.strip()
    ]


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    """The pack, opened, with its wheel opened in it as `installed`."""
    home = tmp_path_factory.mktemp("students")
    written = packs.pack("students", "cloth", out=home / "out")
    assert [path.name for path in written] == ["cloth-students.zip", "README.md"]
    with zipfile.ZipFile(written[0]) as archive:
        archive.extractall(home / "given")
    (wheel,) = (home / "given").glob("muslin-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(home / "given" / "installed")
    return home / "given"


def texts(given):
    """Everything in it that can be read, by path, without blanks."""
    for path in sorted(given.rglob("*")):
        if path.is_file():
            try:
                yield path.relative_to(given).as_posix(), re.sub(r"\s", "", path.read_text(encoding="utf-8"))
            except UnicodeDecodeError:
                continue


def test_there_is_no_folder_of_answers_or_truths_in_it(given):
    names = {path.relative_to(given).as_posix() for path in given.rglob("*") if path.is_file()}
    assert len(names) > 300
    pattern = r"solutions?/|(^|/)judge/|(^|/)reference\.py$|misconceptions/|hidden"
    assert {name for name in names if re.search(pattern, name)} == {
        "installed/muslin/judging/reference.py"  # the module that reads the public data
    }
    stub = (paths.assignment("cloth") / "shape_functions.py").read_bytes()
    assert (given / "cloth" / "shape_functions.py").read_bytes() == stub


@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_no_line_of_a_solution_stands_in_it(assignment, given):
    lines = {"".join(symbols(line)): where for line, where in answers(paths.solution(assignment)).items()
             if len(symbols(line)) >= LONG}  # fmt: skip
    assert len(lines) > 40
    found = {
        f"{name}: {where}"
        for name, text in texts(given)
        for line, where in lines.items()
        if line in text and re.sub(r"^\w=", "", line) not in ANYWHERE
    }
    assert found == set()


@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_no_line_of_a_truth_stands_in_it(assignment, given):
    """Of what is true, and of how hidden cases are drawn: every statement that computes something."""
    lines = set()
    for path in (paths.source(assignment) / "judge").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith(("truth_", "draw_")):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                lines |= {"".join(symbols(line)) for one in body for line in ast.unparse(one).splitlines()
                          if len(symbols(line)) >= LONG}  # fmt: skip
    assert len(lines) > 10
    found = {f"{name}: {line}" for name, text in texts(given) for line in lines if line in text}
    assert found == set()
    names = [
        name
        for name, text in texts(given)
        if re.search(r"def(truth|draw|mistakes)_(phi|psi|dpsi_dF)\(", text)
    ]
    assert names == []


@pytest.mark.skipif(sys.platform == "win32", reason="calls are made in forked processes")
@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_calling_everything_in_it_answers_no_task(assignment, given):
    command = [sys.executable, "-I", ROOT / "tests" / "answers_in.py", given / "installed", assignment]
    said = json.loads(
        subprocess.run(command, capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL).stdout
    )
    assert said["failed"] == {}
    assert min(said["tried"].values()) > 20
    assert said["answers"] == {}


def test_the_search_by_calling_finds_an_answer_where_there_is_one(given, tmp_path):
    """Beside the wheel as graders have it, with the solution in a module of its own."""
    source = (paths.solution("cloth") / "stress.py").read_text(encoding="utf-8")
    (given / "installed" / "muslin" / "physics" / "planted.py").write_text(source, encoding="utf-8")
    try:
        command = [
            sys.executable,
            "-I",
            ROOT / "tests" / "answers_in.py",
            given / "installed",
            "cloth",
            "dpsi_dF",
        ]
        said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    finally:
        (given / "installed" / "muslin" / "physics" / "planted.py").unlink()
    assert said["answers"] == {"dpsi_dF": ["muslin.physics.planted.dpsi_dF"]}


def test_nor_does_an_answer_in_practice_stay_unseen(given):
    """As one that properties were drawn with: all of a triangle in one array."""
    path = next((given / "installed" / "muslin" / "_shipped" / "practice" / "cloth").glob("triangles.py"))
    before = path.read_text(encoding="utf-8")
    planted = """

def planted(X):
    N, e1, e2 = normals(X), X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    g1, g2 = cross(e2, N), cross(N, e1)
    g1, g2 = (g / np.sum(g * e, axis=1)[:, None] for g, e in ((g1, e1), (g2, e2)))
    return np.stack([-g1 - g2, g1, g2], axis=1)
"""
    try:
        path.write_text(before + planted, encoding="utf-8")
        command = [
            sys.executable,
            "-I",
            ROOT / "tests" / "answers_in.py",
            given / "installed",
            "cloth",
            "dphi_dX",
        ]
        said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    finally:
        path.write_text(before, encoding="utf-8")
    assert said["answers"] == {"dphi_dX": ["muslin_practice_cloth.triangles.planted"]}


def told(given, *words, folder="cloth"):
    """What an installation of the pack says to a command typed in the workspace."""
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); sys.argv[0] = 'muslin'; import muslin.cli as c; c.main()"
    command = [sys.executable, "-I", "-c", code, given / "installed", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=given / folder)
    return done.returncode, " ".join((done.stdout + done.stderr).split())


def test_students_work_with_it_as_its_readme_says(given):
    assert "everything you need" in (given / "README.md").read_text(encoding="utf-8")
    assert "@" not in (given / "README.md").read_text(encoding="utf-8")
    code, said = told(given, "check", "phi")
    assert code == 1
    assert "not implemented yet" in said
    (given / "cloth" / "kinetic_energy.py").write_bytes(
        (paths.solution("cloth") / "kinetic_energy.py").read_bytes()
    )
    code, said = told(given, "check", "S4")
    assert (code, "mass_block" in said) == (0, True)


@pytest.mark.parametrize(
    "words", [("release", "cloth"), ("lint", "cloth"), ("reference", "build"), ("pack", "students")]
)
def test_what_needs_answers_says_plainly_that_they_are_not_here(words, given):
    code, said = told(given, *words, folder=".")
    assert code == 1
    assert "muslin: " in said or "to fix" in said
    assert "Traceback" not in said
    assert "report" not in said


def test_pip_reads_what_it_is_told_to_install(given, tmp_path):
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        tmp_path,
    ]
    subprocess.run([*command, "-r", "requirements.txt"], check=True, cwd=given, capture_output=True)
    assert (tmp_path / "muslin" / "__init__.py").is_file()
    assert "[fast,view]" in (given / "requirements.txt").read_text()


def test_hidden_data_and_students_do_not_go_together(tmp_path):
    with pytest.raises(MuslinError, match="it is what students get"):
        packs.pack("students", "cloth", tmp_path, tmp_path / "out")
