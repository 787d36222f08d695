"""What is told of a function that does not compile for its shapes: the change after which it is right."""

import pytest

from muslin import tasks
from muslin.base import paths
from muslin.grading.diagnosis import misfit
from muslin.judging import reference
from muslin.student.checking import examine

TABLE = tasks.assignment("cloth")

#: Task, a piece of its solution, what is written instead, and what is to be told.
SLIPS = [
    ("dphi_dX", "ti.Matrix.cols([X1 - X0, X2 - X0])", "ti.Matrix.rows([X1 - X0, X2 - X0])", "`ti.Matrix.cols` belongs"),
    ("deformation_gradient", "n.outer_product(N)", "n.cross(N)", "`n.outer_product(N)` belongs"),
    ("right_cauchy_green", "F.transpose() @ F", "F.transpose().dot(F)", ""),
    ("nodal_force", "P @ grad_phi", "P.transpose() @ grad_phi.transpose()", ""),
    ("filter_velocity", "d = n.dot(v)", "d = n.outer_product(v)", "`n.dot(v)` belongs"),
    ("sphere_contact", "d.norm() < r", "d < r", "`d.norm()` belongs"),
    ("d2psi_dFij", "V.transpose()", "V.transpose() @ ds", ""),
]  # fmt: skip


def written(task, piece, instead):
    text = (paths.solution("cloth") / TABLE.tasks[task].file).read_text(encoding="utf-8")
    begin = text.index(f"def {task}(")
    assert piece in text[begin:], (task, piece)
    return text[:begin] + text[begin:].replace(piece, instead, 1)


def told(task, text):
    inputs, expected = reference.cases("cloth", task)
    found = misfit(TABLE.tasks[task], expected, inputs, "cloth", text)
    return found.mistake if found else ""


@pytest.mark.parametrize(("task", "piece", "instead", "words"), SLIPS, ids=[slip[0] for slip in SLIPS])
def test_a_change_that_makes_shapes_fit_and_the_answers_right_is_told_and_no_other(
    task, piece, instead, words
):
    said = told(task, written(task, piece, instead))
    assert words in said
    assert bool(words) == bool(said)


@pytest.mark.parametrize("task", TABLE.tasks)
def test_nothing_is_told_of_a_function_whose_shapes_are_right(task):
    assert told(task, (paths.solution("cloth") / TABLE.tasks[task].file).read_text(encoding="utf-8")) == ""


def test_the_check_tells_it_beside_the_compilers_message(tmp_path):
    task, piece, instead, words = SLIPS[0]
    (tmp_path / TABLE.tasks[task].file).write_text(written(task, piece, instead), encoding="utf-8")
    (report,) = examine(tmp_path, "cloth", (task,))
    assert report.status == "error"
    assert f"{TABLE.tasks[task].file}, line" in report.message
    assert words in report.mistake
