"""Edits of a line: its condition, its loop, what it does with its value."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from muslin.authoring.edits import nodes
from muslin.authoring.edits.pieces import call, minus, numeral, shape_of
from muslin.authoring.edits.words import Edit

if TYPE_CHECKING:
    from muslin.authoring.edits.reader import Reader

#: Statements that compute a value.
VALUED = (ast.Assign, ast.AugAssign, ast.Return)

_FLIPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add}
#: Comparisons, and what one says that stands in place of another.
_COMPARED: Mapping[type[ast.cmpop], str] = {
    ast.Lt: "the comparison is turned round, or equality is taken otherwise (< stands there)",
    ast.LtE: "equality is taken otherwise, or the comparison is turned round (<= stands there)",
    ast.Gt: "the comparison is turned round, or equality is taken otherwise (> stands there)",
    ast.GtE: "equality is taken otherwise, or the comparison is turned round (>= stands there)",
    ast.Eq: "it asks for equality (==)",
    ast.NotEq: "it asks for what is not equal (!=)",
}


def changes(reader: Reader, body: Sequence[ast.stmt]) -> Iterator[Edit]:
    """Edits of every line."""
    for statement in body:
        place = reader.place(statement)
        if isinstance(statement, ast.If):
            yield from _condition(reader, statement)
            yield from changes(reader, statement.body)
            yield from changes(reader, statement.orelse)
        elif isinstance(statement, ast.For):
            yield from _loop(reader, statement)
            yield from changes(reader, statement.body)
        elif isinstance(statement, VALUED) and statement.value is not None:
            for node in ast.walk(statement.value):
                for kind, detail, of, change in nodes.changes(reader, node):
                    yield reader.edit(kind, detail, place, of, node, change, statement)
            yield from _whole(reader, statement, place)
            yield from _stored(reader, statement, place)


def _loop(reader: Reader, statement: ast.For) -> Iterator[Edit]:
    """A loop that ends too early, begins too late, or makes its first or last pass alone."""
    number, place = statement.iter.number, reader.place(statement)  # type: ignore[attr-defined]
    size = ast.literal_eval(statement.iter.args[-1])  # type: ignore[attr-defined]
    passes = {
        "its last term is missing: a range may end too early": range(size - 1),
        "its first term is missing: a range may begin at 1": range(1, size),
        "only its first term comes in": range(1),
        "only its last term comes in: an assignment may overwrite where += would add": range(size - 1, size),
        "its middle term is missing": range(0, size, 2),
    }
    for of, those in passes.items():
        alone = ast.parse(repr(list(those)), mode="eval").body
        yield Edit("loop", of, place, of, "", {number: lambda n, o=alone: o})


def _stored(reader: Reader, statement: Any, place: str) -> Iterator[Edit]:
    """What a line does with its value: adds it, takes it away, overwrites, or is left out."""
    number = statement.number
    if isinstance(statement, ast.AugAssign):
        of = "it is overwritten in each pass, = or =+ stands for +="
        yield Edit("loop", "overwritten", place, of, "",
                   {number: lambda n: ast.Assign([n.target], n.value, lineno=n.lineno)})  # fmt: skip
        yield Edit("sign", "taken away", place, ": -= stands for +=", "",
                   {number: lambda n: ast.AugAssign(n.target, _FLIPPED[type(n.op)](), n.value)})  # fmt: skip
        of = "factors are multiplied, *= stands for +="
        yield Edit("loop", "multiplied", place, of, "",
                   {number: lambda n: ast.AugAssign(n.target, ast.Mult(), n.value)})  # fmt: skip
    if not isinstance(statement, ast.Return):
        yield Edit("lacks", "the line", place, "the whole line", "", {number: lambda n: ast.Pass()})


def _whole(reader: Reader, statement: Any, place: str) -> Iterator[Edit]:
    """Edits of all that a line computes."""
    number = statement.value.number
    if isinstance(statement.value, ast.Tuple):
        return
    yield Edit("sign", "whole line", place, "", "", {number: minus})
    for factor in (2, 0.5):
        of = "a factor of 2" if factor == 2 else "a factor of 1/2"
        yield Edit("extra", f"times {factor}", place, of, "",
                   {number: lambda n, f=factor: ast.BinOp(n, ast.Mult(), numeral(f))})  # fmt: skip
    for name in reader.scalars:
        for op, words in ((ast.Mult(), name), (ast.Div(), f"1/{name}")):
            yield Edit("extra", f"{type(op).__name__} {name}", place, words, "",
                       {number: lambda n, o=op, m=name: ast.BinOp(n, o, ast.Name(m, ast.Load()))})  # fmt: skip
    for method, kind, of in (
        ("normalized", "length", "a vector has been made of length one"),
        ("transpose", "transposed", ""),
    ):
        yield Edit(kind, method, place, of, "", {number: lambda n, m=method: call(n, m)})


def _condition(reader: Reader, statement: ast.If) -> Iterator[Edit]:
    place = reader.place(statement.body[0])
    number = statement.test.number  # type: ignore[attr-defined]
    for value in (True, False):
        yield Edit("condition", str(value), place, "", "", {number: lambda n, v=value: ast.Constant(v)})
    if not isinstance(statement.test, ast.Compare):
        return
    for op, of in _COMPARED.items():
        if not isinstance(statement.test.ops[0], op):
            yield Edit("condition", op.__name__, place, f": {of}", "",
                       {number: lambda n, o=op: ast.Compare(n.left, [o()], n.comparators)})  # fmt: skip
    parts = (
        *reader.atoms,
        *reader.parts,
        *(ast.Name(n, ast.Load()) for n in reader.scalars),
        ast.Constant(0),
        ast.Constant(1),
    )
    for side in (statement.test.left, statement.test.comparators[0]):
        which = side.number  # type: ignore[attr-defined]
        for new in parts:
            if ast.unparse(new) != ast.unparse(side):
                of = f": it compares {reader.shown(new)}"
                yield Edit("condition", ast.unparse(new), place, of, "", {which: lambda n, o=new: o})
    for node in ast.walk(statement.test):
        for kind, detail, of, change in nodes.changes(reader, node):
            if kind in ("number", "sign", "lacks", "index", "name", "another"):
                kind, of = "condition", f": {of}" if of and not of.startswith(":") else of
            yield Edit(kind, detail, place, of, shape_of(node), {node.number: change})  # type: ignore[attr-defined]
