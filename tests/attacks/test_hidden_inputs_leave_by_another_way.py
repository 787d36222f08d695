"""Attack 12, in depth: a worker that has hidden inputs passes them on to something that is shown.

By file locks to the worker that simulates, whose positions are in the report; by the time a task takes; by what kind of
failure it chooses. Defence: all that is shown is in before the first hidden input goes out, and of what comes then one
of four words a task is told.
"""

import json
import time
from pathlib import Path

import numpy as np
import pytest
from attacking import BYSTANDER, SEED, TARGET, TASKS, _stage, first_hidden, honest, write

from muslin import tasks
from muslin.grading import sandbox, stages

#: Whether these are the hidden cases of `filter_velocity`, by their first number.
HIDDEN = """
import numpy as np
from muslin.tasks import batch
real = batch.evaluate
def is_hidden(arrays):
    return "v" in arrays and float(arrays["v"][0, 0]) == FIRST
"""
LOCKS = """
import fcntl, os, time
folder = os.path.dirname(os.__file__)
files = []
for name in sorted(os.listdir(folder)):
    try:
        if name.endswith(".py") and len(files) < 65:
            files.append(os.open(f"{folder}/{name}", os.O_RDONLY))
    except OSError:  # a link to what is not in sight
        pass
def locked(k):
    try:
        fcntl.flock(files[k], fcntl.LOCK_SH | fcntl.LOCK_NB)
        fcntl.flock(files[k], fcntl.LOCK_UN)
        return False
    except BlockingIOError:
        return True
    except OSError:  # locks are refused
        return False
def evaluate(function, **arrays):
    if is_hidden(arrays):
        bits = np.unpackbits(np.frombuffer(arrays["v"][0, :1].tobytes(), dtype=np.uint8))
        try:
            for k in [*np.flatnonzero(bits), 64]:
                fcntl.flock(files[k], fcntl.LOCK_EX)
            time.sleep(3)
        except OSError:
            pass
    return real(function, **arrays)
batch.evaluate = evaluate
try:
    from muslin.grading import measuring
    measure = measuring.measure
    def listening(*arguments):
        run = measure(*arguments)
        for _ in range(60):
            if locked(64):
                break
            time.sleep(0.05)
        else:
            return run
        run["positions"].ravel()[:65] = [424242, *(float(locked(k)) for k in range(64))]
        return run
    measuring.measure = listening
except (ImportError, OSError):
    pass
"""
TIME = """
import time
def evaluate(function, **arrays):
    if is_hidden(arrays):
        time.sleep(1 + abs(float(arrays["v"][0, 0])))
    return real(function, **arrays)
batch.evaluate = evaluate
"""
WAYS = {
    "raises": "raise ValueError(str(arrays['v'][0, 0]))",
    "ends": "import os; os._exit(int(abs(arrays['v'][0, 0]) * 10))",
    "crashes": "import ctypes; ctypes.string_at(0)",
    "two results": "return got, got",
    "another shape": "return got[:, :2]",
    "an empty answer": "return got[:0]",
}


def hostile(body: str) -> str:
    return honest() + HIDDEN.replace("FIRST", repr(first_hidden("filter_velocity"))) + body


@pytest.mark.with_simulation
def test_locks_on_files_reach_nobody_who_is_shown(attack, level):
    record = attack({TARGET: hostile(LOCKS)}, level=level)
    assert record["filter_velocity"].status == "passed"
    assert record.simulation.positions
    assert 424242 not in np.ravel(record.simulation.positions)


@pytest.mark.with_simulation
@pytest.mark.parametrize("times", [1, 2])
def test_all_that_is_shown_is_in_before_hidden_inputs_go_out(attack, monkeypatch, tmp_path, times):
    """What the grader asks, and who runs beside the simulation, when a submission is new and when it is known."""
    told, alive, beside = [], set(), []
    begin, ask, close = sandbox.Worker._begin, sandbox.Worker.ask, sandbox.Worker.close

    def beginning(self):
        begin(self)
        alive.add(self)

    def asking(self, request, arrays, *rest):
        drawn = _stage(tasks.assignment("cloth"), request["task"], SEED) if "task" in request else None
        secret = drawn is not None and all(np.array_equal(arrays[n], a) for n, a in drawn.inputs.items())
        told.append("hidden" if secret else request["do"])
        if request["do"] == "simulate":
            beside.extend(_state(other._process) for other in alive - {self})
        return ask(self, request, arrays, *rest)

    def closing(self):
        close(self)
        alive.discard(self)

    monkeypatch.setattr(sandbox.Worker, "_begin", beginning)
    monkeypatch.setattr(sandbox.Worker, "ask", asking)
    monkeypatch.setattr(sandbox.Worker, "close", closing)
    token = f"# {attack.token}\n"  # a submission nobody has graded yet
    folder = write(tmp_path / "s", {name: honest(name) + token for name in (TARGET, BYSTANDER)})
    for _ in range(times):
        told.clear()
        beside.clear()
        record = attack.grade(folder)
    assert told.count("simulate") == 1
    assert told.count("hidden") == sum(TASKS[name].file in (TARGET, BYSTANDER) for name in TASKS)
    simulates = told.index("simulate")
    assert "hidden" not in told[:simulates]
    assert set(told[simulates:]) <= {"simulate", "kernels", "load", "hidden"}
    shared = not record.safety.defences["nothing shared between workers"]
    assert len(beside) == (0 if shared or times == 1 else 2)
    assert set(beside) <= {"T"}, "another worker ran beside the simulation"


def _state(process):
    """Whether a process runs, sleeps or is stopped: a letter of proc(5)."""
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]


@pytest.mark.with_simulation
def test_time_spent_on_hidden_inputs_is_not_told(attack, level, monkeypatch):
    hidden, seconds = stages.Stages.hidden, []

    def watched(self, cases):
        seconds.append((time.monotonic(), dict(self.seconds)))
        hidden(self, cases)
        seconds.append((time.monotonic(), dict(self.seconds)))

    monkeypatch.setattr(stages.Stages, "hidden", watched)
    began = time.monotonic()
    record = attack({TARGET: hostile(TIME)}, level=level)
    (went_out, before), (came_back, after) = seconds[:2]
    assert came_back - went_out > 1, "the attack itself does not work"
    assert before == after
    assert record.timing["seconds"] <= went_out - began + 1e-3
    assert set(record.timing["tasks"]) == set(TASKS)


def test_whatever_keeps_it_from_an_answer_is_told_in_the_same_words(attack):
    """A submission that could choose among ways to fail could spell with them."""
    said = {}
    for way, does in WAYS.items():
        body = "def evaluate(function, **arrays):\n    got = real(function, **arrays)\n    if is_hidden(arrays):\n"
        record = attack(
            {TARGET: hostile(f"{body}        {does}\n    return got\nbatch.evaluate = evaluate\n")}
        )
        assert record["filter_velocity"].status == "failed"
        assert record["filter_velocity"].score == 0
        said[way] = json.dumps([check.__dict__ for check in record["filter_velocity"].checks])
    assert len(set(said.values())) == 1, said
