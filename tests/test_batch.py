"""The bridge between numpy and student functions: shapes in, shapes out, and mistakes explained in their terms."""

import textwrap
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import given, tasks
from muslin.base.errors import MuslinError, NotImplementedYet, StudentCodeError
from muslin.judging import reference

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def solution():
    return muslin.load(ROOT / "solutions" / "cloth")


def submission(folder, name, body, header="import taichi as ti\nimport math\nimport numpy as np\n"):
    """A folder with one function of the assignment, decorated, with this body."""
    task = muslin.load(ROOT / "solutions" / "cloth")[name].task
    arguments = ", ".join(value.name for value in task.arguments)
    code = f"{header}\n@ti.func\ndef {name}({arguments}):\n" + textwrap.indent(textwrap.dedent(body), "    ")
    (folder / task.file).write_text(code)
    return muslin.load(folder)


def test_one_sample_serves_a_whole_batch(solution):
    n = np.array([0.0, 0.0, 1.0])
    v = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_array_equal(
        muslin.evaluate(solution.filter_velocity, v=v, n=n),
        muslin.evaluate(solution.filter_velocity, v=v, n=np.tile(n, (5, 1))),
    )


def test_inputs_are_never_changed(tmp_path):
    f = submission(tmp_path, "filter_velocity", "v[0] = 7.0\nreturn v")
    v = np.zeros((3, 3))
    got = muslin.evaluate(f.filter_velocity, v=v, n=v)
    np.testing.assert_array_equal(got[:, 0], 7.0)
    np.testing.assert_array_equal(v, 0.0)


def test_functions_that_return_several_values_give_a_tuple(solution):
    hit, n = muslin.evaluate(solution.sphere_contact, x=np.zeros((2, 3)), c=np.ones(3), r=[1.0, 2.0])
    assert hit.tolist() == [0, 1]
    assert n.shape == (2, 3)
    U, s, V = muslin.evaluate(given.svd, F=np.eye(3)[None], N=np.array([[0.0, 0.0, 1.0]]))
    assert U.shape == V.shape == (1, 3, 3)
    assert s.tolist() == [[1.0, 1.0, 1.0]]


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"v": np.zeros((2, 3))}, r"takes \(v, n\)"),
        ({"v": np.zeros((2, 2)), "n": np.zeros((2, 3))}, r"v is a vec3 and needs shape \(b, 3\)"),
        ({"v": np.zeros((2, 3)), "n": np.zeros((4, 3))}, "different numbers of samples"),
    ],
)
def test_wrong_arguments_are_named(solution, arrays, words):
    with pytest.raises(MuslinError, match=words):
        muslin.evaluate(solution.filter_velocity, **arrays)


def test_every_stub_says_that_it_is_one(monkeypatch):
    monkeypatch.chdir(ROOT)
    stubs = muslin.load("assignments/cloth")
    for function in stubs:
        task = function.task
        with pytest.raises(NotImplementedYet) as caught:
            muslin.evaluate(function, **{value.name: 0.0 for value in task.arguments})
        assert str(caught.value) == f"not implemented yet: {task.name} (assignments/cloth/{task.file})"


MISTAKES = {
    "a method that does not exist": ("return v.crss(n)", ["line 7", "v.crss(n)", "write v.cross()"]),
    "a Python list": ("return [v[0], v[1], v[2]]", ["returns a Python list", "ti.Vector"]),
    "a matrix instead of a vector": (
        "return v.outer_product(n)",
        ["returns a 3x3 matrix where a vector of 3"],
    ),
    "shapes that do not fit": ("return v.outer_product(n) + v", ["line 7", "a 3x3 matrix and a vector of 3"]),
    "return in a branch": (
        "if v.dot(n) < 0:\n    return v\nreturn n",
        ["line 8", "end with return y"],
    ),
    "numpy": ("return np.cross(v, n)", ["line 7", "NumPy and math do not run"]),
    "math": ("return v * math.sqrt(n[0])", ["line 7", "ti.sqrt"]),
    "an unknown name": ("return w", ["line 7", "gives w a value"]),
    "recursion": ("return filter_velocity(v, n)", ["line 7", "calls itself"]),
    "no return": ("d = v.dot(n)", ["returns nothing"]),
    "an index out of range": ("return v * n[3]", ["line 7", "3 is not an index of a vector of 3"]),
    "vectors in a matrix": ("return ti.Matrix([v, n, v]) @ v", ["line 7", "ti.Matrix.rows"]),
    "a list indexed late": ("return [v, n][int(n[0])]", ["line 7", "known in advance"]),
    "a method without brackets": ("return v * v.norm", ["line 7", "brackets"]),
    "a hat for a power": ("return v^2", ["line 7", "**"]),
    "a function used as a vector": (
        "return filter_velocity[0] * v",
        ["line 7", "not one of this task's arguments"],
    ),
    "a generator": ("return sum(v[i] for i in range(3)) * n", ["line 7", "in a loop"]),
    "a vector called": ("return v(n)", ["line 7"]),
    "a text": ('v = "fast"\nreturn v', ["line 7"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_explained_in_the_students_own_file(mistake, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    body, words = MISTAKES[mistake]
    f = submission(tmp_path, "filter_velocity", body)
    with pytest.raises(StudentCodeError) as caught:
        muslin.evaluate(f.filter_velocity, v=np.ones((2, 3)), n=np.ones((2, 3)))
    message = str(caught.value)
    for word in words:
        assert word in message
    for noise in ("Traceback", "site-packages", "muslin/batch", "Tensor"):
        assert noise not in message
    assert len(message.splitlines()) <= 6
    assert "".join(capfd.readouterr()).strip() == ""


FILES = {
    "not Python": (b"def phi(:\n", "line 1: Python cannot read this"),
    "not text": (b"\xff\xfe\x00", "collision.py"),
    "fails on import": (
        b"import taichi as ti\n1 / 0\n",
        "line 2: importing the file fails: ZeroDivisionError",
    ),
    "leaves on import": (b"import sys\nsys.exit(0)\n", "line 2: importing the file fails: SystemExit"),
    "restarts Taichi": (b"import taichi as ti\nti.init(arch=ti.gpu)\n", "calls ti.init or ti.reset"),
    "lacks the function": (b"import taichi as ti\n", "has no function filter_velocity"),
    "lacks the decorator": (b"def filter_velocity(v, n):\n    return v\n", "Write @ti.func"),
    "other arguments": (
        b"import taichi as ti\n@ti.func\ndef filter_velocity(n, v):\n    return v\n",
        "takes (n, v). It must take (v, n)",
    ),
}


@pytest.mark.parametrize("fault", FILES)
def test_a_broken_file_costs_only_its_own_tasks(fault, tmp_path, capfd):
    for file in (ROOT / "solutions" / "cloth").glob("*.py"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    content, words = FILES[fault]
    (tmp_path / "collision.py").write_bytes(content)
    f = muslin.load(tmp_path)
    with pytest.raises(MuslinError) as caught:
        muslin.evaluate(f.filter_velocity, v=np.ones((1, 3)), n=np.ones((1, 3)))
    assert words in str(caught.value)
    assert muslin.evaluate(f.psi, s=np.ones((1, 3)), mu=1.0, lam=1.0).tolist() == [0.0]
    assert "Traceback" not in "".join(capfd.readouterr())


def test_a_function_python_cannot_read_costs_only_itself_and_who_uses_it(tmp_path):
    for file in (ROOT / "solutions" / "cloth").glob("*.py"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    path = tmp_path / "strain_energy.py"
    text = path.read_text(encoding="utf-8").replace(
        "def psi(s, mu, lam):", "def psi(s, mu, lam):\n    y = 2 s[0]"
    )
    text += "\n\n@ti.func\ndef twice(s):\n    return 2.0 * psi(s, 1.0, 1.0)\n"
    path.write_text(text.replace("def dpsi_ds(s, mu, lam):", "def dpsi_ds(s, mu, lam):\n    y = twice(s)"))
    line = text.split("\n").index("    y = 2 s[0]") + 1
    f, right = muslin.load(tmp_path), muslin.load(ROOT / "solutions" / "cloth")
    for name, words in {"psi": "", "dpsi_ds": "dpsi_ds uses psi, which Python cannot read"}.items():
        told = str(muslin.tasks.failure_of(f[name]))
        assert words in told
        assert f"line {line}: Python cannot read this" in told
        assert "2 * s" in told
    s = np.array([[1.2, 0.9, 1.0]])
    got = [muslin.evaluate(g.d2psi_ds2, s=s, mu=2.0, lam=3.0) for g in (f, right)]
    np.testing.assert_array_equal(*got)
    got = [muslin.evaluate(g.right_cauchy_green, F=np.ones((1, 3, 3))) for g in (f, right)]
    np.testing.assert_array_equal(*got)


def test_a_file_that_uses_what_python_cannot_read_while_it_is_read_is_broken(tmp_path):
    above = "import taichi as ti\n\n\n@ti.func\ndef sphere_contact(x, c, r):\n    return 2 x\n\n\n"
    below = "@ti.func\ndef filter_velocity(v, n=sphere_contact):\n    return v\n"
    (tmp_path / "collision.py").write_text(above + below)
    told = str(muslin.tasks.failure_of(muslin.load(tmp_path).filter_velocity))
    assert "line 6: Python cannot read this" in told


def test_an_edited_file_is_read_again(tmp_path):
    v, n = np.ones((1, 3)), np.ones((1, 3))
    first = submission(tmp_path, "filter_velocity", "return v * 2")
    assert muslin.evaluate(first.filter_velocity, v=v, n=n)[0, 0] == 2
    second = submission(tmp_path, "filter_velocity", "return v * 30.0")
    assert muslin.evaluate(second.filter_velocity, v=v, n=n)[0, 0] == 30
    assert muslin.evaluate(first.filter_velocity, v=v, n=n)[0, 0] == 2


def test_annotations_are_types_also_where_a_file_asks_for_them_as_texts(tmp_path):
    text = (ROOT / "solutions" / "cloth" / "kinetic_energy.py").read_text(encoding="utf-8")
    text = text.replace("import taichi as ti", "from __future__ import annotations\n\nimport taichi as ti", 1)
    typed = "def mass_block(i: int, j: int, area: float, rho: float, h: float) -> float:"
    text = text.replace("def mass_block(i, j, area, rho, h):", typed)
    assert typed in text
    (tmp_path / "kinetic_energy.py").write_text(text, encoding="utf-8")
    f = muslin.load(tmp_path)
    block = muslin.evaluate(f.mass_block, i=np.array([0, 1]), j=np.array([0, 2]), area=6.0, rho=1.0, h=1.0)
    np.testing.assert_allclose(block, [1.0, 0.5], rtol=1e-15)


def test_a_function_that_taichi_refuses_is_told_as_that(tmp_path):
    text = 'import taichi as ti\n\n\n@ti.func\ndef filter_velocity(v: "a vector", n):\n    return v\n'
    (tmp_path / "collision.py").write_text(text, encoding="utf-8")
    told = str(muslin.tasks.failure_of(muslin.load(tmp_path).filter_velocity))
    assert "line 4" in told or "line 5" in told
    assert told.endswith("Taichi does not take filter_velocity as it is written.")


#: Right functions in which a reader may see what is not there.
READ_WRONGLY = {
    "several values from a class of one's own": (
        "sphere_contact",
        "class contact:\n    @staticmethod\n    @ti.func\n    def find(x, c, r):\n        d = x - c\n"
        "        n = ti.Vector([0.0, 1.0, 0.0])\n        if d.norm() > 0:\n            n = d.normalized()\n"
        "        return ti.cast(d.norm() < r, ti.i32), n\n\n",
        "def sphere_contact(x, c, r):\n    found = contact.find(x, c, r)\n    return found\n",
    ),
    "a transpose of one's own": (
        "right_cauchy_green",
        "class linalg:\n    @staticmethod\n    @ti.func\n    def T(A):\n        return A.transpose()\n\n",
        "def right_cauchy_green(F):\n    return linalg.T(F) @ F\n",
    ),
    "a call that stops, where nothing is compiled": (
        "right_cauchy_green",
        "",
        "def right_cauchy_green(F):\n    if ti.static(False):\n        breakpoint()\n    return F.transpose() @ F\n",
    ),
}


@pytest.mark.parametrize("case", READ_WRONGLY)
def test_a_right_function_is_run_whatever_is_thought_of_its_text(case, tmp_path):
    task, before, function = READ_WRONGLY[case]
    table = tasks.assignment("cloth")
    file = table.tasks[task].file
    (tmp_path / file).write_text(f"import taichi as ti\n\n{before}@ti.func\n{function}", encoding="utf-8")
    inputs, expected = reference.cases("cloth", task)
    got = muslin.evaluate(tasks.load(tmp_path, table)[task], **inputs)
    for mine, right in zip(got if isinstance(got, tuple) else (got,), expected, strict=True):
        np.testing.assert_allclose(mine, right, rtol=1e-9, atol=1e-9)


def test_a_call_that_ends_python_is_told_as_an_error(tmp_path):
    f = submission(tmp_path, "filter_velocity", "exit()\nreturn v")
    with pytest.raises(StudentCodeError, match="cannot be run as it is"):
        muslin.evaluate(f.filter_velocity, v=np.ones((2, 3)), n=np.ones((2, 3)))
