"""Attack 24: endless output, a disk full of files, a result of gigabytes.

Defence: what is printed is drained and capped; files are capped and live in a small memory disk (namespace);
frames are capped.
"""

import re

from attacking import TASKS, honest

from muslin.grading import sandbox, views

OUTPUT = """
import os, time
until = time.monotonic() + 2
while time.monotonic() < until:
    os.write(1, b"flood " * 10000)
"""
DISK = """
import os
written = 0
for k in range(8):
    try:
        with open(f"flood{k}", "wb") as stream:
            for _ in range(100):
                written += stream.write(bytes(1 << 20))
    except OSError:
        pass
print("WROTE", written >> 20, "MB")
"""
RESULT = """
import numpy as np
from muslin.tasks import batch
batch.evaluate = lambda function, **arrays: np.zeros((1 << 24, 3))
"""


def test_floods_are_capped(attack):
    names = ("collision.py", "stress.py", "shape_functions.py")
    spoiled = tuple(name for name, task in TASKS.items() if task.file in names)
    files = {n: flood + honest(n) for n, flood in zip(names, (OUTPUT, DISK, RESULT), strict=True)}
    record = attack(files, spoils=spoiled)
    assert record["sphere_contact"].status == "passed"
    assert "flood" in record["sphere_contact"].output
    assert len(record["sphere_contact"].output) < 2 * sandbox.LONGEST_OUTPUT
    assert record["phi"].status == "error"
    if record.safety.level == "namespace":
        wrote = re.search(r"WROTE (\d+) MB", record["dpsi_dF"].output)
        assert wrote
        assert int(wrote[1]) <= 128
    assert len(views.render(record, "json")) < 500_000
