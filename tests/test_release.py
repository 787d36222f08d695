"""What a student receives is made from the solution, teaches every task, and gives no answer away."""

from __future__ import annotations

import ast
import contextlib
import doctest
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin.authoring import release as authoring
from muslin.authoring import wheel
from muslin.authoring.leaks import answers
from muslin.authoring.regions import regions
from muslin.base import paths
from muslin.base.errors import MuslinError, NotImplementedYet
from muslin.tasks import Assignment, read_assignment

ROOT = Path(__file__).resolve().parent.parent
SOLUTION, RELEASED = ROOT / "solutions" / "cloth", ROOT / "assignments" / "cloth"
TABLE = read_assignment(SOLUTION)
TASKS = list(TABLE.tasks.values())
COMMANDS = {
    "scenes",
    "experiment",
    "handout",
    "view",
    "play",
    "simulate",
    "render",
    "export",
    "demo",
    "doctor",
    "release",
    "reference",
    "check",
    "start",
    "watch",
    "list",
    "hint",
    "reset",
    "run",
    "explain",
    "gradcheck",
    "submit",
    "upgrade",
}


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the assignment and its solution in which a test may do as it likes."""
    for folder in ("solutions", "assignments"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(paths, "solution", lambda name: tmp_path / "solutions" / name)
    monkeypatch.setattr(paths, "assignment", lambda name: tmp_path / "assignments" / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


# -------------------- the repository as it is


def test_the_released_assignments_are_what_the_solutions_give(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert [authoring.out_of_step(name) for name in paths.assignments("solutions")] == [[], []]


def test_students_get_what_every_assignment_lets_them_read_of_its_judges():
    held = {path.resolve() for path in wheel.contents().values()}
    files = list((ROOT / "solutions").glob("*/practice/*.py"))
    assert {path.parts[-3] for path in files} == set(paths.assignments("solutions"))
    assert {path.resolve() for path in files} <= held


def test_no_solution_line_occurs_in_what_a_student_receives():
    """Written apart from the release's own check: each line as it stands, blanks aside."""
    released = {
        path.relative_to(RELEASED): re.sub(r"\s", "", path.read_text(encoding="utf-8"))
        for path in RELEASED.rglob("*")
        if path.suffix in (".py", ".md", ".toml", ".svg")
    }
    regions = 0
    for file in TABLE.files:
        inside = False
        for line in (SOLUTION / file).read_text(encoding="utf-8").splitlines():
            if "# begin solution" in line or "# end solution" in line:
                inside = "begin" in line
                regions += inside
            elif inside and len(code := re.sub(r"\s|\s# .*", "", line)) > 8:
                assert [path for path, text in released.items() if code in text] == [], line
    assert regions >= len(TASKS)


def test_every_answer_is_looked_for():
    found = answers(SOLUTION)
    assert "F.transpose() @ F" in found
    assert "if d < 0:" in found
    assert len(found) > 60


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_an_untouched_task_says_not_implemented_yet(task, monkeypatch):
    monkeypatch.chdir(ROOT)
    stubs = muslin.load("assignments/cloth")
    arguments = {v.name: np.ones((1, *v.shape)) for v in task.arguments}
    with pytest.raises(NotImplementedYet) as failure:
        muslin.evaluate(stubs[task.name], **arguments)
    assert str(failure.value) == f"not implemented yet: {task.name} (assignments/cloth/{task.file})"


@pytest.mark.parametrize("file", TABLE.files)
def test_stubs_are_python_that_keeps_docstrings_and_loses_markers(file):
    stub, solution = ((folder / file).read_text(encoding="utf-8") for folder in (RELEASED, SOLUTION))
    assert "begin solution" not in stub
    assert "end solution" not in stub
    assert max(map(len, stub.splitlines())) <= 110
    written, asked = (
        {n.name: ast.get_docstring(n) for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef)}
        for text in (solution, stub)
    )
    assert asked == written
    assert all(asked.values())
    assert ast.get_docstring(ast.parse(stub)) == ast.get_docstring(ast.parse(solution))
    assert stub.count("# Your code here: ") == sum(task.file == file for task in TASKS)
    compile(stub, file, "exec")


def test_stubs_pass_the_linter_and_the_formatter():
    if find_spec("ruff") is None:
        pytest.skip("ruff is not installed")
    for command in (["check"], ["format", "--check"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *command, "--no-cache", str(RELEASED)],
            cwd=ROOT, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr


# -------------------- what --check finds


def test_a_hand_edit_is_found_with_its_line(checkout):
    stub = checkout / "assignments/cloth/stress.py"
    lines = stub.read_text(encoding="utf-8").splitlines()
    lines[3] = "import taichi as tea"
    stub.write_text("\n".join(lines) + "\n", encoding="utf-8")
    (finding,) = authoring.out_of_step("cloth")
    assert finding.startswith("assignments/cloth/stress.py, line 4: stale or edited by hand")
    assert "muslin release cloth" in finding


def test_a_file_is_stale_when_its_solution_changed(checkout):
    solution = checkout / "solutions/cloth/collision.py"
    text = solution.read_text(encoding="utf-8")
    solution.write_text(
        text.replace("The very", "the very").replace("Did the vertex hit", "Has the vertex hit")
    )
    (finding,) = authoring.out_of_step("cloth")
    assert finding.startswith("assignments/cloth/collision.py, line ")
    authoring.release("cloth")
    assert authoring.out_of_step("cloth") == []


def test_a_changed_answer_alone_makes_nothing_stale(checkout):
    solution = checkout / "solutions/cloth/strain_energy.py"
    text = solution.read_text(encoding="utf-8")
    solution.write_text(text.replace("F.transpose() @ F", "(F.transpose()) @ F"), encoding="utf-8")
    assert authoring.out_of_step("cloth") == []


def test_a_superfluous_file_is_found_and_a_cache_is_not(checkout):
    (checkout / "assignments/cloth/notes.txt").write_text("hello", encoding="utf-8")
    (checkout / "assignments/cloth/__pycache__").mkdir()
    (checkout / "assignments/cloth/__pycache__/stress.pyc").write_bytes(b"\xff")
    for number in range(3):  # a run that was left behind is one finding
        frame = checkout / f"assignments/cloth/run/frames/{number}.npy"
        frame.parent.mkdir(parents=True, exist_ok=True)
        frame.write_bytes(b"\x93NUMPY\xff")
    notes, run = authoring.out_of_step("cloth")
    assert notes.startswith("assignments/cloth/notes.txt is superfluous")
    assert run.startswith("assignments/cloth/run is superfluous")


@pytest.mark.parametrize("file", ["stress.py", "assignment.toml", "README.md", "pictures/modes.svg"])
def test_a_missing_file_is_found(checkout, file):
    (checkout / "assignments/cloth" / file).unlink()
    (finding,) = authoring.out_of_step("cloth")
    assert finding.startswith(f"assignments/cloth/{file} is missing")


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("stress.py", "# -h*area*P@grad_phi"),
        ("README.md", "Compute `F.transpose()@F`."),
        ("pictures/modes.svg", "<!-- d = n.dot(v) -->"),
        ("draft.txt", "x = U @ diag(dpsi_ds) @ V.transpose()"),
    ],
)
def test_an_answer_is_found_wherever_it_lies_and_however_it_is_spaced(checkout, file, text):
    with (checkout / "assignments/cloth" / file).open("a", encoding="utf-8") as stream:
        stream.write(text + "\n")
    findings = authoring.out_of_step("cloth")
    assert any(f"assignments/cloth/{file}, line " in f and "gives away" in f for f in findings)


def test_a_handout_that_tells_is_not_released(checkout):
    with (checkout / "solutions/cloth/README.md").open("a", encoding="utf-8") as stream:
        stream.write("Hint: `F.transpose() @ F`\n")
    before = (checkout / "assignments/cloth/README.md").read_bytes()
    with pytest.raises(MuslinError, match=r"give an answer away.*README\.md, line \d+"):
        authoring.release("cloth")
    assert (checkout / "assignments/cloth/README.md").read_bytes() == before


def test_the_release_is_the_same_every_time_and_goes_where_it_is_told(checkout, tmp_path):
    out = tmp_path / "elsewhere"
    written = authoring.release("cloth", out)
    assert written == sorted(written)
    assert {path.relative_to(out): path.read_bytes() for path in written} == {
        path.relative_to(RELEASED): path.read_bytes()
        for path in RELEASED.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


# -------------------- markers

BROKEN = {
    "never ends": ("    # begin solution: do\n    return x\n", 2),
    "still open": (
        "    # begin solution: do\n    # begin solution: more\n    return x\n    # end solution\n",
        3,
    ),
    "is empty": ("    # begin solution: do\n\n    # end solution\n", 2),
    "does not say what to do": ("    # begin solution\n    return x\n    # end solution\n", 2),
    "never began": ("    return x\n    # end solution\n", 3),
    "is not a solution marker": ("    # Begin solution: do\n    return x\n    # end solution\n", 2),
    "not a solution marker: return x": ("    return x  # begin solution: do\n    # end solution\n", 2),
    "must stand alone": ("    # begin solution: do\n    return x\n    # end solution: done\n", 4),
    "must not leave": ("    # begin solution: do\n    return x\ny = 1\n    # end solution\n", 4),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_malformed_marker_is_refused_with_file_and_line(what, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    body, line = BROKEN[what]
    lines = ("def f(x):\n" + body).splitlines()
    with pytest.raises(MuslinError, match=rf"^folder/file\.py, line {line}: .*{what}"):
        regions(lines, Path("folder/file.py"))


def test_a_task_without_a_region_is_refused(checkout):
    path = checkout / "solutions/cloth/collision.py"
    text = path.read_text(encoding="utf-8")
    first = text.index("    # begin solution")
    text = text[:first] + text[first:].replace("    # end solution\n", "", 1).split("\n", 1)[1]
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MuslinError, match=r"collision\.py, line \d+: sphere_contact has no solution region"):
        authoring.release("cloth")


def test_helpers_at_module_level_vanish_and_long_words_are_wrapped(checkout):
    path = checkout / "solutions/cloth/stress.py"
    text = path.read_text(encoding="utf-8")
    helper = "# begin solution\n@ti.func\ndef helper(x):\n    return x + 12345\n\n\n# end solution\n\n\n"
    at = text.index("@ti.func")
    text = text[:at] + helper + text[at:]
    text = re.sub(r"(# begin solution: ).*chain rule.*", r"\1" + "word " * 40, text)
    path.write_text(text, encoding="utf-8")
    stub = authoring.rendered(path.parent)["stress.py"].decode()
    assert "helper" not in stub
    assert "    # word word" in stub
    assert max(map(len, stub.splitlines())) <= 110
    assert "\n\n\n\n" not in stub
    compile(stub, "stress.py", "exec")


def test_an_unknown_marker_in_the_handout_is_refused(checkout):
    with (checkout / "solutions/cloth/README.md").open("a", encoding="utf-8") as stream:
        stream.write("<!-- signature: dpsi -->\n")
    with pytest.raises(
        MuslinError, match=r"README\.md, line \d+: the marker <!-- signature: dpsi --> is not"
    ):
        authoring.release("cloth")


def test_a_picture_appears_when_it_is_there(checkout):
    assert (
        "](pictures/later.png)" not in authoring.rendered(checkout / "solutions/cloth")["README.md"].decode()
    )
    with (checkout / "solutions/cloth/README.md").open("a", encoding="utf-8") as stream:
        stream.write("<!-- picture: later.png | Later -->\n")
    (checkout / "solutions/cloth/pictures/later.png").write_bytes(b"\x89PNG")
    files = authoring.rendered(checkout / "solutions/cloth")
    assert "![Later](pictures/later.png)" in files["README.md"].decode()
    assert files["pictures/later.png"] == b"\x89PNG"


# -------------------- the handout


@dataclass(frozen=True)
class Handout:
    """The handout of an assignment, and what it belongs to."""

    name: str

    @property
    def solution(self) -> Path:
        return ROOT / "solutions" / self.name

    @property
    def released(self) -> Path:
        return ROOT / "assignments" / self.name

    @property
    def text(self) -> str:
        return (self.released / "README.md").read_text(encoding="utf-8")

    @property
    def table(self) -> Assignment:
        return read_assignment(self.solution)


HANDOUTS = [Handout(name) for name in paths.assignments("solutions")]
every_handout = pytest.mark.parametrize("handout", HANDOUTS, ids=lambda handout: handout.name)


def _sections(handout: Handout) -> dict[str, str]:
    """Text below each `### task` heading."""
    parts = re.split(r"^### (\w+)$", handout.text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize(
    ("handout", "task"),
    [
        pytest.param(handout, task, id=f"{handout.name}-{task.name}")
        for handout in HANDOUTS
        for task in handout.table.tasks.values()
    ],
)
def test_the_handout_teaches_every_task(handout, task):
    text = re.split(r"^## ", _sections(handout)[task.name], flags=re.MULTILINE)[0]
    assert f"`{task.name}({', '.join(v.name for v in task.arguments)})`" in text
    assert "**Derivation.**" in text
    assert f"`muslin check {task.name}`" in text
    pitfalls = text.split("**Pitfalls**")[1].split("**Check it:**")[0]
    assert len(re.findall(r"^- ", pitfalls, flags=re.MULTILINE)) >= 3
    assert f"f.{task.name}(" if task.in_python else f"evaluate(f.{task.name}," in text


@every_handout
def test_the_handout_follows_the_manifest_order(handout):
    assert list(_sections(handout)) == list(handout.table.tasks)


def _commands(text: str) -> list[list[str]]:
    lines = re.findall(
        r"^\s*(muslin .+)$", "\n".join(re.findall(r"```bash\n(.*?)```", text, re.DOTALL)), re.M
    )
    return [line.split("#")[0].split() for line in lines + re.findall(r"`(muslin [^`]+)`", text)]


@every_handout
def test_the_handout_shows_only_commands_that_exist(handout, monkeypatch, capsys):
    shown = _commands(handout.text)
    assert len(shown) > 25
    assert {words[1] for words in shown} <= COMMANDS
    assert {words[2] for words in shown if words[1] == "check" and len(words) > 2} == set(handout.table.tasks)
    if find_spec("muslin.cli") is None:
        return  # the list above is then all there is to compare with
    main = import_module("muslin.cli").main
    monkeypatch.setenv("COLUMNS", "300")
    for name in sorted({words[1] for words in shown}):
        monkeypatch.setattr(sys, "argv", ["muslin", name, "--help"])
        with contextlib.suppress(SystemExit):
            main()
        told = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)
        for option in {word for words in shown if words[1] == name for word in words if word[:2] == "--"}:
            assert option in told, f"muslin {name} has no {option}"


@every_handout
def test_the_links_and_pictures_of_the_handout_exist(handout):
    headings = re.findall(r"^#+ (.+)$", re.sub(r"```.*?```", "", handout.text, flags=re.DOTALL), re.MULTILINE)
    anchors = {
        "#" + re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in headings
    }
    assert len(anchors) == len(headings)
    for target in re.findall(r"\]\(([^)]+)\)", handout.text):
        if target.startswith("#"):
            assert target in anchors
        elif not target.startswith("https://"):
            assert (handout.released / target).is_file(), target
    shown = set(re.findall(r"\]\(pictures/([^)]+)\)", handout.text))
    assert shown == {path.name for path in (handout.released / "pictures").iterdir()}
    assert len(shown) >= 4


@every_handout
def test_formulas_survive_markdown(handout):
    """Outside fences GitHub would read a backslash before punctuation as its own, and a bare < as a tag."""
    text = re.sub(r"```.*?```|<!--.*?-->|`[^`\n]*`", "", handout.text, flags=re.DOTALL)
    for paragraph in text.split("\n"):
        assert paragraph.count("$") % 2 == 0, paragraph
        for formula in re.findall(r"\$([^$]+)\$", paragraph):
            assert not re.search(r"\\[^A-Za-z ]|[<>|]|^\s|\s$", formula), formula
            assert formula.count("{") == formula.count("}"), formula


class _ZeroIsZero(doctest.OutputChecker):
    """-0. is printed where 0. is meant, depending on how a right answer is written."""

    def check_output(self, want: str, got: str, optionflags: int) -> bool:
        want, got = (re.sub(r"-(0\.(?!\d))", r" \1", text) for text in (want, got))
        return super().check_output(re.sub(r"\[\s+", "[", want), re.sub(r"\[\s+", "[", got), optionflags)


@every_handout
def test_the_numbers_in_the_handout_are_what_the_solution_computes(handout, monkeypatch):
    monkeypatch.chdir(handout.solution)
    before = np.get_printoptions()
    test = doctest.DocTestParser().get_doctest(handout.text, {}, "handout", "README.md", 0)
    runner = doctest.DocTestRunner(checker=_ZeroIsZero(), optionflags=doctest.NORMALIZE_WHITESPACE)
    report: list[str] = []
    try:
        result = runner.run(test, out=report.append)
    finally:
        np.set_printoptions(**{k: v for k, v in before.items() if k not in ("legacy", "override_repr")})
    assert result.attempted > 25
    assert result.failed == 0, "".join(report)
