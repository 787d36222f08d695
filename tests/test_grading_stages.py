"""The stages of a grading: who is late has another turn, alone; and the grader may be stopped, or share its machine."""

from __future__ import annotations

import itertools
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

import muslin
from muslin.base import paths
from muslin.grading import parts, simulating
from muslin.grading.checks import Outcome
from muslin.grading.patience import Patience

SOLUTION = paths.solution("cloth")
FILES = ("collision.py", "kinetic_energy.py", "strain_energy.py")


@pytest.fixture(autouse=True)
def _without_simulation(monkeypatch):
    monkeypatch.setattr(simulating, "reference", lambda assignment: None)


@pytest.fixture
def small(tmp_path):
    folder = tmp_path / "small"
    folder.mkdir()
    for file in FILES:
        shutil.copy(SOLUTION / file, folder)
    return folder


class Watched:
    """Counts the questions that are open at once; says "late" where it is told to."""

    def __init__(self, monkeypatch, late):
        self._ask, self._late = parts.Part.ask, late
        self._lock, self._open = threading.Lock(), 0
        self.asked: list[tuple[str, int]] = []
        monkeypatch.setattr(parts.Part, "ask", lambda part, *rest, **more: self(part, *rest, **more))

    def __call__(self, part, task, inputs, shown=False):
        with self._lock:
            self._open += 1
            turn = sum(name == task.name for name, _ in self.asked)
            self.asked.append((task.name, self._open))
        try:
            if self._late(task.name, turn):
                return Outcome(kind="late", text="It took too long.")
            return self._ask(part, task, inputs, shown)
        finally:
            with self._lock:
                self._open -= 1


def test_who_was_late_is_asked_once_more_alone_and_gets_full_points(monkeypatch, small):
    watched = Watched(monkeypatch, lambda name, turn: name in ("psi", "kinetic_energy") and turn == 0)
    record = muslin.grade(small)
    assert {record[name].status for name in ("psi", "dpsi_ds", "kinetic_energy", "filter_velocity")} == {
        "passed"
    }
    for name in ("psi", "kinetic_energy"):
        second = [k for k, (asked, _) in enumerate(watched.asked) if asked == name][1]
        assert watched.asked[second][1] == 1, "another question was open"


def test_who_is_late_alone_too_fails_and_a_file_has_one_such_turn_in_a_stage(monkeypatch, small):
    watched = Watched(monkeypatch, lambda name, turn: name in ("psi", "dpsi_ds"))
    record = muslin.grade(small)
    assert record["psi"].status == record["dpsi_ds"].status == "error"
    assert record["d2psi_ds2"].status == "passed"
    assert [name for name, _ in watched.asked].count("psi") == 2
    assert [name for name, _ in watched.asked].count("dpsi_ds") == 1


def test_a_grader_that_is_stopped_again_and_again_makes_nobody_late(monkeypatch, small):
    """Its clock jumps by more than the deadline each time it looks."""
    jumps = itertools.count(0.0, 23.0)
    monkeypatch.setattr(parts, "Patience", lambda seconds: Patience(seconds, clock=lambda: next(jumps)))
    record = muslin.grade(small, deadline=20)
    assert all(task.status == "passed" for task in record if task.file in FILES)


def test_two_graders_at_once_give_the_same_record(small):
    alone = muslin.grade(small, seed="two")
    with ThreadPoolExecutor(2) as pool:
        both = [pool.submit(muslin.grade, small, seed="two") for _ in range(2)]
        records = [found.result() for found in both]
    assert [record.as_json(timing=False) for record in records] == [alone.as_json(timing=False)] * 2
