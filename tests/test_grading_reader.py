"""The process that reads a submission's text says what is said in this one, word by word."""

import sys

import numpy as np
import pytest

from muslin import reading, tasks
from muslin.grading import diagnosis, reader
from muslin.grading.upheld import upheld
from muslin.judging import properties, reference

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="nothing is graded there")

NAME = "filter_velocity"
TASK = tasks.assignment("cloth").tasks[NAME]
INPUTS, EXPECTED = reference.cases("cloth", NAME)

HEAD = "import taichi as ti\n\n@ti.func\ndef filter_velocity(v, n):\n"
WRONG = HEAD + "    N = n\n    return v + ti.min(v.dot(n), 0.0) * n\n"
MISFIT = HEAD + "    return v - ti.min(v.outer_product(n), 0.0) * n\n"
LOOSE = HEAD + "    d = v.dot(n)\n    w = v\n    if d < -0.05:\n        w = v - d * n\n    return w\n"


@pytest.fixture(scope="module")
def asked():
    with reader.Reader() as process:
        yield process
        assert process._lost == 0


def alike(said, found):
    assert found is not None
    assert said == (found.cause, found.mistake, found.advice)


def along(v, n):
    return np.sum(v * n, axis=1, keepdims=True)


def test_a_wrong_answer(asked):
    v, n = INPUTS["v"], INPUTS["n"]
    got = (v + np.minimum(along(v, n), 0.0) * n,)
    found = diagnosis.diagnose(TASK, got, EXPECTED, INPUTS, "cloth", WRONG)
    alike(asked.diagnose(NAME, got, EXPECTED, INPUTS, "cloth", WRONG.encode()), found)
    assert "ine 6" in found.mistake + found.advice  # the text was read, not the numbers alone


def test_a_function_that_does_not_compile(asked):
    found = diagnosis.misfit(TASK, EXPECTED, INPUTS, "cloth", MISFIT)
    alike(asked.misfit(NAME, EXPECTED, INPUTS, "cloth", MISFIT.encode()), found)


def test_a_property_that_does_not_hold(asked):
    drawn = properties.draw("cloth", NAME, "any")
    given = properties.batch([inputs for _, inputs in drawn])
    d = along(given["v"], given["n"])
    came = (np.where(d < -0.05, given["v"] - d * given["n"], given["v"]),)
    parts = properties.apart(came, [inputs for _, inputs in drawn])
    question = EXPECTED, INPUTS, drawn, parts, "cloth"
    found = upheld(TASK, *question, LOOSE)
    alike(asked.upheld(NAME, *question, LOOSE.encode()), found)


def test_what_is_noticed(asked):
    notes = reading.told_of(WRONG, TASK)
    assert "did you mean n?" in notes[0]
    assert asked.notes(NAME, "cloth", WRONG.encode()) == notes


@pytest.mark.parametrize("data", [b"", b"\xff\xfe\x00", b"# coding: no-such\n", b"(" * 5000, b"\0" * 1000])
def test_a_text_that_is_none(asked, data):
    assert asked.notes(NAME, "cloth", data) == []
    said = asked.diagnose(NAME, (2.0 * EXPECTED[0],), EXPECTED, INPUTS, "cloth", data)
    assert said is not None
    assert said[0] == "scaled:2"


def test_an_answer_that_is_right_or_of_another_shape(asked):
    assert asked.diagnose(NAME, EXPECTED, EXPECTED, INPUTS, "cloth", WRONG.encode()) is None
    assert asked.diagnose(NAME, (EXPECTED[0][:, :2],), EXPECTED, INPUTS, "cloth", WRONG.encode()) is None
    assert asked.diagnose("no such task", EXPECTED, EXPECTED, INPUTS, "cloth", b"") is None
