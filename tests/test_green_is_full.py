"""What `check` calls right, the grader gives full points for, hidden cases apart."""

import itertools
import sys
from pathlib import Path

import pytest

import muslin
from muslin import tasks
from muslin.grading import checks
from muslin.grading.reader import Reader
from muslin.grading.record import FAILED
from muslin.judging import properties, reference
from muslin.student import checking

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import looks_right
import suite

TABLE = tasks.assignment("cloth")

#: A reader that has ended says nothing of mistakes: no verdict depends on that.
with Reader() as SILENT:
    pass

#: Of so many variants of a task one is tried here; `python tests/test_green_is_full.py` tries all.
EVERY = 12


def rounds(every=1):
    """Variants side by side: one of each task in each submission."""
    columns = {}
    for variant in [*looks_right.variants(), *(v for v in suite.variants() if v.verdict == "right")]:
        columns.setdefault(variant.task, []).append(variant)
    for row in itertools.zip_longest(*(column[::every] for column in columns.values())):
        yield {variant.task: variant for variant in row if variant is not None}


def judged(folder, chosen, seed="a seed of the grader"):
    """What `check` and the grader say of each variant: (variant, report, layers that fail)."""
    suite.submission(folder, chosen)
    reports = {r.task: r for r in checking.examine(folder, "cloth", tuple(chosen))}
    functions = muslin.load(folder)
    for name, variant in chosen.items():
        verdict = checks.Verdict(TABLE.tasks[name])
        public = outcome(functions[name], reference.cases("cloth", name)[0])
        checks.judge_public(TABLE, verdict, public, SILENT)
        drawn = properties.draw("cloth", name, seed)
        if drawn and verdict.checks[-1].status != FAILED:
            inputs = properties.batch([inputs for _, inputs in drawn])
            checks.judge_properties(TABLE, verdict, drawn, outcome(functions[name], inputs), SILENT)
        yield variant, reports[name], {check.layer for check in verdict.checks if check.status == FAILED}


def outcome(function, inputs):
    got = muslin.evaluate(function, **inputs)
    return checks.Outcome(got if isinstance(got, tuple) else (got,))


def told_apart(folder, every):
    """Variants, and those that `check` calls right and the grader does not."""
    found = [
        entry for k, chosen in enumerate(rounds(every)) for entry in judged(folder / str(k), chosen)
    ]  # a folder for each: modules are kept by path
    return found, [
        f"{variant}: {failed - {'hidden'}}"
        for variant, report, failed in found
        if report.status == checking.GREEN and failed - {"hidden"}
    ]


def test_what_check_calls_right_gets_full_points_but_for_hidden_cases(tmp_path):
    found, broken = told_apart(tmp_path, EVERY)
    assert not broken
    assert {report.status for _, report, _ in found} == {checking.GREEN, checking.WRONG}
    right = [(str(v), r.message) for v, r, _ in found if v.verdict == "right" and r.status != checking.GREEN]
    assert not right


def test_there_are_two_hundred_variants_that_look_right():
    assert sum(map(len, rounds())) >= 200


@pytest.mark.parametrize(
    ("name", "statement"),
    [
        ("no floor", "divided by 1e-6"),
        ("floor of 1e-12", "divided by 1e-6"),
        ("threshold, no abs [1e-3]", "flip must not jump"),
    ],
)
def test_check_tells_what_must_hold_and_for_which_inputs_it_does_not(tmp_path, name, statement):
    (variant,) = (v for v in looks_right.variants() if v.task == "eigensystem" and v.name == name)
    suite.submission(tmp_path, {"eigensystem": variant})
    (report,) = checking.examine(tmp_path, "cloth", ("eigensystem",))
    assert report.status == checking.WRONG
    assert "the public cases agree" in report.message.splitlines()[0]
    assert "s        = [" in report.message
    assert statement in report.mistake


if __name__ == "__main__":
    import tempfile

    found, broken = told_apart(Path(tempfile.mkdtemp()), 1)
    print(
        f"{len(found)} variants, {sum(r.status == checking.GREEN for _, r, _ in found)} green",
        *broken,
        sep="\n",
    )
