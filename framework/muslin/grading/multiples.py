"""Expressions that are right but for a factor: a number, or powers of the function's own numbers."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from muslin.grading.needs import Slope, Spread
from muslin.reading.repairs import Repair
from muslin.reading.repairs.missing import takes_a_factor
from muslin.reading.repairs.pieces import code, factors, name, number, product, text_of, times

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: How closely a factor must be met in every case; largest numerator and denominator of a number, and of a power.
NEAR, LARGEST, POWER = 1e-6, 48, 3


def multiples(search: Search) -> Iterator[Repair]:
    """Factors that are missing, read off from what an expression would have to be."""
    scope = search.changes.scope
    for node in search.changes.valued():
        if not takes_a_factor(scope, node) or (lacking := _factors(search, node)) is None:
            continue
        for text, part in _made(search, node, lacking):
            if isinstance(node, ast.Name) and (rest := _without(part, node.id)) is not None:
                words = f"{code(node)} stands in place of {code(rest)}"
                yield Repair("another", f"{node.id}->{code(rest)}", node.lineno, words, {id(node): rest})
                continue
            words = f"a factor of {text} is missing at {code(node)}"
            if isinstance(part, ast.Name):
                words = f"a factor is missing at {code(node)}: {scope.said(part.id)}"
            elif text_of(part).endswith(" ** (-1)"):
                words = f"a division is missing at {code(node)}: by {scope.said(text_of(part).split()[0])}"
            new = times(part, scope.alias(node))
            yield Repair("lacks factor", f"{text}*{code(node)}", node.lineno, words, {id(node): new})


def _without(part: ast.expr, key: str) -> ast.expr | None:
    """What is left of a product beside the inverse of a name; None if that is no factor of it."""
    every = factors(part, ast.Mult)
    rest = [one for one in every if text_of(one) != f"{key} ** (-1)"]
    return product(rest, ast.Mult) if rest and len(rest) < len(every) else None


def _factors(search: Search, node: ast.expr) -> np.ndarray | None:
    """The number an expression must be multiplied by in each case, NaN where any will do; None if there is none."""
    slope = search.slope(node)
    if isinstance(slope, Slope):
        effect = np.einsum("bmp,bp->bm", slope.rows, slope.value)
    elif isinstance(slope, Spread):
        effect = slope.rate * slope.value[slope.row]
    else:
        return None
    asked = search.usable[:, None] & search.asked
    effect, lacking = np.where(asked, effect, 0.0), np.where(asked, search.lacking, 0.0)
    square = np.sum(effect**2, axis=1)
    some = square > 0
    change = np.sum(effect * lacking, axis=1) / np.where(some, square, 1.0)
    off = np.abs(effect * change[:, None] - lacking)
    if not some.any() or not (off <= NEAR * (1 + np.abs(lacking))).all():
        return None
    return np.where(some, 1 + change, np.nan)


def _made(search: Search, node: ast.expr, factors: np.ndarray) -> Iterator[tuple[str, ast.expr]]:
    """A number that the factors are, or powers of one or two numbers of the function."""
    known = np.isfinite(factors) & (np.abs(factors) > 1e-12)
    if known.sum() < 3:
        return
    right = np.log(np.abs(factors[known]))
    if np.ptp(right) <= NEAR:
        if (made := _number(factors[known])) is not None:
            yield str(Fraction(made).limit_denominator(LARGEST)), number(made)
        return
    symbols = _symbols(search, node, known)
    for names in itertools.chain(itertools.combinations(symbols, 1), itertools.combinations(symbols, 2)):
        columns = np.stack([np.ones(known.sum()), *(symbols[key] for key in names)], axis=1)
        if known.sum() <= columns.shape[1] + 1 or np.linalg.matrix_rank(columns) < columns.shape[1]:
            continue
        found = np.linalg.lstsq(columns, right, rcond=None)[0]
        powers = [Fraction(float(power)).limit_denominator(POWER) for power in found[1:]]
        if not all(powers) or max(map(abs, powers)) > POWER:
            continue
        exact = columns[:, 1:] @ np.array([float(power) for power in powers])
        scale = _number(factors[known] / np.exp(exact))
        if scale is None:
            continue
        part: ast.expr | None = None if scale == 1 else number(scale)
        for key, power in zip(names, powers, strict=True):
            base: ast.expr = name(key)
            if power != 1:
                base = ast.BinOp(
                    base, ast.Pow(), number(int(power) if power.denominator == 1 else float(power))
                )
            part = base if part is None else times(part, base)
        if part is not None:
            yield code(part), part


def _number(values: np.ndarray) -> float | None:
    """The simple number that all values are."""
    middle = float(np.median(values))
    if (np.abs(values - middle) > NEAR * abs(middle)).any():
        return None
    nearest = Fraction(middle).limit_denominator(LARGEST)
    simple = abs(nearest.numerator) <= LARGEST and abs(float(nearest) - middle) <= NEAR * abs(middle)
    return float(nearest) if simple and nearest != 1 else (1.0 if nearest == 1 else None)


def _symbols(search: Search, node: ast.expr, known: np.ndarray) -> dict[str, np.ndarray]:
    """Logarithms of the positive numbers that have a name where a node stands."""
    found = {}
    for key in search.changes.scope.named(()):
        value = search.meaning.here.get(id(node), search.meaning.before[-1]).get(key)
        if value is None or not np.ndim(value) or len(value) != len(known) or key in search.meaning.integers:
            continue
        some = np.asarray(value, dtype=np.float64)[known]
        if (some > 0).all() and np.ptp(some) > 1e-9 * np.abs(some).max():
            found[key] = np.log(some)
    return found
