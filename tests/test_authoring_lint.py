"""The publisher's lint: cloth passes, and every seeded authoring mistake is named."""

from __future__ import annotations

import hashlib
import inspect
import re
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest

from muslin.authoring import lint as linting
from muslin.authoring import reference_data
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import cases, exact


@pytest.fixture(scope="module", autouse=True)
def worked_out_once():
    """What is true and what is drawn is worked out once for all copies whose judges are the same.

    That takes the lint seconds, and no mistake below is one of a judge; all else is looked at anew in each copy.
    """
    known, answers, draw_inputs = {}, exact.answers, cases.draw_inputs

    def judges(folder):
        files = sorted((*folder.rglob("*.py"), *folder.parent.glob("*.toml")))
        return hashlib.sha256(b"".join(path.read_bytes() for path in files)).digest()

    def answered(function, inputs):
        file = Path(inspect.getfile(inspect.unwrap(function)))
        asked = [(name, array.shape, np.asarray(array).tobytes()) for name, array in sorted(inputs.items())]
        key = (judges(file.parent), file.name, function.__qualname__, *asked)
        if key not in known:
            known[key] = answers(function, inputs)
        return tuple(array.copy() for array in known[key])

    def drawn(assignment, *asked):
        key = (judges(paths.source(assignment) / "judge"), assignment, *asked)
        if key not in known:
            known[key] = draw_inputs(assignment, *asked)
        return {name: array.copy() for name, array in known[key].items()}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exact, "answers", answered)
        patch.setattr(cases, "draw_inputs", drawn)
        yield


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{old!r} is not in {path}"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


MANIFEST = Path("solutions/cloth/assignment.toml")
HANDOUT = Path("solutions/cloth/README.md")
SUITE = Path("tests/misconceptions/cloth/phi.py")


def hints_of(number: int):
    """Cut the hints of phi down."""
    text = MANIFEST.read_text(encoding="utf-8")
    start = text.index("hints = [\n", text.index("[task.phi]")) + len("hints = [\n")
    end = text.index("]\n", start)
    kept = "".join(text[start:end].splitlines(keepends=True)[:number])
    MANIFEST.write_text(text[:start] + kept + text[end:], encoding="utf-8")


def variants_of(verdict: str, number: int):
    """Keep so many variants of a verdict in the suite of phi."""
    blocks = re.split(r"^(?=# (?:wrong|right): )", SUITE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    chosen = [block for block in blocks if block.startswith(f"# {verdict}")]
    SUITE.write_text("".join(block for block in blocks if block not in chosen[number:]), encoding="utf-8")


def answer_in(path: str):
    Path(path).write_text("Hint: try  phi[0]*x0 + phi[1]*x1 + phi[2]*x2  first.\n", encoding="utf-8")


def damage(path: Path):
    data = bytearray(path.read_bytes())
    data[-2000] ^= 1  # in the last array, whose checksum the zip has: write it again
    path.write_bytes(data)


def other_data(path: Path):
    with np.load(path) as found:
        arrays = dict(found)
    arrays["expected_phi"][3, 1] += 1e-9
    np.savez(path, **arrays)


def hidden_in(folder: str):
    with tempfile.TemporaryDirectory() as elsewhere:
        reference_data.build("cloth", elsewhere, "a secret", 1, hidden=True)
        shutil.copytree(elsewhere, folder)


#: What an author does wrong -> what the lint must say of it.
MISTAKES = {
    "a task without hints": (lambda: hints_of(0), r"assignment\.toml, phi: it has no hints; write at least"),
    "a single hint": (lambda: hints_of(1), r"assignment\.toml, phi: it has 1 hint;"),
    "no points": (
        lambda: edit(MANIFEST, "points = 5", "points = 0"),
        r"assignment\.toml, phi: its points are 0; give it a whole number",
    ),
    "points that are text": (
        lambda: edit(MANIFEST, "points = 5", 'points = "five"'),
        r"assignment\.toml, phi: its points are 'five'",
    ),
    "a misspelt field": (
        lambda: edit(MANIFEST, "hints = [", "hnits = ["),
        r"assignment\.toml, phi: there is no entry 'hnits'; the entries of a task are .*hints",
    ),
    "a kind that does not exist": (
        lambda: edit(MANIFEST, 'phi = "vec3', 'phi = "vector3'),
        r"'vector3 \[1\] barycentric coordinates' does not describe a value; Write .*vecN",
    ),
    "a prerequisite that does not exist": (
        lambda: edit(MANIFEST, "[task.phi]\n", '[task.phi]\nneeds = ["barycentric"]\n'),
        r"assignment\.toml, phi: it needs 'barycentric', which is no task",
    ),
    "prerequisites in a circle": (
        lambda: (
            edit(MANIFEST, "[task.phi]\n", '[task.phi]\nneeds = ["interpolate"]\n'),
            edit(MANIFEST, "[task.interpolate]\n", '[task.interpolate]\nneeds = ["phi"]\n'),
        ),
        r"(phi needs interpolate needs phi|interpolate needs phi needs interpolate): a circle",
    ),
    "a section the handout lacks": (
        lambda: edit(HANDOUT, "\n## S4 Kinetic energy", "\n## Kinetic energy"),
        r"README\.md: there is no section S4, which mass_block belongs to",
    ),
    "a task the handout does not teach": (
        lambda: edit(HANDOUT, "\n### mass_block\n", "\n"),
        r"README\.md: the handout does not teach mass_block",
    ),
    "too few misconceptions": (
        lambda: variants_of("wrong", 4),
        r"phi\.py: phi has 4 of 5 misconceptions; write 1 more",
    ),
    "too few right variants": (lambda: variants_of("right", 1), r"phi\.py: phi has 1 of 2 right variants"),
    "no misconceptions at all": (SUITE.unlink, r"cloth/phi\.py: phi has no misconceptions; write 5 wrong"),
    "a variant of another function": (
        lambda: edit(SUITE, "def phi(", "def chi("),
        r"phi\.py: the variant 'vertex-0-not-subtracted' does not define phi",
    ),
    "a solution with a mistake": (
        lambda: edit(Path("solutions/cloth/collision.py"), "v - d * n", "v + d * n"),
        r"solutions/cloth/collision\.py, filter_velocity: the solution fails: wrong in case",
    ),
    "a stub that is already written": (
        lambda: shutil.copy("solutions/cloth/stress.py", "assignments/cloth/stress.py"),
        r"assignments/cloth/stress\.py, dpsi_dF: the stub is already written; run: muslin release cloth",
    ),
    "a stub that is not Python": (
        lambda: edit(Path("assignments/cloth/stress.py"), "import taichi", "import taichi taichi"),
        r"assignments/cloth/stress\.py, dpsi_dF: the stub cannot be used: .*Python cannot read this",
    ),
    "a release out of step": (
        lambda: edit(HANDOUT, "# Cloth", "# The cloth"),
        r"assignments/cloth/README\.md, line \d+: stale or edited by hand; .*muslin release cloth",
    ),
    "an answer among the data": (
        lambda: answer_in("data/meshes/notes.txt"),
        r"data/meshes/notes\.txt, line 1: gives away .*shape_functions\.py, line \d+.*; students get",
    ),
    "an answer in the framework": (
        lambda: answer_in("framework/muslin/notes.md"),
        r"framework/muslin/notes\.md, line 1: gives away",
    ),
    "solutions in the wheel": (
        lambda: edit(
            Path("pyproject.toml"), '"data" = ', '"solutions" = "muslin/_shipped/solutions"\n"data" = '
        ),
        r"pyproject\.toml: the wheel holds solutions/cloth/collision\.py; solutions stay here",
    ),
    "hidden data among the data": (
        lambda: hidden_in("data/reference/hidden"),
        r"data/reference/hidden: hidden reference data \(their seed is not the public one\)",
    ),
    "hidden data beside the solution": (
        lambda: hidden_in("solutions/cloth/hidden"),
        r"solutions/cloth/hidden: reference data beside the solution; move solutions/cloth/hidden out",
    ),
    "a hidden file among the public ones": (
        lambda: shutil.copy("data/reference/cloth/phi.npz", "data/reference/cloth/phi-hidden.npz"),
        r"data/reference/cloth/phi-hidden\.npz: reference data that are not on record",
    ),
    "reference data missing": (
        Path("data/reference/cloth/phi.npz").unlink,
        r"data/reference/cloth: phi\.npz: cannot be read",
    ),
    "reference data changed": (
        lambda: other_data(Path("data/reference/cloth/phi.npz")),
        r"data/reference/cloth: phi\.npz: its content is not what the provenance says",
    ),
    "a docstring that forgets an argument": (
        lambda: edit(
            Path("solutions/cloth/kinetic_energy.py"), "    area    : undeformed area", "    A : what is"
        ),
        r"kinetic_energy\.py, mass_block: its docstring does not say what area is; add shape and unit",
    ),
    "a line left to be written": (
        lambda: edit(HANDOUT, "## S4 Kinetic energy\n", "## S4 Kinetic energy\n\nTODO: derive it.\n"),
        r"README\.md, line \d+: still TODO: derive it",
    ),
}


def test_cloth_has_nothing_to_fix():
    assert [str(finding) for finding in linting.lint("cloth")] == []


def test_there_are_at_least_ten_mistakes_to_name():
    assert len(MISTAKES) >= 10


@pytest.mark.parametrize("mistake", MISTAKES)
def test_an_authoring_mistake_is_named(mistake, repository):
    make, named = MISTAKES[mistake]
    make()
    findings = [str(finding) for finding in linting.lint("cloth")]
    assert [line for line in findings if re.search(named, line)], "\n".join(findings)
    assert all("\n" not in line and line.count("; ") >= 1 for line in findings)


def test_an_unknown_assignment_is_refused():
    with pytest.raises(MuslinError, match=r"no assignment 'clot'.*There is: cloth"):
        linting.lint("clot")
