"""Changes of a symbol or two in an expression: a sign, a name, a number, an index, a method, a comparison."""

from __future__ import annotations

import ast
import itertools
import math
from fractions import Fraction
from typing import Any

from muslin.reading.repairs import entries, operations
from muslin.reading.repairs.pieces import (
    CALLED,
    OPERATORS,
    Form,
    Found,
    code,
    function,
    function_of,
    like,
    method,
    minus,
    name,
    number,
    ratio,
    text_of,
)
from muslin.reading.repairs.scope import Scope

#: Numbers that are tried for another, beside those made of it.
NUMBERS = (0, 1, 2, 3, 4, 6, 12, 24, 0.5, 0.25, 1e-6)

#: Methods and functions that are easily taken for each other.
GROUPS = (
    ("dot", "cross", "outer_product"),
    ("norm", "norm_sqr", "normalized"),
    ("rows", "cols"),
    ("max", "min"),
    ("transpose", "inverse"),
)

#: Kinds of slips in which one of them stands for another, where it is no "operation".
KIND_OF = {
    "rows": "transposed",
    "cols": "transposed",
    "norm": "length",
    "norm_sqr": "length",
    "normalized": "length",
    "transpose": "transposed",
    "inverse": "transposed",
    "determinant": "length",
    "trace": "length",
}

COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)


def changes(scope: Scope, node: Any) -> Found:
    """All changes of a symbol or two in one expression, but not in those inside of it."""
    form = scope.form(node)
    yield from _signs(scope, node, form)
    if isinstance(node, ast.Name):
        yield from _names(scope, node, form)
    elif isinstance(node, ast.Constant):
        yield from _constants(scope, node)
    elif isinstance(node, ast.Subscript):
        yield from _subscripts(node)
        for key in (
            scope.named(()) if form == () and not isinstance(scope.parent(node), ast.Subscript) else ()
        ):
            words = f"{code(node)} stands in place of {scope.said(key)}{scope.context(node)}"
            yield "another", f"{text_of(node)}->{key}", words, name(key)
    elif isinstance(node, ast.BinOp):
        yield from operations.changes(scope, node)
    elif isinstance(node, ast.Call):
        yield from _calls(node)
    elif isinstance(node, (ast.List, ast.Tuple)):
        yield from entries.changes(scope, node)
    elif isinstance(node, ast.Compare):
        yield from _comparisons(node)
        yield from _two_conditions(scope, node)
    elif isinstance(node, ast.BoolOp):
        yield from _joined(node)
    if form is not None and not isinstance(node, (ast.Compare, ast.BoolOp)):
        yield from _around(scope, node, form)


def _signs(scope: Scope, node: Any, form: Form | None) -> Found:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "sign", "minus", f"a sign is wrong: the minus before {code(node.operand)}", node.operand
        return
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        plus = isinstance(node.op, ast.Add)
        stands, verb, belongs = ("+", "subtracted", ast.Sub()) if plus else ("-", "added", ast.Add())
        words = f"a sign is wrong: {stands} before {code(node.right)} (it should be {verb})"
        yield "sign", f"{stands} before {like(node.right)}", words, ast.BinOp(node.left, belongs, node.right)
    outer = scope.parent(node)
    first = isinstance(outer, ast.BinOp) and isinstance(outer.op, (ast.Add, ast.Sub)) and outer.left is node
    if form == () and _power(outer) and outer.right is node:  # type: ignore[union-attr]
        words = f"a sign is wrong: the minus before the exponent {code(node)} is missing"
        yield "sign", f"exponent {like(node)}", words, minus(scope.alias(node))
        return
    own = first or isinstance(outer, (ast.stmt, ast.List, ast.Tuple, ast.Call))
    zero = isinstance(node, ast.Constant) and not node.value
    if form is not None and own and not zero and not isinstance(node, ast.Compare):
        words = f"the sign of {code(node)} is wrong: a minus is missing, or a difference is turned round"
        yield "turned", f"of {like(node)}", words, minus(scope.alias(node))


def _names(scope: Scope, node: ast.Name, form: Form | None) -> Found:
    here, counting = scope.context(node), scope.counting(node)
    for other, shape in scope.variables.items():
        if (
            other == node.id
            or shape != form
            or (other in scope.meaning.integers) != (node.id in scope.meaning.integers)
        ):
            continue
        if other not in scope.loops or other in counting:
            counts = "the index " if node.id in scope.loops and other in scope.loops else ""
            words = f"{counts}{scope.said(node.id)} stands in place of {scope.said(other)}{here}"
            for one, two, lacks in ((other, node.id, "missing"), (node.id, other, "one too many")):
                given = scope.defined.get(one)
                if given is not None and text_of(given) == f"{two}.transpose()":
                    words += f": a transpose is {lacks}"
            yield "index" if counts else "name", f"{node.id}->{other}", words, name(other)
    outer = scope.parent(node)
    if node.id in scope.loops and isinstance(outer, ast.BinOp) and scope.in_brackets(outer):
        for k in (3,):
            words = f"the index {node.id} should be multiplied by {k}{here}: a factor of {k} is missing"
            yield "index", f"{k}*{node.id}", words, ast.BinOp(ast.Constant(k), ast.Mult(), scope.alias(node))
    if node.id in scope.loops:
        for k in range(scope.length(node)):
            words = f"the index {node.id} stands in place of {k}{here}"
            yield "index", f"{node.id}->{k}", words, ast.Constant(k)
    elif form == () and isinstance(scope.parent(node), ast.Compare):
        for k in (0, 1):
            words = f"{node.id} stands in place of the number {k}{here}"
            yield "condition", f"{node.id}->{k}", words, ast.Constant(k)


def _constants(scope: Scope, node: ast.Constant) -> Found:
    outer, here, value = scope.parent(node), scope.context(node), node.value
    if isinstance(outer, ast.Tuple):
        outer = scope.parent(outer)
    if isinstance(outer, ast.Subscript):
        for k in range(scope.length(node)):
            if k != value:
                words = f"the index {value!r} stands in place of {k}{here}"
                yield "index", f"{value!r}->{k}", words, ast.Constant(k)
        for loop in sorted(scope.counting(node)):
            words = f"the index {value!r} stands in place of {loop}{here}"
            yield "index", f"{value!r}->{loop}", words, name(loop)
        return
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return
    made = [-value, value + 1, value - 1, *(value * k for k in (2, 3, 4)), *(value / k for k in (2, 3, 4))]
    if 0 < abs(value) < 0.1:
        made += [value * 10.0**k for k in range(-9, 10) if k]
    exponent = -round(math.log10(abs(value))) if value else 0
    if exponent < -2 and math.isclose(abs(value), 10.0**-exponent):
        words = f"the exponent of {value:g}{here} has the wrong sign: a large number stands in place of a small one"
        yield "sign", f"exponent {value}", words, number(10.0**exponent)
    for key in scope.named(()) if isinstance(outer, ast.Compare) else ():
        words = f"the number {value:g} stands in place of {scope.said(key)}{here}"
        yield "condition", f"{value}->{key}", words, name(key)
    what = "threshold" if isinstance(outer, ast.Compare) else "number"
    idle = _idle(outer)
    for other in dict.fromkeys((*made, *NUMBERS)):
        if other not in (value, idle) and not (other == 1 and _power(outer)):
            words = f"the {what} {value:g}{here} is wrong{ratio(value, other)}"
            whole = isinstance(value, int) and other == int(other)
            yield "number", f"{value}->{other}", words, number(int(other) if whole else other)
    nearest = Fraction(value).limit_denominator(36)
    if isinstance(value, float) and value and 0 < abs(float(nearest) / value - 1) < 0.02:
        words = f"the number {value:g}{here} is rounded: write it as a fraction, with all its digits"
        yield "number", f"{value}->{nearest}", words, number(float(nearest))
    one = value == 1 and isinstance(outer, ast.BinOp) and not isinstance(outer.op, (ast.Add, ast.Sub))
    tiny = 0 < abs(value) < 1e-3 and not isinstance(outer, ast.Compare)
    for key in scope.named(()) if value != idle and not one and not tiny else ():
        words = f"the number {value:g} stands in place of {scope.said(key)}{here}"
        kind = "condition" if isinstance(outer, ast.Compare) else "name"
        yield kind, f"{value}->{key}", words, name(key)


def _power(outer: ast.AST | None) -> bool:
    return isinstance(outer, ast.BinOp) and isinstance(outer.op, ast.Pow)


def _idle(outer: ast.AST | None) -> int | None:
    """The number that does nothing in an operation: it is told as one number too many."""
    if isinstance(outer, ast.BinOp):
        return {ast.Add: 0, ast.Sub: 0, ast.Mult: 1, ast.Div: 1}.get(type(outer.op))
    return None


def _subscripts(node: ast.Subscript) -> Found:
    if isinstance(node.slice, ast.Tuple) and len(node.slice.elts) == 2:
        turned = ast.Subscript(node.value, ast.Tuple(node.slice.elts[::-1], ast.Load()), ast.Load())
        words = "the two indices are in the wrong order (as in the transpose)"
        if any(isinstance(e, ast.Slice) for e in node.slice.elts):
            words = "a row stands in place of a column, or a column in place of a row (transposed)"
        yield "transposed", "indices", f"{words}: {code(node)}", turned


def _calls(node: ast.Call) -> Found:
    called, here, func = function_of(node), code(node), node.func
    for group in GROUPS:
        for other in group if called in group else ():
            if other != called:
                own = isinstance(func, ast.Attribute)
                new = ast.Attribute(func.value, other, ast.Load()) if own else name(other)  # type: ignore[attr-defined]
                words = f"{CALLED[called]} stands in place of {CALLED[other]} in {here}"
                kind = KIND_OF.get(called, "operation")
                yield kind, f"{called}->{other}", words, ast.Call(new, node.args, [])
    if isinstance(func, ast.Attribute) and called in ("cross", "outer_product") and node.args:
        turned = "exchanged: its sign is wrong" if called == "cross" else "exchanged"
        words = f"the factors of {CALLED[called]} are the wrong way round ({turned}) in {here}"
        yield "order", called, words, method(node.args[0], called, func.value)
    if isinstance(func, ast.Attribute) and called in KIND_OF and called not in ("rows", "cols"):
        inner = func.value
        words = {
            "transpose": f"{code(inner)} is transposed, and should not be",
            "inverse": f"{code(inner)} is inverted, and should not be: an inverse too many",
            "normalized": f"{code(inner)} is made of length one (normalised), and should keep its length",
        }.get(called, f"{CALLED[called]} is taken in {here}, where {code(inner)} itself belongs")
        yield KIND_OF[called], f"no {called}", words, inner
    if called in ("abs", "sqrt", "max", "min", "floor"):
        for argument in node.args:
            kind = "length" if called == "sqrt" else "condition"
            yield kind, f"no {called}", f"{called} should not be taken in {here}", argument
    if called == "diag" and node.args:
        words = f"a diagonal matrix is made in {here}, where the vector itself belongs"
        yield "operation", "no diag", words, node.args[0]
    if called not in ("max", "min"):
        for a, b in itertools.combinations(range(len(node.args)), 2):
            arguments = list(node.args)
            arguments[a], arguments[b] = arguments[b], arguments[a]
            words = f"two arguments are in the wrong order (exchanged) in {here}"
            yield "order", called, words, ast.Call(func, arguments, [])


def _comparisons(node: ast.Compare) -> Found:
    if len(node.ops) != 1:
        sides = [node.left, *node.comparators]
        for a, b in itertools.combinations(range(len(sides)), 2):
            if b - a < len(sides) - 1:
                left = code(ast.Compare(sides[a], node.ops[a:b], sides[a + 1 : b + 1]))
                words = (
                    f"the condition {code(node)} asks for too much: {left} alone is every case that counts"
                )
                yield "condition", "chain", words, ast.Compare(sides[a], node.ops[a:b], sides[a + 1 : b + 1])
        return
    stands, here = OPERATORS.get(type(node.ops[0]), ""), code(node)
    for other in COMPARISONS:
        if not isinstance(node.ops[0], other):
            words = f"the condition is not the right one: {stands} stands in place of {OPERATORS[other]} in {here}"
            new = ast.Compare(node.left, [other()], node.comparators)
            yield "condition", f"{stands}->{OPERATORS[other]}", words, new
    yield (
        "condition",
        "always",
        f"what stands under the condition {here} should be done always",
        ast.Constant(True),
    )
    yield (
        "condition",
        "never",
        f"what stands under the condition {here} should never be done",
        ast.Constant(False),
    )


def _joined(node: ast.BoolOp) -> Found:
    """One condition too many, or the wrong word between them."""
    here, also = code(node), isinstance(node.op, ast.And)
    word, other = ("and", "or") if also else ("or", "and")
    words = f"the condition is not the right one: {word} stands in place of {other} in {here}"
    yield "condition", f"{word}->{other}", words, ast.BoolOp(ast.Or() if also else ast.And(), node.values)
    for k, value in enumerate(node.values):
        rest = [v for q, v in enumerate(node.values) if q != k]
        new = rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)
        much = "much" if also else "little"
        words = f"the condition asks for too {much} in {here}: without {code(value)} it is right"
        yield "condition", f"no {k}", words, new


def _two_conditions(scope: Scope, node: ast.Compare) -> Found:
    """Another condition, that two other indices agree; or that one, too, which is missing."""
    if len(node.ops) == 1 and isinstance(node.ops[0], ast.Eq) and scope.counted(node.left):
        for a, b in itertools.combinations(sorted(scope.meaning.integers & scope.variables.keys()), 2):
            other = ast.Compare(name(a), [ast.Eq()], [name(b)])
            words = f"the condition is not the right one: {code(node)} stands in place of {code(other)}"
            yield "condition", f"<-> {a} == {b}", words, other
    indices = sorted(scope.counting(node))
    mine = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
    if len(node.ops) != 1 or not isinstance(node.ops[0], ast.Eq) or not mine <= set(indices):
        return
    for a, b in itertools.combinations([key for key in indices if key not in mine], 2):
        second = ast.Compare(name(a), [ast.Eq()], [name(b)])
        words = f"the condition {code(node)} asks for too little: {code(second)} must hold, too"
        yield "condition", f"and {a} == {b}", words, ast.BoolOp(ast.And(), [scope.alias(node), second])


def _around(scope: Scope, node: ast.expr, form: Form) -> Found:
    """A method, a power, a guard that is missing around an expression."""
    inner, here, outer = scope.alias(node), code(node), scope.parent(node)
    if len(form) == 1:
        if "normalize" not in text_of(node):
            words = f"{here} is not made of length one (normalised), and should be"
            yield "length", "normalized", words, method(inner, "normalized")
        for called in ("norm", "norm_sqr"):
            yield (
                "length",
                called,
                f"the vector {here} stands in place of {CALLED[called]} of it",
                method(inner, called),
            )
        words = f"{here} is a vector, where the diagonal matrix of it belongs"
        yield "operation", "diag", words, function("diag", inner)
    if len(form) == 2 and form[0] == form[1]:
        for called, verb in (("transpose", "transposed"), ("inverse", "inverted")):
            words = f"{CALLED[called]} is missing: {here} should be {verb}"
            yield "transposed", f"{like(node)} {called}", words, method(inner, called)
    if form or isinstance(node, ast.Constant) or isinstance(outer, (ast.Subscript, ast.Slice)):
        return
    if scope.counted(node):
        return
    ends = (
        isinstance(node, ast.BinOp)
        and isinstance(node.right, ast.BinOp)
        and isinstance(node.right.op, ast.Pow)
    )
    if not ends and not (isinstance(outer, ast.BinOp) and isinstance(outer.op, ast.Pow)):
        square = ast.BinOp(inner, ast.Pow(), ast.Constant(2))
        yield "power", f"{like(node)} squared", f"a square is missing: {here} should be squared", square
    if isinstance(outer, ast.BinOp) and isinstance(outer.op, ast.Div) and outer.right is node:
        words = f"a power is missing: {here} should be cubed"
        yield "power", f"{like(node)} cubed", words, ast.BinOp(inner, ast.Pow(), ast.Constant(3))
    words = f"a root is missing: the square root of {here} should be taken"
    yield "power", f"{like(node)} root", words, function("sqrt", inner)
    words = f"an absolute value is missing around {here}"
    yield "length", f"|{like(node)}|", words, function("abs", inner)
    words = f"nothing keeps {here} from zero: max with a small number is missing"
    yield "condition", f"max {like(node)}", words, function("max", inner, ast.Constant(1e-6))
