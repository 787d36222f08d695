"""The handout as a page: one HTML file that opens from a disk, with formulas a browser draws by itself.

It is made when an assignment is released, so that no student needs anything to read it. What it was made from is
written at its top; so whether it is in step can be said without making it again.
"""

from __future__ import annotations

import hashlib
import posixpath
import re

from markupsafe import Markup

from muslin.base.templates import filled

#: The pages there are: what each is made from -> its name.
PAGES = {"README.md": "handout.html", "experiments/README.md": "experiments/questions.html"}

#: Name of the page beside the handout.
PAGE = PAGES["README.md"]


def origin(handout: str) -> str:
    """First line of the page of a handout: what it was made from."""
    return f"<!doctype html><!-- made from README.md {hashlib.sha256(handout.encode()).hexdigest()} -->"


def page(handout: str, title: str, at: str = "README.md") -> str | None:
    """A handout in Markdown as a page of HTML; None where the packages that make one are missing.

    It stands at a place of `PAGES`, and its links to the others lead to their pages.

    Raises
    ------
    MuslinError
        If a formula cannot be converted.
    """
    try:
        import markdown

        from muslin.authoring.maths import Maths, deeper_lists, mathml
    except ImportError:
        return None
    formulas: list[str] = []

    def kept(match: re.Match[str]) -> str:
        formulas.append(f'<div class="maths">{mathml(match[2], "block")}</div>')
        return f"{match[1]}MATHS{len(formulas) - 1}END"

    text = re.sub(r"\A<!--.*?-->\s*", "", handout, flags=re.DOTALL)
    text = re.sub(r"^( *)```math\n(.*?)\n *```$", kept, text, flags=re.MULTILINE | re.DOTALL)
    body = markdown.markdown(
        deeper_lists(text),
        extensions=["tables", "fenced_code", "sane_lists", "attr_list", "toc", Maths()],
        extension_configs={"toc": {"permalink": "#"}},
    )
    body = re.sub(r"(?:<p>)?MATHS(\d+)END(?:</p>)?", lambda match: formulas[int(match[1])], body)
    body = re.sub(r'href="([^":#]+)', lambda match: f'href="{_led(match[1], at)}', body)
    return filled("authoring/page", origin=Markup(origin(handout)), title=title, body=Markup(body))


def _led(link: str, at: str) -> str:
    """Where a link leads on the page made from the file `at`."""
    folder = posixpath.dirname(at)
    there = PAGES.get(posixpath.normpath(posixpath.join(folder, link)))
    return posixpath.relpath(there, folder or ".") if there else link
