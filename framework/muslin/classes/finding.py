"""Which student handed in what: layouts of learning platforms become one list of submissions.

Nothing is opened here but folders: what is in a submission is for `muslin.grading.submission.gather` to see.
"""

from __future__ import annotations

import datetime
import hashlib
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.classes.layouts import METADATA, Member, claimed, members
from muslin.grading.archives import ignored, readable
from muslin.grading.formats import ARCHIVES
from muslin.grading.submission import Source
from muslin.grading.unpacking import LITTER
from muslin.tasks import Assignment

#: What a student may have handed in instead of an archive; other files beside the submissions are none.
_DOCUMENTS = re.compile(r"\.(py|ipynb|pdf|docx?|odt|rtf|pages|html?)$", re.IGNORECASE)

#: How deep the folder of a download may lie in others, and how many folders of a student are looked into to tell.
_DEEPEST, _MOST_LOOKED_AT = 3, 200


@dataclass(frozen=True)
class Student:
    """Someone who gets a grade: a name for people, and the platform's number where it gives one."""

    name: str
    id: str = ""


@dataclass(frozen=True)
class Submission:
    """What was handed in together.

    Attributes
    ----------
    key : str
        Letters, digits and hyphens; unique in the class and the same in every run.
    students : tuple of Student
        Usually one; a group where the platform knows groups.
    sources : tuple of Source
        Files and folders; empty if the platform knows of a submission that is not there.
    late : bool
    time : str
        When it was handed in, where the platform says so.
    when : datetime, optional
        The same, where it can be reckoned with.
    """

    key: str
    students: tuple[Student, ...]
    sources: tuple[Source, ...]
    late: bool = False
    time: str = ""
    when: datetime.datetime | None = None

    @property
    def name(self) -> str:
        """Names of its students."""
        return ", ".join(student.name for student in self.students)


@dataclass
class _Pile:
    """Entries of one student, on the way to a submission; `origin` is where the first lies."""

    name: str
    origin: str
    id: str = ""
    late: bool = False
    sources: list[Source] = field(default_factory=list)
    member: Member | None = None


def find(folder: Path | str, table: Assignment) -> tuple[list[Submission], list[str]]:
    """Submissions in a folder, and notes on what was passed over.

    Parameters
    ----------
    folder : path
        As a platform's export unpacks, or with a folder or an archive per student; or a folder with such in it.
    table : Assignment

    Raises
    ------
    MuslinError
        If there is none.
    """
    folder = Path(folder)
    if not folder.is_dir():
        hint = "Unpack the platform's download first." if folder.is_file() else "Name the folder they lie in."
        raise MuslinError(f"{paths.shown(folder)} is not a folder of submissions.", hint)
    try:
        if any(entry.name in table.files for entry in _visible(folder)):
            raise MuslinError(
                f"{paths.shown(folder)} holds task files: it is one submission, not a folder of them.",
                f"Grade it with: muslin grade {paths.shown(folder)}",
            )
        piles: list[_Pile] = []
        notes: list[str] = []
        homes = _homes(folder, table)
        notes += [f"{paths.shown(home)}: taken for the download" for home in homes if home != folder]
        for home in homes:
            piles += _piles(home, homes, table, notes)
    except OSError as error:
        raise MuslinError(f"{paths.shown(folder)} cannot be read: {error.strerror}.") from None
    if not piles:
        raise MuslinError(
            f"There is no submission in {paths.shown(folder)}.",
            "It should hold a folder or an archive for each student, or what Canvas, Moodle, Gradescope or GitHub "
            "Classroom let you download.",
        )
    keys = _keys(piles, folder)
    submissions = [_submission(pile, key) for pile, key in zip(piles, keys, strict=True)]
    return sorted(submissions, key=lambda s: (s.name.casefold(), s.key)), notes


def tidy_name(text: str) -> str:
    """A name as people would write it: composed letters, single spaces."""
    return " ".join(unicodedata.normalize("NFC", text).split()) or "(no name)"


def slug(text: str) -> str:
    """Letters, digits and hyphens of a name."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:60].rstrip("-")


# The folder of a download ---------------------------------------------------------------------------------


def _homes(folder: Path, table: Assignment, deep: int = _DEEPEST) -> list[Path]:
    """The folders whose entries are submissions: this one, or those in it that are a platform's download."""
    if _from_platform(folder):
        return [folder]
    inside = [Path(entry.path) for entry in _visible(folder) if entry.is_dir(follow_symlinks=False)]
    if downloads := [path for path in inside if _from_platform(path)]:
        return [folder, *downloads]
    if deep and len(inside) == 1 and not any(_may_be_handed_in(entry) for entry in _visible(folder)):
        if _several(inside[0], table):
            return inside
        deeper = _homes(inside[0], table, deep - 1)
        if deeper != inside:
            return deeper
    return [folder]


def _visible(folder: Path) -> list[os.DirEntry[str]]:
    """Entries that a person put there, in the order of their names."""
    with os.scandir(folder) as scan:
        entries = [e for e in scan if not e.name.startswith(".") and e.name.lower() not in LITTER]
    return sorted((e for e in entries if not ignored(e.name)), key=lambda e: os.fsencode(e.name))


def _from_platform(folder: Path) -> bool:
    """Whether names in a folder are a platform's."""
    try:
        entries = _visible(folder)
    except OSError:
        return False
    if any(entry.name == METADATA for entry in entries):
        return True
    named = sum(claimed(readable(e.name), e.is_dir(follow_symlinks=False)) is not None for e in entries)
    return named >= 2 or 0 < named == len(entries)


def _several(folder: Path, table: Assignment) -> bool:
    """Whether a folder holds the work of several students: archives, or the same task file again and again."""
    try:
        entries = _visible(folder)
    except OSError:
        return False
    if any(entry.name in table.files for entry in entries):
        return False
    if sum(bool(ARCHIVES.search(entry.name)) for entry in entries) >= 2:
        return True
    held: Counter[str] = Counter()
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            held.update({*_task_files(Path(entry.path), table), *_repository(Path(entry.path))})
    return max(held.values(), default=0) >= 2


def _repository(folder: Path) -> set[str]:
    return {".git"} if (folder / ".git").exists() else set()


def _task_files(folder: Path, table: Assignment) -> set[str]:
    waiting, found = [folder], set()
    for path in waiting:
        try:
            entries = _visible(path)
        except OSError:
            continue
        found |= {entry.name for entry in entries if entry.name in table.files}
        if not found and len(waiting) < _MOST_LOOKED_AT:
            waiting += [Path(entry.path) for entry in entries if entry.is_dir(follow_symlinks=False)]
    return found


# What lies in it ------------------------------------------------------------------------------------------


def _piles(home: Path, homes: Sequence[Path], table: Assignment, notes: list[str]) -> Iterator[_Pile]:
    """What each student has in a folder; other folders with submissions in it, and what they came in, left out."""
    entries = [entry for entry in _visible(home) if Path(entry.path) not in homes]
    inside = {path.name for path in homes if path.parent == home}
    came_in = [entry for entry in entries if ARCHIVES.search(entry.name) and _stem(entry.name) in inside]
    notes += [f"{readable(entry.name)}: the download, which is unpacked beside it" for entry in came_in]
    entries = [entry for entry in entries if entry not in came_in]
    prefix = _github_prefix(entries, table)
    known = members(home / METADATA)
    piles: dict[tuple[str, str], _Pile] = {}
    for entry in entries:
        name, folder = readable(entry.name), entry.is_dir(follow_symlinks=False)
        claim = claimed(name, folder)
        if entry.is_symlink():
            notes.append(f"{name}: a link")
        elif not folder and not entry.is_file(follow_symlinks=False):
            notes.append(f"{name}: a pipe, a socket or a device, not a file")
        elif claim is not None:
            key = (tidy_name(claim.name), claim.id)
            pile = piles.setdefault(key, _Pile(claim.name, entry.path, claim.id))
            pile.late |= claim.late
            pile.member = known.pop(name, pile.member)
            own = "" if folder else _before_canvas(claim.inside or name, table)
            pile.sources.append(Source(Path(entry.path), own, claim.upload))
        elif folder or _may_be_handed_in(entry):
            stem = name if folder else _stem(name)
            pile = piles.setdefault(("", stem), _Pile(stem.removeprefix(prefix), entry.path))
            pile.sources.append(Source(Path(entry.path), "" if folder else name))
        elif entry.name != METADATA:
            notes.append(f"{name}: neither a folder nor an archive")
    for name, member in known.items():
        if member.students:
            piles["", f"{METADATA} {name}"] = _Pile(name, str(home / name), _number(name), member=member)
    yield from piles.values()


def _may_be_handed_in(entry: os.DirEntry[str]) -> bool:
    """Whether a file may be a student's submission."""
    if entry.is_dir(follow_symlinks=False):
        return False
    return bool(ARCHIVES.search(entry.name) or _DOCUMENTS.search(entry.name))


def _stem(name: str) -> str:
    """A name without what says that it is an archive or a document."""
    return _DOCUMENTS.sub("", ARCHIVES.sub("", name)) or name


def _before_canvas(name: str, table: Assignment) -> str:
    """A task file's own name: Canvas numbers what is handed in again (`stress-1.py`)."""
    plain = re.sub(r"-\d+(?=\.py$)", "", name)
    return plain if plain in table.files else name


def _number(name: str) -> str:
    return name.rpartition("_")[2]


def _github_prefix(entries: Sequence[os.DirEntry[str]], table: Assignment) -> str:
    """The assignment's name that GitHub Classroom puts before each user's, if it is one."""
    names = [e.name for e in entries if e.is_dir(follow_symlinks=False)]
    first, last = min(names, default=""), max(names, default="")
    same = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), len(first))
    prefix = first[: first.rfind("-", 0, same) + 1]
    if len(names) < 2 or not prefix:
        return f"{table.name}-" if all(name.startswith(f"{table.name}-") for name in names) else ""
    cloned = all(Path(e.path, ".git").exists() for e in entries if e.name in names)
    return prefix if cloned or prefix.startswith(table.name) else ""


# Who it is ------------------------------------------------------------------------------------------------


def _submission(pile: _Pile, key: str) -> Submission:
    listed = pile.member.students if pile.member else ()
    students = tuple(Student(tidy_name(name), id) for name, id in listed)
    students = students or (Student(tidy_name(pile.name), pile.id),)
    time, when = (pile.member.time, pile.member.when) if pile.member else ("", None)
    return Submission(key, students, tuple(pile.sources), pile.late, time, when)


def _keys(piles: Sequence[_Pile], folder: Path) -> list[str]:
    """A key for each: name and number, and where that is not enough a mark of where it lay."""
    keys, marks = [], []
    for pile in piles:
        submission = _submission(pile, "")
        name, number = slug(submission.name), slug(pile.id or submission.students[0].id)
        key = "-".join(filter(None, (name, "" if name.endswith(number) else number)))
        keys.append(key or "student")
        origin = os.fsencode(os.path.relpath(pile.origin, folder))
        marks.append(hashlib.sha256(origin).hexdigest())
    plain, length = list(keys), 0
    while alike := {key for key, count in Counter(keys).items() if count > 1}:
        length += 8
        keys = [f"{p}-{m[:length]}" if k in alike else k for k, p, m in zip(keys, plain, marks, strict=True)]
    return keys
