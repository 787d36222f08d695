"""The commonest Taichi mistakes, each told in the student's words: file, line, expression, what to write instead."""

from pathlib import Path

import pytest

import muslin
from muslin import reading
from muslin.student import checking

RCG = "right_cauchy_green"
HEAD = "import math\n\nimport numpy as np\nimport taichi as ti\n\n\n"
HELPER = "def helper(s):\n    y = 0.0\n    for k in range(2):\n        y += s[k]\n    return y\n\n\n"
SIMPLE = "def helper(x):\n    return x * x\n\n\n"

#: mistake -> (task, what stands above it, body, line in the body that is named, what to write instead)
MISTAKES = {
    "a Python list in a kernel": (RCG, "", "v = [1.0, 2.0, 3.0]\nreturn F @ v", 1, "v = ti.Vector([...])"),
    "a Python list times a number": ("dpsi_ds", "", "v = [1.0, 2.0, 3.0]\nreturn v * 2.0", 1, "v = ti.Vector([...])"),
    "a Python list returned": ("dpsi_ds", "", "return [mu, lam, 0.0]", 1, "ti.Vector([...])"),
    "a matrix of the wrong size, multiplied": (
        RCG, "", "A = ti.Matrix([[1.0, 0.0], [0.0, 1.0]])\nreturn F @ A", 2, "Look at the shapes"),
    "a matrix of the wrong size, added": (
        RCG, "", "A = ti.Matrix([[1.0, 0.0], [0.0, 1.0]])\nreturn F + A", 2, "need the same size"),
    "a matrix of the wrong size, returned": (
        RCG, "", "return ti.Matrix([[1.0, 0.0], [0.0, 1.0]])", None,
        "returns a 2x2 matrix where a 3x3 matrix is asked"),
    "integer division": ("psi", "", "half = 1 // 2\nreturn half * mu * (s[0] - 1) ** 2", 1, "write /"),
    "a variable born as an integer": ("psi", "", "y = 0\ny += mu * (s[0] - 1) ** 2\nreturn y", 1, "write 0.0 for 0"),
    "a vector born of integers": (
        "dpsi_ds", "", "p = ti.Vector([0, 0, 0])\np[0] = 2 * mu * (s[0] - 1)\nreturn p", 1, "write 0.0 for 0"),
    "a float32 literal": ("psi", "", "half = ti.f32(0.1)\nreturn half * mu * (s[0] - 1) ** 2", 1, "leave it out"),
    "a return in a branch": ("psi", "", "if s[0] > 1:\n    return mu\nreturn lam", 2, "end with return y"),
    "a missing @ti.func above the task": ("psi", None, "return mu", None, "Write @ti.func on the line above def psi"),
    "a missing @ti.func above a helper": ("psi", HELPER, "return mu * helper(s)", 1, "above def helper (line 7)"),
    "a missing @ti.func that compiles": ("psi", SIMPLE, "return mu * helper(s[0])", 1, "above def helper (line 7)"),
    "calling numpy": ("psi", "", "return np.sqrt(mu)", 1, "write ti.sqrt"),
    "calling numpy on a matrix": (RCG, "", "return np.transpose(F) @ F", 1, "write A.transpose()"),
    "calling numpy, which compiles": (RCG, "", "return np.dot(F, F)", 1, "A @ B for matrices"),
    "calling numpy for an array": ("dpsi_ds", "", "return np.array([mu, lam, 0.0])", 1, "write ti.Vector([...])"),
    "calling math": ("psi", "", "return math.sqrt(mu)", 1, "write ti.sqrt"),
    "changing an argument": (RCG, "", "F = F.transpose()\nreturn F.transpose() @ F", 1, "a new variable"),
    "changing an entry": (RCG, "", "F[0, 0] = 1.0\nreturn F.transpose() @ F", 1, "a new variable"),
    "recursion": ("psi", "", "return psi(s, mu, lam)", 1, "calls itself"),
    "a loop over a vector": ("psi", "", "t = 0.0\nfor x in s:\n    t += x\nreturn t", 2, "for k in ti.static(range("),
    "a loop over the rows of a matrix": (
        RCG, "", "t = 0.0\nfor row in F:\n    t += row[0]\nreturn F * t", 2, "A[k, :]"),
    "a loop that enumerates": ("psi", "", "t = 0.0\nfor k, x in enumerate(s):\n    t += x\nreturn t", 2, "take v[k]"),
    "a list indexed in a loop": (
        "psi", "", "w = [1.0, 2.0]\nt = 0.0\nfor k in range(2):\n    t += w[k]\nreturn t", 4,
        "ti.static(range(3))"),
    "the sum of a vector": ("psi", "", "return sum(s)", 1, "v.sum()"),
    "numpy's transpose": (RCG, "", "return F.T @ F", 1, "A.transpose()"),
    "two square brackets": (RCG, "", "return F * F[0][0]", 1, "A[i, j]"),
    "a variable born in a branch": ("psi", "", "if s[0] > 1:\n    y = 2.0\nreturn y", 3, "give it a value before"),
    "a power as in mathematics": ("psi", "", "return mu ^ 2", 1, "a power is **"),
}  # fmt: skip


def written(folder, task, above, body):
    """A file with one function; returns the line its body begins in."""
    table = muslin.tasks.assignment()
    entry = table.tasks[task]
    head = f"{HEAD}{above or ''}{'' if above is None else '@ti.func' + chr(10)}"
    head += f"def {task}({', '.join(a.name for a in entry.arguments)}):\n"
    text = head + "".join(f"    {line}\n" for line in body.splitlines())
    (folder / entry.file).write_text(text, encoding="utf-8")
    return head.count("\n") + 1


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_common_mistake_is_told_with_its_line_and_what_to_write(mistake, tmp_path, monkeypatch):
    task, above, body, line, instead = MISTAKES[mistake]
    monkeypatch.chdir(tmp_path)
    first = written(tmp_path, task, above, body)
    (report,) = checking.examine(Path(), "cloth", (task,))
    assert report.status in (checking.WRONG, checking.ERROR)
    told = "\n".join([report.message, report.mistake, *report.notes])
    assert instead in told
    assert "site-packages" not in told
    assert "taichi.lang" not in told
    if line is not None:
        assert f"line {first + line - 1}" in told
        expression = body.splitlines()[line - 1].strip()
        quoted = [note.partition(", ")[2].rpartition(": ")[0] for note in report.notes]
        assert expression in report.message or any(part and part in expression for part in quoted)


def test_a_right_function_is_read_without_a_word():
    folder = Path(__file__).resolve().parent.parent / "solutions" / "cloth"
    table = muslin.tasks.read_assignment(folder)
    for task in table.tasks.values():
        text = (folder / task.file).read_text(encoding="utf-8")
        assert reading.notes(text, task.name) == []


def test_what_is_not_python_is_read_as_nothing():
    assert reading.notes("def f(:\n", "f") == []
