"""Tables as spreadsheets and platforms write them (CSV): read, and written again with some cells filled.

Whatever is not filled keeps its bytes: encoding, byte order mark, ends of lines, quotes, blanks.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Mapping
from typing import NamedTuple

#: Byte order marks, and what they say.
_MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}

#: What may stand between cells.
_BETWEEN = ",;\t"


class _Cell(NamedTuple):
    """A cell: where it stands in the text, and what it says."""

    start: int
    end: int
    said: str


class Sheet:
    """A table, with where everything stands in it.

    Parameters
    ----------
    data : bytes
        A CSV file: UTF-8 (with a mark or without), UTF-16 with one, or Windows' Western encoding; cells apart by
        commas, semicolons or tabs.

    Attributes
    ----------
    rows : list of list of str
        What the cells say; Excel's own first line (`sep=;`) is a row without cells.
    """

    def __init__(self, data: bytes):
        self._mark = next((mark for mark in _MARKS if data.startswith(mark)), b"")
        self._encoding, self._text = _decoded(data[len(self._mark) :], _MARKS.get(self._mark))
        said = re.match(r"sep=(.)[^\S\r\n]*(?=[\r\n])", self._text)
        first = self._text.split("\n", 1)[0]
        self._between = said[1] if said else max(_BETWEEN, key=first.count)
        self._cells = _cells(self._text, self._between)
        if said:
            self._cells[0] = []
        self.rows = [[cell.said for cell in row] for row in self._cells]

    def filled(self, changes: Mapping[tuple[int, int], str]) -> bytes:
        """The file with some cells changed; a row that is too short grows.

        Parameters
        ----------
        changes : dict
            What a cell (row, column) should say.
        """
        edits: list[tuple[int, int, str]] = []
        for (row, column), said in sorted(changes.items()):
            cells = self._cells[row]
            if column < len(cells):
                start, end, _ = cells[column]
                edits.append((start, end, self._written(said, self._text[start:end].startswith('"'))))
            else:
                end = cells[-1].end
                edits.append((end, end, self._between * (column - len(cells) + 1) + self._written(said)))
        pieces, at = [], 0
        for start, end, said in edits:
            pieces += [self._text[at:start], said]
            at = end
        text = "".join([*pieces, self._text[at:]])
        return self._mark + text.encode(self._encoding)

    def _written(self, said: str, quoted: bool = False) -> str:
        if quoted or any(letter in said for letter in f'{self._between}"\r\n'):
            return '"' + said.replace('"', '""') + '"'
        return said


def _decoded(data: bytes, encoding: str | None) -> tuple[str, str]:
    """The encoding of a file, and its text."""
    for name in (encoding,) if encoding else ("utf-8", "cp1252"):
        try:
            return name, data.decode(name)
        except UnicodeDecodeError:
            if encoding:
                raise
    return "latin-1", data.decode("latin-1")


def _cells(text: str, between: str) -> list[list[_Cell]]:
    apart = re.escape(between)
    one = re.compile(rf'"((?:[^"]|"")*)"(?={apart}|[\r\n]|\Z)|([^{apart}\r\n]*)')
    rows: list[list[_Cell]] = []
    at = 0
    while at < len(text):
        row: list[_Cell] = []
        while True:
            match = one.match(text, at)
            assert match is not None  # it matches nothing, too
            said = match[2] if match[1] is None else match[1].replace('""', '"')
            row.append(_Cell(*match.span(), said))
            at = match.end()
            if not text.startswith(between, at):
                break
            at += 1
        rows.append(row)
        at += 2 if text.startswith("\r\n", at) else 1
    return rows
