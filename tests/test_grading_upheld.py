"""Where only a property is broken, the text is searched for the change by which all of them hold."""

import pytest

import muslin
from muslin.base import paths
from muslin.student.checking import examine

GAP = """
    gap = s[0] - s[1]
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
    if {condition}:
        flip = (dpsi_ds[0] - dpsi_ds[1]) / gap
    both = s[0] + s[1]
    if both < 1e-6:
        both {floor} 1e-6
    twist = (dpsi_ds[0] + dpsi_ds[1]) / both
    return ti.Vector([flip, twist, dpsi_ds[0] / max(s[0], 1e-6), dpsi_ds[1] / max(s[1], 1e-6)])
"""


def written(folder, file, task, body):
    """A folder with the solution's file, one function of which has another body."""
    text = (paths.source("cloth") / file).read_text(encoding="utf-8")
    head, _, rest = text.partition(f"def {task}(")
    signature, _, rest = rest.partition("\n    # begin solution")
    rest = rest.partition("# end solution")[2]
    (folder / file).write_text(f"{head}def {task}({signature}{body}{rest}", encoding="utf-8")


def eigensystem(condition="abs(gap) > 1e-3", floor="="):
    return GAP.format(condition=condition, floor=floor)


def test_the_function_that_is_changed_here_is_right(tmp_path):
    written(tmp_path, "stiffness.py", "eigensystem", eigensystem())
    (report,) = examine(tmp_path, "cloth", ("eigensystem",))
    assert report.status == "green", report.message


@pytest.mark.parametrize(
    ("file", "task", "body", "said"),
    [
        ("stiffness.py", "eigensystem", eigensystem("gap > 1e-3"), "`abs(gap)` belongs"),
        ("stiffness.py", "eigensystem", eigensystem(floor="+="), "where = belongs"),
        ("collision.py", "filter_velocity", """
    d = v.dot(n)
    result = v
    if d < -0.05:
        result = v - d * n
    return result
""", "where `d < 0` belongs"),
    ],
)  # fmt: skip
def test_a_change_by_which_every_property_holds_is_told_by_check_and_by_the_grader(
    file, task, body, said, tmp_path
):
    written(tmp_path, file, task, body)
    (report,) = examine(tmp_path, "cloth", (task,))
    assert report.status == "wrong"
    assert report.mistake.startswith("This must hold, and does not: ")
    assert said in report.mistake
    record = muslin.grade(tmp_path, "cloth", only=[task])
    (failed,) = [c for c in record[task].checks if c.diagnosis]
    assert failed.layer == "properties"
    assert said in failed.diagnosis


def test_what_switches_a_guard_off_is_not_told_before_what_mends_it(tmp_path):
    text = (paths.source("cloth") / "stiffness.py").read_text(encoding="utf-8")
    assert "abs(gap) > 1e-5 and" in text
    (tmp_path / "stiffness.py").write_text(
        text.replace("abs(gap) > 1e-5 and", "gap > 1e-5 and"), encoding="utf-8"
    )
    (report,) = examine(tmp_path, "cloth", ("eigensystem",))
    assert "where `abs(gap)` belongs" in report.mistake


@pytest.mark.parametrize(
    ("condition", "status"),
    [
        ("gap != 0.0", "wrong"),
        ("abs(gap) > 1e-13", "wrong"),
        ("abs(gap) > 1e-9", "green"),
        ("abs(gap) > 2e-3", "green"),
    ],
)
def test_a_quotient_of_rounding_errors_is_wrong_and_any_threshold_between_is_right(
    condition, status, tmp_path
):
    written(tmp_path, "stiffness.py", "eigensystem", eigensystem(condition))
    (report,) = examine(tmp_path, "cloth", ("eigensystem",))
    assert report.status == status, report.message
    assert ("one rounding error divided by another" in report.mistake) == (status == "wrong")


def test_nothing_is_told_of_a_text_that_is_not_understood(tmp_path):
    body = """
    d = v.dot(n)
    result = v
    while d < -0.05:
        result = v - d * n
        d = 0.0
    return result
"""
    written(tmp_path, "collision.py", "filter_velocity", body)
    (report,) = examine(tmp_path, "cloth", ("filter_velocity",))
    assert report.status == "wrong"
    assert report.mistake.startswith("This must hold, and does not: ")
    assert "Line" not in report.mistake
