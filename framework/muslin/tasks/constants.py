"""Constants of each student's own: numbers that go with arguments of some tasks, drawn from who they are.

A manifest with `[constants]` says which tasks have them and which of Muslin's arguments each is a factor of. Whoever
knows a student's name for themselves (a login, a number) can draw theirs; `NAME@ID` is the assignment as that student
has it, and everything that is known of the assignment is carried over to it (`muslin.tasks.wiring`).
"""

from __future__ import annotations

import hashlib
import hmac
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from muslin.base.errors import MuslinError
from muslin.base.text import one_line
from muslin.tasks.wiring import Wiring

if TYPE_CHECKING:
    from muslin.tasks.manifest import Task

#: Between the name of an assignment and whose it is.
OF = "@"

#: What constants are drawn from, in thousandths: a tenth away from 1 at least, and away from halves and doubles.
DRAWN = (*range(610, 891), *range(1110, 1891))

#: Who has the constants that are written in the solution: 1, every one.
NOBODY = "nobody"

_ID = re.compile(r"[\w.+@-]{1,80}")
_WHOSE = re.compile(r"^# Constants of (\S{1,80}):", re.MULTILINE)


@dataclass(frozen=True)
class Constants:
    """Which constants an assignment has: the manifest's `[constants]`.

    Attributes
    ----------
    salt : str
        What they are drawn from, with the student's id.
    file : str
        The task file they stand in.
    tasks : tuple of str
        The tasks that have them.
    factors : mapping
        Name of a constant -> the argument of Muslin's that it goes with.
    """

    salt: str
    file: str
    tasks: tuple[str, ...] = ()
    factors: Mapping[str, str] = field(default_factory=dict)

    def drawn(self, student: str) -> dict[str, float]:
        """A student's own, by name."""
        found = {}
        for name in self.factors:
            digest = hmac.new(self.salt.encode(), f"{name}/{student}".encode(), hashlib.sha256).digest()
            found[name] = DRAWN[int.from_bytes(digest[:8], "big") % len(DRAWN)] / 1000
        return found

    def said(self, student: str = "") -> str:
        """They as they stand in the task file."""
        values = self.drawn(student).values() if student else [1.0] * len(self.factors)
        return f"{', '.join(self.factors)} = {', '.join(f'{value}' for value in values)}"

    def written(self, text: str, student: str) -> str:
        """A text that is given to everybody, as it is given to a student."""
        whose = (f"Constants of {NOBODY}:", f"Constants of {student}:")
        return text.replace(self.said(), self.said(student)).replace(*whose)

    def whose(self, files: Mapping[str, bytes]) -> str:
        """Whose constants a submission says it has; empty where it does not say."""
        found = _WHOSE.search(files.get(self.file, b"").decode("utf-8", "replace"))
        return "" if found is None or found[1] == NOBODY else plain(found[1])

    def apply(self, task: Task, student: str) -> Task:
        """A task as a student has it."""
        if task.name not in self.tasks:
            return task
        wiring = task.called or Wiring(task.arguments, task.results)
        own, values = [value.name for value in task.inputs], self.drawn(student)
        give = {name: wiring.give.get(name, name) for name in own}
        back = {value.name: wiring.back.get(value.name, value.name) for value in wiring.arguments}
        for name, argument in self.factors.items():
            divided = rf"({argument} / {values[name]})"
            give = {key: re.sub(rf"\b{argument}\b", divided, text) for key, text in give.items()}
            back[argument] = f"{values[name]} * ({back[argument]})"
        return replace(task, called=replace(wiring, give=give, back=back))


def plain(student: str) -> str:
    """A student's id as it is drawn from: however it was typed."""
    return unicodedata.normalize("NFKC", student).strip().casefold()


def of(assignment: str, student: str) -> str:
    """An assignment as a student has it, by name.

    Raises
    ------
    MuslinError
        If that cannot be an id.
    """
    if not _ID.fullmatch(plain(student)) or plain(student) == NOBODY:
        raise MuslinError(
            f"{one_line(student, 80)!r} cannot be a student's id.",
            "Use the login, number or address that your course knows you by.",
        )
    return f"{assignment.partition(OF)[0]}{OF}{plain(student)}"


def personal(manifest: str, name: str) -> str:
    """Text of the manifest of a student's own assignment, NAME@ID, from everybody's.

    Raises
    ------
    MuslinError
        If the assignment has no constants, or that cannot be an id.
    """
    bare, _, student = name.partition(OF)
    if "\n[constants]\n" not in manifest:
        raise MuslinError(f"Everybody has the same {bare}: it has no constants of each student's own.")
    line = f'name = "{bare}"\n'
    return manifest.replace(line, f'{line}student = "{of(name, student).partition(OF)[2]}"\n', 1)


def read(table: Mapping[str, Any], where: str) -> Constants:
    """A manifest's `[constants]`.

    Raises
    ------
    MuslinError
        If it cannot be understood; the message says `where` it is.
    """
    try:
        found = Constants(**{**table, "tasks": tuple(table["tasks"])})
        sound = all(isinstance(one, str) for one in (found.salt, found.file, *found.factors.values()))
    except (TypeError, KeyError, AttributeError):
        sound = False
    if not sound or not found.factors:
        raise MuslinError(
            f"The table [constants] in {where} cannot be understood.",
            "It takes salt, file, tasks, and factors: constant = argument.",
        )
    return found
