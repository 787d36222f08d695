"""Changes of an operation: its operator, its sides, its brackets, the order of a product."""

from __future__ import annotations

import ast
import itertools

from muslin.reading.repairs.pieces import (
    CALLED,
    OPERATORS,
    Found,
    code,
    factors,
    identity,
    like,
    method,
    minus,
    number,
    product,
    terms,
    text_of,
    times,
    total,
)
from muslin.reading.repairs.scope import Scope

#: Operators that are easily taken for each other.
LIKELY = ({"*", "/"}, {"*", "@"}, {"*", "**"}, {"+", "*"})

#: What is said of a side of an operation that should not be there: of the left one, of the right one.
VERBS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("added", "added"),
    ast.Sub: ("there", "subtracted"),
    ast.Mult: ("multiplied by", "multiplied by"),
    ast.MatMult: ("multiplied by", "multiplied by"),
    ast.Div: ("there", "divided by"),
}

#: Pairs of operators, the one that stands and the one that belongs -> what else is said.
BESIDE: dict[tuple[str, str], str] = {
    ("*", "@"): " (* multiplies entry by entry, @ is the product of matrices)",
    ("*", "/"): ": it should be divided by {right}",
    ("/", "*"): ": it is divided by {right} where it should be multiplied",
    ("*", "**"): ": a multiple (twice) stands where a power (a square) is meant",
    ("**", "*"): ": a power (a square) stands where a multiple (twice) is meant",
    ("+", "*"): ": a sum stands where a product is meant",
    ("@", "+"): ": a product stands where a sum is meant",
    ("*", "+"): ": a product stands where a sum is meant",
}


def changes(scope: Scope, node: ast.BinOp) -> Found:
    """All changes of one operation."""
    yield from _operators(scope, node)
    yield from _sides(scope, node)
    yield from _entries(scope, node)
    yield from _brackets(node)
    yield from _of_matrices(scope, node)
    outer = scope.parent(node)
    if not (isinstance(outer, ast.BinOp) and type(outer.op) is type(node.op)):
        yield from _chains(scope, node)


def _operators(scope: Scope, node: ast.BinOp) -> Found:
    op, left, right, here = node.op, node.left, node.right, code(node)
    stands = OPERATORS.get(type(op), "")
    if isinstance(op, (ast.Mod, ast.FloorDiv)):
        remainder = isinstance(op, ast.Mod)
        words = "% (the remainder) stands in place of // (the quotient)"
        if not remainder:
            words = "// (the quotient) stands in place of % (the remainder)"
        meant: ast.operator = ast.FloorDiv() if remainder else ast.Mod()
        yield "operation", "quotient or remainder", f"{words} in {here}", ast.BinOp(left, meant, right)
    for other in (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.MatMult, ast.Pow):
        if isinstance(op, other) or {type(op), other} == {ast.Add, ast.Sub}:
            continue
        belongs = OPERATORS[other]
        words = f"{stands} stands in place of {belongs} in {here}"
        words += BESIDE.get((stands, belongs), "").format(right=code(right))
        with_one = any(isinstance(s, ast.Constant) and s.value == 1 for s in (left, right))
        plain = {stands, belongs} != {"+", "*"} or not with_one
        kind = "operation" if {stands, belongs} in LIKELY and plain else "odd"
        yield kind, f"{stands}->{belongs}", words, ast.BinOp(left, other(), right)
    shape = scope.form(left)
    if isinstance(op, ast.Mult) and shape and shape == scope.form(right):
        for called in ("dot", "cross", "outer_product"):
            words = f"* multiplies entry by entry in {here}, where {CALLED[called]} belongs"
            yield "operation", f"*->{called}", words, method(left, called, right)
    exponent = _value(right)
    if isinstance(op, ast.Pow) and exponent is not None:
        for k in (1, 2, 3, 4, 0.5, -1, -2, 2 / 3, -2 / 3, 1 / 3, -1 / 3):
            if k != exponent:
                words = f"the power is wrong in {here}"
                if k == 1:
                    words += f": {code(left)} should not be squared"
                new = scope.alias(left) if k == 1 else ast.BinOp(left, ast.Pow(), number(k))
                yield "power", f"**{exponent!r}->{k}", words, new
    quotients = [s for s in (left, right) if isinstance(s, ast.BinOp) and isinstance(s.op, ast.Div)]
    if isinstance(op, ast.Add) and len(quotients) == 2:
        one, two = quotients
        above, below = ast.BinOp(one.left, ast.Add(), two.left), ast.BinOp(one.right, ast.Add(), two.right)
        words = f"a sum of quotients stands in place of the quotient of two sums in {here}"
        yield "operation", "quotient of sums", words, ast.BinOp(above, ast.Div(), below)


def _value(node: ast.expr) -> float | None:
    """The number that an exponent is, with a sign, and a quotient of numbers."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return node.value
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = _value(node.operand)
        return None if inner is None else -inner
    return None


def _of_matrices(scope: Scope, node: ast.BinOp) -> Found:
    """What is done entry by entry with a matrix: a number added to it, a division by it, a power of it."""
    op, left, right, here, form = node.op, node.left, node.right, code(node), scope.form(node) or ()
    if len(form) != 2 or form[0] != form[1]:
        return
    if isinstance(op, (ast.Add, ast.Sub)) and () in (scope.form(left), scope.form(right)):
        first = scope.form(left) == ()
        one = left if first else right
        unit: ast.expr = identity(form[0])
        if not (isinstance(one, ast.Constant) and one.value == 1):
            unit = times(one, unit)
        words = f"{code(one)} goes into every entry in {here}: the identity matrix is meant"
        made = ast.BinOp(unit, op, right) if first else ast.BinOp(left, op, unit)
        yield "operation", "identity", words, made
    if isinstance(op, ast.Div) and scope.form(right) == form:
        inverse = method(right, "inverse")
        words = f"/ divides entry by entry in {here}: the inverse of {code(right)} is meant"
        scaled: ast.expr = ast.BinOp(left, ast.Mult() if scope.form(left) == () else ast.MatMult(), inverse)
        if isinstance(left, ast.Constant) and left.value == 1:
            scaled = inverse
        yield "operation", "inverse", words, scaled
    if isinstance(op, ast.Pow) and text_of(right) in ("-1", "-1.0", "2"):
        words = f"the power is taken entry by entry in {here}: the inverse of {code(left)} is meant"
        if text_of(right) == "2":
            words = f"the power is taken entry by entry in {here}: a product of matrices is meant"
            yield "operation", "square", words, ast.BinOp(left, ast.MatMult(), left)
        else:
            yield "operation", "inverse", words, method(left, "inverse")


def _sides(scope: Scope, node: ast.BinOp) -> Found:
    """Both sides exchanged, or one that should not be there."""
    op, left, right, here = node.op, node.left, node.right, code(node)
    stands, form = OPERATORS.get(type(op), ""), scope.form(node)
    on_left = isinstance(op, ast.MatMult) and len(scope.form(right) or ()) == 1  # a matrix times a vector
    if isinstance(op, (ast.Sub, ast.Div, ast.MatMult, ast.Pow)) and not on_left:
        words = f"the two sides are in the wrong order (exchanged) in {here}"
        if isinstance(op, ast.Sub):
            words = f"a sign is wrong: the difference {here} is turned round, its two sides are exchanged"
        if isinstance(op, ast.MatMult) and len(scope.form(left) or ()) == 1:
            words += ": a vector on the left is multiplied by the transpose"
        yield "order", stands, words, ast.BinOp(right, op, left)
    if type(op) not in VERBS:
        return
    first, second = VERBS[type(op)]
    end = f"once too often in {here}: it does not belong there"
    if scope.form(right) is not None and scope.form(left) == form:
        yield (
            "extra",
            f"{stands}{like(right)}",
            f"{code(right)} is {second} {end}{_factor(right, stands)}",
            left,
        )
    if scope.form(left) is not None and scope.form(right) == form:
        negative = isinstance(op, ast.Sub)
        yield (
            "extra",
            f"{like(left)}{stands}",
            f"{code(left)} is {first} {end}{_factor(left, stands)}",
            minus(right) if negative else right,
        )
        if negative:
            words = f"{code(left)} and the minus do not belong in {here}"
            yield "extra", f"{like(left)}{stands}.", words, right


def _factor(node: ast.expr, stands: str) -> str:
    """What a number too many makes of the rest."""
    value = node.value if isinstance(node, ast.Constant) else None
    if not isinstance(value, (int, float)) or stands not in "*/":
        return ""
    return f" (a factor of {'1/' if stands == '/' else ''}{value:g} too much)"


def _entries(scope: Scope, node: ast.BinOp) -> Found:
    """One entry that stands for all: of a matrix before a vector, of weights before a sum; a minus for a product."""
    left, right, here = node.left, node.right, code(node)
    if isinstance(node.op, ast.Sub) and not scope.form(left) and scope.form(right):
        words = f"the minus makes a difference of {here}: a product with a minus belongs there"
        yield "sign", "difference for product", words, ast.BinOp(left, ast.Mult(), minus(right))
    if not isinstance(node.op, ast.Mult):
        return
    *before, entry = factors(left, ast.Mult)
    whole = entry.value if isinstance(entry, ast.Subscript) else None
    if whole is None:
        return
    if len(scope.form(whole) or ()) == 2 and len(scope.form(right) or ()) == 1:
        applied: ast.expr = ast.BinOp(whole, ast.MatMult(), right)
        words = f"one entry, {code(entry)}, stands in place of the whole matrix {code(whole)} in {here}"
        yield "operation", "entry for matrix", words, product([*before, applied], ast.Mult)
    parts = terms(right)
    if len(scope.form(whole) or ()) == 1 and len(parts) > 1:
        own: ast.expr = total(
            [
                (sign, ast.BinOp(ast.Subscript(whole, ast.Constant(k), ast.Load()), ast.Mult(), part))
                for k, (sign, part) in enumerate(parts)
            ]
        )
        words = f"one weight, {code(entry)}, stands before the whole sum in {here}: each term has a weight of its own"
        yield "operation", "one weight", words, product([*before, own], ast.Mult)


def _brackets(node: ast.BinOp) -> Found:
    """Where the same symbols in the same order are bracketed otherwise."""
    left, right = node.left, node.right
    words = f"brackets are missing in {code(node)}, or set otherwise than they should be"
    if isinstance(left, ast.BinOp):
        yield "brackets", "", words, ast.BinOp(left.left, left.op, ast.BinOp(left.right, node.op, right))
    if isinstance(right, ast.BinOp):
        yield "brackets", "", words, ast.BinOp(ast.BinOp(left, node.op, right.left), right.op, right.right)
    yield from _powers(node)
    yield from _too_wide(node, words)
    chain = terms(node)
    if len(chain) < 2:
        return
    (_, first), (sign, last) = chain[0], chain[-1]
    ahead = _edge(first, ahead=True)
    behind = _edge(last, ahead=False)
    for front, back in ((ahead, None), (None, behind), (ahead, behind)):
        if front is None and back is None:
            continue
        inner = [*chain]
        if front is not None:
            inner[0] = (1, front.right)
        if back is not None:
            inner[-1] = (sign, back.left)
        made: ast.expr = total(inner)
        if front is not None:
            made = ast.BinOp(front.left, front.op, made)
        if back is not None:
            made = ast.BinOp(made, back.op, back.right)
        yield "brackets", "around a sum", words, made


def _powers(node: ast.BinOp) -> Found:
    """A power of one of two terms, where that of the whole is meant."""
    left, right = node.left, node.right
    for power, other in ((left, right), (right, left)):
        if not isinstance(node.op, (ast.Add, ast.Sub)) or not isinstance(power, ast.BinOp):
            continue
        if isinstance(power.op, ast.Pow):
            a, b = (power.left, other) if power is left else (other, power.left)
            made = ast.BinOp(ast.BinOp(a, node.op, b), ast.Pow(), power.right)
            words = f"brackets are missing in {code(node)}: the power is of the whole, {code(made)}"
            yield "brackets", "power of a sum", words, made


def _too_wide(node: ast.BinOp, words: str) -> Found:
    """A factor before or behind a bracket of three terms or more, of which only some should be in it."""
    if isinstance(node.op, (ast.Mult, ast.MatMult)) and len(inner := terms(node.right)) > 2:
        for k in range(1, len(inner) - 1):
            near = ast.BinOp(node.left, node.op, total(inner[:k]))
            yield "brackets", "around a sum", words, total([(1, near), *inner[k:]])
    if isinstance(node.op, (ast.Mult, ast.MatMult, ast.Div)) and len(inner := terms(node.left)) > 2:
        for k in range(1, len(inner) - 1):
            if inner[k][0] == 1:
                near = ast.BinOp(total(inner[k:]), node.op, node.right)
                yield "brackets", "around a sum", words, total([*inner[:k], (1, near)])


def _edge(node: ast.expr, ahead: bool) -> ast.BinOp | None:
    """A term with a factor in front, or behind, that may belong to the whole sum."""
    fits = isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult,) if ahead else (ast.Mult, ast.Div))
    return node if fits and isinstance(node, ast.BinOp) else None


def _chains(scope: Scope, node: ast.BinOp) -> Found:
    """Factors in another order, transposes at other factors; twice a factor where its square is meant."""
    here = code(node)
    if isinstance(node.op, ast.Mult):
        parts = factors(node, ast.Mult)
        twos = [k for k, part in enumerate(parts) if isinstance(part, ast.Constant) and part.value == 2]
        for two in twos[:1]:
            rest = [part for k, part in enumerate(parts) if k != two]
            for k, part in enumerate(rest):
                square = ast.BinOp(part, ast.Pow(), ast.Constant(2))
                words = (
                    f"a multiple (twice) stands in place of a power: {code(part)} should be squared in {here}"
                )
                made = product([square if q == k else p for q, p in enumerate(rest)], ast.Mult)
                yield "power", "twice for squared", words, made
    if not isinstance(node.op, ast.MatMult):
        return
    parts = factors(node, ast.MatMult)
    if not 2 < len(parts) <= 4:
        return
    for p in itertools.permutations(range(len(parts))):
        if p != tuple(range(len(parts))):
            words = f"the factors of the product are in the wrong order (exchanged) in {here}"
            yield "order", f"chain {p}", words, product([parts[q] for q in p], ast.MatMult)
    bare = [_untransposed(part) for part in parts]
    stand = [inner is not part for inner, part in zip(bare, parts, strict=True)]
    for flags in itertools.product((False, True), repeat=len(parts)):
        if sum(flag != stands for flag, stands in zip(flags, stand, strict=True)) > 1:
            words = f"the transposes stand at the wrong factors in {here}"
            turned = [
                method(scope.alias(inner), "transpose") if flag else inner
                for flag, inner in zip(flags, bare, strict=True)
            ]
            yield "odd", f"chain {flags}", words, product(turned, ast.MatMult)


def _untransposed(node: ast.expr) -> ast.expr:
    """What is transposed; the expression itself if it is not."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "transpose":
        return node.func.value
    return node
