"""Terms and factors that are missing, made of several names: `mu * (s[0] - 1) ** 2`, `U @ diag(p) @ dV.transpose()`.

Where it is known what an expression would have to come to (`muslin.grading.needs`), it is known what is missing in it,
as a term or as a factor. That is compared with products of what has a name there, a number in front.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from muslin.grading.making import Kit, known
from muslin.grading.needs import IMPOSSIBLE, Slope, Spread, Target
from muslin.reading.repairs import Repair
from muslin.reading.repairs.missing import takes_a_factor
from muslin.reading.repairs.pieces import code, text_of, times
from muslin.reading.repairs.scope import Scope

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: How closely what is missing must be met; largest numerator and denominator of the number in front.
NEAR, LARGEST = 1e-6, 12

#: Most numbers that are multiplied with each other, of two and of three; most
#: expressions looked at, and what is made of one that is worked out to the end.
PAIRED, TRIPLED, PLACES, MOST = 72, 20, 30, 4

#: Rows of a loop that is worked out at once by which a term is told not to fit.
ROWS = 24


@dataclass(frozen=True)
class Part:
    """An expression, what it comes to in some cases, and how many names it is made of."""

    text: str
    value: np.ndarray
    size: int = 1


def composed(search: Search) -> Iterator[Repair]:
    """Terms and factors that are missing, the shortest first."""
    scope = search.changes.scope
    found: list[Repair] = []
    nodes = [n for n in search.changes.valued() if not isinstance(n, ast.Constant)]
    places = [
        n for n in nodes if not scope.counted(n) and (not _summed(scope, n) or takes_a_factor(scope, n))
    ]
    for node in sorted(places, key=lambda n: len(text_of(n)))[:PLACES]:
        try:
            found += itertools.islice(_at(search, node), MOST)
        except IMPOSSIBLE:
            continue
    yield from sorted(found, key=lambda change: len(change.detail))


def _summed(scope: Scope, node: ast.AST) -> bool:
    outer = scope.parent(node)
    return isinstance(outer, ast.BinOp) and isinstance(outer.op, (ast.Add, ast.Sub))


def _at(search: Search, node: ast.expr) -> Iterator[Repair]:
    scope, slope = search.changes.scope, search.slope(node)
    factor = takes_a_factor(scope, node)
    if isinstance(slope, Spread):
        stands, needed, parts = _in_loop(search, node, slope)
        vectors: list[Part] = []
    elif isinstance(slope, (Slope, Target)):
        found = _wanted(search, node, slope)
        if found is None:
            return
        stands, needed = found
        kit = known(search, node)
        parts = [Part(one.text, one.value, one.size) for one in kit.all(())]
        vectors = _larger(kit, stands.shape[1:])
    else:
        return
    if not _summed(scope, node):
        for text in _made(needed - stands, parts, vectors):
            if not text.strip("-()").endswith(text_of(node)):  # of itself it is a factor
                yield _term(search, node, text)
    if factor and stands.ndim == 1 and (np.abs(stands) > 0).all():
        for text in _made(needed / stands, parts, []):
            part = ast.parse(text, mode="eval").body
            words = f"a factor is missing at {code(node)}: `{ast.unparse(part)}`"
            yield Repair(
                "lacks factor",
                f"composed *{text}",
                node.lineno,
                words,
                {id(node): times(scope.alias(node), part)},
            )


def _term(search: Search, node: ast.expr, text: str) -> Repair:
    part = ast.parse(text, mode="eval").body
    op: ast.operator = ast.Add()
    verb = "added"
    if isinstance(part, ast.UnaryOp):
        part, op, verb = part.operand, ast.Sub(), "subtracted"
    words = f"a term is missing in {code(node)}: `{ast.unparse(part)}` should be {verb}, and is left out"
    new = ast.BinOp(search.changes.scope.alias(node), op, part)
    return Repair("lacks term", f"composed {verb} {text}", node.lineno, words, {id(node): new})


def _wanted(search: Search, node: ast.expr, slope: Slope | Target) -> tuple[np.ndarray, np.ndarray] | None:
    """What an expression comes to in a few cases, and what it must; None if there is a choice."""
    few, form = search.few, search.changes.scope.form(node) or ()
    shape = (search.meaning.count, *form)
    stands = np.broadcast_to(np.asarray(search.meaning.values[id(node)], dtype=np.float64), shape)[few]
    if isinstance(slope, Target):
        return (stands, slope.value[few]) if slope.asked[few].all() else None
    rows = slope.rows[few][:, search.asked]
    if not np.isfinite(rows).all() or (np.linalg.matrix_rank(rows) < rows.shape[2]).any():
        return None
    return stands, slope.needed[few].reshape(stands.shape)


def _in_loop(search: Search, node: ast.expr, slope: Spread) -> tuple[np.ndarray, np.ndarray, list[Part]]:
    """The same in some passes of a loop that is worked out at once, with the numbers known there."""
    asked = search.usable[:, None] & search.asked & (np.abs(slope.rate) > 1e-9)
    wrong = np.argwhere(asked & search.wrong)
    right = np.argwhere(asked & ~search.wrong)
    some = np.concatenate(
        [wrong[:: max(1, 2 * len(wrong) // ROWS)], right[:: max(1, 2 * len(right) // ROWS)]]
    )
    case, entry = some[:, 0], some[:, 1]
    rows = slope.row[case, entry]
    stands = slope.value[rows]
    needed = stands + search.lacking[case, entry] / slope.rate[case, entry]
    parts = {}
    for text, value in search.meaning.numbers_in_loop(node, search.changes.scope.parts).items():
        if value.shape == slope.value.shape:
            parts[text] = Part(text, value[rows])
    counting = sorted(set(search.changes.scope.counting(node)))
    return stands, needed, [*parts.values(), *_deltas(search, node, counting, rows)]


def _deltas(search: Search, node: ast.expr, counting: list[str], rows: np.ndarray) -> Iterator[Part]:
    """One where two indices of the loops agree, or two pairs of them do."""
    values = search.meaning.counts_in_loop(node, counting)
    pairs = {(a, b): (values[a] == values[b])[rows] for a, b in itertools.combinations(values, 2)}
    for (a, b), same in pairs.items():
        yield Part(f"(1.0 if {a} == {b} else 0.0)", same.astype(float))
    for ((a, b), one), ((c, d), two) in itertools.combinations(pairs.items(), 2):
        if len({a, b, c, d}) == 4:
            yield Part(f"(1.0 if {a} == {b} and {c} == {d} else 0.0)", (one & two).astype(float))


def _made(lacking: np.ndarray, numbers: list[Part], larger: list[Part]) -> Iterator[str]:
    """Text of what comes to some values: a number times a product of others, or of them and a vector or matrix."""
    if not np.isfinite(lacking).all() or not lacking.any():
        return
    if lacking.ndim == 1:
        yield from _products(lacking, numbers)
        return
    flat = lacking.reshape(len(lacking), -1)
    square = (flat * flat).sum(axis=1)
    for part in larger:
        other = part.value.reshape(len(lacking), -1)
        across, own = (flat * other).sum(axis=1), (other * other).sum(axis=1)
        if (own <= 0).any() or (np.abs(across**2 - square * own) > NEAR * (square * own) + 1e-300).any():
            continue
        scale = across / own
        if (number := _number(scale)) is not None:
            yield _times(number, part.text)
            continue
        for text in itertools.islice(_products(scale, numbers), 1):
            minus = text.startswith("-(")
            made = f"{text[2:-1] if minus else text} * ({part.text})"
            yield f"-({made})" if minus else made


def _products(lacking: np.ndarray, numbers: list[Part]) -> Iterator[str]:
    """Numbers, products of two or three of them, and quotients, that come to some values but for a number in front."""
    if (number := _number(lacking)) is not None:
        yield _times(number, "")
        return
    usable = [p for p in numbers if np.isfinite(p.value).all() and np.abs(p.value).max() > 0]
    usable.sort(key=lambda p: p.size)
    if not usable:
        return
    for made in (_single, _double, _triple):
        hits = list(itertools.islice(made(lacking, usable), MOST))
        yield from (text for _, text in sorted(hits, key=lambda hit: (hit[0], len(hit[1]))))
        if hits:
            return


Hits = Iterator[tuple[bool, str]]


def _single(lacking: np.ndarray, parts: list[Part]) -> Hits:
    values = np.stack([part.value for part in parts])
    yield from _met(lacking, values, lambda k: parts[k].text)
    for power in (2, -1, 3, -2):
        yield from _met(lacking, values**power, lambda k, p=power: f"{parts[k].text} ** {p}")  # type: ignore[misc]


def _double(lacking: np.ndarray, parts: list[Part]) -> Hits:
    some = parts[:PAIRED]
    values, count = np.stack([part.value for part in some]), len(some)
    for power, written in (
        (1, "{} * {}"),
        (-1, "{} / {}"),
        (2, "{} * {} ** 2"),
        (-2, "{} / {} ** 2"),
        (-3, "{} / {} ** 3"),
    ):
        made = (values[:, None] * values[None] ** power).reshape(count * count, -1)

        def text(k: int, written: str = written) -> str:
            return written.format(some[k // count].text, some[k % count].text)

        yield from _met(lacking, made, text)


def _triple(lacking: np.ndarray, parts: list[Part]) -> Hits:
    some = parts[:TRIPLED]
    values, count = np.stack([part.value for part in some]), len(some)
    pairs = (values[:, None] * values[None]).reshape(count * count, -1)
    for power, sign in ((1, "*"), (-1, "/")):
        made = (pairs[:, None] * values[None] ** power).reshape(count**3, -1)

        def text(k: int, sign: str = sign) -> str:
            (a, b), c = divmod(k // count, count), k % count
            return f"{some[a].text} * {some[b].text} {sign} {some[c].text}"

        yield from _met(lacking, made, text)


def _met(lacking: np.ndarray, values: np.ndarray, text: Callable[[int], str]) -> Hits:
    """Which of some products come to the values, but for a number: whether there is one, and the text."""
    with np.errstate(all="ignore"):
        front = values @ lacking / (values * values).sum(axis=1)
        off = np.abs(front[:, None] * values - lacking).max(axis=1)
    for k in np.flatnonzero(off <= NEAR * np.abs(lacking).max()):
        number = _number(np.full(1, front[k]))
        if number is not None:
            yield abs(number) != 1, _times(number, text(int(k)))


def _number(values: np.ndarray) -> Fraction | None:
    """The simple number that all values are."""
    middle = float(np.median(values))
    if not np.isfinite(middle) or not middle or (np.abs(values - middle) > NEAR * abs(middle)).any():
        return None
    nearest = Fraction(middle).limit_denominator(LARGEST)
    simple = abs(nearest.numerator) <= LARGEST and abs(float(nearest) - middle) <= NEAR * abs(middle)
    return nearest if simple else None


def _times(number: Fraction, text: str) -> str:
    """A number times an expression, as people write it; a minus is the outermost of it."""
    front = str(abs(number)).replace("/", " / ")
    made = front if not text else text if abs(number) == 1 else f"{front} * {text}"
    return f"-({made})" if number < 0 else made


def _larger(kit: Kit, form: tuple[int, ...]) -> list[Part]:
    """Vectors or matrices of a shape, with products of matrices that hold a diagonal one."""
    if not form:
        return []
    found = [Part(one.text, one.value) for one in kit.all(form)]
    if len(form) != 2 or form[0] != form[1]:
        return found
    plain = [one for one in kit.plain.get(form, [])][:6]
    vectors = [one for one in kit.all(form[:1]) if "." not in one.text][:24]
    for v in vectors:
        for a, b in itertools.product(plain, repeat=2):
            scaled = a.value * v.value[:, None, :]
            found.append(
                Part(f"{a.text} @ diag({v.text}) @ {b.text}.transpose()", scaled @ b.value.swapaxes(1, 2))
            )
        for a in plain:
            found.append(Part(f"{a.text} @ diag({v.text})", a.value * v.value[:, None, :]))
    return (
        [*found, Part(f"ti.Matrix.identity(float, {form[0]})", np.eye(form[0]) + 0 * found[0].value)]
        if found
        else []
    )
