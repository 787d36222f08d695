"""What the site does beyond plain MkDocs.

- Maths: `$...$` and blocks fenced with `math` become MathML here, so that a page needs no script and no network.
- Handouts: a page for each assignment, rendered from its solution as the student's README is.
- The command reference, from the commands themselves.
- A search that works from a disk.
- Markdown as GitHub reads it: list items indented by two or three blanks, links to files of the repository.
"""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File

from muslin.authoring.maths import Maths, deeper_lists, mathml
from muslin.base.errors import MuslinError

HERE = Path(__file__).resolve().parent
DOCS, REPOSITORY = HERE.parent, HERE.parents[1]

#: Pages the navigation names already and that may not be written yet.
AWAITED = {"viewer.md": "The viewer", "performance.md": "Performance"}

log = logging.getLogger("mkdocs.hooks.muslin")


def block(source: str, language: str, css_class: str, options: Any, md: Any, **_: Any) -> str:
    """A fenced block of maths."""
    try:
        return f'<div class="maths">{mathml(source, "block")}</div>'
    except MuslinError as error:
        raise PluginError(str(error)) from error


# Events of MkDocs ------------------------------------------------------------------------------------------


def on_config(config: Any) -> Any:
    """Maths; the handouts in the navigation."""
    config.markdown_extensions.append(Maths())
    config.mdx_configs.setdefault("pymdownx.superfences", {})["custom_fences"] = [
        {"name": "math", "class": "maths", "format": block}
    ]
    for entry in config.nav:
        if "Handouts" in entry:
            entry["Handouts"] = [
                f"handouts/{source.name}/{page}"
                for source in handouts()
                for page, given in (
                    ("index.md", "README.md"),
                    ("experiments/README.md", "experiments/README.md"),
                )
                if (source / given).is_file()
            ]
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
            elif relative == "experiments/README.md":
                text = content.decode("utf-8").replace("(../README.md", "(../index.md")
                made[f"handouts/{source.name}/{relative}"] = text
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


@event_priority(-100)  # after the search has written its index
def on_post_build(config: Any) -> None:
    """The index as a script, too: from a disk nothing else can be read. `search-from-disk.js` does the rest."""
    search = Path(config.site_dir) / "search"
    index = (search / "search_index.json").read_text(encoding="utf-8")
    (search / "search_index.js").write_text(f"var __index = {index}", encoding="utf-8")


# Links ---------------------------------------------------------------------------------------------------

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
