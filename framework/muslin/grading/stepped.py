"""The one change of a student's function in plain Python that makes its answers right.

As `muslin.grading.repairing`, for functions that march in steps and call functions they are given: how their answers
hang on an expression is not asked, each change is tried on the cases (`muslin.reading.stepping`).
"""

from __future__ import annotations

import ast
import itertools
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging.reference import TOLERANCE
from muslin.reading.arithmetic import Unclear
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
from muslin.reading.repairs.readable import ordinary
from muslin.reading.source import Source
from muslin.reading.stepping import STEPS, Stepping, TooLong
from muslin.tasks import Task
from muslin.tasks.plain import builder

#: Most steps of all runs together; most cases that are tried of each change; most steps of one case then.
SPENT, CASES, BRIEF = 900_000, 12, 2000

#: What is so much larger than the right answer hangs on the rounding of every step.
FAR = 100

FAILS = (
    Unclear,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    AttributeError,
    ArithmeticError,
    np.linalg.LinAlgError,
)

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
    got: np.ndarray,
    expected: np.ndarray,
    scale: np.ndarray,
    assignment: str,
) -> Repair | None:
    """The plainest change of a function's text that makes its answers right; None if there is none.

    Parameters
    ----------
    text : str
        The file.
    task : Task
    inputs : dict of ndarray, (b, ...)
        The public cases.
    got, expected : ndarray, (b, ...)
        What came, and what is right.
    scale : ndarray, (b,)
        What errors are measured against.
    assignment : str
    """
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if not ordinary(text):
                return None
            node = Source(text).functions[task.name].node
            return _Marches(node, task, inputs, got, expected, scale, assignment).found()
    except (MuslinError, RecursionError, *FAILS):
        return None


class _Marches:
    """A function on the cases, those that are wrong first."""

    def __init__(
        self,
        node: ast.FunctionDef,
        task: Task,
        inputs: Any,
        got: Any,
        expected: Any,
        scale: Any,
        assignment: str,
    ) -> None:
        table = tasks.assignment(assignment)
        build = builder(task, table, paths.assignment(assignment))
        if build is None:
            raise Unclear
        self.node, self.expected, self.scale, self.spent = node, expected, scale, 0
        error = np.abs(got - expected).reshape(len(expected), -1).max(axis=1)
        right = error <= TOLERANCE * scale
        wrong = np.flatnonzero(~right)
        self.order = [*wrong[:CASES], *np.flatnonzero(right)[: CASES // 2]]
        self.cases = {}
        for k in self.order:
            case = {key: array[k] for key, array in inputs.items()}
            given = build(**case)
            own = {v.name: given.get(v.name, case.get(v.name)) for v in task.arguments}
            self.cases[k] = {key: _plain(value) for key, value in own.items()}
        self.seen: dict[int, Any] = {}
        for k in (*self.order[:3], self.order[-1]):
            try:
                came = self._come({}, k, self.seen)
            except TooLong:
                continue
            tame = np.isfinite(got[k]).all() and np.abs(got[k]).max() < FAR * scale[k]
            if tame and not np.allclose(came, got[k], rtol=1e-6, atol=1e-9 * scale[k]):
                raise Unclear

    def _come(self, changes: Mapping[int, Any], k: int, seen: dict[int, Any] | None = None) -> np.ndarray:
        stepping = Stepping(self.node, changes, seen, BRIEF if changes else STEPS)
        case = {
            key: value.copy() if isinstance(value, np.ndarray) else value
            for key, value in self.cases[k].items()
        }
        try:
            return np.asarray(stepping.run(case), dtype=np.float64)
        finally:
            self.spent += stepping.steps

    def _right(self, changes: Mapping[int, Any]) -> bool:
        for k in self.order:
            try:
                came = self._come(changes, k)
            except FAILS:
                return False
            if came.shape != self.expected[k].shape:
                return False
            if not np.abs(came - self.expected[k]).max() <= TOLERANCE * self.scale[k]:
                return False
        return True

    def found(self) -> Repair | None:
        """The first change that makes all cases right."""
        for kind, words, changes in itertools.chain(
            self._symbols(), self._anew(), self._larger(), self._numbers(), self._lines()
        ):
            if self.spent > SPENT:
                return None
            if self._right(changes):
                line = min(n.lineno for n in ast.walk(self.node) if id(n) in changes)  # type: ignore[attr-defined]
                return Repair(kind, "stepped", line, words, {})
        return None

    def _expressions(self) -> list[Any]:
        return [
            n
            for n in ast.walk(self.node)
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
            elif isinstance(node, (ast.BinOp, ast.Call, ast.Name)):
                root = method(name("np"), "sqrt", node)
                yield self._change("power", node, root, "a root is missing: ")
            if isinstance(node, ast.Call) and len(node.args) == 1 and not form and self._form(node.args[0]):
                yield self._change(
                    "length", node, _norm(node.args[0]), "the length of the whole vector is meant: "
                )
        for node in nodes:
            if isinstance(node, ast.Compare):
                yield self._change(
                    "condition", node, ast.UnaryOp(ast.Not(), node), "the condition is turned round: "
                )
            elif isinstance(node, ast.BoolOp):
                turned = ast.Or() if isinstance(node.op, ast.And) else ast.And()
                yield self._change("condition", node, ast.BoolOp(turned, node.values), "")

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
        for other in (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.MatMult):
            if not isinstance(node.op, other):
                belongs, stands = OPERATORS[other], OPERATORS.get(type(node.op), "")
                kind = "sign" if {belongs, stands} == {"+", "-"} else "operation"
                words = "a sign is wrong: " if kind == "sign" else f"{stands} stands in place of {belongs}: "
                yield self._change(kind, node, ast.BinOp(left, other(), right), words)
        for side, gone in ((left, right), (right, left)):
            yield self._change("extra", node, side, f"{code(gone)} does not belong there: ")
        if isinstance(node.op, ast.MatMult) and len(self._form(left)) == 2:
            words = "a product is made where a linear system should be solved: "
            yield self._change("operation", node, function("solve", left, right), words)

    def _lines(self) -> Iterator[Change]:
        """A line that is missing, too much, elsewhere, or adds up."""
        for outer, body in _blocks(self.node):
            loop = isinstance(outer, (ast.For, ast.While))
            for k, s in enumerate(body):
                if isinstance(s, ast.AugAssign):
                    for other in (ast.Add, ast.Sub, ast.Mult, ast.Div):
                        if not isinstance(s.op, other):
                            words = f"{OPERATORS.get(type(s.op))}= stands in place of {OPERATORS[other]}= in {code(s)}"
                            yield "operation", words, {id(s): [ast.AugAssign(s.target, other(), s.value)]}
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
                elif isinstance(s, (ast.Assign, ast.AugAssign)):
                    yield "extra", f"{code(s)} does not belong there: the line is one too many", {id(s): []}

    def _anew(self) -> Iterator[Change]:
        """A line that is missing in a loop, as it stands before it."""
        lines = [
            s for s in ast.walk(self.node) if isinstance(s, ast.Assign) and isinstance(s.value, ast.Call)
        ]
        for outer, body in _blocks(self.node):
            for s in lines if isinstance(outer, (ast.For, ast.While)) else ():
                if not any(inner is s for inner in ast.walk(outer)):
                    said = f"{code(s)} is missing in the loop: it should be done anew in every step"
                    yield "loop", f"{said}, at its end", {id(body[-1]): [body[-1], s]}
                    yield "loop", f"{said}, at its beginning", {id(body[0]): [s, body[0]]}

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
        found = {n.id for n in ast.walk(self.node) if isinstance(n, ast.Name) and id(n) in self.seen}
        values = {
            n.id: self.seen[id(n)]
            for n in ast.walk(self.node)
            if isinstance(n, ast.Name) and id(n) in self.seen
        }
        return sorted(key for key in found if not callable(values[key]) and np.shape(values[key]) == form)

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


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
