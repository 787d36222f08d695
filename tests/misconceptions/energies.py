"""Mistakes in the energy of a variant: ways people write it, and what a slip or a wrong idea makes of each.

Written without a look at how mistakes are named (`muslin.authoring.edits`, `muslin.reading.repairs`): the ways are of
students, not of `strain_energy.py`, and the changes are made by this file. A slip may be made once, or wherever the
same stands in a function, as somebody does who has the formula wrong and not one letter.
"""

from __future__ import annotations

import ast
import copy
import random
import re
from collections.abc import Iterator

import numpy as np

from muslin import tasks
from muslin.authoring import mutations, variants
from muslin.base import paths
from muslin.grading.diagnosis import Diagnosis, diagnose
from muslin.grading.diagnosis.own import bare
from muslin.judging import reference
from muslin.reading.source import Source, read
from muslin.student import plain

#: Ways to write the three functions: energy -> task -> bodies, with mu and lam.
WAYS: dict[str, dict[str, tuple[str, ...]]] = {
    "linearised": {
        "psi": (
            """
    a = s[0] - 1
    b = s[1] - 1
    return mu * (a * a + b * b) + 0.5 * lam * (a + b) ** 2
""",
        ),
        "dpsi_ds": (
            """
    tr = s[0] + s[1] - 2
    g = ti.Vector([0.0, 0.0, 0.0])
    for i in range(2):
        g[i] = 2 * mu * (s[i] - 1) + lam * tr
    return g
""",
        ),
        "d2psi_ds2": (
            """
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    H[0, 0] = 2 * mu + lam
    H[1, 1] = 2 * mu + lam
    H[0, 1] = lam
    H[1, 0] = lam
    return H
""",
        ),
    },
    "green": {
        "psi": (
            """
    e0 = 0.5 * (s[0] * s[0] - 1)
    e1 = 0.5 * (s[1] * s[1] - 1)
    tr = e0 + e1
    return mu * (e0 * e0 + e1 * e1) + 0.5 * lam * tr * tr
""",
            """
    squares = 0.0
    total = 0.0
    for i in range(2):
        e = (s[i] ** 2 - 1) / 2
        squares += e**2
        total += e
    return mu * squares + lam / 2 * total**2
""",
        ),
        "dpsi_ds": (
            """
    tr = 0.5 * (s[0] ** 2 + s[1] ** 2) - 1
    g0 = mu * (s[0] ** 3 - s[0]) + lam * tr * s[0]
    g1 = mu * (s[1] ** 3 - s[1]) + lam * tr * s[1]
    return ti.Vector([g0, g1, 0.0])
""",
            """
    e = ti.Vector([(s[0] ** 2 - 1) / 2, (s[1] ** 2 - 1) / 2])
    g = ti.Vector([0.0, 0.0, 0.0])
    for i in range(2):
        g[i] = (2 * mu * e[i] + lam * (e[0] + e[1])) * s[i]
    return g
""",
        ),
        "d2psi_ds2": (
            """
    tr = 0.5 * (s[0] ** 2 + s[1] ** 2) - 1
    h00 = mu * (3 * s[0] ** 2 - 1) + lam * (tr + s[0] ** 2)
    h11 = mu * (3 * s[1] ** 2 - 1) + lam * (tr + s[1] ** 2)
    h01 = lam * s[0] * s[1]
    return ti.Matrix([[h00, h01, 0], [h01, h11, 0], [0, 0, 0]])
""",
            """
    e0 = (s[0] * s[0] - 1) / 2
    e1 = (s[1] * s[1] - 1) / 2
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    H[0, 0] = (2 * mu + lam) * s[0] ** 2 + 2 * mu * e0 + lam * (e0 + e1)
    H[1, 1] = (2 * mu + lam) * s[1] ** 2 + 2 * mu * e1 + lam * (e0 + e1)
    H[0, 1] = lam * s[0] * s[1]
    H[1, 0] = H[0, 1]
    return H
""",
        ),
    },
    "green-area": {
        "psi": (
            """
    e0 = 0.5 * (s[0] * s[0] - 1)
    e1 = 0.5 * (s[1] * s[1] - 1)
    J = s[0] * s[1]
    return mu * (e0 * e0 + e1 * e1) + 0.5 * lam * (J - 1) * (J - 1)
""",
            """
    shape = mu / 4 * ((s[0] ** 2 - 1) ** 2 + (s[1] ** 2 - 1) ** 2)
    area = lam / 2 * (s[0] * s[1] - 1) ** 2
    return shape + area
""",
        ),
        "dpsi_ds": (
            """
    e0 = (s[0] ** 2 - 1) / 2
    e1 = (s[1] ** 2 - 1) / 2
    J = s[0] * s[1]
    return ti.Vector([2 * mu * e0 * s[0] + lam * (J - 1) * s[1], 2 * mu * e1 * s[1] + lam * (J - 1) * s[0], 0.0])
""",
            """
    g = ti.Vector([0.0, 0.0, 0.0])
    for i in range(2):
        g[i] = mu * (s[i] ** 3 - s[i]) + lam * (s[0] * s[1] - 1) * s[1 - i]
    return g
""",
        ),
        "d2psi_ds2": (
            """
    h00 = 3 * mu * s[0] ** 2 - mu + lam * s[1] ** 2
    h11 = 3 * mu * s[1] ** 2 - mu + lam * s[0] ** 2
    h01 = lam * (s[0] * s[1] - 1) + lam * s[0] * s[1]
    return ti.Matrix([[h00, h01, 0.0], [h01, h11, 0.0], [0.0, 0.0, 0.0]])
""",
            """
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for i in range(2):
        j = 1 - i
        H[i, i] = mu * (3 * s[i] ** 2 - 1) + lam * s[j] ** 2
        H[i, j] = lam * (2 * s[0] * s[1] - 1)
    return H
""",
        ),
    },
    "neo-hookean": {
        "psi": (
            """
    d = s[0] - s[1]
    J = s[0] * s[1]
    return 0.5 * mu * d * d + 0.5 * (lam + mu) * (J - 1) ** 2
""",
            """
    k = mu + lam
    shape = (s[0] ** 2 + s[1] ** 2) / 2 - s[0] * s[1]
    area = (s[0] * s[1] - 1) ** 2 / 2
    return mu * shape + k * area
""",
        ),
        "dpsi_ds": (
            """
    d = s[0] - s[1]
    J = s[0] * s[1]
    k = lam + mu
    return ti.Vector([mu * d + k * (J - 1) * s[1], -mu * d + k * (J - 1) * s[0], 0.0])
""",
            """
    g = ti.Vector([0.0, 0.0, 0.0])
    for i in range(2):
        g[i] = mu * (s[i] - s[1 - i]) + (mu + lam) * (s[0] * s[1] - 1) * s[1 - i]
    return g
""",
        ),
        "d2psi_ds2": (
            """
    J = s[0] * s[1]
    h00 = mu + (lam + mu) * s[1] * s[1]
    h11 = mu + (lam + mu) * s[0] * s[0]
    h01 = -mu + (lam + mu) * (J - 1) + (lam + mu) * J
    return ti.Matrix([[h00, h01, 0.0], [h01, h11, 0.0], [0.0, 0.0, 0.0]])
""",
            """
    k = lam + mu
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    H[0, 0] = mu + k * s[1] ** 2
    H[1, 1] = mu + k * s[0] ** 2
    H[0, 1] = k * (2 * s[0] * s[1] - 1) - mu
    H[1, 0] = H[0, 1]
    return H
""",
        ),
    },
    "mixed": {
        "psi": (
            """
    d = s[0] - s[1]
    long = s[0] * s[0] + s[1] * s[1] - 2
    size = s[0] * s[1] - 1
    return 0.5 * mu * d * d + (lam + mu) / 16 * long * long + (lam + mu) / 4 * size * size
""",
        ),
        "dpsi_ds": (
            """
    k = (lam + mu) / 4
    long = s[0] ** 2 + s[1] ** 2 - 2
    size = s[0] * s[1] - 1
    g = ti.Vector([0.0, 0.0, 0.0])
    for i in range(2):
        j = 1 - i
        g[i] = mu * (s[i] - s[j]) + k * long * s[i] + 2 * k * size * s[j]
    return g
""",
        ),
        "d2psi_ds2": (
            """
    k = (lam + mu) / 4
    long = s[0] ** 2 + s[1] ** 2 - 2
    J = s[0] * s[1]
    h00 = mu + k * (long + 2 * s[0] ** 2 + 2 * s[1] ** 2)
    h11 = mu + k * (long + 2 * s[1] ** 2 + 2 * s[0] ** 2)
    h01 = -mu + k * (6 * J - 2)
    return ti.Matrix([[h00, h01, 0.0], [h01, h11, 0.0], [0.0, 0.0, 0.0]])
""",
        ),
    },
}

#: Wrong ways to make mu and lam of what is handed on: parameters -> (what, line).
CONVERSIONS: dict[str, tuple[tuple[str, str], ...]] = {
    "lame": (),
    "young": (
        ("lam of the volume", "    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))\n"),
        ("mu without the 2", "    mu, lam = E / (1 + nu), E * nu / (1 - nu**2)\n"),
        ("E and nu taken for mu and lam", "    mu, lam = E, nu\n"),
        ("1 - nu in mu", "    mu, lam = E / (2 * (1 - nu)), E * nu / (1 - nu**2)\n"),
        ("nu missing in lam", "    mu, lam = E / (2 * (1 + nu)), E / (1 - nu**2)\n"),
        ("nu not squared", "    mu, lam = E / (2 * (1 + nu)), E * nu / (1 - nu)\n"),
        ("1 + nu squared", "    mu, lam = E / (2 * (1 + nu)), E * nu / (1 + nu**2)\n"),
        ("no bracket around 2 (1 + nu)", "    mu, lam = E / 2 * (1 + nu), E * nu / (1 - nu**2)\n"),
    ),
    "bulk": (
        ("kappa taken for lam", "    lam = kappa\n"),
        ("kappa plus mu", "    lam = kappa + mu\n"),
        ("2/3 as of a volume", "    lam = kappa - 2 * mu / 3\n"),
        ("twice mu", "    lam = kappa - 2 * mu\n"),
        ("mu minus kappa", "    lam = mu - kappa\n"),
    ),
    "halves": (
        ("C and D taken for mu and lam", "    mu, lam = C, D\n"),
        ("C taken for mu", "    mu, lam = C, 2 * D\n"),
        ("D taken for lam", "    mu, lam = 2 * C, D\n"),
        ("halved once more", "    mu, lam = C / 2, D / 2\n"),
        ("exchanged", "    mu, lam = 2 * D, 2 * C\n"),
    ),
}

SWAPS = {"mu": "lam", "lam": "mu", "e0": "e1", "e1": "e0", "e_0": "e_1", "e_1": "e_0", "a": "b", "b": "a",
         "h00": "h11", "h11": "h00"}  # fmt: skip


def mutants(text: str) -> Iterator[tuple[str, str]]:
    """What is wrong, and a function with that wrong: each slip once, and the same slip wherever the same stands."""
    tree = ast.parse(text)
    seen = {ast.unparse(tree)}
    groups: dict[tuple[str, str], list[int]] = {}
    nodes = list(ast.walk(tree))
    for k, node in enumerate(nodes):
        if any(
            node is inner
            for outer in nodes
            if isinstance(outer, ast.Subscript)
            for inner in ast.walk(outer.slice)
        ):
            continue  # an index: the stretches are exchanged as a whole
        for kind, _ in _slips(node):
            groups.setdefault((kind, _alike(node)), []).append(k)
    for (kind, _), where in groups.items():
        often = [where] if len(where) > 1 and kind.split()[0] not in ("third", "number") else []
        for each in (*([k] for k in where), *often):
            made = copy.deepcopy(tree)
            copies = list(ast.walk(made))
            outer = {id(child): parent for parent in copies for child in ast.iter_child_nodes(parent)}
            for k in sorted(each, reverse=True):
                new = dict(_slips(copies[k]))[kind]
                _put(outer[id(copies[k])], copies[k], new)
            written = ast.unparse(ast.fix_missing_locations(made))
            if written not in seen:
                seen.add(written)
                what = f"{kind}: {ast.unparse(nodes[each[0]])}" + (" everywhere" if len(each) > 1 else "")
                yield what, written
    yield from ((what, new) for what, new in _whole(text) if new not in seen)


def _put(parent: ast.AST, old: ast.AST, new: ast.AST) -> None:
    for field, value in ast.iter_fields(parent):
        if value is old:
            setattr(parent, field, new)
        elif isinstance(value, list):
            setattr(parent, field, [new if entry is old else entry for entry in value])


def _alike(node: ast.AST) -> str:
    """What a node is, which of the two stretches it is about left aside."""
    text = ast.unparse(node)
    return re.sub(r"\b([eghp]_?)[01]\b", r"\1", re.sub(r"\[[01ij]\]|\[1 - i\]", "[]", text))


def _slips(node: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """What may stand in the place of a node, by a word for it."""
    c = copy.deepcopy
    if isinstance(node, ast.BinOp):
        left, right, op = node.left, node.right, node.op
        if isinstance(op, (ast.Add, ast.Sub)):
            yield "sign", ast.BinOp(c(left), ast.Sub() if isinstance(op, ast.Add) else ast.Add(), c(right))
            yield "last term missing", c(left)
            yield (
                "first term missing",
                c(right) if isinstance(op, ast.Add) else ast.UnaryOp(ast.USub(), c(right)),
            )
        if isinstance(op, ast.Mult):
            yield "last factor missing", c(left)
            yield "first factor missing", c(right)
            if isinstance(left, ast.BinOp) and isinstance(left.op, (ast.Add, ast.Sub)):
                yield (
                    "bracket lost",
                    ast.BinOp(c(left.left), c(left.op), ast.BinOp(c(left.right), ast.Mult(), c(right))),
                )
            if isinstance(right, ast.BinOp) and isinstance(right.op, (ast.Add, ast.Sub)):
                yield (
                    "bracket lost",
                    ast.BinOp(ast.BinOp(c(left), ast.Mult(), c(right.left)), c(right.op), c(right.right)),
                )
            if isinstance(left, ast.Subscript) and isinstance(right, ast.Subscript):
                yield "sum for product", ast.BinOp(c(left), ast.Add(), c(right))
        if isinstance(op, ast.Div):
            yield "divisor missing", c(left)
            yield "times for divided by", ast.BinOp(c(left), ast.Mult(), c(right))
        if isinstance(op, ast.Pow):
            yield "power missing", c(left)
            yield "power too high", ast.BinOp(c(left), ast.Pow(), ast.Constant(right.value + 1))
            if right.value == 3:
                yield "power too low", ast.BinOp(c(left), ast.Pow(), ast.Constant(2))
            if isinstance(left, ast.BinOp) and isinstance(left.op, (ast.Add, ast.Sub)):
                two = [ast.BinOp(c(part), ast.Pow(), c(right)) for part in (left.left, left.right)]
                yield "squares apart", ast.BinOp(two[0], c(left.op), two[1])
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "minus missing", c(node.operand)
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and node.value > 1:
        yield "number doubled", ast.Constant(node.value * 2)
        yield "number one more", ast.Constant(node.value + 1)
        yield "number halved", ast.Constant(node.value / 2)
    if isinstance(node, ast.Constant) and node.value == 0.5:
        yield "half twice", ast.Constant(0.25)
    if isinstance(node, ast.Name) and node.id in SWAPS and isinstance(node.ctx, ast.Load):
        yield f"{SWAPS[node.id]} for {node.id}", ast.Name(SWAPS[node.id], ast.Load())
    if isinstance(node, ast.Subscript) and ast.unparse(node) in ("s[0]", "s[1]"):
        k = node.slice.value  # type: ignore[attr-defined]
        yield "other stretch", ast.Subscript(c(node.value), ast.Constant(1 - k), ast.Load())
        yield "third stretch", ast.Subscript(c(node.value), ast.Constant(2), ast.Load())
        yield "minus one", ast.BinOp(c(node), ast.Sub(), ast.Constant(1))
    if isinstance(node, ast.Subscript) and ast.unparse(node) in ("s[1 - i]", "s[j]", "s[i]"):
        new = "i" if ast.unparse(node) != "s[i]" else "1 - i"
        yield "other stretch", ast.parse(f"s[{new}]", mode="eval").body


def _whole(text: str) -> Iterator[tuple[str, str]]:
    """Wrong ideas about the answer as a whole."""
    head, _, last = text.rstrip().rpartition("return ")
    if last.startswith("ti.Matrix("):
        rows = ast.parse(last, mode="eval").body.args[0].elts  # type: ignore[attr-defined]
        (a, c, _), (_, b, _) = ([ast.unparse(e) for e in row.elts] for row in rows[:2])
        for what, entries in {
            "coupling missing": (a, "0.0", "0.0", b, "0.0"),
            "coupling below missing": (a, c, "0.0", b, "0.0"),
            "diagonal exchanged": (b, c, c, a, "0.0"),
            "antisymmetric": (a, c, f"-{c}", b, "0.0"),
            "diagonal and coupling exchanged": (c, a, b, c, "0.0"),
            "something in the third corner": (a, c, c, b, "mu"),
            "a one in the third corner": (a, c, c, b, "1.0"),
        }.items():
            p, q, r, t, u = entries
            yield what, f"{head}return ti.Matrix([[{p}, {q}, 0.0], [{r}, {t}, 0.0], [0.0, 0.0, {u}]])\n"
    elif last.startswith("ti.Vector("):
        p, q, _ = (ast.unparse(e) for e in ast.parse(last, mode="eval").body.args[0].elts)  # type: ignore[attr-defined]
        for what, vector in {
            "components exchanged": (q, p, "0.0"),
            "first component twice": (p, p, "0.0"),
            "second component missing": (p, "0.0", "0.0"),
            "third component one": (p, q, "1.0"),
            "third component like the first": (p, q, "mu * (s[2] - s[0])"),
            "minus": (f"-({p})", f"-({q})", "0.0"),
        }.items():
            yield what, f"{head}return ti.Vector([{', '.join(vector)}])\n"
    elif head and "[" not in last[:1]:
        yield "doubled", f"{head}return 2 * ({last})\n"
        yield "third stretch added", f"{head}return {last} + mu * (s[2] - 1) ** 2\n"


def written(name: str, task: str) -> Iterator[tuple[str, str]]:
    """Mistakes in one of a variant's three tasks: what is wrong, and the function with that wrong.

    Parameters
    ----------
    name : str
        The variant; its own answer is mutated, too.
    task : str
    """
    choice = variants.chosen(name)
    entry = variants.Tables("cloth").parameters["parameters"][choice.parameters]
    line = entry.get("solution", "").lstrip("\n")
    function = copy.deepcopy(Source(read(paths.solution(name) / "strain_energy.py")).functions[task].node)
    function.decorator_list, function.body = [], function.body[1:]
    own = ast.unparse(function) + "\n"
    if line:
        own = own.replace(f"    {ast.unparse(ast.parse(line.strip()))}\n", line)
    head = f"def {task}(s, {', '.join(entry['names'])}):\n{line}"
    for way, text in enumerate([own, *(head + way.strip("\n") + "\n" for way in WAYS[choice.energy][task])]):
        for what, new in mutants(text):
            yield what, f"import taichi as ti\n\n\n@ti.func\n{new}\n"
        if line and way < 2:
            for what, wrong in CONVERSIONS[choice.parameters]:
                yield what, f"import taichi as ti\n\n\n@ti.func\n{text.replace(line, wrong)}\n"


def diagnosed(name: str, task: str, most: int) -> Iterator[tuple[str, str, Diagnosis | None]]:
    """Mistakes that are wrong and can be run, at most so many, drawn: what is wrong, the text, what is said of it."""
    table = tasks.assignment(name).tasks[task]
    inputs, expected = reference.cases(name, task)
    cases = [{key: plain.own(array[k]) for key, array in inputs.items()} for k in range(len(expected[0]))]
    every = list(written(name, task))
    size = np.abs(expected[0]).max()
    for what, text in random.Random(task).sample(every, min(most, len(every))):
        node = ast.parse(text).body[-1]
        assert isinstance(node, ast.FunctionDef)
        node.decorator_list = []
        with plain.looked_at() as names, np.errstate(all="ignore"):
            got = mutations.run(mutations.compiled(node, {}, names), cases, table)
        if got is None or np.allclose(got[0], expected[0], rtol=1e-9, atol=1e-9 * size):
            continue
        yield what, text, diagnose(table, tuple(got), expected, inputs, name, text)


def is_named(found: Diagnosis | None) -> bool:
    """Whether a diagnosis says what is wrong, or in which line, and not only in which cases or entries."""
    return found is not None and (not bare(found.cause) or "Line " in found.mistake)
