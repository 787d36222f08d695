"""What fails becomes a squiggle: VS Code's problem matcher of a workspace, applied to what Muslin really writes."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from muslin.base import paths
from muslin.student import workspace

WRONG = '''"""Mine."""
import taichi as ti


@ti.func
def mass_block(i, j, area, rho, h):
    """Twice what it should be."""
    m = rho * h * area / 6
    if i == j:
        m = m * 2
    return m


@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    return rho * speed(v0)
'''

UNREADABLE = """import taichi as ti


@ti.func
def psi(s, mu, lam):
    return mu * (s[0] - 1) ** 2 +
"""


#: The tasks of that file.
UNREAD = {"right_cauchy_green", "psi", "dpsi_ds", "d2psi_ds2"}


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "my cloth"
    workspace.start("cloth", made)
    (made / "kinetic_energy.py").write_text(WRONG, encoding="utf-8")
    (made / "strain_energy.py").write_text(UNREADABLE, encoding="utf-8")
    shutil.copy(paths.solution("cloth") / "shape_functions.py", made)
    return made


def tasks(folder):
    """The workspace's tasks by label."""
    return {
        task["label"]: task for task in json.loads((folder / ".vscode" / "tasks.json").read_text())["tasks"]
    }


def written(folder, task, **variables):
    """What a task writes, in a terminal that is narrow."""
    assert task["command"] == "${command:python.interpreterPath}"
    words = [word.replace("${fileBasename}", "kinetic_energy.py") for word in task["args"]]
    assert task["options"]["cwd"] == "${workspaceFolder}"
    done = subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False,
                          env=os.environ | {"COLUMNS": "60"} | variables)  # fmt: skip
    return done.stdout


def problems(task, output):
    """What VS Code makes of the output: file, line, severity and message of each problem."""
    (matcher,) = task["problemMatcher"]
    assert matcher["fileLocation"] == ["relative", "${workspaceFolder}"]
    pattern = matcher["pattern"]
    found = [re.search(pattern["regexp"], line) for line in output.splitlines()]
    return [
        tuple(match[pattern[part]] for part in ("file", "line", "severity", "message"))
        for match in found
        if match
    ]


def test_every_task_that_fails_is_a_problem_at_its_line_and_no_other(folder):
    task = tasks(folder)["muslin check"]
    assert task["group"] == {"kind": "build", "isDefault": True}
    output = written(folder, task)
    found = {
        message.split(":")[0]: (file, int(line), severity)
        for file, line, severity, message in problems(task, output)
    }
    assert found == {
        "mass_block": ("kinetic_energy.py", 8, "error"),  # the factor, in the line that has it
        "kinetic_energy": ("kinetic_energy.py", 16, "error"),
        "psi": ("strain_energy.py", 6, "error"),
        "dpsi_ds": ("strain_energy.py", 6, "error"),  # the file cannot be read: its other tasks neither
        "d2psi_ds2": ("strain_energy.py", 6, "error"),
        "right_cauchy_green": ("strain_energy.py", 6, "error"),
    }
    said = {message for *_, message in problems(task, output)}
    assert any("Nothing here gives speed a value" in message or "speed" in message for message in said)
    for file, line, *_ in problems(task, output):
        assert 0 < int(line) <= len((folder / file).read_text().splitlines())


def test_the_file_that_is_open_is_checked_alone(folder):
    task = tasks(folder)["muslin check this file"]
    assert {file for file, *_ in problems(task, written(folder, task))} == {"kinetic_energy.py"}


def test_what_is_right_or_not_begun_is_no_problem_and_without_the_option_nothing_is_written_for_editors(
    folder,
):
    task = tasks(folder)["muslin check"]
    (folder / "kinetic_energy.py").write_bytes((paths.solution("cloth") / "kinetic_energy.py").read_bytes())
    (folder / "strain_energy.py").write_bytes((paths.assignment("cloth") / "strain_energy.py").read_bytes())
    assert problems(task, written(folder, task)) == []
    task["args"].remove("--problems")
    (folder / "strain_energy.py").write_text(UNREADABLE, encoding="utf-8")
    assert problems(task, written(folder, task)) == []


def test_a_function_without_a_line_in_its_verdict_is_marked_where_it_begins(folder):
    (folder / "strain_energy.py").unlink()
    (folder / "kinetic_energy.py").write_text(WRONG.replace("area / 6", "area * 5.3 + i"), encoding="utf-8")
    task = tasks(folder)["muslin check"]
    found = {
        message.split(":")[0]: (file, int(line))
        for file, line, _, message in problems(task, written(folder, task))
    }
    assert found["psi"] == ("strain_energy.py", 1)  # it is missing
    assert found["mass_block"][0] == "kinetic_energy.py"
    assert 6 <= found["mass_block"][1] <= 11


@pytest.mark.skipif(sys.platform == "win32", reason="ended by a signal")
def test_while_watching_all_that_fails_is_told_again_after_each_save(folder):
    task = tasks(folder)["muslin watch"]
    assert task["isBackground"] is True
    background = task["problemMatcher"][0]["background"]
    with subprocess.Popen(
        [sys.executable, *task["args"]], cwd=folder, stdout=subprocess.PIPE, text=True
    ) as process:
        try:

            def one_check():
                """Problems between the next two marks that have any, or None where there were none."""
                seen = []
                for line in process.stdout:
                    if re.search(background["beginsPattern"], line.rstrip("\n")):
                        seen = []
                    elif re.search(background["endsPattern"], line.rstrip("\n")):
                        return {message.split(":")[0] for *_, message in problems(task, "".join(seen))}
                    else:
                        seen.append(line)
                raise AssertionError("it ended")

            assert one_check() == set()  # before anything has been looked at
            assert one_check() == {"mass_block", "kinetic_energy", *UNREAD}
            right = (paths.solution("cloth") / "kinetic_energy.py").read_text(encoding="utf-8")
            (folder / "kinetic_energy.py").write_text(right, encoding="utf-8")
            assert one_check() == UNREAD
        finally:
            process.terminate()


def test_what_a_students_code_says_begins_no_problem_of_its_own(folder):
    text = WRONG.replace("speed(v0)", '"\\nstress.py:1: error: forged"')
    (folder / "kinetic_energy.py").write_text(text, encoding="utf-8")
    task = tasks(folder)["muslin check"]
    assert "stress.py" not in {file for file, *_ in problems(task, written(folder, task))}


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no JavaScript here")
def test_the_matcher_reads_the_same_in_javascript(folder):
    task = tasks(folder)["muslin check"]
    output = written(folder, task)
    script = "const [p, o] = JSON.parse(require('fs').readFileSync(0)); console.log(JSON.stringify(" \
        "o.split('\\n').map((l) => l.match(new RegExp(p))).filter(Boolean).map((m) => m.slice(1))))"  # fmt: skip
    asked = json.dumps([task["problemMatcher"][0]["pattern"]["regexp"], output])
    read = json.loads(
        subprocess.run(["node", "-e", script], input=asked, capture_output=True, text=True, check=True).stdout
    )
    assert [tuple(one) for one in read] == problems(task, output)
    assert len(read) == 6
