"""Kinds of slips in a formula, and their words."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

#: Makes a node into another one.
Change = Callable[..., Any]
Changes = Iterator[tuple[str, str, str, Change]]

#: Kinds of slips, the plainest first: what is said, and one next step. {place} is what a line computes.
WORDS: Mapping[str, tuple[str, str]] = {
    "sign": (
        "a sign is wrong in {place}{of}",
        "Write {place} down once more, and look at every sign.",
    ),
    "factors exchanged": (
        "the factors of {of} are in the wrong order in {place}",
        "Exchange them, and see what it changes: their order matters.",
    ),
    "exchanged": (
        "{of} have changed places in {place}",
        "Follow both through {place}, and compare with the formula.",
    ),
    "transposed": (
        "a transpose is missing in {place}, or one too many{of}",
        "Compare {place} with the formula: what is transposed there, and what is not?",
    ),
    "name": (
        "{of} in {place}",
        "Read {place} name by name, beside the formula.",
    ),
    "index": (
        "an index is wrong in {place}{of}",
        "Read {place} index by index: Python counts from 0.",
    ),
    "lacks": (
        "something is missing in {place}: {of}",
        "Compare {place} with the formula, term by term and factor by factor.",
    ),
    "number": (
        "a number is wrong in {place}: it looks like {of}",
        "Derive the numbers of {place} once more.",
    ),
    "power": (
        "a power is wrong in {place}{of}",
        "Check the unit of {place}: is everything squared that should be, and nothing else?",
    ),
    "length": (
        "{of} in {place}",
        "Check the unit of {place}: a length, a squared length, or a vector of length one?",
    ),
    "inverted": (
        "something is multiplied in {place} where it should be divided, or the other way round{of}",
        "Check the unit of {place}.",
    ),
    "inverse": (
        "an inverse is missing in {place}, or one too many{of}",
        "Write the equation down that {place} solves.",
    ),
    "entry by entry": (
        "`*` stands for another product in {place}: it multiplies entry by entry",
        "Matrices are multiplied with @, and vectors with dot, cross or outer_product.",
    ),
    "operation": (
        "{of} in {place}",
        "Read {place} operation by operation, beside the formula.",
    ),
    "brackets": (
        "brackets are missing in {place}, or set otherwise",
        "What is meant to be multiplied, divided or squared as a whole in {place}?",
    ),
    "entries": (
        "{of} in {place}",
        "Write down what belongs in each place of {place}, one by one.",
    ),
    "condition": (
        "the condition for {place} is not the right one{of}",
        "Take an input on each side of it, and one exactly on it: what should happen there?",
    ),
    "loop": (
        "the sum in {place} is not made as it should be: {of}",
        "Write its terms down one by one: which come in, and each how often?",
    ),
    "branches": (
        "{place} {of}",
        "Draw the triangle, number it from 0, and follow each branch.",
    ),
    "guard": (
        "a guard is missing, turned round, or one too many, in {place}{of}",
        "Ask for which inputs {place} needs to be kept from something, and for which not.",
    ),
    "extra": (
        "{of} comes in once too often in {place}",
        "Check the unit of {place}.",
    ),
    "another": (
        "{of} in {place}",
        "Read {place} part by part, beside the formula.",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Edit:
    """One thing changed in a function: at which nodes, how, and what it is called.

    Edits of one `kind` and one `shape` (the text around, but for its digits) are one slip when made together.
    """

    kind: str
    detail: str
    place: str
    of: str
    shape: str
    changes: Mapping[int, Change]
    line: str = ""
