"""A folder, zip or tar becomes the bytes of the task files, and nothing else.

Nothing is ever unpacked to disk: entries are looked at by name, the task files are read up to a cap, links,
devices and paths that climb are passed over. So neither `..` nor a bomb has anything to work on.
"""

from __future__ import annotations

import bz2
import gzip
import hashlib
import io
import lzma
import os
import stat
import tarfile
import zipfile
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

#: Most bytes of an archive taken at once: a list of contents, a name, a piece of a file.
LARGEST_READ = 8_000_000
#: Most notes on what was passed over, and longest name in one [characters].
MOST_NOTES, LONGEST_NAME = 5, 120

#: Entries nobody handed in on purpose.
_IGNORED_FOLDERS = {"__MACOSX", "__pycache__", ".git", ".venv", ".vscode", ".idea", ".taichi", ".muslin"}


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
            return _sort_out(path.resolve().name, list(_folder(path)), _read_file, table)
        if not path.is_file():
            raise MuslinError(f"There is no submission {paths.shown(path)}.", "Name a folder, zip or tar.")
        if zipfile.is_zipfile(path):
            with _Guarded(path.open("rb")) as raw, zipfile.ZipFile(raw) as archive:
                return _sort_out(path.name, _zip(archive), lambda e: archive.open(e.source), table)
        with _Guarded(_unpacked(path)) as raw, tarfile.open(fileobj=raw, mode="r:") as archive:
            return _sort_out(path.name, _tar(archive), lambda e: archive.extractfile(e.source), table)
    except MuslinError:
        raise
    except tarfile.ReadError:
        raise MuslinError(f"{paths.shown(path)} is neither a folder nor a zip nor a tar.") from None
    except Exception as error:  # what readers raise on damaged or hostile archives has no end
        hint = "Pack it again, or hand in the folder."
        raise MuslinError(f"{paths.shown(path)} cannot be read: {_shown(error)}.", hint) from None


class _Guarded:
    """An open archive that refuses to be read in larger pieces, or further, than an honest one needs."""

    def __init__(self, stream: IO[bytes]):
        self._stream = stream

    def __enter__(self) -> _Guarded:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def read(self, size: int = -1) -> bytes:
        """Up to `size` bytes."""
        if size < 0:
            size = LARGEST_READ
        if size > LARGEST_READ or self._stream.tell() > LARGEST_ARCHIVE:
            raise OSError("it holds too much")
        return self._stream.read(size)

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        if offset > LARGEST_ARCHIVE:
            raise OSError("it holds too much")
        return self._stream.seek(offset, whence)


def _unpacked(path: Path) -> IO[bytes]:
    """A file, decompressed on the fly if it is compressed."""
    with path.open("rb") as stream:
        magic = stream.read(6)
    for start, opened in ((b"\x1f\x8b", gzip.open), (b"BZh", bz2.open), (b"\xfd7zXZ\0", lzma.open)):
        if magic.startswith(start):
            return opened(path, "rb")  # type: ignore[return-value]
    return path.open("rb")


def _shown(text: object) -> str:
    """Short text that any file can hold."""
    shown = str(text).encode("utf-8", "replace").decode()
    return shown if len(shown) <= LONGEST_NAME else shown[:LONGEST_NAME] + "..."


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
            entries.append(
                _Entry(PurePosixPath(info.filename.replace("\\", "/")), kind in (0, stat.S_IFREG), info)
            )
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
    notes: list[str] = []
    extra, leaving = [], []
    for entry in entries:
        parts = entry.path.parts
        if not parts or _IGNORED_FOLDERS & set(parts[:-1]) or parts[-1].startswith("._"):
            continue
        if entry.path.is_absolute() or ".." in parts:
            leaving.append(_shown(entry.path))
        elif parts[-1] in wanted:
            wanted[parts[-1]].append(entry)
        elif parts[-1].endswith((".py", ".pth", ".so")) and parts[-1] != MANIFEST:
            extra.append(_shown(entry.path))
    files, refused = {}, {}
    for file, found in wanted.items():
        depth = min((len(entry.path.parts) for entry in found), default=0)
        nearest = [entry for entry in found if len(entry.path.parts) == depth]
        if not found:
            refused[file] = f"{file} is missing. Hand it in with the others, under this name."
        elif len(nearest) > 1:
            where = " and ".join(_shown(entry.path) for entry in nearest[:3])
            refused[file] = f"There are {len(nearest)} files {file} ({where}). Hand in one."
        elif not nearest[0].regular:
            refused[file] = f"{file} is a link or a device, not a file. Hand in the file itself."
        else:
            if len(found) > 1:
                notes.append(f"There are {len(found)} files {file}: {_shown(nearest[0].path)} was graded.")
            try:
                with read(nearest[0]) as stream:
                    data = stream.read(LARGEST_FILE + 1)
            except Exception as error:  # damaged, encrypted, gone
                refused[file] = f"{file} cannot be read: {_shown(error)}."
                continue
            if len(data) > LARGEST_FILE:
                refused[file] = f"{file} is larger than {LARGEST_FILE // 1000} kB. Hand in your code only."
            else:
                files[file] = data
    for found_too, what in (
        (leaving, "Passed over, their paths leave the archive"),
        (extra, "Not task files, so not used"),
    ):
        if found_too:
            more = f" and {len(found_too) - MOST_NOTES} more" if len(found_too) > MOST_NOTES else ""
            notes.append(f"{what}: {', '.join(found_too[:MOST_NOTES])}{more}.")
    digest = hashlib.sha256()
    for file in sorted(files):
        digest.update(f"{file} {len(files[file])}\n".encode() + files[file])
    found_as = {file: hashlib.sha256(data).hexdigest() for file, data in files.items()}
    return Handed(files, refused, Submission(_shown(name), digest.hexdigest(), found_as, tuple(notes)))
