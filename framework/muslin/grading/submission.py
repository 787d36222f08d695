"""What was handed in becomes the bytes of the task files, and nothing else.

Folders and archives are read by `unpacking` and `choosing` in a process of their own, which may take little time and
memory: what a reader does with a hostile archive costs that submission only.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from muslin.base import child, paths
from muslin.base.errors import MuslinError
from muslin.grading.choosing import shown
from muslin.grading.record import Submission
from muslin.tasks import EXPERIMENTS, MANIFEST, Assignment, named_in
from muslin.tasks.guessing import another, fitting, known

#: What the process that reads a submission may take: address space [bytes], processor time and, should the system
#: not see to that, time by the clock [s].
MOST_MEMORY, MOST_SECONDS, PATIENCE = 1 << 30, 10, 120.0

#: What is said of a submission whose reading had to be stopped.
TOO_MUCH = (
    "Unpacking it takes more time or memory than an honest submission needs. "
    "Hand in the task files only, as a folder or an ordinary zip."
)


class Unreadable(MuslinError):
    """A submission of which nothing can be graded: it gets no score, and a reason."""


@dataclass(frozen=True)
class Source:
    """A file or folder that was handed in.

    Attributes
    ----------
    path : Path
    name : str
        Its path inside the submission; empty if it is all of it.
    upload : int
        Of two uploads, the one with the larger number is newer.
    """

    path: Path
    name: str = ""
    upload: int = 0


@dataclass(frozen=True)
class Handed:
    """What was handed in: the bytes of each usable task file, why others cannot be used, and a description.

    `unreadable` says why there is nothing to grade, if there is nothing; `student` whose it is, where each has
    constants of their own.
    """

    files: dict[str, bytes]
    refused: dict[str, str]
    about: Submission
    unreadable: str = ""
    student: str = ""


def collect(path: Path | str, table: Assignment) -> Handed:
    """Read a submission.

    Parameters
    ----------
    path : path
        A folder, a zip or a tar (also compressed), or a task file by itself.
    table : Assignment
        Which files it should hold.

    Raises
    ------
    MuslinError
        If there is nothing at `path`.
    """
    whole = Path(path).resolve()
    if not whole.is_dir() and not whole.is_file():
        raise MuslinError(f"There is no submission {paths.shown(path)}.", "Name a folder, zip or tar.")
    sources = [Source(whole)]
    if whole == paths.source(table.name).resolve():  # what judges it lies below, in files named alike
        sources = [Source(whole / file, file) for file in table.files if (whole / file).is_file()]
    return gather(sources, whole.name, table)


def answered(path: Path | str) -> str | None:
    """Which assignment a submission answers: as its own `assignment.toml` says, or else by its files.

    What their names leave open, the arguments of the functions in them may tell.

    Parameters
    ----------
    path : path
        A folder, a zip or a tar.

    Returns
    -------
    str or None
        None where neither says anything.

    Raises
    ------
    MuslinError
        If its `assignment.toml` names one that there is not, or nothing tells which of several it is.
    """
    whole = Path(path).resolve()
    if whole.is_dir() and paths.source(whole.name).resolve() == whole:
        return whole.name  # a solution: what judges it lies below, with manifests of its own
    files = _asked([Source(whole)], (MANIFEST, *_all_files())).get("files", {})
    if said := _said(files, paths.shown(path)):
        return said
    found = fitting(texts({file: base64.b64decode(data) for file, data in files.items()}))
    if len(found) > 1:
        raise MuslinError(
            f"{paths.shown(path)} may answer {' or '.join(found)}: its files are named as in "
            f"{'both' if len(found) == 2 else 'all of them'}, and its functions do not tell.",
            f"Say which: --assignment {found[0]}",
        )
    return found[0] if found else None


def texts(files: Mapping[str, bytes]) -> dict[str, str]:
    """Task files as text, whatever is in them."""
    return {file: data.decode("utf-8", errors="replace") for file, data in files.items()}


def named_by(sources: Sequence[Source], name: str) -> str | None:
    """Which assignment the `assignment.toml` of what was handed in names, if it has one.

    Raises
    ------
    MuslinError
        If there is no assignment of that name.
    """
    return _said(_asked(sources, (MANIFEST,)).get("files", {}), name)


def _said(files: Mapping[str, str], name: str) -> str | None:
    manifest = base64.b64decode(files.get(MANIFEST, ""))
    return named_in(manifest.decode("utf-8", errors="replace"), name)


def _all_files() -> list[str]:
    """The task files of every assignment."""
    return list(dict.fromkeys(file for table in known().values() for file in table.files))


def gradable(submission: Path | str | Handed, table: Assignment, supposed: bool = False) -> Handed:
    """What was handed in, if something of it can be graded; what was collected already is taken as it is.

    `supposed`: that it answers this assignment is only supposed, since nothing says so.

    Raises
    ------
    Unreadable
        If nothing can.
    """
    if isinstance(submission, Handed):
        return submission
    handed = collect(submission, table)
    if handed.unreadable:
        raise Unreadable(
            f"{paths.shown(submission)} cannot be graded. {handed.unreadable}",
            f"It was taken for {table.name}; --assignment names another: {', '.join(known())}."
            if supposed
            else "",
        )
    return noted(handed, table)


def noted(handed: Handed, table: Assignment) -> Handed:
    """What was handed in, with a note where its functions are those of another assignment."""
    if handed.unreadable or not (other := another(texts(handed.files), table)):
        return handed
    note = f"By what its functions take it answers {other}, and it was graded as {table.name}."
    return replace(handed, about=replace(handed.about, notes=(*handed.about.notes, note)))


def gather(sources: Sequence[Source], name: str, table: Assignment) -> Handed:
    """What was handed in in several pieces.

    Parameters
    ----------
    sources : sequence of Source
    name : str
        Of the submission, for people.
    table : Assignment
    """
    measured = (paths.assignment(table.name) / EXPERIMENTS).glob("*.py")
    given = (*table.given, *(f"{EXPERIMENTS}/{path.name}" for path in measured))
    answer = _asked(sources, table.files, given)
    files: dict[str, bytes] = {}
    try:
        files = {file: base64.b64decode(text) for file, text in answer["files"].items()}
        refused, notes, unreadable = answer["refused"], answer["notes"], answer["unreadable"]
    except KeyError:
        refused, notes, unreadable = dict.fromkeys(table.files, TOO_MUCH), [], TOO_MUCH
    digest = hashlib.sha256()
    for file in sorted(files):
        digest.update(f"{file} {len(files[file])}\n".encode() + files[file])
    found_as = {file: hashlib.sha256(data).hexdigest() for file, data in files.items()}
    about = Submission(shown(name), digest.hexdigest(), found_as, tuple(notes))
    return Handed(files, refused, about, unreadable)


def _asked(sources: Sequence[Source], wanted: Sequence[str], given: Sequence[str] = ()) -> dict:
    """What the reading process says; nothing if it was ended."""
    package = str(paths.PACKAGE.parent)
    code = f"import sys; sys.path.insert(0, {package!r}); from muslin.grading.unpacking import main; main()"
    request = {
        "sources": [(source.name, os.fsencode(source.path).hex(), source.upload) for source in sources],
        "wanted": wanted,
        "given": given,
        "memory": MOST_MEMORY,
        "seconds": MOST_SECONDS,
    }
    try:
        done = child.run(
            [sys.executable, "-I", "-S", "-c", code], json.dumps(request).encode(), limit=PATIENCE
        )
    except OSError as error:
        raise MuslinError(
            f"A process to read the submission with cannot be started: {error.strerror}."
        ) from None
    with contextlib.suppress(ValueError):
        answer = json.loads(done.output)
        return answer if done.status == 0 else {}
    return {}
