"""Attack 8: replaces the classes of results and scores, and asks for more than the maximum.

Defence: scoring happens in the grader only, from its own task table.
"""

import pytest
from attacking import TARGET, TASKS, honest

HOSTILE = """
import dataclasses, importlib
def found(name):
    try:
        return importlib.import_module(name)
    except ImportError:  # a worker sees no more of Muslin than it needs
        return None
record, tasks, wire = (found(f"muslin.{name}") for name in ("grading.record", "tasks", "grading.wire"))
for name in ("Record", "TaskResult", "Check"):
    kind = getattr(record, name, None)
    for attribute in ("score", "max_score", "status") if kind else ():
        setattr(kind, attribute, property(lambda self: 1000))
if tasks:
    tasks.Grading.credit = {"form": 1.0}
    for name, task in list(getattr(tasks, "_cached", {}).items()):
        task.points = 1000
if wire:
    send = wire.send
    def boasting(channel, header, arrays=None, deadline=None):
        more = {"score": 1000, "max_score": 1000, "status": "passed", "verdict": "passed", "points": 1000}
        return send(channel, {**header, **more}, arrays, deadline)
    wire.send = boasting
"""
WRONG = honest().replace("v - d * n", "v + d * n")


@pytest.mark.with_simulation
def test_points_come_from_the_task_table(attack):
    record = attack({TARGET: HOSTILE + WRONG}, instead_of={TARGET: WRONG})
    assert record["filter_velocity"].score == 0
    assert record["sphere_contact"].score == TASKS["sphere_contact"].points
