"""What is in a folder or an archive, read in a process that may take little time and memory.

`main` runs in a child of its own (`muslin.grading.submission` starts it) and imports the standard library only.
Nothing is ever unpacked to disk: entries are looked at by name, what may be a task file is read up to a cap,
archives inside are opened where something is missing without them. Links, devices and paths that climb are passed
over, and what no student's tool makes (sparse files, headers of megabytes) is refused.
"""

from __future__ import annotations

import base64
import contextlib
import io
import json
import lzma
import os
import stat
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import PurePosixPath
from typing import IO, NamedTuple

from muslin.grading.archives import (
    MOST_ENTRIES,
    READERS,
    Item,
    Refused,
    ignored,
    open_file,
    readable,
    walk,
)
from muslin.grading.choosing import CHANGED, UNREAD, Entry, chosen, nearness
from muslin.grading.formats import ARCHIVES, kind_of

#: Largest task file [bytes]; a long honest one has 10 kB.
LARGEST_FILE = 1_000_000
#: Most that is read of files that may be task files, and of archives inside [bytes].
MOST_READ, LARGEST_INSIDE = 50_000_000, 200_000_000
#: Most archives that are opened, and how deep they may lie in each other.
MOST_ARCHIVES, DEEPEST = 10, 3

#: Files that systems leave in every folder.
LITTER = {".ds_store", "thumbs.db", "desktop.ini", ".localized", ".gitignore", ".gitattributes"}


class Archive(NamedTuple):
    """An archive that is still to be opened: its path, what goes before paths in it, and how deep in others it lies."""

    path: str
    prefix: str
    upload: int
    depth: int
    opened: Callable[[], IO[bytes]]


@dataclass
class Found:
    """What has been found so far; see `choosing.chosen` for what becomes of it.

    Attributes
    ----------
    wanted : tuple of str
        Names of the task files.
    given : tuple of str
        Names of files that students are given beside them, or folder/name: no word is lost about those.
    entries : list of Entry
        What may be a task file, or is named like one.
    others : list of str
        Everything else, by its path.
    leaving : list of str
        Paths that leave the submission.
    closed : dict of str
        Archives and folders that cannot be opened, and why.
    unopened : list of str
        Archives that nobody needed to open.
    """

    wanted: tuple[str, ...]
    given: tuple[str, ...] = ()
    entries: list[Entry] = field(default_factory=list)
    others: list[str] = field(default_factory=list)
    leaving: list[str] = field(default_factory=list)
    closed: dict[str, str] = field(default_factory=dict)
    unopened: list[str] = field(default_factory=list)
    waiting: list[Archive] = field(default_factory=list)
    read: int = 0

    def needs(self, archive: Archive) -> bool:
        """Whether some task file is not there yet, or might be newer in an archive."""
        here = {
            entry.file for entry in self.entries if entry.tier <= CHANGED and entry.upload >= archive.upload
        }
        return not here.issuperset(self.wanted)


def look(sources: Sequence[tuple[str, str, int]], wanted: Sequence[str], given: Sequence[str] = ()) -> Found:
    """Everything in a submission that matters.

    Parameters
    ----------
    sources : sequence of (name, path, upload)
        What was handed in: folders and files; `name` is the path inside the submission, empty for all of it.
        Of two uploads, the one with the larger number is newer.
    wanted : sequence of str
        Names of the task files.
    given : sequence of str
        Names of files that students are given beside them.
    """
    found = Found(tuple(wanted), tuple(given))
    for name, path, upload in sources:
        try:
            if stat.S_ISDIR(os.lstat(path).st_mode):
                _take(found, name, upload, 0, walk(path))
            else:
                _source(found, name, path, upload)
        except (Refused, OSError) as error:
            found.closed[name or readable(os.path.basename(path))] = _why(error)
    opened = 0
    while found.waiting:
        archive = found.waiting.pop(0)
        if not found.needs(archive):
            found.unopened.append(archive.path)
        elif opened >= MOST_ARCHIVES:
            found.closed[archive.path] = f"it is one of more than {MOST_ARCHIVES} archives"
        else:
            opened += 1
            _unpack(found, archive)
    return found


def _source(found: Found, name: str, path: str, upload: int) -> None:
    """A file that was handed in by itself."""
    shown = name or readable(os.path.basename(path))
    kind = ""
    if nearness(shown, found.wanted)[1] == UNREAD:
        with open_file(path) as stream:
            kind = kind_of(stream, shown)
    if kind in READERS:
        found.waiting.append(Archive(shown, name, upload, 1, partial(open_file, path)))
    elif ARCHIVES.search(shown) or (kind and not name):
        found.closed[shown] = _no_archive(kind)
    else:
        _take(found, "", upload, 0, iter([Item(shown, True, partial(open_file, path))]))


def _no_archive(kind: str) -> str:
    return f"it is {kind}" if kind else "it is neither a zip nor a tar"


def _unpack(found: Found, archive: Archive) -> None:
    """Take what is in an archive."""
    try:
        with archive.opened() as stream:
            kind = kind_of(stream, archive.path)
            stream.seek(0)
            if kind not in READERS:
                raise Refused(_no_archive(kind))
            items = READERS[kind](stream, archive.path)
            if not _take(found, archive.prefix, archive.upload, archive.depth, items):
                raise Refused("it is empty")
    except Exception as error:  # what readers raise on damaged or hostile archives has no end
        found.closed[archive.path] = _why(error)


def _take(found: Found, prefix: str, upload: int, depth: int, items: Iterator[Item]) -> int:
    """Sort the files of a folder or an archive: read what may be a task file, put archives aside; gives their count."""
    count = 0
    for item in items:
        path = PurePosixPath(prefix, item.path) if prefix else PurePosixPath(item.path)
        parts = PurePosixPath(item.path).parts
        if not parts or any(ignored(part) for part in parts[:-1]):
            continue
        if parts[-1].lower() in LITTER or parts[-1].startswith("._"):
            continue
        count += 1
        if count > MOST_ENTRIES:
            raise Refused(f"it holds more than {MOST_ENTRIES} files")
        if item.path.startswith("/") or ".." in parts:
            found.leaving.append(str(path))
            continue
        file, tier = nearness(parts[-1], found.wanted)
        if tier < UNREAD:
            data, why = _content(found, item)
            found.entries.append(Entry(str(path), file, tier, upload, depth, data, why))
        elif item.regular and ARCHIVES.search(parts[-1]):
            _put_aside(found, str(path), upload, depth, item)
        elif file:
            found.entries.append(Entry(str(path), file, tier, upload, depth, b"", ""))
        else:
            found.others.append(str(path))
    return count


def _content(found: Found, item: Item) -> tuple[bytes, str]:
    """The bytes of what may be a task file, or why they cannot be used."""
    if not item.regular:
        return b"", "is a link or a device, not a file. Hand in the file itself."
    if found.read > MOST_READ:
        return b"", "was not read: there are too many files of this name."
    try:
        with item.opened() as stream:
            data = stream.read(LARGEST_FILE + 1)
    except Exception as error:  # damaged, encrypted, gone
        return b"", f"cannot be read: {_why(error)}."
    found.read += len(data)
    if len(data) > LARGEST_FILE:
        return b"", f"is larger than {LARGEST_FILE // 1000} kB. Hand in your code only."
    return data, ""


def _put_aside(found: Found, path: str, upload: int, depth: int, item: Item) -> None:
    """Keep an archive for later: from a folder where it lies, from an archive its bytes."""
    if depth >= DEEPEST:
        found.closed[path] = f"it lies in {depth} other archives"
    elif depth == 0:
        found.waiting.append(Archive(path, path, upload, 1, item.opened))
    else:
        data = io.BytesIO()
        try:
            with item.opened() as stream:
                while piece := stream.read(1 << 20):
                    data.write(piece)
                    if data.tell() > LARGEST_INSIDE:
                        raise Refused(f"it is larger than {LARGEST_INSIDE // 10**6} MB")
        except Exception as error:
            found.closed[path] = _why(error)
            return
        found.waiting.append(Archive(path, path, upload, depth + 1, lambda: io.BytesIO(data.getvalue())))


def _why(error: BaseException) -> str:
    """An error as a reason, to follow the name of what it is about or a colon."""
    if isinstance(error, Refused):
        return str(error)
    if isinstance(error, MemoryError):
        return "it takes more memory to unpack than an honest archive"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror[:1].lower() + error.strerror[1:]
    if isinstance(
        error, (zipfile.BadZipFile, zlib.error, lzma.LZMAError, tarfile.TarError, EOFError, OSError)
    ):
        return "it is damaged or was cut off"
    return f"it is damaged ({type(error).__name__})"


def limit(memory: int, seconds: int) -> None:
    """Take little from here on, where the system can see to it."""
    with contextlib.suppress(ImportError):
        import resource

        for what, most in (
            (resource.RLIMIT_AS, memory),
            (resource.RLIMIT_CPU, seconds),
            (resource.RLIMIT_FSIZE, 0),
            (resource.RLIMIT_CORE, 0),
            (resource.RLIMIT_NOFILE, 64),
        ):
            with contextlib.suppress(ValueError, OSError):
                resource.setrlimit(what, (most, most))


def main() -> None:
    """Answer what is on standard input: sources and wanted names; what was chosen goes to standard output."""
    request = json.load(sys.stdin)
    limit(request["memory"], request["seconds"])
    sources = [(name, os.fsdecode(bytes.fromhex(path)), upload) for name, path, upload in request["sources"]]
    picked = chosen(look(sources, request["wanted"], request["given"]))
    files = {file: base64.b64encode(data).decode() for file, data in picked.files.items()}
    json.dump({**picked._asdict(), "files": files}, sys.stdout)
    sys.stdout.flush()
    os._exit(0)
