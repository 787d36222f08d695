"""Attack 25: zip and tar bombs, links, devices, paths that climb, encrypted and damaged archives.

Defence: nothing is unpacked to disk; regular files of the right names are read, up to a cap, by a process that may
take little memory and time.
"""

import gzip
import io
import os
import resource
import struct
import tarfile
import zipfile

import pytest
from attacking import BYSTANDER, SOLUTION, TARGET, honest

from muslin import tasks
from muslin.base.errors import MuslinError
from muslin.grading import submission, unpacking

TABLE = tasks.assignment("cloth")


def collect(path):
    """What is read of an archive; in little time and memory."""
    before, spent = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, os.times()
    try:
        return submission.collect(path, TABLE)
    finally:
        assert os.times().children_user - spent.children_user < submission.MOST_SECONDS + 2
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000


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
    assert (
        "more than"
        in collect(zipped(tmp_path / "b.zip", [(f"{k}.txt", "") for k in range(20_001)])).unreadable
    )
    long = [("n" * 60_000 + str(k), "") for k in range(300)]
    assert collect(zipped(tmp_path / "d.zip", long)).unreadable  # a huge list
    info = tarfile.TarInfo("header")
    info.type, info.size = tarfile.XHDTYPE, 400_000_000
    with gzip.open(tmp_path / "c.tar.gz", "wb", compresslevel=1) as stream:  # a header of 400 MB
        stream.write(info.tobuf())
        for _ in range(400):
            stream.write(bytes(1_000_000))
    assert "headers" in collect(tmp_path / "c.tar.gz").unreadable


def test_a_zip_that_bzip2_blows_up_in_one_piece(tmp_path):
    with zipfile.ZipFile(tmp_path / "s.zip", "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr(TARGET, bytes(400_000_000))
    assert "unusual way" in collect(tmp_path / "s.zip").refused[TARGET]


def extended(path, header, kind=tarfile.XHDTYPE, count=1):
    """A tar in which each copy of the target comes after a header."""
    with open(path, "wb") as stream:
        for _ in range(count):
            before, member = tarfile.TarInfo("header"), tarfile.TarInfo(TARGET)
            before.type, before.size, member.size = kind, len(header), 5
            stream.write(before.tobuf() + header + bytes(-len(header) % 512))
            stream.write(member.tobuf() + b"x = 1" + bytes(507))
        stream.write(bytes(1024))
    return path


def test_headers_of_a_tar_that_keep_a_reader_busy(tmp_path):
    assert "headers" in collect(extended(tmp_path / "a.tar", b"9" * 200_000)).unreadable
    digits = b"60009 mtime=" + b"9" * 59_996 + b"\n"
    assert collect(extended(tmp_path / "b.tar", digits, count=50)).files == {TARGET: b"x = 1"}
    sparse = b"22 GNU.sparse.major=1\n23 GNU.sparse.numblocks=9\n"
    assert "sparse" in collect(extended(tmp_path / "c.tar", sparse)).unreadable
    assert "sparse" in collect(extended(tmp_path / "d.tar", b"", tarfile.GNUTYPE_SPARSE)).unreadable


def test_a_gzip_of_millions_of_empty_members_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(submission, "MOST_SECONDS", 2)
    (tmp_path / "s.tar.gz").write_bytes(gzip.compress(b"") * 2_000_000)
    assert "more time or memory" in collect(tmp_path / "s.tar.gz").unreadable


def test_what_takes_more_memory_than_there_is_costs_that_submission_only(tmp_path, monkeypatch):
    monkeypatch.setattr(submission, "MOST_MEMORY", 120 << 20)
    big = zipped(tmp_path / "s.zip", [("inner.zip", bytes(190_000_000))])
    assert "memory" in collect(big).unreadable


def test_notes_stay_short(tmp_path):
    entries = [("../" * 300 + f"{k}\udcff.py", "") for k in range(500)] + [(TARGET, "x = 1")]
    entries = [(name.encode("utf-8", "replace").decode(), data) for name, data in entries]
    found = collect(zipped(tmp_path / "a.zip", entries))
    assert found.files
    assert sum(map(len, found.about.notes)) < 2000
    nasty = tarred(tmp_path / "b.tar", [("\udcff\udcfe.py", tarfile.REGTYPE, b"x")])
    for note in collect(nasty).about.notes:
        note.encode()


def test_encrypted_and_damaged_archives_are_refused_and_nested_ones_opened_to_a_depth(tmp_path):
    sound = zipped(tmp_path / "sound.zip", [(TARGET, honest())]).read_bytes()
    encrypted = bytearray(sound)
    encrypted[6] |= 1
    encrypted[sound.index(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "encrypted.zip").write_bytes(encrypted)
    assert "password" in collect(tmp_path / "encrypted.zip").refused[TARGET]
    for depth in range(2, 6):
        sound_inside = sound if depth == 2 else (tmp_path / "nested.zip").read_bytes()
        nested = collect(zipped(tmp_path / "nested.zip", [("inner.zip", sound_inside)]))
        assert list(nested.files) == ([TARGET] if depth <= unpacking.DEEPEST else [])
    assert "other archives" in nested.unreadable
    for method in (12, 14, 93, 99):  # bzip2, lzma, zstandard, unknown: not what the bytes are
        other = bytearray(sound)
        struct.pack_into("<H", other, 8, method)
        struct.pack_into("<H", other, sound.index(b"PK\x01\x02") + 10, method)
        (tmp_path / "method.zip").write_bytes(other)
        assert "cannot be read" in collect(tmp_path / "method.zip").refused[TARGET]
    for cut in range(0, len(sound), 37):
        (tmp_path / "cut.zip").write_bytes(sound[:cut])
        assert collect(tmp_path / "cut.zip").unreadable


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
