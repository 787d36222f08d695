"""Places people work in: no home, no room, no folder any more, other people's folders, narrow and plain terminals."""

import os
import stat
import subprocess
import sys

import pytest

from muslin import paths

STEP = ("simulate", "hang", "--steps", "1", "--set", "resolution=4")


def muslin(*words, cwd=None, without=(), **variables):
    """Run the command in a process of its own."""
    environment = {k: v for k, v in os.environ.items() if k not in without} | variables
    return subprocess.run(
        [sys.executable, "-m", "muslin.cli", *map(str, words)],
        env=environment, cwd=cwd, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
        check=False,
    )  # fmt: skip


# --- no home -------------------------------------------------------------------------------------------------

no_windows = pytest.mark.skipif(sys.platform == "win32", reason="Taichi keeps its kernels elsewhere there")


@no_windows
@pytest.mark.parametrize("home", ["unset", "a file", "nowhere"])
def test_a_run_ends_well_without_a_home_to_write_to(tmp_path, home):
    (tmp_path / "file").touch()
    variables = {"unset": {}, "a file": {"HOME": str(tmp_path / "file")}, "nowhere": {"HOME": "/proc/none"}}[
        home
    ]
    out = tmp_path / "run"
    done = muslin(*STEP, "--out", out, without=("HOME", "XDG_CACHE_HOME"), TMPDIR=str(tmp_path), **variables)
    assert done.returncode == 0, done.stderr
    assert (out / "run.json").is_file()


@no_windows
def test_kernels_go_to_the_usual_cache_as_long_as_it_can_be_written(monkeypatch, tmp_path):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    paths.find_caches()
    assert "XDG_CACHE_HOME" not in os.environ
    assert paths.cache("muslin", "grading") == tmp_path / ".cache" / "muslin" / "grading"


@no_windows
def test_a_cache_that_another_user_made_is_passed_over(monkeypatch, tmp_path):
    """As after `sudo`: ~/.cache is one's own, what Taichi keeps in it is not (here it is no folder at all)."""
    (tmp_path / ".cache").mkdir()
    (tmp_path / ".cache" / "taichi").touch()
    (tmp_path / "tmp").mkdir()
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    paths._private_folder.cache_clear()
    try:
        paths.find_caches()
        chosen = os.environ["XDG_CACHE_HOME"]
        assert chosen.startswith(str(tmp_path / "tmp"))
        assert stat.S_IMODE(os.stat(chosen).st_mode) == 0o700
    finally:
        paths._private_folder.cache_clear()


@no_windows
def test_a_temporary_folder_that_others_may_write_is_not_trusted(monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    planted = tmp_path / f"muslin-cache-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    paths._private_folder.cache_clear()
    try:
        assert paths._private_folder() != planted
    finally:
        paths._private_folder.cache_clear()


def test_a_chosen_kernel_folder_that_cannot_be_written_is_not_forced_on_taichi(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path / "file" / "kernels"))
    paths.find_caches()
    assert "TI_OFFLINE_CACHE_FILE_PATH" not in os.environ


def test_a_worker_that_cannot_start_is_no_fault_of_the_student(monkeypatch):
    from muslin.errors import MuslinError
    from muslin.student import worker

    monkeypatch.setattr(worker, "_serve", lambda *_: os._exit(3))
    with worker.Worker() as one, pytest.raises(MuslinError, match="not in your code") as told:
        list(one.ask(iter, (), deadline=60))
    assert not isinstance(told.value, worker.Crashed)
