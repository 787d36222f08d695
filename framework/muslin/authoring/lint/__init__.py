"""What is still missing or wrong in an assignment, said before a student finds out.

`CHECKS` is the list of what is looked at, the quick ones first. Each finding is one line: where, what, what to do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from muslin import tasks
from muslin.authoring.lint.finding import Finding, Subject, of_error
from muslin.authoring.lint.judging import check_judges, check_laws, check_names
from muslin.authoring.lint.manifest import check_entries, check_hints, check_prerequisites
from muslin.authoring.lint.sharing import check_release, check_stubs, check_what_students_get, given_away
from muslin.authoring.lint.teaching import check_docstrings, check_handout, check_placeholders
from muslin.authoring.lint.trying import (
    check_misconceptions,
    check_reference,
    check_solutions,
    check_variants,
)
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks import MANIFEST

__all__ = ["CHECKS", "Finding", "given_away", "lint"]


def lint(name: str, thorough: bool = False) -> list[Finding]:
    """Look an assignment over.

    Parameters
    ----------
    name : str
        The assignment.
    thorough : bool
        Also make the reference run again, hold the laws, and try every variant of the misconception suite.

    Returns
    -------
    list of Finding
        Empty if nothing is to be fixed.

    Raises
    ------
    MuslinError
        If there is no such assignment, or no solutions here.
    """
    source = paths.solution(name)
    try:
        subject = Subject(name, tasks.read_assignment(source), thorough)
    except MuslinError as error:
        return [of_error(source / MANIFEST, error)]
    found: list[Finding] = []
    for title, check in CHECKS.items():
        try:
            found += check(subject)
        except MuslinError as error:
            found.append(of_error(title, error))
        if found and check is check_entries:
            break  # all other checks build on a sound manifest
    return list(dict.fromkeys(found))


#: What is looked at, in this order.
CHECKS: dict[str, Callable[[Subject], Iterator[Finding]]] = {
    "manifest": check_entries,
    "prerequisites": check_prerequisites,
    "hints": check_hints,
    "handout": check_handout,
    "docstrings": check_docstrings,
    "placeholders": check_placeholders,
    "released folder": check_release,
    "what students get": check_what_students_get,
    "what is known of tasks": check_names,
    "reference data": check_reference,
    "misconceptions": check_misconceptions,
    "stubs": check_stubs,
    "solution": check_solutions,
    "judges": check_judges,
    "laws": check_laws,
    "variants": check_variants,
}
