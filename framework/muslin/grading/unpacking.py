"""What is in a folder or an archive, read in a process that may take little time and memory.

`main` runs in a child of its own (`muslin.grading.submission` starts it) and imports the standard library only.
Nothing is ever unpacked to disk: entries are looked at by name, what may be a task file is read up to a cap,
archives inside are opened where something is missing without them. Links, devices and paths that climb are passed
over, and what no student's tool makes (sparse files, headers of megabytes) is refused.
"""

from __future__ import annotations

import base64
import bz2
import contextlib
import gzip
import io
import json
import lzma
import os
import re
import stat
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import PurePosixPath
from typing import IO, Any, NamedTuple

from muslin.grading.choosing import CHANGED, UNREAD, Entry, chosen, nearness

#: Largest task file [bytes]; a long honest one has 10 kB.
LARGEST_FILE = 1_000_000
#: Most that is read of files that may be task files, of archives inside, and of one compressed stream [bytes].
MOST_READ, LARGEST_INSIDE, LARGEST_STREAM = 50_000_000, 200_000_000, 1_000_000_000
#: Most files that are looked at in one folder or archive, those in folders nobody hands in on purpose left out.
MOST_ENTRIES = 20_000
#: Most archives that are opened, and how deep they may lie in each other.
MOST_ARCHIVES, DEEPEST = 10, 3
#: Longest header of a tar for a long name or attributes [bytes]; tools write some hundred.
LONGEST_HEADER = 65_536

#: Folders nobody hands in on purpose; those whose name begins with a dot are passed over as well.
IGNORED = {"__macosx", "__pycache__", "node_modules", "venv", "env", "site-packages", "$recycle.bin"}
#: Files that systems leave in every folder.
LITTER = {".ds_store", "thumbs.db", "desktop.ini", ".localized", ".gitignore", ".gitattributes"}

#: How an archive inside another is known: by the end of its name.
ARCHIVES = re.compile(
    r"\.(zip|tar|tgz|tbz2?|txz|(tar\.)?(gz|bz2|xz|zst|lzma|z)|rar|7z|zipx|cab|arj|lzh)$", re.IGNORECASE
)

#: How a file is known whatever its name. In capitals: what can be opened; otherwise what it is, in words.
MAGIC: tuple[tuple[bytes, str], ...] = (
    (b"PK\x03\x04", "ZIP"),
    (b"PK\x05\x06", "ZIP"),
    (b"\x1f\x8b", "GZIP"),
    (b"BZh", "BZIP2"),
    (b"\xfd7zXZ\0", "XZ"),
    (b"Rar!\x1a\x07", "a RAR archive"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive"),
    (b"\x1f\x9d", "a Unix compress archive"),
    (b"MSCF", "a cabinet archive"),
    (b"%PDF", "a PDF"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Office document"),
    (b"{\\rtf", "an RTF document"),
    (b"\x89PNG", "a picture"),
    (b"\xff\xd8\xff", "a picture"),
    (b"GIF8", "a picture"),
    (b"\x7fELF", "a program"),
    (b"MZ", "a program"),
    (b"version https://git-lfs", "a pointer of Git LFS without its file"),
)

#: Known by the end of their name.
DOCUMENTS = {
    ".docx": "a Word document", ".pages": "a Pages document", ".odt": "a text document", ".xlsx": "a spreadsheet",
    ".pptx": "a presentation", ".key": "a presentation", ".ipynb": "a Jupyter notebook", ".pdf": "a PDF",
    ".html": "a web page", ".htm": "a web page", ".txt": "a text", ".md": "a text", ".whl": "a Python package",
    ".jar": "a Java program", ".npz": "an array file", ".mp4": "a film", ".mov": "a film", ".webm": "a film",
}  # fmt: skip

#: Those of them that are zips inside.
ZIPPED = {
    "a Word document", "a Pages document", "a text document", "a spreadsheet", "a presentation",
    "a Python package", "a Java program", "an array file",
}  # fmt: skip


class Refused(Exception):
    """Something that cannot be read, with the reason."""


class Item(NamedTuple):
    """A file in a folder or an archive; `opened` gives its content, for as long as the walk stands at it."""

    path: str
    regular: bool
    opened: Callable[[], IO[bytes]]


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


def look(sources: Sequence[tuple[str, str, int]], wanted: Sequence[str]) -> Found:
    """Everything in a submission that matters.

    Parameters
    ----------
    sources : sequence of (name, path, upload)
        What was handed in: folders and files; `name` is the path inside the submission, empty for all of it.
        Of two uploads, the one with the larger number is newer.
    wanted : sequence of str
        Names of the task files.
    """
    found = Found(tuple(wanted))
    for name, path, upload in sources:
        try:
            if stat.S_ISDIR(os.lstat(path).st_mode):
                _take(found, name, upload, 0, _folder(path))
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
        with _file(path) as stream:
            kind = kind_of(stream, shown)
    if kind in _READERS:
        found.waiting.append(Archive(shown, name, upload, 1, partial(_file, path)))
    elif ARCHIVES.search(shown) or (kind and not name):
        found.closed[shown] = _no_archive(kind)
    else:
        _take(found, "", upload, 0, iter([Item(shown, True, partial(_file, path))]))


def kind_of(stream: IO[bytes], name: str) -> str:
    """What a file is: in capitals if it can be opened, else in words; empty if nobody knows."""
    start = stream.read(512)
    if not start:
        return "an empty file"
    document = DOCUMENTS.get(os.path.splitext(name)[1].lower(), "")
    for magic, kind in MAGIC:
        if start.startswith(magic):
            return document if kind == "ZIP" and document in ZIPPED else kind
    if start[257:262] == b"ustar":
        return "TAR"
    if start.lstrip()[:14].lower().startswith((b"<!doctype html", b"<html")):
        return "a web page"
    with contextlib.suppress(tarfile.TarError):
        tarfile.TarInfo.frombuf(start, "utf-8", "surrogateescape")
        return "TAR"
    return document


def _no_archive(kind: str) -> str:
    return f"it is {kind}" if kind else "it is neither a zip nor a tar"


def _unpack(found: Found, archive: Archive) -> None:
    """Take what is in an archive."""
    try:
        with archive.opened() as stream:
            kind = kind_of(stream, archive.path)
            stream.seek(0)
            if kind not in _READERS:
                raise Refused(_no_archive(kind))
            items = _READERS[kind](stream, archive.path)
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


def ignored(folder: str) -> bool:
    """Whether a folder of this name is one that nobody hands in on purpose."""
    return folder.lower() in IGNORED or (folder.startswith(".") and folder not in (".", ".."))


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


# Readers --------------------------------------------------------------------------------------------------


def _folder(root: str) -> Iterator[Item]:
    """Files below a folder, links never followed, breadth first."""
    waiting, count = [(root, "")], 0
    while waiting:
        folder, inside = waiting.pop(0)
        try:
            with os.scandir(folder) as scan:
                items = sorted(scan, key=lambda item: item.name)
        except OSError:
            if folder == root:
                raise
            continue
        if folder != root and any(item.name == "pyvenv.cfg" for item in items):
            continue  # a virtual environment, whatever it is called
        for item in items:
            name = f"{inside}{readable(item.name)}"
            if not item.is_dir(follow_symlinks=False):
                yield Item(name, item.is_file(follow_symlinks=False), partial(_file, item.path))
            elif not ignored(item.name):
                waiting.append((item.path, f"{name}/"))
                count += 1
                if count > MOST_ENTRIES:
                    raise Refused(f"it holds more than {MOST_ENTRIES} folders")


def readable(name: str) -> str:
    """A file's name as text, whatever the locale and whoever wrote it: UTF-8, or else Latin-1."""
    raw = os.fsencode(name)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _file(path: str) -> IO[bytes]:
    # NONBLOCK: what is no regular file any more must not keep us waiting
    flags = (
        os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    )
    descriptor = os.open(path, flags)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise Refused("it is not a regular file")
    return os.fdopen(descriptor, "rb")


def _zip(stream: IO[bytes], _: str) -> Iterator[Item]:
    with zipfile.ZipFile(stream) as archive:
        for info in archive.infolist():
            kind = stat.S_IFMT(info.external_attr >> 16)
            if not info.is_dir():
                yield Item(_zip_name(info), kind in (0, stat.S_IFREG), partial(_zipped, archive, info))


def _zip_name(info: zipfile.ZipInfo) -> str:
    """A name in a zip: slashes for Windows' backslashes, UTF-8 where it was not declared."""
    name = info.filename
    if not info.flag_bits & 0x800:  # read as cp437
        with contextlib.suppress(UnicodeError):
            name = name.encode("cp437").decode("utf-8")
    return name.replace("\\", "/")


def _zipped(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> IO[bytes]:
    if info.flag_bits & 1:
        raise Refused("it has a password")
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise Refused(f"it is packed in an unusual way (method {info.compress_type}). Pack an ordinary zip")
    return archive.open(info)


def _tar(stream: IO[bytes], _: str) -> Iterator[Item]:
    """Members of a tar, header by header: `tarfile` itself can be kept busy for long by what headers say."""
    long, size = "", 0
    while block := _exactly(stream, tarfile.BLOCKSIZE, none=True):
        if not any(block):
            return
        info = tarfile.TarInfo.frombuf(block, "utf-8", "surrogateescape")
        if info.size < 0:
            raise tarfile.ReadError
        padded = -(-info.size // tarfile.BLOCKSIZE) * tarfile.BLOCKSIZE
        if info.type == tarfile.GNUTYPE_SPARSE:
            raise Refused("it holds sparse files, which no ordinary tool packs")
        if info.type in (tarfile.XHDTYPE, tarfile.SOLARIS_XHDTYPE, *_LONG):
            if info.size > LONGEST_HEADER:
                raise Refused("it has headers that no ordinary tool writes")
            data = _exactly(stream, padded)[: info.size]
            if info.type == tarfile.GNUTYPE_LONGNAME:
                long = data.rstrip(b"\0").decode("utf-8", "surrogateescape")
            elif info.type not in _LONG:
                long, size = _extended(data)
            continue
        if size:
            padded = -(-size // tarfile.BLOCKSIZE) * tarfile.BLOCKSIZE
        body = _Body(stream, size or info.size)
        if not info.isdir() and info.type != tarfile.XGLTYPE:
            yield Item(long or info.name, info.isreg(), partial(_itself, body))
        if info.type not in _EMPTY:
            _skip(stream, padded - body.taken)
        long, size = "", 0


#: Headers that carry a long name; kinds of member that have no content.
_LONG = (tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
_EMPTY = (
    tarfile.DIRTYPE,
    tarfile.LNKTYPE,
    tarfile.SYMTYPE,
    tarfile.CHRTYPE,
    tarfile.BLKTYPE,
    tarfile.FIFOTYPE,
)


def _itself(body: _Body) -> IO[bytes]:
    return body  # type: ignore[return-value]


def _extended(data: bytes) -> tuple[str, int]:
    """Name and size that an extended header (POSIX.1-2001) gives the next member."""
    name, size = "", 0
    while match := re.match(rb"(\d{1,6}) ([^=\n]{1,256})=", data):
        value = data[match.end() : int(match[1]) - 1]
        if match[2].startswith(b"GNU.sparse"):
            raise Refused("it holds sparse files, which no ordinary tool packs")
        if match[2] == b"path":
            name = value.decode("utf-8", "surrogateescape")
        elif match[2] == b"size" and value.isdigit() and len(value) < 16:
            size = int(value)
        data = data[max(int(match[1]), match.end()) :]
    return name, size


class _Body(io.RawIOBase):
    """The content of a member, read from where the stream stands."""

    def __init__(self, stream: IO[bytes], size: int):
        self._stream, self._left, self.taken = stream, size, 0

    def read(self, size: int = -1) -> bytes:
        """Up to `size` bytes."""
        wanted = self._left if size < 0 else min(size, self._left)
        data = _exactly(self._stream, wanted)
        self._left -= len(data)
        self.taken += len(data)
        return data


def _exactly(stream: IO[bytes], size: int, none: bool = False) -> bytes:
    """That many bytes; none at all at the end, where that may be."""
    data = bytearray()
    while len(data) < size and (piece := stream.read(min(size - len(data), 1 << 20))):
        data += piece
    if len(data) < size and (data or not none):
        raise EOFError
    return bytes(data)


def _skip(stream: IO[bytes], size: int) -> None:
    if stream.tell() + size > LARGEST_STREAM:
        raise Refused(f"it holds more than {LARGEST_STREAM // 10**6} MB")
    while size > 0:
        size -= len(_exactly(stream, min(size, 1 << 20)))


def _compressed(opener: Any, stream: IO[bytes], name: str) -> Iterator[Item]:
    """A compressed tar, or a single compressed file."""
    with opener(stream) as plain:
        kind = kind_of(plain, "")
        plain.seek(0)
        if kind == "TAR":
            yield from _tar(plain, name)
        else:
            inside = os.path.splitext(os.path.basename(name))[0] or "file"
            yield Item(inside, True, lambda: plain)


_READERS: dict[str, Callable[[IO[bytes], str], Iterator[Item]]] = {
    "ZIP": _zip,
    "TAR": _tar,
    "GZIP": partial(_compressed, gzip.open),
    "BZIP2": partial(_compressed, bz2.open),
    "XZ": partial(_compressed, lzma.open),
}


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
    picked = chosen(look(sources, request["wanted"]))
    files = {file: base64.b64encode(data).decode() for file, data in picked.files.items()}
    json.dump({**picked._asdict(), "files": files}, sys.stdout)
    sys.stdout.flush()
    os._exit(0)
