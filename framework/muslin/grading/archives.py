"""Files in a folder, a zip or a tar, one after another, without unpacking anything to disk.

What no student's tool makes (sparse files, headers of megabytes) is refused. Standard library only, like `unpacking`.
"""

from __future__ import annotations

import bz2
import contextlib
import gzip
import io
import lzma
import os
import re
import stat
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from typing import IO, Any, NamedTuple

from muslin.grading.formats import kind_of

#: Most that is read of one compressed stream [bytes].
LARGEST_STREAM = 1_000_000_000

#: Most files that are looked at in one folder or archive, those in folders nobody hands in on purpose left out.
MOST_ENTRIES = 20_000

#: Longest header of a tar for a long name or attributes [bytes]; tools write some hundred.
LONGEST_HEADER = 65_536

#: Folders nobody hands in on purpose; those whose name begins with a dot are passed over as well.
IGNORED = {"__macosx", "__pycache__", "node_modules", "venv", "env", "site-packages", "$recycle.bin"}

#: Headers that carry a long name; kinds of member that have no content.
LONG_NAMES = (tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
WITHOUT_CONTENT = (
    tarfile.DIRTYPE,
    tarfile.LNKTYPE,
    tarfile.SYMTYPE,
    tarfile.CHRTYPE,
    tarfile.BLKTYPE,
    tarfile.FIFOTYPE,
)


class Refused(Exception):
    """Something that cannot be read, with the reason."""


class Item(NamedTuple):
    """A file in a folder or an archive; `opened` gives its content, for as long as the walk stands at it."""

    path: str
    regular: bool
    opened: Callable[[], IO[bytes]]


def ignored(folder: str) -> bool:
    """Whether a folder of this name is one that nobody hands in on purpose."""
    return folder.lower() in IGNORED or (folder.startswith(".") and folder not in (".", ".."))


def walk(root: str) -> Iterator[Item]:
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
                yield Item(name, item.is_file(follow_symlinks=False), partial(open_file, item.path))
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


def open_file(path: str) -> IO[bytes]:
    """A regular file, opened."""
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
        if info.type in (tarfile.XHDTYPE, tarfile.SOLARIS_XHDTYPE, *LONG_NAMES):
            if info.size > LONGEST_HEADER:
                raise Refused("it has headers that no ordinary tool writes")
            data = _exactly(stream, padded)[: info.size]
            if info.type == tarfile.GNUTYPE_LONGNAME:
                long = data.rstrip(b"\0").decode("utf-8", "surrogateescape")
            elif info.type not in LONG_NAMES:
                long, size = _extended(data)
            continue
        if size:
            padded = -(-size // tarfile.BLOCKSIZE) * tarfile.BLOCKSIZE
        body = _Body(stream, size or info.size)
        if not info.isdir() and info.type != tarfile.XGLTYPE:
            yield Item(long or info.name, info.isreg(), partial(_itself, body))
        if info.type not in WITHOUT_CONTENT:
            _skip(stream, padded - body.taken)
        long, size = "", 0


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


READERS: dict[str, Callable[[IO[bytes], str], Iterator[Item]]] = {
    "ZIP": _zip,
    "TAR": _tar,
    "GZIP": partial(_compressed, gzip.open),
    "BZIP2": partial(_compressed, bz2.open),
    "XZ": partial(_compressed, lzma.open),
}
