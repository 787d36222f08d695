"""What a text may cost whoever reads it: little, whatever stands in it; and what people write is still worked out."""

import ast
import tracemalloc

import numpy as np
import pytest

from muslin.reading import bounds
from muslin.reading.bounds import Unclear
from muslin.reading.meaning import Meaning
from muslin.reading.stepping import Stepping

#: Most memory that reading one of these texts may take [bytes].
LITTLE = 30_000_000


def function(body):
    lines = "\n".join(f"    {line}" for line in body.split("\n"))
    return ast.parse(f"def f(x):\n{lines}\n").body[0]


def stepped(body, x=2.0):
    return Stepping(function(body), {}).run({"x": x})


def meant(body, x):
    """What a compiled function's text comes to for numbers."""
    (found,) = Meaning({"f": function(body)}, "f", {"x": np.asarray(x, dtype=np.float64)}).results
    return np.broadcast_to(found, np.shape(x))


def refused(read, *arguments):
    tracemalloc.start()
    try:
        with pytest.raises(Unclear):
            read(*arguments)
        assert tracemalloc.get_traced_memory()[1] < LITTLE
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    "body",
    [
        "return sum(range(10 ** 13))",
        "return max(range(10 ** 9))",
        "return np.array(range(10 ** 9))",
        "return np.sum(range(10 ** 9))",
        "r = range(10 ** 9)\nreturn r.sum()",
        "return range(10 ** 9).T",
        "return np.ones_like(x) + range(10 ** 9)",
        "return (0,) * 200000000",
        "return 200000000 * (0,)",
        "t = (0,) * 1000\nreturn t + t",
        "t = (0, 0)\nfor k in range(60):\n    t = (t, t)\nreturn np.array(t)",
        "return np.zeros((64, 64, 64, 64, 64))",
        "return np.zeros(shape=(10 ** 9,))",
        "return np.eye(3, M=10 ** 9)",
        "a = [0] * 32\nfor k in range(6):\n    b = [0] * 32\n"
        "    for i in range(32):\n        b[i] = a\n    a = b\nreturn x",
        "a = 7\nfor k in range(4):\n    a = a ** 60\nreturn a",
        "a = 7\na **= 60\nreturn a",
        "a = 7 ** 22\nreturn a * a * a",
        "return int(1e300)",
        "for k in range(10 ** 13):\n    x = x + 1.0\nreturn x",
        "while True:\n    x = x + 1.0",
        "return 99999999999999999999 * x",
    ],
)
def test_plain_python_that_would_cost_too_much_is_not_worked_out(body):
    refused(stepped, body)


@pytest.mark.parametrize(
    ("body", "right"),
    [
        ("for k in range(10 ** 13):\n    x = 2.0 * x\n    if x > 1000.0:\n        break\nreturn x", 1024.0),
        ("return sum((1.0, 2.0, x))", 5.0),
        ("return sum(range(10)) * x", 90.0),
        ("t = (x, 1.0) * 3\nreturn t[4] + len(t)", 8.0),
        ("return 2 ** 40 + 3", 2**40 + 3),
        ("t = (1.0, x)\nfor k in range(3):\n    t = (t[1], t[0] + t[1])\nreturn t[1]", 8.0),
    ],
)
def test_plain_python_that_people_write_is(body, right):
    assert stepped(body) == right


MANY = "range(2000000000)"


@pytest.mark.parametrize(
    "loop",
    [
        f"for j in {MANY}",
        f"for j in ti.static({MANY})",
        f"for j, k in enumerate({MANY})",
        f"for j, k in zip({MANY}, {MANY})",
        "for j, k, l, m, n in ti.ndrange(128, 128, 128, 128, 128)",
        "for j in range(129)",
        "for j in range(0, 10, 0)",
        "for j in range(2147483647 - 1, -2147483647, -1)",
    ],
)
def test_a_loop_is_counted_before_it_is_gone_through(loop):
    refused(meant, f"y = 0.0\n{loop}:\n    y += x\nreturn y", np.ones(5))
    if "ti" not in loop and "0, 10, 0" not in loop:  # one that is never run is not gone through either
        refused(meant, f"y = 0.0\n{loop}:\n    for i in range(2):\n        y += x\nreturn y", np.ones(5))


@pytest.mark.parametrize(
    "body",
    [
        f"return ti.Vector([x for k in {MANY}]).sum()",
        "y = 0.0\nfor a in range(4000):\n    for b in range(4000):\n        y += x\nreturn y",
        "y = 0.0\nfor a in range(100):\n    for b in range(100):\n        y += x\nreturn y",
        "a = 99999\nfor k in range(9):\n    a = a * a\nreturn a * x",
        "return int(1e300) * x",
        "for k in ti.static(range(0)):\n    for j in range(2000000000):\n        x += 1.0\nwhile True:\n    pass",
    ],
)
def test_nor_is_anything_else_made_that_is_too_large(body):
    refused(meant, body, np.ones(5))


@pytest.mark.parametrize(
    ("body", "factor"),
    [
        ("y = 0.0\nfor k in range(128):\n    y += x\nreturn y", 128),
        ("y = 0.0\nfor a in range(8):\n    for b in range(16):\n        y += b * x\nreturn y", 8 * 120),
        ("y = 0.0\nfor a, b in ti.ndrange(3, 4):\n    y += a * b * x\nreturn y", 18),
        ("y = 0.0\nfor k, a in enumerate([2, 3]):\n    y += k * a * x\nreturn y", 3),
        ("y = 0.0\nfor a, b in zip(range(4), [1, 2, 3]):\n    y += a * b * x\nreturn y", 8),
        ("return ti.Vector([k * x for k in range(4)]).sum()", 6),
        ("y = x\nfor i in ti.static(range(0)):\n    y += x\nreturn y", 1),
    ],
)
def test_loops_that_people_write_are_worked_out(body, factor):
    x = np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(meant(body, x), factor * x, rtol=1e-14)


def test_passes_beside_very_many_cases_are_not_put_there_at_once():
    body = "y = 0.0\nfor k in range(128):\n    y += k * x\nreturn y"
    x = np.linspace(0.0, 1.0, 5000)
    tracemalloc.start()
    try:
        np.testing.assert_allclose(meant(body, x), 8128 * x, rtol=1e-12)
        assert tracemalloc.get_traced_memory()[1] < LITTLE
    finally:
        tracemalloc.stop()


def test_a_value_that_fits_is_passed_on():
    array, held = np.zeros(64), (1, (2.0, np.zeros(4)))
    assert bounds.plain(array) is array
    assert bounds.plain(held) is held
    assert bounds.plain(2**63) == 2**63
    assert bounds.passes(range(3)) == [0, 1, 2]
    for large in (np.zeros(65), (np.zeros(64),) * 17, 2**63 + 1, range(65)):
        with pytest.raises(Unclear):
            bounds.plain(large)
