"""The whole answer, transformed: a sign, an order, a root, an argument that is merely handed back."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from muslin.grading.diagnosis.question import Diagnosis, Question, about
from muslin.judging.arrays import transposed, unit

Transform = Callable[[np.ndarray], np.ndarray]


def _inverse(matrix: np.ndarray) -> np.ndarray:
    try:
        return np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


#: As many rows are tried in every order; of more, those orders that people make.
MOST_ORDERS = 5


def _permutations(n: int) -> Iterator[tuple[int, ...]]:
    """Other orders of n things: all, or where these are too many, exchanged, moved on, reversed, column by column."""
    as_is = tuple(range(n))
    if n <= MOST_ORDERS:
        yield from (p for p in itertools.permutations(as_is) if p != as_is)
        return
    yield from (tuple({a: b, b: a}.get(k, k) for k in as_is) for a, b in itertools.combinations(as_is, 2))
    yield from (as_is[k:] + as_is[:k] for k in range(1, n))
    yield as_is[::-1]
    side = math.isqrt(n)
    if side * side == n:
        yield tuple(np.arange(n).reshape(side, side).T.ravel().tolist())


def _reordered(n: int, axis: int) -> Iterator[tuple[str, Transform]]:
    for p in _permutations(n):
        yield ",".join(map(str, p)), lambda a, p=p: np.take(a, p, axis=axis)  # type: ignore[misc]


#: Whole-answer mistakes by number of axes: (cause, transform). `_transformed` adds permutations.
TRANSFORMS: Mapping[str, tuple[tuple[int, ...], Transform]] = {
    "zeros": ((0, 1, 2), np.zeros_like),
    "whole numbers": ((0, 1, 2), np.trunc),
    "negated": ((0, 1, 2), np.negative),
    "transposed": ((2,), transposed),
    "negated and transposed": ((2,), lambda a: -transposed(a)),
    "absolute": ((0, 1, 2), np.abs),
    "clamped": ((0, 1, 2), lambda a: np.maximum(a, 0)),
    "between 0 and 1": ((0, 1, 2), lambda a: np.where(((a > 0) & (a < 1)).any(), np.clip(a, 0, 1), np.nan)),
    "normalised": ((1,), unit),
    "rows normalised": ((2,), unit),
    "squared": ((0, 1, 2), np.square),
    "root": ((0, 1, 2), np.sqrt),
    "inverse": ((0, 2), lambda a: _inverse(a) if a.ndim == 3 else 1 / a),
    "symmetrised": ((2,), lambda a: (a + transposed(a)) / 2),
    "diagonal only": ((2,), lambda a: a * np.eye(a.shape[-1])),
    "upper triangle only": ((2,), np.triu),
    "lower triangle only": ((2,), np.tril),
}


def _made(transform: Transform, array: np.ndarray) -> np.ndarray | None:
    """Answers transformed; None where they cannot be: a 4x3 matrix transposed is no answer."""
    try:
        made = transform(array)
    except ValueError:
        return None
    return made if made.shape == array.shape else None


def by_transform(question: Question) -> Diagnosis | None:
    """The whole answer, or what is asked of it, transformed; an argument handed back, added or left out."""
    for share, (cause, (axes, transform)) in itertools.product((1.0, 0.9), TRANSFORMS.items()):
        made = _made(transform, question.right) if len(question.shape) in axes else None
        if made is not None and question.explained(made, share):
            return about(question, cause)
    if not question.entries.all():
        return _copied(question)
    heads = {1: ("permuted",), 2: ("rows permuted", "columns permuted")}.get(len(question.shape), ())
    for axis, head in enumerate(heads, start=1):
        for order, transform in _reordered(question.shape[axis - 1], axis):
            if question.explained(transform(question.right)):
                return about(question, f"{head}:{order}", order)
    for name, array in question.inputs.items():
        if array.shape == question.got.shape and array.dtype.kind == "f":
            for cause, candidate in (
                ("echo", array),
                ("turned", -array),
                ("lacks", question.right - array),
                ("plus", question.right + array),
            ):
                if question.explained(candidate):
                    return about(question, f"{cause}:{name}", name)
    return None


def _copied(question: Question) -> Diagnosis | None:
    """A row, column or component that repeats another one."""
    for axis, size in enumerate(question.shape, start=1):
        place = {(1, 1): "component", (1, 2): "row", (2, 2): "column"}[axis, len(question.shape)]
        for k in range(size):
            if question.explained(np.take(question.right, [k] * size, axis=axis)):
                return about(question, f"copy:{k}", f"{place} {k}")
    return None


def constant(question: Question) -> Diagnosis | None:
    """The same for all inputs."""
    same = len(question.got) > 5 and question.explained(question.got[question.wrong][0])
    if not same or not np.ptp(question.right, axis=0).any():
        return None
    always = "" if question.shape else f": it is always {question.got[question.wrong][0]:g}"
    return about(question, "constant", always)
