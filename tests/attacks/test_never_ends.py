"""Attack 20: an endless loop in Python, in a Taichi kernel, a long sleep, answers drop by drop.

Defence: SIGKILL from outside at the task's deadline.
"""

import time
from collections import Counter

import pytest
from attacking import FILES, TARGET, TASKS, honest

from muslin.grading import parts
from muslin.grading.patience import CAP

KERNEL = """
@ti.func
def ENDLESS(ARGUMENTS):
    k = 0
    while k < 10:
        k -= 1
        if k < -100:
            k = 0
    return RESULT
"""
WAYS = {
    "python": "while True: pass",
    "sleep": """
import signal, time
for number in range(1, 30):
    try:
        signal.signal(number, signal.SIG_IGN)
    except OSError:
        pass
time.sleep(1e6)
""",
    "threads": """
import threading, time
threading.Thread(target=lambda: [0 for _ in iter(int, 1)]).start()
time.sleep(1e6)
""",
    "drops": """
import gc, socket, time, struct
for channel in [o for o in gc.get_objects() if isinstance(o, socket.socket)]:
    try:
        channel.sendall(struct.pack("<QI", 50_000_000, 10))
        break
    except OSError:  # one that is closed
        pass
while True:
    channel.sendall(b"x")
    time.sleep(0.05)
""",
}
DEADLINE = 4.0


@pytest.fixture
def late(monkeypatch):
    """The files whose workers were asked, each time one was too late."""
    found = []
    ask = parts.ask

    def asked(worker, request, arrays, *rest):
        header, results, trouble = ask(worker, request, arrays, *rest)
        if trouble is not None and trouble.kind == "late":
            found.append(next(name for name in arrays if name in FILES))  # they hang while loaded
        return header, results, trouble

    monkeypatch.setattr(parts, "ask", asked)
    return found


def test_each_way_ends_at_its_deadline(attack, late):
    """Four files, at least two side by side, then each once more alone.

    What sleeps is charged all the time that passes: a turn is a deadline. What computes may wait for a core: a turn
    is at most the generous cap. So two files that compute and two that sleep take one cap and one deadline
    together, two of each alone.
    """
    files = dict(
        zip(("collision.py", "stress.py", "shape_functions.py", "stiffness.py"), WAYS.values(), strict=True)
    )
    spoiled = tuple(name for name, task in TASKS.items() if task.file in files)
    began = time.monotonic()
    record = attack(files, spoils=spoiled, deadline=DEADLINE, instead_of={})
    assert time.monotonic() - began < 3 * (CAP + 1) * DEADLINE
    turns = Counter(late)
    assert set(turns) <= set(files)
    assert max(turns.values()) == 2, "who was late is asked once more, and never again, for all its tasks"
    for name in spoiled:
        assert record[name].status == "error"
        # where the walls refuse threads, the file that starts one cannot be imported
        assert "was stopped" in record[name].message or "start new thread" in record[name].message


def test_an_endless_kernel_costs_its_own_task(attack):
    kernel = (
        KERNEL.replace("ENDLESS", "sphere_contact").replace("ARGUMENTS", "x, c, r").replace("RESULT", "k, x")
    )
    other = honest()[honest().index("@ti.func\ndef filter_velocity") :]
    record = attack({TARGET: "import taichi as ti\n" + kernel + other}, deadline=3.0)
    assert record["sphere_contact"].status == "error"
    assert "was stopped" in record["sphere_contact"].message
    assert record["filter_velocity"].status == "passed"
