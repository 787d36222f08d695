"""What the student's own text says beside the arrays: the line, and the one change that makes all of it right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from muslin.grading.diagnosis.question import Diagnosis
from muslin.grading.diagnosis.words import WORDS
from muslin.reading.repairs import Repair

#: Causes that say where an answer is wrong, or how far, and not what makes it so: by their first word.
BARE = (
    "component", "components", "entry", "row", "column", "where", "diagonal", "off", "third", "factor", "digits",
    "nan", "constant",
)  # fmt: skip

#: For each kind of slip in a right formula, the kinds of changes of a student's text that it may be.
ALIKE: Mapping[str, tuple[str, ...]] = {
    "sign": ("sign", "order", "turned"),
    "factors exchanged": ("order", "turned"),
    "exchanged": ("name", "index", "order"),
    "transposed": ("transposed", "order"),
    "name": ("name", "another", "index"),
    "index": ("index", "name", "another", "order"),
    "lacks": ("lacks factor", "lacks term", "another"),
    "number": ("number", "lacks factor", "extra", "name"),
    "power": ("power", "extra", "operation", "number"),
    "length": ("length", "operation"),
    "inverted": ("operation", "order"),
    "inverse": ("transposed", "operation"),
    "entry by entry": ("operation",),
    "operation": ("operation", "another", "odd"),
    "brackets": ("order",),
    "entries": ("order", "entries", "index", "name", "transposed"),
    "condition": ("condition", "name", "index", "another"),
    "loop": ("loop", "index", "number"),
    "branches": ("condition", "index", "number", "name"),
    "guard": ("condition", "number", "length"),
    "extra": ("extra", "number", "operation", "lacks factor"),
    "another": ("another", "name", "index", "extra"),
}

#: Kinds of slips that a search of a student's text does not miss: where it finds none, they are none of its own.
FOUND = ("sign", "name", "index", "factors exchanged")

ADVICE = "Hold that line against the formula. With this one thing changed, all public cases agree."
ADVICE_BOTH = "Hold those lines against the formula. With them changed, all public cases agree."


def agrees(cause: str, change: Repair | None) -> bool:
    """Whether a slip in a right formula may be the change that makes the student's text right."""
    kind, _, place = cause.partition(": ")
    if change is None or change.more or kind not in ALIKE:
        return True
    if change.kind in ("another", "where") and place and place in (change.place, change.called):
        return True
    if change.kind in ("where", "nothing"):
        return kind not in FOUND
    return change.kind in ALIKE[kind]


def bare(cause: str) -> bool:
    """Whether a cause says no more than where something is wrong."""
    return cause.split(": ")[-1].split(" ")[0].split(":")[0] in BARE


def repaired(found: Diagnosis | None, change: Repair | None) -> Diagnosis | None:
    """A diagnosis, and beside it what the student's own text shows."""
    if change is None or change.kind == "nothing":
        return found
    own, advice = change.sentence, ADVICE_BOTH if change.more else ADVICE
    if found is None:
        return Diagnosis(f"in the text: {change.kind}", own, advice)
    if bare(found.cause):
        return replace(found, mistake=f"{own} {found.mistake}", advice=advice)
    plain = found.mistake.startswith("Your ") and found.cause.split(":")[0] in WORDS
    if (plain or found.mistake.startswith("Most likely")) and not made(change):
        return replace(found, mistake=f"{own} {found.mistake}")
    return replace(found, mistake=f"{found.mistake} {own}")


def made(change: Repair) -> bool:
    """Whether what belongs in a place is made to fit: then what is known of the mistake says more."""
    return change.detail.startswith("made ")
