"""Functions in plain Python: read line by line, and the one change of them that makes them right."""

import ast
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from muslin import tasks
from muslin.base import paths
from muslin.grading import diagnosis
from muslin.grading.marching import Marching
from muslin.judging import reference
from muslin.reading.arithmetic import Unclear
from muslin.reading.source import Source
from muslin.reading.stepping import Stepping, TooLong
from muslin.tasks.plain import builder

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import suite

TABLE = tasks.assignment("solids")
TASK = TABLE.tasks["newtons_method"]
NAMES = [value.name for value in TASK.arguments]

RIGHT = """
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    g = gradient(x)
    steps = 0
    while steps < most_steps and np.linalg.norm(g) > tolerance:
        p = solve(hessian(x), -g)
        t, m = 1.0, g @ p
        for _ in range(40):
            if objective(x + t * p) <= objective(x) + 1e-4 * t * m:
                break
            t *= 0.5
        x = x + t * p
        g = gradient(x)
        steps += 1
    return x
"""


def arguments(k):
    inputs, _ = reference.cases("solids", "newtons_method")
    case = {key: array[k] for key, array in inputs.items()}
    given = builder(TASK, TABLE, paths.assignment("solids"))(**case)
    return {key: given.get(key, case.get(key)) for key in NAMES}


def run(text):
    """What a text makes of the cases where Python runs it; NaN where that does not end well."""
    inside = {"np": np}
    exec(text, inside)
    ends = []
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(30):
            case = arguments(k)
            case["x"] = case["x"].copy()
            ends.append(inside["newtons_method"](**case))
    return np.array(ends)


def told(text):
    inputs, expected = reference.cases("solids", "newtons_method")
    found = diagnosis.diagnose(TASK, (run(text),), expected, inputs, "solids", text)
    return found.mistake if found else ""


def test_a_right_text_read_line_by_line_comes_to_what_python_makes_of_it():
    texts = [
        RIGHT,
        *(v.code for v in suite.variants("solids") if v.task == TASK.name and v.verdict == "right"),
    ]
    assert len(texts) > 2
    read = 0
    for text in texts:
        node = Source(text).functions[TASK.name].node
        expected = run(text)
        for k in range(30):
            try:
                came = Stepping(node, {}).run(arguments(k))
            except Unclear:
                continue
            read += 1
            np.testing.assert_array_equal(came, expected[k])
    assert read > 0.6 * 30 * len(texts)


@pytest.mark.parametrize(
    "body",
    [
        "return __import__('os')",
        "return x.__class__",
        "return open('f')",
        "return np.load('f')",
        "return (lambda: 1)()",
    ],
)
def test_only_what_is_listed_is_understood(body):
    node = ast.parse(f"def f(x):\n    {body}").body[0]
    with pytest.raises((Unclear, KeyError)):
        Stepping(node, {}).run({"x": np.zeros(2)})


def test_what_never_ends_is_given_up():
    node = ast.parse("def f(x):\n    while x < 1:\n        pass\n    return x").body[0]
    with pytest.raises(TooLong):
        Stepping(node, {}).run({"x": 0.0})


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("np.linalg.norm(g) > tolerance", "g @ g > tolerance", "Line 5: a root is missing: `g @ g`"),
        ("norm(g) > tolerance", "norm(g) < tolerance", "`np.linalg.norm(g) > tolerance` belongs"),
        ("solve(hessian(x), -g)", "hessian(x) @ -g", "`solve(hessian(x), -g)` belongs"),
        ("x = x + t * p", "x = x + p", "Line 12: a factor of t is missing"),
        ("x = x + t * p", "x = x - t * p", "Line 12: a sign is wrong: `x - t * p` stands where `x + t * p`"),
        ("g @ p", "g @ g", "Line 7: `g` stands where `p` belongs"),
        ("        g = gradient(x)\n", "", "`g = gradient(x)` is missing in the loop"),
        ("if objective(x + t * p)", "if objective(x + p)", "Line 9: a factor of t is missing: `p`"),
    ],
)
def test_a_slip_is_told_with_its_line_and_what_belongs_there(right, wrong, words):
    assert right in RIGHT
    assert words in told(RIGHT.replace(right, wrong))


HELPED = """
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    def enough(x, d, t, g):
        return objective(x + t * d) <= objective(x) + 1e-4 * t * (g @ d)

    for _ in range(most_steps):
        g = gradient(x)
        if np.abs(g).max() <= tolerance / 2:
            break
        d = solve(hessian(x), -g)
        t = 1.0
        for _ in range(50):
            if enough(x, d, t, g):
                break
            t = 0.5 * t
        else:
            t = 1.0
        x = x + t * d
    return x
"""

LISTED = """
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    x = x.copy()
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = -np.linalg.solve(hessian(x), g)
        here, slope = objective(x), float(g @ d)
        parts = [0.5**k for k in range(40)]
        x += d * next((t for t in parts if objective(x + t * d) <= here + 1e-4 * t * slope), 1.0)
    return x
"""


def marching(text, got=None):
    inputs, expected = reference.cases("solids", "newtons_method")
    return Marching(text, TASK, inputs, got, expected[0], np.ones(30), "solids")


@pytest.mark.parametrize("text", [RIGHT, HELPED, LISTED])
def test_nothing_is_seen_on_a_right_way(text):
    right = marching(text)
    assert right.right({})
    with np.errstate(all="ignore"):
        assert right.sound({})
        assert [seen for case in right.cases.values() for seen in right.seen({}, case)] == []


@pytest.mark.parametrize(
    ("text", "right", "wrong", "words"),
    [
        (
            HELPED,
            "t = 0.5 * t",
            "t = t - 0.1",
            "after x + d, x + 0.9 d is tried: that is not half of the step",
        ),
        (HELPED, "t = 0.5 * t", "t = 1.5 * t", "the step grows: after x + d, x + 1.5 d is tried"),
        (HELPED, "t = 0.5 * t", "s = 0.5 * t", "the same point x + d is tried again and again"),
        (HELPED, "range(50)", "range(3)", "x + d is taken, where the objective is infinite"),
        (HELPED, "x = x + t * d", "y = x + t * d", "the same system is solved again: x has not moved"),
        (HELPED, "-g)", "-g - x)", "the right side that solve is given is not -g"),
        (HELPED, "1e-4 *", "0.9 *", "the objective falls by 0.5 of the promise: enough, yet"),
        (
            LISTED,
            "range(40)",
            "range(1, 40)",
            "the first point tried is x + 0.5 d: the whole step, x + d, is not",
        ),
    ],
)
def test_what_is_seen_on_a_wrong_way_is_told(text, right, wrong, words):
    assert right in text
    with np.errstate(all="ignore"):
        seen = marching(text.replace(right, wrong, 1)).watched()
    assert words in seen.words


def test_a_change_that_breaks_a_property_is_none():
    text = RIGHT.replace("np.linalg.norm(g) > tolerance", "g[0] > tolerance")
    assert "`np.linalg.norm(g)` belongs" in told(text)
