"""A loop of many passes, worked out at once: the passes are put beside the cases, and what they add is summed up after.

That is done where no pass reads what another has written: a body of assignments and conditions, in which variables from
outside are added to, or written to entry by entry, and nothing else.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.reading import bounds
from muslin.reading.arithmetic import form, whole
from muslin.reading.bounds import Unclear
from muslin.reading.expressions import index

if TYPE_CHECKING:
    from muslin.reading.meaning import Meaning

#: Passes from which on a loop is dear, and is worked out at once or not at all; fewest that are worked out at once.
MANY, FEWEST = 28, 2

#: Rows that are as dear as one step more, all passes at once; steps that it takes to put them beside each other.
ROWS, BESIDE = 150, 60


@dataclass(frozen=True)
class Nest:
    """Loops that hold each other and little else, and what is done in the innermost."""

    loops: list[ast.For]
    body: list[ast.stmt]


def nested(statement: ast.For) -> Nest:
    """A loop, and those within it that may as well run together with it: before them there are values alone."""
    found: Nest | None = getattr(statement, "_nest", None)
    if found is None:
        found = statement._nest = _nested(statement)  # type: ignore[attr-defined]
    return found


def _nested(statement: ast.For) -> Nest:
    loops, body = [statement], statement.body
    before: list[ast.stmt] = []
    while body and isinstance(body[-1], ast.For) and all(map(_sets_a_name, body[:-1])):
        inner: Any = body[-1]
        counted = {n.id for loop in loops for n in ast.walk(loop.target) if isinstance(n, ast.Name)}
        counted |= {n.id for line in [*before, *body[:-1]] for n in ast.walk(line) if isinstance(n, ast.Name)}
        own = {n.id for n in ast.walk(inner.iter) if isinstance(n, ast.Name)}
        given = {t.id for line in [*before, *body[:-1]] for t in line.targets}  # type: ignore[attr-defined]
        stored = (n for n in ast.walk(inner) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
        if inner.orelse or own & counted or given & {n.id for n in stored}:
            break
        loops, before, body = [*loops, inner], [*before, *body[:-1]], inner.body
    return Nest(loops, [*before, *body])


def _sets_a_name(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Assign)
        and len(statement.targets) == 1
        and isinstance(statement.targets[0], ast.Name)
    )


@dataclass
class Sum:
    """What the passes do to a variable from outside, (b * passes, ...): what they add or write, and where they do."""

    made: np.ndarray
    written: np.ndarray


@dataclass
class Wide:
    """A loop under way.

    Attributes
    ----------
    sums : dict of Sum
        By variable.
    where : ndarray of bool, (b * passes,)
        In which rows the statements count that are worked out now.
    """

    sums: dict[str, Sum]
    where: np.ndarray

    def put(self, meaning: Meaning, target: Any, value: Any, env: dict[str, Any], sign: int) -> None:
        """Add to an entry, or take from it, or write it (0)."""
        base: Any = target.value if isinstance(target, ast.Subscript) else target
        found, rows = self.sums[base.id], np.flatnonzero(self.where)
        spot: tuple[Any, ...] = (rows,)
        if isinstance(target, ast.Subscript):
            for k in index(meaning, target.slice, env):
                if isinstance(k, slice):
                    raise Unclear
                spot += (k[rows] if isinstance(k, np.ndarray) else k,)
        if len(spot) != found.made.ndim:
            raise Unclear
        new = np.broadcast_to(np.asarray(value, dtype=np.float64), (len(self.where),))[rows]
        if sign:
            found.made[spot] += sign * new
        else:
            found.made[spot], found.written[spot] = new, True


def at_once(
    meaning: Meaning, statement: ast.For, nest: Nest, over: Sequence[Any], env: dict[str, Any]
) -> bool:
    """Work a loop out at once, or several within each other; False if that cannot be done.

    Raises
    ------
    Unclear
        If something in it is not understood.
    """
    if meaning.wide is not None or len(over) < FEWEST:
        return False
    summed = _summed(meaning, [meaning.instead_of(s) for s in nest.body], env)
    if summed is None or not all(type(item) is int or isinstance(item, tuple) for item in over):
        return False
    passes, count = len(over), meaning.count
    rows = passes * count
    if rows > bounds.BESIDE_EACH_OTHER:
        return False
    inside: dict[str, Any] = {}
    asked = meaning.names(statement) | meaning.new_names()
    for name in (
        env if meaning.recording else asked
    ):  # what stands in a line may be exchanged for anything known
        value = env.get(name)
        if value is None or name in summed:
            continue
        if isinstance(value, (list, tuple)):
            if name in asked:
                return False
            continue
        if np.ndim(value) and len(value) == count:
            meaning.counted(np.size(value) * passes)
            value = np.repeat(value, passes, axis=0)
        inside[name] = value
    columns = list(zip(*over, strict=True)) if isinstance(over[0], tuple) else [tuple(over)]
    arrays = [np.tile(np.array(column), count) for column in columns]
    targets = [t for loop in nest.loops for t in _one_by_one(loop.target)]
    if len(targets) != len(arrays):
        return False
    for target, array in zip(targets, arrays, strict=True):
        meaning.assign_loop(target, array, inside)
    sums = {}
    for name in summed:
        shape = (rows, *form(env[name]))
        meaning.counted(math.prod(shape))
        sums[name] = Sum(np.zeros(shape), np.zeros(shape, dtype=bool))
    values = meaning.wide_values
    if meaning.rows_of.setdefault(id(statement), rows) != rows and not meaning.recording:
        meaning.wide_values = {}  # another number of passes
    meaning.spent += BESIDE
    meaning.wide, meaning.count = Wide(sums, np.ones(rows, dtype=bool)), rows
    try:
        if meaning.run(nest.body, inside) is not None:
            raise Unclear
    finally:
        meaning.wide, meaning.count, meaning.wide_values = None, count, values
    for name, value in inside.items():
        if np.ndim(value) and len(value) == rows and name in meaning.assigned(statement):
            env[name] = value.reshape(count, passes, *value.shape[1:])[:, -1]
    for name, found in sums.items():
        env[name] = _total(found, env[name], count, passes)
    return True


def _one_by_one(target: ast.expr) -> list[ast.expr]:
    return list(target.elts) if isinstance(target, ast.Tuple) else [target]


def _total(found: Sum, before: Any, count: int, passes: int) -> np.ndarray:
    shape = form(before)
    made = found.made.reshape(count, passes, *shape)
    start = np.broadcast_to(before, (count, *shape))
    if not found.written.any():
        return start + made.sum(axis=1)
    written = found.written.reshape(made.shape)
    last = passes - 1 - np.argmax(written[:, ::-1], axis=1)
    kept = np.arange(passes).reshape(1, passes, *(1,) * len(shape)) >= last[:, None]
    return np.where(written.any(axis=1), np.where(kept, made, 0.0).sum(axis=1), start + made.sum(axis=1))


def _summed(meaning: Meaning, body: Sequence[Any], env: dict[str, Any]) -> set[str] | None:
    """Variables from outside that a loop adds to or writes to; None if it does anything else with them."""
    inner = list(_statements(meaning, body))
    found: set[str] = set()
    known: set[str] = set()
    read: set[str] = set()
    for top, statement in inner:
        read |= set().union(*(meaning.names(part) for part in _read(statement)))
        if isinstance(statement, (ast.Pass, ast.Expr, ast.If)):
            continue
        if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            target: Any = statement.targets[0]
        elif isinstance(statement, ast.AugAssign):
            target = statement.target
        else:
            return None
        base = target.value if isinstance(target, ast.Subscript) else target
        for one in base.elts if isinstance(base, ast.Tuple) else [base]:
            if not isinstance(one, ast.Name):
                return None
            if isinstance(target, ast.Subscript) or (
                isinstance(statement, ast.AugAssign) and one.id not in known
            ):
                if one.id in known:
                    return None
                found.add(one.id)
            elif top and (one.id in known or one.id not in read):
                known.add(one.id)
            elif one.id not in known:
                return None
    for name in found:
        value = env.get(name)
        if value is None or isinstance(value, (list, tuple)) or whole(value):
            return None
    if any(found & meaning.names(part) for _, s in inner for part in _read(s)) or found & meaning.new_names():
        return None
    return found


def _statements(meaning: Meaning, body: Sequence[Any], top: bool = True) -> Any:
    """All statements of a body, each with whether it stands under no condition."""
    for statement in body:
        yield top, statement
        if isinstance(statement, ast.If):
            for part in (statement.body, statement.orelse):
                yield from _statements(meaning, [meaning.instead_of(s) for s in part], top=False)


def _read(statement: Any) -> list[ast.AST]:
    """What a statement reads, but for what it adds to."""
    if isinstance(statement, ast.If):
        return [statement.test]
    if isinstance(statement, (ast.Assign, ast.AugAssign)):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        return [statement.value, *(t.slice for t in targets if isinstance(t, ast.Subscript))]
    return []
