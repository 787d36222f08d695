"""The handout as a page: whole, in step with the handout, and where the check points to."""

import re
import sys
from html.parser import HTMLParser

import pytest

from muslin import cli
from muslin.authoring import page
from muslin.base import paths
from muslin.student import workspace
from muslin.student.checking import Report, told

HANDOUT = (paths.assignment("cloth") / "README.md").read_text(encoding="utf-8")
PAGE = (paths.assignment("cloth") / page.PAGE).read_text(encoding="utf-8")


class Reader(HTMLParser):
    """Anchors, links, pictures and scripts of a page, and its text outside code."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.links, self.pictures, self.tags, self.words, self.code = [], [], [], [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.append(tag)
        self.code += tag in ("code", "style")
        self.anchors += [found["id"]] if "id" in found else []
        self.links += [found["href"]] if "href" in found else []
        self.pictures += [found["src"]] if "src" in found else []

    def handle_endtag(self, tag):
        self.code -= tag in ("code", "style")

    def handle_data(self, data):
        self.words += [] if self.code else [data]


READER = Reader(PAGE)


def test_the_page_in_the_release_is_made_from_the_handout_in_the_release():
    assert PAGE.splitlines()[0] == page.origin(HANDOUT)


def test_every_task_has_its_place_on_the_page_and_no_link_leads_nowhere():
    tasks = workspace.assignment("cloth").tasks
    assert {task.lower() for task in tasks} <= set(READER.anchors)
    assert {link[1:] for link in READER.links if link.startswith("#")} <= set(READER.anchors)
    for picture in READER.pictures:
        assert (paths.assignment("cloth") / picture).is_file()


def test_the_page_needs_no_network_and_no_script_and_no_latex_is_left_over():
    assert "script" not in READER.tags
    assert "link" not in READER.tags
    assert not [picture for picture in READER.pictures if ":" in picture]
    assert READER.tags.count("math") > 150
    words = "".join(READER.words)
    assert "$" not in words
    assert "MATHS" not in words
    assert not re.search(r"\\[a-z]", words)


def test_a_formula_and_a_list_become_what_they_are():
    pytest.importorskip("latex2mathml")
    pytest.importorskip("markdown")
    made = page.page("# A\n\n- one $x^2$\n\n  ```math\n  y\n  ```\n\n| a |\n| --- |\n| `$x$` |\n", "A")
    assert "<msup>" in made
    assert made.count("<math") == 2
    assert "<code>$x$</code>" in made


def test_the_check_points_to_the_task_on_the_page(tmp_path):
    workspace.start("cloth", tmp_path / "w")
    here = workspace.find(tmp_path / "w")
    lines = told(here, Report("dn_dx", "wrong", "off by a sign", 3))
    read = next(line for line in lines if "read:" in line)
    assert f"{(tmp_path / 'w' / page.PAGE).as_uri()}#dn_dx" in read
    number = int(re.search(r"README\.md:(\d+)", read)[1])
    assert HANDOUT.splitlines()[number - 1] == "### dn_dx"


def test_the_handout_is_opened_at_a_task(monkeypatch, capsys, tmp_path):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    workspace.start("cloth", tmp_path / "w")
    monkeypatch.chdir(tmp_path / "w")
    for words in (["handout"], ["handout", "psi"]):
        monkeypatch.setattr(sys, "argv", ["muslin", *words])
        cli.main()
    address = (tmp_path / "w" / page.PAGE).as_uri()
    assert opened == [address, f"{address}#psi"]
    assert capsys.readouterr().out.split() == opened


def test_a_variable_that_agrees_by_chance_is_not_called_another_quantity(tmp_path):
    """In case 10 of phi the point is the vertex X2, so that X - X0 is the edge X2 - X0."""
    from muslin.student import explaining

    text = (paths.solution("cloth") / "shape_functions.py").read_text(encoding="utf-8")
    named = "    e2 = X2 - X0\n    r = X - X0\n"
    (tmp_path / "shape_functions.py").write_text(
        text.replace("    D = ", f"{named}    D = ", 1), encoding="utf-8"
    )
    lines = list(explaining.steps(tmp_path, "cloth", "phi", 10))
    assert not [line for line in lines if " e2 = " in line and "this is" in line]
    assert [line for line in lines if " r = " in line and line.endswith("this is X - X0")]


@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_the_questions_are_a_page_too_and_the_pages_lead_to_each_other(assignment, tmp_path):
    workspace.start(assignment, tmp_path / "w")
    found = {}
    for source, name in page.PAGES.items():
        made = (tmp_path / "w" / name).read_text(encoding="utf-8")
        assert made.splitlines()[0] == page.origin((tmp_path / "w" / source).read_text(encoding="utf-8"))
        found[name] = Reader(made)
    questions = found["experiments/questions.html"]
    assert questions.tags.count("math") > 5
    assert "$" not in "".join(questions.words)
    for name, reader in found.items():
        for link in (link for link in reader.links if ":" not in link):
            file, _, anchor = link.partition("#")
            target = ((tmp_path / "w" / name).parent / file).resolve() if file else tmp_path / "w" / name
            assert target.is_file(), (name, link)
            assert target.suffix == ".html", (name, link)
            there = found[target.relative_to((tmp_path / "w").resolve()).as_posix()] if file else reader
            assert not anchor or anchor in there.anchors, (name, link)
    assert "experiments/questions.html" in found["handout.html"].links
