"""How the framework's files are made: kernels apart from what is typed, and no file too long to be read at once."""

import ast
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
FRAMEWORK = ROOT / "framework" / "muslin"

#: Lines a file may have, unless it says why it has more: a line of its docstring begins with these words.
LONGEST, REASON = 400, "Longer than others:"


def name_of(file):
    return ".".join(file.relative_to(ROOT / "framework").with_suffix("").parts)


def engine_functions(tree):
    """Functions that the engine compiles, in a syntax tree."""
    marks = ("ti.kernel", "ti.func", "ti.pyfunc")
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any(ast.unparse(mark) in marks for mark in node.decorator_list)
    ]


def untyped_modules():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (exempt,) = (o for o in settings["tool"]["mypy"]["overrides"] if o.get("ignore_errors"))
    return set(exempt["module"])


def test_types_are_checked_in_every_file_that_is_not_made_of_kernels():
    untyped = untyped_modules()
    for name in untyped - {"muslin.given"}:
        file = ROOT / "framework" / Path(*name.split(".")).with_suffix(".py")
        tree = ast.parse(file.read_text(encoding="utf-8"))
        classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]  # records, at most
        assert not [n for c in classes for n in ast.walk(c) if isinstance(n, ast.FunctionDef)], name
        compiled = engine_functions(tree)
        for function in (node for node in tree.body if isinstance(node, ast.FunctionDef)):
            made = [inner for inner in ast.walk(function) if inner in compiled]
            hands_on = function.name == "fused"  # keeps what `_kernel` makes
            assert made or hands_on, f"{name}.{function.name} is no kernel and makes none"


def test_kernels_have_files_of_their_own():
    asks_whether_the_engine_works = {"muslin.doctor.compiling"}
    for file in FRAMEWORK.rglob("*.py"):
        if engine_functions(ast.parse(file.read_text(encoding="utf-8"))):
            assert name_of(file) in untyped_modules() | asks_whether_the_engine_works


@pytest.mark.parametrize("folder", ["framework", "solutions"])
def test_a_file_too_long_to_be_read_at_once_says_why(folder):
    long = {}
    for file in (ROOT / folder).rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        if len(text.splitlines()) > LONGEST and REASON not in (ast.get_docstring(ast.parse(text)) or ""):
            long[str(file.relative_to(ROOT))] = len(text.splitlines())
    assert not long
