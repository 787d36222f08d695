"""Attack 10: SkipTest, pytest.exit, SystemExit, KeyboardInterrupt, os._exit(0), at import and in the function.

Defence: the list of verdicts is fixed; what gives no answer has failed.
"""

import pytest
from attacking import FILES, TARGET, TASKS, honest

WAYS = {
    "os._exit": "import os; os._exit(0)",
    "SystemExit": "raise SystemExit(0)",
    "SkipTest": "import unittest; raise unittest.SkipTest('no need')",
    "GeneratorExit": "raise GeneratorExit",
    "KeyboardInterrupt": "raise KeyboardInterrupt",
}
INSIDE = """
import taichi as ti
def leave():
    {way}

@ti.func
def sphere_contact(x, c, r):
    ti.static(leave())
    return 1, x
"""


def test_leaving_at_import_fails(attack):
    files = {file: f"{way}\n{honest(file)}" for file, way in zip(FILES, WAYS.values(), strict=False)}
    spoiled = tuple(name for name, task in TASKS.items() if task.file in files)
    record = attack(files, spoils=spoiled)
    assert {record[name].status for name in spoiled} <= {"error"}


@pytest.mark.parametrize("way", ["os._exit", "KeyboardInterrupt"])
def test_leaving_in_one_function_costs_that_one(attack, way):
    other = honest()[honest().index("@ti.func\ndef filter_velocity") :]
    record = attack({TARGET: INSIDE.format(way=WAYS[way]) + other})
    assert record["sphere_contact"].status == "error"
    assert record["filter_velocity"].status == "passed"
