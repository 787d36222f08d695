"""Places people work in: no home, no room, no folder any more, other people's folders, narrow and plain terminals."""

import os
import re
import stat
import subprocess
import sys

import pytest

from muslin.base import paths

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


def ends_at_once(*_):
    os._exit(3)


def test_a_worker_that_cannot_start_is_no_fault_of_the_student(monkeypatch):
    from muslin.base.errors import MuslinError
    from muslin.student import worker

    monkeypatch.setattr(worker, "_serve", ends_at_once)
    with worker.Worker() as one, pytest.raises(MuslinError, match="not in your code") as told:
        list(one.ask(iter, (), deadline=60))
    assert not isinstance(told.value, worker.Crashed)


# --- no room, no folder ----------------------------------------------------------------------------------------

full = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here")


@full
@pytest.mark.parametrize(
    "words", [("scenes",), ("--help",), ("--version",), ("list", "--help"), ("nonsense",)]
)
@pytest.mark.parametrize("streams", ["stdout", "stderr", "both"])
def test_a_full_disk_behind_the_output_is_called_that(words, streams):
    with open("/dev/full", "w") as room:
        options = {name: room for name in ("stdout", "stderr") if streams in (name, "both")}
        done = subprocess.run(
            [sys.executable, "-m", "muslin.cli", *words], stdin=subprocess.DEVNULL, text=True, check=False,
            env=dict(os.environ), **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options,
        )  # fmt: skip
    if streams == "stdout" and words != ("nonsense",):
        assert done.returncode == 1
        assert done.stderr.startswith("muslin: No space left.")
        assert len(done.stderr.splitlines()) == 1
    if streams == "both":
        assert done.returncode in (1, 2)
    assert "please report" not in (done.stderr or "")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not remove a folder in use")
@pytest.mark.parametrize("words", [("check",), ("list",), ("hint",), ("watch",), ("submit",), ("start", "cloth"),
                                   ("run",), STEP, ("render", "run"), ("export", "run"), ("grade", "x"),
                                   ("demo",), ("upgrade",), ("gradcheck",), ("explain",)])  # fmt: skip
def test_a_folder_that_has_gone_is_named_as_the_trouble(tmp_path, words):
    here = tmp_path / "gone"
    here.mkdir()
    code = (
        "import os, sys; os.rmdir(os.getcwd()); from muslin.cli import main; sys.argv[0] = 'muslin'; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=here, stdin=subprocess.DEVNULL, capture_output=True, text=True,
        check=False, env=dict(os.environ),
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert done.stderr == "muslin: The folder you are in is there no longer. Go to another one: cd\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of one step."""
    folder = tmp_path_factory.mktemp("run") / "run"
    done = muslin(*STEP, "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("words", [("render", "RUN"), ("export", "RUN"), STEP, ("demo",), ("grade", "RUN"),
                                   ("release", "cloth"), ("pack", "actions")])  # fmt: skip
@pytest.mark.parametrize("below", ["file", "file/below", "file/further/below"])
def test_a_place_below_a_file_is_refused_by_name(tmp_path, run, words, below):
    (tmp_path / "file").write_text("mine")
    if below == "file" and words[0] in ("render", "export"):
        pytest.skip("these take a name without an ending: film.mp4 beside a file named film is all right")
    words = [run if word == "RUN" else word for word in words]
    done = muslin(*words, "--out", tmp_path / below, cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert "file" in done.stderr
    assert "please report" not in done.stderr
    assert (tmp_path / "file").read_text() == "mine"


# --- terminals -------------------------------------------------------------------------------------------------

COMMANDS = ["", "start", "check", "list", "hint", "reset", "run", "submit", "watch", "upgrade", "handout",
            "explain", "experiment", "gradcheck",
            "simulate", "scenes", "render", "export", "demo", "doctor", "view", "play", "grade", "lint", "release",
            "pack", "bench", "class", "class grade", "new", "new assignment", "new task", "reference",
            "reference build", "reference mistakes", "reference slips", "reference verify", "mesh"]  # fmt: skip


def in_process(monkeypatch, capsys, *words, **variables):
    """Run the command in this process; gives its exit code, output and errors."""
    from muslin import cli

    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "argv", ["muslin", *map(str, words)])
    try:
        cli.main()
        code = 0
    except SystemExit as ending:
        code = ending.code or 0
    return code, *capsys.readouterr()


@pytest.mark.parametrize("command", COMMANDS)
def test_no_line_of_help_is_wider_than_the_terminal(monkeypatch, capsys, command):
    _, out, err = in_process(monkeypatch, capsys, *command.split(), "--help", COLUMNS="60")
    assert "--help" in out
    assert err == ""
    assert max(map(len, out.splitlines())) <= 60
    assert not re.search(r"\w\.\.\.$", out.replace("[ARGS]...", ""), re.MULTILINE)  # nothing is cut off


def test_every_command_there_is_has_its_help_looked_at():
    from typer.main import get_command

    from muslin.cli import app

    def names(command, before=""):
        yield before.strip()
        for name, one in getattr(command, "commands", {}).items():
            yield from names(one, f"{before} {name}")

    assert set(names(get_command(app))) == set(COMMANDS)


def words_of(text):
    return " ".join(text.split())


@pytest.mark.parametrize(
    "text",
    [
        "muslin: There is no scene 'drap'. Did you mean drape? There is: course, cape, drape, flag, freefall, hang.",
        "  FAIL deformation_gradient  the answer of case 3 is off by 0.4; expected 1.2, got 1.6, in entry (2, 1)",
        "       likely: the inverse of the two by two matrix has a wrong sign in one of its four entries",
        "\x1b[31mwrong\x1b[0m  a line that has colours of its own and goes on for longer than sixty columns are",
        "名前 名前 名前 名前 名前 名前 名前 名前 名前 名前 名前 名前 名前 名前 名前 名前",
    ],
)
def test_a_line_is_broken_between_words_and_loses_none(text):
    from muslin.cli import console

    folded = console.folded(text, 60)
    assert words_of(folded) == words_of(text)
    lines = folded.splitlines()
    assert len(lines) > 1
    assert all(console._long(line) <= 60 for line in lines)
    assert console.folded(text, None) == text


def test_what_goes_on_stands_below_its_own_column():
    from muslin.cli import console

    first, second = console.folded("  FAIL phi   one two three four five six", 26).splitlines()
    assert second.index("four") == first.index("one")


def test_a_word_longer_than_a_line_stays_whole():
    from muslin.cli import console

    assert "a" * 90 in console.folded("see " + "a" * 90 + " and this", 60).splitlines()[1]


def in_a_terminal(words, columns=60, **variables):
    """What the command writes to a terminal of so many columns, as bytes; and its exit code."""
    pty = pytest.importorskip("pty")
    import fcntl
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "COLUMNS", "TERM")}
    child = subprocess.Popen(
        [sys.executable, "-m", "muslin.cli", *map(str, words)], stdin=theirs, stdout=theirs, stderr=theirs,
        env={"TERM": "xterm"} | environment | variables, close_fds=True,
    )  # fmt: skip
    os.close(theirs)
    seen = b""
    try:
        while piece := os.read(ours, 1 << 16):
            seen += piece
    except OSError:  # the other end has been closed
        pass
    os.close(ours)
    return seen, child.wait()


TALKATIVE = [
    ("doctor",),
    ("grade", paths.assignment("cloth")),
    ("simulate", "hang", "--steps", "1"),
    ("scenes",),
]


@no_windows
@pytest.mark.parametrize("words", TALKATIVE, ids=lambda words: words[0])
@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}, {}], ids=str)
def test_colours_are_for_terminals_that_have_them_and_people_who_want_them(
    tmp_path, monkeypatch, words, variables
):
    monkeypatch.chdir(tmp_path)
    seen, _ = in_a_terminal(words, **variables)
    styles = re.findall(rb"\x1b\[[0-9;]*m", seen)
    if variables:
        assert not any(re.search(rb"\b[349][0-7]m", style) for style in styles)
        if "TERM" in variables:
            assert b"\x1b" not in seen
    elif words[0] in ("doctor", "grade"):
        assert styles
    lines = re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", seen).decode().replace("\r", "\n").splitlines()
    assert [line for line in lines if len(line) > 60 and " " in line.strip()] == []


def test_letters_a_terminal_lacks_stop_no_command(tmp_path):
    folder = tmp_path / "Ñandú 名前"
    done = muslin("start", "cloth", folder, PYTHONIOENCODING="latin-1")
    assert done.returncode == 0, done.stderr
    done = muslin("check", "phi", "--functions", tmp_path / "ψ", PYTHONIOENCODING="ascii")
    assert done.returncode == 1
    assert done.stderr.startswith("muslin: There is no folder")


@no_windows
def test_names_are_read_and_written_in_a_locale_without_an_encoding(tmp_path):
    """What cron and slim containers have; then Python reads names as bytes it cannot show."""
    (tmp_path / "Ñandú").mkdir()
    done = subprocess.run(
        [sys.executable, "-m", "muslin.cli", *STEP, "--out", "Ñandú/run"], cwd=tmp_path, capture_output=True,
        env=os.environ | {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Ñandú/run".encode() in done.stdout
    assert (tmp_path / "Ñandú" / "run" / "run.json").is_file()


# --- names of files that are written ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("out", "to", "written"),
    [
        ("fall", (), {"fall.png", "fall.mp4"}),
        ("fall.mp4", (), {"fall.png", "fall.mp4"}),
        ("fall.MP4", (), {"fall.png", "fall.mp4"}),
        ("fall.webp", (), {"fall.png", "fall.webp"}),
        ("fall.gif", ("--to", "gif"), {"fall.png", "fall.gif"}),
        ("fall.png", (), {"fall.png"}),
        ("fall.2", ("--to", "none"), {"fall.2.png"}),
        ("folder/", (), {"folder/hang.png", "folder/hang.mp4"}),
        ("there", (), {"there/hang.png", "there/hang.mp4"}),
    ],
)
def test_pictures_are_called_as_they_are_asked_to_be(tmp_path, monkeypatch, capsys, run, out, to, written):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    code, _, err = in_process(
        monkeypatch, capsys, "render", run, "--quality", "draft", "--size", "64x36", "--out", out, *to
    )
    assert code == 0, err
    found = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert {name for name in found if not name.endswith("-energies.png")} == written


def test_an_ending_that_muslin_does_not_write_is_not_swallowed(tmp_path, monkeypatch, capsys, run):
    for out, more in (("fall.mov", ()), ("fall.mp4", ("--to", "gif"))):
        code, _, err = in_process(monkeypatch, capsys, "render", run, "--out", tmp_path / out, *more)
        assert code == 1
        assert out in err
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_exported_in_the_format_of_its_ending(tmp_path, monkeypatch, capsys, run):
    code, _, err = in_process(monkeypatch, capsys, "export", run, "--out", tmp_path / "fall.usda")
    assert code == 0, err
    assert [path.name for path in tmp_path.iterdir()] == ["fall.usda"]


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("chek",), "check"),
        (("simulate", "drap"), "drape"),
        (("simulate", "Hang"), "hang"),
        (("simulate", "hang", "--set", "gravty=1,2,3"), "gravity"),
        (("check", "phii", "--functions", paths.assignment("cloth")), "phi"),
        (("start", "clth"), "cloth"),
        (("render", "RUN", "--to", "mp3"), "mp4"),
        (("export", "RUN", "--to", "gltf"), "glb"),
    ],
    ids=lambda value: value if isinstance(value, str) else value[0],
)
def test_what_was_probably_meant_is_said(tmp_path, monkeypatch, capsys, run, words, meant):
    monkeypatch.chdir(tmp_path)
    words = [run if word == "RUN" else word for word in words]
    code, _, err = in_process(monkeypatch, capsys, *words)
    assert code in (1, 2)
    assert re.search(rf"Did you mean '?{meant}\b", err)
    assert list(tmp_path.iterdir()) == []
