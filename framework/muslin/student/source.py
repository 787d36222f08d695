"""The anatomy of a student's file: which lines are the signature, the docstring, the body of which function.

Everything works on lines, so that what is not meant to change keeps every byte.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from muslin import paths
from muslin.errors import MuslinError


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
        self.lines = text.splitlines(keepends=True)
        try:
            self.tree = ast.parse(text)
        except SyntaxError as error:
            raise MuslinError(
                f"{where}, line {error.lineno}: Python cannot read this: {error.msg}."
            ) from None
        except ValueError as error:  # null bytes
            raise MuslinError(f"{where}: Python cannot read this: {error}.") from None
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


def read(path: Path) -> str:
    """Text of a file, all its line ends made plain newlines.

    Raises
    ------
    MuslinError
        If it is missing or not UTF-8 text.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise MuslinError(f"{paths.shown(path)} is missing.", "Bring it back with: muslin upgrade") from None
    except UnicodeDecodeError:
        raise MuslinError(f"{paths.shown(path)} is not UTF-8 text.", "Save it as UTF-8.") from None
    except OSError as error:
        raise MuslinError(f"{paths.shown(path)} cannot be read: {error.strerror}.") from None


def write(path: Path, text: str) -> None:
    """Write a file at once or not at all, with the line ends it has.

    Raises
    ------
    MuslinError
        If it cannot be written.
    """
    newline = "\n"
    try:
        if path.exists():
            newline = "\r\n" if b"\r\n" in path.read_bytes() else "\n"
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = path.with_name(path.name + ".new")
        with beside.open("w", encoding="utf-8", newline=newline) as stream:
            stream.write(text)
        beside.replace(path)
    except OSError as error:
        raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None


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
        source = Source(text)
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
