"""The proof that the grader is right: no wrong variant passes, no right variant loses a point, end to end."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

import muslin
from muslin.base import paths

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import suite  # type: ignore[import-not-found]

#: Set to anything, this grades every wrong variant, which takes minutes, and not every third round of them.
WHOLE = bool(os.environ.get("MUSLIN_ALL_MISTAKES"))


def rounds(verdict):
    """Rounds of every assignment's suite, each with the assignment."""
    return [
        pytest.param(name, chosen, id=f"{name}-{k}")
        for name in paths.assignments("solutions")
        for k, chosen in enumerate(suite.rounds(verdict, name))
        if WHOLE or verdict == "right" or k % 3 == 0
    ]


@pytest.mark.parametrize(("assignment", "chosen"), rounds("wrong"))
def test_no_wrong_function_passes_or_drags_another_down(assignment, chosen, tmp_path):
    record = muslin.grade(suite.submission(tmp_path / "submission", chosen, assignment), assignment)
    for task in record:
        variant = chosen.get(task.name)
        if variant is None:
            assert (task.status, task.score) == ("passed", task.max_score), task.name
        else:
            assert task.status in ("failed", "error"), str(variant)
            assert task.score == 0, str(variant)
    assert record.simulation.status in ("passed", "skipped"), record.simulation


@pytest.mark.parametrize(("assignment", "chosen"), rounds("right"))
def test_no_right_function_loses_a_point(assignment, chosen, tmp_path):
    record = muslin.grade(suite.submission(tmp_path / "submission", chosen, assignment), assignment)
    lost = {task.name: task.message for task in record if task.score < task.max_score}
    assert not lost
    assert record.simulation.status == "passed", record.simulation
    assert record.simulation.stand_ins == ()
