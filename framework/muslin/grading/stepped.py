"""The one change of a student's function in plain Python that makes its answers right.

As `muslin.grading.repairing`, for functions that march in steps and call functions they are given: how their answers
hang on an expression is not asked, each change is tried on the cases (`muslin.reading.stepping`).
"""

from __future__ import annotations

import ast
import contextlib
import itertools
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.grading.marching import FAILS, Marching
from muslin.judging import Property, Seen
from muslin.reading.repairs.pieces import (
    OPERATORS,
    Repair,
    code,
    function,
    method,
    minus,
    name,
    text_of,
    times,
)
from muslin.tasks import Task

#: Most steps of all runs together.
SPENT = 800_000

#: A change: the kind, words, what stands instead of what, by id.
Change = tuple[str, str, Mapping[int, Any]]

#: Numbers that are tried for another.
NUMBERS = (0, 1, 1.0, 0.5, 2, 1e-4, 1e-10)

COMPARED: Mapping[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt, ast.GtE), ast.LtE: (ast.Lt, ast.GtE, ast.Gt), ast.Gt: (ast.GtE, ast.Lt, ast.LtE),
    ast.GtE: (ast.Gt, ast.LtE, ast.Lt), ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,),
}  # fmt: skip


def stepped(
    text: str,
    task: Task,
    inputs: Mapping[str, np.ndarray],
    got: np.ndarray | None,
    expected: np.ndarray,
    scale: np.ndarray,
    assignment: str,
) -> tuple[Repair | None, Seen | None]:
    """The plainest change of a function's text that makes its answers right, or else what its way there shows.

    Parameters
    ----------
    text : str
        The file.
    task : Task
    inputs : dict of ndarray, (b, ...)
        The public cases.
    got, expected : ndarray, (b, ...)
        What came, and what is right; nothing came where it is not known, or did not come to an end.
    scale : ndarray, (b,)
        What errors are measured against.
    assignment : str
    """
    with contextlib.suppress(MuslinError, RecursionError, StopIteration, *FAILS), _quietly():
        marching = Marching(text, task, inputs, got, expected, scale, assignment)
        change = _Marches(marching).found()
        return change, None if change is not None else marching.watched()
    return None, None


def unkept(
    text: str,
    task: Task,
    prop: Property,
    broken: Mapping[str, np.ndarray],
    inputs: Mapping[str, np.ndarray],
    expected: np.ndarray,
    scale: np.ndarray,
    assignment: str,
) -> tuple[Repair | None, Seen | None]:
    """As `stepped`, of a function that is right in all cases and breaks a property: on inputs it was asked for that."""
    with contextlib.suppress(MuslinError, RecursionError, StopIteration, *FAILS), _quietly():
        marching = Marching(text, task, inputs, expected, expected, scale, assignment)
        change = _Marches(marching, (prop, broken)).found()
        if change is not None:
            return change, None
        shown = np.zeros((len(next(iter(broken.values()))), *expected.shape[1:]))
        return None, Marching(text, task, broken, None, shown, shown, assignment).watched(numbered=False)
    return None, None


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


class _Marches:
    """The changes of a function on its cases; before them on the inputs of a property that does not hold."""

    def __init__(
        self, marching: Marching, broken: tuple[Property, Mapping[str, np.ndarray]] | None = None
    ) -> None:
        self.marching, self.node, self.broken = marching, marching.node, broken
        self.seen: dict[int, Any] = {}
        self.compared = marching.compared(self.seen)

    def found(self) -> Repair | None:
        """The first change that makes all cases right."""
        if not self.compared:
            return None
        for kind, words, changes in itertools.chain(
            self._added(),
            self._symbols(),
            self._moved(),
            self._anew(),
            self._numbers(),
            self._larger(),
            self._lines(),
        ):
            if self.marching.spent > SPENT:
                return None
            if self.broken is not None and not self.marching.holds(*self.broken, changes):
                continue
            if self.marching.right(changes) and self.marching.sound(changes):
                line = min(n.lineno for n in self._nodes() if id(n) in changes)
                return Repair(kind, "stepped", line, words, {})
        return None

    def _nodes(self) -> Iterator[Any]:
        for node in self.marching.functions:
            yield from ast.walk(node)

    def _added(self) -> Iterator[Change]:
        """A line that adds up, and should take away, multiply or divide."""
        for _, body in self._blocks():
            for s in body:
                for other in (ast.Add, ast.Sub, ast.Mult, ast.Div) if isinstance(s, ast.AugAssign) else ():
                    if isinstance(s, ast.AugAssign) and not isinstance(s.op, other):
                        stands, belongs = OPERATORS.get(type(s.op)), OPERATORS[other]
                        words = f"{stands}= stands in place of {belongs}= in {code(s)}"
                        yield "operation", words, {id(s): [ast.AugAssign(s.target, other(), s.value)]}

    def _expressions(self) -> list[Any]:
        return [
            n
            for n in self._nodes()
            if isinstance(n, ast.expr)
            and isinstance(getattr(n, "ctx", ast.Load()), ast.Load)
            and id(n) in self.seen
        ]

    def _symbols(self) -> Iterator[Change]:
        """A comparison, a sign, an operation, a name, a number, a function that is another one."""
        nodes = self._expressions()
        for node in nodes:
            if isinstance(node, ast.Compare) and len(node.ops) == 1:
                for meant in COMPARED.get(type(node.ops[0]), ()):
                    new: ast.expr = ast.Compare(node.left, [meant()], node.comparators)
                    yield self._change("condition", node, new, "the condition is not the right one: ")
        for node in nodes:
            if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
                other: ast.operator = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
                yield self._change("sign", node, ast.BinOp(node.left, other, node.right), "a sign is wrong: ")
        for node in nodes:
            if isinstance(node, ast.Name) and not callable(self.seen[id(node)]):
                form = np.shape(self.seen[id(node)])
                for key in self._names(form):
                    if key != node.id:
                        yield self._change("name", node, name(key), "")
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
                for key in ("objective", "gradient", "hessian"):
                    if node.func.id in ("objective", "gradient", "hessian") and key != node.func.id:
                        yield self._change("name", node, function(key, node.args[0]), "")
        for node in nodes:
            if isinstance(node, ast.UnaryOp):
                yield self._change("sign", node, node.operand, "")
            elif isinstance(node, ast.BinOp):
                yield from self._operations(node)
        for node in nodes:
            form = np.shape(self.seen[id(node)])
            if callable(self.seen[id(node)]) or isinstance(node, ast.Constant):
                continue
            if form and len(form) == 1:
                yield self._change("sign", node, minus(node), "a sign is wrong: ")
            squared = isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult)
            if isinstance(node, (ast.Call, ast.Subscript, ast.BinOp)) and not form and not squared:
                for vector in self._vectors(node):
                    words = "the length of the whole vector is meant: "
                    yield self._change("length", node, _norm(vector), words)
        for node in nodes:
            number = not callable(self.seen[id(node)]) and not self._form(node)
            if number and isinstance(node, (ast.BinOp, ast.Call, ast.Name)):
                root = method(name("np"), "sqrt", node)
                yield self._change("power", node, root, "a root is missing: ")
        for node in nodes:
            if isinstance(node, ast.Compare):
                yield self._change(
                    "condition", node, ast.UnaryOp(ast.Not(), node), "the condition is turned round: "
                )
            elif isinstance(node, ast.BoolOp):
                turned = ast.Or() if isinstance(node.op, ast.And) else ast.And()
                yield self._change("condition", node, ast.BoolOp(turned, node.values), "")

    def _vectors(self, node: ast.expr) -> list[ast.expr]:
        """The vectors a number is made of."""
        names = {n.id: n for n in ast.walk(node) if isinstance(n, ast.Name) and len(self._form(n)) == 1}
        return [*names.values()] if len(names) == 1 else []

    def _numbers(self) -> Iterator[Change]:
        """A number that is another one."""
        for node in self._expressions():
            if isinstance(node, ast.Constant) and not isinstance(node.value, bool):
                stands: Any = node.value
                for number in dict.fromkeys((*NUMBERS, -stands, stands + 1, stands - 1)):
                    if number != stands:
                        yield self._change("number", node, ast.Constant(number), "")

    def _operations(self, node: ast.BinOp) -> Iterator[Change]:
        left, right = node.left, node.right
        for side, gone in ((left, right), (right, left)):
            yield self._change("extra", node, side, f"{code(gone)} does not belong there: ")
        for other in (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.MatMult):
            if not isinstance(node.op, other) and not {type(node.op), other} <= {ast.Add, ast.Sub}:
                belongs, stands = OPERATORS[other], OPERATORS.get(type(node.op), "")
                words = f"{stands} stands in place of {belongs}: "
                yield self._change("operation", node, ast.BinOp(left, other(), right), words)
        if isinstance(node.op, ast.MatMult) and len(self._form(left)) == 2:
            words = "a product is made where a linear system should be solved: "
            yield self._change("operation", node, function("solve", left, right), words)

    def _lines(self) -> Iterator[Change]:
        """A line that is missing, too much, elsewhere, or adds up."""
        for outer, body in self._blocks():
            loop = isinstance(outer, (ast.For, ast.While))
            if loop:
                yield from self._uncounted(outer, body)
            for k, s in enumerate(body):
                if (
                    loop
                    and isinstance(s, ast.Assign)
                    and not any(isinstance(t, ast.Tuple) for t in s.targets)
                ):
                    words = f"{code(s)} belongs before the loop: there it is done again in every step"
                    yield "loop", words, {id(s): [], id(outer): [s, _other(outer, body[:k] + body[k + 1 :])]}
                if isinstance(s, (ast.Break, ast.Return)) and not (
                    isinstance(s, ast.Return) and outer is self.node
                ):
                    where = "the loop ends here in its first step: " if body[-1] is s and loop else ""
                    yield "loop", f"{where}{code(s)} does not belong there", {id(s): []}
                elif isinstance(s, ast.If) and not isinstance(s.body[-1], (ast.Break, ast.Return)) and loop:
                    ends = f"break is missing behind {code(s.body[-1])}: the loop goes on"
                    yield "loop", ends, {id(s.body[-1]): [s.body[-1], ast.Break()]}
                elif isinstance(s, (ast.Assign, ast.AugAssign)):
                    yield "extra", f"{code(s)} does not belong there: the line is one too many", {id(s): []}

    def _anew(self) -> Iterator[Change]:
        """A line that is missing in a loop, as it stands before it."""
        lines = [s for s in self._nodes() if isinstance(s, ast.Assign) and isinstance(s.value, ast.Call)]
        for outer, body in self._blocks():
            for s in lines if isinstance(outer, (ast.For, ast.While)) else ():
                if not any(inner is s for inner in ast.walk(outer)):
                    said = f"{code(s)} is missing in the loop: it should be done anew in every step"
                    yield "loop", f"{said}, at its end", {id(body[-1]): [body[-1], s]}
                    yield "loop", f"{said}, at its beginning", {id(body[0]): [s, body[0]]}

    def _uncounted(self, loop: Any, body: list[ast.stmt]) -> Iterator[Change]:
        """A count that the loop waits for, and which is never raised in it."""
        if not isinstance(loop, ast.While):
            return
        stored = {n.id for n in ast.walk(loop) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        for n in ast.walk(loop.test):
            if isinstance(n, ast.Name) and n.id not in stored and isinstance(self.seen.get(id(n)), int):
                counts = ast.AugAssign(ast.Name(n.id, ast.Store()), ast.Add(), ast.Constant(1))
                words = f"the loop waits for `{n.id}`, which is never raised in it: {code(counts)} is missing"
                yield "loop", words, {id(body[-1]): [body[-1], counts]}

    def _moved(self) -> Iterator[Change]:
        """A line that belongs a line further up, or behind the block it stands in, or in the loop before it."""
        for _, body in self._blocks():
            for s, after in itertools.pairwise(body):
                both = (_plain_line(s) or isinstance(s, ast.If)) and (
                    _plain_line(after) or isinstance(after, ast.If)
                )
                if both:
                    words = f"{_head(after)} belongs before {_head(s)}"
                    yield "order", words, {id(s): [after], id(after): [s]}
                if isinstance(s, (ast.For, ast.While, ast.If)) and _plain_line(after):
                    words = f"{code(after)} belongs in the {_called(s)} before it, at its end: indent it"
                    yield "loop", words, {id(s.body[-1]): [s.body[-1], after], id(after): []}
                if isinstance(s, (ast.For, ast.While, ast.If)) and _ends(s.body):
                    yield self._behind(s)
            if body and isinstance(body[-1], (ast.For, ast.While, ast.If)) and _ends(body[-1].body):
                yield self._behind(body[-1])

    def _behind(self, outer: Any) -> Change:
        last = outer.body[-1]
        words = f"{code(last)} belongs behind the {_called(outer)}: it is indented too much"
        return "loop", words, {id(last): [], id(outer): [outer, last]}

    def _blocks(self) -> Iterator[tuple[Any, list[ast.stmt]]]:
        for node in self.marching.functions:
            yield from _blocks(node)

    def _larger(self) -> Iterator[Change]:
        """A factor, or a term, that is missing."""
        for node in self._expressions():
            value = self.seen[id(node)]
            if (
                callable(value)
                or isinstance(node, (ast.Constant, ast.Compare, ast.BoolOp))
                or isinstance(value, bool)
            ):
                continue
            for text, part in ((key, name(key)) for key in self._names(())):
                yield self._change(
                    "lacks factor", node, times(part, node), f"a factor of {text} is missing: "
                )
            for number in (1e-4,) if not np.shape(value) else ():
                yield self._change(
                    "lacks factor",
                    node,
                    times(ast.Constant(number), node),
                    f"a factor of {number:g} is missing: ",
                )
            for key in self._names(np.shape(value)):
                if text_of(node) != key:
                    words = f"{key} is left out: "
                    yield self._change("lacks term", node, ast.BinOp(name(key), ast.Add(), node), words)

    def _form(self, node: ast.AST) -> tuple[int, ...]:
        """The shape of what an expression came to."""
        return np.shape(self.seen.get(id(node), 0))

    def _names(self, form: tuple[int, ...]) -> list[str]:
        """Names of numbers, or arrays, of a shape."""
        values = {
            n.id: self.seen[id(n)] for n in self._nodes() if isinstance(n, ast.Name) and id(n) in self.seen
        }
        return sorted(key for key in values if not callable(values[key]) and np.shape(values[key]) == form)

    def _change(self, kind: str, node: ast.expr, new: ast.expr, words: str, shown: str = "") -> Change:
        belongs = f"`{shown.format(text_of(node))}`" if shown else code(new)
        return kind, f"{words}{code(node)} stands where {belongs} belongs", {id(node): new}


def _blocks(node: ast.AST) -> Iterator[tuple[Any, list[ast.stmt]]]:
    for outer in ast.walk(node):
        for key in ("body", "orelse"):
            body = getattr(outer, key, None)
            if isinstance(body, list) and body:
                yield outer, body


def _other(loop: Any, body: list[ast.stmt]) -> ast.stmt:
    """A loop with another body."""
    body = body or [ast.Pass()]
    if isinstance(loop, ast.For):
        return ast.For(loop.target, loop.iter, body, [])
    return ast.While(loop.test, body, [])


def _norm(node: ast.expr) -> ast.expr:
    return method(ast.Attribute(name("np"), "linalg", ast.Load()), "norm", node)


def _plain_line(s: ast.stmt) -> bool:
    return isinstance(s, (ast.Assign, ast.AugAssign))


def _ends(body: list[ast.stmt]) -> bool:
    """Whether a block ends with a line that may stand behind it."""
    return len(body) > 1 and (_plain_line(body[-1]) or isinstance(body[-1], ast.Return))


def _head(s: ast.stmt) -> str:
    """A line as it is named: of an if its condition."""
    return f"`if {text_of(s.test)}: ...`" if isinstance(s, ast.If) else code(s)


def _called(s: ast.stmt) -> str:
    return "if" if isinstance(s, ast.If) else "loop"
