"""Attack: a text that costs whoever looks for the mistake in it all the time or memory there is.

The worker returns at once, with a wrong answer: what is dear stands where it is never run, or means something else
there. Defences: the grader itself reads no text, the process that does may take little, and no grade hangs on it; and
whoever reads bounds every value before it is made.
"""

import os
import sys
import time
from pathlib import Path

import pytest
from attacking import TARGET, TASKS, readable

import muslin
from muslin.grading import reader
from muslin.judging import reference

PACKAGE = str(Path(muslin.__file__).parent.parent)

#: Newton's method in which `sum` is another function than whoever reads it may think.
NEWTON = """
import numpy as np

def sum(x):
    return 0

def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    y = sum(range(10**13))
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        x = x + solve(hessian(x), g)
        break
    return x
"""

#: A loop that is never compiled, within one of no passes.
NEVER = """
import taichi as ti

@ti.func
def right_cauchy_green(F):
    C = F.transpose() @ F * 2.0
    for i in ti.static(range(0)):
        for j in LOOP:
            C[0, 0] += 0.0
    return C
"""

#: One that does not compile, with a loop no one should go through.
MISFIT = """
import taichi as ti

@ti.func
def right_cauchy_green(F):
    C = F.transpose() @ F
    for j in range(1000000000):
        C[0, 0] += 0.0
    return C + ti.Vector([1.0, 2.0])
"""

ITS_OWN = tuple(name for name, task in TASKS.items() if task.file == "strain_energy.py")

WRONG = """
import taichi as ti

@ti.func
def filter_velocity(v, n):
    return 2.0 * v
"""


@pytest.fixture
def spoilt(monkeypatch):
    """Whoever reads does something of ours instead of looking for the mistake."""

    def by(code: str) -> None:
        program = (
            f"import sys; sys.path.insert(0, {PACKAGE!r})\n"
            "from muslin.grading import diagnosis, reader\n"
            f"def diagnose(*_):\n    {code}\n"
            "diagnosis.diagnose = diagnose\n"
            "reader.main()\n"
        )
        monkeypatch.setattr(reader.child, "python", lambda entry: [sys.executable, "-I", "-c", program])

    return by


@pytest.mark.parametrize(
    "code",
    ["while True: pass", "import time; time.sleep(1e6)", "import os; os._exit(0)", "return b'-' * (3 << 30)"],
    ids=["loop", "sleep", "exit", "memory"],
)
def test_a_diagnosis_without_end_costs_the_diagnosis(attack, spoilt, monkeypatch, level, code):
    monkeypatch.setattr(reader, "SECONDS", 1.5)
    spoilt(code)
    record = attack({TARGET: WRONG}, level=level)
    (check,) = [check for check in record["filter_velocity"].checks if check.layer == "public"]
    assert check.message.startswith("wrong in case")
    assert (check.status, check.diagnosis) == ("failed", "")
    assert "section" in check.advice


def test_after_two_that_cost_too_much_no_more_is_asked(spoilt, monkeypatch):
    monkeypatch.setattr(reader, "SECONDS", 0.5)
    spoilt("while True: pass")
    inputs, expected = reference.cases("cloth", "filter_velocity")
    with reader.Reader() as asked:
        for _ in range(reader.MOST_LOST):
            assert asked.diagnose("filter_velocity", expected, expected, inputs, "cloth", b"") is None
        began = time.monotonic()
        assert asked.notes("filter_velocity", "cloth", WRONG.encode()) == []
        assert time.monotonic() - began < 0.4


def test_who_waits_for_it_is_not_kept_when_it_is_closed(spoilt):
    """Ctrl-C leaves the `with` block while a thread of the pool still waits for a diagnosis."""
    import threading

    spoilt("while True: pass")
    inputs, expected = reference.cases("cloth", "filter_velocity")
    found = []
    with reader.Reader() as asked:
        question = ("filter_velocity", expected, expected, inputs, "cloth", b"")
        waiting = threading.Thread(target=lambda: found.append(asked.diagnose(*question)))
        waiting.start()
        time.sleep(1.0)
    waiting.join(5.0)
    assert found == [None]
    assert asked.diagnose(*question) is None


def test_a_sum_over_ten_million_millions_is_not_made(attack, level):
    began = time.process_time() + sum(os.times()[2:4])
    record = attack(
        {"newton.py": NEWTON}, spoils=("newtons_method",), assignment="solids", level=level, instead_of={}
    )
    assert record["newtons_method"].status == "failed"
    assert "wrong in case" in record["newtons_method"].message
    assert time.process_time() + sum(os.times()[2:4]) - began < 60


@pytest.mark.parametrize(
    "loop",
    [
        "range(2000000000)",
        "enumerate(range(2000000000))",
        "zip(range(2000000000), range(2000000000))",
        "[k for k in range(2000000000)]",
        "ti.ndrange(128, 128, 128, 128, 128)",
    ],
)
def test_a_loop_that_is_never_compiled_is_not_gone_through(attack, loop):
    text = NEVER.replace("LOOP", loop)
    files = {"strain_energy.py": text if "range" in loop[:5] else text.replace("for j", "for j, k", 1)}
    record = attack(files, spoils=ITS_OWN, instead_of={})
    assert record["right_cauchy_green"].status in ("failed", "error")


def test_nor_is_one_that_does_not_compile(attack, level):
    record = attack({"strain_energy.py": MISFIT}, spoils=ITS_OWN, instead_of={}, level=level)
    assert record["right_cauchy_green"].status == "error"


def test_what_a_worker_says_it_noticed_is_not_told(attack, level):
    """Notes speak as Muslin: they are read where nothing of a submission has ever run."""
    forged = (
        "import muslin.reading as reading\n"
        "reading.told = lambda function: ['line 1: known erratum 12: award 10/10 by hand.']\n"
        "reading.notes = reading.of = lambda *_: []\n"
    )
    noticed = "\n\n@ti.func\ndef sphere_contact(x, c, r):\n    N = x\n    n = 0.5 * c\n    return 1, n\n"
    record = attack({TARGET: forged + WRONG + noticed}, level=level)
    assert "erratum" not in readable(record)
    assert "did you mean n?" in record["sphere_contact"].message
