"""What is told of a function that marches in steps: what its way there shows, where no change of its text is known."""

from __future__ import annotations

from dataclasses import replace

from muslin.grading.diagnosis.own import bare, repaired
from muslin.grading.diagnosis.question import Diagnosis
from muslin.judging import Seen
from muslin.reading.repairs import Repair


def watched(found: Diagnosis | None, change: Repair | None, seen: Seen | None) -> Diagnosis | None:
    """A diagnosis, and beside it the change that is needed, or what was seen on the way."""
    if change is not None or seen is None:
        return repaired(found, change)
    if found is None or found.cause.startswith("echo:"):
        return Diagnosis(f"on the way: {seen.cause}", told(seen), seen.advice)
    if bare(found.cause):
        return replace(found, mistake=f"{told(seen)} {found.mistake}", advice=seen.advice)
    return replace(found, mistake=f"{found.mistake} {told(seen)}")


def told(seen: Seen) -> str:
    """What was seen, as a sentence."""
    if seen.line:
        return f"Line {seen.line}: {seen.words}."
    return f"{seen.words[0].upper()}{seen.words[1:]}."
