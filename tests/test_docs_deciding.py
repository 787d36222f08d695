"""The page for a decision is true: every function, point and dependency of today is on it, and no other."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import pytest

from muslin import tasks
from muslin.authoring.wheel import read_toml

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "deciding.md").read_text(encoding="utf-8")


def section(title):
    """A section of the page."""
    return re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S)[1]


def rows(text):
    """Rows of the tables in it, without their heads."""
    lines = [line.strip("|").split("|") for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line] for line in lines if not set("".join(line)) <= set("-: ")]


@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_the_mapping_to_the_lecture_has_every_function_with_its_points(assignment):
    table = tasks.assignment(assignment)
    found, said = [], 0
    for lecture, where, functions, points in rows(section("Where it is in the lecture"))[1:]:
        if ("(solids)" in lecture) != (assignment == "solids"):
            continue
        named = re.findall(r"`(\w+)`", functions)
        assert sum(table.tasks[name].points for name in named) == int(points), lecture
        first, _, last = where.replace(",", " to").partition(" to ")
        assert {table.tasks[name].section for name in named} <= {
            f"S{k}" for k in range(int(first[1:]), int((last or first)[1:]) + 1)
        }
        found += named
        said += int(points)
    assert sorted(found) == sorted(table.tasks)
    assert said == 100


def test_the_sizes_it_tells_are_those_of_the_assignments():
    words = {6: "six", 7: "seven"}
    for name in ("cloth", "solids"):
        table = tasks.assignment(name)
        assert re.search(
            rf"handouts/{name}/index\.md\), {len(table.tasks)}(\s+functions)? in {words[len(table.files)]}",
            PAGE,
        ), name


def test_the_hours_add_up():
    hours = {
        what: cell.strip("*")
        for _, what, cell in rows(section("What a week looks like"))[1:]
        if "S" in what or "all" in what
    }
    whole = float(hours.pop("**in all**"))
    assert sum(map(float, hours.values())) == whole
    assert "our estimate" in section("What a week looks like")


def test_every_dependency_has_its_licence_there():
    project = read_toml(ROOT / "pyproject.toml")["project"]
    extras = project["optional-dependencies"]
    needed = [*project["dependencies"], *extras["fast"], *extras["view"], *extras["class"]]
    names = {re.match(r"[\w.-]+", text)[0] for text in needed} - {"muslin"}
    told = " ".join(line[0] for line in rows(section("Licences")))
    assert {name for name in names if not re.search(rf"\b{re.escape(name)}\b", told)} == set()


def test_every_command_on_it_exists(monkeypatch, capsys):
    from muslin import cli

    fenced = re.findall(r"^```sh\n(.*?)^```", PAGE, re.M | re.S)
    inline = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", PAGE, flags=re.M | re.S))
    commands = set(re.findall(r"\bmuslin ((?:class )?[a-z]+)", " ".join([*fenced, *inline])))
    assert {"demo", "play", "grade", "doctor", "pack"} <= commands
    for command in sorted(commands):
        monkeypatch.setattr("sys.argv", ["muslin", *command.split(), "--help"])
        with contextlib.suppress(SystemExit):
            cli.main()
        # "Usage: muslin", or where pytest was started as a module "python -m pytest.muslin"
        assert re.search(r"Usage: .*\bmuslin", capsys.readouterr().out), command


@pytest.mark.parametrize(
    ("words", "page", "heading"),
    [
        ("films", "gallery.md", "Gallery"),
        ("hours", "deciding.md", "What a week looks like"),
        ("mapping to the lecture", "deciding.md", "Where it is in the lecture"),
        ("licence", "deciding.md", "Licences"),
        ("solutions are public", "integrity.md", "Integrity: the solutions are public"),
    ],
)
def test_a_newcomer_is_one_click_from_what_decides(words, page, heading):
    front = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    links = [target for said, target in re.findall(r"\[([^\]]+)\]\(([^)]+)\)", front) if words in said]
    anchor = re.sub(r"[^\w-]", "", heading.lower().replace(" ", "-"))
    assert any(target in (page, f"{page}#{anchor}") for target in links), links
    assert re.search(rf"^#+ {re.escape(heading)}$", (ROOT / "docs" / page).read_text(encoding="utf-8"), re.M)
