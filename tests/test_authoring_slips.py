"""An author's slip is told as theirs, by lint and where it is met: file, line, what is wrong, what to do.

On the toy, in a course folder of its own. Beside it: what students' machines measure with is what graders measure with.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import cli
from muslin.authoring import lint, mistakes, reference_data, release
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import checking, judge, measured, properties, reference
from muslin.judging.knowledge import secret
from muslin.tasks.authored import AuthorError

TOY = Path(__file__).parent / "toy"

#: What is said of the toy as it is: it has no suite, and its handout is short.
LACKS = ("misconceptions", "README.md")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The toy, released, with its data."""
    folder = tmp_path_factory.mktemp("made")
    shutil.copytree(TOY, folder / "solutions" / "toy", ignore=shutil.ignore_patterns("__pycache__"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.COURSE, str(folder))
        release.release("toy")
        reference_data.build("toy", cases=10)
        list(mistakes.build("toy"))
    return folder


@pytest.fixture
def course(made, tmp_path, monkeypatch):
    """A copy of it in which a test may do as it likes."""
    folder = shutil.copytree(made, tmp_path / "course")
    monkeypatch.setenv(paths.COURSE, str(folder))
    monkeypatch.chdir(folder)
    return folder


def edit(file: str, old: str, new: str) -> None:
    path = Path("solutions/toy", file)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def found() -> list[str]:
    """What lint finds, but what the toy lacks anyway."""
    return [line for line in map(str, lint.lint("toy")) if not any(word in line for word in LACKS)]


def said(monkeypatch, capsys, words: str) -> str:
    """What a command says that fails."""
    monkeypatch.setattr(sys, "argv", words.split())
    with pytest.raises(SystemExit) as ending:
        cli.main()
    assert ending.value.code == 1
    out, err = capsys.readouterr()
    assert "error in Muslin" not in out + err
    return out + err


#: File, what stands there, a slip -> what lint must say of it.
SLIPS = {
    "a truth misspelt": (
        "reference.py", "def truth_edges", "def truth_egdes",
        r"reference\.py: nobody asks for truth_egdes; did you mean truth_edges\?",
    ),
    "a truth missing": (
        "reference.py", "def truth_edges", "def _edges", r"reference\.py: there is no truth_edges: nobody says what",
    ),
    "a draw missing": (
        "reference.py", "def draw_edges", "def _edges", r"there is no draw_edges: its cases cannot be drawn",
    ),
    "a truth of other arguments": (
        "reference.py", "def truth_edges(x0, x1, x2)", "def truth_edges(x0, x1, y)",
        r"reference\.py, line \d+: truth_edges takes \(x0, x1, y\), and is given x0, x1, x2; Name its arguments",
    ),
    "a draw without an argument": (
        "reference.py", ', "mu": draw.decades(0, 4)}', "}",
        r"reference\.py, line \d+: draw_psi gives F in case 0; The manifest asks for F, mu",
    ),
    "a draw of another kind": (
        "reference.py", '"mu": draw.decades(0, 4)', '"mu": draw.vector()',
        r"draw_psi gives 3 numbers for mu in case 0; The manifest says scalar",
    ),
    "a draw of something else than numbers": (
        "reference.py", '"mu": draw.decades(0, 4)', '"mu": "soft"',
        r"draw_psi gives something else than numbers for mu in case 0",
    ),
    "a truth of another kind": (
        "reference.py", "return [P[:3], P[3:6], P[6:]]", "return P[:3]",
        r"truth_dpsi_dF gives 3 numbers for P; The manifest says mat3",
    ),
    "a tuple for a vector": (
        "reference.py", "return [P[:3], P[3:6], P[6:]]", "return P[:3], P[3:6], P[6:]",
        r"truth_dpsi_dF gives 3 results; The manifest asks for 1: P\. A vector is a list",
    ),
    "a truth that is no number": (
        "reference.py", "return mu / 2 * (dot", "return float('nan') * (dot",
        r"truth_psi gives no finite number for psi in case 0",
    ),
    "a name that is not defined": (
        "reference.py", "return mu / 2 * (dot", "return mu / 2 * (dott",
        r"reference\.py, line \d+: truth_psi raises NameError: name 'dott' is not defined",
    ),
    "no Python": ("reference.py", "def truth_psi(", "def truth_psi((", r"reference\.py, line \d+: this is not Python"),
    "an import that fails": (
        "reference.py", "import numpy as np", "import numpyy as np",
        r"reference\.py, line \d+: it cannot be read: ModuleNotFoundError: No module named 'numpyy'",
    ),
    "a truth that has changed": (
        "reference.py", "return mu / 2 * (dot", "return -mu / 2 * (dot",
        r"psi\.npz: expected_psi differs from the truth by 2\.0e\+00 .*; run: muslin reference build toy",
    ),
    "terms that have changed": (
        "reference.py", 'size_of(a["q"]) *', '2 * size_of(a["q"]) *',
        r"deformation_gradient\.npz: terms-of-the-answer differs",
    ),
    "terms that are no sizes": (
        "reference.py", 'return size_of(a["q"]) *', 'return -size_of(a["q"]) *',
        r"reference\.py, line \d+: terms_deformation_gradient gives what is no size: -",
    ),
    "properties misspelt": (
        "practice/energy.py", "properties_psi = ", "properites_psi = ",
        r"practice/energy\.py: nobody asks for properites_psi; did you mean properties_psi\?",
    ),
    "one property without a comma": (
        "practice/descent.py", "    ),\n)", "    )\n)",
        r"practice/descent\.py: properties_descend is not a tuple of Property \(one alone needs a comma",
    ),
    "a property that raises": (
        "practice/energy.py", "H - np.swapaxes(H, 1, 2)", "H - np.swapaxes(H, 1, 3)",
        r"practice/energy\.py, line \d+: the property 'symmetric' of d2psi_dF2 raises AxisError",
    ),
    "a property that does not hold": (
        "practice/energy.py", "H - np.swapaxes(H, 1, 2)", "H",
        r"practice/energy\.py.*: the solution breaks the property 'symmetric' of d2psi_dF2: it is off by",
    ),
    "a property of other inputs": (
        "practice/energy.py", '"mu": binades(rng, 2, 8, 6)}', '"nu": binades(rng, 2, 8, 6)}',
        r"the property 'symmetric' of d2psi_dF2 draws F, nu; draw F, mu",
    ),
    "a mistake that raises": (
        "reference.py", "a.right + 1.5 * a.mu", "a.right + 1.5 * a.nu",
        r"reference\.py, line \d+: the mistake 'not zero at rest' of psi raises .*: there is no argument 'nu'",
    ),
    "a mistake of another shape": (
        "reference.py", "a.right + 1.5 * a.mu", "np.zeros(7)",
        r"the mistake 'not zero at rest' makes \(7,\) of the right answers, \(10,\)",
    ),
    "a mistake in other words": (
        "reference.py", "A sheet at rest", "A sheet in peace", r"known/toy/psi\.npz: it is older than mistakes_psi;",
    ),
    "steps that raise": (
        "practice/energy.py", 'np.trace(a["F"].T', 'np.trace(a["G"].T', r"line \d+: steps_psi raises KeyError: 'G'",
    ),
    "conditions of other cases": (
        "reference.py", "axis=(1, 2))", "axis=1)", r"the condition 'F is the identity' has shape \(10, 3\), not",
    ),
    "a law that needs what is no task": (
        "reference.py", '("psi", "dpsi_dF")', '("psi", "dpsi_df")', r"needs 'dpsi_df', which is no task; did you mean",
    ),
    "what students need where they do not get it": (
        "reference.py", "def conditions_psi", "def steps_edges(a):\n    return {}\n\n\ndef conditions_psi",
        r"students do not get steps_edges: muslin explain shows none; move it to solutions/toy/practice/triangle\.py",
    ),
    "a builder of other functions": (
        "problems.py", '"gradient":', '"slope":',
        r"problems\.py, line 4: descend gives slope, and no function gradient, which the manifest asks for",
    ),
    "a builder that raises": (
        "problems.py", "A @ x + b}", "A @ x + b}[0]", r"problems\.py, line 6: descend raises KeyError: 0",
    ),
    "an entry misspelt": (
        "assignment.toml", "points = ", "pionts = ",
        r"assignment\.toml, psi: it lacks the entry 'points'; There is 'pionts': rename it",
    ),
    "a language there is not": (
        "assignment.toml", '"python"', '"pyton"',
        r"assignment\.toml, descend: there is no language 'pyton'; Did you mean python",
    ),
    "a manifest that is older": (
        "assignment.toml", "points = ", "points = 1",
        r"solutions/toy/assignment\.toml: it has been changed since toy was released; Run: muslin release toy",
    ),
}  # fmt: skip


def test_the_toy_has_no_slip(course):
    assert found() == []


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_named(slip, course):
    file, old, new, named = SLIPS[slip]
    edit(file, old, new)
    lines = found()
    assert any(re.search(named, line) for line in lines), "\n".join(lines)


@pytest.mark.parametrize(
    ("slip", "command"),
    [
        ("a draw without an argument", "muslin reference build toy"),
        ("a draw of another kind", "muslin reference build toy"),
        ("a truth of other arguments", "muslin reference build toy"),
        ("a name that is not defined", "muslin reference build toy"),
        ("a mistake that raises", "muslin reference mistakes toy"),
        ("no Python", "muslin reference build toy"),
        ("a manifest that is older", "muslin reference build toy"),
        ("a manifest that is older", "muslin check --functions solutions/toy"),
        ("an entry misspelt", "muslin release toy"),
    ],
)
def test_a_slip_is_the_authors_wherever_it_is_met(slip, command, course, monkeypatch, capsys):
    file, old, new, named = SLIPS[slip]
    edit(file, old, new)
    assert re.search(named.replace(r"\?", "").split(";")[0], said(monkeypatch, capsys, command))


def test_a_slip_keeps_a_class_from_being_graded_in_words_of_its_own(course):
    edit(*SLIPS["a name that is not defined"][:3])
    with pytest.raises(AuthorError, match=r"reference\.py, line \d+: truth_psi raises NameError"):
        muslin.grade("solutions/toy", "toy")


def test_a_property_that_raises_is_its_authors_and_answers_that_cannot_be_computed_with_are_not(course):
    good = {"x": np.zeros((5, 4))}, (np.ones((5, 4)), np.ones(5))
    for raises, breaks in (
        ("np.linalg.inv(np.zeros((2, 2)))", True),
        ("[1, 2][int(9 * out[1][0])]", True),
        ("np.zeros(3) + np.zeros(4)", False),
        ("nothing", False),
    ):
        path = Path("solutions/toy/practice/descent.py")
        path.write_text(re.sub(r"lambda a, out: .*", f"lambda a, out: {raises},", path.read_text()))
        (prop,) = judge("toy", "descend").properties
        if breaks:
            assert properties.judge(prop, *good) == np.inf
        else:
            with pytest.raises(
                AuthorError, match=r"practice/descent\.py, line \d+: the property 'the way is what x"
            ):
                properties.judge(prop, *good)


def test_a_whole_number_where_a_truth_is_a_scalar_is_no_integer(course):
    edit("reference.py", "return energy([entry for row in F for entry in row], mu)", "return 3")
    reference_data.build("toy", cases=2)
    _, (answer,) = reference.cases("toy", "psi")
    assert answer.dtype == float


def test_lint_of_an_assignment_of_ones_own_reads_its_own_suite_and_solution(course, monkeypatch, capsys):
    """Straight after `new assignment`, as that says; what is found is what is still to be written, no more."""
    monkeypatch.setattr(sys, "argv", ["muslin", "new", "assignment", "heat"])
    cli.main()
    capsys.readouterr()
    for more in ("", " --thorough"):
        lines = said(monkeypatch, capsys, f"muslin lint heat{more}").strip().splitlines()
        rest = [line for line in lines[:-1] if "TODO" not in line]
        assert [line.partition(": ")[2] for line in rest] == [
            "example has 2 of 5 misconceptions; write 3 more",
            "example has 1 of 2 right variants; write 1 more",
        ]
        assert all(line.startswith("tests/misconceptions/heat/") for line in rest)


# -------------------- what a student's machine measures with


@pytest.fixture
def at_rest(course, monkeypatch, tmp_path):
    """The toy with the terms of psi in `reference.py`, and what a student has of it: no judge, no solution."""
    text = Path("solutions/toy/practice/energy.py").read_text()
    begin = text.index("def terms_psi")
    end = text.index("def _strained")
    terms = text[begin:end]
    shared = (text[:begin] + text[end:]).replace("follows(terms_psi,", "follows(None,")
    Path("solutions/toy/practice/energy.py").write_text(shared)
    own = Path("solutions/toy/reference.py")
    own.write_text(own.read_text() + "\n\n" + terms.rstrip() + "\n")
    edit(
        "energy.py",
        "0.5 * mu * ((F.transpose() @ F).trace() - 3.0)",
        "mu * (0.1 * (F.transpose() @ F).trace() - 0.3) * 5.0",
    )
    release.release("toy")
    reference_data.build("toy", cases=10)
    student = tmp_path / "student"
    shutil.copytree("assignments/toy", student / "assignments" / "toy")
    shutil.copytree("data", student / "data")
    work = shutil.copytree("solutions/toy", tmp_path / "work")
    shutil.rmtree(work / "practice")
    (work / "reference.py").unlink()
    return work, student


def test_a_right_answer_is_right_on_a_students_machine_though_its_terms_stay_with_the_author(
    at_rest, monkeypatch
):
    """At rest it is a small difference of large numbers: 1e-17 where nothing belongs."""
    work, student = at_rest
    assert secret("toy", "terms_psi")
    (verdict,) = checking.check(muslin.load(work, "toy"), ["psi"])
    assert verdict.ok
    inputs, _ = reference.cases("toy", "psi")
    graders = judge("toy", "psi").terms(inputs)
    monkeypatch.setenv(paths.COURSE, str(student))
    assert judge("toy", "psi").truth is None
    (verdict,) = checking.check(muslin.load(work, "toy"), ["psi"])
    assert verdict.ok, verdict.message
    ours = judge("toy", "psi").terms
    assert list(ours(inputs)) == list(graders)
    some = [7, 2]
    assert list(ours({name: array[some] for name, array in inputs.items()})) == list(graders[some])
    assert list(ours({**inputs, "mu": inputs["mu"] + 1})) == [0.0] * 10


def test_without_what_is_recorded_it_would_be_wrong_there(at_rest, monkeypatch):
    work, student = at_rest
    monkeypatch.setenv(paths.COURSE, str(student))
    monkeypatch.setattr(measured, "terms", lambda *_: None)
    (verdict,) = checking.check(muslin.load(work, "toy"), ["psi"])
    assert not verdict.ok


def test_terms_that_students_have_as_a_function_are_not_recorded(course):
    assert judge("toy", "psi").terms is not None
    for task, recorded in (("psi", False), ("deformation_gradient", True), ("edges", False)):
        with np.load(f"data/reference/toy/{task}.npz") as data:
            assert (measured.TERMS in data.files) is recorded, task


def test_no_pack_is_made_whose_public_data_are_older_than_the_terms(course, monkeypatch, capsys, tmp_path):
    edit(
        "reference.py",
        "def conditions_psi",
        "def terms_edges(a):\n    return size_of(a['x0'])\n\n\ndef conditions_psi",
    )
    told = said(monkeypatch, capsys, f"muslin pack students --assignment toy --out {tmp_path / 'pack'}")
    assert (
        "older than terms_edges: on students' machines right answers could fail. Run: muslin reference"
        in told
    )
    assert any("edges.npz: terms-of-the-answer is missing" in line for line in found())


# -------------------- refusals


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        ("triangle.py", "@ti.func\n", "", 'edges is no Taichi function. Write "@ti.func" above def edges'),
        (
            "assignment.toml",
            "hints = [",
            'needs = ["psy"]\nhints = [',
            "psi: it needs 'psy', which is no task. Did you",
        ),
        ("README.md", "# Toy", "# way = step * gradient(x)", "line 9). Say it in other words."),
    ],
)
def test_a_release_refuses_what_cannot_be_worked_on(file, old, new, told, course, monkeypatch, capsys):
    edit(file, old, new)
    assert told in said(monkeypatch, capsys, "muslin release toy")


def test_a_release_names_what_is_left_over(course, monkeypatch, capsys):
    Path("assignments/toy/spare.py").write_text("", encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["muslin", "release", "toy"])
    cli.main()
    assert (
        "assignments/toy/spare.py is left over: nothing in the solution leads to it. Delete it."
        in " ".join(capsys.readouterr().out.split())
    )


@pytest.mark.parametrize("place", ["solutions/toy/hidden", "hid", "assignments/hid", "data/reference/hid"])
def test_hidden_data_do_not_lie_where_all_else_is_shared_from(place, course):
    with pytest.raises(MuslinError, match="Choose a folder outside"):
        reference_data.build("toy", place, "a secret", 1, hidden=True)
    assert not Path(place).exists()
    assert os.environ[paths.COURSE]


def test_an_assignment_misspelt_is_named(course, monkeypatch, capsys):
    assert "Did you mean toy?" in said(monkeypatch, capsys, "muslin release tpy")
