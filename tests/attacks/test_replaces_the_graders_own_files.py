"""Attack 3: overwrites, replaces and races the grader's own files.

Defence: read-only source (namespace, landlock), no changes of modes (filter), another user where possible; the
grader has imported all it needs before, and writes nothing a submission could reach.

What is tried on a file is tried on one that is there to be harmed; the real ones are opened only.
"""

import os
import sys
from pathlib import Path

from attacking import TARGET, honest, needs

import muslin

HOSTILE = """
import os, threading

def attempt(path, real):
    ways = [lambda: open(path, "ab").close(), lambda: open(path, "r+b").close()]
    if not real:
        ways += [lambda: os.rename(path, path + ".moved"), lambda: os.unlink(path), lambda: os.chmod(path, 0),
                 lambda: os.utime(path, (0, 0)), lambda: os.truncate(path, 0),
                 lambda: os.symlink("/", path + ".link"), lambda: os.chmod(os.path.dirname(path), 0)]
    for k, way in enumerate(ways):
        try:
            way()
            print("REPLACED", path, k)
        except OSError:
            pass

def race():
    for _ in range(20):
        for path in REAL:
            attempt(path, True)
        attempt(VICTIM, False)

threading.Thread(target=race).start()
race()
"""


def test_nothing_of_the_grader_can_be_replaced(attack, level, tmp_path):
    victim = tmp_path / "results.json"
    victim.write_text("mine")
    victim.chmod(0o644)
    before = victim.stat()
    package = Path(muslin.__file__).parent
    real = [muslin.__file__, package / "grading" / "grader.py", os.__file__, os.path.realpath(sys.executable)]
    hostile = HOSTILE.replace("REAL", repr([str(p) for p in real])).replace("VICTIM", repr(str(victim)))
    record = attack({TARGET: hostile + honest()}, level=level)
    needs(record, "no other processes or programs" if level == "process" else "own user")
    assert "REPLACED" not in record["sphere_contact"].output
    assert victim.read_text() == "mine"
    assert (victim.stat().st_mode, victim.stat().st_mtime_ns) == (before.st_mode, before.st_mtime_ns)
