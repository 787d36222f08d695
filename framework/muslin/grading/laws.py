"""The laws that the functions of a submission must obey together, as the assignment's own `judge/` states them.

Runs in the grader, which asks for one function after the other.
"""

from __future__ import annotations

import numpy as np

from muslin.base.errors import MuslinError
from muslin.grading.record import FAILED, PASSED, SKIPPED, Check
from muslin.judging import Ask, Law
from muslin.judging.knowledge import known
from muslin.tasks import assignment as table_of
from muslin.tasks.wiring import asked


class Trouble(Exception):
    """A function that was right by itself gave no results here; the sentence says why."""


def obeyed(assignment: str, ask: Ask, usable: frozenset[str]) -> tuple[Check, ...]:
    """Hold the functions against the laws of an assignment.

    Parameters
    ----------
    assignment : str
    ask : Ask
        Gives the results of a function; raises `Trouble` where it cannot.
    usable : frozenset of str
        Tasks whose functions passed their own checks.
    """
    laws, specimen = known(assignment, "laws") or (), known(assignment, "specimen")
    ask = asked(table_of(assignment).tasks, ask)
    together = specimen(ask) if specimen is not None else ask
    return tuple(_obeyed(law, together, usable) for law in laws)


def _obeyed(law: Law, together: object, usable: frozenset[str]) -> Check:
    absent = [need for need in dict.fromkeys(law.needs) if need not in usable]
    if absent:
        return Check(law.name, "simulation", SKIPPED, f"skipped: it needs {', '.join(absent)}.")
    try:
        with np.errstate(all="ignore"):
            return judged(law.name, *law.error(together))
    except Trouble as trouble:
        return Check(law.name, "simulation", FAILED, str(trouble))
    except MuslinError:  # the grading itself cannot be done
        raise
    except Exception:
        return Check(
            law.name, "simulation", FAILED, "The results are not finite, or too large to compute with."
        )


def judged(name: str, error: float, tolerance: float) -> Check:
    """Whether something holds for all functions together."""
    if error <= tolerance:
        return Check(name, "simulation", PASSED, "holds.")
    return Check(name, "simulation", FAILED, f"does not hold{extent(error)}.")


def extent(error: float) -> str:
    """How far off something is, in words: numbers could carry hidden inputs out."""
    if not np.isfinite(error):
        return " (not finite)"
    return " (by a little: are digits lost?)" if error < 1e-5 else ""
