"""Solution regions: what a solution marks for students to write, and the stubs that are left without it."""

from __future__ import annotations

import ast
import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import syntax
from muslin.tasks import Assignment

HANDOUT = "README.md"
LINE_LENGTH = 110

_MARKER = re.compile(r"^(\s*)# (begin|end) solution(?::\s*(.*?))?\s*$")
_LOOKS_LIKE_MARKER = re.compile(r"#\W*(begin|end)\W*solution", re.IGNORECASE)


@dataclass(frozen=True)
class Region:
    """A solution region: line indices of its two markers, their indentation, and what to do in words."""

    begin: int
    end: int
    indent: str
    words: str

    @property
    def body(self) -> range:
        """Line indices between the markers."""
        return range(self.begin + 1, self.end)


def regions(lines: list[str], path: Path) -> list[Region]:
    """Solution regions of a file, in order.

    Parameters
    ----------
    lines : list of str
        The file's lines, without line ends.
    path : Path
        Where they come from, for messages.

    Raises
    ------
    MuslinError
        If a marker is misspelt, unclosed, nested, closed twice, or its region is empty.
    """

    def wrong(index: int, what: str, hint: str = "") -> MuslinError:
        return MuslinError(f"{paths.shown(path)}, line {index + 1}: {what}.", hint)

    found: list[Region] = []
    begin: tuple[int, str, str] | None = None
    for index, line in enumerate(lines):
        match = _MARKER.match(line)
        if match is None:
            if _LOOKS_LIKE_MARKER.search(line):
                raise wrong(
                    index,
                    f"this is not a solution marker: {line.strip()}",
                    'Write "# begin solution: what to do" or "# end solution" on a line of its own.',
                )
            if begin and line.strip() and not line.startswith(begin[1]):
                raise wrong(index, "a solution region must not leave the block it begins in")
            continue
        indent, kind, words = match[1], match[2], match[3] or ""
        if kind == "begin":
            if begin:
                raise wrong(index, f"the solution region of line {begin[0] + 1} is still open here")
            if indent and not words:
                raise wrong(
                    index, "the marker does not say what to do", 'Write "# begin solution: what to do".'
                )
            begin = (index, indent, words)
            continue
        if begin is None:
            raise wrong(index, "a solution region ends that never began")
        if words or indent != begin[1]:
            raise wrong(
                index, f'"# end solution" must stand alone and below the marker of line {begin[0] + 1}'
            )
        if not any(text.strip() for text in lines[begin[0] + 1 : index]):
            raise wrong(begin[0], "the solution region is empty")
        found.append(Region(begin[0], index, indent, begin[2]))
        begin = None
    if begin:
        raise wrong(begin[0], "this solution region never ends", 'Close it with "# end solution".')
    return found


def stubs(path: Path, table: Assignment) -> str:
    """A solution file as the student gets it."""
    text = read(path)
    _require_regions(text, path, table)
    header = f"# {table.name} {table.version}: fill in the functions of this file; {HANDOUT} explains each."
    return header + "\n" + _mark_idle_imports(without_regions(text, path))


def without_regions(text: str, path: Path) -> str:
    """Regions in functions become the words and a raise; regions at module level vanish."""
    lines = syntax.bare_lines(text)
    kept: list[str] = []
    next_line = 0
    for region in regions(lines, path):
        kept += lines[next_line : region.begin]
        if region.indent:
            kept += textwrap.wrap(
                f"Your code here: {region.words}",
                width=LINE_LENGTH,
                initial_indent=f"{region.indent}# ",
                subsequent_indent=f"{region.indent}# ",
                break_long_words=False,
                break_on_hyphens=False,
            )
            kept.append(f"{region.indent}raise NotImplementedError")
        else:
            while kept and not kept[-1].strip():
                kept.pop()
        next_line = region.end + 1
    kept += lines[next_line:]
    return "\n".join(kept).strip("\n") + "\n"


def _require_regions(text: str, path: Path, table: Assignment) -> None:
    """Each task of the file is a function with exactly one region; else its answer would be released."""
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise MuslinError(f"{paths.shown(path)}, line {error.lineno}: {error.msg}.") from None
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    begins = [region.begin + 1 for region in regions(syntax.bare_lines(text), path) if region.indent]
    for task in table.tasks.values():
        if task.file != path.name:
            continue
        if task.name not in functions:
            raise MuslinError(
                f"{paths.shown(path)} has no function {task.name}, which the manifest asks for."
            )
        node = functions[task.name]
        if not task.in_python and not any(ast.unparse(line) == "ti.func" for line in node.decorator_list):
            raise MuslinError(
                f"{paths.shown(path)}, line {node.lineno}: {task.name} is no Taichi function.",
                f'Write "@ti.func" above def {task.name}, or language = "python" in the manifest.',
            )
        count = sum(node.lineno <= line <= (node.end_lineno or node.lineno) + 1 for line in begins)
        if count != 1:
            raise MuslinError(
                f"{paths.shown(path)}, line {node.lineno}: {task.name} has {count or 'no'} solution region"
                f"{'s' if count > 1 else ''}.",
                'Mark its answer, once, with "# begin solution: what to do" and "# end solution".',
            )


def _mark_idle_imports(text: str) -> str:
    """Keep imports that only the answers use, and say so: the student will want them."""
    tree = ast.parse(text)
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    lines = syntax.bare_lines(text)
    for node in tree.body:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names = {(alias.asname or alias.name).split(".")[0] for alias in node.names}
            if not names & used:
                lines[node.lineno - 1] += "  # given, for your code below  # noqa: F401"
    return "\n".join(lines) + "\n"


def read(path: Path) -> str:
    """A file the manifest names, as text."""
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise MuslinError(f"{paths.shown(path)} is missing, though the manifest names it.") from None
    except UnicodeDecodeError:
        raise MuslinError(f"{paths.shown(path)} is not UTF-8 text.") from None
