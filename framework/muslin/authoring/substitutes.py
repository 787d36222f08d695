"""One part of a formula in place of another: entries of arrays, and whole parts of the function.

The slips of `muslin.authoring.edits` that do not change an operation, but take something else for an operand.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from muslin.authoring.edits import Reader

#: Nodes a part may have to stand in for another one, and a part that is replaced.
SMALL, LARGE = 12, 16

#: Entries people take of an argument, by its kind.
ENTRIES = {"vec3": ("0", "1", "2"), "mat3": ("0, 0", "0, 1", "1, 0", "1, 1", "2, 2")}


def _distinct(nodes: Iterator[ast.expr]) -> list[ast.expr]:
    return list({ast.unparse(node): node for node in nodes}.values())


def atoms(reader: Reader) -> list[ast.expr]:
    """Entries of arrays: those the function takes, and others of the arguments it takes any of."""
    taken = [
        n for n in ast.walk(reader.function) if isinstance(n, ast.Subscript) and ":" not in ast.unparse(n)
    ]
    if not taken:
        return []
    others = [
        ast.parse(f"{name}[{entry}]", mode="eval").body
        for name, kind in reader.kinds.items()
        for entry in ENTRIES.get(kind, ())
    ]
    loads = (n for n in taken if isinstance(n.ctx, ast.Load))
    return _distinct(itertools.chain(loads, others))


def parts(reader: Reader) -> list[ast.expr]:
    """Sums, products and calls of the function that are small enough to stand somewhere else."""
    return _distinct(
        node
        for node in ast.walk(reader.function)
        if isinstance(node, (ast.BinOp, ast.Call)) and sum(1 for _ in ast.walk(node)) <= SMALL
    )


def of(reader: Reader, node: ast.AST) -> Iterator[tuple[str, str, str, Callable[..., Any]]]:
    """What may stand in place of a node: (kind, what makes two edits the same, of what, change)."""
    here = ast.unparse(node)
    if isinstance(node, (ast.Subscript, ast.Name)) and isinstance(node.ctx, ast.Load):
        news = [*reader.atoms, *reader.parts]
    elif isinstance(node, (ast.BinOp, ast.Call)) and sum(1 for _ in ast.walk(node)) <= LARGE:
        names = [ast.Name(name, ast.Load()) for name in (*reader.arguments, *reader.said)]
        news = [*reader.atoms, *reader.parts, *names]
    else:
        return
    for new in news:
        text = ast.unparse(new)
        if text != here:
            yield "another", f"{here}->{text}", reader.instead(new, node), lambda n, o=new: o


def exchanged(reader: Reader, scope: ast.AST) -> Iterator[tuple[str, str, dict[int, Callable[..., Any]]]]:
    """Two entries of one array that have changed places in a scope: (which, in words, changes)."""
    found: dict[str, list[ast.Subscript]] = {}
    for node in ast.walk(scope):
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
            found.setdefault(ast.unparse(node), []).append(node)
    for (a, here), (b, there) in itertools.combinations(found.items(), 2):
        if a.split("[")[0] == b.split("[")[0]:
            changes: dict[int, Callable[..., Any]] = {}
            for nodes, other in ((here, there[0]), (there, here[0])):
                changes |= {n.number: (lambda _, o=other: o) for n in nodes}  # type: ignore[attr-defined]
            array, first, second = a.split("[")[0], a[a.index("[") :], b[b.index("[") :]
            yield f"{a},{b}", f"components {first} and {second} of {reader.told(ast.Name(array))}", changes
