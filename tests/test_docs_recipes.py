"""The recipes of the documentation work: each is followed, word for word, in a copy of the repository.

A block whose title is a file name is that file; a block of changes is made in the file it names; commands are run
and must print the lines shown below them, in order, where `...` stands for what may differ.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
RECIPES = sorted(path for path in (ROOT / "docs" / "recipes").glob("*.md") if path.stem != "index")
COPIED = ("assignments", "data", "framework", "solutions", "tests")
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)

#: Lines of a page, code included; a placeholder and what replaces it count once.
LONGEST = 120


def changed(text: str, diff: str) -> str:
    """Text with the changes of a diff without line numbers: what is kept or taken away must be there, once."""
    lines = diff.splitlines()
    assert all(line[:1] in "+- " for line in lines), "a line of a diff begins with +, - or a blank"
    before = "".join(f"{line[1:]}\n" for line in lines if line[:1] != "+")
    after = "".join(f"{line[1:]}\n" for line in lines if line[:1] != "-")
    assert text.count(before) == 1, f"found {text.count(before)} times:\n{before}"
    return text.replace(before, after)


def shown(said: str, expected: str) -> bool:
    """Whether what was said has the lines that were expected, `...` being anything."""
    anything = r"[\s\S]*?"
    pattern = anything.join(re.escape(part) for part in expected.strip("\n").split("..."))
    return re.search(pattern, said) is not None


@pytest.fixture
def checkout(tmp_path):
    """A copy of the repository, with `muslin`, `pytest` and `python` that run it."""
    folder = tmp_path / "muslin"
    ignored = shutil.ignore_patterns("__pycache__", "*.pyc", ".*", "benchmarks", "attacks")
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", folder)
    programs = tmp_path / "bin"
    programs.mkdir()
    for name, module in {"muslin": "-m muslin.cli", "pytest": "-m pytest", "python": ""}.items():
        program = programs / name
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}" {module} "$@"\n', encoding="utf-8")
        program.chmod(0o755)
    environment = os.environ | {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(folder / "framework"),
        "COLUMNS": "110",
    }
    return folder, environment


@pytest.mark.skipif(os.name == "nt", reason="the recipes' commands are for a Unix shell")
@pytest.mark.parametrize("recipe", RECIPES, ids=lambda path: path.stem)
def test_a_recipe_does_what_it_says(recipe, checkout):
    folder, environment = checkout
    text = recipe.read_text(encoding="utf-8")
    blocks = BLOCK.findall(text)
    assert sum(kind == "sh" for kind, _, _ in blocks), "a recipe says how to try it"
    said = None
    for kind, title, content in blocks:
        if kind == "diff":
            file = folder / title
            file.write_text(changed(file.read_text(encoding="utf-8"), content), encoding="utf-8")
        elif kind == "sh":
            done = subprocess.run(
                ["sh", "-e", "-c", content], cwd=folder, env=environment, capture_output=True, text=True,
                timeout=300, check=False,
            )  # fmt: skip
            said = done.stdout + done.stderr
            assert done.returncode == 0, said
        elif kind == "text":
            assert said is not None
            assert shown(said, content), f"expected:\n{content}\ngot:\n{said}"
        else:
            assert title, f"a block of {kind} without a file name"
            (folder / title).parent.mkdir(parents=True, exist_ok=True)
            (folder / title).write_text(content, encoding="utf-8")
    assert_tidy(folder, blocks)


def assert_tidy(folder: Path, blocks: list[tuple[str, str, str]]) -> None:
    """Files of a recipe are in the house style, if the tool for it is installed."""
    ruff = shutil.which("ruff", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    files = sorted({title for _, title, _ in blocks if title.endswith(".py") and "mistaken" not in title})
    if ruff is None:
        return
    for command in (["check", "--force-exclude"], ["format", "--check", "--force-exclude"]):
        done = subprocess.run(
            [ruff, *command, "--no-cache", *files], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda path: path.stem)
def test_a_recipe_fits_on_a_page(recipe):
    lines = recipe.read_text(encoding="utf-8").splitlines()
    assert sum(bool(line.strip()) and not line.startswith("-") for line in lines) <= LONGEST


def test_every_recipe_is_listed():
    index = (ROOT / "docs" / "recipes" / "index.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"\]\((\w+)\.md\)", index)) == [path.stem for path in RECIPES]


def test_changes_are_made_where_they_fit_and_nowhere_else():
    assert changed("a\nb\nc\n", " a\n-b\n+d\n") == "a\nd\nc\n"
    with pytest.raises(AssertionError, match="found 0 times"):
        changed("a\nb\n", "-x\n")
    with pytest.raises(AssertionError, match="found 2 times"):
        changed("a\na\n", "-a\n")


def test_what_is_said_is_compared_line_by_line():
    assert shown("x\nruns/flag.png\ny\n", "...\nruns/flag.png\n...\n")
    assert shown("1 passed in 0.5s\n", "1 passed in ...\n")
    assert not shown("1 failed in 0.5s\n", "1 passed in ...\n")
