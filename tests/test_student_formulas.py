"""A derivative is a formula, and a task's function is alone: what the handouts promise of both."""

import re
import sys
from pathlib import Path

import pytest

import muslin
from muslin import tasks
from muslin.base.errors import StudentCodeError
from muslin.student import checking

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import suite

HELPERS = """\
@ti.func
def energy(F, C, D):
    J = F.determinant()
    return C * (J ** (-2 / 3) * F.norm_sqr() - 3) + D * (J - 1) ** 2


@ti.func
def stress(F, C, D):
    J = F.determinant()
    G = F.inverse().transpose()
    return 2 * C * J ** (-2 / 3) * (F - F.norm_sqr() / 3 * G) + 2 * D * (J - 1) * J * G


"""

DIFFERENCES = {
    "dpsi_dF": """
        P = ti.Matrix.zero(float, 3, 3)
        for a, b in ti.static(ti.ndrange(3, 3)):
            E = ti.Matrix.zero(float, 3, 3)
            E[a, b] = {h}
            P[a, b] = ({f}(F + E, C, D) - {f}(F - E, C, D)) / (2 * {h})
        return P
        """,
    "d2psi_dF2": """
        H = ti.Matrix.zero(float, 9, 9)
        for m, n in ti.static(ti.ndrange(3, 3)):
            E = ti.Matrix.zero(float, 3, 3)
            E[m, n] = {h}
            Q = ({f}(F + E, C, D) - {f}(F - E, C, D)) / (2 * {h})
            for i, j in ti.static(ti.ndrange(3, 3)):
                H[3 * i + j, 3 * m + n] = Q[i, j]
        return H
        """,
}


PLAIN = """\
schema = 1
name = "plain"
title = "Plain"
version = "1.0"

[grading]
deadline = 20
simulation_deadline = 60
hidden_cases = 6
credit = { public = 0.0, hidden = 0.7, properties = 0.3 }

[task.root]
file = "roots.py"
section = "S1"
title = "Root"
points = 1
language = "python"
arguments = { x = "scalar [1] a number" }
results = { root = "scalar [1] its root" }
hints = ["What is its square?", "The square is x."]

[task.fourth]
file = "roots.py"
section = "S1"
title = "Fourth root"
points = 1
language = "python"
arguments = { x = "scalar [1] a number" }
results = { fourth = "scalar [1] its fourth root" }
hints = ["What is its square?", "The square is the root."]
"""


def submission(folder, task, body, helpers="", assignment="solids"):
    """The solution with one function's body written otherwise, perhaps with helpers above it."""
    variant = suite.function(tasks.assignment(assignment).tasks[task], "other", body)
    other = suite.Variant(task, "other", "", "", helpers + variant.code)
    return suite.submission(folder, {task: other}, assignment)


@pytest.mark.parametrize("step", ["1e-4", "1e-5", "2e-6", "1e-6", "1e-7"])
def test_differences_of_an_energy_of_ones_own_are_no_derivative(tmp_path, step):
    """2e-6 is the best step there is; none of them is blamed on a line of the energy, which is right."""
    body = DIFFERENCES["dpsi_dF"].format(h=step, f="energy")
    folder = submission(tmp_path, "dpsi_dF", body, HELPERS)
    (report,) = checking.examine(folder, "solids", ("dpsi_dF",))
    assert report.status == checking.WRONG
    assert report.mistake.startswith(
        "Your result is nearly right, but only to some digits, as by differences with a small step: its error in case"
    )
    assert "numerical derivative" in report.advice


def test_differences_of_a_stress_of_ones_own_are_no_hessian(tmp_path):
    folder = submission(tmp_path, "d2psi_dF2", DIFFERENCES["d2psi_dF2"].format(h="2e-6", f="stress"), HELPERS)
    (report,) = checking.examine(folder, "solids", ("d2psi_dF2",))
    assert report.status == checking.WRONG
    assert "only to some digits" in report.mistake


@pytest.mark.parametrize("right", [True, False], ids=["psi is right", "psi is wrong"])
def test_a_function_that_calls_another_tasks_is_refused_with_the_line_and_nothing_else_is_blamed(
    tmp_path, right
):
    folder = submission(tmp_path, "dpsi_dF", DIFFERENCES["dpsi_dF"].format(h="1e-6", f="psi"))
    path = folder / "neo_hookean.py"
    text = path.read_text(encoding="utf-8")
    if not right:
        assert ".trace() - 3)" in text
        path.write_text(text.replace(".trace() - 3)", ".trace() - 4)", 1), encoding="utf-8")
    line = next(k for k, row in enumerate(text.splitlines(), 1) if "psi(F + E" in row)
    (report,) = checking.examine(folder, "solids", ("dpsi_dF",))
    assert report.status == checking.ERROR
    assert f"neo_hookean.py, line {line}: dpsi_dF calls psi, the function of another task." in report.message
    assert (report.mistake, report.notes) == ("", ())


def test_nor_may_a_helper_call_it(tmp_path):
    helper = "@ti.func\ndef twice(F, C, D):\n    return 2 * psi(F, C, D)\n\n\n"
    folder = submission(tmp_path, "dpsi_dF", "return twice(F, C, D) * F", helper)
    (report,) = checking.examine(folder, "solids", ("dpsi_dF",))
    assert report.status == checking.ERROR
    assert "twice, which dpsi_dF uses, calls psi" in report.message


#: Ways to call another task's function: what stands above the task, and its body.
DISGUISES = {
    "an alias": ("other = psi\n\n\n", "return other(F, C, D) * F"),
    "a class": ("class mine:\n    energy = psi\n\n\n", "return mine.energy(F, C, D) * F"),
    "a dictionary": ("known = {'e': psi}\n\n\n", "return ti.static(known['e'])(F, C, D) * F"),
    "an argument": (
        "@ti.func\ndef of(e: ti.template(), F, C, D):\n    return e(F, C, D)\n\n\n",
        "return of(psi, F, C, D) * F",
    ),
}


@pytest.mark.parametrize(("above", "body"), DISGUISES.values(), ids=DISGUISES)
def test_what_is_called_counts_not_what_it_is_called_by(tmp_path, above, body):
    folder = submission(tmp_path, "dpsi_dF", body, above)
    (report,) = checking.examine(folder, "solids", ("dpsi_dF",))
    assert report.status == checking.ERROR
    assert re.search(r"neo_hookean\.py, line \d+: .*calls psi, the function of another task", report.message)


#: Helpers named like a task of another file, and how a right function of this one uses them.
NAMED_LIKE_A_TASK = {
    "cloth": (
        "d2psi_dFij",
        "from muslin.given import diag\n\n\n@ti.func\ndef dpsi_dF(A, p, B):\n"
        "    return A @ diag(p) @ B.transpose()\n\n\n",
        "return dpsi_dF(dU, dpsi_ds, V) + dpsi_dF(U, d2psi_ds2 @ ds, V) + dpsi_dF(U, dpsi_ds, dV)",
    ),
    "solids": (
        "dpsi_dF",
        "@ti.func\ndef deformation_gradient(F):\n    return F.determinant(), F.inverse().transpose()\n\n\n",
        "J, G = deformation_gradient(F)\n"
        "return 2 * C * J ** (-2 / 3) * (F - F.norm_sqr() / 3 * G) + 2 * D * (J - 1) * J * G",
    ),
}


@pytest.mark.parametrize("assignment", NAMED_LIKE_A_TASK)
def test_a_helper_of_ones_own_may_be_named_like_a_task_of_another_file(tmp_path, assignment):
    """What `check` calls green `grade` gives full points: they once read different tables."""
    task, helper, body = NAMED_LIKE_A_TASK[assignment]
    folder = submission(tmp_path, task, body, helper, assignment)
    (report,) = checking.examine(folder, assignment, (task,))
    assert report.status == checking.GREEN
    only = tmp_path / "handed in"
    only.mkdir()
    file = tasks.assignment(assignment).tasks[task].file
    (only / file).write_bytes((folder / file).read_bytes())
    graded = muslin.grade(only, assignment=assignment)[task]
    assert (graded.score, graded.max_score) == (graded.max_score, graded.max_score)


def test_a_function_that_is_mentioned_and_not_called_is_not_borrowed(tmp_path):
    body = """
        J = F.determinant()
        G = F.inverse().transpose()
        P = 2 * C * J ** (-2 / 3) * (F - F.norm_sqr() / 3 * G) + 2 * D * (J - 1) * J * G
        if ti.static(False):
            P = psi(F, C, D) * F
        return P
        """
    (report,) = checking.examine(submission(tmp_path, "dpsi_dF", body), "solids", ("dpsi_dF",))
    assert report.status == checking.GREEN


@pytest.mark.parametrize("call", ["root(x)", "again(x)", "caught(x)"])
def test_in_plain_python_too(tmp_path, call):
    (tmp_path / "assignment.toml").write_text(PLAIN, encoding="utf-8")
    (tmp_path / "roots.py").write_text(
        "def root(x):\n    return x**0.5\n\n\nagain = root\n\n\n"
        "def caught(x):\n    try:\n        return root(x)\n    except Exception:\n        return x**0.5\n\n\n"
        f"def fourth(x):\n    return {call}**0.5\n",
        encoding="utf-8",
    )
    functions = tasks.load(tmp_path, tasks.read_assignment(tmp_path))
    line = 10 if "caught" in call else 16
    for _ in range(2):
        with pytest.raises(
            StudentCodeError, match=rf"line {line}: .*calls root, the function of another task"
        ):
            muslin.evaluate(functions.fourth, x=[16.0])
        assert muslin.evaluate(functions.root, x=[16.0]) == [4.0]


@pytest.mark.parametrize(
    ("task", "body"),
    [
        ("interpolate", "return phi[0] * x0 + phi[1] * x1 + phi[2] * x2 + phi[3] * x3"),
        ("psi", "dpsi_dF = F.determinant()\nreturn C * dpsi_dF + D"),
        ("stiffness_block", "nodal_force = d2psi_dF2[0, 0]\nreturn nodal_force * volume"),
    ],
)
def test_an_argument_or_a_variable_may_be_called_like_a_task(tmp_path, task, body):
    reports = checking.examine(submission(tmp_path, task, body), "solids", (task,))
    assert all("another task" not in report.message for report in reports)


def test_of_a_large_matrix_the_wrong_entries_are_told_in_lines_that_fit(tmp_path):
    body = """
        H = ti.Matrix.zero(float, 9, 9)
        for i, j, m, n in ti.ndrange(3, 3, 3, 3):
            if i == m and j == n:
                H[3 * i + j, 3 * m + n] = C
        H[2, 5] += 1e9
        return H
        """
    (report,) = checking.examine(submission(tmp_path, "d2psi_dF2", body), "solids", ("d2psi_dF2",))
    lines = report.message.splitlines()
    told = [line for line in lines if "expected =" in line]
    assert told[0].startswith("[2, 5]   yours = 1")  # it is off by far more than all others
    assert 1 < len(told) <= 6
    assert max(map(len, lines[1:])) <= 71  # check indents them by nine
