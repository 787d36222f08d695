"""What is looked for too long is given up: the verdict stands, and is not called an endless loop of the student's."""

import pytest

from muslin.base import paths
from muslin.student import checking, workspace

#: A diagnosis, or a look at shapes, that never comes to an end; a student's file is imported where those run.
ENDLESS = """
import muslin.student.checking as checking
import muslin.grading.diagnosis as diagnosis
import muslin.grading.upheld as upheld

def never(*_):
    while True:
        pass

diagnosis.diagnose = diagnosis.misfit = upheld.upheld = never
checking.EXPLAINING = 1.0
"""


@pytest.mark.parametrize(
    ("body", "status", "says", "likely"),
    [
        ("return 2.0 * v", checking.WRONG, "wrong in case", ""),
        ("return v.outer_product(n)", checking.ERROR, "returns a 3x3 matrix", ""),
        (
            "v_n = v.dot(n)\n    v_new = v\n    if v_n < -0.05:\n        v_new = v - v_n * n\n    return v_new",
            checking.WRONG,
            "the public cases agree",
            "This must hold, and does not",
        ),
    ],
)
def test_a_verdict_stands_without_its_explanation(tmp_path, body, status, says, likely):
    folder = tmp_path / "cloth"
    workspace.start("cloth", folder)
    file = folder / "collision.py"
    solution = (paths.solution("cloth") / "collision.py").read_text(encoding="utf-8")
    contact, filtering = (
        solution[: solution.index("@ti.func\ndef filter_velocity")],
        "def filter_velocity(v, n):",
    )
    file.write_text(f"{ENDLESS}\n{contact}\n@ti.func\n{filtering}\n    {body}\n", encoding="utf-8")
    with checking.Checker() as checker:
        reports = list(checker.check(workspace.find(folder), ["filter_velocity", "sphere_contact"]))
    assert [report.task for report in reports] == ["filter_velocity", "sphere_contact"]
    assert reports[0].status == status
    assert says in reports[0].message
    assert likely in reports[0].mistake
    assert "has not come to an end" not in reports[0].message
    assert reports[1].status == checking.GREEN


def test_explain_shows_the_case_all_the_same(tmp_path, monkeypatch, capsys):
    from muslin import cli
    from muslin.student import explaining

    folder = tmp_path / "cloth"
    workspace.start("cloth", folder)
    body = "@ti.func\ndef filter_velocity(v, n):\n    return 2.0 * v\n"
    (folder / "collision.py").write_text(f"{ENDLESS}import taichi as ti\n\n{body}", encoding="utf-8")
    monkeypatch.chdir(folder)
    monkeypatch.setattr(explaining.Looking, "allowed", 1.0)
    monkeypatch.setattr("sys.argv", ["muslin", "explain", "filter_velocity"])
    cli.main()
    said = capsys.readouterr().out
    assert "wrong in case" in said
    assert "has not come to an end" not in said
