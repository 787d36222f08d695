"""Changes of what is listed: the entries of a vector, the rows and entries of a matrix."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable
from typing import Any

from muslin.reading.repairs.pieces import Found, code, minus, name, text_of
from muslin.reading.repairs.scope import Scope

#: Most entries of a list that is looked at.
MOST = 4


def changes(scope: Scope, node: Any) -> Found:
    """All changes of one list of entries, or of rows."""
    entries, here = list(node.elts), code(node)
    if not 1 < len(entries) <= MOST or isinstance(scope.parent(node), ast.Subscript):
        return
    if isinstance(scope.parent(node), ast.Assign):
        for a, b in itertools.combinations(range(len(entries)), 2):
            turn = {a: b, b: a}
            turned = ast.Tuple([entries[turn.get(k, k)] for k in range(len(entries))], ast.Load())
            words = (
                f"{code(entries[a])} and {code(entries[b])} are in each other's place (exchanged) in {here}"
            )
            yield "order", f"{a}<->{b}", words, turned
        return

    def made(values: list[ast.expr]) -> ast.expr:
        listed: ast.expr = type(node)(values, ast.Load())
        return listed

    rows = [row for row in entries if isinstance(row, (ast.List, ast.Tuple))]
    if len(rows) == len(entries):
        yield from _of_rows(scope, node, rows)
        return
    for p in itertools.permutations(range(len(entries))):
        moved = [k for k, q in enumerate(p) if k != q]
        if moved:
            which = " and ".join(map(str, moved)) if len(moved) == 2 else ", ".join(map(str, moved))
            words = f"the entries {which} are in the wrong order (exchanged) in {here}"
            yield "entries" if len(moved) > 2 else "order", f"{p}", words, made([entries[q] for q in p])
    if not rows:
        words = f"the signs of all entries are wrong in {here}"
        yield "turned", "all entries", words, made([minus(scope.alias(e)) for e in entries])
    numbers = {text: part for text, (part, shape) in scope.parts.items() if shape == ()}
    numbers |= {key: name(key) for key in scope.named(())}
    for k, entry in enumerate(entries):

        def put(new: ast.expr, k: int = k) -> ast.expr:
            return made([new if q == k else e for q, e in enumerate(entries)])

        if isinstance(entry, (ast.List, ast.Tuple)):
            continue
        if not (isinstance(entry, ast.Constant) and not entry.value):
            yield "entries", f"zero {k}", f"entry {k} should be zero in {here}", put(ast.Constant(0.0))
            continue
        for text, part in numbers.items():
            yield "entries", f"{k}={text}", f"entry {k} should not be zero in {here}", put(part)


def _of_rows(scope: Scope, node: Any, rows: list[Any]) -> Found:
    """Two entries of a matrix that have changed places, two rows, rows and columns, all signs."""
    here, width = code(node), len(rows[0].elts)
    if any(len(row.elts) != width for row in rows):
        return

    def made(entry: Callable[[int, int], ast.expr]) -> ast.expr:
        lines = [[entry(i, j) for j in range(width)] for i in range(len(rows))]
        return ast.List([ast.List(line, ast.Load()) for line in lines], ast.Load())

    def at(i: int, j: int) -> ast.expr:
        found: ast.expr = rows[i].elts[j]
        return found

    def swapped(a: tuple[int, int], b: tuple[int, int]) -> Callable[[int, int], ast.expr]:
        other = {a: b, b: a}
        return lambda i, j: at(*other.get((i, j), (i, j)))

    places = [(i, j) for i in range(len(rows)) for j in range(width)]
    for a, b in itertools.combinations(places, 2):
        if text_of(at(*a)) != text_of(at(*b)):
            words = f"the entries [{a[0]}, {a[1]}] and [{b[0]}, {b[1]}] are exchanged in {here}"
            yield "order", f"{a}{b}", words, made(swapped(a, b))
    for a, b in itertools.combinations(
        places, 2
    ):  # they stand in each other's place, and with the other sign
        if isinstance(at(*a), ast.UnaryOp) != isinstance(at(*b), ast.UnaryOp):
            words = f"the entries [{a[0]}, {a[1]}] and [{b[0]}, {b[1]}] are exchanged, but for their signs, in {here}"
            bare = {a: _with_sign(at(*a), at(*b)), b: _with_sign(at(*b), at(*a))}
            yield "entries", f"{a}{b}-", words, made(lambda i, j, o=bare: o.get((i, j)) or at(i, j))  # type: ignore[misc]
    for p, q in itertools.combinations(range(len(rows)), 2):
        turn = {p: q, q: p}
        words = f"the rows {p} and {q} are exchanged in {here}"
        yield "order", f"rows {p}{q}", words, made(lambda i, j, o=turn: at(o.get(i, i), j))  # type: ignore[misc]
    if len(rows) == width:
        words = f"rows and columns are exchanged (transposed) in {here}"
        yield "transposed", "all", words, made(lambda i, j: at(j, i))
    words = f"the signs of all entries are wrong in {here}"
    yield "turned", "all entries", words, made(lambda i, j: minus(scope.alias(at(i, j))))


def _with_sign(stands: ast.expr, other: ast.expr) -> ast.expr:
    """What another entry holds, with the sign this one has."""
    bare = other.operand if isinstance(other, ast.UnaryOp) else other
    return minus(bare) if isinstance(stands, ast.UnaryOp) else bare
