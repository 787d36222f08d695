"""Which assignment the submissions of a class answer, where that is another than the one they are graded as."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes.finding import Submission
from muslin.grading.choosing import listed
from muslin.grading.submission import Handed, named_by, texts
from muslin.grading.views.text import one_line
from muslin.tasks.guessing import another


def believed(handed: Handed, submission: Submission, table: tasks.Assignment) -> Handed:
    """What was handed in, with what its own manifest makes of it.

    It is not graded where that names another assignment that there is. A name that nobody has is only told.
    """
    try:
        name = named_by(submission.sources, submission.name)
    except MuslinError as error:
        note = f"{one_line(str(error))} It was graded as {table.name}."
        return replace(handed, about=replace(handed.about, notes=(*handed.about.notes, note)))
    if name is None or paths.bare(name) == table.name:
        return handed
    reason = (
        f"Its {tasks.MANIFEST} says that it answers {name}, and this class is graded as {table.name}. "
        f"Grade it with: muslin grade --assignment {name}"
    )
    return replace(handed, unreadable=reason)


def told(collected: Mapping[str, Handed], table: tasks.Assignment) -> list[str]:
    """Notes on submissions whose functions take what another assignment asks, and nowhere what this one does."""
    found: dict[str, list[str]] = {}
    for name, handed in collected.items():
        if not handed.unreadable and (other := another(texts(handed.files), table)):
            found.setdefault(other, []).append(name)
    return [
        f"{listed(names)}: by what the functions take, {other} is answered, and this class is graded as {table.name}. "
        f"Grade with: --assignment {other}"
        for other, names in found.items()
    ]
