"""Who is in the class, by the platform's own table; and that table again, with the scores in it.

Canvas' gradebook, Moodle's grading worksheet, Gradescope's roster or grades, or any table with names or numbers. People
are matched by number, then by login or e-mail, then by name; where that is not certain, nobody is.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta, tzinfo
from functools import cached_property
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.text import one_line
from muslin.classes import late
from muslin.classes.finding import Student
from muslin.classes.tables import Sheet
from muslin.grading.views.text import points
from muslin.tasks import Assignment

#: What a column is about -> how platforms call it.
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "number": ("id", "identifier", "sid", "student id", "sis user id", "id number", "integration id", "github_id"),
    "login": ("sis login id", "login", "username", "github_username", "email", "email address"),
    "name": ("student", "full name", "name", "student name"),
    "first": ("first name", "given name"),
    "last": ("last name", "surname", "family name"),
    "role": ("role",),
    "score": ("grade", "total score", "score", "points"),
    "most": ("maximum grade", "max points"),
    "open": ("grade can be changed",),
    "submitted": ("last modified (submission)", "submission time"),
    "lateness": ("lateness (h:m:s)", "lateness", "status"),
}  # fmt: skip

#: Canvas: an assignment's column, with its number; a row that is no student; whoever is none.
_ASSIGNMENT = re.compile(r"(?P<title>.+?)\s*\((?P<number>\d+)\)\s*", re.S)
_POINTS, _READ_ONLY, _TEST = "points possible", "(read only)", "student, test"

#: People by what they may be called.
Keys = Mapping[str, list["Person"]]

#: One of those who handed in: the key of the submission, and who it is.
Entry = tuple[str, Student]

#: What stands in a cell that no score may replace.
_EXCUSED = ("ex", "excused")


@dataclass(frozen=True)
class Person:
    """Someone on the roster: the rows that are about them, and what is said of them there."""

    rows: tuple[int, ...]
    name: str
    numbers: tuple[str, ...] = ()
    logins: tuple[str, ...] = ()
    submitted: str = ""
    lateness: str = ""

    @property
    def told(self) -> str:
        """A name for people."""
        return self.name or next(iter((*self.logins, *self.numbers)), "?")


@dataclass
class Match:
    """Who is who.

    Attributes
    ----------
    found : dict
        Person by entry.
    nobody : list of Entry
        Who handed in and is not on the roster.
    ambiguous : list of (Entry, list of Person)
        Who may be several, or one whom another may be, too.
    missing : list of Person
        Who is on the roster and has handed in nothing.
    """

    found: dict[Entry, Person] = field(default_factory=dict)
    nobody: list[Entry] = field(default_factory=list)
    ambiguous: list[tuple[Entry, list[Person]]] = field(default_factory=list)
    missing: list[Person] = field(default_factory=list)


class Roster:
    """A class's table.

    Parameters
    ----------
    path : path

    Raises
    ------
    MuslinError
        If it cannot be read, or nothing in it says who is who.
    """

    def __init__(self, path: Path | str):
        self.path = Path(path)
        try:
            self._sheet = Sheet(self.path.read_bytes())
        except (OSError, UnicodeDecodeError) as error:
            why = getattr(error, "strerror", None) or error
            raise MuslinError(f"The roster {paths.shown(path)} cannot be read: {why}.") from None
        rows = self._sheet.rows
        self._head = next((k for k, row in enumerate(rows) if row), 0)
        self.header = [" ".join(cell.split()) for cell in rows[self._head]] if rows else []
        self._canvas = {"student", "id", "section"} <= {name.casefold() for name in self.header}
        if not any(self._columns[what] for what in ("number", "login", "name", "last")):
            raise MuslinError(
                f"The roster {paths.shown(path)} has no column that says who is who.",
                "Its first line should name some of: Student, ID, SID, Email, Full name, Identifier. "
                f"It says: {one_line(', '.join(self.header), 300)}",
            )
        self.people = tuple(self._read())
        if not self.people:
            raise MuslinError(f"There is nobody in the roster {paths.shown(path)}.")

    @cached_property
    def _columns(self) -> dict[str, list[int]]:
        """Columns by what they are about, in the order in which `COLUMNS` names them."""
        said = [name.casefold() for name in self.header]
        return {what: [said.index(name) for name in names if name in said] for what, names in COLUMNS.items()}

    def _read(self) -> Iterable[Person]:
        together: dict[object, list[int]] = {}
        for number, row in enumerate(self._sheet.rows[self._head + 1 :], self._head + 1):
            numbers, name = self._all(row, "number"), self._name(row)
            if self._is_student(row, name, numbers):
                # in several sections one person may have several rows
                together.setdefault((numbers[0], name) if numbers else number, []).append(number)
        for rows in together.values():
            row = self._sheet.rows[rows[0]]
            yield Person(
                tuple(rows), self._name(row), self._all(row, "number"), self._all(row, "login"),
                self._first(row, "submitted"), self._first(row, "lateness"),
            )  # fmt: skip

    def _is_student(self, row: Sequence[str], name: str, numbers: Sequence[str]) -> bool:
        if name.casefold() in (_POINTS, _TEST) or (self._canvas and not numbers):
            return False
        if (role := self._first(row, "role").casefold()) and role != "student":
            return False
        return bool(name or numbers or self._all(row, "login"))

    def _all(self, row: Sequence[str], what: str) -> tuple[str, ...]:
        cells = (row[column].strip() for column in self._columns[what] if column < len(row))
        return tuple(cell for cell in cells if cell)

    def _first(self, row: Sequence[str], what: str) -> str:
        return next(iter(self._all(row, what)), "")

    def _name(self, row: Sequence[str]) -> str:
        last, first = self._first(row, "last"), self._first(row, "first")
        whole = self._first(row, "name")
        return " ".join((whole or ", ".join(filter(None, (last, first)))).split())

    def handing(self, person: Person, zone: tzinfo) -> tuple[datetime | None, timedelta | None]:
        """When someone handed in and how late that was, where the table says so."""
        return late.moment(person.submitted, zone), late.lateness(person.lateness)

    # Who is who -----------------------------------------------------------------------------------------------

    def match(self, entries: Sequence[Entry], said: Mapping[str, str] | None = None) -> Match:
        """Who of those who handed in is who on the roster.

        Parameters
        ----------
        entries : sequence of Entry
        said : dict, optional
            What a person has said: the key of a submission -> a number, login or name on the roster.

        Raises
        ------
        MuslinError
            If what a person has said is not one on the roster.
        """
        numbers = _by_keys((p, map(_number, p.numbers)) for p in self.people)
        logins = _by_keys((p, map(_plain, p.logins)) for p in self.people)
        locals_ = _by_keys((p, map(_local, p.logins)) for p in self.people)
        by_name = _by_keys((p, names(p.name)) for p in self.people)
        match, waiting = Match(), list(dict.fromkeys(entries))
        for entry in [entry for entry in waiting if said and entry[0] in said]:
            match.found[entry] = self._said((said or {})[entry[0]], (numbers, logins, by_name))
            waiting.remove(entry)
        by_hand = set(match.found)
        for known, asked in (
            (numbers, lambda s: {_number(s.id)}),
            (logins, _logins),
            (locals_, lambda s: set(map(_local, _logins(s)))),
            (by_name, lambda s: names(s.name)),
        ):
            waiting = _stage(match, waiting, known, asked)
        match.nobody = waiting
        _contradicted(match, by_name, by_hand)
        settled = {*match.found.values(), *(person for _, many in match.ambiguous for person in many)}
        match.missing = [person for person in self.people if person not in settled]
        return match

    def _said(self, text: str, known: Iterable[Keys]) -> Person:
        for keys, written in zip(known, ({_number(text)}, {_plain(text)}, names(text)), strict=True):
            people = {person for key in written for person in keys.get(key, ())}
            if len(people) == 1:
                return people.pop()
        raise MuslinError(
            f"{one_line(text)!r} is not one person on the roster {paths.shown(self.path)}.",
            "Write their number, login or name as it stands there.",
        )

    # The scores -----------------------------------------------------------------------------------------------

    def column(self, table: Assignment, wanted: str | None = None) -> int:
        """The column of the scores; one after the last if there is none, where a table may grow.

        Parameters
        ----------
        table : Assignment
        wanted : str, optional
            Its heading; in Canvas' also without the number, or the number alone.

        Raises
        ------
        MuslinError
            If there is no such column, or it is not certain which.
        """
        if not self._canvas:
            return self._plain_column(wanted)
        found = {k: match for k, name in enumerate(self.header) if (match := _ASSIGNMENT.fullmatch(name))}
        read_only = {
            column for row in self._sheet.rows for column, cell in enumerate(row)
            if row and _plain(row[0]) == _POINTS and cell.strip().casefold() == _READ_ONLY
        }  # fmt: skip
        found = {column: match for column, match in found.items() if column not in read_only}
        for likely in (wanted,) if wanted else (table.name, table.title):
            said = _plain(likely)
            for alike in (
                lambda m, said=said: said in map(_plain, (m[0], m["title"], m["number"])),
                lambda m, said=said: said in _plain(m["title"]),
            ):
                columns = [column for column, match in found.items() if alike(match)]
                if len(columns) == 1:
                    return columns[0]
                if columns:
                    break
        if not wanted and len(found) == 1:
            return next(iter(found))
        what = f"no one column {one_line(wanted)!r}" if wanted else "no one column for this assignment"
        there = one_line(", ".join(match[0] for match in found.values()) or "none", 400)
        raise MuslinError(
            f"The roster {paths.shown(self.path)} has {what}.", f"Name it with --column; there is: {there}."
        )

    def _plain_column(self, wanted: str | None) -> int:
        if wanted is None:
            return next(iter(self._columns["score"]), len(self.header))
        said = [k for k, name in enumerate(self.header) if _plain(name) == _plain(wanted)]
        if len(said) != 1:
            raise MuslinError(
                f"The roster {paths.shown(self.path)} has no one column {one_line(wanted)!r}.",
                f"It says: {one_line(', '.join(self.header), 400)}",
            )
        return said[0]

    def most(self, column: int) -> float | None:
        """The points the platform gives for the column, where it says so."""
        rows = self._sheet.rows
        if self._canvas:
            cells = (r[column] for r in rows if r and _plain(r[0]) == _POINTS and column < len(r))
        else:
            cells = (self._first(rows[person.rows[0]], "most") for person in self.people)
        return next((number for cell in cells if (number := _as_number(cell)) is not None), None)

    def filled(
        self, scores: Mapping[Person, float], column: int, heading: str, missing: float | None = None,
        absent: Iterable[Person] = (),
    ) -> tuple[bytes, list[str]]:  # fmt: skip
        """The file with scores in a column, all else as it is to the last byte; and what was left alone, in words.

        Parameters
        ----------
        scores : dict
            Points by person.
        column : int
        heading : str
            Of the column, if it is a new one.
        missing : float, optional
            What to write for the `absent` where nothing stands; default nothing.
        absent : iterable of Person
        """
        changes: dict[tuple[int, int], str] = {}
        notes: list[str] = []
        rows = self._sheet.rows
        comma = any("," in self._first(rows[p.rows[0]], "most") for p in self.people)
        if column == len(self.header):
            changes[self._head, column] = heading
        wanted = {**({} if missing is None else dict.fromkeys(absent, missing)), **scores}
        for person, score in wanted.items():
            for number in person.rows:
                row = rows[number]
                now = row[column].strip() if column < len(row) else ""
                if self._first(row, "open").casefold() == "no":
                    notes.append(f"{person.told}: the platform says that the grade cannot be changed")
                elif now.casefold() in _EXCUSED:
                    notes.append(f"{person.told}: excused, left so")
                elif person not in scores and now:
                    notes.append(f"{person.told}: handed in nothing and has {one_line(now)} already, left so")
                elif _as_number(now) != score:
                    text = points(score)
                    changes[number, column] = text.replace(".", ",") if comma else text
        return self._sheet.filled(changes), notes


# Names and numbers ----------------------------------------------------------------------------------------


def _plain(text: str) -> str:
    return " ".join(unicodedata.normalize("NFKC", text).split()).casefold()


def _local(login: str) -> str:
    """A login: what stands before the @ of an address."""
    return _plain(login).partition("@")[0]


def _number(text: str) -> str:
    """A number as all platforms would write it; Moodle has a word before it ("Participant 123")."""
    match = re.fullmatch(r"[^\W\d_/ ]+(?:/[^\W\d_]+)? ?(\d+)", _plain(text)) if " " in text.strip() else None
    return match[1] if match else _plain(text)


def _logins(student: Student) -> set[str]:
    return {_plain(student.id), _plain(student.name)}


def names(name: str) -> set[str]:
    """What a name may be written as: letters only, in either order; without accents."""
    letters = unicodedata.normalize("NFKD", name.casefold())
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    last, comma, first = plain.partition(",")
    words = re.findall(r"[^\W_]+", plain)
    either = [words, re.findall(r"[^\W_]+", f"{first} {last}")] if comma else [words]
    return {"".join(order) for order in either} | ({" ".join(sorted(words))} if len(words) > 1 else set())


def _as_number(text: str) -> float | None:
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        return None


def _by_keys(people: Iterable[tuple[Person, Iterable[str]]]) -> Keys:
    found: dict[str, list[Person]] = {}
    for person, keys in people:
        for key in set(filter(None, keys)):
            found.setdefault(key, []).append(person)
    return found


def _stage(
    match: Match, waiting: Sequence[Entry], known: Keys, asked: Callable[[Student], set[str]]
) -> list[Entry]:
    """Match by one kind of key; gives who is on the roster by none."""
    left, wanted = [], []
    for entry in waiting:
        keys = sorted(filter(None, asked(entry[1])))
        people = list(dict.fromkeys(person for key in keys for person in known.get(key, ())))
        if people:
            wanted.append((entry, people))
        else:
            left.append(entry)
    claims = Counter(person for _, people in wanted for person in people)
    taken = set(match.found.values())
    for entry, people in wanted:
        if len(people) == 1 and claims[people[0]] == 1 and people[0] not in taken:
            match.found[entry] = people[0]
        else:
            match.ambiguous.append((entry, people))
    return left


def _contradicted(match: Match, by_name: Keys, by_hand: set[Entry]) -> None:
    """Take back whom a number matched with one and the name, without doubt, with another."""
    for entry, person in list(match.found.items()):
        named = {p for key in names(entry[1].name) for p in by_name.get(key, ())}
        if len(named) == 1 and person not in named and entry not in by_hand:
            del match.found[entry]
            match.ambiguous.append((entry, [person, *named]))
