"""Right in part: some entries of the answer, or some of the cases; and what is wrong with the others."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from muslin.grading.diagnosis.factors import scaled, sized
from muslin.grading.diagnosis.question import Diagnosis, Question, about, first
from muslin.grading.diagnosis.whole import by_transform
from muslin.judging.arrays import lengths as norm
from muslin.judging.arrays import transposed
from muslin.judging.reference import TOLERANCE

#: What is looked for in a part.
WITHIN = (by_transform, scaled, sized)


def conditions(question: Question) -> Iterator[tuple[str, Any]]:
    """Natural conditions on a case, by which right and wrong ones may be told apart: (words, (b,) of bool)."""
    yield from question.known.conditions
    a = question.inputs
    kinds: dict[str, list[str]] = {}
    for value in question.task.inputs:
        kinds.setdefault(value.kind, []).append(value.name)
    for p, q in itertools.combinations(kinds.get("int", []), 2):
        yield f"{p} = {q}", a[p] == a[q]
    for name in kinds.get("int", []):
        for k in range(3):
            yield f"{name} = {k}", a[name] == k
    vectors = kinds.get("vec3", [])
    for name in vectors:
        yield f"{name} = 0", ~a[name].any(axis=1)
    if len(vectors) == 2:
        p, q = vectors
        product, distance = np.sum(a[p] * a[q], axis=1), norm(a[p] - a[q])
        yield f"{p} = {q}", distance == 0
        yield f"{p} . {q} < 0", product < 0
        yield f"{p} . {q} <= 0", product <= 0
        yield f"{p} . {q} = 0", product == 0
        for name in kinds.get("scalar", []):
            yield f"|{p} - {q}| = {name}", distance == a[name]
            yield f"|{p} - {q}| < {name}", distance < a[name]
            yield f"|{p} - {q}| <= {name}", distance <= a[name]
    for name in kinds.get("scalar", []):
        yield f"{name} < 1", a[name] < 1
    for name in kinds.get("mat3", []):
        yield f"{name} is not symmetric", norm(a[name] - transposed(a[name])) > 1e-9 * norm(a[name])
        yield f"{name} is not a rotation", norm(a[name] @ transposed(a[name]) - np.eye(3)) > 1e-9
        yield f"det {name} < 0", np.linalg.det(a[name]) < 0
    flat = question.right.reshape(len(question.right), -1)
    yield "the right answer is negative somewhere", (flat < 0).any(axis=1)


#: Turns a condition round: the first phrase found is replaced.
OPPOSITES = (
    (" <= ", " > "),
    (" < ", " >= "),
    (" > ", " <= "),
    (" = ", " != "),
    (" is not ", " is "),
    (" lies off ", " lies in "),
    (" somewhere", " nowhere"),
    (" is ", " is not "),
    (" are different ", " are the same "),
)


def opposite(words: str) -> str:
    """A condition turned round, in words."""
    for phrase, turned in OPPOSITES:
        if phrase in words:
            return words.replace(phrase, turned)
    return f"it is not so that {words}"


def somewhere(question: Question) -> Diagnosis | None:
    """Wrong in some cases only, which a condition tells apart."""
    wrong = question.wrong
    entries = ~np.isclose(question.got, question.right, rtol=1e-9, atol=0).all(axis=0) & question.entries
    told = wrong | question.whole  # where the answer is zero anyway, being right means little
    told |= norm(question.right[:, entries]) > 0
    if wrong[told].all():
        return None
    for words, holds in conditions(question):
        for phrase, where in ((words, holds), (opposite(words), ~holds)):
            if (where[told] == wrong[told]).all():
                inner = None if question.whole else first(question.at(wrong), (*WITHIN, partly))
                found = about(question, f"where {phrase}", phrase, "where")
                return within(found, inner, f"where {phrase}", question.name)
    return None


def parts(shape: tuple[int, ...]) -> Iterator[tuple[str, str, str, np.ndarray]]:
    """Natural parts of an answer, the smaller first: (cause, head of its words, which, mask of entries)."""
    index = np.indices(shape)
    if len(shape) == 1:
        for count in range(1, shape[0]):
            for chosen in itertools.combinations(range(shape[0]), count):
                which = ",".join(map(str, chosen))
                head = "component" if count == 1 else "components"
                yield f"{head} {which}", head, which, np.isin(index[0], chosen)
    if len(shape) == 2:
        i, j = index
        for k, m in np.ndindex(*shape):
            yield f"entry {k},{m}", "entry", f"[{k}, {m}]", (i == k) & (j == m)
        for axis, head in enumerate(("row", "column")):
            for k in range(shape[axis]):
                yield f"{head} {k}", head, str(k), index[axis] == k
        yield "diagonal", "diagonal", "", i == j
        yield "third row and column", "third row and column", "", (i == 2) | (j == 2)
        yield "off the diagonal", "off the diagonal", "", i != j


def partly(question: Question) -> Diagnosis | None:
    """One row, column or component is wrong and the rest is right."""
    error = np.abs(question.got - question.right)
    reach = question.scale.reshape(-1, *[1] * len(question.shape))
    wrong = (~(error <= TOLERANCE * reach)).any(axis=0) & question.entries
    for cause, head, which, mask in parts(question.shape):
        if not (wrong & ~mask).any() and (question.entries & ~mask).any():
            inner = first(replace(question, entries=mask & question.entries), WITHIN)
            return within(about(question, cause, which, head), inner, cause, question.name)
    return None


def some(question: Question) -> Diagnosis | None:
    """Some of the entries or some of the cases: whichever says more, the entries first."""
    found = [d for d in (partly(question), somewhere(question)) if d is not None]
    return next((d for d in found if ": " in d.cause), found[-1] if found else None)


#: Causes that say where an answer is wrong, and not what makes it so: by their first word.
PLACES = ("component", "components", "entry", "row", "column", "where", "diagonal", "off")


def some_alike(question: Question) -> Diagnosis | None:
    """Some of the entries or cases, where it is known what is wrong with them, too."""
    found = some(question)
    if found is None or ": " not in found.cause:
        return None
    return None if found.cause.split(": ")[-1].split(" ")[0] in PLACES else found


def within(outer: Diagnosis, inner: Diagnosis | None, place: str, name: str) -> Diagnosis:
    """What is wrong in a part, joined with which part it is."""
    if inner is None:
        return outer
    start = f"Your {name} "
    then = (
        f" it {inner.mistake.removeprefix(start)}"
        if inner.mistake.startswith(start)
        else f": {inner.mistake}"
    )
    return Diagnosis(f"{place}: {inner.cause}", f"{outer.mistake} There{then}", inner.advice)
