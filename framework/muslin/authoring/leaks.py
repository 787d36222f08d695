"""Answers, and where files give them away."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from muslin.authoring.regions import read, regions
from muslin.base import paths
from muslin.reading import syntax
from muslin.tasks import MANIFEST, read_assignment

#: Expressions shorter than this (without blanks) say too little to be an answer, `x1 - x0` for example.
SHORTEST_ANSWER = 12


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
        lines = syntax.bare_lines(read(source / file))
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
