"""The command line as its users meet it: results on success, one clear message and a non-zero exit otherwise."""

import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import malformed
import pytest

from muslin import cli
from muslin.base import paths
from muslin.cli import console

ROOT = Path(__file__).resolve().parent.parent


def muslin(monkeypatch, capsys, *words):
    """Run the command line in this process; returns (exit code, output, errors)."""
    monkeypatch.setattr(sys, "argv", ["muslin", *map(str, words)])
    try:
        cli.main()
        code = 0
    except SystemExit as ending:
        code = ending.code or 0
    out, err = capsys.readouterr()
    return code, out, err


def test_a_scene_is_simulated_rendered_and_exported(monkeypatch, capsys, tmp_path):
    run = tmp_path / "run"
    code, out, err = muslin(
        monkeypatch, capsys, "simulate", "course", "--steps", 10, "--functions", ROOT / "solutions" / "cloth",
        "--set", "gravity=0,-900,0", "--set", "sphere=off", "--out", run,
    )  # fmt: skip
    assert code == 0, err
    assert "400 vertices, 10 steps" in out
    assert len(list((run / "frames").iterdir())) == 3
    code, out, err = muslin(
        monkeypatch,
        capsys,
        "render",
        run,
        "--quality",
        "draft",
        "--size",
        "160x90",
        "--to",
        "webp",
        "--strain",
    )
    assert code == 0, err
    assert {p.name for p in run.glob("course*")} == {"course.png", "course.webp", "course-energies.png"}
    for kind in ("glb", "usda", "pvd", "ply"):
        code, out, err = muslin(monkeypatch, capsys, "export", run, "--to", kind)
        assert code == 0, err
        assert any((run / kind).iterdir())


def test_the_solution_passes_and_the_stubs_fail_the_check(monkeypatch, capsys):
    code, out, _ = muslin(monkeypatch, capsys, "check", "--functions", ROOT / "solutions" / "cloth")
    assert code == 0
    assert "17 of 17" in out
    code, out, _ = muslin(
        monkeypatch, capsys, "check", "dpsi_dF", "--functions", ROOT / "assignments" / "cloth"
    )
    assert code == 1
    assert "not implemented yet: dpsi_dF" in out
    assert "Traceback" not in out


@pytest.mark.parametrize("name", sorted(malformed.MALFORMED))
def test_a_malformed_mesh_ends_in_one_paragraph(name, monkeypatch, capsys, tmp_path):
    path = tmp_path / name
    path.write_bytes(malformed.MALFORMED[name][0])
    code, out, err = muslin(
        monkeypatch, capsys, "simulate", "course", "--mesh", path, "--out", tmp_path / "run"
    )
    assert code != 0
    assert name in err
    assert len(err.strip().splitlines()) == 1
    assert "Traceback" not in out + err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["simulate", "moon"], "There is no scene 'moon'"),
        (["simulate", "course", "--set", "gravity"], "is not KEY=VALUE"),
        (["simulate", "course", "--set", "weight=3"], "has no parameter 'weight'"),
        (["simulate", "course", "--mesh", "nowhere.obj"], "nowhere.obj"),
        (["simulate", "course", "--functions", "nowhere"], "There is no folder nowhere"),
        (["simulate", "course", "--out", "OUT", "--resume"], "is not a run"),
        (["render", "nowhere"], "is not a run"),
        (["export", "nowhere"], "is not a run"),
        (["export", "nowhere", "--to", "fbx"], "fbx"),
        (["render", "nowhere", "--size", "big"], "is not a picture size"),
        (
            ["check", "gravity", "--functions", str(ROOT / "solutions" / "cloth")],
            "There is no task 'gravity'",
        ),
        (["release", "knitting"], "knitting"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(words, expected, monkeypatch, capsys, tmp_path):
    words = [str(tmp_path / "run") if word == "OUT" else word for word in words]
    monkeypatch.chdir(tmp_path)
    code, out, err = muslin(monkeypatch, capsys, *words)
    assert code != 0
    assert expected in err
    assert "Traceback" not in out + err
    assert len(err.strip().splitlines()) == 1


def test_an_error_of_our_own_is_owned(monkeypatch, capsys):
    from muslin import doctor

    monkeypatch.setattr(doctor, "examine", lambda: 1 / 0)
    code, _, err = muslin(monkeypatch, capsys, "doctor")
    assert code == 70
    assert "an error in Muslin itself" in err
    assert "Traceback" not in err


def test_help_is_quick_and_names_every_command():
    """Help must not load Taichi or NumPy: it is the first thing anyone types."""
    code = "import sys; sys.argv = ['muslin', '--help']\nfrom muslin import cli\n"
    code += "try: cli.main()\nexcept SystemExit: pass\n"
    code += "assert not {'taichi', 'numpy', 'scipy', 'meshio'} & set(sys.modules), 'help is slow'"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for name in ("simulate", "render", "export", "check", "demo", "doctor", "release", "reference"):
        assert name in done.stdout


def test_a_command_is_read_alone_and_a_mistyped_one_among_all(monkeypatch, capsys):
    everything, read = len(cli.app.registered_commands), []

    def called(**_):
        read.append([command.callback.__name__ for command in cli.app.registered_commands])

    monkeypatch.setattr(type(cli.app), "__call__", lambda self, **_: called())
    for words in (["check"], ["class", "grade"], ["chekc"], ["--help"], []):
        muslin(monkeypatch, capsys, *words)
    assert read[0] == ["check"]
    assert read[1] == []
    assert [len(names) for names in read[2:]] == [everything] * 3
    assert len(cli.app.registered_commands) == everything > 10


def test_an_unbuffered_interrupt_leaves_a_usable_run(tmp_path):
    """A real Ctrl-C, sent to a real process."""
    import signal

    from muslin.simulation.runs import RunFolder

    run = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-m", "muslin.cli", "simulate", "drape", "--out", run],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        for _ in range(1200):
            if (run / "frames" / "000012.npy").is_file():
                break
            assert process.poll() is None
            __import__("time").sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == cli.INTERRUPTED, err
    assert "--resume" in out
    assert "Traceback" not in err
    folder = RunFolder(run)
    assert len(folder.frames) >= 4
    assert len(folder.energies) >= 13


def test_the_readme_shows_what_it_promises():
    """Two commands, a picture that exists, and only commands that are real."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```(?:sh|bash)\n(.*?)```", text, re.S)
    assert "muslin demo" in blocks[0]
    assert "pytest" in blocks[1]
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text)
    assert pictures
    for target in pictures + re.findall(r"\]\((?!http)([^)#]+)[^)]*\)", text):
        assert (ROOT / target).exists(), target
    known = {command.name or command.callback.__name__ for command in cli.app.registered_commands} | {
        "reference"
    }
    for word in re.findall(r"(?:^|\s|/)muslin ([a-z]+)", "\n".join(blocks)):
        assert word in known, word


def test_paths_are_shown_from_the_working_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert paths.shown(tmp_path / "a" / "b.py") == "a/b.py"
    assert paths.shown("/elsewhere/b.py") == "/elsewhere/b.py"


def test_the_time_left_is_told_from_the_steps_and_not_from_what_was_compiled_before_them(monkeypatch, capsys):
    clock = iter([0.0, 40.0, 42.0, 46.0, 50.0])
    monkeypatch.setattr(console, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    with console.progress("simulating") as tick:
        for done in (1, 2, 4, 6):  # 40 s until the first, then 2 s a step
            tick(done, 6)
    assert capsys.readouterr().err.splitlines() == ["simulating: 1/6", "simulating: 4/6, 4 s left"]
