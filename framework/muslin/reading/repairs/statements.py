"""Changes of a line: what it does with its value, how often, and whether it is made as its counterpart is."""

from __future__ import annotations

import ast
import copy
import itertools
import re
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from muslin.reading import traps
from muslin.reading.repairs.alike import renumbered
from muslin.reading.repairs.pieces import (
    BORN,
    OPERATORS,
    Repair,
    code,
    function,
    function_of,
    like,
    name,
    replaced,
    text_of,
)
from muslin.reading.repairs.scope import Scope


def changes(scope: Scope, node: ast.stmt) -> Iterator[Repair]:
    """All changes of one statement."""
    if isinstance(node, (ast.Assign, ast.AugAssign)):
        yield from _targets(scope, node)
    if isinstance(node, ast.AugAssign):
        yield from _added(node)
        yield from _guarded(scope, node)
    elif isinstance(node, ast.Assign):
        yield from _born(node)
        yield from _assigned(scope, node)
        yield from _guarded(scope, node)
    elif isinstance(node, ast.For):
        yield from _loop(node)
    elif isinstance(node, ast.If) and node.orelse:
        words = f"the two branches of the condition {code(node.test)} are exchanged"
        turned = ast.If(node.test, node.orelse, node.body)
        yield Repair("condition", "turned", node.lineno, words, {id(node): turned})


def _born(node: ast.Assign) -> Iterator[Repair]:
    """A variable that is born as a whole number, and keeps that type, as one with fractions."""
    target = node.targets[0]
    if not isinstance(target, ast.Name):
        return
    born = copy.deepcopy(node.value)
    if traps.whole(born):
        for part in ast.walk(born):
            if isinstance(part, ast.Constant):
                part.value = float(part.value)  # type: ignore[arg-type]
    elif isinstance(born, ast.Call) and (
        types := [k for k, arg in enumerate(born.args) if traps.is_int(arg)]
    ):
        born.args[types[0]] = name("float")
    else:
        return
    words = (
        f"{target.id} is born as a whole number, so that what it gets later is cut off: "
        f"{code(born)} belongs there"
    )
    yield Repair("loop", BORN, node.lineno, words, {id(node): ast.Assign(node.targets, born)})


def _targets(scope: Scope, node: ast.Assign | ast.AugAssign) -> Iterator[Repair]:
    """A value that another variable, or another entry, should get."""
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    others: list[ast.expr] = []
    if isinstance(target, ast.Name):
        own = scope.variables.get(target.id)
        known = [key for key in scope.written if key != target.id and key not in scope.loops]
        others = [ast.Name(key, ast.Store()) for key in known if scope.variables.get(key) == own]
    elif isinstance(target, ast.Subscript):
        parts = target.slice.elts if isinstance(target.slice, ast.Tuple) else [target.slice]
        own = scope.variables.get(target.value.id) if isinstance(target.value, ast.Name) else None
        for k, part in enumerate(parts):
            rows = own[k] if own and k < len(own) else 3
            choices: list[ast.expr] = [ast.Constant(i) for i in range(rows)]
            choices += [name(key) for key in sorted(scope.loops)]
            for choice in choices:
                if text_of(choice) != text_of(part):
                    made = [choice if q == k else p for q, p in enumerate(parts)]
                    index = ast.Tuple(made, ast.Load()) if len(made) > 1 else made[0]
                    others.append(ast.Subscript(target.value, index, ast.Store()))
        yield from _turned_targets(scope, node, target)
        other = replaced(target.slice, _divided_otherwise)
        if text_of(other) != text_of(target.slice):
            others.append(ast.Subscript(target.value, other, ast.Store()))
    for other in others:
        new: ast.stmt = ast.Assign([other], node.value)
        if isinstance(node, ast.AugAssign):
            new = ast.AugAssign(other, node.op, node.value)  # type: ignore[arg-type]
        words = f"{code(target)} gets here what {code(other)} should get"
        yield Repair(
            "loop", f"target {text_of(target)}->{text_of(other)}", node.lineno, words, {id(node): new}
        )


def _turned_targets(
    scope: Scope, node: ast.Assign | ast.AugAssign, target: ast.Subscript
) -> Iterator[Repair]:
    """Two indices exchanged in the entry that gets a value."""
    if isinstance(target.slice, ast.Tuple) and len(target.slice.elts) == 2:
        i, j = target.slice.elts
        if text_of(i) != text_of(j):
            made = ast.Subscript(target.value, ast.Tuple([j, i], ast.Load()), ast.Store())
            words = f"{code(target)} gets here what {code(made)} should get: its two indices are exchanged (transposed)"
            yield _with_target(node, made, "target turned", words)
    inside = {n.id for n in ast.walk(target.slice) if isinstance(n, ast.Name) and n.id in scope.loops}
    for a, b in itertools.combinations(sorted(inside), 2):
        turned = replaced(target.slice, partial(_exchanged, {a: b, b: a}))
        made = ast.Subscript(target.value, turned, ast.Store())
        words = f"{a} and {b} are exchanged in {code(target)}, where {code(made)} belongs"
        yield _with_target(node, made, f"target {a}<->{b}", words)


def _divided_otherwise(node: Any) -> ast.AST | None:
    """A quotient for a remainder, and the other way round."""
    turned = {ast.Mod: ast.FloorDiv, ast.FloorDiv: ast.Mod}
    if isinstance(node, ast.BinOp) and type(node.op) in turned:
        return ast.BinOp(node.left, turned[type(node.op)](), node.right)
    return None


def _with_target(node: ast.Assign | ast.AugAssign, target: ast.Subscript, detail: str, words: str) -> Repair:
    new: ast.stmt = ast.Assign([target], node.value)
    if isinstance(node, ast.AugAssign):
        new = ast.AugAssign(target, node.op, node.value)
    return Repair("loop", detail, node.lineno, words, {id(node): new})


def _exchanged(turn: Mapping[str, str], node: Any) -> ast.AST | None:
    return name(turn[node.id]) if isinstance(node, ast.Name) and node.id in turn else None


def _too_many(node: ast.Assign | ast.AugAssign, target: ast.expr) -> Repair:
    words = f"what {code(target)} gets here does not belong there: the line is one too many"
    return Repair("extra", "line", node.lineno, words, {id(node): ast.Pass()})


def _added(node: ast.AugAssign) -> Iterator[Repair]:
    for op in (ast.Add(), ast.Sub()):
        if type(op) is not type(node.op):
            stands, belongs = OPERATORS.get(type(node.op), ""), OPERATORS[type(op)]
            words = f"a sign is wrong, or a product is made: {stands}= stands in place of {belongs}="
            new = ast.AugAssign(node.target, op, node.value)
            yield Repair("sign", "augmented", node.lineno, words, {id(node): new})
    words = f"{code(node.target)} is added to, where = belongs"
    assigned = ast.Assign([node.target], node.value)
    yield Repair("loop", "+=->=", node.lineno, words, {id(node): assigned})
    yield _too_many(node, node.target)


def _assigned(scope: Scope, node: ast.Assign) -> Iterator[Repair]:
    target = node.targets[0]
    if len(node.targets) > 1 or not isinstance(target, (ast.Name, ast.Subscript)):
        return
    once = "" if _is_summed(scope, node) else "once, "
    if once and isinstance(target, ast.Name) and scope.never_read(target.id, node):
        once = "once, never read: "
    for op, sign in ((ast.Add(), "+="), (ast.Sub(), "-=")):
        words = (
            f"{code(target)} is overwritten, where {sign} adds up: = stands in place of {sign}, "
            "only the last term is left"
        )
        if once:
            whole = code(ast.BinOp(target, op, node.value))
            words = f"{code(target)} is overwritten, and what it was before is lost: "
            words += f"= stands in place of {sign}, or {whole} belongs there"
        yield Repair(
            "loop", f"{once}=->{sign}", node.lineno, words, {id(node): ast.AugAssign(target, op, node.value)}
        )
    yield _too_many(node, target)


def _is_summed(scope: Scope, node: ast.Assign) -> bool:
    """Whether a line stands in a loop that gives its variable no other value: a sum, then, rather than a value."""
    around = scope.around(node)
    if not around:
        return False
    lines = [n for n in ast.walk(around[0]) if isinstance(n, ast.Assign) and n is not node]
    return text_of(node.targets[0]) not in [text_of(target) for line in lines for target in line.targets]


def _guarded(scope: Scope, node: ast.Assign | ast.AugAssign) -> Iterator[Repair]:
    """A line that only counts under a condition, which is missing."""
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    base = target.value if isinstance(target, ast.Subscript) else target
    if not isinstance(base, ast.Name) or isinstance(scope.parent(node), ast.If):
        return
    if not scope.has_value(base.id, node):
        return
    for test in _conditions(scope, node):
        words = (
            f"{code(target)} gets this always, and should only where {code(test)}: the condition is missing"
        )
        yield Repair(
            "condition",
            f"if {text_of(test)}",
            node.lineno,
            words,
            {id(node): ast.If(test, [scope.alias(node)], [])},
        )


def _conditions(scope: Scope, node: ast.stmt) -> Iterator[ast.expr]:
    """Conditions a line may stand under: two indices that agree, an index that is a number, a number's sign."""
    whole = [key for key in scope.whole if key not in scope.loops] + sorted(scope.counting(node))
    for a, b in itertools.combinations(whole, 2):
        yield from (ast.Compare(name(a), [op], [name(b)]) for op in (ast.Eq(), ast.NotEq()))
    for key, k in itertools.product(whole, range(3)):
        yield ast.Compare(name(key), [ast.Eq()], [ast.Constant(k)])
    for key in scope.named(()):
        if key not in whole:
            yield from (ast.Compare(name(key), [op], [ast.Constant(0)]) for op in (ast.Lt(), ast.Gt()))


def counterparts(scope: Scope, node: ast.Assign) -> Iterator[Repair]:
    """A line made as another one is, whose name differs in a digit."""
    mine = re.search(r"\d", text_of(node.targets[0]))
    if mine is None:
        return
    for other in ast.walk(scope.meaning.node):
        if not isinstance(other, ast.Assign) or like(other.targets[0]) != like(node.targets[0]):
            continue
        theirs = re.search(r"\d", text_of(other.targets[0]))
        if theirs is None or theirs[0] == mine[0]:
            continue
        whose = f"{code(other.targets[0])} in line {other.lineno}"
        words = f"{code(node.targets[0])} is not made as its counterpart {whose} is"
        for turn in ({theirs[0]: mine[0], mine[0]: theirs[0]}, {theirs[0]: mine[0]}):
            new = renumbered(other.value, turn, scope.variables)
            yield Repair("another", f"like {text_of(new)}", node.lineno, words, {id(node.value): new})


def _loop(node: ast.For) -> Iterator[Repair]:
    """A loop over other numbers."""
    over = node.iter
    if isinstance(over, ast.Call) and over.args and isinstance(over.args[0], ast.Call):
        over = over.args[0]  # ti.static(range(...))
    if not isinstance(over, ast.Call) or function_of(over) not in ("range", "ndrange"):
        return
    if function_of(over) == "ndrange":
        yield from _ranges(node, over)
        return
    limits = [getattr(a, "value", None) for a in over.args]
    first, last = [0, *limits] if len(limits) == 1 else limits[:2]
    for start, end in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        if (first, last) == (start, end):
            continue
        new = function("range", *([ast.Constant(start)] if start else []), ast.Constant(end))
        words = f"{_told(first, last, start, end)}: {code(over)}"
        changed: dict[int, ast.AST] = {id(over): new, id(node.iter): new}
        yield Repair("loop", f"{start},{end}", node.lineno, words, changed)


def _ranges(node: ast.For, over: ast.Call) -> Iterator[Repair]:
    """A loop over several indices, one of which runs too far, or not far enough."""
    indices = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
    sizes = [getattr(a, "value", None) for a in over.args]
    for k, (size, index) in enumerate(zip(sizes, indices, strict=False)):
        for other in sorted({s for s in sizes if isinstance(s, int)} | {2, 3, 4}):
            if isinstance(size, int) and other != size:
                made = [ast.Constant(other) if q == k else a for q, a in enumerate(over.args)]
                new = ast.Call(over.func, made, [])
                words = f"{_told(0, size, 0, other)}, the range of {code(index)}: {code(over)}"
                yield Repair("loop", f"{k}:{other}", node.lineno, words, {id(over): new, id(node.iter): new})


def _told(first: Any, last: Any, start: int, end: int) -> str:
    """What is wrong with a loop from `first` to `last`, if it should go from `start` to `end`."""
    if first == start:
        if last is None:
            return "the loop ends too early, some terms are missing"
        if last > end:
            return "the loop ends too late, the last index is one too many"
        left = " and ".join(map(str, range(last, end)))
        return f"the loop ends too early, the last index ({left}) is missing"
    if last == end:
        late = first is None or first > start
        return f"the loop begins too {'late, the first terms are missing' if late else 'early'}"
    return "the loop runs over other numbers than it should"
