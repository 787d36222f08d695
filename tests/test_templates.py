"""Pages from templates: every value is escaped, and what a page is made of is in the wheel."""

import re
from pathlib import Path

import pytest

from muslin.authoring import wheel
from muslin.base import templates

PACKAGE = Path(templates.__file__).parent.parent
ROOT = PACKAGE.parent.parent
TEMPLATES = sorted(PACKAGE.rglob("*.html.j2"))
HOSTILE = "</title><script>alert('x')</script>\" onload=\"y"


@pytest.mark.parametrize(
    ("template", "values"),
    [
        ("authoring/page", {"origin": "<!doctype html>", "title": HOSTILE, "body": HOSTILE}),
        ("notebook/page", {"page": HOSTILE, "title": HOSTILE, "height": 1}),
        ("notebook/run", {"title": HOSTILE, "time": HOSTILE, "steps": 1, "vertices": 1, "rows": [[HOSTILE] * 2],
                          "pictures": [HOSTILE]}),
        ("viewer/legend", {"stops": [HOSTILE], "ends": []}),
    ],
)  # fmt: skip
def test_no_value_opens_a_tag_or_ends_an_attribute(template, values):
    page = templates.filled(template, **values)
    assert "<script" not in page
    assert '" onload' not in page
    assert page.count("&lt;script&gt;") == str(values).count("<script>")


@pytest.mark.parametrize(
    ("text", "page"),
    [
        ("write `a < b` before `c`.", "write <code>a &lt; b</code> before <code>c</code>."),
        ("`<script>alert(1)</script>`", "<code>&lt;script&gt;alert(1)&lt;/script&gt;</code>"),
        (
            "<i>`</i>` <code>` `</code>",
            "&lt;i&gt;<code>&lt;/i&gt;</code> &lt;code&gt;<code> </code>&lt;/code&gt;",
        ),
        ("one ` alone &\nin its `line`", "one ` alone &amp;\nin its <code>line</code>"),
        ("``", "``"),
    ],
)
def test_code_in_a_sentence_is_shown_as_code_and_escaped_inside_and_outside(text, page):
    assert templates.coded(text) == page


def test_a_value_that_is_missing_is_an_error_and_no_gap():
    with pytest.raises(Exception, match="'title' is undefined"):
        templates.filled("notebook/page", page="", height=1)


def test_no_template_turns_escaping_off():
    assert len(TEMPLATES) >= 10
    for template in TEMPLATES:
        text = template.read_text(encoding="utf-8")
        assert not re.search(r"\|\s*safe\b|autoescape", text), template.name


def test_pages_are_written_in_templates_and_not_in_python():
    """The one exception wraps a formula that is MathML already."""
    tag = re.compile(
        r"<(?:a|b|br|code|div|h[1-6]|html|img|li|ol|p|pre|section|span|style|svg|table|td|tr|ul)[ />]"
    )
    found = [
        f"{path.relative_to(PACKAGE)}: {line.strip()}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if tag.search(line) and "(?:<p>)" not in line
    ]
    assert found == [
        """authoring/page.py: formulas.append(f'<div class="maths">{mathml(match[2], "block")}</div>')"""
    ]


def test_templates_and_styles_are_in_the_wheel():
    inside = set(wheel.contents())
    for part in [*TEMPLATES, *PACKAGE.rglob("*.css"), *PACKAGE.rglob("*.js")]:
        assert f"muslin/{part.relative_to(PACKAGE).as_posix()}" in inside
