"""The one change after which a function that does not compile is right, where its shapes do not fit.

Such a function has no answers to compare. Its text is read, and never run (`muslin.reading.meaning`): changes of the
kind that make shapes fit are tried one by one, and what is right for all public cases is told.
"""

from __future__ import annotations

import ast
import copy
import warnings
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from muslin.base.errors import MuslinError
from muslin.grading.needs import IMPOSSIBLE
from muslin.judging.reference import TOLERANCE
from muslin.reading.meaning import Meaning, Unclear
from muslin.reading.page import shown, used
from muslin.reading.repairs.pieces import Repair
from muslin.reading.repairs.readable import ordinary
from muslin.reading.source import Source

#: Methods of which one is written for another, and the constructors.
PRODUCTS = ("dot", "cross", "outer_product")
LENGTHS = ("norm", "norm_sqr", "normalized")
BUILDERS = {"rows": "cols", "cols": "rows"}

#: Most changes that are tried.
MOST = 400


def fitting(
    text: str,
    name: str,
    inputs: Mapping[str, np.ndarray],
    expected: Sequence[np.ndarray],
    scales: Sequence[np.ndarray],
) -> Repair | None:
    """The change that makes shapes fit, and the function right.

    Parameters
    ----------
    text : str
        The file.
    name : str
        The function.
    inputs, expected : arrays (b, ...)
        The public cases, and what is right.
    scales : sequence of (b,) arrays
        What errors are measured against, for each result.

    Returns
    -------
    Repair or None
        None if there is none, or the text is not understood, or there is nothing about shapes that is wrong.
    """
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if not ordinary(text):
                return None
            functions = {key: function.node for key, function in Source(text).functions.items()}
            mine = {key: functions[key] for key in used(functions, name)}
        except (MuslinError, RecursionError, KeyError):
            return None
        return next(_right(mine, name, inputs, expected, scales), None)


def _right(
    functions: dict[str, ast.FunctionDef],
    name: str,
    inputs: Mapping[str, np.ndarray],
    expected: Sequence[np.ndarray],
    scales: Sequence[np.ndarray],
) -> Iterator[Repair]:
    function = functions[name]
    try:
        stands = Meaning(functions, name, inputs).results
    except (Unclear, *IMPOSSIBLE):
        stands = ()
    if [np.shape(one) for one in stands] == [np.shape(one) for one in expected]:
        return  # it can be read, and its shapes are those asked for: something else keeps it from compiling
    tried = 0
    for k, node in enumerate(ast.walk(function)):
        if not isinstance(node, ast.expr) or isinstance(getattr(node, "ctx", None), ast.Store):
            continue
        for new, words in _changes(node):
            tried += 1
            if tried > MOST:
                return
            changed = {**functions, name: _with(function, k, new)}
            try:
                results = Meaning(changed, name, inputs).results
            except (Unclear, MuslinError, RecursionError, *IMPOSSIBLE):
                continue
            if _agree(results, expected, scales):
                words = words or f"`{shown(node)}` stands where `{shown(new)}` belongs"
                yield Repair("odd", "shapes", getattr(node, "lineno", 0), words, {})


def _changes(node: ast.expr) -> Iterator[tuple[ast.expr, str]]:
    """What may be meant where an expression stands, and words for it where both pieces of code are not plainest."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        of, method, arguments = node.func.value, node.func.attr, node.args
        if method == "transpose":
            yield of, ""
        for family in (PRODUCTS, LENGTHS):
            for other in family if method in family else ():
                if other != method:
                    yield _call(of, other, *arguments), ""
        if method in LENGTHS:
            yield of, ""
        if method in BUILDERS:
            meant = f"{shown(of)}.{BUILDERS[method]}"
            yield (
                _call(of, BUILDERS[method], *arguments),
                f"`{shown(node.func)}` stands where `{meant}` belongs",
            )
            lone = arguments[0].elts if arguments and isinstance(arguments[0], ast.List) else []
            if len(lone) == 1:
                vector = shown(lone[0])
                yield (
                    _diagonal(lone[0]),
                    f"the matrix with `{vector}` on its diagonal belongs there, not one of a row",
                )
    if isinstance(node, ast.BinOp):
        a, b = node.left, node.right
        if isinstance(node.op, ast.MatMult):
            yield ast.BinOp(a, ast.Mult(), b), ""
            yield ast.BinOp(b, ast.MatMult(), a), ""
        if isinstance(node.op, (ast.Mult, ast.MatMult)):
            if isinstance(node.op, ast.Mult):
                yield ast.BinOp(a, ast.MatMult(), b), ""
            yield _call(a, "dot", b), ""
            yield _call(a, "outer_product", b), ""
        if isinstance(node.op, ast.Pow):
            yield _call(a, "dot", a), ""
    if isinstance(node, (ast.Name, ast.Call, ast.BinOp)):
        yield _call(node, "transpose"), ""
        yield _call(node, "norm"), ""


def _call(of: ast.expr, method: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Attribute(of, method, ast.Load()), [*arguments], [])


def _diagonal(vector: ast.expr) -> ast.expr:
    """The matrix with a vector of three on its diagonal."""
    v = ast.unparse(vector)
    rows = [[f"{v}[{i}]" if i == j else "0" for j in range(3)] for i in range(3)]
    text = ", ".join(f"[{', '.join(row)}]" for row in rows)
    return ast.parse(f"ti.Matrix([{text}])", mode="eval").body


def _with(function: ast.FunctionDef, place: int, new: ast.expr) -> ast.FunctionDef:
    """A copy of a function in which something else stands for the node at a place of `ast.walk`."""
    other = copy.deepcopy(function)
    node = next(n for k, n in enumerate(ast.walk(other)) if k == place)
    standing = ast.copy_location(copy.deepcopy(new), node)
    for parent in ast.walk(other):
        for field, value in ast.iter_fields(parent):
            if value is node:
                setattr(parent, field, standing)
            elif isinstance(value, list):
                setattr(parent, field, [standing if one is node else one for one in value])
    return ast.fix_missing_locations(other)


def _agree(
    results: Sequence[np.ndarray], expected: Sequence[np.ndarray], scales: Sequence[np.ndarray]
) -> bool:
    """Whether results are right in all cases."""
    if len(results) != len(expected):
        return False
    for came, right, scale in zip(results, expected, scales, strict=True):
        if np.shape(came) != np.shape(right):
            return False
        off = np.abs(np.asarray(came, float) - right).reshape(len(right), -1).max(axis=1)
        if not (off <= TOLERANCE * np.maximum(scale, np.finfo(float).tiny)).all():
            return False
    return True
