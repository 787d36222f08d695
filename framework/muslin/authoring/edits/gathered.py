"""Edits that are several changes and one slip: the same throughout, branches or names exchanged."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from muslin.authoring import substitutes
from muslin.authoring.edits.pieces import terms
from muslin.authoring.edits.statements import VALUED
from muslin.authoring.edits.words import Edit

if TYPE_CHECKING:
    from muslin.authoring.edits.reader import Reader


def together(singles: list[Edit]) -> Iterator[Edit]:
    """The same slip made everywhere: in a line, and in the whole function."""
    groups: dict[tuple[str, ...], list[Edit]] = {}
    for edit in singles:
        groups.setdefault((edit.kind, edit.detail, edit.place), []).append(edit)
        groups.setdefault((edit.kind, edit.detail), []).append(edit)
        if edit.shape:
            alike = re.sub(r"\d+", "#", edit.detail)
            groups.setdefault((edit.kind, alike, edit.shape, "like"), []).append(edit)
            groups.setdefault((edit.kind, alike, edit.shape, edit.line), []).append(edit)
        if edit.kind in ("lacks", "index"):  # the same name or index, whatever it is taken from
            what = edit.of if edit.kind == "lacks" else edit.detail.split("->")[-1]
            groups.setdefault((edit.kind, what, "of"), []).append(edit)
            groups.setdefault((edit.kind, what, edit.place, "of"), []).append(edit)
    for edits in groups.values():
        changes = {k: v for edit in edits for k, v in edit.changes.items()}
        if len(changes) > 1:
            places = list(dict.fromkeys(edit.place for edit in edits))
            place = places[0] if len(places) == 1 else f"{places[0]} and {places[-1]}"
            yield Edit(edits[0].kind, edits[0].detail, place, edits[0].of, "", changes)


def branches(reader: Reader) -> Iterator[Edit]:
    """Conditions of several branches exchanged, or all counted from another number."""
    branches = [
        n
        for n in ast.walk(reader.function)
        if isinstance(n, ast.If) and isinstance(n.test, ast.Compare) and isinstance(n.test.ops[0], ast.Eq)
    ]
    given = [n.test.comparators[0] for n in branches if isinstance(n.test, ast.Compare)]
    numbers = [node.number for node in given if isinstance(node, ast.Constant)]  # type: ignore[attr-defined]
    values: list[Any] = [node.value for node in given if isinstance(node, ast.Constant)]
    if len(values) < 2:
        return
    places = " and ".join(reader.place(branch.body[0]) for branch in branches)
    moved = [value + 1 for value in values]
    for of, others in (("are exchanged", values[::-1]), ("are counted from 1, not from 0", moved)):
        changes = {k: (lambda n, v=v: ast.Constant(v)) for k, v in zip(numbers, others, strict=True)}
        yield Edit("branches", of, places, of, "", changes)


def swaps(reader: Reader) -> Iterator[Edit]:
    """Two names exchanged: in the whole function, in a line, in one term of a line."""
    names = [*reader.arguments, *reader.said]
    scopes: list[tuple[str, ast.AST]] = [("the formula", reader.function)]
    for statement in ast.walk(reader.function):
        if isinstance(statement, VALUED) and statement.value is not None:
            place = reader.place(statement)
            scopes.append((place, statement.value))
            scopes += [(place, term) for term in terms(statement.value)]
    for (place, scope), (a, b) in itertools.product(scopes, itertools.combinations(names, 2)):
        if reader.kinds.get(a) != reader.kinds.get(b):
            continue
        along = {f"d{a}": f"d{b}", f"d{b}": f"d{a}"}  # what is told of their changes
        for other in ({a: b, b: a}, {a: b, b: a, **along}):
            changes = {
                node.number: (lambda n, o=other: ast.Name(o[n.id], ast.Load()))  # type: ignore[attr-defined]
                for node in ast.walk(scope)
                if isinstance(node, ast.Name) and node.id in other and isinstance(node.ctx, ast.Load)
            }
            if len(changes) > 1:
                of = f"{reader.told(ast.Name(a))} and {reader.told(ast.Name(b))}"
                yield Edit("exchanged", f"{a},{b}", place, of, "", changes)
    for place, scope in scopes:
        for which, of, changes in substitutes.exchanged(reader, scope):
            yield Edit("exchanged", which, place, of, "", changes)
