"""One self-contained HTML page for the student and the instructor: no scripts, nothing loaded from elsewhere.

What it looks like is in `report.html.j2`; here is what it says.
"""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from muslin.base.errors import MuslinError
from muslin.base.templates import filled
from muslin.grading.record import ERROR, FAILED, NOT_IMPLEMENTED, PASSED, SKIPPED, Record, TaskResult
from muslin.grading.views import energy_plot, story
from muslin.grading.views.text import capped, one_line, points

#: What a browser may do with the page: apply its own style, show the pictures in it, and nothing else.
POLICY = Markup(
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
)

#: Sign and colour of a status; the words say the same.
_SIGNS = {PASSED: "✓", FAILED: "✗", ERROR: "✗", NOT_IMPLEMENTED: "○", SKIPPED: "–"}
_TONES = {PASSED: "good", FAILED: "wrong", ERROR: "wrong", NOT_IMPLEMENTED: "open", SKIPPED: "quiet"}

#: How statuses are counted in the page's first sentence.
_COUNTED = {
    PASSED: "passed",
    FAILED: "not right yet",
    ERROR: "cannot be run",
    NOT_IMPLEMENTED: "not implemented yet",
}


def render(record: Record, quality: str = "good", counts: str = "", notes: Sequence[str] = ()) -> str:
    """The record as a page.

    Parameters
    ----------
    record : Record
    quality : {"draft", "good", "best", "none"}
        Of the pictures of the simulation; "none" leaves them out and starts no renderer.
    counts : str
        What counts in the end, where that is not the record's score.
    notes : sequence of str
        Why, to stand at the head of the page.
    """
    simulation = record.simulation
    ran = simulation.status != SKIPPED
    shown = ran or bool(simulation.positions)
    return filled(
        "grading/views/report",
        policy=POLICY,
        title=one_line(
            f"{record.assignment.get('title', '')}: {points(record.score)} of {points(record.max_score)}"
        ),
        record=record,
        counts=counts,
        notes=notes,
        counted=_counted(record),
        next=_next(record),
        numbered=list(story.numbered(record)),
        stand_ins=simulation.stand_ins[:50] if ran else (),
        plots=_plots(record) if shown else {},
        circumstances=_circumstances(record),
        **(_pictures(record, quality) if shown else _no_pictures()),
        # how it is said
        message=story.MESSAGE,
        output=story.OUTPUT,
        signs=_SIGNS,
        tones=_TONES,
        words=story.WORDS,
        opened=(FAILED, ERROR),
        untouched=NOT_IMPLEMENTED,
        points=points,
        share=_share,
        room=lambda task: max(float(task.max_score), 0.1),
        in_two=_in_two,
    )


def _share(task: TaskResult) -> str:
    part = task.score / task.max_score if task.max_score > 0 else 0
    return f"{100 * min(max(part, 0.0), 1.0):.1f}%"


def _in_two(message: str) -> tuple[str, str]:
    """The first line of a check's message, and the rest."""
    first, _, rest = message.partition("\n")
    return capped(first, story.MESSAGE), capped(rest, story.MESSAGE)


def _counted(record: Record) -> str:
    counts = Counter(task.status for task in record.tasks)
    return ", ".join(f"{counts[status]} {word}" for status, word in _COUNTED.items() if counts[status])


def _next(record: Record) -> dict[str, Any] | None:
    """Where to go on, if a task is left: what is begun comes first."""
    unfinished = [(k, task) for k, task in enumerate(record.tasks, 1) if task.status != PASSED]
    if not unfinished:
        return None
    begun = [(k, task) for k, task in unfinished if task.status != NOT_IMPLEMENTED]
    k, task = (begun or unfinished)[0]
    nothing = all(task.status == NOT_IMPLEMENTED for task in record.tasks)
    return {"k": k, "task": task, "verb": "Begin" if nothing else "Go on"}


def _no_pictures(why: str = "") -> dict[str, Any]:
    return {"pictures": [], "no_pictures": why}


def _pictures(record: Record, quality: str) -> dict[str, Any]:
    """Both bodies at the end of the simulation, or why they cannot be shown."""
    if quality == "none":
        return _no_pictures()
    try:
        from muslin.grading.views import pictures  # brings Taichi, which nothing else here needs
        from muslin.simulation import scenes

        yours, reference = pictures.draw(record, quality=quality)
    except MuslinError as error:
        return _no_pictures(capped(str(error), 500))
    except Exception as error:  # a report without pictures is better than none
        return _no_pictures(f"the renderer failed ({one_line(type(error).__name__)}).")
    scene = one_line(record.simulation.scene)
    word = scenes.get(record.simulation.scene).WORD
    said = (
        (
            "student",
            yours,
            f"Your {word}",
            f"The {word} at the end of the scene {scene}, with your functions",
        ),
        ("reference", reference, "The reference", f"The reference {word} at the end of the scene {scene}"),
    )
    return {
        "no_pictures": "",
        "folds": word == "cloth",
        "pictures": [
            {"key": key, "data": base64.b64encode(png).decode("ascii"), "caption": caption, "alt": alt}
            for key, png, caption, alt in said
        ],
    }


def _plots(record: Record) -> dict[str, list[energy_plot.Plot]]:
    """The plots of energies and of momenta, by their place on the page; without what was not recorded."""
    made = record.simulation
    groups = {}
    if made.energies or made.reference_energies:
        groups["energy-plot"] = energy_plot.plots(made.energies, made.reference_energies)
    if made.momenta or made.reference_momenta:
        groups["momentum-plot"] = energy_plot.momenta(
            made.energies, made.momenta, made.reference_energies, made.reference_momenta
        )
    return groups


def _circumstances(record: Record) -> list[tuple[str, str]]:
    entries = [*story.circumstances(record)]
    defences = record.safety.defences
    given = [name for name, there in defences.items() if there]
    missing = [name for name, there in defences.items() if not there]
    entries.append(("Defences", ", ".join(given) or "none"))
    if missing:
        entries.append(("Not available here", ", ".join(missing)))
    if "seconds" in record.timing:
        entries.append(("Time", f"{float(record.timing['seconds']):.1f} s"))
    files = [f"{name} {digest[:12]}" for name, digest in list(record.submission.files.items())[:50]]
    if files:
        entries.append(("Files", ", ".join(one_line(file, 120) for file in files)))
    return entries
