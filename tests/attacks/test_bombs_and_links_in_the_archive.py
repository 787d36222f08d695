"""Attack 25: zip and tar bombs, links, devices, paths that climb, encrypted and damaged archives.

Defence: nothing is unpacked to disk; regular files of the right names are read, up to a cap, in small pieces.
"""

import gzip
import io
import os
import resource
import struct
import tarfile
import time
import zipfile

import pytest
from attacking import BYSTANDER, SOLUTION, TARGET, honest

from muslin import tasks
from muslin.errors import MuslinError
from muslin.grading import submission

TABLE = tasks.assignment("cloth")


def collect(path):
    """What is read of an archive; in little time and memory."""
    began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        return submission.collect(path, TABLE)
    finally:
        assert time.monotonic() - began < 30
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


def zipped(path, entries):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries:
            archive.writestr(name, data)
    return path


def tarred(path, members, mode="w"):
    with tarfile.open(path, mode) as archive:
        for name, kind, data in members:
            info = tarfile.TarInfo(name)
            info.type, info.linkname = kind, str(SOLUTION / TARGET)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path


def test_links_devices_and_climbing_paths_are_passed_over(attack, tmp_path):
    def pack(folder):
        link = zipfile.ZipInfo(TARGET)
        link.external_attr = 0o120777 << 16
        climbing = [(f"../../{name}", "evil") for name in TABLE.files]
        absolute = [(f"/tmp/{attack.token}.py", "evil"), (f"../{attack.token}", "evil")]
        kept = [(BYSTANDER, honest(BYSTANDER))]
        return zipped(tmp_path / "s.zip", [(link, str(SOLUTION / TARGET)), *climbing, *absolute, *kept])

    record = attack({TARGET: "# nothing"}, pack=pack)
    assert record["mass_block"].status == "passed"
    assert "link" in record["sphere_contact"].message
    assert any("leave the archive" in note for note in record.submission.notes)


def test_a_tar_with_links_and_devices(tmp_path):
    kinds = [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.FIFOTYPE]
    found = collect(
        tarred(tmp_path / "s.tar", [(f, k, b"") for f, k in zip(TABLE.files, kinds, strict=False)])
    )
    assert not found.files
    assert sum("link or a device" in text for text in found.refused.values()) == len(kinds)


def test_bombs_do_not_go_off(tmp_path):
    assert "larger" in collect(zipped(tmp_path / "a.zip", [(TARGET, bytes(300_000_000))])).refused[TARGET]
    with pytest.raises(MuslinError):
        collect(zipped(tmp_path / "b.zip", [(f"{k}.txt", "") for k in range(20_001)]))
    with pytest.raises(MuslinError):
        collect(zipped(tmp_path / "d.zip", [("n" * 60_000 + str(k), "") for k in range(300)]))  # a huge list
    info = tarfile.TarInfo("header")
    info.type, info.size = tarfile.XHDTYPE, 400_000_000
    with gzip.open(tmp_path / "c.tar.gz", "wb", compresslevel=1) as stream:  # a header of 400 MB
        stream.write(info.tobuf())
        for _ in range(400):
            stream.write(bytes(1_000_000))
    with pytest.raises(MuslinError):
        collect(tmp_path / "c.tar.gz")


def test_notes_stay_short(tmp_path):
    entries = [("../" * 300 + f"{k}\udcff.py", "") for k in range(500)] + [(TARGET, "x = 1")]
    entries = [(name.encode("utf-8", "replace").decode(), data) for name, data in entries]
    found = collect(zipped(tmp_path / "a.zip", entries))
    assert found.files
    assert sum(map(len, found.about.notes)) < 2000
    nasty = tarred(tmp_path / "b.tar", [("\udcff\udcfe.py", tarfile.REGTYPE, b"x")])
    for note in collect(nasty).about.notes:
        note.encode()


def test_encrypted_damaged_and_nested_archives_are_refused(tmp_path):
    sound = zipped(tmp_path / "sound.zip", [(TARGET, honest())]).read_bytes()
    encrypted = bytearray(sound)
    encrypted[6] |= 1
    encrypted[sound.index(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "encrypted.zip").write_bytes(encrypted)
    assert "cannot be read" in collect(tmp_path / "encrypted.zip").refused[TARGET]
    assert not collect(zipped(tmp_path / "nested.zip", [("inner.zip", sound)])).files
    for method in (12, 14, 93, 99):  # bzip2, lzma, zstandard, unknown: not what the bytes are
        other = bytearray(sound)
        struct.pack_into("<H", other, 8, method)
        struct.pack_into("<H", other, sound.index(b"PK\x01\x02") + 10, method)
        (tmp_path / "method.zip").write_bytes(other)
        assert "cannot be read" in collect(tmp_path / "method.zip").refused[TARGET]
    for cut in range(0, len(sound), 37):
        (tmp_path / "cut.zip").write_bytes(sound[:cut])
        with pytest.raises(MuslinError):
            collect(tmp_path / "cut.zip")


def test_nothing_is_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero", "/dev/null"):
        with pytest.raises(MuslinError):
            collect(path)


@pytest.mark.parametrize("suffix", ["gz", "bz2", "xz"])
def test_honest_tars_are_read(tmp_path, suffix):
    members = [(f"cloth/{TARGET}", tarfile.REGTYPE, honest().encode())]
    assert collect(tarred(tmp_path / f"s.tar.{suffix}", members, f"w:{suffix}")).files == {
        TARGET: honest().encode()
    }
