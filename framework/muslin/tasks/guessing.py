"""Which assignment files answer, where nothing says so: by their names."""

from __future__ import annotations

import contextlib
from collections.abc import Collection

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks.manifest import Assignment, assignment

#: What is assumed where names tell nothing.
USUAL = "cloth"


def known() -> dict[str, Assignment]:
    """Every assignment there is, but those whose manifest cannot be read."""
    found = {}
    for name in paths.assignments():
        with contextlib.suppress(MuslinError):
            found[name] = assignment(name)
    return found


def fitting(files: Collection[str]) -> str | None:
    """The assignment most of whose task files are among these; None where there is none of any.

    Of two with as many it is `USUAL`, or the one with the fewest missing.
    """
    tables = known()
    there = {name: len({*table.files} & {*files}) for name, table in tables.items()}
    found = max(there, key=lambda name: (there[name], name == USUAL, -len(tables[name].files)), default=None)
    return found if found is not None and there[found] else None
