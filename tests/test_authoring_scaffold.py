"""A new task and a new assignment work at once, overwrite nothing, and the lint says what is left to write."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import muslin
from muslin import cli, tasks
from muslin.authoring import lint, reference_data, scaffold
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import checking

ROOT = Path(__file__).resolve().parent.parent


def run(monkeypatch, capsys, words: str) -> tuple[int, str, str]:
    """Run a command line `muslin ...` in this process: exit code, output, errors."""
    monkeypatch.setattr(sys, "argv", words.split())
    try:
        cli.main()
        code = 0
    except SystemExit as ending:
        code = int(ending.code or 0)
    return code, *capsys.readouterr()


def everything() -> dict[Path, bytes]:
    return {p: p.read_bytes() for p in Path().rglob("*") if p.is_file() and "__pycache__" not in p.parts}


def test_a_new_assignment_works_at_once(repository, monkeypatch, capsys):
    code, out, err = run(monkeypatch, capsys, "muslin new assignment heat")
    assert code == 0, err
    assert "muslin lint heat" in out
    table = tasks.assignment("heat")
    assert list(table.tasks) == ["example"]
    assert all(verdict.ok for verdict in checking.check(muslin.load("solutions/heat", table)))
    assert not any(verdict.ok for verdict in checking.check(muslin.load("assignments/heat", table)))
    assert muslin.grade("solutions/heat", "heat").score == 5
    assert muslin.grade("assignments/heat", "heat").score == 0
    assert reference_data.verify("heat").ok
    findings = [str(finding) for finding in lint.lint("heat", thorough=True)]
    unwritten = [line for line in findings if "TODO" in line]
    assert len(unwritten) > 10
    assert {line.split(", line")[0].rsplit("/", 1)[-1] for line in unwritten} == {
        "README.md", "assignment.toml", "example.py", "reference.py"
    }  # fmt: skip
    rest = [line for line in findings if line not in unwritten]
    assert [line.split(": ", 1)[1] for line in rest] == [
        "example has 2 of 5 misconceptions; write 3 more",
        "example has 1 of 2 right variants; write 1 more",
    ]


def test_a_new_assignment_is_graded_where_there_are_no_solutions(repository, tmp_path_factory, monkeypatch):
    """As on Gradescope: what the judges know lies in a folder that graders alone have."""
    scaffold.new_assignment("heat")
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "judge" / "heat").mkdir(parents=True)
    shutil.copy("solutions/heat/reference.py", elsewhere / "judge" / "heat")
    for name in ("assignments", "data"):
        shutil.copytree(name, elsewhere / name)
    work = shutil.copytree("solutions/heat", elsewhere / "work")
    monkeypatch.setattr(paths, "_REPOSITORY", elsewhere / "nowhere")
    monkeypatch.setattr(paths, "_SHIPPED", elsewhere)
    assert not paths.in_repository()
    record = muslin.grade(work, "heat")
    assert record.score == 5
    assert record.hidden["cases"] == 20


def test_a_new_task_of_cloth_works_at_once(repository, monkeypatch, capsys):
    before = everything()
    code, _, err = run(
        monkeypatch, capsys, "muslin new task stretch_rate --file strain_energy.py --section S5"
    )
    assert code == 0, err
    table = tasks.assignment("cloth")
    assert list(table.tasks)[-1] == "stretch_rate"
    assert (table.tasks["stretch_rate"].file, table.tasks["stretch_rate"].section) == (
        "strain_energy.py",
        "S5",
    )
    (verdict,) = checking.check(muslin.load("solutions/cloth"), ["stretch_rate"])
    assert verdict.ok
    handout = (repository / "solutions/cloth/README.md").read_text(encoding="utf-8")
    place = handout.index("### stretch_rate")
    assert handout.index("## S5 ") < place < handout.index("## S6 ")
    findings = [str(finding) for finding in lint.lint("cloth")]
    assert findings
    rest = [line for line in findings if "TODO" not in line and "stretch_rate has" not in line]
    assert rest == []
    after = everything()
    changed = {path.as_posix() for path in before if after[path] != before[path]}
    assert changed == {
        "solutions/cloth/assignment.toml", "solutions/cloth/README.md", "solutions/cloth/strain_energy.py",
        "assignments/cloth/assignment.toml", "assignments/cloth/README.md", "assignments/cloth/strain_energy.py",
        "assignments/cloth/handout.html", "data/reference/cloth/provenance.json",
    }  # fmt: skip
    for path in changed:  # what was there is still there
        lines = before[Path(path)].decode().splitlines()
        kept = after[Path(path)].decode().splitlines()
        if "solutions" in path:
            assert [line for line in lines if line.strip() and line not in kept] == []


def test_a_task_may_bring_a_section_of_its_own(repository):
    scaffold.new_assignment("heat")
    scaffold.new_task("flux", "heat")
    scaffold.new_task("source", "heat", "flux.py", "S2")
    table = tasks.assignment("heat")
    assert [(task.file, task.section) for task in table.tasks.values()] == [
        ("example.py", "S1"), ("flux.py", "S2"), ("flux.py", "S2")
    ]  # fmt: skip
    headings = re.findall(
        r"^##+ (\w+)", Path("solutions/heat/README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert headings == ["All", "S1", "example", "S2", "flux", "source"]
    assert all(verdict.ok for verdict in checking.check(muslin.load("solutions/heat", "heat")))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("assignment cloth", "There already is solutions/cloth"),
        ("assignment Heat!", "cannot be the name of an assignment"),
        ("task phi", "There already is a task phi"),
        ("task lambda", "cannot be the name of a function"),
        ("task 2nd", "cannot be the name of a function"),
        ("task fresh --file ../stress.py", "cannot be a file of tasks"),
        ("task fresh --section ##", "cannot be a section"),
        ("task fresh --assignment clot", "no assignment 'clot'. Did you mean cloth?"),
    ],
)
def test_nothing_is_overwritten(repository, monkeypatch, capsys, words, said):
    before = everything()
    code, _, err = run(monkeypatch, capsys, f"muslin new {words}")
    assert code == 1
    assert said in err
    assert everything() == before


def test_a_scaffold_that_fails_leaves_everything_as_it_was(repository, monkeypatch):
    def fail(*_, **__):
        Path("data/reference/cloth/fresh.npz").write_bytes(b"half")
        raise MuslinError("The disk is full.")

    monkeypatch.setattr(reference_data, "build", fail)
    before = everything()
    with pytest.raises(MuslinError, match="disk is full"):
        scaffold.new_task("fresh")
    assert everything() == before
    with pytest.raises(MuslinError, match="disk is full"):
        scaffold.new_assignment("heat")
    assert {path for path in everything() if "heat" in str(path)} == set()


# -------------------- the recipes of the handbook


def recipe(title: str) -> str:
    """The shell block under a heading of docs/instructor.md."""
    text = (ROOT / "docs" / "instructor.md").read_text(encoding="utf-8")
    part = re.split(rf"^##+ {re.escape(title)}$", text, flags=re.MULTILINE)[1]
    block = re.search(r"```sh\n(.*?)```", part.split("\n## ")[0], re.DOTALL)
    assert block, f"no recipe under {title!r}"
    return block[1]


@pytest.mark.skipif(shutil.which("bash") is None, reason="the recipes are for a shell")
@pytest.mark.parametrize("title", ["A class, from nothing to grades", "Add a task", "Add an assignment"])
def test_a_recipe_of_the_handbook_works_as_it_is_written(title, repository, tmp_path_factory):
    program = tmp_path_factory.mktemp("bin") / "muslin"
    start = f"import sys; sys.path.insert(0, {str(repository / 'framework')!r}); from muslin.cli import main; main()"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{start}" "$@"\n')
    program.chmod(0o755)
    (repository / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "constraints.txt", repository / ".ci")
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", f'PATH="{program.parent}:$PATH"\n' + recipe(title)],
        cwd=repository, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
