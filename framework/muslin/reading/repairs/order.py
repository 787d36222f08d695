"""Lines in the wrong place: one that stands too early or too late, or under a condition where it does not belong."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator

from muslin.reading.repairs.pieces import Repair, code
from muslin.reading.repairs.scope import Scope

#: Lines of a block that are moved.
LINES = 8


def changes(scope: Scope) -> Iterator[Repair]:
    """Two lines of a block exchanged; a line taken out of a condition, or put into it."""
    for node in ast.walk(scope.meaning.node):
        for block in (getattr(node, "body", None), getattr(node, "orelse", None)):
            if isinstance(block, list):
                yield from _moved(
                    [s for s in block if isinstance(s, (ast.Assign, ast.AugAssign, ast.If, ast.For))]
                )
                yield from _conditions(scope, block)


def _said(node: ast.stmt) -> str:
    """A line by its number and text."""
    if isinstance(node, (ast.If, ast.For)):
        head = (
            f"if {ast.unparse(node.test)}" if isinstance(node, ast.If) else f"for {ast.unparse(node.target)}"
        )
        return f"`{head}: ...` in line {node.lineno}"
    return f"{code(node)} in line {node.lineno}"


def _moved(block: list[ast.stmt]) -> Iterator[Repair]:
    """A line that belongs further up, or further down."""
    pairs = itertools.combinations(range(min(len(block), LINES)), 2)
    for a, b in sorted(pairs, key=lambda pair: pair[1] - pair[0]):
        for turned in {(*range(a + 1, b + 1), a), (b, *range(a, b))}:
            moved = {id(block[a + k]): block[q] for k, q in enumerate(turned)}
            late = turned[0] == b
            one, other = (block[b], block[a]) if late else (block[a], block[b])
            when, where = ("late", "before") if late else ("early", "after")
            words = f"{_said(one)} stands too {when}: it belongs {where} {_said(other)}"
            yield Repair("loop", f"moved {a}{b}{late}", one.lineno, words, moved)


def _conditions(scope: Scope, block: list[ast.stmt]) -> Iterator[Repair]:
    """A line after a condition that belongs under it; the last one under it that belongs after it."""
    for one, after in itertools.pairwise(block):
        if isinstance(one, ast.If) and isinstance(after, (ast.Assign, ast.AugAssign)):
            inside = ast.If(one.test, [*one.body, scope.alias(after)], one.orelse)
            words = f"{_said(after)} is done always: it belongs under the condition {code(one.test)}"
            yield Repair("condition", "into", after.lineno, words, {id(one): inside, id(after): ast.Pass()})
    for one in block:
        if (
            isinstance(one, ast.If)
            and len(one.body) > 1
            and isinstance(one.body[-1], (ast.Assign, ast.AugAssign))
        ):
            last = one.body[-1]
            out = ast.If(ast.Constant(True), [ast.If(one.test, one.body[:-1], one.orelse), last], [])
            words = f"{_said(last)} belongs after the condition {code(one.test)}: it should be done always"
            yield Repair("condition", "out", last.lineno, words, {id(one): out})
