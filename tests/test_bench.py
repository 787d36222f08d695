"""`muslin bench` measures, records ratios, and names what regressed."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from muslin import MuslinError
from muslin.bench import bench, candidates, record
from muslin.cli import app


def run(*words):
    return CliRunner().invoke(app, ["bench", *map(str, words)])


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A tiny benchmark: (its output, its record's file)."""
    file = tmp_path_factory.mktemp("bench") / "record.json"
    done = run("--tiny", "--out", file)
    assert done.exit_code == 0, done.output
    return done.output, file


def test_a_tiny_benchmark_says_times_ratios_and_what_can_be_had(measured):
    said, _ = measured
    assert "6x6 vertices" in said
    assert "native, permissive" in said
    assert "at best:" in said
    assert "GB/s" in said
    assert "Gflop/s" in said


def test_a_record_holds_ratios_with_their_spread_and_nothing_of_the_machine(measured):
    written = json.loads(measured[1].read_text())
    assert set(written) == {"version", "kind", "busy", "ratios"}
    assert written["ratios"]
    for name, ratio in written["ratios"].items():
        assert "speed against" in name
        assert set(ratio) == {"median", "low", "high"}
        assert 0 < ratio["low"] <= ratio["median"] <= ratio["high"]


def test_a_record_survives_being_written_and_read(measured, tmp_path):
    first = record.Record.load(measured[1])
    first.save(tmp_path / "again.json")
    assert record.Record.load(tmp_path / "again.json") == first


def test_a_regression_of_a_quarter_is_named_and_fails_the_command(measured, tmp_path):
    now = record.Record.load(measured[1])
    name, ratio = next(iter(now.ratios.items()))
    now.busy = False
    now.save(tmp_path / "now.json")
    better = record.Ratio(*(1.25 * x for x in (ratio.median, ratio.low, ratio.high)))
    record.Record(now.ratios | {name: better}, kind=now.kind).save(tmp_path / "before.json")
    done = run("--read", tmp_path / "now.json", "--against", tmp_path / "before.json")
    assert done.exit_code == 1
    (line,) = [line for line in done.output.splitlines() if line.startswith("REGRESSED")]
    assert name in line
    assert "1.25 times the cost" in line
    assert f"1 of {len(now.ratios)} ratios regressed" in done.output


def test_a_slowed_step_is_noticed_when_it_is_measured(measured, tmp_path):
    before = record.Record.load(measured[1])
    for name, ratio in before.ratios.items():
        before.ratios[name] = record.Ratio(*(1000 * x for x in (ratio.median, ratio.low, ratio.high)))
    before.save(tmp_path / "before.json")
    done = run("--tiny", "--against", tmp_path / "before.json")
    assert done.exit_code == 1
    assert done.output.count("REGRESSED") >= len(before.ratios) // 2


def test_ten_percent_is_no_regression_and_a_gain_is_none(measured, tmp_path):
    now = record.Record.load(measured[1])
    for factor in (1.1, 0.5):
        other = {
            name: record.Ratio(*(factor * x for x in (ratio.median, ratio.low, ratio.high)))
            for name, ratio in now.ratios.items()
        }
        record.Record(other).save(tmp_path / "other.json")
        done = run("--read", measured[1], "--against", tmp_path / "other.json")
        assert done.exit_code == 0, done.output
        assert "REGRESSED" not in done.output


def test_wall_times_of_a_busy_machine_are_not_compared():
    good, bad = record.Ratio(4.0, 3.9, 4.1), record.Ratio(1.0, 0.9, 1.1)
    names = ("native, speed against C++ (wall)", "native, speed against C++ (CPU)")
    recorded = record.Record(dict.fromkeys(names, good))
    busy = record.Record(dict.fromkeys(names, bad), busy=True)
    regressions, left_out = record.compare(busy, recorded)
    assert [regression.name for regression in regressions] == [names[1]]
    assert left_out == [f"{names[0]}: the machine is busy with something else"]


def test_of_two_measurements_the_better_ratio_counts_and_of_the_plan_only_what_was_doubtful_is_measured():
    good, bad = record.Ratio(4.0, 3.9, 4.1), record.Ratio(1.0, 0.9, 1.1)
    better = record.Record({"a": good, "b": bad}, busy=True).or_better(record.Record({"b": good}))
    assert better == record.Record({"a": good, "b": good}, busy=False)
    part = bench.plan_of(["50x50 native, speed against C++ (CPU)", "50x50 student, speed against C++ (CPU)"])
    assert (part.sizes, part.everyday) == ({50: bench.PLAN[50]}, False)
    part = bench.plan_of(["draft picture, 1280x720, speed against the yardstick (CPU)"])
    assert (part.sizes, part.everyday) == ({}, True)


def test_on_another_kind_of_processor_only_muslin_is_compared_with_itself():
    ours, other = "50x50 student, speed against native (CPU)", "50x50 native, speed against C++ (CPU)"
    good, bad = record.Ratio(4.0, 3.9, 4.1), record.Ratio(1.0, 0.9, 1.1)
    for kind, named in (("here", {ours, other}), ("64 cores, made of brass", {ours})):
        recorded = record.Record(dict.fromkeys((ours, other), good), kind=kind)
        regressions, left_out = record.compare(
            record.Record(dict.fromkeys((ours, other), bad), kind="here"), recorded
        )
        assert {regression.name for regression in regressions} == named
        assert all("another kind of processor" in line for line in left_out)
        assert len(left_out) == 2 - len(named)


def test_a_record_of_another_kind_of_processor_is_said(measured, tmp_path):
    now = record.Record.load(measured[1])
    assert now.kind
    for kind, said in ((now.kind, False), ("64 cores, made of brass", True)):
        record.Record(now.ratios, kind=kind).save(tmp_path / "before.json")
        done = run("--read", measured[1], "--against", tmp_path / "before.json")
        assert ("64 cores, made of brass" in done.output) == said
        assert "REGRESSED" not in done.output


def test_overlapping_spreads_are_said():
    before, now = record.Ratio(4.0, 2.0, 6.0), record.Ratio(3.0, 1.5, 5.0)
    regressions, _ = record.compare(record.Record({"a": now}), record.Record({"a": before}))
    assert "measure again" in str(regressions[0])


def test_a_record_with_nothing_in_common_is_no_success(measured, tmp_path):
    record.Record({"something else": record.Ratio(1, 1, 1)}).save(tmp_path / "other.json")
    done = run("--read", measured[1], "--against", tmp_path / "other.json")
    assert done.exit_code == 1
    assert "not compared: something else" in done.output


@pytest.mark.parametrize("text", ["", "[]", '{"version": 1}', '{"version": 99, "ratios": {}}'])
def test_what_is_no_record_is_refused(text, tmp_path):
    file = tmp_path / "record.json"
    file.write_text(text)
    with pytest.raises(MuslinError, match="not a record"):
        record.Record.load(file)


def test_the_shipped_record_is_one_and_covers_every_size(pytestconfig):
    shipped = record.Record.load(pytestconfig.rootpath / "tests" / "benchmarks" / "recorded.json")
    for size in bench.PLAN:
        assert any(name.startswith(f"{size}x{size} native") for name in shipped.ratios)


def test_candidates_take_turns():
    order = []

    class Someone:
        def __init__(self, name):
            self.name = name

        def steps(self, count):
            order.append(self.name)
            return np.ones((count - 1, 2))

    times = candidates.alternate([Someone("a"), Someone("b")], 3, lambda done: done == 2)
    assert order == ["a", "b", "a", "b"]
    assert times["a"].shape == (2, 2)


def test_where_there_is_no_compiler_the_baseline_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(candidates.shutil, "which", lambda name: None)
    program, why = candidates.build_baseline(tmp_path)
    assert program is None
    assert "compiler" in why
