"""Exercism's results.json, version 3 of its test-runner interface."""

from __future__ import annotations

import json
from typing import Any

from muslin.grading.record import ERROR, FAILED, NOT_IMPLEMENTED, PASSED, SKIPPED, Record
from muslin.grading.views import story
from muslin.grading.views.text import capped, one_line

MESSAGE, OUTPUT = 65_535, 500  # the interface's own limits [characters]
CUT = "\n[Output was truncated. Please limit to 500 chars.]"
_STATUS = {PASSED: "pass", FAILED: "fail", NOT_IMPLEMENTED: "fail", ERROR: "error"}


def render(record: Record) -> str:
    """The record for Exercism: a test per task, then the simulation if there was one, linked to no task.

    As the interface asks, the whole is an "error" only if no task could be run; and only the first failure is
    shown to students, so tasks keep the order of the handout.
    """
    tests = []
    for number, task in enumerate(record.tasks, 1):
        test: dict[str, Any] = {
            "name": one_line(f"{task.name}: {task.title}"),
            "status": _STATUS[task.status],
            "test_code": one_line(f"{task.section}: {task.file}"),
            "task_id": number,
        }
        if task.status != PASSED:
            test["message"] = capped(story.task_told(task), MESSAGE)
        if task.output:
            test["output"] = capped(task.output, OUTPUT, CUT)
        tests.append(test)
    if record.simulation.status != SKIPPED:
        test = {
            "name": "All functions together in a simulation",
            "status": _STATUS[record.simulation.status],
            "test_code": "",
        }
        if record.simulation.status != PASSED:
            test["message"] = capped(story.simulation_told(record), MESSAGE)
        tests.append(test)
    data: dict[str, Any] = {"version": 3, "status": "pass", "message": None, "tests": tests}
    if any(test["status"] != "pass" for test in tests):
        data["status"] = "fail"
    if record.tasks and all(task.status == ERROR for task in record.tasks):
        told = "\n\n".join(f"{task.name}\n{story.task_told(task)}" for task in record.tasks)
        data |= {"status": "error", "message": capped(f"No task could be run.\n\n{told}", MESSAGE)}
    return json.dumps(data, indent=1, allow_nan=False) + "\n"
