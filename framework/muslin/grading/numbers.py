"""Numbers of a text that would be right if they were another one, the same in all cases: it is known which."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from muslin.grading.needs import NEAR, Slope, Spread, Target
from muslin.reading.repairs import Repair
from muslin.reading.repairs.pieces import number, ratio

if TYPE_CHECKING:
    from muslin.grading.repairing import Search


def numbers(search: Search) -> Iterator[Repair]:
    """Numbers of the text that would be right if they were another one, the same in all cases; whole ones first."""
    yield from sorted(
        _numbers(search), key=lambda change: not float(change.detail.split("->")[1]).is_integer()
    )


def _numbers(search: Search) -> Iterator[Repair]:
    scope = search.changes.scope
    for node in ast.walk(search.meaning.node):
        indexed = isinstance(scope.parent(node), (ast.Subscript, ast.Slice))
        if not isinstance(node, ast.Constant) or indexed or not scope.counts(node):
            continue
        stands, outer = node.value, scope.parent(node)
        if isinstance(stands, bool) or not isinstance(stands, (int, float)):
            continue
        slope = search.slope(node)
        if not isinstance(slope, (Slope, Target, Spread)):
            continue
        needed, asked = slope.value, getattr(slope, "asked", search.usable)
        if isinstance(slope, Spread):
            asked = search.usable[:, None] & search.asked & (np.abs(slope.rate) > 1e-9)
            needed = slope.value[slope.row] + search.lacking / np.where(asked, slope.rate, 1.0)
        elif isinstance(slope, Slope):
            needed, asked = slope.needed[:, 0], asked & (np.abs(slope.rows[:, :, 0]).max(axis=1) > 1e-9)
        if not asked.any():
            continue
        middle = float(np.median(needed[asked]))
        if (np.abs(needed[asked] - middle) <= NEAR * (abs(middle) + 1e-9)).all():
            nearest = Fraction(middle).limit_denominator(360)
            belongs = nearest.numerator if nearest.denominator == 1 else float(nearest)
            for other in dict.fromkeys((math.copysign(1, stands) * abs(belongs), belongs)):  # of squares both
                other = belongs if other == belongs else -belongs
                if other == 1 and isinstance(outer, ast.BinOp) and isinstance(outer.op, ast.Pow):
                    continue  # it is no power
                words = f"the number {stands:g}{scope.context(node)} is wrong{ratio(stands, other)}"
                yield Repair(
                    "number",
                    f"{stands}->{other}",
                    node.lineno,
                    words,
                    {id(node): number(float(other) if isinstance(stands, float) else other)},
                )
