"""Attack 9: walks stack frames, gc, its own memory, /proc and other processes for expected values.

Defence: the worker never holds them (`test_no_expected_value_in_a_worker` looks at all of its memory); other
processes cannot be looked into.
"""

import os

from attacking import TARGET, honest, needs

HOSTILE = """
import ctypes, gc, os, sys
found = []
frame = sys._getframe()
while frame:
    found += [n for n in (*frame.f_locals, *frame.f_globals) if "expected" in n.lower()]
    frame = frame.f_back
for thing in gc.get_objects():
    if isinstance(thing, dict):
        found += [k for k in list(thing) if isinstance(k, str) and k.startswith("expected_")]
print("EXPECTED", sorted(set(found)))
print("MODULES", [n for n in sys.modules if n.split(".")[-1] in
                  ("checks", "properties", "diagnosis", "mistakes", "native", "authoring", "reference_data")])
others = []
try:
    listed = list(filter(str.isdigit, os.listdir("/proc")))
except OSError:
    listed = [str(os.getppid()), "PARENT"]
for pid in listed:
    if int(pid) != os.getpid():
        for name in ("mem", "maps", "environ"):
            try:
                with open(f"/proc/{pid}/{name}", "rb") as stream:
                    stream.seek(4096) if name == "mem" else stream.read(1)
                others.append(f"{pid}/{name}")
            except OSError:
                pass
libc = ctypes.CDLL(None, use_errno=True)
for pid in {os.getppid(), 1, PARENT}:
    if libc.ptrace(16, pid, 0, 0) == 0:
        others.append(f"traced {pid}")
print("OTHERS", others)
"""


def test_there_is_nothing_to_find(attack, level):
    record = attack({TARGET: HOSTILE.replace("PARENT", str(os.getpid())) + honest()}, level=level)
    told = record["sphere_contact"].output
    assert "EXPECTED []" in told
    assert "MODULES []" in told
    needs(record, "no other processes or programs")
    assert "OTHERS []" in told
