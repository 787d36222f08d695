"""Attack 23: segmentation fault, stack overflow, abort.

Defence: a process for each file; the crash is explained, and costs the task it happened in.
"""

from attacking import TARGET, TASKS, honest

WAYS = {
    "collision.py": "import ctypes; ctypes.string_at(0)",
    "stress.py": "import os; os.abort()",
    "shape_functions.py": """
import sys, threading
sys.setrecursionlimit(10**9)
def down(n): return max(map(down, [n]))
threading.stack_size(1 << 16)
thread = threading.Thread(target=down, args=(0,))
thread.start()
thread.join()
""",
}
OUTSIDE = """
import taichi as ti
table = ti.field(ti.f64, shape=4)

@ti.func
def sphere_contact(x, c, r):
    for k in range(100):
        table[k * 100000000] = 1.0
    return 1, x

"""


def test_crashes_cost_their_own_file(attack):
    spoiled = tuple(name for name, task in TASKS.items() if task.file in WAYS)
    record = attack({f: f"{way}\n{honest(f)}" for f, way in WAYS.items()}, spoils=spoiled)
    assert {record[name].status for name in spoiled} == {"error"}


def test_an_index_out_of_range_is_explained(attack):
    other = honest()[honest().index("@ti.func\ndef filter_velocity") :]
    record = attack({TARGET: OUTSIDE + other})
    assert record["sphere_contact"].status == "error"
    assert record["filter_velocity"].status == "passed"
