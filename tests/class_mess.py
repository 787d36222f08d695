"""Downloads as a teaching assistant has them: four platforms, and of each student what students really hand in.

    python tests/class_mess.py DIR

writes them into DIR/canvas, DIR/moodle, DIR/gradescope and DIR/github, for a run by hand.
"""

from __future__ import annotations

import io
import lzma
import os
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

from muslin import tasks
from muslin.base import paths

TABLE = tasks.assignment("cloth")
STUBS = {file: (paths.assignment("cloth") / file).read_bytes() for file in TABLE.files}

Files = Mapping[str, bytes]


def zipped(files: Files, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo("placeholder")
            info.filename, info.compress_type = (
                name,
                method,
            )  # as it is: ZipInfo itself would turn backslashes
            archive.writestr(info, data)
    return stream.getvalue()


def locked(files: Files) -> bytes:
    """A zip whose entries say that they are encrypted."""
    data = bytearray(zipped(files, zipfile.ZIP_STORED))
    for mark, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = data.find(mark)
        while at >= 0:
            data[at + flags] |= 1
            at = data.find(mark, at + 1)
    return bytes(data)


def tarred(files: Files) -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as archive:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return stream.getvalue()


def in_folder(folder: str, files: Files = STUBS) -> dict[str, bytes]:
    return {f"{folder}/{name}": data for name, data in files.items()}


def renamed(old: str, new: str) -> dict[str, bytes]:
    return {new if name == old else name: data for name, data in STUBS.items()}


LITTER = {
    ".DS_Store": b"\0", "Thumbs.db": b"\0", "desktop.ini": b"[x]", "venv/pyvenv.cfg": b"home = x",
    "venv/lib/python3.11/site-packages/stress.py": b"evil = 1\n", "__pycache__/stress.cpython-311.pyc": b"\0",
}  # fmt: skip
MAC = {f"__MACOSX/._{name}": b"\0\5\x16\7" for name in STUBS}

#: What is graded: the files of an upload, and what its notes must say.
GRADED: dict[str, tuple[Files, str]] = {
    "loose files": (STUBS, ""),
    "a zip": ({"cloth.zip": zipped(STUBS)}, ""),
    "a tgz": ({"cloth.tgz": subprocess.run(["gzip"], input=tarred(STUBS), capture_output=True).stdout}, ""),
    "a tar.xz": ({"my.cloth.tar.xz": lzma.compress(tarred(in_folder("作业/cloth")))}, ""),
    "a zip in a zip": ({"cloth.zip": zipped({"cloth.zip": zipped(STUBS)})}, ""),
    "a zip of a Mac": ({"cloth.zip": zipped({**in_folder("cloth"), **MAC})}, ""),
    "a zip of old Windows": ({"cloth.zip": zipped({f"Übung\\cloth\\{n}": d for n, d in STUBS.items()})}, ""),
    "two endings": ({"cloth.zip.zip": zipped(STUBS)}, ""),
    "litter": ({"cloth.zip": zipped({**LITTER, **in_folder("a/b/c")})}, ""),
    "another case": (renamed("stress.py", "Stress.py"), "Stress.py was graded in its place"),
    "two endings of a file": (renamed("stress.py", "stress.py.txt"), "stress.py.txt was graded in its place"),
    "downloaded twice": (renamed("stress.py", "stress (1).py"), "stress (1).py was graded in its place"),
    "one is a notebook": (
        renamed("stress.py", "stress.ipynb"),
        "stress.py is missing; there is stress.ipynb",
    ),
    "only one file": ({"stress.py": STUBS["stress.py"]}, "collision.py is missing"),
    "one is a RAR": (
        {**{n: d for n, d in STUBS.items() if n != "psi.py"}, "more.rar": b"Rar!\x1a\x07\1"},
        "",
    ),
}

#: What is not: and the words its reason must have.
REFUSED: dict[str, tuple[Files, str]] = {
    "a password": ({"cloth.zip": locked(STUBS)}, "password"),
    "a 7z": ({"cloth.7z": b"7z\xbc\xaf\x27\x1c and so on"}, "7z archive"),
    "a RAR": ({"cloth.rar": b"Rar!\x1a\x07\1\0 and so on"}, "RAR archive"),
    "an empty zip": ({"cloth.zip": zipped({})}, "empty"),
    "an empty file": ({"cloth.zip": b""}, "empty file"),
    "a notebook": ({"cloth.ipynb": b'{"cells": []}'}, "cloth.ipynb"),
    "a PDF": ({"report.pdf": b"%PDF-1.7"}, "report.pdf"),
    "a Word document": ({"report.docx": zipped({"word/document.xml": b"<x/>"})}, "report.docx"),
    "a damaged zip": ({"cloth.zip": zipped(STUBS)[:3000]}, "damaged or was cut off"),
    "empty task files": ({name: b"" for name in STUBS}, "empty"),
    "another assignment": ({"main.py": b"print(1)\n", "README.md": b"my work"}, "main.py"),
    "a page saved instead": ({"cloth.zip": b"<!DOCTYPE html><html>Log in</html>"}, "web page"),
}

EVERYTHING = {**GRADED, **REFUSED}

#: Names of students, in turn; some differ in little, some only in what no key can show.
NAMES = (
    "Alice", "alice", "Zoë Ångström", "李小龙", "محمد", "Jane Doe", "jane doe", "=1+1", "O'Hara, Tim", "🧵",
    "van der Berg", "a;b=c", "<b>Ann", "Jane_Doe", "Šimić",
)  # fmt: skip


def _put(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def canvas(home: Path) -> dict[str, str]:
    """Flat files; groups whose names hold numbers, late and anonymous students; a typed link."""
    expected = {}
    upload = 90001
    for number, (kind, (files, _)) in enumerate(EVERYTHING.items()):
        name = ("doejane", "team_red", "group_1", "group_2_LATE", "anon", "李小龙")[number % 6] + "x" * (
            number // 6
        )
        id = f"x9{number:02}Q" if name.startswith("anon") else f"{11111 + number}"
        name = "anon" if name.startswith("anon") else name
        for inside, data in files.items():
            _put(home / f"{name}_{id}_{upload}_{inside}", data)
            upload += 1
        expected[id] = kind
    _put(home / "roejim_LATE_55555_link.html", b"<a href='https://example.org'>my work</a>")
    _put(home / "roejim_LATE_55555_text.html", b"<p>see the link</p>")
    expected["55555"] = "typed"
    return expected


def moodle(home: Path) -> dict[str, str]:
    """A folder per student and plug-in, as Moodle of today writes them."""
    expected = {}
    for number, (kind, (files, _)) in enumerate(EVERYTHING.items()):
        name = f"{NAMES[number % len(NAMES)]}_{700 + number}"
        for inside, data in files.items():
            _put(home / f"{name}_assignsubmission_file_" / inside, data)
        _put(home / f"{name}_assignsubmission_onlinetext_" / "onlinetext.html", b"<p>done</p>")
        expected[str(700 + number)] = kind
    _put(home / "Only Text_799_assignsubmission_onlinetext_" / "onlinetext.html", b"<p>I could not.</p>")
    expected["799"] = "typed"
    return expected


def gradescope(home: Path) -> dict[str, str]:
    """Folders with numbers and the metadata; one student in it has no folder."""
    expected, lines = {}, ["---"]
    for number, (kind, (files, _)) in enumerate([*EVERYTHING.items(), ("not there", ({}, ""))]):
        for inside, data in files.items():
            _put(home / "assignment_1_export" / f"submission_{number}" / inside, data)
        name = NAMES[number % len(NAMES)].replace("'", "''")
        lines += [
            f"submission_{number}:", "  :submitters:", f"  - :name: '{name}'", f"    :sid: 's{number}'",
            "  :created_at: !ruby/object:ActiveSupport::TimeWithZone",
            f"    utc: &{number} 2026-01-02 10:30:00 Z", "    zone: !ruby/object:ActiveSupport::TimeZone",
            "      name: Europe/Berlin", f"    time: *{number}",
        ]  # fmt: skip
        expected[f"s{number}"] = kind
    _put(home / "assignment_1_export" / "submission_metadata.yml", "\n".join(lines).encode())
    return expected


def github(home: Path) -> dict[str, str]:
    """Clones, in the folder that GitHub's command makes; in two the work lies deeper, one is empty."""
    expected = {}
    for number, (kind, (files, _)) in enumerate(EVERYTHING.items()):
        clone = home / "cloth-submissions" / f"cloth-user{number:02}"
        (clone / ".git").mkdir(parents=True)
        for inside, data in files.items():
            _put(clone / ("work" if number % 5 == 0 else "") / inside, data)
        expected[f"user{number:02}"] = kind
    (home / "cloth-submissions" / "cloth-nobody" / ".git").mkdir(parents=True)
    with open(home / "cloth-submissions" / "cloth-user00" / "talk.mp4", "wb") as film:
        os.truncate(film.fileno(), 300_000_000)
    (home / "roster.csv").write_text("identifier,github_username\n")
    expected["nobody"] = "an empty repository"
    return expected


LAYOUTS: dict[str, Callable[[Path], dict[str, str]]] = {
    "canvas": canvas, "moodle": moodle, "gradescope": gradescope, "github": github,
}  # fmt: skip

#: Reasons of those that are no kind of `EVERYTHING`.
MORE = {
    "typed": "There is no task file in it", "not there": "not in the download", "an empty repository": "empty",
}  # fmt: skip

if __name__ == "__main__":
    for layout, make in LAYOUTS.items():
        print(layout, len(make(Path(sys.argv[1]) / layout)))
