"""What an expression of a student's text comes to, by what kind of expression it is."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.reading.arithmetic import (
    COMPARE,
    ELEMENTWISE,
    METHODS,
    aligned,
    cast,
    checked,
    chosen,
    combined,
    rank,
    vector,
)
from muslin.reading.bounds import LARGEST, SIZE, Unclear

if TYPE_CHECKING:
    from muslin.reading.meaning import Meaning

#: Variables and their values.
Env = dict[str, Any]


class Fixed(ast.expr):
    """A node that stands for a value."""

    _fields = ()

    def __init__(self, value: Any) -> None:
        super().__init__()
        self.value = value


def function_of(node: ast.Call) -> str:
    """Name of the function or method that is called."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def unclear() -> Any:
    """Where something is missing that is needed.

    Raises
    ------
    Unclear
    """
    raise Unclear


def _fixed(meaning: Meaning, node: Fixed, env: Env) -> Any:
    return node.value


def _constant(meaning: Meaning, node: ast.Constant, env: Env) -> Any:
    value = node.value
    if not isinstance(value, (bool, int, float)) or abs(value) > (
        LARGEST if isinstance(value, int) else 1e300
    ):
        raise Unclear
    return node.value


def _name(meaning: Meaning, node: ast.Name, env: Env) -> Any:
    if node.id not in env:
        raise Unclear
    return env[node.id]


def _binary(meaning: Meaning, node: ast.BinOp, env: Env) -> Any:
    return combined(node.op, meaning.value(node.left, env), meaning.value(node.right, env))


def _unary(meaning: Meaning, node: ast.UnaryOp, env: Env) -> Any:
    value = meaning.value(node.operand, env)
    if isinstance(node.op, ast.USub):
        return -value if not isinstance(value, np.ndarray) or value.dtype.kind != "b" else -value.astype(int)
    if isinstance(node.op, ast.UAdd):
        return value
    if isinstance(node.op, ast.Not):
        return np.logical_not(value) if isinstance(value, np.ndarray) else not value
    raise Unclear


def _compare(meaning: Meaning, node: ast.Compare, env: Env) -> Any:
    sides = [meaning.value(side, env) for side in (node.left, *node.comparators)]
    found: Any = True
    for op, a, b in zip(node.ops, sides[:-1], sides[1:], strict=True):
        if type(op) not in COMPARE or rank(a) or rank(b):
            raise Unclear
        holds = COMPARE[type(op)](a, b)
        found = holds if found is True else np.logical_and(found, holds)
    return found


def _logic(meaning: Meaning, node: ast.BoolOp, env: Env) -> Any:
    values = [meaning.value(v, env) for v in node.values]
    if any(rank(v) for v in values):
        raise Unclear
    join = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
    found = values[0]
    for other in values[1:]:
        found = join(found, other)
    return found if isinstance(found, np.ndarray) else bool(found)


def _either(meaning: Meaning, node: ast.IfExp, env: Env) -> Any:
    holds = meaning.value(node.test, env)
    if not isinstance(holds, np.ndarray):
        return meaning.value(node.body if holds else node.orelse, env)
    return chosen(
        np.broadcast_to(holds != 0, (meaning.count,)),
        meaning.value(node.body, env),
        meaning.value(node.orelse, env),
    )


def _listed(meaning: Meaning, node: Any, env: Env) -> Any:
    return tuple(meaning.value(entry, env) for entry in node.elts)


def _comprehended(meaning: Meaning, node: Any, env: Env) -> Any:
    if len(node.generators) != 1 or node.generators[0].ifs:
        raise Unclear
    (one,), inside, found = node.generators, dict(env), []
    for item in meaning.passes(one.iter, env):
        meaning.assign_loop(one.target, item, inside)
        found.append(meaning.value(node.elt, inside))
    return tuple(found)


def index(meaning: Meaning, node: Any, env: Env) -> tuple[Any, ...]:
    """What stands in square brackets: numbers, slices, arrays of numbers."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    found: list[Any] = []
    for part in parts:
        if isinstance(part, ast.Slice):
            ends = [None if e is None else meaning.value(e, env) for e in (part.lower, part.upper, part.step)]
            if any(e is not None and type(e) is not int for e in ends):
                raise Unclear
            found.append(slice(*ends))
        else:
            k = meaning.value(part, env)
            if (isinstance(k, np.ndarray) and k.ndim == 1 and k.dtype.kind == "i") or (
                type(k) is int and k >= 0
            ):
                found.append(k)
            else:
                raise Unclear
    return tuple(found)


def _subscript(meaning: Meaning, node: ast.Subscript, env: Env) -> Any:
    array, where = meaning.value(node.value, env), index(meaning, node.slice, env)
    if isinstance(array, (list, tuple)):
        if len(where) == 1 and isinstance(where[0], int) and where[0] < len(array):
            return array[where[0]]
        raise Unclear
    if not isinstance(array, np.ndarray) or len(where) != array.ndim - 1:
        raise Unclear
    if any(isinstance(k, np.ndarray) for k in where):
        if any(isinstance(k, slice) for k in where[:-1]) or isinstance(where[0], slice):
            raise Unclear
        array, first = np.broadcast_to(array, (meaning.count, *array.shape[1:])), np.arange(meaning.count)
        spot: tuple[Any, ...] = (first, *where)
    else:
        spot = (slice(None), *where)
    return checked(operator.getitem, array, spot)


def _attribute(meaning: Meaning, node: ast.Attribute, env: Env) -> Any:
    if node.attr in "xyzw":
        value = meaning.value(node.value, env)
        k = "xyzw".index(node.attr)
        if rank(value) == 1 and k < value.shape[1]:
            return value[:, k]
    if node.attr == "pi":
        return math.pi
    raise Unclear


def _call(meaning: Meaning, node: ast.Call, env: Env) -> Any:
    called, name = node.func, function_of(node)
    if node.keywords:
        raise Unclear
    if isinstance(called, ast.Name):
        if name in env:
            raise Unclear
        if name in meaning.functions:
            return meaning.called(meaning.functions[name], [meaning.value(a, env) for a in node.args])
        return _given(meaning, name, node.args, env)
    if not isinstance(called, ast.Attribute):
        raise Unclear
    owner = ast.unparse(called.value) if isinstance(called.value, (ast.Name, ast.Attribute)) else ""
    if owner in ("ti", "taichi", "tm", "ti.math") and owner not in env:
        return _given(meaning, name, node.args, env)
    if owner in ("ti.Vector", "ti.Matrix"):
        return _made(meaning, name, node.args, env)
    if name not in METHODS:
        raise Unclear
    arguments = [meaning.value(a, env) for a in (called.value, *node.args)]
    if not isinstance(arguments[0], np.ndarray) or not rank(arguments[0]):
        raise Unclear
    return checked(METHODS[name], *arguments)


def _given(meaning: Meaning, name: str, nodes: Sequence[ast.expr], env: Env) -> Any:
    if name in ("Vector", "Matrix"):
        return _built(meaning, meaning.value(nodes[0], env)) if nodes else unclear()
    if name == "static":
        return meaning.value(nodes[0], env)
    if name == "cast":
        whole = ast.unparse(nodes[1]).split(".")[-1] in ("int", "i32", "i64")
        return cast(meaning.value(nodes[0], env), whole)
    values = [meaning.value(a, env) for a in nodes]
    if name in ("int", "float", "i32", "f64") and len(values) == 1:
        return cast(values[0], name in ("int", "i32"))
    if name in ELEMENTWISE and len(values) == 1 and not isinstance(values[0], (list, tuple)):
        return ELEMENTWISE[name](values[0])
    if name in ("max", "min") and len(values) > 1:
        found, pick = values[0], np.maximum if name == "max" else np.minimum
        for other in values[1:]:
            found = pick(*aligned(found, other))
        return found
    if name == "pow" and len(values) == 2:
        return combined(ast.Pow(), *values)
    if name == "select" and len(values) == 3:
        holds = values[0]
        if not isinstance(holds, np.ndarray):
            return values[1] if holds else values[2]
        return chosen(np.broadcast_to(holds != 0, (meaning.count,)), *values[1:])
    if name == "diag" and len(values) == 1 and rank(values[0]) == 1:
        return values[0][:, :, None] * np.eye(values[0].shape[1])
    alike = {"length": "norm", "normalize": "normalized"}.get(name, name)
    if alike in METHODS and values and isinstance(values[0], np.ndarray) and rank(values[0]):
        return checked(METHODS[alike], *values)
    if name in ("vec2", "vec3", "vec4") and len(values) == int(name[3]):
        return _built(meaning, tuple(values))
    raise Unclear


def _made(meaning: Meaning, name: str, nodes: Sequence[ast.expr], env: Env) -> Any:
    if name in ("rows", "cols"):
        vectors = [vector(v) for v in meaning.value(nodes[0], env)]
        if len({v.shape[1] for v in vectors}) != 1 or len(vectors) > SIZE:
            raise Unclear
        full = [np.broadcast_to(v, (meaning.count, v.shape[1])) for v in vectors]
        return np.stack(full, axis=1 if name == "rows" else 2)
    sizes = [meaning.value(n, env) for n in nodes[1:]]
    if not all(type(n) is int and 0 < n <= SIZE for n in sizes):
        raise Unclear
    kind = np.int64 if ast.unparse(nodes[0]).split(".")[-1] in ("int", "i32", "i64") else np.float64
    if name == "identity" and len(sizes) == 1:
        return np.eye(sizes[0], dtype=kind)[None]
    if name in ("zero", "one") and 0 < len(sizes) <= 2:
        return np.full((1, *sizes), name == "one", dtype=kind)
    raise Unclear


def _built(meaning: Meaning, value: Any) -> Any:
    """A vector or a matrix of numbers."""
    if not isinstance(value, (list, tuple)) or not 0 < len(value) <= SIZE:
        raise Unclear
    if all(isinstance(row, (list, tuple)) for row in value):
        rows = [_built(meaning, row) for row in value]
        if len({row.shape[1] for row in rows}) != 1:
            raise Unclear
        full = [np.broadcast_to(row, (meaning.count, row.shape[1])) for row in rows]
        return np.stack(full, axis=1)
    if any(isinstance(entry, (list, tuple)) or rank(entry) for entry in value):
        raise Unclear
    return np.stack([np.broadcast_to(entry, (meaning.count,)) for entry in value], axis=1)


READERS: Mapping[type[ast.AST], Callable[[Meaning, Any, Env], Any]] = {
    Fixed: _fixed,
    ast.Constant: _constant,
    ast.Name: _name,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.Compare: _compare,
    ast.BoolOp: _logic,
    ast.IfExp: _either,
    ast.List: _listed,
    ast.Tuple: _listed,
    ast.ListComp: _comprehended,
    ast.Subscript: _subscript,
    ast.Attribute: _attribute,
    ast.Call: _call,
}
