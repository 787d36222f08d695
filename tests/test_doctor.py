"""The doctor tells the truth about this computer, and survives every other."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from muslin import doctor
from muslin.base import engine
from muslin.doctor import Finding, compiling, examine, judge_python, judge_system, places, report, showing

FRAMEWORK = Path(doctor.__file__).parents[2]


@pytest.fixture(scope="module")
def examination():
    start = time.perf_counter()
    findings = examine()
    return findings, time.perf_counter() - start


@pytest.fixture
def fake_taichi(tmp_path, monkeypatch):
    """Puts a `taichi` of the given source first on the path of this process."""

    def put(source):
        (tmp_path / "taichi.py").write_text(source)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.setenv("MUSLIN_ENGINE", "taichi")

    return put


def one_line(findings):
    return all("\n" not in str(f) for f in findings)


def test_where_muslin_runs_the_doctor_finds_nothing_essential_missing(examination):
    findings, _ = examination
    mine = [f for f in findings if f.what not in ("meshes", "assignments", "reference data")]
    assert [str(f) for f in mine if f.ok is False] == []
    named, title = {f.what for f in findings}, engine.chosen().title
    assert {"Python", "system", "video encoder", "cores", "memory"} <= named
    assert {title, f"{title} kernel"} <= named
    assert {"kernel cache", "working folder", "temporary folder", "disk space"} <= named
    assert {"meshes", "assignments", "fast solver", "interactive window", "GPU computing"} <= named
    assert one_line(findings)


def test_the_examination_takes_seconds(examination):
    assert examination[1] < 12  # 2.5 s alone on 2 cores; other tests may run beside it


def test_a_graphics_card_is_never_required(examination):
    assert all(f.ok is not False for f in examination[0] if f.what in ("interactive window", "GPU computing"))


def test_a_missing_libx11_is_answered_with_the_command_that_installs_it(tmp_path):
    package = tmp_path / "taichi"
    package.mkdir()
    (package / "__init__.py").write_text(
        'raise ImportError("libX11.so.6: cannot open shared object file: No such file or directory")'
    )
    code = "from muslin.doctor import examine, report; import sys; sys.exit(not report(examine()))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"MUSLIN_ENGINE": "taichi", "PYTHONPATH": f"{tmp_path}{os.pathsep}{FRAMEWORK}"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stdout + done.stderr
    (line,) = [s for s in done.stdout.splitlines() if s.startswith("FIX") and "Taichi" in s]
    assert "apt-get install -y libx11-6" in line
    assert "dnf install -y libX11" in line
    assert "To fix before Muslin works fully: " in done.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="libX11 matters on Linux alone")
def test_libx11_is_looked_for_before_taichi(monkeypatch):
    monkeypatch.setattr(compiling, "loads", lambda library: library != "libX11.so.6")
    (finding,) = compiling.x11()
    assert finding.ok is False
    assert "apt-get install -y libx11-6" in finding.advice


def test_a_missing_taichi_is_answered_with_pip(fake_taichi):
    fake_taichi("raise ModuleNotFoundError(\"No module named 'taichi'\")")
    finding = compiling.compiler()[0]
    assert (finding.ok, finding.detail) == (False, "not installed")
    assert "pip install" in finding.advice


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_taichi_that_crashes_does_not_take_the_doctor_along(fake_taichi):
    fake_taichi("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    finding = compiling.compiler()[0]
    assert finding.ok is False
    assert "killed by signal SIGSEGV" in finding.detail


def test_a_taichi_that_hangs_is_given_up(fake_taichi, monkeypatch):
    monkeypatch.setattr(compiling, "PATIENCE", 1)
    fake_taichi("import time; time.sleep(60)")
    start = time.perf_counter()
    finding = compiling.compiler()[0]
    assert time.perf_counter() - start < 40  # and not the minute it sleeps
    assert finding.ok is False
    assert "no answer in 1 s" in finding.detail


def test_a_taichi_that_imports_but_cannot_run_kernels_is_named(fake_taichi):
    fake_taichi("__version__ = (1, 7, 4)\nprint('[Taichi] version 1.7.4')\n")
    first, kernel, *_ = compiling.compiler()
    assert first.ok is True
    assert first.detail.startswith("1.7.4")
    assert kernel.what == "Taichi kernel"
    assert kernel.ok is False
    assert kernel.advice


@pytest.mark.parametrize(
    ("version", "implementation", "free_threaded", "ok"),
    [
        ((3, 10, 0), "CPython", False, True),
        ((3, 13, 9), "CPython", False, True),
        ((3, 9, 18), "CPython", False, False),
        ((3, 14, 8), "CPython", False, True),
        ((3, 15, 0), "CPython", False, False),
        ((3, 13, 0), "CPython", True, False),
        ((3, 11, 0), "PyPy", False, False),
    ],
)
def test_pythons_without_an_engines_wheel_are_refused(version, implementation, free_threaded, ok):
    finding = judge_python(version, implementation, free_threaded)
    assert finding.ok is ok
    assert "3.10 to 3.14" in finding.advice
    if version[:2] == (3, 15):
        assert "newer than any wheel" in finding.detail


@pytest.mark.parametrize(
    ("system", "named"),
    [
        (("Linux", "x86_64", "glibc", "2.36"), ""),
        (("Linux", "x86_64", "glibc", "2.27"), ""),
        (("Darwin", "arm64"), ""),
        (("Windows", "AMD64"), ""),
        (("Linux", "x86_64", "glibc", "2.17"), "glibc 2.27"),
        (("Linux", "aarch64", "glibc", "2.36"), ""),
        (("Linux", "x86_64", "musl", ""), "Alpine"),
        (("Linux", "riscv64", "glibc", "2.38"), "processor"),
        (("Darwin", "x86_64"), "Intel Macs"),
        (("Darwin", "x86_64", "", "", True, True), "Intel Python on an Apple processor"),
        (("Windows", "ARM64"), "Windows on ARM"),
        (("Windows", "AMD64", "", "", False), "32-bit"),
        (("FreeBSD", "amd64"), "this system"),
    ],
)
def test_systems_without_an_engines_wheel_are_named(system, named):
    finding = judge_system(*system)
    assert finding.ok is (named == "")
    assert named in finding.detail
    assert bool(finding.advice) is bool(named)


def test_an_encoder_that_does_not_run_is_found_out(monkeypatch, tmp_path):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "no-such-ffmpeg"))
    finding = showing.video()
    assert finding.ok is False
    assert "pip install" in finding.advice


def test_missing_shipped_data_is_found_out(monkeypatch, tmp_path):
    (tmp_path / "data" / "meshes").mkdir(parents=True)
    monkeypatch.setattr(places.paths, "root", lambda: tmp_path)
    findings = places.shipped()
    assert [f.ok for f in findings] == [False, False, False]
    assert all(f.advice for f in findings)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser may write everywhere"
)
def test_a_folder_that_cannot_be_written_is_found_out(monkeypatch, tmp_path):
    tmp_path.chmod(0o500)
    monkeypatch.chdir(tmp_path)
    assert places.folders()[0].ok is False


def test_a_kernel_cache_that_cannot_be_written_is_no_obstacle(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("TI_OFFLINE_CACHE_FILE_PATH", str(tmp_path / "file" / "cache"))
    finding = compiling._kernel_cache(engine.ENGINES["taichi"], None)
    assert finding.ok is None
    assert "cannot be written" in finding.detail


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not remove a folder in use")
def test_a_working_folder_that_is_gone_is_found_out(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    first = places.folders()[0]
    monkeypatch.undo()
    assert (first.ok, first.detail) == (False, "no longer exists")


def test_a_check_that_fails_itself_becomes_a_finding(monkeypatch):
    def broken():
        raise RuntimeError("two\nlines")

    monkeypatch.setattr(doctor, "_CHECKS", (("moon", broken),))
    (finding,) = examine()
    assert (finding.what, finding.ok) == ("moon", False)
    assert "two lines" in finding.detail


def test_only_what_is_essential_decides(capsys):
    good = [Finding("Python", True, "3.12", "never shown"), Finding("fast solver", None, "absent", "pip it")]
    assert report(good)
    printed = capsys.readouterr().out
    assert "never shown" not in printed
    assert "pip it" in printed
    assert "\x1b" not in printed
    assert not report([*good, Finding("libX11", False, "missing", "apt it")])
    assert "To fix before Muslin works fully: libX11." in capsys.readouterr().out
