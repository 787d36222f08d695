"""What a student's function means: its text worked out on many inputs at once, by this file and not by Python.

Only what is listed here is understood: arithmetic on numbers, vectors and matrices, the methods Taichi gives them,
branches, and loops of a known length. Nothing of the text is ever executed, so it may be read where no student's code
may run; whatever is not listed raises `Unclear`. Values are arrays with the inputs in front, (b,), (b, n), (b, n, m),
or plain numbers where all inputs share one.

What a text means may be asked once more with parts of it replaced (`Meaning.otherwise`): only what hangs on them is
worked out again, so that hundreds of changes can be tried.

Longer than others: it is one interpreter, and what it understands of a language cannot be read apart.
"""

from __future__ import annotations

import ast
import copy
import itertools
import operator
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from muslin.reading import bounds
from muslin.reading.arithmetic import METHODS, cast, checked, chosen, combined, form, rank, whole
from muslin.reading.bounds import Unclear
from muslin.reading.expressions import READERS, Fixed, function_of, index
from muslin.reading.loops import FEWEST, MANY, ROWS, Nest, Wide, at_once, nested

__all__ = ["METHODS", "Fixed", "Meaning", "Same", "Unclear"]

#: Nodes of a text that is read; its variables; steps of one run; calls within calls.
NODES, VARIABLES, STEPS, DEPTH = 1200, 40, 6000, 6

Names = frozenset[str]


class Same(Exception):
    """What was replaced comes to the same."""


class Meaning:
    """A function of a text, worked out on inputs.

    Parameters
    ----------
    functions : dict of ast.FunctionDef
        The file's functions.
    name : str
        The one that is asked.
    inputs : dict of ndarray, (b, ...)
        In the order of its arguments.

    Attributes
    ----------
    node : ast.FunctionDef
    results : tuple
        What it returns.
    values : dict
        Value of each node of the function that is worked out once, by the node's id.
    before : list of dict
        Variables before each statement of its body.
    statement : dict
        Which statement of the body a node stands in, by the node's id.
    forms : dict
        Shape of each node's value, by the node's id; also of what is worked out more than once.
    variables : dict
        Shape of each variable.
    integers : set of str
        Variables that are whole numbers.
    seen : dict, optional
        Where values are noted that are worked out, by the node's id.
    spent : int
        Steps taken so far.
    wide : Wide, optional
        The loop that is worked out at once just now.
    widened : bool
        Whether there is such a loop.
    wide_values : dict
        Values of the nodes in such loops, by the node's id.
    rows_of : dict
        How many rows they have, by the loop's id.
    here : dict
        Variables where a node is worked out, by the node's id; of nodes that are worked out once.

    Raises
    ------
    Unclear
        If it holds something that is not understood here.
    """

    def __init__(
        self, functions: Mapping[str, ast.FunctionDef], name: str, inputs: Mapping[str, np.ndarray]
    ) -> None:
        self.functions, self.node = functions, functions[name]
        given = [a.arg for a in self.node.args.args]
        if sum(1 for f in functions.values() for _ in ast.walk(f)) > NODES or len(given) != len(inputs):
            raise Unclear
        self.count = len(next(iter(inputs.values())))
        self.inputs = dict(zip(given, inputs.values(), strict=True))
        self.values: dict[int, Any] = {}
        self.before: list[dict[str, Any]] = []
        self.statement = {
            id(inner): k for k, statement in enumerate(self.node.body) for inner in ast.walk(statement)
        }
        self._node = {id(inner): inner for f in functions.values() for inner in ast.walk(f)}
        self._passes: dict[tuple[int, int], list[Any]] = {}
        self._one_by_one: set[tuple[int, int]] = set()  # loops whose passes cannot be worked out at once
        self._home = {id(inner): key for key, f in functions.items() for inner in ast.walk(f)}
        self.forms: dict[int, tuple[int, ...]] = {}
        self.variables: dict[str, tuple[int, ...]] = {}
        self.integers = {key for key, value in self.inputs.items() if whole(value)}
        self.here: dict[int, dict[str, Any]] = {}
        self._wide_here: dict[int, tuple[dict[str, Any], int]] = {}
        self.seen: dict[int, Any] | None = None
        self._names: dict[int, Names] = {}
        self._alive: list[ast.AST] = []  # what ids stand for
        self._again: set[int] = set()  # worked out more than once
        self._over: Mapping[int, ast.AST] = {}
        self._same: dict[int, int] = {}  # which node an alias stands for
        self._inner: frozenset[int] | None = None  # what stood in the node that is replaced
        self._dirty: set[str] = set()
        self._steps, self._made, self._recording, self.spent = 0, 0, True, 0
        self._first = True
        self._depth = 0
        self.wide: Wide | None = None
        self.widened = False
        self.wide_values: dict[int, Any] = {}
        self.rows_of: dict[int, int] = {}
        env = dict(self.inputs)
        self.variables.update({key: form(value) for key, value in env.items()})
        self.results = self._results(self._body_of_the_function(env, 0))
        self._recording = self._first = False
        if len(self.variables) > VARIABLES:
            raise Unclear

    def alias(self, node: Any) -> Any:
        """The same node under another id, to stand inside of what replaces it."""
        other = copy.copy(node)
        self._alive.append(other)
        self._same[id(other)] = id(node)
        return other

    def otherwise(self, changes: Mapping[int, ast.AST]) -> tuple[Any, ...]:
        """What the function returns if some nodes, by id, are replaced.

        Raises
        ------
        Unclear
            If it cannot be worked out then.
        Same
            If that changes nothing.
        """
        self._alive += changes.values()
        self._over, self._steps, self._made = changes, 0, 0
        homes = {self._home.get(key, self.node.name) for key in changes} - {self.node.name}
        self._dirty = set(self.functions) if homes else set()
        places = [self.statement.get(key) for key in changes]
        start = min((k for k in places if k is not None), default=0) if None not in places else 0
        try:
            return self._results(self._body_of_the_function(dict(self.before[start]), start))
        finally:
            self._over = {}

    def alone(self, node: ast.AST, changes: Mapping[int, ast.AST]) -> Any:
        """What a node comes to, worked out where it stands, if some nodes, by id, are replaced: it, or what is in it.

        Raises
        ------
        Unclear
            If it cannot be worked out.
        """
        self._over, self._steps, self._made, self._dirty = changes, 0, 0, set()
        self._alive += changes.values()
        count, wide = self.count, self.wide
        env = self.here.get(id(node))
        if env is None:
            if id(node) not in self._wide_here:
                raise Unclear
            env, self.count = self._wide_here[id(node)]
            self.wide = Wide({}, np.ones(self.count, dtype=bool))
        try:
            found = self.value(node, dict(env))
            return found if self.wide is None else np.broadcast_to(found, (self.count, *form(found)))
        finally:
            self._over, self.wide, self.count = {}, wide, count

    def rows(self, node: ast.AST) -> int:
        """How many values a node has that stands in a loop which is worked out at once."""
        return self._wide_here[id(node)][1] if id(node) in self._wide_here else 0

    def numbers_in_loop(self, node: ast.AST, parts: Mapping[str, tuple[ast.expr, Any]]) -> dict[str, Any]:
        """Numbers known where a node stands in a loop that is worked out at once: variables, and parts of the text."""
        if id(node) not in self._wide_here:
            return {}
        env, count = self._wide_here[id(node)]
        found = {name: value for name, value in env.items() if np.ndim(value) == 1 and len(value) == count}
        for text, (part, shape) in parts.items():
            value = self.wide_values.get(id(part), 0)
            if shape == () and np.ndim(value) == 1 and len(value) == count and self.names(part) <= env.keys():
                found[text] = value
        return {name: np.asarray(value, dtype=np.float64) for name, value in found.items()}

    def counts_in_loop(self, node: ast.AST, counting: Sequence[str]) -> dict[str, np.ndarray]:
        """The indices of such loops, by name, pass by pass."""
        env, count = self._wide_here.get(id(node), ({}, 0))
        return {name: np.broadcast_to(env[name], (count,)) for name in counting if name in env}

    def _instead(self, node: ast.AST, new: ast.AST, env: dict[str, Any]) -> Any:
        """What replaces a node; only what has stood in it is known here, for variables change from line to line."""
        before, self._inner = self._inner, self._inside(node)
        try:
            return self.value(new, env)
        finally:
            self._inner = before

    @property
    def recording(self) -> bool:
        """Whether values are kept that are worked out."""
        return self._recording

    # -- statements

    def _results(self, value: Any) -> tuple[Any, ...]:
        if value is None:
            raise Unclear
        return tuple(value) if isinstance(value, (tuple, list)) else (value,)

    def _body_of_the_function(self, env: dict[str, Any], start: int) -> Any:
        for k in range(start, len(self.node.body)):
            statement = self.node.body[k]
            if self._recording:
                self.before.append(dict(env))
            elif k > start and self._clean(statement) and k + 1 < len(self.before):
                after = self.before[k + 1]
                env.update({name: after[name] for name in _assigned(statement) if name in after})
                continue
            found = self._done(statement, env)
            if found is not None:
                return found
            if k == start and not self._recording and not self._dirty and k + 1 < len(self.before):
                raise Same
        return None

    def _run(self, body: Sequence[ast.stmt], env: dict[str, Any]) -> Any:
        for statement in body:
            found = self._done(statement, env)
            if found is not None:
                return found
        return None

    def _done(self, statement: Any, env: dict[str, Any]) -> Any:
        """Work a statement out; what it returns, if it returns."""
        self._step()
        if self._recording and not isinstance(statement, ast.For):
            now = dict(env)
            part = statement.test if isinstance(statement, ast.If) else statement
            inside = map(id, ast.walk(part))
            if self.wide is None:
                self.here.update(dict.fromkeys(inside, now))
            else:
                self._wide_here.update(dict.fromkeys(inside, (now, self.count)))
        if id(statement) in self._over:
            self._dirty |= _assigned(statement)
            statement = self._over[id(statement)]
            self._dirty |= _assigned(statement)
        if isinstance(statement, ast.Return) and statement.value is not None:
            return self.value(statement.value, env)
        if isinstance(statement, ast.Assign):
            dirty = not self._clean(statement)
            value = self.value(statement.value, env)
            for target in statement.targets:
                self._assign(target, value, env, dirty)
        elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
            self._assign(statement.target, self.value(statement.value, env), env, not self._clean(statement))
        elif isinstance(statement, ast.AugAssign):
            dirty = not self._clean(statement)
            if (name := self._summed(statement.target)) and self.wide is not None:
                sign = {ast.Add: 1, ast.Sub: -1}.get(type(statement.op), 0)
                if not sign:
                    raise Unclear
                self.wide.put(self, statement.target, self.value(statement.value, env), env, sign)
                self._dirty |= {name} if dirty else set()
                return None
            target = _loaded(statement.target)
            self._again.add(id(target))
            old = self.value(target, env)
            new = combined(statement.op, old, self.value(statement.value, env))
            self._assign(statement.target, new, env, dirty)
        elif isinstance(statement, ast.If):
            return self._if(statement, env)
        elif isinstance(statement, ast.For):
            return self._for(statement, env)
        elif not (isinstance(statement, (ast.Pass, ast.Assert)) or _silent(statement)):
            raise Unclear
        return None

    def _assign(self, target: ast.expr, value: Any, env: dict[str, Any], dirty: bool) -> None:
        if isinstance(target, (ast.Tuple, ast.List)):
            values = value
            if isinstance(value, np.ndarray):
                values = [value[:, k] for k in range(value.shape[1])] if value.ndim > 1 else None
            if not isinstance(values, (list, tuple)) or len(values) != len(target.elts):
                raise Unclear
            for one, inner in zip(target.elts, values, strict=True):
                self._assign(one, inner, env, dirty)
        elif isinstance(target, ast.Name) and not self._summed(target):
            old = env.get(target.id)
            if old is not None and whole(old) and not whole(value) and not isinstance(value, (list, tuple)):
                value = cast(value, True)  # a variable keeps the type it is born with
            env[target.id] = value
            if self._first and not isinstance(value, (list, tuple)):
                self.variables.setdefault(target.id, form(value))
                self.integers |= {target.id} if whole(value) else set()
            if dirty:
                self._dirty.add(target.id)
        elif (name := self._summed(target)) and self.wide is not None:
            self.wide.put(self, target, value, env, 0)
            self._dirty |= {name} if dirty else set()
        elif isinstance(target, ast.Subscript) and isinstance(target.value, ast.Name):
            old, where = env.get(target.value.id), index(self, target.slice, env)
            if not isinstance(old, np.ndarray) or any(isinstance(k, np.ndarray) for k in where):
                raise Unclear
            new = np.broadcast_to(old, (self.count, *old.shape[1:])).copy()

            spot = (slice(None), *where)
            if rank(value) and np.shape(value)[1:] != new[spot].shape[1:]:
                raise Unclear
            checked(operator.setitem, new, spot, value)
            env[target.value.id] = new
            if dirty:
                self._dirty.add(target.value.id)
        else:
            raise Unclear

    def _summed(self, target: Any) -> str:
        """The variable from outside that a loop adds to which is worked out at once; empty if it is none."""
        base = target.value if isinstance(target, ast.Subscript) else target
        name = base.id if isinstance(base, ast.Name) else ""
        return name if self.wide is not None and name in self.wide.sums else ""

    def instead_of(self, statement: Any) -> Any:
        """What stands in place of a statement."""
        return self._over.get(id(statement), statement)

    def new_names(self) -> set[str]:
        """Names in what stands in place of something."""
        parts = (new.test if isinstance(new, ast.If) else new for new in self._over.values())
        return set().union(*(self.names(part) for part in parts if isinstance(part, ast.expr)))

    def assigned(self, statement: ast.AST) -> Names:
        """Variables a statement gives values to."""
        return _assigned(statement)

    def run(self, body: Sequence[ast.stmt], env: dict[str, Any]) -> Any:
        """Work statements out."""
        return self._run(body, env)

    def _if(self, statement: ast.If, env: dict[str, Any]) -> Any:
        holds = self.value(statement.test, env)
        dirty = not self._clean(statement.test)
        inside = self._inside(statement)
        given = _assigned(statement).union(
            *(_assigned(new) for key, new in self._over.items() if key in inside)
        )
        if not isinstance(holds, np.ndarray):
            if dirty:
                self._dirty |= given
            return self._run(statement.body if holds else statement.orelse, env)
        holds = np.broadcast_to(holds != 0, (self.count,))
        yes, no = dict(env), dict(env)
        wide = self.wide
        where = wide.where if wide is not None else holds
        for branch, inner, taken in ((statement.body, yes, holds), (statement.orelse, no, ~holds)):
            if wide is not None:
                wide.where = where & taken
            if self._run(branch, inner) is not None:
                raise Unclear
        if wide is not None:
            wide.where = where
        for name in given:
            if name in yes and name in no:
                if yes[name] is not no[name]:
                    env[name] = chosen(holds, yes[name], no[name])
            else:
                env.pop(name, None)
            if dirty:
                self._dirty.add(name)
        return None

    def _for(self, statement: ast.For, env: dict[str, Any]) -> Any:
        nest = nested(statement)
        if len(nest.loops) > 1 and self._looped(statement, nest, env) is not NotImplemented:
            return None
        return self._looped(statement, Nest([statement], statement.body), env)

    def _looped(self, statement: ast.For, nest: Nest, env: dict[str, Any]) -> Any:
        """Work a loop out, or several within each other at once: `NotImplemented` where that cannot be done."""
        dirty = not all(self._clean(loop.iter) for loop in nest.loops)
        key = (id(statement), len(nest.loops))
        known = self._passes.get(key) if not dirty and self._depth == 0 and self.wide is None else None
        if statement.orelse:
            raise Unclear
        over = self._over_all(nest.loops, env) if known is None else known
        fixed = not any(self.names(loop.iter) & self.variables.keys() for loop in nest.loops)
        if fixed and not dirty and self._depth == 0 and all(type(item) in (int, tuple) for item in over):
            self._passes[key] = over
        if dirty:
            self._dirty |= _assigned(statement)
        inside = self._inside(statement)
        for replaced, new in self._over.items():
            if replaced in inside:  # what is written there, and what would be, may be read in the next pass
                node = self._node.get(replaced)
                self._dirty |= _assigned(new) | (_assigned(node) if node is not None else Names())
        if key not in self._one_by_one:
            try:
                if at_once(self, statement, nest, over, env):
                    self.widened = self.widened or (self._first and len(over) >= MANY)
                    return None
            except Unclear:
                if len(over) >= MANY and len(nest.loops) == 1:
                    raise
            if self._first and len(over) >= FEWEST:
                self._one_by_one.add(key)
        if len(nest.loops) > 1:
            return NotImplemented
        if self._recording and len(over) < FEWEST:  # other loops over it may have more passes
            self._again |= inside
        for item in over:
            self.assign_loop(statement.target, item, env)
            found = self._run(statement.body, env)
            if found is not None:
                return found
        return None

    def _over_all(self, loops: Sequence[ast.For], env: dict[str, Any]) -> list[Any]:
        """What a loop runs over; of several within each other all their numbers together."""
        each = [self.passes(loop.iter, env) for loop in loops]
        if len(each) == 1:
            return each[0]
        bounds.together(each)
        return [
            tuple(n for item in items for n in (item if isinstance(item, tuple) else (item,)))
            for items in itertools.product(*each)
        ]

    def assign_loop(self, target: ast.expr, item: Any, env: dict[str, Any]) -> None:
        """Give the variables of a loop their values."""
        if isinstance(target, ast.Name):
            env[target.id] = item
            if self._first:
                self.variables.setdefault(target.id, ())
                self.integers.add(target.id)
        elif isinstance(target, ast.Tuple) and isinstance(item, tuple) and len(item) == len(target.elts):
            for one, inner in zip(target.elts, item, strict=True):
                self.assign_loop(one, inner, env)
        else:
            raise Unclear

    def passes(self, node: Any, env: dict[str, Any]) -> list[Any]:
        """What a loop runs over."""
        node = self._over.get(id(node), node)
        if isinstance(node, (ast.List, ast.Tuple)):
            return [self.value(entry, env) for entry in bounds.passes(node.elts)]
        if not isinstance(node, ast.Call):
            raise Unclear
        name = function_of(node)
        if name in ("static", "grouped") and len(node.args) == 1:
            return self.passes(node.args[0], env)
        if name == "range":
            limits = [self.value(a, env) for a in node.args]
            if not all(type(n) is int for n in limits) or not limits:
                raise Unclear
            return bounds.passes(checked(range, *limits))
        if name == "ndrange":
            sizes = [self.value(a, env) for a in node.args]
            if not all(type(n) is int and n >= 0 for n in sizes):
                raise Unclear
            bounds.together([range(n) for n in sizes])
            return [tuple(map(int, index)) for index in np.ndindex(*sizes)]
        if name in ("enumerate", "zip") and node.args:
            lists = [self.passes(a, env) for a in node.args]
            return list(enumerate(lists[0]) if name == "enumerate" else zip(*lists, strict=False))
        raise Unclear

    # -- expressions

    def value(self, node: Any, env: dict[str, Any]) -> Any:
        """What an expression comes to."""
        key = id(node)
        if key in self._over:
            over, single = self._over, len(self._over) == 1
            self._over = {k: new for k, new in over.items() if k != key}  # what replaces it may hold it
            try:
                new = self._instead(node, over[key], env)
            finally:
                self._over = over
            if single and key in self.values and _equal(new, self.values[key]):
                raise Same
            self._see(key, new)
            return new
        if not self._recording:
            known = self._same.get(key, key)
            here = self._inner is None or known in self._inner
            values = self.values if self.wide is None else self.wide_values
            if here and known in values and self._clean(node):
                return values[known]
        self._step()
        reader = READERS.get(type(node))
        if reader is None:
            raise Unclear
        found = reader(self, node, env)
        if isinstance(found, np.ndarray):
            self.counted(found.size)
        self._see(key, found)
        if self._first and not isinstance(found, (list, tuple)):
            self.forms[key] = form(found)
        if self._recording:
            if key in self.values or key in self.wide_values or key in self._again:
                self._again.add(key)
                self.values.pop(key, None)
                self.wide_values.pop(key, None)
            else:
                (self.values if self.wide is None else self.wide_values)[key] = found
        return found

    def counted(self, numbers: int) -> None:
        """Take note of a value that is made in this run, of so many numbers."""
        self._made += numbers
        if numbers > bounds.NUMBERS or self._made > bounds.MADE:
            raise Unclear

    def _see(self, key: int, value: Any) -> None:
        if self.seen is not None and self.wide is None:
            self.seen[key] = value

    def names(self, node: ast.AST) -> Names:
        """All names in a node."""
        key = id(node)
        if key not in self._names:
            self._alive.append(node)
            own = frozenset([node.id]) if isinstance(node, ast.Name) else frozenset()
            self._names[key] = own.union(*(self.names(child) for child in ast.iter_child_nodes(node)))
        return self._names[key]

    def _clean(self, node: ast.AST) -> bool:
        """Whether nothing in a node has been replaced, or hangs on what was."""
        if self._recording:
            return True
        return not (self._dirty and not self._dirty.isdisjoint(self.names(node))) and not self._touched(node)

    def _touched(self, node: ast.AST) -> bool:
        inside = self._inside(node)
        return any(key in inside for key in self._over)

    def _inside(self, node: ast.AST) -> frozenset[int]:
        found = getattr(node, "_inside", None)
        if found is None:
            found = frozenset(id(n) for n in ast.walk(node))
            node._inside = found  # type: ignore[attr-defined]
        return found

    def _step(self) -> None:
        self._steps += 1
        self.spent += 1 + (self.count // ROWS if self.wide is not None else 0)
        if self._steps > STEPS:
            raise Unclear

    def called(self, function: ast.FunctionDef, arguments: list[Any]) -> Any:
        """What a helper of the file returns."""
        names = [a.arg for a in function.args.args]
        depth = self._depth
        if len(names) != len(arguments) or depth >= DEPTH:
            raise Unclear
        self._depth = depth + 1
        recording, values, dirty, wide_values = self._recording, self.values, self._dirty, self.wide_values
        self._recording, self.values, self._dirty = False, {}, set()  # its names are not those out here
        self.wide_values = {}
        try:
            found = self._run(function.body, dict(zip(names, arguments, strict=True)))
        finally:
            self._depth, self._recording, self.values, self._dirty = depth, recording, values, dirty
            self.wide_values = wide_values
        if found is None:
            raise Unclear
        return found


def _loaded(target: Any) -> Any:
    """A target as an expression."""
    found = getattr(target, "_loaded", None)
    if found is None:
        found = copy.copy(target)
        found.ctx = ast.Load()
        target._loaded = found
    return found


def _assigned(statement: ast.AST) -> Names:
    """Variables a statement gives values to."""
    found = getattr(statement, "_assigned", None)
    if found is None:
        names = set()
        for node in ast.walk(statement):
            if isinstance(node, (ast.Assign, ast.AugAssign, ast.AnnAssign, ast.For)):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                for target in targets:
                    for one in target.elts if isinstance(target, (ast.Tuple, ast.List)) else [target]:
                        while isinstance(one, ast.Subscript):
                            one = one.value
                        names |= {n.id for n in ast.walk(one) if isinstance(n, ast.Name)}
        found = statement._assigned = frozenset(names)  # type: ignore[attr-defined]
    return found


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, (list, tuple)) or isinstance(b, (list, tuple)):
        return False
    return np.shape(a) == np.shape(b) and bool(np.array_equal(a, b))


def _silent(statement: ast.stmt) -> bool:
    """Whether a statement changes nothing: a docstring, a print."""
    if not isinstance(statement, ast.Expr):
        return False
    value = statement.value
    return isinstance(value, ast.Constant) or (isinstance(value, ast.Call) and function_of(value) == "print")
