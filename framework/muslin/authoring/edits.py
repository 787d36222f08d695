"""The slips one can make in a formula: single changes of its syntax tree, and the same change made throughout.

A sign, a factor, an index, a name, the order of a product, a bracket, a guard: see `WORDS`. `Reader` lists the
edits of a function; `applied` makes one.
"""

from __future__ import annotations

import ast
import copy
import itertools
import pickle
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from muslin import tasks
from muslin.authoring import substitutes

#: Makes a node into another one.
Change = Callable[..., Any]
Changes = Iterator[tuple[str, str, str, Change]]

#: Kinds of slips, the plainest first: what is said, and one next step. {place} is what a line computes.
WORDS: Mapping[str, tuple[str, str]] = {
    "sign": (
        "a sign is wrong in {place}{of}",
        "Write {place} down once more, and look at every sign.",
    ),
    "factors exchanged": (
        "the factors of {of} are in the wrong order in {place}",
        "Exchange them, and see what it changes: their order matters.",
    ),
    "exchanged": (
        "{of} have changed places in {place}",
        "Follow both through {place}, and compare with the formula.",
    ),
    "transposed": (
        "a transpose is missing in {place}, or one too many{of}",
        "Compare {place} with the formula: what is transposed there, and what is not?",
    ),
    "name": (
        "{of} in {place}",
        "Read {place} name by name, beside the formula.",
    ),
    "index": (
        "an index is wrong in {place}{of}",
        "Read {place} index by index: Python counts from 0.",
    ),
    "lacks": (
        "something is missing in {place}: {of}",
        "Compare {place} with the formula, term by term and factor by factor.",
    ),
    "number": (
        "a number is wrong in {place}: it looks like {of}",
        "Derive the numbers of {place} once more.",
    ),
    "power": (
        "a power is wrong in {place}{of}",
        "Check the unit of {place}: is everything squared that should be, and nothing else?",
    ),
    "length": (
        "{of} in {place}",
        "Check the unit of {place}: a length, a squared length, or a vector of length one?",
    ),
    "inverted": (
        "something is multiplied in {place} where it should be divided, or the other way round{of}",
        "Check the unit of {place}.",
    ),
    "inverse": (
        "an inverse is missing in {place}, or one too many{of}",
        "Write the equation down that {place} solves.",
    ),
    "entry by entry": (
        "`*` stands for another product in {place}: it multiplies entry by entry",
        "Matrices are multiplied with @, and vectors with dot, cross or outer_product.",
    ),
    "operation": (
        "{of} in {place}",
        "Read {place} operation by operation, beside the formula.",
    ),
    "brackets": (
        "brackets are missing in {place}, or set otherwise",
        "What is meant to be multiplied, divided or squared as a whole in {place}?",
    ),
    "entries": (
        "{of} in {place}",
        "Write down what belongs in each place of {place}, one by one.",
    ),
    "condition": (
        "the condition for {place} is not the right one{of}",
        "Take an input on each side of it, and one exactly on it: what should happen there?",
    ),
    "loop": (
        "the sum in {place} is not made as it should be: {of}",
        "Write its terms down one by one: which come in, and each how often?",
    ),
    "branches": (
        "{place} {of}",
        "Draw the triangle, number it from 0, and follow each branch.",
    ),
    "guard": (
        "a guard is missing, turned round, or one too many, in {place}{of}",
        "Ask for which inputs {place} needs to be kept from something, and for which not.",
    ),
    "extra": (
        "{of} comes in once too often in {place}",
        "Check the unit of {place}.",
    ),
    "another": (
        "{of} in {place}",
        "Read {place} part by part, beside the formula.",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Edit:
    """One thing changed in a function: at which nodes, how, and what it is called.

    Edits of one `kind` and one `shape` (the text around, but for its digits) are one slip when made together.
    """

    kind: str
    detail: str
    place: str
    of: str
    shape: str
    changes: Mapping[int, Change]
    line: str = ""


# --- which edits there are ---------------------------------------------------------------------------------

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


def _call(node: ast.expr, method: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Attribute(node, method, ast.Load()), list(arguments), [])


def _number(value: float) -> ast.expr:
    return ast.Constant(value) if value >= 0 else ast.UnaryOp(ast.USub(), ast.Constant(-value))


def _minus(node: ast.expr) -> ast.expr:
    return ast.UnaryOp(ast.USub(), node)


def _absolute(node: ast.expr) -> ast.Call:
    return ast.Call(ast.Name("abs", ast.Load()), [node], [])


def _operation(node: ast.BinOp, op: ast.operator) -> ast.BinOp:
    return ast.BinOp(node.left, op, node.right)


def _others(value: float) -> Iterator[float]:
    """Numbers people write for another one."""
    found = [0, 1, 2, -value, value + 1, value - 1, 2 * value, value / 2, value * value, 3, 4, 6]
    if value and abs(value) < 0.01:
        found = [0, *(value * 10.0**k for k in (-9, -6, -3, -2, -1, 1, 2, 3, 4, 5))]
    if value >= 6:
        found += [value / 4, value / 3, value * 1.5, 8, 9, 10, 12, 18, 24, 36]
    yield from (other for other in dict.fromkeys(found) if other != value)


class Reader:
    """Reads one function: its statements, what each computes, and the edits that can be made."""

    def __init__(self, function: ast.FunctionDef, source: list[str], task: tasks.Task):
        self.function, self.source = function, source
        for number, node in enumerate(ast.walk(function)):
            if isinstance(node, (ast.expr, ast.stmt)):  # Python shares the other nodes between trees
                node.number = number  # type: ignore[union-attr]
        self.kinds = {value.name: value.kind for value in task.arguments}
        self.arguments = list(self.kinds)
        self.loops = {ast.unparse(node.target) for node in ast.walk(function) if isinstance(node, ast.For)}
        self.scalars = [name for name, kind in self.kinds.items() if kind == "scalar"]
        self.atoms, self.parts = substitutes.atoms(self), substitutes.parts(self)
        self.said: dict[str, str] = {}  # local name -> what it is
        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                self.said.setdefault(node.targets[0].id, self.place(node))
            elif isinstance(node, ast.For):
                self.said.setdefault(ast.unparse(node.target), f"the index {ast.unparse(node.target)}")

    def place(self, statement: ast.stmt) -> str:
        """What a line computes, as its comment says."""
        line = self.source[(statement.end_lineno or statement.lineno) - 1]
        return line.partition("#")[2].strip() or "the formula"

    def shown(self, node: ast.AST) -> str:
        """What stands somewhere: as it is written where that is short and made of arguments, else in words."""
        inside = list(ast.walk(node))
        names = {n.id for n in inside if isinstance(n, ast.Name)}
        short = (
            len(inside) <= 9 and names <= set(self.kinds) and not isinstance(node, (ast.Name, ast.Constant))
        )
        return ast.unparse(node) if short and names else self.told(node)

    def instead(self, new: ast.AST, old: ast.AST) -> str:
        """Words for one part in place of another."""
        stands, belongs = self.shown(new), self.told(old)
        if stands == belongs:
            return f"another part than {belongs} stands"
        return f"{stands} stands where {belongs} belongs"

    def told(self, node: ast.AST) -> str:
        """An operand in words that give no formula away."""
        if isinstance(node, ast.Name):
            return node.id if node.id in self.kinds else self.said.get(node.id, "a quantity")
        if isinstance(node, ast.Constant):
            return f"the number {node.value!r}"
        if isinstance(node, ast.Subscript) and ast.unparse(node.value) in self.kinds:
            return ast.unparse(node)
        names = sorted({n.id for n in ast.walk(node) if isinstance(n, ast.Name)} & set(self.kinds))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and not names:
            return "a number"
        entries = [
            n for n in ast.walk(node) if isinstance(n, ast.Subscript) and ast.unparse(n.value) in names
        ]
        if entries:
            taken = sorted({ast.unparse(entry) for entry in entries})
            names = [*taken, *(name for name in names if not any(e.startswith(f"{name}[") for e in taken))]
            return f"the {'sum' if _terms(node) else 'part'} with {' and '.join(names)}"  # type: ignore[arg-type]
        if names:
            return f"the part with {' and '.join(names)}"
        locals_ = [self.said[n.id] for n in ast.walk(node) if isinstance(n, ast.Name) and n.id in self.said]
        return f"the part with {locals_[0]}" if locals_ else "a part"

    def edits(self) -> list[Edit]:
        """Everything that can be changed: one thing, or the same thing throughout."""
        singles = [edit for edit in self._statements(self.function.body) if edit.changes]
        return [*singles, *self._branches(), *self._together(singles), *self._swaps()]

    def _statements(self, body: Sequence[ast.stmt]) -> Iterator[Edit]:
        for statement in body:
            place = self.place(statement)
            if isinstance(statement, ast.If):
                yield from self._condition(statement)
                yield from self._statements(statement.body)
                yield from self._statements(statement.orelse)
            elif isinstance(statement, ast.For):
                yield from self._loop(statement)
                yield from self._statements(statement.body)
            elif isinstance(statement, VALUED) and statement.value is not None:
                for node in ast.walk(statement.value):
                    for kind, detail, of, change in self._node(node):
                        yield self._edit(kind, detail, place, of, node, change, statement)
                yield from self._whole(statement, place)
                yield from self._stored(statement, place)

    def _loop(self, statement: ast.For) -> Iterator[Edit]:
        """A loop that ends too early, begins too late, or makes its first or last pass alone."""
        number, place = statement.iter.number, self.place(statement)  # type: ignore[attr-defined]
        size = ast.literal_eval(statement.iter.args[-1])  # type: ignore[attr-defined]
        passes = {
            "its last term is missing: a range may end too early": range(size - 1),
            "its first term is missing: a range may begin at 1": range(1, size),
            "only its first term comes in": range(1),
            "only its last term comes in: an assignment may overwrite where += would add": range(
                size - 1, size
            ),
            "its middle term is missing": range(0, size, 2),
        }
        for of, those in passes.items():
            alone = ast.parse(repr(list(those)), mode="eval").body
            yield Edit("loop", of, place, of, "", {number: lambda n, o=alone: o})

    def _stored(self, statement: Any, place: str) -> Iterator[Edit]:
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

    def _edit(
        self, kind: str, detail: str, place: str, of: str, node: ast.AST, change: Change, statement: ast.stmt
    ) -> Edit:
        """An edit of one node; lines that differ in digits and names of their own are alike."""
        names = "|".join(map(re.escape, self.said)) or "$."
        shape, line = (re.sub(rf"\b({names})\b", "_", _shape(text)) for text in (node, statement))
        return Edit(kind, detail, place, of, shape, {node.number: change}, line)  # type: ignore[attr-defined]

    def _whole(self, statement: Any, place: str) -> Iterator[Edit]:
        """Edits of all that a line computes."""
        number = statement.value.number
        if isinstance(statement.value, ast.Tuple):
            return
        yield Edit("sign", "whole line", place, "", "", {number: _minus})
        for factor in (2, 0.5):
            of = "a factor of 2" if factor == 2 else "a factor of 1/2"
            yield Edit("extra", f"times {factor}", place, of, "",
                       {number: lambda n, f=factor: ast.BinOp(n, ast.Mult(), _number(f))})  # fmt: skip
        for name in self.scalars:
            for op, words in ((ast.Mult(), name), (ast.Div(), f"1/{name}")):
                yield Edit("extra", f"{type(op).__name__} {name}", place, words, "",
                           {number: lambda n, o=op, m=name: ast.BinOp(n, o, ast.Name(m, ast.Load()))})  # fmt: skip
        for method, kind, of in (
            ("normalized", "length", "a vector has been made of length one"),
            ("transpose", "transposed", ""),
        ):
            yield Edit(kind, method, place, of, "", {number: lambda n, m=method: _call(n, m)})

    def _condition(self, statement: ast.If) -> Iterator[Edit]:
        place = self.place(statement.body[0])
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
            *self.atoms,
            *self.parts,
            *(ast.Name(n, ast.Load()) for n in self.scalars),
            ast.Constant(0),
            ast.Constant(1),
        )
        for side in (statement.test.left, statement.test.comparators[0]):
            which = side.number  # type: ignore[attr-defined]
            for new in parts:
                if ast.unparse(new) != ast.unparse(side):
                    of = f": it compares {self.shown(new)}"
                    yield Edit("condition", ast.unparse(new), place, of, "", {which: lambda n, o=new: o})
        for node in ast.walk(statement.test):
            for kind, detail, of, change in self._node(node):
                if kind in ("number", "sign", "lacks", "index", "name", "another"):
                    kind, of = "condition", f": {of}" if of and not of.startswith(":") else of
                yield Edit(kind, detail, place, of, _shape(node), {node.number: change})  # type: ignore[attr-defined]

    def _node(self, node: ast.AST) -> Changes:
        """Edits of one node: (kind, what makes two edits the same, of what, change)."""
        yield from substitutes.of(self, node)
        if isinstance(node, ast.BinOp):
            yield from self._binary(node)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield "sign", "minus dropped", ": a minus is missing", lambda n: n.operand
        elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            for number in _others(float(node.value)):
                yield "number", f"{node.value}->{number}", f"{number:g}", lambda n, o=number: _number(o)
        elif isinstance(node, ast.Subscript):
            yield from self._subscript(node)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            same = [n for n in self.arguments if self.kinds[n] == self.kinds.get(node.id, self.kinds[n])]
            for other in [*same, *self.said]:
                if other != node.id:
                    of = self.instead(ast.Name(other), node)
                    yield "name", f"{node.id}->{other}", of, lambda n, o=other: ast.Name(o, ast.Load())
            if node.id in self.loops:
                for k in range(3):
                    of = f"the index {k} stands where {node.id} belongs"
                    yield "name", f"{node.id}->{k}", of, lambda n, k=k: ast.Constant(k)
            if self.kinds.get(node.id) == "scalar":
                of = f"the number 1 stands where {node.id} belongs"
                yield "name", f"{node.id}->1", of, lambda n: ast.Constant(1.0)
            if self.kinds.get(node.id) == "mat3":
                yield "transposed", node.id, f": of {node.id}", lambda n: _call(n, "transpose")
                yield "inverse", node.id, f": of {node.id}", lambda n: _call(n, "inverse")
            yield (
                "power",
                f"{node.id} squared",
                f": {self.told(node)} is squared",
                lambda n: ast.BinOp(n, ast.Pow(), ast.Constant(2)),
            )
            yield (
                "length",
                f"{node.id} of length one",
                "a vector has been made of length one",
                (lambda n: _call(n, "normalized")),
            )
        elif isinstance(node, (ast.List, ast.Tuple)) and len(node.elts) > 1:
            yield from self._listed(node)
        elif isinstance(node, ast.Call):
            yield from self._called(node)

    def _binary(self, node: ast.BinOp) -> Changes:
        op, left, right = node.op, self.told(node.left), self.told(node.right)
        key = f"{ast.unparse(node.left)} | {ast.unparse(node.right)}"
        if isinstance(op, (ast.Add, ast.Sub)):
            yield (
                "power",
                "sum squared",
                ": a sum is squared",
                lambda n: ast.BinOp(n, ast.Pow(), ast.Constant(2)),
            )
            yield "sign", "second", f": before {right}", lambda n: _operation(n, _FLIPPED[type(n.op)]())
            yield "sign", "first", f": before {left}", lambda n: ast.BinOp(_minus(n.left), n.op, n.right)
            what = f"{right} that is subtracted" if isinstance(op, ast.Sub) else f"{right} that is added"
            yield "lacks", f"right {key}", what, lambda n: n.left
            yield (
                "lacks",
                f"left {key}",
                f"{left} that the rest is subtracted from" if isinstance(op, ast.Sub) else f"{left} of a sum",
                ((lambda n: n.right) if isinstance(op, ast.Add) else (lambda n: _minus(n.right))),
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
                (lambda n: _operation(n, ast.Mult())),
            )
            if isinstance(node.left, ast.BinOp) and isinstance(node.left.op, ast.Pow):
                yield "brackets", "square of the sum", "", _square_outside
        elif isinstance(op, (ast.Mult, ast.MatMult)):
            yield "lacks", f"right {key}", f"the factor {right}", lambda n: n.left
            yield "lacks", f"left {key}", f"the factor {left}", lambda n: n.right
            if isinstance(op, ast.Mult):
                yield "inverted", "", f": {right}", lambda n: _operation(n, ast.Div())
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
                    (lambda n: _operation(n, ast.Add())),
                )
            else:
                yield (
                    "factors exchanged",
                    "@",
                    "a matrix product",
                    (lambda n: ast.BinOp(n.right, n.op, n.left)),
                )
                yield "entry by entry", "@", "", lambda n: _operation(n, ast.Mult())
            for change in (_spread_right, _spread_left):
                yield "brackets", change.__name__, "", change
        elif isinstance(op, ast.Div):
            yield "lacks", f"below {key}", f"the division by {right}", lambda n: n.left
            yield "inverted", "", f": {right}", lambda n: _operation(n, ast.Mult())
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
            yield "brackets", "over", "", _spread_left
        elif isinstance(op, ast.Pow):
            yield "power", "dropped", ": a square is missing", lambda n: n.left
            yield "power", "inside", ": terms are squared one by one", _square_inside
            yield "power", "half", ": it is squared twice", lambda n: ast.BinOp(n.left, n.op, ast.Constant(4))

    def _subscript(self, node: ast.Subscript) -> Changes:
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
                f": {self.told(node)} is squared",
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

    def _listed(self, node: Any) -> Changes:
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
                put(lambda e, a=a: [_minus(x) if k == a else x for k, x in enumerate(e)]),
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
                        put(
                            lambda e, a=a, b=b: [
                                copy.deepcopy(e[b]) if k == a else x for k, x in enumerate(e)
                            ]
                        ),
                    )

    def _called(self, node: ast.Call) -> Changes:
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
                (lambda n: _call(n.args[0], n.func.attr, n.func.value)),
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
                (lambda n: ast.BinOp(_call(n.func.value, "norm"), ast.Mult(), _call(n.args[0], "norm"))),
            )
            yield "sign", "absolute", ": an absolute value is taken", _absolute
        if name in ("transpose", "inverse"):
            kind = "transposed" if name == "transpose" else "inverse"
            yield kind, f"not {ast.unparse(node)}", "", lambda n: n.func.value
            yield (
                kind,
                f"{name} for another",
                "",
                lambda n: _call(n.func.value, "inverse" if n.func.attr == "transpose" else "transpose"),
            )
            yield (
                "lacks",
                f"without {ast.unparse(node)}",
                self.told(node),
                lambda n: _call(ast.BinOp(n, ast.MatMult(), _call(n, "inverse")), "transpose"),
            )
        if name == "normalized":
            yield "length", "not normalised", "a vector is not of length one", lambda n: n.func.value
            yield (
                "length",
                "by the squared length",
                "a vector is divided by its squared length",
                (lambda n: ast.BinOp(n.func.value, ast.Div(), _call(n.func.value, "norm_sqr"))),
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
            yield "guard", "abs", ": abs stands for the guard", lambda n: _absolute(n.args[0])
            yield (
                "guard",
                "abs inside",
                ": an absolute value is taken",
                lambda n: ast.Call(n.func, [_absolute(n.args[0]), *n.args[1:]], []),
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
                (lambda n: _call(n, "normalized")),
            )

    def _together(self, singles: list[Edit]) -> Iterator[Edit]:
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

    def _branches(self) -> Iterator[Edit]:
        """Conditions of several branches exchanged, or all counted from another number."""
        branches = [
            n
            for n in ast.walk(self.function)
            if isinstance(n, ast.If) and isinstance(n.test, ast.Compare) and isinstance(n.test.ops[0], ast.Eq)
        ]
        given = [n.test.comparators[0] for n in branches if isinstance(n.test, ast.Compare)]
        numbers = [node.number for node in given if isinstance(node, ast.Constant)]  # type: ignore[attr-defined]
        values: list[Any] = [node.value for node in given if isinstance(node, ast.Constant)]
        if len(values) < 2:
            return
        places = " and ".join(self.place(branch.body[0]) for branch in branches)
        moved = [value + 1 for value in values]
        for of, others in (("are exchanged", values[::-1]), ("are counted from 1, not from 0", moved)):
            changes = {k: (lambda n, v=v: ast.Constant(v)) for k, v in zip(numbers, others, strict=True)}
            yield Edit("branches", of, places, of, "", changes)

    def _swaps(self) -> Iterator[Edit]:
        """Two names exchanged: in the whole function, in a line, in one term of a line."""
        names = [*self.arguments, *self.said]
        scopes: list[tuple[str, ast.AST]] = [("the formula", self.function)]
        for statement in ast.walk(self.function):
            if isinstance(statement, VALUED) and statement.value is not None:
                place = self.place(statement)
                scopes.append((place, statement.value))
                scopes += [(place, term) for term in _terms(statement.value)]
        for (place, scope), (a, b) in itertools.product(scopes, itertools.combinations(names, 2)):
            if self.kinds.get(a) != self.kinds.get(b):
                continue
            along = {f"d{a}": f"d{b}", f"d{b}": f"d{a}"}  # what is told of their changes
            for other in ({a: b, b: a}, {a: b, b: a, **along}):
                changes = {
                    node.number: (lambda n, o=other: ast.Name(o[n.id], ast.Load()))  # type: ignore[attr-defined]
                    for node in ast.walk(scope)
                    if isinstance(node, ast.Name) and node.id in other and isinstance(node.ctx, ast.Load)
                }
                if len(changes) > 1:
                    of = f"{self.told(ast.Name(a))} and {self.told(ast.Name(b))}"
                    yield Edit("exchanged", f"{a},{b}", place, of, "", changes)
        for place, scope in scopes:
            for which, of, changes in substitutes.exchanged(self, scope):
                yield Edit("exchanged", which, place, of, "", changes)


def _shape(node: ast.AST) -> str:
    """The text of a node, but for its digits: of s[0] - 1 and of s[1] - 1 it is the same."""
    return re.sub(r"\d+", "#", ast.unparse(node))


def _terms(node: ast.expr) -> list[ast.expr]:
    """The terms a sum is made of; nothing if it is no sum."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        return [part for side in (node.left, node.right) for part in (_terms(side) or [side])]
    return []


def _square_outside(n: Any) -> ast.AST:
    """(a + b)^2 for a^2 + b^2."""
    if not (isinstance(n.right, ast.BinOp) and isinstance(n.right.op, ast.Pow)):
        raise ValueError
    return ast.BinOp(ast.BinOp(n.left.left, n.op, n.right.left), ast.Pow(), n.left.right)


def _square_inside(n: Any) -> ast.AST:
    """a^2 + b^2 for (a + b)^2."""
    if not isinstance(n.left, ast.BinOp):
        raise ValueError
    inner = n.left
    return ast.BinOp(ast.BinOp(inner.left, n.op, n.right), inner.op, ast.BinOp(inner.right, n.op, n.right))


def _spread_right(n: Any) -> ast.AST:
    """A * b + c for a * (b + c)."""
    if not (isinstance(n.right, ast.BinOp) and isinstance(n.right.op, (ast.Add, ast.Sub))):
        raise ValueError
    return ast.BinOp(ast.BinOp(n.left, n.op, n.right.left), n.right.op, n.right.right)


def _spread_left(n: Any) -> ast.AST:
    """A + b * c for (a + b) * c."""
    if not (isinstance(n.left, ast.BinOp) and isinstance(n.left.op, (ast.Add, ast.Sub))):
        raise ValueError
    return ast.BinOp(n.left.left, n.left.op, ast.BinOp(n.left.right, n.op, n.right))


class _Applied(ast.NodeTransformer):
    def __init__(self, changes: Mapping[int, Change]):
        self.changes = changes

    def visit(self, node: ast.AST) -> Any:
        node = self.generic_visit(node)
        change = self.changes.get(getattr(node, "number", -1))
        return change(node) if change is not None else node


def applied(function: ast.FunctionDef, changes: Mapping[int, Change]) -> ast.FunctionDef:
    """A function with an edit made; inner changes come first."""
    copied = pickle.loads(pickle.dumps(function))  # several times as fast as deepcopy
    made: ast.FunctionDef = _Applied(changes).visit(copied)
    return made
