"""Larger changes of an expression: a factor or a term that is missing, another part in its place."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from muslin.reading.repairs import alike
from muslin.reading.repairs.pieces import (
    Form,
    Found,
    code,
    function,
    function_of,
    identity,
    like,
    method,
    name,
    names_in,
    product,
    terms,
    text_of,
    times,
)
from muslin.reading.repairs.pieces import factors as chain
from muslin.reading.repairs.scope import Scope

#: Numbers that may be missing as a factor.
FACTORS = (2, 3, 4, 6, 0.5, 0.25, 1 / 3, 1 / 6, 1 / 12)

#: Nodes of a part that may be missing as a factor; longest text of a term that is shown [characters]; longest row of a
#: matrix whose entries may be missing.
SMALL, SHOWN, LONGEST = 8, 40, 4

#: Most vectors or matrices that are tried as what a number is a multiple of; most columns of which they are made.
MANY, FEW_COLUMNS = 120, 10


def _fixed(scope: Scope, node: ast.expr) -> bool:
    """Whether nothing is added to a node, or multiplied with it: a number, an index."""
    return isinstance(node, ast.Constant) or isinstance(scope.parent(node), (ast.Subscript, ast.Slice))


def takes_a_factor(scope: Scope, node: ast.expr) -> bool:
    """Whether an expression is a term, an entry, or all of a line."""
    outer = scope.parent(node)
    term = isinstance(outer, ast.BinOp) and isinstance(outer.op, (ast.Add, ast.Sub))
    return not (_fixed(scope, node) or scope.counted(node)) and (
        term or isinstance(outer, (ast.stmt, ast.List, ast.Tuple, ast.Call))
    )


def unused(scope: Scope, node: ast.expr) -> Found:
    """A factor or a term that is missing, or stands nowhere, of the variables that are never used."""
    form, outer = scope.form(node), scope.parent(node)
    for key in scope.idle if isinstance(outer, (ast.stmt, ast.List, ast.Tuple)) else ():
        if scope.variables[key] == form and key in scope.defined and not _fixed(scope, node):
            for op, verb in ((ast.Add(), "added"), (ast.Sub(), "subtracted")):
                words = f"a term is missing in {code(node)}: {scope.said(key)}, which is used nowhere, should be {verb}"
                yield "lacks term", f"idle {verb} {key}", words, ast.BinOp(scope.alias(node), op, name(key))
    if takes_a_factor(scope, node):
        idle = ((scope.said(key), name(key)) for key in scope.idle if scope.variables[key] == ())
        yield from _numbered(scope, node, idle)


def broadcast(scope: Scope, node: ast.expr) -> Found:
    """The vector, or the matrix, that a number is a multiple of which is added to one."""
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, (ast.Add, ast.Sub)):
        return
    form = scope.form(node) or ()
    for number, other in ((node.left, node.right), (node.right, node.left)):
        if form and scope.form(number) == () and scope.form(other) == form:
            for detail, words, part in _multiplied(scope, number, form, other):
                new = times(scope.alias(number), part)
                sides = (new, other) if number is node.left else (other, new)
                yield "lacks factor", detail, words, ast.BinOp(sides[0], node.op, sides[1])


def into_a_vector(scope: Scope, node: ast.stmt) -> Found:
    """The same of a number that a vector or a matrix gets, or that is added to one."""
    if not isinstance(node, (ast.Assign, ast.AugAssign)) or scope.form(node.value) != ():
        return
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    form = scope.variables.get(target.id, ()) if isinstance(target, ast.Name) else ()
    for detail, words, part in _multiplied(scope, node.value, form, node) if form else ():
        made = times(scope.alias(node.value), part)
        new: ast.stmt = ast.Assign([target], made)
        if isinstance(node, ast.AugAssign):
            new = ast.AugAssign(node.target, node.op, made)
        yield "lacks factor", detail, words, new


def _multiplied(
    scope: Scope, number: ast.expr, form: Form, other: ast.AST
) -> Iterator[tuple[str, str, ast.expr]]:
    """Vectors or matrices that a number may be a multiple of."""
    parts: dict[str, ast.expr] = {key: name(key) for key in scope.named(form)}
    for part in [part for part, shape in scope.parts.values() if shape == form and part is not other]:
        parts |= {text_of(one): one for one in (part, *alike.counterparts(scope, part))}
    if len(form) == 1:
        parts |= {f"{key}.normalized()": method(name(key), "normalized") for key in scope.named(form)}
    if len(form) == 2:
        whole = [key for key in scope.idle if scope.variables[key] == form]
        columns: list[ast.expr] = [
            ast.Subscript(name(key), ast.Tuple([ast.Slice(), name(k)], ast.Load()), ast.Load())
            for key, k in itertools.product(whole, sorted(set(scope.counting(number))))
        ]
        columns += [part for part, shape in scope.parts.values() if shape == form[:1]]
        columns += [other for part in columns for other in alike.counterparts(scope, part)]
        for a, b in itertools.permutations([*map(name, scope.named(form[:1])), *columns][:FEW_COLUMNS], 2):
            made = method(a, "outer_product", b)
            parts[text_of(made)] = made
    what = "vector" if len(form) == 1 else "matrix"
    for text, part in sorted(parts.items(), key=lambda found: len(found[0]))[:MANY]:
        words = f"{code(number)} is a number where a {what} belongs: the factor `{text}` is missing"
        yield f"*{text}", words, part


def inserted(scope: Scope, node: ast.expr, form: Form) -> Found:
    """A matrix that is missing in a product: one with a name, its transpose, the diagonal one of a vector."""
    outer = scope.parent(node)
    if isinstance(outer, ast.BinOp) and isinstance(outer.op, ast.MatMult):
        return
    summed = isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub))
    if len(form) != 2 or not takes_a_factor(scope, node) or summed:
        return
    every = chain(node, ast.MatMult)
    for k in range(1, len(every) + (len(every) == 1)):
        before = scope.form(every[k - 1])
        if before is None or len(before) != 2 or len(every) > 4:
            continue
        made = [function("diag", name(key)) for key in scope.vectors if scope.variables[key] == before[1:]]
        for a, b in itertools.product(scope.matrices, scope.vectors):
            if scope.variables[a] == (before[1], before[1]) and scope.variables[b] == before[1:]:
                made.append(function("diag", ast.BinOp(name(a), ast.MatMult(), name(b))))
        square = [key for key in scope.matrices if scope.variables[key] == (before[1], before[1])]
        made += [m for key in square for m in (name(key), method(name(key), "transpose"))]  # type: ignore[misc]
        for part in made:
            new = product([*every[:k], part, *every[k:]], ast.MatMult)
            words = f"a factor is missing in {code(node)}: {code(part)}"
            yield "lacks factor", f"{k}@{text_of(part)}", words, new


def entries(scope: Scope, node: ast.expr, form: Form) -> Found:
    """A factor that is missing, of the entries that are never taken of arrays of which others are."""
    if takes_a_factor(scope, node):
        for text, part in _entries(scope, node):
            words = f"a factor is missing at {code(node)}: {text}"
            yield "lacks factor", f"*{text}{like(node)}", words, times(scope.alias(node), part)


def _numbered(scope: Scope, node: ast.expr, parts: Iterable[tuple[str, ast.expr]]) -> Found:
    """A factor or a divisor that is missing, of some."""
    inner, here = scope.alias(node), code(node)
    for text, part in parts:
        yield (
            "lacks factor",
            f"*{text}{like(node)}",
            f"a factor is missing at {here}: {text}",
            times(inner, part),
        )
        if text_of(part) == text_of(node):
            continue  # that makes one of it: it is what stands there that is not right
        words = f"a division is missing at {here}: by {text}"
        yield "lacks factor", f"/{text}{like(node)}", words, ast.BinOp(inner, ast.Div(), part)


def factors(scope: Scope, node: ast.expr, form: Form) -> Found:
    """A factor that is missing at an expression which is a term, an entry, or all of a line."""
    if not takes_a_factor(scope, node):
        return
    inner, here = scope.alias(node), code(node)
    for value in FACTORS:
        much = str(Fraction(value).limit_denominator(24))
        yield (
            "lacks factor",
            f"{much}*{like(node)}",
            f"a factor of {much} is missing at {here}",
            times(ast.Constant(value), inner),
        )
    yield from _numbered(scope, node, _numbers(scope))
    if form == ():
        for key in scope.vectors:
            words = f"{here} is a number where a vector belongs: the factor {scope.said(key)} is missing"
            yield "lacks factor", f"*{key}", words, times(inner, name(key))
        return
    for key in scope.matrices:
        shape = scope.variables[key]
        for text, part in (
            (scope.said(key), name(key)),
            (f"the transpose of {key}", method(name(key), "transpose")),
        ):
            if shape[1] == form[0]:
                new = ast.BinOp(part, ast.MatMult(), inner)
                yield "lacks factor", f"{text}@", f"a factor is missing in front of {here}: {text}", new
            if len(form) == 2 and shape[0] == form[1]:
                new = ast.BinOp(inner, ast.MatMult(), part)
                yield "lacks factor", f"@{text}", f"a factor is missing behind {here}: {text}", new


def _numbers(scope: Scope) -> Iterator[tuple[str, ast.expr]]:
    """Numbers of the function that may be missing as a factor."""
    for key in scope.named(()):
        yield scope.said(key), name(key)
    for text, (part, shape) in scope.parts.items():
        if shape == () and sum(1 for _ in ast.walk(part)) <= SMALL:
            yield f"`{text}`", part
    for key in scope.vectors:
        yield f"the length of {scope.said(key)}", method(name(key), "norm")
        yield f"the squared length of {scope.said(key)}", method(name(key), "norm_sqr")


def _entries(scope: Scope, node: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    """Entries that are taken nowhere yet: by the indices of the loops a node stands in, and of vectors by numbers."""
    counting = [name(key) for key in sorted(set(scope.counting(node)))]
    idle = [key for key in scope.idle if len(scope.variables[key]) == 1]
    for a, b in itertools.permutations(idle, 2):
        for k in counting if scope.variables[a] == scope.variables[b] else ():
            one, two = (ast.Subscript(name(key), k, ast.Load()) for key in (a, b))
            part: ast.expr = ast.BinOp(one, ast.Sub(), two)
            yield f"`{text_of(part)}`", part
    for key, shape in scope.variables.items():
        if key in scope.idle and len(shape) == 2 and 9 in shape:  # in row-major order
            loops = [text_of(index) for index in counting]
            joined = [f"3 * {a} + {b}" for a, b in itertools.permutations(loops, 2)]
            for row, column in itertools.product(*(joined if size == 9 else loops for size in shape)):
                part = ast.parse(f"{key}[{row}, {column}]", mode="eval").body
                yield f"`{text_of(part)}`", part
        if not 1 <= len(shape) <= 2 or max(shape) > LONGEST:
            continue
        if key not in scope.idle and not any(text.startswith(f"{key}[") for text in scope.parts):
            continue
        indices: list[Any] = [*counting, *map(ast.Constant, range(shape[0]))]
        if len(shape) == 2:
            indices = [ast.Tuple(list(pair), ast.Load()) for pair in itertools.product(counting, repeat=2)]
        for index in indices:
            part = ast.Subscript(name(key), index, ast.Load())
            if text_of(part) not in scope.parts:
                yield f"`{text_of(part)}`", part


def units(scope: Scope, node: ast.expr, form: Form) -> Found:
    """What is taken off, or added, that is the same for all: 1 or 2, or the identity."""
    outer = scope.parent(node)
    if _fixed(scope, node) or (len(form) == 2 and form[0] != form[1]):
        return
    if isinstance(outer, (ast.BinOp, ast.UnaryOp)) and isinstance(outer.op, (ast.Add, ast.Sub, ast.USub)):
        return  # the sum as a whole is asked
    inner, here = scope.alias(node), code(node)
    numbers = (1, 2, 3) if len(terms(node)) > 1 else (1,)
    parts: list[tuple[str, ast.expr]] = [(f"the number {k}", ast.Constant(k)) for k in numbers]
    if len(form) == 2:
        parts = [("the identity", identity(form[0]))]
    for text, part in parts:
        for op, verb in ((ast.Sub(), "subtracted from"), (ast.Add(), "added to")):
            words = f"{text} should be {verb} {here}, and is left out"
            yield "lacks term", f"{verb} {text}", words, ast.BinOp(inner, op, part)


def addends(scope: Scope, node: ast.expr, form: Form) -> Found:
    """A term that is missing in a sum, or beside what is none yet."""
    outer = scope.parent(node)
    if _fixed(scope, node) or (isinstance(outer, ast.BinOp) and isinstance(outer.op, (ast.Add, ast.Sub))):
        return  # the sum as a whole is asked
    if isinstance(node, ast.Call) and function_of(node) in ("max", "min", "abs"):
        return  # what it is taken of is asked
    inner, found = scope.alias(node), {text_of(part): (text, part) for text, part in _terms(scope, form)}
    for term in [*(part for _, part in terms(node)), *scope.added(text_of(node))]:
        for part in alike.counterparts(scope, term):
            text = f"a term like the others, with {names_in(part, scope.variables)},"
            found.setdefault(text_of(part), (text, part))
    found.pop(text_of(node), None)  # twice is told as a factor
    for text, part in found.values():
        for op, verb in ((ast.Add(), "added"), (ast.Sub(), "subtracted")):
            shown = "" if "`" in text or len(text_of(part)) > SHOWN else f" ({code(part)})"
            words = f"something is missing in {code(node)}: {text}{shown} should be {verb}, and is left out"
            yield "lacks term", f"{verb} {text}", words, ast.BinOp(inner, op, part)


def _terms(scope: Scope, form: Form) -> Iterator[tuple[str, ast.expr]]:
    """What may be missing as a term."""
    for key in scope.named(form):
        yield scope.said(key), name(key)
    for part, shape in scope.parts.values():
        if shape == form:
            yield f"a part with {names_in(part, scope.variables)}", part
    if form == ():
        for key, (i, j) in itertools.product(scope.matrices, np.ndindex(2, 2)):
            text = f"{key}[{i}, {j}]"
            if scope.variables[key][0] <= LONGEST and text not in scope.parts:
                index = ast.Tuple([ast.Constant(i), ast.Constant(j)], ast.Load())
                yield f"`{text}`", ast.Subscript(name(key), index, ast.Load())
        for key, k in itertools.product(scope.vectors, range(3)):
            yield f"{key}[{k}]", ast.Subscript(name(key), ast.Constant(k), ast.Load())
        for a, b in itertools.combinations_with_replacement(scope.vectors, 2):
            yield f"a product of {a} and {b}", method(name(a), "dot", name(b))
    if form == (3, 3):
        for a, b in itertools.product(scope.vectors, repeat=2):
            yield f"an outer product of {a} and {b}", method(name(a), "outer_product", name(b))


def others(scope: Scope, node: ast.expr, form: Form) -> Found:
    """Another part of the function in place of an expression, or a product of its variables."""
    if isinstance(node, ast.Constant) or isinstance(scope.parent(node), ast.Slice):
        return
    here, whole = text_of(node), isinstance(node, (ast.BinOp, ast.Call))
    parts = {text: part for text, (part, shape) in scope.parts.items() if shape == form}
    if whole:
        parts |= {text_of(part): part for part in scope.variants(node)}
    for text, part in parts.items():
        if text != here:
            which = (
                code(part) if len(text_of(part)) <= SHOWN else f"one with {names_in(part, scope.variables)}"
            )
            words = f"{code(node)} stands in place of another part: {which} belongs there"
            yield "another", f"{here}->{text}", words, part
    for text, part in _products(scope, form):
        yield "another", f"{here}->{text}", f"{code(node)} stands in place of {text}", part
    for key in scope.named(form) if not isinstance(node, ast.Name) else ():
        yield "another", f"{here}->{key}", f"{code(node)} stands in place of {scope.said(key)}", name(key)


def _products(scope: Scope, form: Form) -> Iterator[tuple[str, ast.expr]]:
    """Lengths and products of variables."""
    if form == ():
        for key in scope.vectors:
            yield f"the length of {scope.said(key)}", method(name(key), "norm")
            yield f"the squared length of {scope.said(key)}", method(name(key), "norm_sqr")
        for a, b in itertools.combinations(scope.vectors, 2):
            yield f"the dot product of {a} and {b}", method(name(a), "dot", name(b))
    if len(form) == 1:
        for a, b in itertools.product(scope.matrices, scope.vectors):
            yield (
                f"the product of the matrix {a} and the vector {b}",
                ast.BinOp(name(a), ast.MatMult(), name(b)),
            )
        for a, b in itertools.permutations(scope.vectors, 2):
            yield f"the cross product of {a} and {b}", method(name(a), "cross", name(b))


def counterparts(scope: Scope, node: ast.expr, form: Form) -> Found:
    """What a variable would be with another name or index in its definition."""
    given = scope.defined.get(node.id) if isinstance(node, ast.Name) else None
    for variant in scope.variants(given) if given is not None else ():
        words = f"{code(node)}{scope.context(node)} stands where its counterpart, with another name or index, belongs"
        yield "another", f"{text_of(node)}->>{text_of(variant)}", words, variant
