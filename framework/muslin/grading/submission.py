"""A folder, zip or tar becomes the bytes of the task files, and nothing else.

Nothing is ever unpacked to disk: entries are looked at by name, the task files are read up to a cap, links,
devices and paths that climb are passed over. So neither `..` nor a bomb has anything to work on.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any

from muslin import paths
from muslin.errors import MuslinError
from muslin.grading.record import Submission
from muslin.tasks import MANIFEST, Assignment

#: Largest task file [bytes]; a long honest one has 10 kB.
LARGEST_FILE = 1_000_000
#: Most entries and bytes an archive or folder may hold before it is refused unread.
MOST_ENTRIES, LARGEST_ARCHIVE = 20_000, 200_000_000

#: Entries nobody handed in on purpose.
_IGNORED_FOLDERS = {"__MACOSX", "__pycache__", ".git", ".venv", ".vscode", ".idea", ".taichi"}


@dataclass(frozen=True)
class Handed:
    """What was handed in: the bytes of each usable task file, why others cannot be used, and a description."""

    files: dict[str, bytes]
    refused: dict[str, str]
    about: Submission


@dataclass(frozen=True)
class _Entry:
    path: PurePosixPath
    regular: bool
    source: Any


def collect(path: Path | str, table: Assignment) -> Handed:
    """Read a submission.

    Parameters
    ----------
    path : path
        A folder, a zip or a tar (also compressed).
    table : Assignment
        Which files it should hold.

    Returns
    -------
    Handed
        A file that is missing, doubled, too large or no regular file stands in `refused`, with the reason.

    Raises
    ------
    MuslinError
        If there is nothing at `path`, or it cannot be read as a folder or an archive.
    """
    path = Path(path)
    try:
        if path.is_dir():
            entries, read = _folder(path), _read_file
            return _sort_out(path.resolve().name, list(entries), read, table)
        if not path.is_file():
            raise MuslinError(f"There is no submission {paths.shown(path)}.", "Name a folder, zip or tar.")
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                return _sort_out(path.name, _zip(archive), lambda e: archive.open(e.source), table)
        if tarfile.is_tarfile(path):
            with tarfile.open(path) as archive:
                return _sort_out(path.name, _tar(archive), lambda e: archive.extractfile(e.source), table)
    except (zipfile.BadZipFile, tarfile.TarError, zlib.error, EOFError, OSError, RuntimeError) as error:
        hint = "Pack it again, or hand in the folder."
        raise MuslinError(f"{paths.shown(path)} cannot be read: {error}.", hint) from None
    raise MuslinError(f"{paths.shown(path)} is neither a folder nor a zip nor a tar.")


def _folder(root: Path) -> Iterator[_Entry]:
    """Files below a folder, links never followed, breadth first."""
    waiting, count = [(root, PurePosixPath())], 0
    while waiting:
        folder, inside = waiting.pop(0)
        with os.scandir(folder) as found:
            for item in sorted(found, key=lambda item: item.name):
                count += 1
                if count > MOST_ENTRIES:
                    raise MuslinError(f"{paths.shown(root)} holds more than {MOST_ENTRIES} files.")
                if item.is_dir(follow_symlinks=False):
                    if item.name not in _IGNORED_FOLDERS:
                        waiting.append((Path(item.path), inside / item.name))
                else:
                    yield _Entry(inside / item.name, item.is_file(follow_symlinks=False), item.path)


def _read_file(entry: _Entry) -> IO[bytes]:
    # NONBLOCK: what is no regular file any more must not keep us waiting
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    descriptor = os.open(str(entry.source), flags)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError("it is not a regular file any more")
    return os.fdopen(descriptor, "rb")


def _zip(archive: zipfile.ZipFile) -> list[_Entry]:
    if len(archive.infolist()) > MOST_ENTRIES:
        raise MuslinError(f"The zip holds more than {MOST_ENTRIES} entries.")
    entries: list[_Entry] = []
    for info in archive.infolist():
        kind = stat.S_IFMT(info.external_attr >> 16)
        if not info.is_dir():
            entries.append(_Entry(PurePosixPath(info.filename), kind in (0, stat.S_IFREG), info))
    return entries


def _tar(archive: tarfile.TarFile) -> list[_Entry]:
    entries: list[_Entry] = []
    while (member := archive.next()) is not None:
        if len(entries) >= MOST_ENTRIES or member.offset_data + member.size > LARGEST_ARCHIVE:
            raise MuslinError(
                f"The tar holds more than {MOST_ENTRIES} entries or {LARGEST_ARCHIVE // 10**6} MB."
            )
        if not member.isdir():
            entries.append(_Entry(PurePosixPath(member.name), member.isreg(), member))
    return entries


def _sort_out(name: str, entries: list[_Entry], read: Callable[[_Entry], Any], table: Assignment) -> Handed:
    """The task files among the entries; the one nearest the top wins, two at the same depth are refused."""
    wanted: dict[str, list[_Entry]] = {file: [] for file in table.files}
    notes, extra = [], []
    for entry in entries:
        parts = entry.path.parts
        if not parts or _IGNORED_FOLDERS & set(parts[:-1]) or parts[-1].startswith("._"):
            continue
        if entry.path.is_absolute() or ".." in parts:
            notes.append(f"{entry.path}: passed over, its path leaves the archive.")
        elif parts[-1] in wanted:
            wanted[parts[-1]].append(entry)
        elif parts[-1].endswith((".py", ".pth", ".so")) and parts[-1] != MANIFEST:
            extra.append(str(entry.path))
    files, refused = {}, {}
    for file, found in wanted.items():
        depth = min((len(entry.path.parts) for entry in found), default=0)
        nearest = [entry for entry in found if len(entry.path.parts) == depth]
        if not found:
            refused[file] = f"{file} is missing. Hand it in with the others, under this name."
        elif len(nearest) > 1:
            where = " and ".join(str(entry.path) for entry in nearest[:3])
            refused[file] = f"There are {len(nearest)} files {file} ({where}). Hand in one."
        elif not nearest[0].regular:
            refused[file] = f"{file} is a link or a device, not a file. Hand in the file itself."
        else:
            if len(found) > 1:
                notes.append(f"There are {len(found)} files {file}: {nearest[0].path} was graded.")
            try:
                with read(nearest[0]) as stream:
                    data = stream.read(LARGEST_FILE + 1)
            except (OSError, zipfile.BadZipFile, zlib.error, RuntimeError, tarfile.TarError) as error:
                refused[file] = f"{file} cannot be read: {error}."
                continue
            if len(data) > LARGEST_FILE:
                refused[file] = f"{file} is larger than {LARGEST_FILE // 1000} kB. Hand in your code only."
            else:
                files[file] = data
    if extra:
        more = f" and {len(extra) - 5} more" if len(extra) > 5 else ""
        notes.append(f"Not task files, so not used: {', '.join(extra[:5])}{more}.")
    digest = hashlib.sha256()
    for file in sorted(files):
        digest.update(f"{file} {len(files[file])}\n".encode() + files[file])
    found_as = {file: hashlib.sha256(data).hexdigest() for file, data in files.items()}
    return Handed(files, refused, Submission(name, digest.hexdigest(), found_as, tuple(notes)))
