"""What a function in plain Python comes to, worked out line by line by this file and not by Python.

As `muslin.reading.meaning`, for functions that are not compiled: they count in loops of any length and call functions
they are given. One input at a time; nothing of the text is ever executed, and whatever is not listed raises `Unclear`.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from muslin.reading import bounds
from muslin.reading.bounds import Unclear

#: Steps of one run.
STEPS = 12_000

OPERATIONS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.MatMult: operator.matmul, ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Is: operator.is_, ast.IsNot: operator.is_not,
    ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_,
}  # fmt: skip

#: Functions of NumPy, and of Python; methods of arrays.
NUMPY: Mapping[str, Callable[..., Any]] = {
    "sqrt": np.sqrt, "abs": np.abs, "dot": np.dot, "inner": np.inner, "sum": np.sum, "max": np.max, "min": np.min,
    "isfinite": np.isfinite, "isinf": np.isinf, "isnan": np.isnan, "array": np.array, "copy": np.copy,
    "asarray": np.asarray, "zeros_like": np.zeros_like, "exp": np.exp, "log": np.log, "all": np.all, "any": np.any,
    "norm": np.linalg.norm, "solve": np.linalg.solve, "inv": np.linalg.inv, "float64": np.float64,
}  # fmt: skip
PYTHON: Mapping[str, Callable[..., Any]] = {
    "abs": abs, "max": max, "min": min, "float": float, "len": len, "sum": sum, "int": int, "range": range,
    "bool": bool,
}  # fmt: skip
METHODS = ("copy", "dot", "max", "min", "sum", "transpose")
CONSTANTS = {"inf": np.inf, "nan": np.nan, "pi": np.pi}

#: What ends a block: nothing, `break`, `continue`; else what is returned, in a tuple.
GOES_ON, BREAKS, CONTINUES = "goes on", "breaks", "continues"


class TooLong(Unclear):
    """It takes more steps than are looked at."""


class Stepping:
    """A function of a text, worked out for one input.

    Parameters
    ----------
    node : ast.FunctionDef
    changes : dict
        What stands in place of a node, by its id: an expression, or a list of statements.
    seen : dict, optional
        Where the last value of each expression is noted, by its id.
    most : int
        Steps it may take.
    """

    def __init__(
        self,
        node: ast.FunctionDef,
        changes: Mapping[int, Any],
        seen: dict[int, Any] | None = None,
        most: int = STEPS,
    ) -> None:
        self.node, self.changes, self.seen, self.most = node, changes, seen, most
        self.steps = 0

    def run(self, arguments: Mapping[str, Any]) -> Any:
        """What it returns.

        Raises
        ------
        Unclear
            If it holds something that is not understood here, or takes too long.
        """
        names = [a.arg for a in self.node.args.args]
        if len(names) != len(arguments):
            raise Unclear
        self.env = dict(zip(names, arguments.values(), strict=True))
        end = self._block(self.node.body)
        return end[0] if isinstance(end, tuple) else None

    def _step(self) -> None:
        self.steps += 1
        if self.steps > self.most:
            raise TooLong

    def _block(self, body: Sequence[ast.stmt]) -> Any:
        for statement in body:
            if (end := self._statement(statement)) is not GOES_ON:
                return end
        return GOES_ON

    def _statement(self, s: Any) -> Any:
        self._step()
        if id(s) in self.changes:
            changes = self.changes
            self.changes = {key: new for key, new in changes.items() if key != id(s)}
            try:
                return self._block(changes[id(s)])
            finally:
                self.changes = changes
        if isinstance(s, ast.Return):
            return (self.value(s.value),) if s.value is not None else (None,)
        if isinstance(s, ast.Assign):
            value = self.value(s.value)
            for target in s.targets:
                self._assign(target, value)
        elif isinstance(s, ast.AugAssign) and isinstance(s.target, ast.Name):
            old = self.env.get(s.target.id)
            if old is None:
                raise Unclear
            self.env[s.target.id] = self._operation(s.op, old, self.value(s.value))
        elif isinstance(s, ast.If):
            return self._block(s.body if self._holds(s.test) else s.orelse)
        elif isinstance(s, (ast.For, ast.While)):
            return self._loop(s)
        elif isinstance(s, ast.Break):
            return BREAKS
        elif isinstance(s, ast.Continue):
            return CONTINUES
        elif isinstance(s, ast.Expr):
            if not isinstance(s.value, ast.Constant):
                raise Unclear
        elif not isinstance(s, ast.Pass):
            raise Unclear
        return GOES_ON

    def _loop(self, s: Any) -> Any:
        passes = iter(self._passes(s.iter)) if isinstance(s, ast.For) else None
        while True:
            self._step()
            if passes is not None:
                item = next(passes, self)
                if item is self:
                    break
                self._assign(s.target, item)
            elif not self._holds(s.test):
                break
            end = self._block(s.body)
            if end is BREAKS:
                return GOES_ON
            if isinstance(end, tuple):
                return end
        return self._block(s.orelse)

    def _assign(self, target: Any, value: Any) -> None:
        if isinstance(target, ast.Name):
            self.env[target.id] = value
        elif isinstance(target, ast.Tuple) and isinstance(value, tuple) and len(value) == len(target.elts):
            for one, inner in zip(target.elts, value, strict=True):
                self._assign(one, inner)
        else:
            raise Unclear

    def _holds(self, node: ast.expr) -> bool:
        return bool(self.value(node))

    def _passes(self, node: ast.expr) -> Any:
        """What a loop runs over: a range of any length, since each pass is a step."""
        found = self._whatever(node)
        return found if isinstance(found, range) else bounds.plain(found)

    def value(self, node: Any) -> Any:
        """What an expression comes to."""
        return bounds.plain(self._whatever(node))

    def _whatever(self, node: Any) -> Any:
        """What an expression comes to, of any size."""
        self._step()
        if id(node) in self.changes:
            changes = self.changes
            self.changes = {key: new for key, new in changes.items() if key != id(node)}
            try:
                return self._whatever(changes[id(node)])
            finally:
                self.changes = changes
        found = self._value(node)
        if self.seen is not None:
            self.seen[id(node)] = found
        return found

    def _value(self, node: Any) -> Any:
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float, bool)):
            return node.value
        if isinstance(node, ast.Name) and node.id in self.env:
            return self.env[node.id]
        if isinstance(node, ast.Tuple):
            return tuple(self.value(e) for e in node.elts)
        if isinstance(node, ast.BinOp):
            return self._operation(node.op, self.value(node.left), self.value(node.right))
        if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATIONS:
            return OPERATIONS[type(node.op)](self.value(node.operand))
        if isinstance(node, ast.BoolOp):
            stops = isinstance(node.op, ast.Or)
            return next((stops for part in node.values if self._holds(part) is stops), not stops)
        if isinstance(node, ast.Compare):
            sides = [self.value(side) for side in (node.left, *node.comparators)]
            pairs = zip(node.ops, sides, sides[1:], strict=False)
            return all(bool(self._operation(op, a, b)) for op, a, b in pairs)
        if isinstance(node, ast.IfExp):
            return self.value(node.body if self._holds(node.test) else node.orelse)
        if isinstance(node, ast.Attribute):
            if isinstance(node.value, ast.Name) and node.value.id in ("np", "numpy", "math"):
                return CONSTANTS[node.attr]
            if node.attr == "T":
                return np.transpose(self.value(node.value))
        if isinstance(node, ast.Subscript) and not isinstance(node.slice, ast.Slice):
            return self.value(node.value)[self.value(node.slice)]
        if isinstance(node, ast.Call):
            return self._called(node)
        raise Unclear

    def _operation(self, op: ast.AST, a: Any, b: Any) -> Any:
        if type(op) not in OPERATIONS or (isinstance(op, ast.Pow) and not abs(np.max(np.abs(b))) < 64):
            raise Unclear
        if isinstance(op, (ast.Add, ast.Mult)):
            bounds.repeated(a, b)
        return bounds.plain(OPERATIONS[type(op)](a, b))

    def _called(self, node: ast.Call) -> Any:
        arguments = [self.value(a) for a in node.args]
        func = node.func
        if isinstance(func, ast.Name):
            given = self.env.get(func.id)
            if callable(given):
                return given(*(np.array(a) if isinstance(a, np.ndarray) else a for a in arguments))
            if func.id in PYTHON:
                return PYTHON[func.id](*arguments)
        elif isinstance(func, ast.Attribute):
            root = func.value
            module = root.attr if isinstance(root, ast.Attribute) else getattr(root, "id", "")
            if module in ("np", "numpy", "linalg", "math") and module not in self.env and func.attr in NUMPY:
                return NUMPY[func.attr](*arguments)
            if func.attr in METHODS and not node.keywords:
                return getattr(np.asarray(self.value(root)), func.attr)(*arguments)
        raise Unclear
