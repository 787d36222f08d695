"""What a function in plain Python comes to, worked out line by line by this file and not by Python.

As `muslin.reading.meaning`, for functions that are not compiled: they count in loops of any length and call functions
they are given, and functions of their own. One input at a time; nothing of the text is ever executed, and whatever is
not listed raises `Unclear`. What is asked of the functions that are given is noted: it shows which way was taken.

Longer than others: one walk over Python's statements and expressions, a method for each kind.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from muslin.reading import bounds
from muslin.reading.bounds import Unclear
from muslin.reading.stepping_words import (
    CONSTANTS,
    IN_PLACE,
    METHODS,
    NUMPY,
    OPERATIONS,
    PYTHON,
    TYPES,
)

#: Steps of one run; functions within functions.
STEPS, DEEPEST = 12_000, 20

#: What is never too large.
SMALL = frozenset((float, bool, np.float64, np.bool_, type(None)))

#: What ends a block: nothing, `break`, `continue`; else what is returned, in a tuple.
GOES_ON, BREAKS, CONTINUES = "goes on", "breaks", "continues"


class TooLong(Unclear):
    """It takes more steps than are looked at."""


class Asked(NamedTuple):
    """One call of a function that was given: its name, its arguments, what it said, and the line it stands in."""

    name: str
    arguments: tuple[Any, ...]
    answer: Any
    line: int


class _Own(NamedTuple):
    """A function of the text's own, and the names around it."""

    node: Any
    around: Mapping[str, Any]


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
    module : ast.Module, optional
        The file it stands in: its other functions, and numbers with a name.
    asked : list of Asked, optional
        Where it is noted what functions that were given are asked, in order.
    """

    def __init__(
        self,
        node: ast.FunctionDef,
        changes: Mapping[int, Any],
        seen: dict[int, Any] | None = None,
        most: int = STEPS,
        module: ast.Module | None = None,
        asked: list[Asked] | None = None,
    ) -> None:
        self.node, self.changes, self.seen, self.most, self.module = node, changes, seen, most, module
        self.steps = self.depth = 0
        self.asked = asked

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
        self.env: dict[str, Any] = {}
        for line in self.module.body if self.module is not None else ():
            if isinstance(line, ast.FunctionDef) and line is not self.node:
                self.env[line.name] = _Own(line, self.env)
            elif isinstance(line, ast.Assign) and len(line.targets) == 1:
                try:
                    self._assign(line.targets[0], self.value(line.value))
                except Unclear:
                    continue
        noted = [self._noted(key, value) if callable(value) else value for key, value in arguments.items()]
        self.env = {**self.env, **dict(zip(names, noted, strict=True))}
        end = self._block(self.node.body)
        return end[0] if isinstance(end, tuple) else None

    def _noted(self, key: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """A function that was given, which notes what it is asked."""

        def noting(*arguments: Any) -> Any:
            answer = function(*(np.array(a) if isinstance(a, np.ndarray) else a for a in arguments))
            if self.asked is not None:
                kept = [np.array(a) if isinstance(a, np.ndarray) else a for a in (*arguments, answer)]
                self.asked.append(Asked(key, tuple(kept[:-1]), kept[-1], self.line))
            return answer

        return noting

    line = 0

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
        self.line = getattr(s, "lineno", self.line)
        if isinstance(s, ast.Return):
            return (self.value(s.value),) if s.value is not None else (None,)
        if isinstance(s, ast.Assign):
            value = self.value(s.value)
            for target in s.targets:
                self._assign(target, value)
        elif isinstance(s, ast.AnnAssign) and s.value is not None:
            self._assign(s.target, self.value(s.value))
        elif isinstance(s, ast.AugAssign) and isinstance(s.target, (ast.Name, ast.Subscript)):
            old = self._found(s.target)
            if isinstance(old, np.ndarray) and type(s.op) in IN_PLACE:
                value = IN_PLACE[type(s.op)](old, self.value(s.value))
            else:
                value = self._operation(s.op, old, self.value(s.value))
            self._assign(s.target, value)
        elif isinstance(s, ast.FunctionDef) and not s.decorator_list:
            self.env[s.name] = _Own(s, self.env)
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
                self.value(s.value)
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
        elif isinstance(target, (ast.Tuple, ast.List)) and isinstance(value, (tuple, list, np.ndarray)):
            if len(value) != len(target.elts):
                raise Unclear
            for one, inner in zip(target.elts, value, strict=True):
                self._assign(one, inner)
        elif isinstance(target, ast.Subscript):
            holds = self.value(target.value)
            if not isinstance(holds, (np.ndarray, list)):
                raise Unclear
            holds[self._index(target.slice)] = value
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
        found = self._whatever(node)
        return found if type(found) in SMALL else bounds.plain(found)

    def _whatever(self, node: Any) -> Any:
        """What an expression comes to, of any size."""
        self._step()
        if self.changes and id(node) in self.changes:
            changes = self.changes
            self.changes = {key: new for key, new in changes.items() if key != id(node)}
            try:
                return self._whatever(changes[id(node)])
            finally:
                self.changes = changes
        how = VALUES.get(type(node))
        if how is None:
            raise Unclear
        found = how(self, node)
        if self.seen is not None:
            self.seen[id(node)] = found
        return found

    def _constant(self, node: Any) -> Any:
        if node.value is None or isinstance(node.value, (int, float, str)):
            return node.value
        raise Unclear

    def _tuple(self, node: Any) -> Any:
        return tuple(self.value(e) for e in node.elts)

    def _list(self, node: Any) -> Any:
        return [self.value(e) for e in node.elts]

    def _named(self, node: Any) -> Any:
        value = self.value(node.value)
        self._assign(node.target, value)
        return value

    def _lambda(self, node: Any) -> Any:
        return _Own(node, self.env)

    def _binary(self, node: Any) -> Any:
        return self._operation(node.op, self.value(node.left), self.value(node.right))

    def _unary(self, node: Any) -> Any:
        if type(node.op) not in OPERATIONS:
            raise Unclear
        return OPERATIONS[type(node.op)](self.value(node.operand))

    def _boolean(self, node: Any) -> Any:
        stops = isinstance(node.op, ast.Or)
        return next((stops for part in node.values if self._holds(part) is stops), not stops)

    def _compare(self, node: Any) -> Any:
        sides = [self.value(side) for side in (node.left, *node.comparators)]
        if len(sides) == 2:
            return self._operation(node.ops[0], *sides)
        pairs = zip(node.ops, sides, sides[1:], strict=False)
        return all(bool(self._operation(op, a, b)) for op, a, b in pairs)

    def _choice(self, node: Any) -> Any:
        return self.value(node.body if self._holds(node.test) else node.orelse)

    def _attribute(self, node: Any) -> Any:
        if isinstance(node.value, ast.Name) and node.value.id in ("np", "numpy", "math"):
            return CONSTANTS[node.attr]
        if node.attr == "T":
            return np.transpose(self.value(node.value))
        if node.attr in ("size", "shape", "ndim"):
            return getattr(np.asarray(self.value(node.value)), node.attr)
        raise Unclear

    def _found(self, node: Any) -> Any:
        """What a name, or a place in an array, holds."""
        if not isinstance(node, ast.Name):
            return self.value(node.value)[self._index(node.slice)]
        if node.id in self.env:
            return self.env[node.id]
        if node.id in TYPES:
            return TYPES[node.id]
        raise Unclear

    def _index(self, node: Any) -> Any:
        if isinstance(node, ast.Slice):
            return slice(
                *(self.value(n) if n is not None else None for n in (node.lower, node.upper, node.step))
            )
        if isinstance(node, ast.Tuple):
            return tuple(self._index(e) for e in node.elts)
        return self.value(node)

    def _comprehension(self, node: Any) -> list[Any]:
        if len(node.generators) != 1:
            raise Unclear
        (inside,) = node.generators
        around, self.env = self.env, dict(self.env)
        try:
            found = []
            for item in self._passes(inside.iter):
                self._step()
                self._assign(inside.target, item)
                if all(self._holds(test) for test in inside.ifs):
                    found.append(self.value(node.elt))
            return found
        finally:
            self.env = around

    def _operation(self, op: ast.AST, a: Any, b: Any) -> Any:
        if type(op) not in OPERATIONS or (isinstance(op, ast.Pow) and not abs(np.max(np.abs(b))) < 64):
            raise Unclear
        if isinstance(op, (ast.Add, ast.Mult)):
            bounds.repeated(a, b)
        if isinstance(a, str) or isinstance(b, str):
            raise Unclear
        return bounds.plain(OPERATIONS[type(op)](a, b))

    def _called(self, node: ast.Call) -> Any:
        func = node.func
        if isinstance(func, ast.Name) and func.id == "next" and isinstance(node.args[0], ast.GeneratorExp):
            return self._first(node)
        if isinstance(func, ast.Name) and func.id == "print" and "print" not in self.env:
            return None
        arguments = [self.value(a) for a in node.args]
        keywords = {k.arg: self.value(k.value) for k in node.keywords if k.arg is not None}
        if len(keywords) < len(node.keywords):
            raise Unclear
        if isinstance(func, ast.Name):
            given = self.env.get(func.id)
            if isinstance(given, _Own):
                return self._own(given, arguments, keywords)
            if callable(given) and not keywords:
                self.line = node.lineno if hasattr(node, "lineno") else self.line
                return given(*arguments)
            if func.id in PYTHON and given is None:
                return PYTHON[func.id](*arguments, **keywords)
        elif isinstance(func, ast.Attribute):
            root = func.value
            module = root.attr if isinstance(root, ast.Attribute) else getattr(root, "id", "")
            if module in ("np", "numpy", "linalg", "math") and module not in self.env and func.attr in NUMPY:
                return NUMPY[func.attr](*arguments, **keywords)
            holds = self.value(root)
            if isinstance(holds, list) and func.attr == "append":
                return holds.append(*arguments)
            if func.attr in METHODS:
                return getattr(np.asarray(holds), func.attr)(*arguments, **keywords)
        raise Unclear

    def _first(self, node: ast.Call) -> Any:
        """`next(... for ...)`: nothing is worked out behind the first."""
        generator: Any = node.args[0]
        (inside,) = generator.generators
        around, self.env = self.env, dict(self.env)
        try:
            for item in self._passes(inside.iter):
                self._step()
                self._assign(inside.target, item)
                if all(self._holds(test) for test in inside.ifs):
                    return self.value(generator.elt)
        finally:
            self.env = around
        if len(node.args) != 2:
            raise Unclear
        return self.value(node.args[1])

    def _own(self, function: _Own, arguments: Sequence[Any], keywords: Mapping[str, Any]) -> Any:
        """What a function of the text's own comes to."""
        takes = function.node.args
        names = [a.arg for a in takes.args]
        if (
            self.depth >= DEEPEST
            or takes.vararg
            or takes.kwarg
            or takes.kwonlyargs
            or len(arguments) > len(names)
        ):
            raise Unclear
        usual = dict(zip(names[len(names) - len(takes.defaults) :], takes.defaults, strict=True))
        inside = {**dict(zip(names, arguments, strict=False)), **keywords}
        for key in names:
            if key not in inside:
                if key not in usual:
                    raise Unclear
                inside[key] = self.value(usual[key])
        around, self.env = self.env, {**function.around, **inside}
        self.depth += 1
        try:
            if isinstance(function.node, ast.Lambda):
                return self.value(function.node.body)
            end = self._block(function.node.body)
            return end[0] if isinstance(end, tuple) else None
        finally:
            self.env = around
            self.depth -= 1


VALUES: Mapping[type[ast.AST], Callable[[Stepping, Any], Any]] = {
    ast.Constant: Stepping._constant, ast.Name: Stepping._found, ast.Subscript: Stepping._found,
    ast.Tuple: Stepping._tuple, ast.List: Stepping._list, ast.ListComp: Stepping._comprehension,
    ast.GeneratorExp: Stepping._comprehension, ast.NamedExpr: Stepping._named, ast.Lambda: Stepping._lambda,
    ast.BinOp: Stepping._binary, ast.UnaryOp: Stepping._unary, ast.BoolOp: Stepping._boolean,
    ast.Compare: Stepping._compare, ast.IfExp: Stepping._choice, ast.Attribute: Stepping._attribute,
    ast.Call: Stepping._called,
}  # fmt: skip
