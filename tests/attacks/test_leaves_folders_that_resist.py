"""Beyond the table: folders so deep that removing them recursively fails, and folders their owner cannot list.

Defence: homes are removed without recursion, by handles and not by paths, and opened up on the way; a disk in
memory goes as a whole (namespace).
"""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from attacking import TARGET, honest

from muslin.base import scratch
from muslin.grading import isolation

DEEP = """
import os
here = os.getcwd()
for _ in range(1500):
    os.mkdir("d")
    os.chdir("d")
os.chdir(here)
"""
LONG = """
import os
here = os.open(".", os.O_RDONLY)
for _ in range(300):
    os.mkdir("long" * 50)
    os.chdir("long" * 50)
open("at the end", "w").close()
os.fchdir(here)
"""
CLOSED = """
import os
for folder, mode in (("unlisted", 0o300), ("unentered", 0o600), ("nothing", 0)):
    os.mkdir(folder)
    for k in range(3):
        open(f"{folder}/left{k}", "wb").write(bytes(1000))
        os.mkdir(f"{folder}/{k}", mode)
    os.mkdir(f"{folder}-itself", mode)
os.mkdir("closed", 0o300)
open("closed/left", "wb").write(bytes(1000))
"""
ALL = {"deep": DEEP, "long": LONG, "closed": CLOSED}


@pytest.mark.parametrize("folders", ALL)
def test_a_home_goes_whatever_is_in_it(attack, level, folders):
    record = attack({TARGET: ALL[folders] + honest()}, level=level)  # what is left behind fails there
    assert record["sphere_contact"].status == "passed"


@pytest.mark.parametrize("folders", ALL)
@pytest.mark.parametrize("user", [None, 61234])
def test_a_folder_is_removed_whatever_is_in_it(tmp_path, folders, user):
    if user is not None and os.geteuid() != 0:
        pytest.skip("needs root, to be another user")
    for above in (tmp_path, *tmp_path.parents[:3]):
        above.chmod(0o711)
    place = tmp_path / "home"
    place.mkdir()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "kept").touch()
    program = [
        "import os, sys, types",
        "package = types.ModuleType('muslin')",  # as another user, who may not read the packages Muslin imports
        f"package.__path__ = [{str(Path(scratch.__file__).parents[1])!r}]",
        "sys.modules['muslin'] = package",
        "from muslin.base import scratch",
        f"place = {str(place)!r}",
        *([f"os.chown(place, {user}, {user})", f"os.setresuid({user}, {user}, {user})"] if user else []),
        "os.chdir(place)",
        f"os.symlink({str(elsewhere)!r}, 'link')",
        ALL[folders],
        "os.chdir('/')",
        "os.mkdir(place + '/last'); scratch.remove(place)",
        "print('LEFT', os.listdir(place) if os.path.isdir(place) else 'nothing')",
    ]
    done = subprocess.run([sys.executable, "-c", "\n".join(program)], capture_output=True, text=True)
    # the folder above is not that user's to write, so the folder itself stays, empty
    assert done.stdout.strip() == ("LEFT []" if user else "LEFT nothing"), done.stderr
    assert (elsewhere / "kept").exists()


@pytest.mark.skipif(not isolation.LINUX, reason="handles have paths on Linux only")
def test_what_fills_a_disk_is_seen_below_the_longest_path_and_depth_alone_is_no_filling(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(isolation, "DISK", 1 << 20)
    deep = "import os\nos.chdir(HOME)\n" + LONG.replace(
        '"at the end", "w").close()', '"at the end", "wb").write(SIZE)'
    )
    for size, full in ((1000, False), (1 << 21, True)):
        home = tmp_path / str(size)
        home.mkdir()
        code = deep.replace("HOME", repr(str(home))).replace("SIZE", f"bytes({size})")
        subprocess.run([sys.executable, "-c", code], check=True)
        assert isolation.overflows(str(home)) is full
        scratch.remove(home)


def test_two_threads_may_remove_a_folder_at_once(tmp_path, monkeypatch):
    """As when a nursery dies, and all whose workers were in it notice."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = scratch.Scratch(scratch.GRADING)
    both, remove, closed = threading.Barrier(2), scratch.remove, []

    def removing(path):
        both.wait(30)
        gone = remove(path)
        both.wait(30)
        return gone

    close = os.close

    def closing(descriptor):
        if descriptor == folder._lock:
            closed.append(descriptor)
        close(descriptor)

    monkeypatch.setattr(scratch, "remove", removing)
    monkeypatch.setattr(os, "close", closing)
    with ThreadPoolExecutor(2) as pool:
        for done in [pool.submit(folder.close) for _ in range(2)]:
            done.result()
    assert len(closed) == 1
    assert not os.listdir(tmp_path)
    folder.close()


def test_what_a_dead_grader_has_left_is_swept(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    stale = tmp_path / f"{scratch.CLASS}stale"
    (stale / "hidden data").mkdir(parents=True)
    with scratch.Scratch(scratch.GRADING) as living:
        assert not stale.exists()
        with scratch.Scratch(scratch.CLASS):
            assert os.path.isdir(living.path)
            assert len(os.listdir(tmp_path)) == 2
    assert not os.listdir(tmp_path)


def test_a_folder_somebody_writes_into_is_removed_before_its_maker_ends_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder, writing = scratch.Scratch(scratch.GRADING), threading.Event()

    def writes():
        for k in range(300):
            try:
                (Path(folder.path) / f"{k}").mkdir()
            except OSError:
                return
            writing.set()

    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(writes)
        writing.wait(30)
        scratch.Scratch.close_all()
        done.result()
    assert not list(tmp_path.iterdir())
