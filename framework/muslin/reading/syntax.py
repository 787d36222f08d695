"""What Python cannot read, in the student's terms: the line, a caret, and what to write instead.

Python's own words ("invalid syntax") differ from version to version and seldom name the habit behind a mistake:
a missing `*`, a formula that goes on in the next line, another language's `&&`. Those are found in the line itself.
"""

from __future__ import annotations

import ast
import io
import keyword
import re
import warnings
from collections.abc import Callable
from types import CodeType
from typing import NoReturn, TypeVar

from muslin.base.errors import StudentCodeError

#: Longest line shown [characters]; of a longer one, the part around the caret.
WIDEST = 64

#: Characters that text processors, web pages and PDFs put in place of those of the keyboard.
TYPED: dict[str, str] = {
    **dict.fromkeys("\u2212\u2013\u2014\u2010\u2011\ufe63\uff0d", "-"),  # minus sign, dashes
    **dict.fromkeys("\u00d7\u00b7\u2219\u22c5\u2217\u2022", "*"),  # times, dots
    **dict.fromkeys("\u00f7\u2215\u2044", "/"),
    **dict.fromkeys("\u201c\u201d\u201e\u00ab\u00bb", '"'),
    **dict.fromkeys("\u2018\u2019\u201a\u2032\u00b4", "'"),
    **dict.fromkeys("\u2264", "<="), **dict.fromkeys("\u2265", ">="), **dict.fromkeys("\u2260", "!="),
    **dict.fromkeys("\u00b2", " ** 2"), **dict.fromkeys("\u00b3", " ** 3"), "\u00bd": "0.5", "\u221a": "ti.sqrt(...)",
    "\uff08": "(", "\uff09": ")", "\uff0c": ",", "\uff1a": ":", "\uff1d": "=", "\uff0b": "+",
    "\u207b": " ** -", "\u1d40": ".transpose()", "\u2016": "v.norm()", "\u2211": "a sum", "\u2202": "a derivative",
}  # fmt: skip

_NUMBER = r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_WORDS = "|".join(keyword.kwlist)
_NAME = rf"(?!(?:{_WORDS})\b)[^\W\d]\w*"

#: Pattern in the line, without strings and comments, -> what to write instead. The first that matches is given;
#: what stands in {1}, {2} are the pattern's groups.
LINES: tuple[tuple[str, str], ...] = (
    (
        r"^(<{4,}|={4,}|>{4,})",
        "Git left this when it merged two versions: keep one, delete the other and the marks.",
    ),
    (r"^`{3}", "The fence ``` belongs to a handout, not to Python: delete the line."),
    (r"^(>>>|\.\.\. )", "The prompt {1} belongs to a handout, not to Python: delete it."),
    (
        r"\\[ \t]+$",
        "A space stands after the \\ that ends the line. Better put the formula into brackets ( ): "
        "then it may take many lines.",
    ),
    (r"\\[A-Za-z]", "A name is written without backslash: mu, lam."),
    (r"=<", "Write <= for =<."),
    (r"=>", "Write >= for =>."),
    (r"<>", "Write != for <>."),
    (r"^return\s*:", "No colon stands after return."),
    (
        rf"^return\s+{_NAME}\s*=(?!=)",
        "A return gives a value, not a name: write return and the formula alone.",
    ),
    (rf"({_NAME})\.(\d)", "An entry has square brackets: {1}[{2}]."),
    (rf"^({_NAME})\s*:=", "Write {1} = ... for {1} := ..."),
    (r"\bthen$", "Write a colon for then."),
    (r"^else\s+if\b", "Write elif for else if."),
    (r"&&", "Write and for &&."),
    (r"\|\|", "Write or for ||."),
    (r"!(?!=)", "Write not for !."),
    (rf"({_NAME})\s*(\+\+|--)", "Write {1} {=2}= 1 for {1}{2}."),
    (
        r"^//|;\s*//|//\s*[A-Za-z]+\s+(?!(?:if|else|and|or|not|in|is|for)\b)[A-Za-z]",
        "A comment begins with # in Python.",
    ),
    (r"\?.*:", "Give a variable one value before, and change it inside an if."),
    (r"\.([*/^])", "Write {1} for .{1}: of vectors + - * / work entry by entry; the power is **."),
    (r"\*\s*\^|\^\s*\*", "Write ** for a power."),
    (r"\blambda\b", "lambda is a word of Python's own, so it cannot be a name: write lam, or another."),
    (
        rf"^({_WORDS})\s*[-+*/]?=(?!=)",
        "{1} is a word of Python's own, so it cannot be a name: choose another.",
    ),
    (
        rf"^(?:double|float|int|auto|const|let|var|vec[234]|mat[234]|Vector3d|Matrix3d)\s+({_NAME})",
        "Python wants no type in front of a name: write {1} = ...",
    ),
    (r"[;{}]\s*$", "Python has no braces and no semicolons: a block stands four spaces further right."),
    (
        r"^(?:if|elif|while)\b[^=!<>]*[^=!<>](?<!:)=(?!=)",
        "Write == to compare: = gives a name a value.",
    ),
    (
        r"^(if|elif|else|for|while|def|class|try|with)\b.*[^:\\,(\[{]$",
        "A line that begins with {1} ends with a colon.",
    ),
    (r"^(else|try)$", "A line that begins with {1} ends with a colon."),
    (r"\[[^\]]*;", "Each row of a matrix has brackets of its own: ti.Matrix([[a, b], [c, d]])."),
    (
        rf"\[[^\],(]*(?:{_NAME}|{_NUMBER})\s+-?(?:{_NAME}|{_NUMBER})",
        "Write commas between the entries: ti.Vector([a, b, c]).",
    ),
    (r"\|\s*[\w.\[\]()+\- ]+\|", "Write v.norm() for the length of a vector, abs(a) for a number."),
    (r"[\w)\]]'(?!\w)", "The transpose is A.transpose()."),
    (rf"({_NUMBER})\s*({_NAME})\b(?!\s*\()", "Between {1} and {2} a * is missing: {1} * {2}."),
    (rf"({_NUMBER})\s*({_NAME})\s*\(", "Between {1} and {2} a * is missing: {1} * {2}(...)."),
    (
        rf"(?:^|[^\w.])(?!print\b)({_NAME})\s+({_NAME})\b",
        "Between {1} and {2} an operator is missing: {1} * {2}, or {1} @ {2} for matrices.",
    ),
    (rf"({_NAME})\s+({_NUMBER})", "Between {1} and {2} an operator is missing."),
    (
        rf"([)\]])\s*({_NAME}|{_NUMBER})",
        "Between {1} and {2} an operator is missing: {1} * {2}, or {1} @ {2} for matrices.",
    ),
    (r"^print\s+\S", "print takes brackets; better take it out."),
    (
        r"[-+*/@=,]$",
        "The line ends in the middle of a formula: put the whole formula into brackets ( ), then it may take "
        "many lines.",
    ),
)

#: What to do about a formula in two lines.
CONTINUED = (
    "A formula that goes on in the next line stands in brackets ( ); without them it ends with the line."
)

#: Pattern in Python's message -> what to do, where the line itself says nothing.
MESSAGES: tuple[tuple[str, str], ...] = (
    (r"was never closed", "Count the brackets from here on: one is opened more often than it is closed."),
    (
        r"unindent does not match|unexpected indent",
        "The lines of a block begin exactly one below the other; this one begins in another column.",
    ),
    (r"unmatched|does not match", "Count the brackets: each ( and [ is closed by its own ) and ]."),
    (r"unterminated (f-)?triple|EOF while", 'Three quotation marks """ are opened here and never closed.'),
    (r"unterminated (f-)?string|EOL while", "A quotation mark is opened here and not closed in this line."),
    (r"expected an indented block", "What belongs to the line above stands four spaces further right."),
    (r"inconsistent use of tabs", "Indent with spaces only, four for each level."),
    (r"outside function", "This line stands outside of every function: indent it by four spaces."),
    (r"expected ':'", "A line that begins with if, else, for or def ends with a colon."),
    (
        r"cannot assign|Maybe you meant '=='",
        "On the left of = stands one name (y = ...); to compare, write ==.",
    ),
    (
        r"forgot a comma",
        "Something is missing between two things here: an operator (* or @), or a comma.",
    ),
    (r"f-string", "Take the print out: what a function computes, muslin explain shows line by line."),
    (r"argument", "Look at what stands in the brackets of the call or of the def."),
    (r"global|nonlocal", "A function here uses its arguments and its own variables only."),
)

_T = TypeVar("_T")


def lines(text: str) -> list[str]:
    r"""Lines as Python counts them, line ends kept: after \n, \r\n and \r, and after no other character.

    `str.splitlines` also breaks at form feeds, U+2028 and more, so its line numbers are not Python's.
    """
    return list(io.StringIO(text, newline=""))


def bare_lines(text: str) -> list[str]:
    """The same without line ends."""
    return [line.rstrip("\r\n") for line in lines(text)]


def parsed(text: str, where: str) -> ast.Module:
    """The syntax tree of a file.

    Parameters
    ----------
    text : str
    where : str
        What the file is called in messages.

    Raises
    ------
    StudentCodeError
        If it is not Python.
    """
    return _read(lambda: ast.parse(text), text, where)


def compiled(text: str, filename: str, where: str) -> CodeType:
    """A file as code that can be run.

    Raises
    ------
    StudentCodeError
        If it is not Python.
    """
    return _read(lambda: compile(_with_types(text), filename, "exec", dont_inherit=True), text, where)


def _with_types(text: str) -> str | ast.Module:
    """A file whose annotations are types. The import that makes texts of them would have Taichi refuse them."""
    if "__future__" not in text:
        return text
    tree = ast.parse(text)
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module == "__future__":
            kept = [alias for alias in node.names if alias.name != "annotations"]
            node.names = kept or [ast.alias("division", None)]  # which does nothing
    return ast.fix_missing_locations(tree)


def _read(attempt: Callable[[], _T], text: str, where: str) -> _T:
    if "\0" in text:
        line = len(lines(text[: text.index("\0") + 1]))
        _fail(
            f"{where}, line {line}",
            "there are null bytes in it",
            "The file is damaged: bring it back from a copy.",
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what can be run is told better when it is compiled
            return attempt()
    except SyntaxError as error:
        raise unreadable(error, text, where) from None
    except (RecursionError, MemoryError):
        _fail(where, "brackets or blocks are nested too deeply", "Give the parts names.")


def _fail(where: str, why: str, hint: str) -> NoReturn:
    raise StudentCodeError(f"{where}: Python cannot read this: {why}.", hint)


def unreadable(error: SyntaxError, text: str, where: str) -> StudentCodeError:
    """What Python says of a file it cannot read, with the line, a caret and what to write instead.

    Parameters
    ----------
    error : SyntaxError
        From the parser or the compiler.
    text : str
        The file.
    where : str
        What the file is called in messages.
    """
    rows = lines(text)
    number = min(max(error.lineno or 1, 1), max(len(rows), 1))
    row = rows[number - 1].rstrip("\r\n") if rows else ""
    advice = _advice(error.msg or "", row, rows[: number - 1])
    if "unterminated" in (error.msg or "") and (opened := _open_docstring(text)):
        advice = f'Line {opened} opens a docstring with """, and nothing closes it there.'
    said = (error.msg or "invalid syntax").split(" (detected")[0].split(" Maybe you meant")[0]
    shown = [
        f"{where}, line {number}: Python cannot read this: {said.rstrip('.')}{'' if said.endswith('?') else '.'}",
        *_pointed(row, error),
    ]
    return StudentCodeError("\n".join([*shown, advice] if advice else shown))


def _pointed(row: str, error: SyntaxError) -> list[str]:
    """The line, and below it carets under what Python stumbled over."""
    if not row.strip():
        return []
    indent = len(row) - len(row.lstrip())
    begin = max((error.offset or 1) - 1, indent)
    end = (error.end_offset or 0) - 1 if error.end_lineno in (None, error.lineno) else len(row)
    end = max(end, begin + 1)
    left = indent if end - indent <= WIDEST else max(begin - WIDEST // 2, indent)
    cut = row[left : left + WIDEST].expandtabs(1)
    carets = "^" * min(end - begin, max(left + len(cut) - begin, 1))
    return [f"    {cut}", " " * (4 + begin - left) + carets]


def _bare(row: str) -> str:
    """A line without strings and comment, as far as that can be told of what is no Python."""
    row = re.sub(r'"[^"]*"|(?<!\w)\'[^\']*\'', '""', row)
    return row.split("#")[0].strip("\r\n\t ")


def _advice(message: str, row: str, before: list[str]) -> str:
    """What to write instead; empty if nothing is known."""
    if (odd := re.search(r"U\+([0-9A-Fa-f]{4,6})", message)) is not None:
        return _typed(chr(int(odd[1], 16)))
    code = _bare(row)
    above = next((_bare(line) for line in reversed(before) if _bare(line)), "")
    if "unexpected indent" in message and re.match(r"[-+*/@]|[)\]]", code):
        return CONTINUED
    if "unexpected indent" in message and (
        begun := re.match(r"(?:async\s+)?def\b|@|class\b|import\b|from\b", code)
    ):
        return f"This line begins in the first column: take the spaces in front of {begun[0]} out."
    told = re.search(
        r"never closed|unmatched|does not match|unterminated|indent|outside function|tabs", message
    )
    if told is None or ("\\" in code and "indent" not in message):
        ends = row.rstrip("\r\n").split("#")[0]
        for pattern, words in LINES:
            found = re.search(pattern, ends.lstrip() if pattern.startswith(r"\\[ ") else code)
            if found is not None:
                return _filled(words, found)
    elif re.search(r"unterminated (f-)?string", message) and re.search(r"[\w)\]]'", row):
        return "The transpose is A.transpose()."
    for pattern, words in MESSAGES:
        if re.search(pattern, message):
            return words
    if above.endswith(tuple("+-*/@,(=")) or above.count("(") > above.count(")"):
        return "Perhaps the line above is not finished: look for a missing bracket or number there."
    return ""


def _open_docstring(text: str) -> int:
    """Line of the first three quotation marks whose partner stands in another function; 0 if there are none."""
    parts = text.split('"""')
    for k in range(1, len(parts), 2):
        if re.search(r"^(def|@)", parts[k], re.MULTILINE):
            return len(lines('"""'.join(parts[:k]) + "."))
    return 0


def _typed(character: str) -> str:
    if character in TYPED:
        return (
            f"The character {character} comes from a text processor, a web page or a PDF: "
            f"write {TYPED[character].strip()}."
        )
    if not character.isprintable() or character.isspace():
        return (
            "An invisible character stands here, copied from a web page or a PDF: delete it and what is beside it, "
            "and type that again."
        )
    return f"Python knows no {character}: use the characters of the keyboard."


def _filled(words: str, found: re.Match[str]) -> str:
    for k, group in enumerate(found.groups(), 1):
        words = words.replace(f"{{{k}}}", group or "").replace(f"{{={k}}}", (group or "")[:1])
    return words
