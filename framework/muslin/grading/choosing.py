"""Which of the files in a submission are its task files: by name, or by a name that is nearly right.

Names are changed by browsers (`stress (1).py`), systems (`Stress.py`, `stress.py.txt`), platforms (`stress-1.py`)
and people (`stres.py`). A file of the right name counts; without one, the only file whose name is nearly right.
"""

from __future__ import annotations

import difflib
import os
import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from muslin.grading.unpacking import Found

#: How near a name is: right, changed by a machine, mistyped, or only reminding of a task file (and so not read).
RIGHT, CHANGED, MISTYPED, UNREAD = range(4)

#: How like a mistyped name must be.
ALIKE = 0.92

#: Most things that are listed in a note, most notes, and longest name in one [characters].
MOST_LISTED, MOST_NOTES, LONGEST_NAME = 5, 20, 120

#: What is put before and behind a name when a file is copied, downloaded or handed in again.
_BEFORE = re.compile(r"^(copy of|kopie von|copie de|copia de|cópia de|копия)[\s_-]+")
_BEHIND = re.compile(
    r"[\s_]*(-?[\s_]*(copy|kopie|copie|copia|cópia|копия|副本|コピー)[\s_]*\(?\d*\)?|\(\d+\)|[\s_-]\d+)$"
)


class Entry(NamedTuple):
    """A file that may be a task file.

    `file` says which, `tier` how near its name is, `level` in how many archives it lies, `why` why it is of no use.
    """

    path: str
    file: str
    tier: int
    upload: int
    level: int
    data: bytes
    why: str


class Chosen(NamedTuple):
    """The task files, why the others cannot be used, what a person should know, and why there is nothing to grade."""

    files: dict[str, bytes]
    refused: dict[str, str]
    notes: list[str]
    unreadable: str


def nearness(name: str, wanted: Sequence[str]) -> tuple[str, int]:
    """The task file a name may mean, and how near it is; an empty name and `UNREAD` if it means none."""
    return _nearness(name, tuple(wanted))


@lru_cache(4096)
def _nearness(name: str, wanted: tuple[str, ...]) -> tuple[str, int]:
    if name in wanted:
        return name, RIGHT
    folded = unicodedata.normalize("NFKC", name).casefold().strip()
    stem, ending = os.path.splitext(folded)
    if ending == ".txt" and stem.endswith(".py"):
        stem, ending = os.path.splitext(stem)
    if ending == ".py":
        stem = stem.removesuffix(".py").strip()
        for form in (stem, unmarked(stem)):
            for file in wanted:
                if _squeezed(form) == _squeezed(file.casefold().removesuffix(".py")):
                    return file, CHANGED
        for file in difflib.get_close_matches(f"{stem}.py", wanted, 1, ALIKE):
            if re.findall(r"\d+", stem) == re.findall(r"\d+", file):
                return file, MISTYPED
    words = f"_{re.sub(r'[^0-9a-z]+', '_', folded)}_"
    for file in sorted(wanted, key=len, reverse=True):
        if f"_{re.sub(r'[^0-9a-z]+', '_', file.casefold().removesuffix('.py'))}_" in words:
            return file, UNREAD
    return "", UNREAD


def unmarked(stem: str) -> str:
    """A name without its ending and without what copying, downloading or handing in again has added to it."""
    return _BEHIND.sub("", _BEFORE.sub("", stem.casefold()))


def _squeezed(stem: str) -> str:
    return re.sub(r"[\s_-]+", "", stem)


def shown(text: object) -> str:
    """Short text that any file can hold."""
    said = str(text).encode("utf-8", "replace").decode()
    return said if len(said) <= LONGEST_NAME else said[:LONGEST_NAME] + "..."


def listed(names: Sequence[object], last: str = "and") -> str:
    """Names in a sentence: the first few, and how many more."""
    said = [shown(name) for name in names[:MOST_LISTED]]
    if len(names) > MOST_LISTED:
        return f"{', '.join(said)} and {len(names) - MOST_LISTED} more"
    return f" {last} ".join([", ".join(said[:-1]), said[-1]] if len(said) > 1 else said)


def chosen(found: Found) -> Chosen:
    """The task files among what was found: the newest upload wins, then what lies loose, then the best name.

    Of equals it is what is nearest the top; of those that are still equal, none, unless they are the same.
    """
    files: dict[str, bytes] = {}
    refused: dict[str, str] = {}
    notes: list[str] = []
    closed = [f"{shown(name)} cannot be opened: {why}" for name, why in sorted(found.closed.items())]
    for file in found.wanted:
        every = [entry for entry in found.entries if entry.file == file]
        named = _last_of_each(every)
        notes += _repeated(every)
        first = _first(named)
        if why := _refusal(file, first, named, closed):
            refused[file] = why
        else:
            files[file] = first[0].data
            notes += _taken(file, first[0], named)
    notes += [*_noticed(found), *(f"{text}." for text in closed[:MOST_LISTED])]
    unreadable = "" if any(files.values()) else _unreadable(found, refused, closed)
    return Chosen(files, refused, notes[:MOST_NOTES], unreadable)


def _last_of_each(entries: Sequence[Entry]) -> list[Entry]:
    """Of entries that an archive holds under one path the last, which is what unpacking leaves."""
    loose = [entry for entry in entries if not entry.level]
    return loose + list({(entry.path, entry.upload): entry for entry in entries if entry.level}.values())


def _repeated(entries: Sequence[Entry]) -> list[str]:
    """What to say of paths that an archive holds several times, with different files."""
    held: dict[tuple[str, int], list[Entry]] = {}
    for entry in (entry for entry in entries if entry.level):
        held.setdefault((entry.path, entry.upload), []).append(entry)
    return [
        f"{shown(path)} is in its archive {len(same)} times; the last one counts, as when it is unpacked."
        for (path, _), same in held.items()
        if len({(entry.data, entry.why) for entry in same}) > 1
    ]


def _first(named: Sequence[Entry]) -> list[Entry]:
    """Those that come before all others."""
    read = [entry for entry in named if entry.tier < UNREAD]
    best = min(map(_rank, read), default=None)
    return [entry for entry in read if _rank(entry) == best]


def _rank(entry: Entry) -> tuple[int, ...]:
    depth = len(PurePosixPath(entry.path).parts)
    return -entry.upload, entry.tier == MISTYPED, entry.level, entry.tier, depth


def _refusal(file: str, first: Sequence[Entry], named: Sequence[Entry], closed: Sequence[str]) -> str:
    """Why none of the files can be used; nothing if the first can."""
    paths = [entry.path for entry in first]
    if not first:
        return _missing(file, named, closed)
    if len({(entry.data, entry.why) for entry in first}) == 1:
        return first[0].why and f"{file} {first[0].why}"
    if first[0].tier == RIGHT:
        return f"There are {len(first)} files {file} ({listed(paths)}). Hand in one."
    return f"{file} is missing; {listed(paths, 'or')} may be meant. Hand in one, under this name."


def _missing(file: str, named: Sequence[Entry], closed: Sequence[str]) -> str:
    if named:
        there = listed([entry.path for entry in named])
        return f"{file} is missing; there is {there}. Hand it in under this name, as a Python file."
    if closed:
        return f"{file} is missing. {listed(closed)}."
    return f"{file} is missing. Hand it in with the others, under this name."


def _taken(file: str, taken: Entry, named: Sequence[Entry]) -> list[str]:
    """What to say of a choice."""
    notes = []
    others = [entry for entry in named if entry is not taken and entry.tier < UNREAD]
    if taken.tier != RIGHT:
        notes.append(f"{file} is missing; {shown(taken.path)} was graded in its place.")
    if older := [entry.path for entry in others if entry.upload < taken.upload]:
        notes.append(f"{file} was handed in {len(older) + 1} times; the newest was graded.")
    if same := [entry.path for entry in others if entry.upload == taken.upload]:
        notes.append(f"{file} was taken from {shown(taken.path)}, not from {listed(same)}.")
    return notes


def _noticed(found: Found) -> list[str]:
    """What to say of the rest."""
    said = {
        "Passed over, their paths leave the archive": found.leaving,
        "Not task files, so not used": _extra(found),
        "Not opened, since there are task files beside": found.unopened,
    }
    return [f"{what}: {listed(names)}." for what, names in said.items() if names]


def _extra(found: Found) -> list[str]:
    """Files that look as if they were meant to be run."""
    named = [entry.path for entry in found.entries if entry.tier == UNREAD]
    return [
        path
        for path in found.others + named
        if path.endswith((".py", ".pth", ".so"))
        and not {os.path.basename(path), "/".join(path.split("/")[-2:])} & {*found.given}
    ]


def _unreadable(found: Found, refused: dict[str, str], closed: Sequence[str]) -> str:
    """Why there is nothing to grade."""
    named = [entry for entry in found.entries if entry.tier < UNREAD]
    spoilt = dict.fromkeys(refused.get(entry.file, f"{entry.file} is empty.") for entry in named)
    if spoilt:
        more = f" And {len(spoilt) - 1} more." if len(spoilt) > 1 else ""
        return f"None of its task files can be used. {next(iter(spoilt))}{more}"
    if closed:
        return f"{listed(closed)}. Hand in an ordinary zip, or the folder."
    there = [*[entry.path for entry in found.entries], *found.others, *found.leaving, *found.unopened]
    if not there:
        return "It is empty: there is no file in it."
    return f"There is no task file in it: {listed(found.wanted)} are missing. It holds {listed(there)}."
