"""Which student handed in what: layouts of learning platforms become one list of submissions.

Nothing is unpacked here. A submission is handed on as one archive in memory (`payload`): the student's own, or a
tar of the task files where they lie about as files.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import stat
import tarfile
import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from muslin import paths
from muslin.errors import MuslinError
from muslin.grading.submission import LARGEST_ARCHIVE, LARGEST_FILE, MOST_ENTRIES
from muslin.tasks import Assignment

ARCHIVES = (".zip", ".tar", ".tgz", ".tar.gz", ".tar.bz2", ".tar.xz", ".tbz2", ".txz")

#: Folders nobody hands in on purpose; hidden ones are passed over as well.
_IGNORED = {"__MACOSX", "__pycache__", "node_modules", "venv", "env"}

#: Platforms by how they name what is handed in. `rest` is the student's own file name.
_PLATFORMS: Mapping[str, re.Pattern[str]] = {
    "Canvas": re.compile(r"(?P<name>[^_]+)_(?P<late>LATE_)?(?P<id>\d+)_(?P<upload>\d+)_(?P<rest>.+)", re.S),
    "Moodle": re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_file_?(?P<rest>.*)", re.S),
    "Gradescope": re.compile(r"submission_(?P<id>\d+)"),
}
_METADATA = "submission_metadata.yml"


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
    files : tuple of (str, Path)
        Where each lies, by its path inside the submission; or a single archive.
    late : bool
    notes : tuple of str
    """

    key: str
    students: tuple[Student, ...]
    files: tuple[tuple[str, Path], ...]
    late: bool = False
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Names of its students."""
        return ", ".join(student.name for student in self.students)


@dataclass
class _Pile:
    """Top-level entries of one student, on the way to a submission."""

    name: str
    id: str = ""
    late: bool = False
    source: str = ""
    files: list[tuple[int, str, Path]] = field(default_factory=list)  # (upload, path inside, path)
    folders: list[Path] = field(default_factory=list)
    students: tuple[Student, ...] = ()


def find(folder: Path | str, table: Assignment) -> tuple[list[Submission], list[str]]:
    """Submissions in a folder, and notes on what was passed over.

    Parameters
    ----------
    folder : path
        As a platform's export unpacks, or with a folder or an archive per student.
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
    entries = sorted((e for e in os.scandir(folder) if not e.name.startswith(".")), key=lambda e: e.name)
    if any(entry.name in table.files for entry in entries):
        raise MuslinError(
            f"{paths.shown(folder)} holds task files: it is one submission, not a folder of them.",
            f"Grade it with: muslin grade {paths.shown(folder)}",
        )
    prefix = _github_prefix(entries, table)
    members = _gradescope_members(folder / _METADATA)
    piles: dict[tuple[str, str], _Pile] = {}
    passed_over = []
    for entry in entries:
        if entry.is_symlink():
            passed_over.append(f"{entry.name}: a link")
        elif (claimed := _claimed(entry)) is not None:
            name, id, late, upload, inside = claimed
            pile = piles.setdefault((name, id), _Pile(name, id, source=entry.name))
            pile.late |= late
            pile.students = members.get(entry.name, pile.students)
            if entry.is_dir(follow_symlinks=False):
                pile.folders.append(Path(entry.path))
            else:
                pile.files.append((upload, inside or entry.name, Path(entry.path)))
        elif entry.is_dir(follow_symlinks=False) and entry.name not in _IGNORED:
            name = entry.name.removeprefix(prefix)
            piles["", entry.name] = _Pile(name, source=entry.name, folders=[Path(entry.path)])
        elif entry.name.lower().endswith(ARCHIVES):
            name = _stem(entry.name).removeprefix(prefix)
            files = [(0, entry.name, Path(entry.path))]
            piles["", entry.name] = _Pile(name, source=entry.name, files=files)
        elif entry.name != _METADATA:
            passed_over.append(f"{entry.name}: neither a folder nor an archive")
    if not piles:
        raise MuslinError(
            f"There is no submission in {paths.shown(folder)}.",
            "It should hold a folder or an archive for each student, or what Canvas, Moodle, Gradescope or GitHub "
            "Classroom let you download.",
        )
    return _with_keys([_settled(pile, table) for pile in piles.values()], list(piles.values())), passed_over


def payload(submission: Submission, table: Assignment) -> bytes:
    """The submission as the bytes of one archive; the same files give the same bytes.

    Raises
    ------
    MuslinError
        If it cannot be read, or is too large.
    """
    try:
        if len(submission.files) == 1 and submission.files[0][0].lower().endswith(ARCHIVES):
            return _read(submission.files[0][1], LARGEST_ARCHIVE)
        return _packed(submission.files, table)
    except OSError as error:
        raise MuslinError(f"It cannot be read: {error.strerror or error}.") from None


def tidy_name(text: str) -> str:
    """A name as people would write it: composed letters, single spaces."""
    return " ".join(unicodedata.normalize("NFC", text).split()) or "(no name)"


def slug(text: str) -> str:
    """Letters, digits and hyphens of a name."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:60].rstrip("-")


def _stem(name: str) -> str:
    ending = max((e for e in ARCHIVES if name.lower().endswith(e)), key=len, default="")
    return name[: len(name) - len(ending)] if ending else name


def _claimed(entry: os.DirEntry[str]) -> tuple[str, str, bool, int, str] | None:
    """What a platform's name of an entry says: name, id, late, number of the upload, path inside."""
    for platform, pattern in _PLATFORMS.items():
        match = pattern.fullmatch(entry.name)
        if match is None or (platform == "Canvas" and entry.is_dir()):
            continue
        said = match.groupdict()
        name = tidy_name(said.get("name") or entry.name)
        return name, said["id"], bool(said.get("late")), int(said.get("upload") or 0), said.get("rest") or ""
    return None


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


def _gradescope_members(path: Path) -> dict[str, tuple[Student, ...]]:
    """Students by submission, from Gradescope's metadata."""
    if not path.is_file():
        return {}
    try:
        import yaml
    except ImportError:
        raise MuslinError(
            f"To read the students' names in {path.name}, PyYAML is needed.",
            "Install it with: pip install 'muslin[class]'",
        ) from None
    try:
        text = path.read_text(encoding="utf-8")
        data = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        raise MuslinError(f"{paths.shown(path)} cannot be read: {str(error).splitlines()[0]}.") from None
    members = {}
    for name, about in data.items() if isinstance(data, dict) else ():
        listed = _symbol(about, "submitters")
        students = tuple(
            Student(
                tidy_name(str(_symbol(s, "name") or name)),
                str(_symbol(s, "sid") or _symbol(s, "email") or ""),
            )
            for s in (listed if isinstance(listed, list) else ())
        )
        if students:
            members[str(name)] = students
    return members


def _symbol(data: Any, key: str) -> Any:
    """An entry of Gradescope's metadata, whose keys are Ruby symbols."""
    return data.get(f":{key}", data.get(key)) if isinstance(data, dict) else None


def _settled(pile: _Pile, table: Assignment) -> Submission:
    """Which of the files of a student are the submission."""
    notes: list[str] = []
    loose = [(upload, _own_name(inside, table), path) for upload, inside, path in pile.files]
    files = _newest(loose, notes) if loose else []
    for folder in pile.folders:
        files += list(_walk(folder))
    wanted = [(inside, path) for inside, path in files if Path(inside).name in table.files]
    archives = [(inside, path) for inside, path in files if inside.lower().endswith(ARCHIVES)]
    if wanted or not archives:
        if archives:
            notes.append(f"{archives[0][0]} was not opened: there are task files beside it.")
        chosen = [(i, p) for i, p in files if i.endswith(".py") or Path(i).name in table.files]
    else:
        chosen = archives[-1:]
        if len(archives) > 1:
            notes.append(f"There are {len(archives)} archives; {chosen[0][0]} was graded.")
    students = pile.students or (Student(tidy_name(pile.name), pile.id),)
    return Submission("", students, tuple(chosen), pile.late, tuple(notes))


def _own_name(inside: str, table: Assignment) -> str:
    """A task file's own name: Canvas numbers what is handed in again (`stress-1.py`)."""
    plain = re.sub(r"(?:-\d+| ?\(\d+\))(?=\.py$)", "", inside)
    return plain if plain in table.files else inside


def _newest(loose: list[tuple[int, str, Path]], notes: list[str]) -> list[tuple[str, Path]]:
    """The newest upload of each name; the newest archive last."""
    newest: dict[str, Path] = {}
    for _, inside, path in sorted(loose, key=lambda f: (f[0], f[1], f[2].name)):
        if newest.pop(inside, None) is not None:
            notes.append(f"{inside} was handed in more than once; the newest was graded.")
        newest[inside] = path
    return list(newest.items())


def _walk(root: Path) -> Iterator[tuple[str, Path]]:
    """Files and links below a folder by their path in it, in the order of their names."""
    waiting, count = [root], 0
    while waiting:
        folder = waiting.pop(0)
        try:
            found = sorted(os.scandir(folder), key=lambda e: e.name)
        except OSError:
            continue
        for entry in found:
            count += 1
            if count > MOST_ENTRIES:
                return
            if not entry.is_dir(follow_symlinks=False):
                yield Path(entry.path).relative_to(root).as_posix(), Path(entry.path)
            elif entry.name not in _IGNORED and not entry.name.startswith("."):
                waiting.append(Path(entry.path))


def _with_keys(submissions: list[Submission], piles: list[_Pile]) -> list[Submission]:
    """Each with its key: name and number, and where that is not enough a mark of where it lay."""
    first = []
    for submission, pile in zip(submissions, piles, strict=True):
        name, number = slug(submission.name), slug(pile.id or submission.students[0].id)
        first.append("-".join(filter(None, (name, "" if name.endswith(number) else number))) or "student")
    counts = Counter(first)
    keyed = []
    for submission, pile, key in zip(submissions, piles, first, strict=True):
        if counts[key] > 1:
            key += f"-{hashlib.sha256(os.fsencode(pile.source)).hexdigest()[:8]}"
        keyed.append(replace(submission, key=key))
    return sorted(keyed, key=lambda s: (s.name.casefold(), s.key))


def _read(path: Path, most: int) -> bytes:
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    descriptor = os.open(path, flags)
    with os.fdopen(descriptor, "rb") as stream:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError("it is no regular file")
        data = stream.read(most + 1)
    if len(data) > most:
        raise MuslinError(f"It is larger than {most // 10**6} MB.")
    return data


def _packed(files: Sequence[tuple[str, Path]], table: Assignment) -> bytes:
    """A tar with the task files; of other Python files the name, of links that they are links."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for inside, path in files:
            info = tarfile.TarInfo(inside.encode("utf-8", "replace").decode())
            mode = path.lstat().st_mode
            data = b""
            if stat.S_ISREG(mode) and path.name and Path(inside).name in table.files:
                data = _first(path, LARGEST_FILE + 1)  # one byte too many, if so, for the grader to refuse
            elif not stat.S_ISREG(mode):
                info.type, info.linkname = tarfile.SYMTYPE, "elsewhere"
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return stream.getvalue()


def _first(path: Path, most: int) -> bytes:
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    with os.fdopen(descriptor, "rb") as stream:
        return stream.read(most)
