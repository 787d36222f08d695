"""Attack 5: hands in conftest.py, sitecustomize.py, numpy.py, taichi.py, muslin/, *.pth and an assignment.toml.

Defence: only the task files are taken; Python starts isolated (-I); no pytest in the worker.
"""

from attacking import TARGET, honest, readable

BAD = "print('SHADOWED'); raise SystemExit('shadowed')"
NAMES = ("conftest.py", "sitecustomize.py", "usercustomize.py", "numpy.py", "taichi.py", "json.py", "socket.py",
         "muslin/__init__.py", "muslin/batch.py", "evil.pth", "pyvenv.cfg", "pytest.ini", "wire.py")  # fmt: skip
MANIFEST = """
schema = 1
name = "cloth"
title = "easy"
version = "9"
[grading]
hidden_cases = 1
"""


def test_only_the_task_files_are_taken(attack):
    files = dict.fromkeys(NAMES, BAD) | {"assignment.toml": MANIFEST, TARGET: honest()}
    record = attack(files)
    assert record["sphere_contact"].status == "passed"
    assert "SHADOWED" not in readable(record)
    assert any("Not task files" in note for note in record.submission.notes)
    assert record.assignment["version"] != "9"


def test_a_task_file_cannot_bring_modules_along_either(attack):
    """It writes them beside itself, where a worker that imports something late might look."""
    hostile = """
import os
for name in ("numpy.py", "json.py", "muslin.py", "scipy.py", "sitecustomize.py", "kinetic_energy.py"):
    open(name, "w").write("print('SHADOWED'); raise SystemExit")
"""
    record = attack({TARGET: hostile + honest()})
    assert "SHADOWED" not in readable(record)
