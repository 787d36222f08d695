"""Whose constants a submission is graded with, where each student has their own: those of who handed it in."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from muslin.base.text import one_line
from muslin.classes.finding import Submission
from muslin.classes.roster import Person
from muslin.grading.submission import Handed
from muslin.tasks import Assignment
from muslin.tasks.constants import Constants, plain


def assigned(handed: Handed, submission: Submission, people: Iterable[Person], table: Assignment) -> Handed:
    """What was handed in, with whose it is; or why that is not certain, and then it is not graded.

    A student may have typed any of the ids that the platform knows them by. Which one, the task file says; where that
    line is gone, its constants do. They are believed only of those who handed it in.
    """
    if table.constants is None or handed.unreadable or table.constants.file not in handed.files:
        return handed
    ids = list(_ids(submission, people))
    said = table.constants.whose(handed.files) or _by_constants(table.constants, handed, ids)
    if said in ids:
        return replace(handed, student=said)
    file, name = table.constants.file, one_line(submission.name, 80)
    if said:
        why = f"{file} has the constants of {one_line(said, 80)}, and {name} is not known by that."
    else:
        why = f"{file} does not have the constants of {name}, by any name known of them."
    hint = "Whom did it come from? Name the class with --roster, or grade it by itself: muslin grade --student ID"
    return replace(handed, unreadable=f"{why} {hint}")


def _by_constants(constants: Constants, handed: Handed, ids: Iterable[str]) -> str:
    text = handed.files[constants.file].decode("utf-8", "replace")
    return next((one for one in ids if constants.said(one) in text), "")


def _ids(submission: Submission, people: Iterable[Person]) -> Iterable[str]:
    """All that those who handed it in are known by, as constants are drawn from."""
    known = [word for student in submission.students for word in (student.id, student.name)]
    known += [word for person in people for word in (*person.logins, *person.numbers)]
    for word in filter(None, known):
        yield plain(word)
        yield plain(word).partition("@")[0]
