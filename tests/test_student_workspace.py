"""The student's commands, typed one after the other in a folder of their own."""

import json
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from muslin import cli
from muslin.base import paths
from muslin.reading import source
from muslin.student import gradcheck, plain, rows, workspace

ROOT = Path(__file__).resolve().parent.parent
SOLUTION = ROOT / "solutions" / "cloth"
FILES = workspace.assignment("cloth").files


def muslin(monkeypatch, capfd, *words):
    """Run the command line in this process; returns (exit code, output, errors)."""
    monkeypatch.setattr(sys, "argv", ["muslin", *map(str, words)])
    try:
        cli.main()
        code = 0
    except SystemExit as ending:
        code = ending.code or 0
    out, err = capfd.readouterr()
    return code, out, err


@pytest.fixture
def typed(tmp_path, monkeypatch, capfd):
    """Type a command in the workspace `my-cloth`; returns (exit code, output, errors)."""
    monkeypatch.chdir(tmp_path)
    assert muslin(monkeypatch, capfd, "start", "cloth", "my-cloth")[0] == 0
    monkeypatch.chdir("my-cloth")
    return lambda *words: muslin(monkeypatch, capfd, *words)


def answer(*files):
    """Put the reference solution's files into the working folder."""
    for file in files:
        shutil.copy(SOLUTION / file, file)


def write(task, body, folder=Path()):
    """Write a function's body."""
    file = folder / workspace.assignment("cloth").tasks[task].file
    text = source.Source(file.read_text(encoding="utf-8"))
    lines = text.functions[task].body
    text.lines[lines.start : lines.stop] = [f"    {line}\n" for line in body.splitlines()]
    file.write_text("".join(text.lines), encoding="utf-8")


# --- start -----------------------------------------------------------------------------------------------


def test_a_workspace_has_all_that_was_released_and_settings_for_editors(typed):
    here = Path()
    for given in (
        p for p in paths.assignment("cloth").rglob("*") if p.is_file() and "__pycache__" not in p.parts
    ):
        relative = given.relative_to(paths.assignment("cloth"))
        assert (here / relative).read_bytes() == given.read_bytes()
    about = json.loads(Path(".muslin/workspace.json").read_text())
    assert (about["assignment"], about["version"]) == ("cloth", workspace.assignment("cloth").version)
    assert set(FILES) < set(about["files"])
    settings = Path("pyproject.toml").read_text() + Path(".vscode/settings.json").read_text()
    assert str(Path(sys.prefix)) not in settings
    assert str(Path.home()) not in settings


def test_an_environment_beside_the_workspace_is_named_by_a_relative_path(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "prefix", str(tmp_path / ".venv"))
    monkeypatch.setattr(sys, "base_prefix", "elsewhere")
    workspace.start("cloth", tmp_path / "course" / "cloth")
    text = (tmp_path / "course" / "cloth" / "pyproject.toml").read_text()
    assert 'venvPath = "../.."' in text
    assert 'venv = ".venv"' in text
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "far" / "away" / ".venv"))
    workspace.start("cloth", tmp_path / "elsewhere")
    assert "venv" not in (tmp_path / "elsewhere" / "pyproject.toml").read_text()


def test_starting_never_overwrites(typed, tmp_path, monkeypatch, capfd):
    code, _, err = typed("start", "cloth", ".")
    assert code == 1
    assert "is a workspace already" in err
    other = tmp_path / "other"
    other.mkdir()
    (other / "stress.py").write_text("mine\n")
    code, _, err = typed("start", "cloth", other)
    assert code == 1
    assert "stress.py is there already; nothing was written" in err
    assert [p.name for p in other.iterdir()] == ["stress.py"]
    code, _, err = typed("start", "knitting")
    assert code == 1
    assert "There is no assignment 'knitting'" in err
    (tmp_path / "file").write_text("")
    assert "is a file" in typed("start", "cloth", tmp_path / "file")[2]


def test_a_folder_with_other_things_in_it_can_be_started_in(tmp_path):
    (tmp_path / "notes.txt").write_text("mine\n")
    (tmp_path / ".git").mkdir()
    assert "README.md" in workspace.start("cloth", tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine\n"


def test_outside_a_workspace_one_is_told_how_to_make_one(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    for command in (["check"], ["list"], ["hint"], ["run"], ["submit"], ["explain"], ["watch"], ["upgrade"]):
        code, _, err = muslin(monkeypatch, capfd, *command)
        assert code == 1
        assert "muslin start cloth|solids" in err
        assert "Traceback" not in err


def test_scenes_of_the_workspaces_own_body_come_first(tmp_path, monkeypatch, capfd):
    for assignment, first in (("solids", "beam"), ("cloth", "course")):
        workspace.start(assignment, tmp_path / assignment)
        monkeypatch.chdir(tmp_path / assignment)
        code, out, _ = muslin(monkeypatch, capfd, "scenes")
        assert code == 0
        assert out.split()[0] == first
        assert "drape" in out
        assert "twist" in out


# --- check, list, hint, reset ------------------------------------------------------------------------------


def test_from_the_stub_over_a_mistake_to_green(typed, monkeypatch):
    code, out, _ = typed("check", "S5")
    assert code == 1
    assert "todo right_cauchy_green  not implemented yet" in out
    write("right_cauchy_green", "return F @ F.transpose()")
    code, out, _ = typed("check", "right_cauchy_green")
    assert code == 1
    assert "likely: This is the left Cauchy-Green tensor" in out
    assert "read: README.md:" in out
    assert "muslin explain right_cauchy_green --case" in out
    code, out, _ = typed("list")
    assert "right_cauchy_green" in next(line for line in out.splitlines() if "wrong" in line)
    write("right_cauchy_green", "return F.transpose() @ F")
    assert "not checked" in typed("list")[1]
    monkeypatch.chdir("pictures")  # anywhere in the workspace
    code, out, _ = typed("check", "right_cauchy_green")
    assert code == 0
    assert "Next: psi, at ../strain_energy.py" in out or "Next: psi, at " in out
    code, out, _ = typed("list")
    assert "1/17 tasks, 3/100 points" in out


def test_a_crash_costs_its_own_task_only(typed):
    answer("stress.py")
    with open("strain_energy.py", "a", encoding="utf-8") as stream:
        stream.write("\nimport ctypes\nctypes.string_at(0)\n")
    code, out, _ = typed("check", "right_cauchy_green", "dpsi_dF")
    assert code == 1
    assert "FAIL right_cauchy_green  Your code has ended the whole Python process (SIGSEGV)" in out
    assert "ok   dpsi_dF" in out


def test_a_function_python_cannot_read_leaves_its_neighbours_alone(typed):
    answer("strain_energy.py")
    text = Path("strain_energy.py").read_text(encoding="utf-8")
    Path("strain_energy.py").write_text(
        text.replace("def psi(s, mu, lam):", "def psi(s, mu, lam):\n    y = 2 s")
    )
    code, out, _ = typed("check", "right_cauchy_green", "psi")
    assert code == 1
    assert "ok   right_cauchy_green" in out
    assert "Python cannot read this" in out
    rows = typed("list")[1].splitlines()
    for task, state in {"right_cauchy_green": "green", "psi": "unreadable", "dpsi_ds": "not checked"}.items():
        assert state in next(row for row in rows if f" {task} " in row)


def test_an_index_that_crashes_is_named_at_a_second_look(typed):
    write("right_cauchy_green", "A = F\nfor k in range(20000):\n    A[k * 1000, 0] = 1.0\nreturn A")
    code, out, err = typed("check", "right_cauchy_green")
    assert code == 1
    assert "1000 is not an index of" in out
    assert len((out + err).splitlines()) < 20


def test_a_comment_changes_no_verdict_and_a_helper_does():
    text = (
        "import taichi as ti\n\n\ndef g(x):\n    return x\n\n\ndef f(a):\n    '''Doc.'''\n    return g(a)\n"
    )
    text += "\n\ndef h(a):\n    return a\n"
    key = source.fingerprint(text, "f")
    assert source.fingerprint(text.replace("Doc.", "Words."), "f") == key
    assert source.fingerprint(text.replace("return g(a)", "return g(a)  # !"), "f") == key
    assert source.fingerprint(text.replace("    return a\n", "    return 2 * a\n"), "f") == key
    assert source.fingerprint(text.replace("return x", "return 2 * x"), "f") != key
    assert source.fingerprint(text.replace("import taichi as ti", "import taichi"), "f") != key


def test_hints_come_one_by_one_and_are_remembered(typed):
    hints = workspace.assignment("cloth").tasks["phi"].hints
    for k, hint in enumerate(hints):
        out = typed("hint")[1]  # phi is the first open task
        assert f"hint {k + 1} of {len(hints)}: {hint}" in out
    out = typed("hint", "phi")[1]
    assert all(hint in out for hint in hints)
    assert typed("hint", "phi", "--level", 1)[1].count(", hint ") == 1
    code, _, err = typed("hint", "phi", "--level", 9)
    assert code == 1
    assert "hints 1 to 3" in err
    assert "Did you mean phi" in typed("hint", "fhi")[2]


def test_nothing_but_what_a_function_prints_stands_before_what_is_said_of_it(typed):
    """Where vectors stand in a vector, the engine prints two empty lines before it says that they must not."""
    write("phi", "v = X1 - X0\nreturn ti.Vector([1 - v.sum(), v])")
    write("dphi_dX", "v = X1 - X0\nreturn ti.Matrix([v, v, v])")
    out = typed("check", "phi", "dphi_dX")[1]
    assert [line[:14] for line in out.splitlines() if line[:7] in ("", "  FAIL ")] == [
        "  FAIL phi    ",
        "  FAIL dphi_dX",
    ]
    write("phi", 'print("mine", X[0])\nreturn X')
    assert typed("check", "phi")[1].startswith("mine ")


def test_resetting_keeps_a_backup_and_everything_else(typed):
    write("dphi_dX", "return my_helper(X0, X1, X2)")
    with open("shape_functions.py", "a", encoding="utf-8") as stream:
        stream.write("\n\n@ti.func\ndef my_helper(a, b, c):\n    return a\n")
    mine = Path("shape_functions.py").read_text(encoding="utf-8")
    code, out, _ = typed("reset", "dphi_dX")
    assert code == 0
    backup = next(Path(".muslin/backup").rglob("shape_functions.py.bak"))
    assert backup.as_posix() in out
    assert backup.read_text(encoding="utf-8") == mine
    now = Path("shape_functions.py").read_text(encoding="utf-8")
    assert now == paths.assignment("cloth").joinpath("shape_functions.py").read_text(encoding="utf-8") + (
        "\n\n@ti.func\ndef my_helper(a, b, c):\n    return a\n"
    )
    assert "nothing was changed" in typed("reset", "dphi_dX")[1]
    Path("stress.py").write_text("def broken(:\n")
    code, _, err = typed("reset", "dpsi_dF")
    assert code == 1
    assert "muslin reset stress.py" in err
    assert "Fix that line, or start the whole file again" in err
    assert "nothing was changed" in err
    assert typed("reset", "stress.py")[0] == 0
    assert typed("reset", "S1")[0] == 1
    Path("collision.py").unlink()
    assert typed("reset", "filter_velocity")[0] == 0
    assert Path("collision.py").is_file()


def test_a_reset_is_undone_to_the_byte_and_what_was_written_since_is_kept(typed):
    path = Path("shape_functions.py")
    write("phi", "return X0")
    write("dphi_dX", "return X1")
    mine = path.read_bytes()
    assert "muslin reset --undo" in typed("reset", "phi")[1]
    assert typed("reset", "dphi_dX")[0] == 0
    assert typed("reset", "--undo")[0] == 0
    assert typed("reset", "--undo")[0] == 0
    assert path.read_bytes() == mine
    assert "no reset to undo" in typed("reset", "--undo")[2]

    typed("reset", "phi")  # and then work goes on, on another function and on this one
    write("dphi_dX", "return X2")
    write("phi", "return X")
    later = path.read_bytes()
    code, out, _ = typed("reset", "--undo")
    assert code == 0
    now = path.read_text(encoding="utf-8")
    assert "return X0" in now
    assert "return X2" in now
    copy = Path(re.search(r"kept in (\S+)\.$", out, re.MULTILINE)[1])
    assert copy.read_bytes() == later

    broken = path.read_text(encoding="utf-8") + "(("
    path.write_text(broken, encoding="utf-8")
    assert typed("reset", "shape_functions.py")[0] == 0
    assert typed("reset", "--undo")[0] == 0
    assert path.read_text(encoding="utf-8") == broken
    for words in ((), ("phi", "--undo")):
        code, _, err = typed("reset", *words)
        assert code == 2
        assert "give a task or a file, or --undo alone" in err


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("def psi(", " def psi("),
        ("lam/2 (s_0", '"""lam/2 (s_0'),
        ("    raise NotImplementedError", "    return (s[0] * mu"),
    ],
)
def test_resetting_a_function_python_cannot_read_leaves_the_others_as_they_are(typed, right, wrong):
    path = Path("strain_energy.py")
    given = path.read_text(encoding="utf-8")
    head, mark, rest = given.partition("@ti.func\ndef psi(")
    after = rest.index("@ti.func")
    broken = (mark + rest[:after]).replace(right, wrong, 1)
    assert broken != mark + rest[:after]
    below = rest[after:].replace("raise NotImplementedError", "return mine", 1)
    path.write_text(head + broken + below, encoding="utf-8")
    code, out, err = typed("reset", "psi")
    assert (code, err) == (0, "")
    assert "psi is back to the stub" in out
    assert path.read_text(encoding="utf-8") == given.replace(rest[after:], below)


# --- run, submit -------------------------------------------------------------------------------------------


def test_a_missing_file_is_told_once_and_in_one_sentence(tmp_path):
    from muslin.student import submitting

    folder = tmp_path / "work"
    workspace.start("cloth", folder)
    (folder / "stress.py").unlink()
    packed = submitting.pack(workspace.find(folder), tmp_path / "mine.zip")
    assert packed.faults == ("stress.py is missing. Hand it in with the others, under this name",)


def test_a_scene_runs_with_what_is_right_and_says_who_stands_in(typed):
    answer("shape_functions.py", "kinetic_energy.py")
    write("mass_block", "return 2.0 * rho * h * area")
    code, out, err = typed("run", "course", "--steps", 3, "--no-film", "--size", "160x90")
    assert code == 0, err
    assert "Yours: kinetic_energy." in out
    assert "wrong: mass_block" in out
    assert "to do: deformation_gradient, dn_dx" in out
    assert Path("runs/course/course.png").is_file()
    assert "There is no scene 'moon'" in typed("run", "moon")[2]


def test_a_scene_is_looked_at_with_the_workspaces_functions_unless_muslins_are_asked_for(
    typed, tmp_path, monkeypatch
):
    from muslin import viewer

    seen = []
    monkeypatch.setattr(
        viewer, "view", lambda *arguments, **settings: seen.append((*arguments[:2], settings))
    )
    for words in (["hang"], [], ["hang", "--native"], ["jelly"]):  # jelly: of functions that are not here
        assert typed("view", *words)[0] == 0
    here = tmp_path / "my-cloth"
    assert [(scene, functions and functions.resolve()) for scene, functions, _ in seen] == [
        ("hang", here), ("drape", here), ("hang", None), ("jelly", None)
    ]  # fmt: skip
    assert [settings for *_, settings in seen[:2]] != [{}, {}]
    monkeypatch.chdir(tmp_path)
    assert typed("view")[0] == 0
    assert seen[-1][:2] == ("hang", None)
    assert typed("view", "--functions", tmp_path)[0] == 1


def test_what_is_handed_in_is_looked_at_again(typed):
    answer("stress.py")
    Path("collision.py").unlink()
    Path("stiffness.py").write_text("def broken(:\n")
    Path("notes.txt").write_text("mine\n")
    code, out, _ = typed("submit")
    assert code == 0
    assert "Packed 6 of 7 files" in out
    assert "ok   dpsi_dF" in out
    assert "todo phi" in out
    assert "Attention: collision.py" in out
    assert "Attention: stiffness.py, line 1" in out
    with zipfile.ZipFile("my-cloth-cloth.zip") as archive:
        assert set(archive.namelist()) == {*FILES, "assignment.toml"} - {"collision.py"}
    before = Path("my-cloth-cloth.zip").read_bytes()
    assert typed("submit")[0] == 0
    assert Path("my-cloth-cloth.zip").read_bytes() == before, "the same work is the same zip"
    Path("essay.zip").write_text("no zip\n")
    assert "is there already and is not a zip" in typed("submit", "--out", "essay.zip")[2]


# --- explain, gradcheck ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(), (3,), (3, 3), (4, 3), (9, 9), (12, 12)])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 3e6])
def test_numbers_are_told_in_lines_that_a_terminal_of_80_columns_holds(shape, scale):
    some = np.random.default_rng(5)
    mine, right = (np.asarray(scale * some.normal(size=shape)) for _ in range(2))
    told = [*rows.named("  line 12   H = ", mine), *rows.beside("Result", mine, right)]
    assert max(map(len, told)) < 80
    for value in (
        mine,
        right,
    ):  # each can be read off: six digits, or to a thousandth (a tenth) of the largest
        factor, lines = rows.rows(value, rows.WIDTH - 4)
        numbers = re.findall(r"[-+.e\d]+", " ".join(lines))
        read = float(factor.split()[0] if factor else 1) * np.array(numbers, float).reshape(shape)
        digits = 0.06 if shape == (12, 12) else 6e-4
        assert np.abs(read - value).max() <= digits * np.abs(value).max()


def test_of_two_large_matrices_the_entries_that_differ_are_told_worst_first():
    right = np.zeros((9, 9))
    right[3, 4] = 100.0
    mine = right.copy()
    mine[1, 2], mine[3, 4] = 7.0, 130.0
    told = list(rows.beside("Result", mine, right, whole=False))
    assert told[1] == "    of 81 entries 2 differ:"
    assert [line.split() for line in told[3:]] == [
        ["[3,", "4]", "130", "100", "30"], ["[1,", "2]", "7", "0", "7"]
    ]  # fmt: skip


def test_of_a_loop_its_first_two_rounds_and_its_last_are_told_and_of_a_matrix_what_changed(typed):
    answer("shape_functions.py", "deformation_gradient.py", "strain_energy.py")
    write(
        "dpsi_dF",
        "A = U @ diag(dpsi_ds)\nP = ti.Matrix.zero(float, 3, 3)\nfor i in range(3):\n    for j in range(3):\n"
        "        for k in range(3):\n            P[i, j] += A[i, k] * V[j, k]\nreturn P",
    )
    out = typed("explain", "dpsi_dF", "--case", 4)[1]
    told = out.split("line by line")[1].split("Result")[0]
    entries = re.findall(r"P\[(\d), (\d)\] = ", told)
    assert entries[:2] == [("0", "0")] * 2  # two rounds of k
    assert re.search(r"\.\.\. +\d+ more values, round after round of the loop", told)
    assert "[2, 2]" in told or "this is P" in told  # and the last one
    assert len(told.splitlines()) < 25


def test_a_case_is_explained_step_by_step(typed):
    answer("shape_functions.py", "deformation_gradient.py", "strain_energy.py")
    write("dpsi_dF", "A = U @ diag(dpsi_ds)\nB = A @ V\nreturn B")
    code, out, err = typed("explain", "dpsi_dF", "--case", 4)
    assert code == 0, err
    for what in (
        "Psi_s = diag(dpsi_ds)",
        "yours",
        "expected",
        "difference",
        "likely:",
        "F (yours agrees)",
        "s = [",
    ):
        assert what in out
    assert "A = [" in out
    assert "line 18" in out
    write(
        "mass_block",
        "x = 0\nif i == j:\n    x = rho * h * area / 6\nelse:\n    x = rho * h * area / 12\nreturn x",
    )
    out = typed("explain", "mass_block")[1]
    assert "born as a whole number" in out
    assert "does not run yet" in typed("explain", "nodal_force")[1]
    code, _, err = typed("explain", "phi", "--case", 99)
    assert code == 1
    assert "cases 0 to 29" in err


def test_what_plain_python_sees_is_what_taichi_computes():
    import numpy as np

    from muslin import evaluate, load
    from muslin.judging import reference

    functions = load(SOLUTION)
    for name, task in functions.assignment.tasks.items():
        inputs, _ = reference.cases("cloth", name)
        one = {key: value[5] for key, value in inputs.items()}
        got = evaluate(functions[name], **one)
        mine, _ = plain.values(SOLUTION / task.file, name, one)
        for a, b in zip(
            mine if isinstance(mine, tuple) else (mine,),
            got if isinstance(got, tuple) else (got,),
            strict=True,
        ):
            np.testing.assert_allclose(a, b[0], rtol=1e-9, atol=1e-12 * np.abs(b).max())


def test_right_derivatives_make_a_v_and_wrong_ones_do_not(typed):
    answer(*FILES)
    code, out, err = typed("gradcheck", "dn_dx", "dpsi_ds", "d2psi_ds2", "d2psi_dFij", "nodal_force")
    assert code == 0, out + err
    assert out.count("ok  ") == 5
    assert out.count("slope 2.0") == 3
    assert "slope 1.0" in out
    assert Path("runs/gradcheck/dn_dx.png").is_file()
    write("dn_dx", "m = (x1 - x0).cross(x2 - x0)\nreturn ti.Matrix.identity(float, 3) / m.norm()")
    code, out, _ = typed("gradcheck", "dn_dx", "dpsi_dF")
    assert code == 1
    assert "this is not the derivative" in out
    assert "ok   dpsi_dF" in out
    code, _, err = typed("gradcheck", "phi")
    assert code == 1
    assert ", ".join(gradcheck.derivatives("cloth")) in err


def test_the_workspace_is_made_from_an_installed_wheel_too(tmp_path):
    """Only what the wheel carries: the package without its repository."""
    site = tmp_path / "site"
    shutil.copytree(
        ROOT / "framework" / "muslin", site / "muslin", ignore=shutil.ignore_patterns("__pycache__")
    )
    shutil.copytree(ROOT / "assignments", site / "muslin" / "_shipped" / "assignments")
    shutil.copytree(ROOT / "data" / "reference", site / "muslin" / "_shipped" / "data" / "reference")
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); from muslin import cli, paths; "
    code += "assert not paths.in_repository(); cli.main()"
    command = [sys.executable, "-c", code, str(site)]
    done = subprocess.run([*command, "start", "cloth"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    done = subprocess.run([*command, "check", "phi"], cwd=tmp_path / "cloth", capture_output=True, text=True)
    assert "todo phi" in done.stdout, done.stderr


def test_no_curve_of_a_gradcheck_lies_under_another_and_a_slope_is_a_decade_long():
    steps, order = gradcheck.STEPS, 2
    rounding = 1e-15 / steps
    falling = gradcheck.Curve("f", "", "central", steps**order + rounding, steps**order + rounding, 2.0, True)
    drawn = gradcheck.lines(falling)
    assert list(drawn) == ["yours, as a right one", "slope 2"]
    x, y = drawn["slope 2"]
    near = np.isin(steps, x)
    assert (falling.errors[near] > 3 * y).all()
    exact = gradcheck.Curve("f", "", "central", rounding, rounding, None, True)
    assert list(gradcheck.lines(exact)) == ["yours, as a right one"]
    wrong = gradcheck.Curve("f", "", "central", steps**0, steps**order + rounding, None, False)
    assert list(gradcheck.lines(wrong)) == ["a right derivative", "yours", "slope 2"]
