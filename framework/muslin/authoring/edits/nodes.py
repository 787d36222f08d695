"""Edits of one node of a formula: a sign, an index, a name, an operator, a product."""

from __future__ import annotations

import ast
import copy
import itertools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from muslin.authoring import substitutes
from muslin.authoring.edits.pieces import (
    absolute,
    call,
    minus,
    numeral,
    operation,
    others,
    spread_left,
    spread_right,
    square_inside,
    square_outside,
)
from muslin.authoring.edits.words import Change, Changes

if TYPE_CHECKING:
    from muslin.authoring.edits.reader import Reader

_FLIPPED = {ast.Add: ast.Sub, ast.Sub: ast.Add}

_METHODS: Mapping[str, tuple[tuple[str, str, str], ...]] = {
    "norm": (("norm_sqr", "length", "the squared length stands for the length"),),
    "norm_sqr": (("norm", "length", "the length stands for the squared length"),),
    "cross": (("dot", "operation", "a dot product stands for the cross product"),),
    "dot": (("cross", "operation", "a cross product stands for the dot product"),),
    "outer_product": (
        ("dot", "operation", "a dot product stands for the outer product"),
        ("cross", "operation", "a cross product stands for the outer product"),
    ),
    "cols": (("rows", "entries", "vectors stand in rows where they should be columns"),),
    "rows": (("cols", "entries", "vectors stand in columns where they should be rows"),),
}


def changes(reader: Reader, node: ast.AST) -> Changes:
    """Edits of one node: (kind, what makes two edits the same, of what, change)."""
    yield from substitutes.of(reader, node)
    if isinstance(node, ast.BinOp):
        yield from _binary(reader, node)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "sign", "minus dropped", ": a minus is missing", lambda n: n.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        for number in others(float(node.value)):
            yield "number", f"{node.value}->{number}", f"{number:g}", lambda n, o=number: numeral(o)
    elif isinstance(node, ast.Subscript):
        yield from _subscript(reader, node)
    elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
        same = [n for n in reader.arguments if reader.kinds[n] == reader.kinds.get(node.id, reader.kinds[n])]
        for other in [*same, *reader.said]:
            if other != node.id:
                of = reader.instead(ast.Name(other), node)
                yield "name", f"{node.id}->{other}", of, lambda n, o=other: ast.Name(o, ast.Load())
        if node.id in reader.loops:
            for k in range(3):
                of = f"the index {k} stands where {node.id} belongs"
                yield "name", f"{node.id}->{k}", of, lambda n, k=k: ast.Constant(k)
        if reader.kinds.get(node.id) == "scalar":
            of = f"the number 1 stands where {node.id} belongs"
            yield "name", f"{node.id}->1", of, lambda n: ast.Constant(1.0)
        if reader.kinds.get(node.id) == "mat3":
            yield "transposed", node.id, f": of {node.id}", lambda n: call(n, "transpose")
            yield "inverse", node.id, f": of {node.id}", lambda n: call(n, "inverse")
        yield (
            "power",
            f"{node.id} squared",
            f": {reader.told(node)} is squared",
            lambda n: ast.BinOp(n, ast.Pow(), ast.Constant(2)),
        )
        yield (
            "length",
            f"{node.id} of length one",
            "a vector has been made of length one",
            (lambda n: call(n, "normalized")),
        )
    elif isinstance(node, (ast.List, ast.Tuple)) and len(node.elts) > 1:
        yield from _listed(reader, node)
    elif isinstance(node, ast.Call):
        yield from _called(reader, node)


def _binary(reader: Reader, node: ast.BinOp) -> Changes:
    op, left, right = node.op, reader.told(node.left), reader.told(node.right)
    key = f"{ast.unparse(node.left)} | {ast.unparse(node.right)}"
    if isinstance(op, (ast.Add, ast.Sub)):
        yield (
            "power",
            "sum squared",
            ": a sum is squared",
            lambda n: ast.BinOp(n, ast.Pow(), ast.Constant(2)),
        )
        yield "sign", "second", f": before {right}", lambda n: operation(n, _FLIPPED[type(n.op)]())
        yield "sign", "first", f": before {left}", lambda n: ast.BinOp(minus(n.left), n.op, n.right)
        what = f"{right} that is subtracted" if isinstance(op, ast.Sub) else f"{right} that is added"
        yield "lacks", f"right {key}", what, lambda n: n.left
        yield (
            "lacks",
            f"left {key}",
            f"{left} that the rest is subtracted from" if isinstance(op, ast.Sub) else f"{left} of a sum",
            ((lambda n: n.right) if isinstance(op, ast.Add) else (lambda n: minus(n.right))),
        )
        yield (
            "extra",
            f"twice {right}",
            right,
            (lambda n: ast.BinOp(n.left, n.op, ast.BinOp(ast.Constant(2), ast.Mult(), n.right))),
        )
        yield (
            "extra",
            f"twice {left}",
            left,
            (lambda n: ast.BinOp(ast.BinOp(ast.Constant(2), ast.Mult(), n.left), n.op, n.right)),
        )
        yield (
            "operation",
            "product of terms",
            "terms are multiplied that should be added",
            (lambda n: operation(n, ast.Mult())),
        )
        if isinstance(node.left, ast.BinOp) and isinstance(node.left.op, ast.Pow):
            yield "brackets", "square of the sum", "", square_outside
    elif isinstance(op, (ast.Mult, ast.MatMult)):
        yield "lacks", f"right {key}", f"the factor {right}", lambda n: n.left
        yield "lacks", f"left {key}", f"the factor {left}", lambda n: n.right
        if isinstance(op, ast.Mult):
            yield "inverted", "", f": {right}", lambda n: operation(n, ast.Div())
            yield (
                "inverted",
                "left below",
                f": {left}",
                lambda n: ast.BinOp(n.right, ast.Div(), n.left),
            )
            yield (
                "operation",
                "sum of factors",
                "factors are added that should be multiplied",
                (lambda n: operation(n, ast.Add())),
            )
        else:
            yield (
                "factors exchanged",
                "@",
                "a matrix product",
                (lambda n: ast.BinOp(n.right, n.op, n.left)),
            )
            yield "entry by entry", "@", "", lambda n: operation(n, ast.Mult())
        for change in (spread_right, spread_left):
            yield "brackets", change.__name__, "", change
    elif isinstance(op, ast.Div):
        yield "lacks", f"below {key}", f"the division by {right}", lambda n: n.left
        yield "inverted", "", f": {right}", lambda n: operation(n, ast.Mult())
        yield (
            "inverted",
            "upside down",
            ": a quotient is upside down",
            lambda n: ast.BinOp(n.right, n.op, n.left),
        )
        yield (
            "power",
            "below squared",
            f": {right} is squared",
            lambda n: ast.BinOp(n.left, n.op, ast.BinOp(n.right, ast.Pow(), ast.Constant(2))),
        )
        yield (
            "power",
            "below root",
            f": of {right} the root is taken",
            lambda n: ast.BinOp(n.left, n.op, ast.BinOp(n.right, ast.Pow(), ast.Constant(0.5))),
        )
        yield "brackets", "over", "", spread_left
    elif isinstance(op, ast.Pow):
        yield "power", "dropped", ": a square is missing", lambda n: n.left
        yield "power", "inside", ": terms are squared one by one", square_inside
        yield "power", "half", ": it is squared twice", lambda n: ast.BinOp(n.left, n.op, ast.Constant(4))


def _subscript(reader: Reader, node: ast.Subscript) -> Changes:
    whole = ast.unparse(node)
    if isinstance(node.slice, ast.Constant):
        for k in range(3):
            if k != node.slice.value:
                yield (
                    "index",
                    f"{whole}->{k}",
                    f": {k} is taken",
                    lambda n, k=k: ast.Subscript(n.value, ast.Constant(k), n.ctx),
                )
        yield (
            "power",
            f"{whole} squared",
            f": {reader.told(node)} is squared",
            lambda n: ast.BinOp(n, ast.Pow(), ast.Constant(2)),
        )
    elif isinstance(node.slice, ast.Tuple):
        yield (
            "index",
            f"{whole} turned",
            (
                ": a column stands for a row, or a row for a column"
                if ":" in whole
                else ": the two indices of an entry have changed places, as in the transpose"
            ),
            lambda n: ast.Subscript(n.value, ast.Tuple(n.slice.elts[::-1], ast.Load()), n.ctx),
        )
        for p, entry in enumerate(node.slice.elts):
            if isinstance(entry, ast.Constant):
                for k in {0, 1, 2} - {entry.value}:
                    yield "index", f"{whole}->{p},{k}", f": {k} is taken", lambda n, p=p, k=k: ast.Subscript(
                        n.value,
                        ast.Tuple([ast.Constant(k) if q == p else e for q, e in enumerate(n.slice.elts)],
                                  ast.Load()),
                        n.ctx,
                    )  # fmt: skip


def _listed(reader: Reader, node: Any) -> Changes:
    def put(values: Callable[..., list[Any]]) -> Change:
        return lambda n: type(n)(values(list(n.elts)), ast.Load())

    for a, b in itertools.combinations(range(len(node.elts)), 2):

        def swapped(e: list[Any], a: int = a, b: int = b) -> list[Any]:
            e[a], e[b] = e[b], e[a]
            return e

        yield "entries", f"{a}<->{b}", f"entries {a} and {b} have changed places", put(swapped)
    for shift in range(1, len(node.elts)):
        yield (
            "entries",
            f"moved {shift}",
            "the entries are in another order",
            put(lambda e, k=shift: [*e[k:], *e[:k]]),
        )
    for a in range(len(node.elts)):
        of = f"entry {a}"
        yield (
            "sign",
            of,
            f": that of {of}",
            put(lambda e, a=a: [minus(x) if k == a else x for k, x in enumerate(e)]),
        )
        yield (
            "entries",
            f"zero {a}",
            f"{of} is zero",
            put(
                lambda e, a=a: [
                    ast.BinOp(ast.Constant(0.0), ast.Mult(), x) if k == a else x for k, x in enumerate(e)
                ]
            ),
        )
        for b in range(len(node.elts)):
            if a != b:
                yield (
                    "entries",
                    f"{a} as {b}",
                    f"{of} repeats entry {b}",
                    put(lambda e, a=a, b=b: [copy.deepcopy(e[b]) if k == a else x for k, x in enumerate(e)]),
                )


def _called(reader: Reader, node: ast.Call) -> Changes:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    for other, kind, of in _METHODS.get(name, ()):
        yield (
            kind,
            f"{name}->{other}",
            of,
            lambda n, o=other: ast.Call(ast.Attribute(n.func.value, o, ast.Load()), n.args, n.keywords),
        )
    if name in ("cross", "outer_product"):
        yield (
            "factors exchanged",
            name,
            f"{'a cross' if name == 'cross' else 'an outer'} product",
            (lambda n: call(n.args[0], n.func.attr, n.func.value)),
        )
    if name in ("cross", "dot", "outer_product"):
        yield "entry by entry", name, "", lambda n: ast.BinOp(n.func.value, ast.Mult(), n.args[0])
        yield (
            "operation",
            f"{name}->+",
            "vectors are added where a product of them is asked",
            (lambda n: ast.BinOp(n.func.value, ast.Add(), n.args[0])),
        )
    if name in ("cross", "dot"):
        yield "lacks", f"first of {name}", "the first factor of a product", lambda n: n.args[0]
    if name == "dot":
        yield (
            "operation",
            "product of lengths",
            "a product of lengths stands for the dot product",
            (lambda n: ast.BinOp(call(n.func.value, "norm"), ast.Mult(), call(n.args[0], "norm"))),
        )
        yield "sign", "absolute", ": an absolute value is taken", absolute
    if name in ("transpose", "inverse"):
        kind = "transposed" if name == "transpose" else "inverse"
        yield kind, f"not {ast.unparse(node)}", "", lambda n: n.func.value
        yield (
            kind,
            f"{name} for another",
            "",
            lambda n: call(n.func.value, "inverse" if n.func.attr == "transpose" else "transpose"),
        )
        yield (
            "lacks",
            f"without {ast.unparse(node)}",
            reader.told(node),
            lambda n: call(ast.BinOp(n, ast.MatMult(), call(n, "inverse")), "transpose"),
        )
    if name == "normalized":
        yield "length", "not normalised", "a vector is not of length one", lambda n: n.func.value
        yield (
            "length",
            "by the squared length",
            "a vector is divided by its squared length",
            (lambda n: ast.BinOp(n.func.value, ast.Div(), call(n.func.value, "norm_sqr"))),
        )
    if name in ("max", "min", "abs"):
        yield "guard", name, f": {name} is missing", lambda n: n.args[0]
    if name in ("max", "min"):
        turned = "min" if name == "max" else "max"
        yield (
            "guard",
            turned,
            f": {turned} stands where {name} belongs",
            lambda n, o=turned: ast.Call(ast.Name(o, ast.Load()), n.args, []),
        )
        yield "guard", "abs", ": abs stands for the guard", lambda n: absolute(n.args[0])
        yield (
            "guard",
            "abs inside",
            ": an absolute value is taken",
            lambda n: ast.Call(n.func, [absolute(n.args[0]), *n.args[1:]], []),
        )
        yield (
            "guard",
            "added",
            ": the small number is added",
            lambda n: ast.BinOp(n.args[0], ast.Add(), n.args[1]),
        )
        yield "guard", "only", ": the small number stands alone", lambda n: n.args[1]
    if name in ("norm", "norm_sqr"):
        yield (
            "lacks",
            f"half of {name}",
            "a factor of 2",
            lambda n: ast.BinOp(ast.Constant(0.5), ast.Mult(), n),
        )
        yield (
            "extra",
            f"twice {name}",
            "a factor of 2",
            lambda n: ast.BinOp(ast.Constant(2), ast.Mult(), n),
        )
    if name == "cross":
        yield (
            "length",
            "cross of length one",
            "a vector has been made of length one",
            (lambda n: call(n, "normalized")),
        )
