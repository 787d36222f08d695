"""From a solution to what a student receives: `release` writes it, `out_of_step` says what no longer agrees.

A solution marks what a student is to write::

    # begin solution: what to do, in words
    return 6 * 7
    # end solution

Inside a function such a region becomes the words and `raise NotImplementedError`; at module level (helpers,
imports only the answer needs) it vanishes. The handout `README.md` may hold these markers, each on a line of
its own::

    <!-- tasks -->                        the task table
    <!-- signature: NAME -->              arguments and results of a task, with shapes and units
    <!-- picture: NAME.png | caption -->  that picture, if it is in pictures/; nothing otherwise
    <!-- note: for authors -->            nothing

What comes out depends only on what is in `solutions/<name>/`.
"""

from __future__ import annotations

import ast
import importlib.util
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from muslin.authoring.page import PAGE, origin, page
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import syntax
from muslin.tasks import MANIFEST, Assignment, Task, Value, read_assignment

HANDOUT = "README.md"
PICTURES = "pictures"
PICTURE_TYPES = (".gif", ".jpg", ".png", ".svg", ".webp")
LINE_LENGTH = 110

#: Expressions shorter than this (without blanks) say too little to be an answer, `x1 - x0` for example.
SHORTEST_ANSWER = 12


def release(name: str, out: Path | str | None = None) -> list[Path]:
    """Turn `solutions/<name>/` into what a student receives.

    Parameters
    ----------
    name : str
        The assignment.
    out : path, optional
        Folder to write to; default `assignments/<name>/`. Files in it that the release does not write are
        left alone (`out_of_step` names them).

    Returns
    -------
    list of Path
        The files written, sorted.

    Raises
    ------
    MuslinError
        If a marker is malformed, a task has no region, or an answer would be given away; nothing is written.
    """
    source = paths.solution(name)
    files = rendered(source)
    given_away = list(leaks(source, files))
    if given_away:
        raise MuslinError(f"The release would give an answer away: {given_away[0]}", "Say it in other words.")
    folder = Path(out) if out is not None else paths.assignment(name)
    written = []
    for relative, content in files.items():
        path = folder / relative
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except OSError as error:
            raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None
        written.append(path)
    return written


def out_of_step(name: str) -> list[str]:
    """Say how `assignments/<name>/` differs from what `release` would write, and which answers it gives away.

    Parameters
    ----------
    name : str
        The assignment.

    Returns
    -------
    list of str
        One sentence per finding, with file and, where there is one, line; empty if all is well.
    """
    source, folder = paths.solution(name), paths.assignment(name)
    expected = rendered(source)
    present = {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }
    mend = f"run: muslin release {name}"
    findings = []
    folders = {relative.split("/")[0] for relative in expected}
    for relative in sorted(expected.keys() | {_within(relative, folders) for relative in present}):
        where = paths.shown(folder / relative)
        if relative == PAGE and HANDOUT in expected and relative in present:
            if present[PAGE].split(b"\n")[0].decode() != origin(expected[HANDOUT].decode("utf-8")):
                findings.append(f"{where}: not made from this handout; {mend}{_first_install()}")
        elif relative not in expected:
            findings.append(f"{where} is superfluous: nothing in the solution leads to it; delete it")
        elif relative not in present:
            findings.append(f"{where} is missing; {mend}")
        elif (line := _first_difference(present[relative], expected[relative])) is not None:
            at = f", line {line}" if line else ""
            findings.append(f"{where}{at}: stale or edited by hand; change the solution and {mend}")
    findings += [f"{paths.shown(folder)}/{leak}" for leak in leaks(source, present)]
    return findings


def _first_install() -> str:
    """What must be installed before a handout's page can be made; empty if nothing."""
    missing = [name for name in ("markdown", "latex2mathml") if importlib.util.find_spec(name) is None]
    return ', after: pip install "muslin[authoring]"' if missing else ""


def rendered(source: Path) -> dict[str, bytes]:
    """Every file of the release of one solution folder, by relative path.

    Parameters
    ----------
    source : Path
        A folder such as `solutions/cloth`.

    Returns
    -------
    dict
        Relative path to content, sorted by path.
    """
    table = read_assignment(source)
    texts = {file: _stubs(source / file, table) for file in table.files}
    texts |= {task.builder: _read(source / task.builder) for task in table.tasks.values() if task.builder}
    texts[MANIFEST] = _without_regions(_read(source / MANIFEST), source / MANIFEST)
    pictures = {
        f"{PICTURES}/{path.name}": path.read_bytes()
        for path in (source / PICTURES).glob("*")
        if path.suffix.lower() in PICTURE_TYPES
    }
    if (source / HANDOUT).is_file():
        texts[HANDOUT] = _handout(source / HANDOUT, table, pictures)
        if made := page(texts[HANDOUT], table.title):
            texts[PAGE] = made
    contents = {relative: text.encode("utf-8") for relative, text in texts.items()} | pictures
    return dict(sorted(contents.items()))


# ---------------------------------------------------------------------------------------- solution regions


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


_MARKER = re.compile(r"^(\s*)# (begin|end) solution(?::\s*(.*?))?\s*$")
_LOOKS_LIKE_MARKER = re.compile(r"#\W*(begin|end)\W*solution", re.IGNORECASE)


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


def _stubs(path: Path, table: Assignment) -> str:
    """A solution file as the student gets it."""
    text = _read(path)
    _require_regions(text, path, table)
    header = f"# {table.name} {table.version}: fill in the functions of this file; {HANDOUT} explains each."
    return header + "\n" + _mark_idle_imports(_without_regions(text, path))


def _without_regions(text: str, path: Path) -> str:
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


# ------------------------------------------------------------------------------------------------- handout

_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


def _handout(path: Path, table: Assignment, pictures: Mapping[str, bytes]) -> str:
    """The handout with its generated parts filled in."""
    text = _read(path)
    explained = set()

    def fill(match: re.Match[str]) -> str:
        line = text.count("\n", 0, match.start()) + 1
        keyword, _, rest = match[1].strip().partition(":")
        rest = rest.strip()
        if keyword == "tasks":
            return _task_table(table)
        if keyword == "signature" and rest in table.tasks:
            explained.add(rest)
            return _signature(table.tasks[rest])
        if keyword == "picture" and "|" in rest:
            file, caption = (part.strip() for part in rest.split("|", 1))
            return f"![{caption}]({PICTURES}/{file})" if f"{PICTURES}/{file}" in pictures else ""
        if keyword == "note":
            return ""
        raise MuslinError(
            f"{paths.shown(path)}, line {line}: the marker {match[0]} is not understood.",
            "There are: tasks, signature: TASK, picture: FILE | caption, note: text.",
        )

    filled = _COMMENT.sub(fill, text)
    if missing := [name for name in table.tasks if name not in explained]:
        raise MuslinError(
            f"{paths.shown(path)} does not explain {', '.join(missing)}.",
            f"Give it a section with <!-- signature: {missing[0]} -->.",
        )
    filled = re.sub(r"\n{3,}", "\n\n", filled).strip("\n")
    return f"<!-- Written by `muslin release {table.name}`; edits made here are lost. -->\n\n{filled}\n"


def _task_table(table: Assignment) -> str:
    rows = [
        f"| {task.section} | [`{name}`](#{name.lower()}) | {task.title} | `{task.file}` | {task.points} |"
        for name, task in table.tasks.items()
    ]
    total = sum(task.points for task in table.tasks.values())
    head = ["| section | function | what it is | file | points |", "| --- | --- | --- | --- | ---: |"]
    return "\n".join([*head, *rows, f"| | | | **total** | **{total}** |"])


def _signature(task: Task) -> str:
    arguments = ", ".join(value.name for value in task.arguments)
    head = f"**`{task.name}({arguments})`** in `{task.file}`, {task.points} points"
    rows = ["| | shape | unit | meaning |", "| --- | --- | --- | --- |"]
    rows += [_row(f"`{value.name}`", value) for value in task.arguments]
    word = "returns" if len(task.results) == 1 else "returns, in this order,"
    for value in task.results:
        rows.append(_row(f"{word} `{value.name}`" if len(task.results) > 1 else f"*{word}*", value))
        word = "and"
    return "\n".join([head, "", *rows])


def _row(label: str, value: Value) -> str:
    if value.is_function:
        return f"| {label} | function | {value.unit} | {value.meaning} |"
    shape, is_int = value.shape, value.integer
    size = "×".join(map(str, shape)) + f" (`{value.kind}`)" if shape else "number"
    unit = value.unit.replace("^2", "²").replace("^3", "³")
    return f"| {label} | {'integer' if is_int else size} | {unit} | {value.meaning} |"


# ------------------------------------------------------------------------------------------------- checks


def answers(source: Path) -> dict[str, str]:
    """Everything that counts as an answer: each solution line, and what it computes if long enough.

    Parameters
    ----------
    source : Path
        A folder such as `solutions/cloth`.

    Returns
    -------
    dict
        The answer (comments and outer blanks removed) to where it stands (`file, line n`).
    """
    found: dict[str, str] = {}
    for file in (*read_assignment(source).files, MANIFEST):
        lines = syntax.bare_lines(_read(source / file))
        for region in regions(lines, source / file):
            for index in region.body:
                line = re.sub(r"\s#\s.*$", "", f" {lines[index]}").strip()
                where = f"{paths.shown(source / file)}, line {index + 1}"
                if len(re.findall(r"\w+", line)) > 1:
                    found.setdefault(line, where)
                value = re.sub(r"^(return\b|[\w, ]+[-+*/]?=(?!=))\s*", "", line)
                if len(re.sub(r"\s", "", value)) >= SHORTEST_ANSWER and not value.isidentifier():
                    found.setdefault(value, where)
    return found


def leaks(source: Path, files: Mapping[str, bytes], results: bool = False) -> Iterator[str]:
    """Where files repeat an answer, however it is spaced.

    Parameters
    ----------
    source : Path
        The folder with the answers.
    files : dict of bytes
        By relative path.
    results : bool
        Look for what is returned only: other code may well take the same steps on the way.

    Yields
    ------
    str
        `file, line n: gives away ...`
    """
    found = answers(source)
    if results:
        found = {answer: where for answer, where in found.items() if f"return {answer}" in found}
    looked_for = [
        (re.sub(r"\s", "", answer), answer, where, re.compile(_spaced_anyhow(answer)))
        for answer, where in found.items()
    ]
    for relative, content in files.items():
        try:
            text = content.decode("utf-8")
        except UnicodeDecodeError:
            continue
        squeezed = re.sub(r"\s", "", text)
        for symbols, answer, where, pattern in looked_for:
            if symbols in squeezed and (match := pattern.search(text)):
                line = text.count("\n", 0, match.start()) + 1
                yield f"{relative}, line {line}: gives away `{answer}` ({where})"


def _spaced_anyhow(code: str) -> str:
    """Pattern for a piece of code with any blanks between its symbols, not inside a longer word."""
    symbols = re.findall(r"\w+|[^\w\s]", code)
    pattern = r"\s*".join(re.escape(symbol) for symbol in symbols)
    before = r"(?<!\w)" if symbols[0][0].isalnum() or symbols[0][0] == "_" else ""
    after = r"(?!\w)" if symbols[-1][-1].isalnum() or symbols[-1][-1] == "_" else ""
    return f"{before}{pattern}{after}"


def _within(relative: str, folders: set[str]) -> str:
    """The file itself, or the folder that holds it where the release has no such folder at all."""
    top, slash, _ = relative.partition("/")
    return top if slash and top not in folders else relative


def _first_difference(present: bytes, expected: bytes) -> int | None:
    """Line of the first difference (0 where lines mean nothing), or None if there is none."""
    try:
        have, want = (syntax.bare_lines(content.decode("utf-8")) for content in (present, expected))
    except UnicodeDecodeError:
        return None if present == expected else 0
    if have == want:
        return None
    same = next((k for k, pair in enumerate(zip(have, want, strict=False)) if pair[0] != pair[1]), None)
    return min(len(have), len(want)) + 1 if same is None else same + 1


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise MuslinError(f"{paths.shown(path)} is missing, though the manifest names it.") from None
    except UnicodeDecodeError:
        raise MuslinError(f"{paths.shown(path)} is not UTF-8 text.") from None
