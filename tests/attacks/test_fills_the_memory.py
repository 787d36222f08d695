"""Attack 22: takes all memory, with numpy, Taichi fields, Python lists and mappings.

Defence: a limit of the address space; the worker is the first to go when memory runs out all the same.
"""

import re

from attacking import TARGET, honest

HOSTILE = """
import mmap, numpy as np
kept = []
try:
    while len(kept) < 40:
        kept.append(np.empty(1 << 25))
except MemoryError:
    pass
try:
    while len(kept) < 80:
        kept.append(mmap.mmap(-1, 1 << 28))
except (OSError, MemoryError):
    pass
print("TOOK", len(kept) / 4, "GiB")
del kept
"""
FIELDS = """
import taichi as ti
kept = []
for k in range(10):
    kept.append(ti.field(ti.f64, shape=(1 << 27,)))
    kept[-1].fill(1.0)
"""


def test_memory_is_limited(attack):
    record = attack(
        {TARGET: HOSTILE + honest(), "stress.py": FIELDS + honest("stress.py")}, spoils=SPOILED_TOO
    )
    took = re.search(r"TOOK ([\d.]+) GiB", record["sphere_contact"].output)
    assert took
    assert float(took[1]) < 5
    assert record["sphere_contact"].status == "passed"
    assert record["dpsi_dF"].status == "error"


SPOILED_TOO = ("sphere_contact", "filter_velocity", "dpsi_dF", "nodal_force")
