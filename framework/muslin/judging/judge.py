"""All that is known of one task, found by assignment and name, and put together from its files."""

from __future__ import annotations

import functools
from dataclasses import replace
from types import ModuleType
from typing import Any

from muslin import tasks
from muslin.base import paths
from muslin.judging import measured
from muslin.judging.knowledge import modules, said
from muslin.judging.parts import PARTS, Judge
from muslin.judging.wired import wired
from muslin.tasks.authored import AuthorError, guarded

#: What the parts of a judge are that are no functions.
FORMS = {
    "properties": "a tuple of Property (one alone needs a comma after it)",
    "mistakes": "a tuple of Mistake (one alone needs a comma after it)",
    "said": "a table: cause -> (mistake, advice)",
    "derivative": "a Derivative",
}


def judge(assignment: str, task: str) -> Judge:
    """All that is known here of a task; on a student's machine that is what `practice/` and the public data say.

    Its functions are the author's, `guarded`: what goes wrong in one is told as theirs.

    Raises
    ------
    AuthorError
        If a file of the assignment cannot be run.
    """
    found = _judge(modules(assignment), task)
    if not any(place(assignment).is_dir() for place in (paths.assignment, paths.source)):
        return found
    entry = tasks.assignment(assignment).tasks.get(task)
    if entry is None:
        return found
    found = wired(found, entry)
    return found if found.terms is not None else replace(found, terms=measured.terms(assignment, entry))


@functools.lru_cache(maxsize=256)
def _judge(files: tuple[ModuleType, ...], task: str) -> Judge:
    found = {}
    for part in PARTS:
        file, value = said(files, f"{part}_{task}")
        if value is not None:
            found[part] = _guarded(part, task, value, file)
    return Judge(**found)


def _guarded(part: str, task: str, value: Any, file: str) -> Any:
    """A part of a judge whose functions tell what goes wrong in them."""
    words = f"{part}_{task}"
    try:
        if part == "properties":
            return tuple(
                replace(
                    prop,
                    inputs=guarded(prop.inputs, f"the property {prop.name!r} of {task}", file),
                    judge=guarded(prop.judge, f"the property {prop.name!r} of {task}", file),
                )
                for prop in value
            )
        if part == "mistakes":
            return tuple(
                replace(
                    mistake, makes=guarded(mistake.makes, f"the mistake {mistake.cause!r} of {task}", file)
                )
                for mistake in value
            )
        if part == "said":
            return {cause: (mistake, advice) for cause, (mistake, advice) in value.items()}
        if part == "derivative":
            return replace(value, line=guarded(value.line, words, file))
    except (TypeError, ValueError, AttributeError):
        raise AuthorError(paths.shown(file), f"{words} is not {FORMS[part]}") from None
    if not callable(value):
        raise AuthorError(paths.shown(file), f"{words} is not a function")
    return guarded(value, words, file)
