"""Files are written whole or not at all; a store that was damaged is as none; no name steers a terminal."""

import os
import subprocess
import sys

import numpy as np
import pytest

from muslin.base import paths, writing
from muslin.base.errors import MuslinError
from muslin.grading.kernels import Store, tidy

MUSLIN = [sys.executable, "-c", "from muslin.cli import main; main()"]
ESCAPE = "\x1b]0;owned\x07\x1b[2J\u202e"


@pytest.mark.parametrize("private", [False, True])
def test_a_file_is_replaced_whole(tmp_path, private):
    path = tmp_path / "new" / "report.html"
    writing.write(path, b"old")
    writing.write(path, b"new", private=private)
    assert path.read_bytes() == b"new"
    assert os.listdir(path.parent) == ["report.html"]
    if os.name == "posix":
        assert path.stat().st_mode & 0o077 == (0 if private else 0o044)


def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    writing.write(path, b"old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(MuslinError, match=r"report\.html cannot be written: No space left"):
        writing.write(path, b"new")
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["report.html"]


def test_a_link_is_replaced_and_not_followed(tmp_path):
    (tmp_path / "precious").write_bytes(b"mine")
    (tmp_path / "report.html").symlink_to(tmp_path / "precious")
    writing.write(tmp_path / "report.html", b"new")
    assert (tmp_path / "precious").read_bytes() == b"mine"
    assert (tmp_path / "report.html").read_bytes() == b"new"


def _kept(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    store = Store("some submission")
    store.save("stress.py", {"kernels/a.tcb": np.arange(200, dtype=np.uint8)})
    (file,) = (tmp_path / "muslin" / "grading").glob("*/*.npz")
    assert set(store.load("stress.py")) == {"kernels/a.tcb"}
    return store, file


def _cut(file):
    file.write_bytes(file.read_bytes()[:-40])


def _flipped(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 255
    file.write_bytes(data)


def _others(file):
    with open(file, "wb") as stream:
        np.savez(stream, **{"../../outside": np.zeros(3, dtype=np.uint8)})


def _numbers(file):
    with open(file, "wb") as stream:
        np.save(stream, np.zeros(3))


def _objects(file):
    with open(file, "wb") as stream:
        np.savez(stream, **{"kernels/a": np.array([{}], dtype=object)})


def _folder(file):
    file.unlink()
    file.mkdir()


@pytest.mark.parametrize(
    "damage",
    [
        _cut, _flipped, _others, _numbers, _objects, _folder,
        lambda file: file.write_bytes(b""),
        lambda file: file.write_bytes(b"PK\x03\x04 and nothing"),
        lambda file: file.write_bytes(b"\x93NUMPY\x01\x00\xff\xff{'descr'"),
    ],
)  # fmt: skip
def test_a_damaged_store_of_kernels_is_as_none(monkeypatch, tmp_path, damage):
    store, file = _kept(monkeypatch, tmp_path)
    damage(file)
    assert store.load("stress.py") == {}
    (file.parent.parent / "no folder").write_bytes(b"x")
    tidy()


def test_stores_beyond_the_limit_go_oldest_first(monkeypatch, tmp_path):
    monkeypatch.setattr("muslin.grading.kernels.LARGEST_TOTAL", 1000)
    _, file = _kept(monkeypatch, tmp_path)
    old = file.parent.parent / "old"
    old.mkdir()
    (old / "part.npz").write_bytes(bytes(900))
    (file.parent.parent / "oldest").mkdir()
    (file.parent.parent / "oldest" / "part.npz").write_bytes(bytes(10))
    for name, age in (("old", 100), ("oldest", 50)):
        os.utime(file.parent.parent / name, (age, age))
    tidy()
    assert [entry.name for entry in file.parent.parent.iterdir()] == [file.parent.name]


def test_no_name_and_no_error_steers_a_terminal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f"a{ESCAPE}\nb"
    assert paths.shown(path) == r"a\x1b]0;owned\x07\x1b[2J\u202e\nb"
    error = MuslinError(f"There is no {path}.", f"Look for {path}.")
    assert all(text.isascii() and "\x1b" not in text for text in (str(error), error.message, error.hint))


@pytest.mark.parametrize(
    "command",
    ["grade NAME", "render NAME", "check --functions NAME", "class grade NAME --out out", "simulate NAME",
     "simulate drape --mesh NAME", "grade NAME --assignment NAME", "lint NAME"],
)  # fmt: skip
def test_no_command_passes_on_what_steers_a_terminal(tmp_path, command):
    words = [word.replace("NAME", f"x{ESCAPE}") for word in command.split()]
    done = subprocess.run([*MUSLIN, *words], cwd=tmp_path, capture_output=True, timeout=120)
    assert done.returncode == 1
    assert b"owned" in done.stderr
    assert b"\x1b]" not in done.stdout + done.stderr
    assert "\u202e".encode() not in done.stdout + done.stderr
