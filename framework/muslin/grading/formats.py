"""What a file is, known by how it begins or how its name ends."""

from __future__ import annotations

import contextlib
import os
import re
import tarfile
from typing import IO

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
