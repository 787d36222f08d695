"""A function under the eyes: its syntax tree, what surrounds it, and what is noted about it."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Note:
    """Something noticed.

    Attributes
    ----------
    line : int
    code : str
        The expression.
    words : str
        What is wrong with it, and what to write instead.
    fatal : bool
        Whether it explains why the function cannot be run, where it cannot. Nothing is refused for it: a text may mean
        something else than whoever reads it thinks.
    compiles : bool
        Whether it compiles all the same, so that it explains no compile error.
    """

    line: int
    code: str
    words: str
    fatal: bool = False
    compiles: bool = False

    def __str__(self) -> str:
        return f"line {self.line}, {self.code}: {self.words}"


@dataclass(frozen=True)
class Page:
    """A function to read.

    Attributes
    ----------
    text : str
        The file.
    node : ast.FunctionDef
    arguments : frozenset of str
    functions : dict
        The file's functions by name.
    modules : dict
        Names that stand for modules or things imported from them: name -> what was imported ("numpy.linalg").
    known : frozenset of str
        All names the file gives a meaning at its top level.
    asked : tuple of str
        Names of the results the task asks for; empty for a helper.
    sizes : dict
        How many components the arguments have that are vectors, where that is known.
    """

    text: str
    node: ast.FunctionDef
    arguments: frozenset[str]
    functions: dict[str, ast.FunctionDef]
    modules: dict[str, str]
    known: frozenset[str]
    asked: tuple[str, ...] = ()
    sizes: Mapping[str, int] = field(default_factory=dict)

    def note(self, node: ast.AST, words: str, fatal: bool = False, compiles: bool = False) -> Note:
        """A note about a node."""
        code = shorter(ast.get_source_segment(self.text, node) or shown(node))
        return Note(node.lineno, code, words, fatal, compiles)  # type: ignore[attr-defined]

    def foreign(self, name: str) -> bool:
        """Whether a name is NumPy's or math's, and not an argument."""
        origin = self.modules.get(name, name if name in ("np", "numpy", "math") else "")
        return name not in self.arguments and origin.split(".")[0] in ("np", "numpy", "math", "scipy")


@functools.lru_cache(maxsize=64)
def nodes(node: ast.AST) -> tuple[ast.AST, ...]:
    """A node and all below it: walked once, since every notice looks at them all."""
    return tuple(ast.walk(node))


def sentence(words: str, code: str) -> str:
    """Words with a capital in front, unless they begin with a name that stands in the code."""
    first = re.match(r"[\w.]+", words)
    if first is not None and re.search(rf"(?<!\w){re.escape(first[0])}(?!\w)", code):
        return words
    return words[:1].upper() + words[1:]


def shown(node: ast.AST) -> str:
    """A node as one short line of code."""
    return shorter(ast.unparse(node))


def shorter(code: str) -> str:
    """Code in one line, cut where it is long."""
    code = " ".join(code.split())
    return code if len(code) <= 60 else code[:57] + "..."


def assignments(node: ast.AST) -> Iterator[tuple[ast.stmt, ast.expr, ast.expr]]:
    """Statements that give something a value: (statement, target, value)."""
    for statement in nodes(node):
        if isinstance(statement, ast.Assign):
            for target in statement.targets:
                yield statement, target, statement.value
        elif isinstance(statement, (ast.AugAssign, ast.AnnAssign)) and statement.value is not None:
            yield statement, statement.target, statement.value


def name_of(target: ast.expr) -> str:
    """Variable behind `v`, `v[0]`, `v[0, :]`, `v.x`."""
    while isinstance(target, (ast.Subscript, ast.Attribute)):
        target = target.value
    return target.id if isinstance(target, ast.Name) else ""


def is_taichi(node: ast.expr, *names: str) -> bool:
    """Whether a call is `ti.NAME(...)`."""
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id in ("ti", "taichi")
        and (not names or node.func.attr in names)
    )


def free(node: ast.AST) -> list[ast.Name]:
    """Names that a function uses and gives no meaning itself, as an argument, a variable, or a loop's."""
    own = {n.arg for n in nodes(node) if isinstance(n, ast.arg)}
    names = [n for n in nodes(node) if isinstance(n, ast.Name)]
    own |= {n.id for n in names if not isinstance(n.ctx, ast.Load)}
    return [n for n in names if n.id not in own]


def used(functions: dict[str, ast.FunctionDef], name: str) -> list[str]:
    """A function of the file and those it uses, itself first."""
    found: list[str] = []
    todo = [name]
    while todo:
        this = todo.pop()
        if this in functions and this not in found:
            found.append(this)
            todo += [n.id for n in ast.walk(functions[this]) if isinstance(n, ast.Name)]
    return found
