"""What the site does beyond plain MkDocs.

- Maths: `$...$` and blocks fenced with `math` become MathML here, so that a page needs no script and no network.
- Handouts: a page for each assignment, rendered from its solution as the student's README is.
- The command reference, from the commands themselves.
- Markdown as GitHub reads it: list items indented by two or three blanks, links to files of the repository.
"""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

HERE = Path(__file__).resolve().parent
DOCS, REPOSITORY = HERE.parent, HERE.parents[1]

#: Pages the navigation names already and that may not be written yet.
AWAITED = {"viewer.md": "The viewer", "performance.md": "Performance"}

log = logging.getLogger("mkdocs.hooks.muslin")


# Maths -----------------------------------------------------------------------------------------------------

MATHML = "http://www.w3.org/1998/Math/MathML"
NORM = "\u2016"


def mathml(formula: str, display: str = "inline") -> str:
    """A formula in LaTeX as MathML.

    Raises
    ------
    PluginError
        If it cannot be converted, or LaTeX is left over in the result.
    """
    try:
        root = ElementTree.fromstring(convert(formula.strip(), display=display))
    except Exception as error:
        raise PluginError(f"The formula {formula.strip()!r} cannot be converted: {error!r}") from error
    for parent in root.iter():
        _upright_words(parent)
    _norms(root)
    _spaces(root)
    if re.search(r"[\\$]", "".join(root.itertext())):
        raise PluginError(f"LaTeX is left over in the formula {formula.strip()!r}.")
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


def block(source: str, language: str, css_class: str, options: Any, md: Any, **_: Any) -> str:
    """A fenced block of maths."""
    return f'<div class="maths">{mathml(source, "block")}</div>'


# Events of MkDocs ------------------------------------------------------------------------------------------


def on_config(config: Any) -> Any:
    """Maths; the handouts in the navigation."""
    config.markdown_extensions.append(Maths())
    config.mdx_configs.setdefault("pymdownx.superfences", {})["custom_fences"] = [
        {"name": "math", "class": "maths", "format": block}
    ]
    for entry in config.nav:
        if "Handouts" in entry:
            entry["Handouts"] = [f"handouts/{source.name}/index.md" for source in handouts()]
    return config


def handouts() -> list[Path]:
    """Solution folders with a handout."""
    return sorted(path.parent for path in (REPOSITORY / "solutions").glob("*/README.md"))


def on_files(files: Any, config: Any) -> Any:
    """Pages that are made, not written."""
    from muslin.authoring.release import rendered

    made: dict[str, str | bytes] = {"reference/commands.md": commands()}
    for source in handouts():
        for relative, content in rendered(source).items():
            if relative == "README.md":
                text = re.sub(r"\A<!--.*?-->\s*", "", content.decode("utf-8"))
                made[f"handouts/{source.name}/index.md"] = text
            elif relative.startswith("pictures/"):
                made[f"handouts/{source.name}/{relative}"] = content
    for page, title in AWAITED.items():
        if files.get_file_from_path(page) is None:
            log.info("%s is not written yet: an empty page stands in", page)
            made[page] = f"# {title}\n\nThis page is not written yet.\n"
    for path, content in made.items():
        files.append(File.generated(config, path, content=content))
    return files


def on_page_markdown(text: str, page: Any, **_: Any) -> str:
    """GitHub's Markdown as Python-Markdown reads it."""
    return inside_the_site(deeper_lists(text), page.file.src_uri)


# GitHub's Markdown -----------------------------------------------------------------------------------------

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


_LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])+)\]\(([^)\s:#]+)(#[^)\s]*)?\)")


def inside_the_site(text: str, page: str) -> str:
    """Links to files of the repository: to their page on the site, where there is one, else just their path."""
    folder = (DOCS / page).parent

    def link(match: re.Match[str]) -> str:
        target = (folder / match[2]).resolve()
        if DOCS in target.parents or not target.is_relative_to(REPOSITORY) or not target.exists():
            return match[0]  # a page, or a mistake that MkDocs reports
        relative = target.relative_to(REPOSITORY).as_posix()
        if handout := re.fullmatch(r"(?:assignments|solutions)/(\w+)(?:/README\.md)?", relative):
            up = "../" * page.count("/")
            return f"[{match[1]}]({up}handouts/{handout[1]}/index.md{match[3] or ''})"
        return match[1] if relative in match[1] else f"{match[1]} (`{relative}`)"

    parts = re.split(r"(^ *```.*?^ *```$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if k % 2 else _LINK.sub(link, part) for k, part in enumerate(parts))


# The commands ----------------------------------------------------------------------------------------------


def commands() -> str:
    """Every command with its options, as `muslin COMMAND --help` says them."""
    import typer.main

    from muslin.cli import app

    def described(command: Any, name: str) -> list[str]:
        lines = [f"## `{name}`", "", (command.help or "").split("\f")[0].strip(), ""]
        if hasattr(command, "commands"):
            for child, below in command.commands.items():
                if not below.hidden:
                    lines += described(below, f"{name} {child}")
            return lines if name != "muslin" else lines[3:]
        rows = []
        for parameter in command.params:
            if getattr(parameter, "hidden", False):
                continue
            argument = parameter.param_type_name == "argument"
            said = parameter.name.upper() if argument else ", ".join(parameter.opts)
            if said != "--help":
                help_text = " ".join((getattr(parameter, "help", "") or "").split()).replace("|", "\\|")
                rows.append(f"| `{said}` | {help_text} |")
        if rows:
            lines += ["| argument or option | meaning |", "| --- | --- |", *rows, ""]
        return lines

    text = "\n".join(described(typer.main.get_command(app), "muslin"))
    return f"# Commands\n\nEvery command answers `--help`. `muslin doctor` says what a machine lacks.\n\n{text}\n"
