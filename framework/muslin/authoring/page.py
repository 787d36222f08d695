"""The handout as a page: one HTML file that opens from a disk, with formulas a browser draws by itself.

It is made when an assignment is released, so that no student needs anything to read it. What it was made from is
written at its top; so whether it is in step can be said without making it again.
"""

from __future__ import annotations

import hashlib
import re

#: Name of the page beside the handout.
PAGE = "handout.html"

_STYLE = """
body { font: 17px/1.6 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #24292f;
  background: #fff; max-width: 52rem; margin: 2rem auto; padding: 0 1.25rem; }
h1, h2, h3 { line-height: 1.25; margin-top: 2em; } h2 { border-bottom: 1px solid #ddd; padding-bottom: .2em; }
a { color: #a8341f; } a.headerlink { visibility: hidden; text-decoration: none; margin-left: .4em; }
h1:hover a.headerlink, h2:hover a.headerlink, h3:hover a.headerlink { visibility: visible; }
:target { background: #fff3d6; }
code, pre { font-family: ui-monospace, "SF Mono", "Cascadia Mono", Consolas, "DejaVu Sans Mono", monospace;
  font-size: .9em; background: #f5f3f0; border-radius: 4px; }
code { padding: .1em .3em; } pre { padding: .8em 1em; overflow-x: auto; } pre code { padding: 0; }
table { border-collapse: collapse; display: block; overflow-x: auto; font-size: .92em; }
th, td { border: 1px solid #ddd; padding: .3em .6em; text-align: left; vertical-align: top; }
img { max-width: 100%; } blockquote { border-left: 4px solid #c04a35; margin-left: 0; padding-left: 1em; color: #555; }
math { font-family: "STIX Two Math", "Cambria Math", "Latin Modern Math", math; font-size: 1.08em; }
.maths { margin: 1em 0; padding: .25em 0; overflow-x: auto; overflow-y: hidden; }
@media (prefers-color-scheme: dark) { body { color: #e3e3e3; background: #1d1f22; } a { color: #f0947f; }
  code, pre { background: #2b2e33; } th, td { border-color: #444; } :target { background: #4a3c1c; }
  h2 { border-color: #444; } img { background: #fff; } }
""".strip()


def origin(handout: str) -> str:
    """First line of the page of a handout: what it was made from."""
    return f"<!doctype html><!-- made from README.md {hashlib.sha256(handout.encode()).hexdigest()} -->"


def page(handout: str, title: str) -> str | None:
    """A handout in Markdown as a page of HTML; None where the packages that make one are missing.

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
    return (
        f'{origin(handout)}\n<html lang="en">\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width">\n<title>{title}</title>\n'
        f"<style>\n{_STYLE}\n</style>\n{body}\n</html>\n"
    )
