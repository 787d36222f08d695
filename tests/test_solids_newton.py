"""Newton's method as students write it: what is right keeps every property, whichever line search it has."""

import numpy as np
import pytest

from muslin import tasks
from muslin.base import paths
from muslin.judging import judge, properties
from muslin.tasks import plain

TABLE = tasks.assignment("solids")
TASK = TABLE.tasks["newtons_method"]

COUNTED = """
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    steps = 0
    g = gradient(x)
    while steps < most_steps and np.linalg.norm(g) > tolerance:
        d = -solve(hessian(x), g)
        promised, here = g @ d, objective(x)
        t = 1.0
        for _ in range(HALVINGS):
            if objective(x + t * d) <= here + SHARE * t * promised:
                break
            t = t * PART
        else:
            t = 1.0
        x = x + t * d
        g = gradient(x)
        steps += 1
    return x
"""


def broken(text):
    """The properties that do not hold for a text."""
    inside = {"np": np}
    exec(text, inside)
    function = inside["newtons_method"]
    function.build = plain.builder(TASK, TABLE, paths.assignment("solids"))
    found = []
    for prop in judge("solids", TASK.name).properties:
        for seed in range(3):
            inputs = prop.inputs(np.random.Generator(np.random.PCG64(seed)))
            with np.errstate(all="ignore"):
                came = plain.evaluate(function, TASK, inputs)
            errors = properties.errors(prop, inputs, (came,))
            if errors.max() > prop.tolerance:
                found.append(prop.name)
    return set(found)


def line_search(halvings="40", share="1e-4", part="0.5"):
    return COUNTED.replace("HALVINGS", halvings).replace("SHARE", share).replace("PART", part)


@pytest.mark.parametrize("halvings", ["25", "40", "200"])
@pytest.mark.parametrize("share", ["1e-4", "0.01", "0.3", "0.49"])
def test_every_right_line_search_keeps_every_property(halvings, share):
    assert broken(line_search(halvings, share)) == set()


@pytest.mark.parametrize(
    "enough", ["np.sqrt(g @ g) > tolerance", "np.abs(g).max() > tolerance / 2", "not norm(g) <= tolerance"]
)
def test_every_right_way_to_stop_keeps_every_property(enough):
    enough = enough.replace("norm", "np.linalg.norm")
    assert broken(line_search().replace("np.linalg.norm(g) > tolerance", enough)) == set()


@pytest.mark.parametrize("never", ["True", "np.linalg.norm(x) > tolerance", "np.linalg.norm(g) > 1e-10"])
def test_who_goes_on_where_the_gradient_is_short_breaks_one(never):
    text = line_search().replace("np.linalg.norm(g) > tolerance", never)
    assert "no step where the gradient is short" in broken(text)


@pytest.mark.parametrize("part", ["0.3", "0.7", "0.9"])
def test_other_halvings_take_as_many_steps(part):
    assert "no more steps than allowed" not in broken(line_search(part=part))


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("steps += 1", "steps += 0"),
        ("steps < most_steps", "steps <= most_steps"),
        ("steps < most_steps", "steps < 2 * most_steps"),
        ("steps < most_steps", "steps < 100"),
        ("steps < most_steps", "steps < most_steps - 1"),
        ("steps = 0", "steps = 1"),
    ],
)
def test_steps_that_are_not_counted_right_break_one(right, wrong):
    assert right in COUNTED
    assert "no more steps than allowed" in broken(line_search().replace(right, wrong, 1))
