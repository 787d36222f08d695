"""Markdown as GitHub reads it, with its formulas as MathML: for the handout's page and for the documentation site.

Needs `markdown` and `latex2mathml`, from the extra `authoring`: only those who release an assignment need them.
"""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor

from muslin.base.errors import MuslinError

MATHML = "http://www.w3.org/1998/Math/MathML"
NORM = "\u2016"


def mathml(formula: str, display: str = "inline") -> str:
    """A formula in LaTeX as MathML.

    Raises
    ------
    MuslinError
        If it cannot be converted, or LaTeX is left over in the result.
    """
    try:
        root = ElementTree.fromstring(convert(formula.strip(), display=display))
    except Exception as error:
        raise MuslinError(f"The formula {formula.strip()!r} cannot be converted: {error!r}") from error
    for parent in root.iter():
        _upright_words(parent)
    _norms(root)
    _spaces(root)
    if re.search(r"[\\$]", "".join(root.itertext())):
        raise MuslinError(f"LaTeX is left over in the formula {formula.strip()!r}.")
    ElementTree.register_namespace("", MATHML)
    return ElementTree.tostring(root, encoding="unicode")


def _upright_words(parent: ElementTree.Element) -> None:
    r"""Letters of `\mathrm{diag}` in a row become one word, which is upright by itself."""
    children = list(parent)
    if len(children) > 1 and all(child.get("mathvariant") == "normal" for child in children):
        children[0].text = "".join(child.text or "" for child in children)
        del children[0].attrib["mathvariant"]
        for child in children[1:]:
            parent.remove(child)


def _norms(root: ElementTree.Element) -> None:
    """Bars of a norm, in turn, open and close; otherwise a browser sets them apart like a relation."""
    bars = [mo for mo in root.iter(f"{{{MATHML}}}mo") if mo.text == NORM and "form" not in mo.attrib]
    for k, bar in enumerate(bars):
        bar.attrib |= {"form": "postfix" if k % 2 else "prefix", "stretchy": "false"}


#: Blanks on both sides: A : B is a relation and stands apart, a / b is not and does not.
SPACES = {":": "0.2em", "/": "0.05em"}


def _spaces(root: ElementTree.Element) -> None:
    for mo in root.iter(f"{{{MATHML}}}mo"):
        if space := SPACES.get(mo.text or ""):
            mo.attrib |= {"lspace": space, "rspace": space}


class Inline(InlineProcessor):
    """`$...$`, as on GitHub: no blank inside next to a dollar, no digit after the second."""

    def __init__(self, md: Any):
        super().__init__(r"(?<![\\$\w])\$(?![\s$])([^$\n]+?)(?<![\s\\])\$(?![\w$])", md)

    def handleMatch(self, match: re.Match[str], data: str) -> tuple[str, int, int]:
        """The formula, kept as HTML that nothing else touches."""
        return self.md.htmlStash.store(mathml(match[1])), match.start(0), match.end(0)


class Maths(Extension):
    """Maths in running text; after code spans, before backslash escapes."""

    def extendMarkdown(self, md: Any) -> None:
        """Join in before backslashes are read."""
        md.inlinePatterns.register(Inline(md), "maths", 185)


_ITEM = re.compile(r"( *)([-*+]|\d+[.)]) +(?=\S)")
_FENCE = re.compile(r" *(`{3,}|~{3,})")


def deeper_lists(text: str) -> str:
    """List items continued below their text, as CommonMark has it, indented by four blanks a level instead.

    A list that follows a paragraph directly gets its empty line, and so does an item that follows a paragraph
    other than the first of the item before.
    """
    out: list[str] = []
    stack: list[int] = []  # columns where the text of the open items begins
    fence, shift = "", 0
    paragraph = True  # whether text here is a paragraph of its own, not the first one of an item
    for line in text.splitlines():
        indent = len(line) - len(line.lstrip(" "))
        if fence:
            out.append(" " * max(indent + shift, 0) + line.lstrip(" ") if line.strip() else "")
            if re.fullmatch(rf"{fence[0]}{{{len(fence)},}}", line.strip()):
                fence = ""
            continue
        if not line.strip():
            out.append("")
            paragraph = True
            continue
        while stack and indent < stack[-1]:
            stack.pop()
        shift = 4 * len(stack) - (stack[-1] if stack else 0)
        item, opening = _ITEM.match(line), _FENCE.match(line)
        if item and indent + shift < 4 * len(stack) + 4:
            if out and out[-1].strip() and paragraph:
                out.append("")
            stack.append(item.end())
            paragraph = False
        elif opening:
            fence = opening[1]
        out.append(" " * (indent + shift) + line.lstrip(" "))
    return "\n".join(out) + "\n"
