"""Text that may be hostile, made fit to show: nothing invisible, nothing that steers a terminal, nothing endless.

File names, errors and whatever a record says may come from anybody. Errors and shown paths pass through here by
themselves; every view of a record passes it through `visible` first and then through what its own format needs on
top (HTML, XML and CSV escapes).
"""

from __future__ import annotations

import re

#: Never shown as they are: control characters but tab and newline, marks that turn the writing direction round,
#: odd line ends, halves of surrogate pairs, and code points that are no characters (XML forbids them).
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef\ufeff"
    "\ufffe\uffff" + "".join(f"{chr(p * 0x10000 + 0xFFFE)}{chr(p * 0x10000 + 0xFFFF)}" for p in range(1, 17))
    + "]"
)  # fmt: skip


def visible(text: str) -> str:
    r"""The text with its control characters written out: an escape becomes `\x1b`. Keeps newlines and tabs."""
    return _HIDDEN.sub(_written_out, text.replace("\r\n", "\n"))


def one_line(text: str, limit: int = 200) -> str:
    r"""`visible`, on one line, at most `limit` characters; newlines and tabs are written out too."""
    line = visible(text[: limit + 1]).replace("\n", r"\n").replace("\t", r"\t")
    return line if len(line) <= limit else line[: limit - 3] + "..."


def capped(text: str, limit: int, note: str = "\n[cut here: {left} more characters]") -> str:
    """`visible`, at most `limit` characters, the note that it was cut included."""
    whole = len(text)
    text = visible(text[: limit + 1])
    if whole <= limit and len(text) <= limit:
        return text
    note = note.format(left=max(whole - limit, len(text) - limit))[:limit]
    return text[: limit - len(note)] + note


def _written_out(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
