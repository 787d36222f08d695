"""The one change by which a function that is right in all public cases keeps its properties, too.

Nothing tells what is right for the inputs of a property, but much must hold at once: a change counts that leaves every
public case right and breaks none of the properties. The text is read, never run.
"""

from __future__ import annotations

import ast
import itertools
import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.grading.diagnosis.marched import watched
from muslin.grading.diagnosis.question import Diagnosis
from muslin.grading.needs import IMPOSSIBLE
from muslin.grading.repairing import Search
from muslin.grading.stepped import unkept
from muslin.grading.telling import told
from muslin.judging import Given, Outputs, Property, judge, properties
from muslin.judging.reference import natural_scale
from muslin.reading.meaning import Meaning, Same
from muslin.reading.page import used
from muslin.reading.repairs import Repair
from muslin.reading.repairs.readable import ordinary
from muslin.reading.source import Source
from muslin.tasks import Task

#: Most changes that are tried, and most steps that may cost.
TRIED, SPENT = 4000, 250_000

#: Kinds of changes that are left out: where only rare inputs tell, too many of these only hide what is wrong.
LEFT_OUT = ("operation", "power", "brackets", "extra")

#: Kinds that are tried first, and last: where public cases are right it is mostly how a guard measures; another
#: condition or another name may switch it off.
FIRST, LAST = ("length",), ("condition", "name", "index")

#: What more inputs are drawn from, on which properties must hold after a change: few let too many through.
MORE = ("a", "b", "c", "d")

ADVICE = (
    "Hold that line against the formula. With this one thing changed, it holds, and all public cases agree."
)


def upheld(
    task: Task,
    expected: Sequence[np.ndarray],
    inputs: Given,
    drawn: Sequence[tuple[Property, Given]],
    outputs: Sequence[Outputs],
    assignment: str,
    text: str,
) -> Diagnosis | None:
    """Name the mistake behind a property that does not hold.

    Parameters
    ----------
    task : Task
    expected, inputs : arrays, (b, ...)
        The public cases, all of which are right.
    drawn : sequence of (Property, dict of ndarray)
        The properties with their inputs.
    outputs : sequence of tuple of ndarray
        What came of them.
    assignment : str
    text : str
        The student's file.

    Returns
    -------
    Diagnosis or None
        None if no change is found, or the text is not understood.
    """
    if not text:
        return None
    terms = judge(assignment, task.name).terms
    scales = [natural_scale(terms, right, inputs, k) for k, right in enumerate(expected)]
    if task.in_python:
        broken = next(
            pair
            for pair, part in zip(drawn, outputs, strict=True)
            if not properties.judge(*pair, part) <= pair[0].tolerance
        )
        return watched(None, *unkept(text, task, *broken, inputs, expected[0], scales[0], assignment))
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            came = [
                properties.judge(*pair, part) <= pair[0].tolerance
                for pair, part in zip(drawn, outputs, strict=True)
            ]
            more = [pair for seed in MORE for pair in properties.draw(assignment, task.name, seed)]
            change = _change(text, task.name, inputs, expected, scales, [*drawn, *more], came)
    except (MuslinError, RecursionError, *IMPOSSIBLE):
        return None
    return None if change is None else Diagnosis(f"in the text: {change.kind}", change.sentence, ADVICE)


def _change(
    text: str,
    name: str,
    inputs: Given,
    expected: Sequence[np.ndarray],
    scales: Sequence[np.ndarray],
    drawn: Sequence[tuple[Property, Given]],
    came: Sequence[bool],
) -> Repair | None:
    """The plainest change by which all properties hold that were drawn; the first ones did or did not, as it came."""
    if not ordinary(text):
        return None
    functions = {key: function.node for key, function in Source(text).functions.items()}
    search = Search(functions, name, inputs, expected, scales, lambda values, cases=None: "")
    if search.wrong.any() or search.meaning.widened:
        return None
    asked = [given for _, given in drawn]
    mine = {key: functions[key] for key in used(functions, name)}
    meaning = Meaning(mine, name, {key: properties.batch(asked)[key] for key in inputs})

    def held(results: Sequence[Any]) -> list[bool]:
        whole = tuple(
            np.broadcast_to(np.asarray(one, dtype=right.dtype), (meaning.count, *right.shape[1:]))
            for one, right in zip(results, expected, strict=True)
        )
        parts = properties.apart(whole, asked)
        return [
            properties.judge(*pair, part) <= pair[0].tolerance
            for pair, part in zip(drawn, parts, strict=True)
        ]

    if held(meaning.results)[: len(came)] != came:
        return None  # it is not read as it runs
    found: list[Repair] = []
    plain = [c for c in search.changes.plain() if c.kind not in LEFT_OUT or c.detail == "augmented"]
    plain.sort(key=lambda c: (c.kind not in FIRST) + (c.kind in LAST))
    for change in itertools.islice(plain, TRIED):
        if search.spent + meaning.spent > SPENT or (
            found and change.changes.keys() != found[0].changes.keys()
        ):
            break
        try:
            if _right(search, change) and all(held(meaning.otherwise(change.changes))):
                found.append(change)
        except IMPOSSIBLE:
            continue
    return told(search, min(found, key=_size)) if found else None


def _size(change: Repair) -> float:
    """Of several numbers that will do in one place: none at all first, and then the largest, which guards best."""
    (new,) = list(change.changes.values())[:1]
    try:
        size = abs(float(ast.literal_eval(new)))
    except (ValueError, TypeError):
        return math.inf
    return -size if size else -math.inf


def _right(search: Search, change: Repair) -> bool:
    """Whether a change leaves every public case right."""
    try:
        return search.is_right(change)
    except Same:
        return True
