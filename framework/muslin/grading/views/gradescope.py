"""Gradescope's results.json: one test per task, and one for the simulation, which is worth nothing by itself."""

from __future__ import annotations

import json
from typing import Any

from muslin.grading.record import PASSED, SCHEMA, SKIPPED, Record, TaskResult
from muslin.grading.views import story
from muslin.grading.views.text import capped, one_line, points

#: Most characters of a test's output, and of the output of the whole.
LIMIT = 10_000


def render(record: Record, visibility: str = "visible") -> str:
    """The record for Gradescope.

    Parameters
    ----------
    record : Record
    visibility : {"visible", "after_due_date", "after_published", "hidden"}
        When students see the tests. Seed and layers are in `extra_data`, which only instructors see.
    """
    tests = [_test(number, task) for number, task in story.numbered(record)]
    tests.append(_simulation(record, int(tests[-1]["number"].split(".")[0]) + 1 if tests else 1))
    data = {
        "score": record.score,
        "execution_time": round(float(record.timing.get("seconds", 0.0)), 2),
        "output": capped(_summary(record), LIMIT),
        "output_format": "text",
        "test_output_format": "text",
        "test_name_format": "text",
        "visibility": visibility,
        "stdout_visibility": "hidden",
        "extra_data": {
            "schema": SCHEMA,
            "seed": one_line(record.seed),
            "sha256": one_line(record.submission.sha256),
            "safety": one_line(record.safety.level),
            "versions": {one_line(k): one_line(str(v)) for k, v in record.environment.items()},
        },
        "tests": [{**test, "visibility": visibility} for test in tests],
    }
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def _summary(record: Record) -> str:
    lines = [
        f"{record.assignment.get('title', '')}: {points(record.score)} of {points(record.max_score)} points"
    ]
    return "\n".join([*lines, "", *(f"{name}: {value}" for name, value in story.circumstances(record))])


def _test(number: str, task: TaskResult) -> dict[str, Any]:
    output = f"{story.WORDS[task.status].capitalize()}.\n{capped(story.task_told(task), LIMIT // 2)}"
    if task.output:
        output += f"\n\nYour code printed:\n{story.printed(task, LIMIT // 3)}"
    return {
        "number": number,
        "name": one_line(f"{task.name}: {task.title}"),
        "name_format": "text",
        "score": task.score,
        "max_score": task.max_score,
        "status": "passed" if task.status == PASSED else "failed",
        "output": capped(output, LIMIT),
        "output_format": "text",
        "tags": [one_line(task.section), one_line(task.file), one_line(task.status)],
        "extra_data": {
            "status": task.status,
            "layers": {one_line(check.name): check.status for check in task.checks},
            "causes": [one_line(check.cause) for check in task.checks if check.cause],
        },
    }


def _simulation(record: Record, number: int) -> dict[str, Any]:
    status = record.simulation.status
    return {
        "number": f"{number}.1",
        "name": "simulation: all functions together",
        "name_format": "text",
        "score": 0,
        "max_score": 0,
        # Gradescope knows no third status: skipped is not failed.
        "status": "passed" if status in (PASSED, SKIPPED) else "failed",
        "output": capped(f"{story.WORDS[status].capitalize()}.\n{story.simulation_told(record)}", LIMIT),
        "output_format": "text",
        "tags": ["simulation", status],
        "extra_data": {"status": status, "scene": one_line(record.simulation.scene)},
    }
