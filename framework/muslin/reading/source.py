"""A student's file: its text as Python reads it, and its anatomy (signature, docstring and body of every function).

Everything works on lines, so that what is not meant to change keeps every byte.
"""

from __future__ import annotations

import ast
import codecs
import contextlib
import functools
import hashlib
import io
import itertools
import linecache
import re
import tokenize
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import decode_source
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError, StudentCodeError
from muslin.reading import syntax


@dataclass(frozen=True)
class Function:
    """A function at the top level of a file, as ranges of line indices, one after the other without a gap.

    Attributes
    ----------
    name : str
    head : range
        Decorators and the line(s) of `def`.
    docstring : range
    body : range
        All the rest, comments at its end included.
    node : ast.FunctionDef
    """

    name: str
    head: range
    docstring: range
    body: range
    node: ast.FunctionDef

    @property
    def lines(self) -> range:
        """All of it."""
        return range(self.head.start, self.body.stop)

    @property
    def arguments(self) -> list[str]:
        """Names of the arguments."""
        return [a.arg for a in self.node.args.args]


class Source:
    """A file's text, read.

    Parameters
    ----------
    text : str
    where : str
        What the file is called in messages.

    Raises
    ------
    MuslinError
        If it is not Python.
    """

    def __init__(self, text: str, where: str = "the file"):
        self.text = text
        self.lines = syntax.lines(text)
        self.tree = syntax.parsed(text, where)
        found = (self._function(node) for node in self.tree.body if isinstance(node, ast.FunctionDef))
        self.functions = {function.name: function for function in found}

    def _function(self, node: ast.FunctionDef) -> Function:
        start = min([node.lineno, *(d.lineno for d in node.decorator_list)]) - 1
        first = node.body[0]
        if ast.get_docstring(node, clean=False) is not None:
            docstring = range(first.lineno - 1, first.end_lineno or first.lineno)
        else:
            after = self._head_end(node)
            docstring = range(after, after)
        end = node.end_lineno or node.lineno
        for k in range(end, len(self.lines)):  # comments that end the body belong to it
            if self.lines[k].strip():
                if self.lines[k][0] not in " \t":
                    break
                end = k + 1
        return Function(node.name, range(start, docstring.start), docstring, range(docstring.stop, end), node)

    def _head_end(self, node: ast.FunctionDef) -> int:
        """Index after the line on which `def ...:` ends."""
        first = node.body[0]
        for k in range(node.lineno - 1, first.lineno - 1):
            if self.lines[k].split("#")[0].rstrip().endswith(":"):
                return k + 1
        return first.lineno - 1

    def piece(self, lines: range) -> str:
        """Text of a range of lines."""
        return "".join(self.lines[lines.start : lines.stop])


def decoded(data: bytes, where: str = "the file") -> str:
    """Text of a Python file as Python reads it: in the encoding it declares, else UTF-8; line ends made newlines.

    Raises
    ------
    StudentCodeError
        If it is not text in that encoding.
    """
    wide = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, codecs.BOM_UTF32_BE)
    if data.startswith(wide):
        raise StudentCodeError(
            f"{where} is not UTF-8 text but UTF-16 or UTF-32, which Python does not read.", SAVE
        )
    try:
        return decode_source(data)
    except UnicodeDecodeError as error:
        start, encoding = error.start, error.encoding
    except (SyntaxError, LookupError) as error:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError as inside:
            start, encoding = inside.start, "utf-8"
        else:
            why = str(error) if isinstance(error, LookupError) else (error.msg or "")
            raise StudentCodeError(
                f"{where} declares an encoding in its first lines that Python does not know ({why}).",
                "Take that line out, and save the file as UTF-8.",
            ) from None
    except UnicodeError as error:
        raise StudentCodeError(f"{where} cannot be read as text: {error}.", SAVE) from None
    line = len(syntax.lines(data[:start].decode("latin-1") + "."))
    name = "UTF-8" if encoding.startswith("utf-8") else encoding
    raise StudentCodeError(f"{where}, line {line}: this is not {name} text.", SAVE) from None


#: What to do about a file in an encoding that Python does not expect.
SAVE = "Save it as UTF-8; your editor asks for the encoding, or shows it in its last line."


def glimpse(path: Path) -> str:
    """Text of a file to notice changes by; what cannot be decoded is replaced, a missing file is empty.

    Raises
    ------
    OSError
        If the file is there and cannot be read.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return ""
    try:
        return decoded(data)
    except StudentCodeError:
        return data.decode("utf-8", "replace")


def read(path: Path) -> str:
    """Text of a file, all its line ends made plain newlines.

    Raises
    ------
    MuslinError
        If it is missing or cannot be read as text.
    """
    try:
        return decoded(path.read_bytes(), paths.shown(path))
    except FileNotFoundError:
        raise MuslinError(f"{paths.shown(path)} is missing.", "Bring it back with: muslin upgrade") from None
    except OSError as error:
        raise MuslinError(f"{paths.shown(path)} cannot be read: {error.strerror}.") from None


def write(path: Path, text: str) -> None:
    """Write a file at once or not at all, with the line ends, the mark and the encoding it has.

    Raises
    ------
    MuslinError
        If it cannot be written.
    """
    newline, mark, encoding = "\n", b"", "utf-8"
    try:
        if path.exists():
            before = path.read_bytes()
            newline = "\r\n" if b"\r\n" in before else "\n"
            mark = codecs.BOM_UTF8 if before.startswith(codecs.BOM_UTF8) else b""
        if path.suffix == ".py" and not mark:
            with contextlib.suppress(SyntaxError):
                encoding, _ = tokenize.detect_encoding(io.BytesIO(text.encode()).readline)
        data = mark + text.replace("\n", newline).encode(encoding)
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = path.with_name(path.name + ".new")
        beside.write_bytes(data)
        beside.replace(path)
    except UnicodeEncodeError as error:
        raise MuslinError(
            f"{paths.shown(path)} declares the encoding {encoding}, which lacks {error.object[error.start]!r}.",
            "Save the file as UTF-8 and take the declaration out.",
        ) from None
    except OSError as error:
        raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None


def rows(text: str) -> list[str]:
    """Lines of a file as Taichi may read them.

    A form feed in an indentation counts for nothing in Python, but Taichi would count it as a column.
    """
    return [re.sub(r"^[ \t\f]*\f", "", row) for row in syntax.lines(text)]


def remember(filename: str, text: str) -> None:
    """Have Python and Taichi find the source of functions under a name that need not be a file's."""
    linecache.cache[filename] = (len(text), None, rows(text), filename)


#: A line with which a function begins.
_BEGINS = re.compile(r"@|(?:async[ \t]+)?def\b")
#: The line with its name.
_NAMED = re.compile(r"(?:async[ \t]+)?def[ \t]+(\w+)")


def legible(text: str, names: Collection[str], where: str) -> tuple[str, dict[str, StudentCodeError]]:
    """A file without those functions that Python cannot read, if they can be told from the rest of it.

    It is cut wherever a function begins in the first column, and each piece is read alone. A piece that Python cannot
    read is left out if it is one of the functions in `names` and nothing else: blank lines stand in its place, and
    all other lines keep their numbers.

    Parameters
    ----------
    text : str
    names : collection of str
        Functions that may be left out: where a helper is broken, it cannot be told whom that concerns.
    where : str
        What the file is called in messages.

    Returns
    -------
    text : str
    broken : dict
        What is wrong with each function that is left out, by name.

    Raises
    ------
    StudentCodeError
        If it cannot be told what is broken: what Python says of the whole file.
    """
    try:
        syntax.compiled(text, where, where)
        return text, {}
    except StudentCodeError as error:
        whole = error
    rows = syntax.lines(text)
    broken: dict[str, StudentCodeError] = {}
    for name, piece in pieces(rows):
        start, stop = piece.start, piece.stop
        try:
            syntax.compiled("\n" * start + "".join(rows[start:stop]), where, where)
        except StudentCodeError as error:
            if name not in names or name in broken:
                raise whole from None
            broken[name] = error
            rows[start:stop] = ["\n"] * (stop - start)
    rest = "".join(rows)
    try:
        syntax.compiled(rest, where, where)
    except StudentCodeError:
        raise whole from None
    return rest, broken if len(broken) != 1 else dict.fromkeys(broken, whole)


def pieces(rows: Sequence[str]) -> Iterator[tuple[str, range]]:
    """A file cut wherever a function begins, whether Python can read it or not: (name, lines).

    A function begins in the first column, or right below a decorator that does. The name is empty where more than one
    function stands, or none.
    """
    begins = [
        k
        for k, row in enumerate(rows)
        if _BEGINS.match(row) or (k and rows[k - 1][0] == "@" and _NAMED.match(row.lstrip(" \t")))
    ]
    starts = [k for n, k in enumerate(begins) if n == 0 or rows[begins[n - 1]][0] != "@"]
    for start, stop in itertools.pairwise([0, *starts, len(rows)]):
        yield _only_function(rows[start:stop]), range(start, stop)


def _only_function(rows: Sequence[str]) -> str:
    """Name of the function that these lines are, as far as their first columns tell; empty if more stands there."""
    first = [row for row in rows if row[0] not in " \t\r\n\f#)]}@"]
    if not first:  # a function that is indented, below its decorator
        first = [row.lstrip(" \t") for above, row in itertools.pairwise(rows) if above[0] == "@"]
    named = _NAMED.match(first[0]) if len(first) == 1 else None
    return named[1] if named is not None else ""


@functools.lru_cache(maxsize=16)
def read_once(text: str) -> Source:
    """A file's text, read: a file is asked about once for each of its functions.

    Raises
    ------
    MuslinError
        If it is not Python.
    """
    return Source(text)


def without_docstring(node: ast.FunctionDef) -> str:
    """A function's body as Python understands it, without docstring, comments and layout."""
    body = node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body
    return "\n".join(ast.dump(statement) for statement in body)


def fingerprint(text: str, name: str) -> str:
    """What a function computes depends on: changes if, and only if, it may behave differently.

    Counts the function, what it uses of the functions beside it, and the file's other statements; comments,
    docstrings and layout do not count, nor do other tasks that it does not use.

    Parameters
    ----------
    text : str
        The file.
    name : str
        The function.

    Returns
    -------
    str
        A sha256; of the plain text if it is not Python.
    """
    try:
        source = read_once(text)
    except MuslinError:
        return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()
    wanted, todo = set(), [name]
    while todo:
        this = todo.pop()
        if this in source.functions and this not in wanted:
            wanted.add(this)
            used = ast.walk(source.functions[this].node)
            todo += [node.id for node in used if isinstance(node, ast.Name)]
    parts = []
    for node in source.tree.body:
        if isinstance(node, ast.FunctionDef):
            if node.name in wanted:
                decorators = "".join(map(ast.dump, node.decorator_list))
                parts.append(f"{node.name}{decorators}{ast.dump(node.args)}{without_docstring(node)}")
        elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            parts.append(ast.dump(node))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def imports(tree: ast.Module) -> Iterator[ast.Import | ast.ImportFrom]:
    """Import statements at the top level."""
    for node in tree.body:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            yield node
