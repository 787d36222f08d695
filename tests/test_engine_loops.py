"""A loop over several indices in a student's function does the same passes, as nested loops, and does them quickly."""

import ast
import importlib.util

import numpy as np
import pytest

import muslin
from muslin.base import paths, runtime
from muslin.base.engine import inside, loops
from muslin.tasks.batch import evaluate

TEXT = """
from muslin.base.engine import ti

@ti.func
def table(a):
    K = ti.Matrix.zero(float, 3, 3)
    k = 0.0
    for i, j in ti.ndrange(3, (1, 3)):
        if i == j:
            continue
        k += 1.0
        K[i, j] += k * a
    return K

@ti.func
def until(a):
    K = ti.Matrix.zero(float, 3, 3)
    for i, j in ti.ndrange(3, 3):
        if i == 1 and j == 1:
            break
        K[i, j] = a
    return K

@ti.func
def moved(a):
    K = ti.Matrix.zero(float, 3, 3)
    for i, j in ti.ndrange(2, 3):
        i += 1
        K[i, j] = a + j
    return K

@ti.func
def over(a):
    n = 2
    K = ti.Matrix.zero(float, 3, 3)
    for i, j in ti.ndrange(n, 3):
        for c, d in ti.ndrange(2, 2):
            K[i, j] += a * (c + 2 * d)
    return K
"""


def loop(text: str) -> ast.For:
    return ast.parse(text).body[0]


@pytest.fixture(scope="module")
def functions(tmp_path_factory):
    path = tmp_path_factory.mktemp("loops") / "loops_of_students.py"
    path.write_text(TEXT)
    runtime.start()
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return vars(module)


EXPECTED = {
    "table": [[0, 1, 2], [0, 0, 3], [0, 4, 0]],
    "until": [[1, 1, 1], [1, 0, 0], [0, 0, 0]],
    "moved": [[0, 0, 0], [1, 2, 3], [1, 2, 3]],
    "over": [[6, 6, 6], [6, 6, 6], [0, 0, 0]],
}


@pytest.mark.parametrize("name", EXPECTED)
def test_the_passes_are_those_python_makes(functions, name):
    got = evaluate(functions[name], results=("mat3",), a=np.arange(1.0, 7.0))
    np.testing.assert_array_equal(got[0], EXPECTED[name])


@pytest.mark.parametrize(
    ("text", "loops_"),
    [
        ("for i, j in ti.ndrange(3, 4):\n    x = i", ["i in range(3)", "j in range(4)"]),
        (
            "for i, j, k in ti.ndrange((1, 3), 2, (0, 9)):\n    x = i",
            ["i in range(1, 3)", "j in range(2)", "k in range(0, 9)"],
        ),
        ("for i, j in ti.ndrange(3, 4):\n    if i:\n        break", None),
        ("for i, j in ti.ndrange(3, 4):\n    j = 2", None),
        ("for i, j in ti.ndrange(n, 4):\n    x = i", None),
        ("for i, i in ti.ndrange(3, 4):\n    x = i", None),
        ("for I in ti.ndrange(3, 4):\n    x = I", None),
        ("for i, j in ti.ndrange(3):\n    x = i", None),
    ],
)  # fmt: skip
def test_what_may_be_nested_is_and_nothing_else(text, loops_):
    found, lines = loops.nested(loop(text)), []
    while isinstance(found, ast.For):
        lines.append(f"{ast.unparse(found.target)} in {ast.unparse(found.iter)}")
        found = found.body[0]
    assert lines == (loops_ or [])


def test_the_engine_nests_the_loops_of_functions(monkeypatch, functions):
    assert inside.has("nesting loops")
    seen = []
    monkeypatch.setattr(loops, "nested", lambda node: seen.append(node))
    fresh = muslin.load(paths.source("solids"), "solids")
    evaluate(
        fresh.stiffness_block,
        d2psi_dF2=np.eye(9)[None], grad_phi_i=np.ones((1, 3)), grad_phi_j=np.ones((1, 3)), volume=np.ones(1),
    )  # fmt: skip
    assert len(seen) == 1
