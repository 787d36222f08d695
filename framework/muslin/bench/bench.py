"""The whole benchmark: measure within a time, say lines as results come, return the record."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from muslin.base import runtime
from muslin.bench import everyday, roofline
from muslin.bench.candidates import (
    Baseline,
    Candidate,
    Ours,
    Yardstick,
    alternate,
    build_baseline,
    bytes_moved,
    factor_flops,
    ours,
    throw,
    write_problem,
)
from muslin.bench.record import Ratio, Record
from muslin.solve import solvers

#: Vertices along a side: (steps per round, seconds for all rounds).
PLAN = {20: (60, 8.0), 50: (30, 15.0), 100: (10, 28.0), 200: (4, 35.0)}

#: Rounds at least and at most; one round of the largest cloth may take half a minute on a busy machine.
ROUNDS = 2, 25

#: A single thread that gets less of the wall time than this shares its core: the machine is busy.
BUSY = 0.9

Say = Callable[[str], None]


@dataclass(frozen=True)
class Plan:
    """What to measure: steps and seconds for each size, rounds at least and at most; pictures and checks or not."""

    sizes: dict[int, tuple[int, float]]
    rounds: tuple[int, int] = ROUNDS
    everyday: bool = True


FULL = Plan(PLAN)
QUICK = Plan({size: (steps, seconds / 2) for size, (steps, seconds) in PLAN.items() if size < 200}, (2, 5))
TINY = Plan({6: (4, 0.0)}, (2, 2), everyday=False)


def plan_of(names: Iterable[str], plan: Plan = FULL) -> Plan:
    """What of a plan measures the ratios of these names."""
    first = {name.split()[0] for name in names}
    sizes = {size: spent for size, spent in plan.sizes.items() if f"{size}x{size}" in first}
    return replace(plan, sizes=sizes, everyday=plan.everyday and len(first) > len(sizes))


def measure(plan: Plan = FULL, say: Say = print) -> Record:
    """Measure, say what comes out, and return the ratios.

    Parameters
    ----------
    plan : Plan
    say : callable
        Gets lines of text.
    """
    record = Record(kind=roofline.kind())
    threads = runtime.usable_cores()
    speed, peak = roofline.bandwidth(threads), roofline.peak()
    say(
        f"{threads} cores: {speed / 1e9:.1f} GB/s by copying with all, "
        f"{peak / 1e9:.1f} Gflop/s by matrix products with one; yardstick {roofline.yardstick():.1f} ms"
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program, why = build_baseline(folder)
        if program is None:
            say(f"No C++ baseline: {why}.")
        if solvers.choose() != "cholmod":
            say('No fast solver: pip install "muslin[fast]" (CHOLMOD, under the GPL).')
        busy = []
        for size, (steps, seconds) in plan.sizes.items():
            found: list[Candidate] = list(ours(size))
            if program is not None:
                problem = folder / f"{size}.txt"
                write_problem(throw(size), problem)
                found.insert(0, Baseline("C++", program, problem))
            else:
                found.insert(0, Yardstick())
            times = _timed(found, steps, seconds, plan.rounds)
            wall, cpu = times[found[0].name].T
            busy.append(float(np.median(cpu / wall)) < BUSY)
            _tell_steps(size, found, times, speed, peak, record, say)
        if plan.everyday:
            _tell_everyday(folder, record, say)
    record.busy = any(busy)
    if record.busy:
        say("This machine is busy with something else: trust the CPU times, not the wall times.")
    return record


def read(path: Path) -> Record:
    """A record from its file."""
    return Record.load(path)


def _timed(
    candidates: list[Candidate], steps: int, seconds: float, rounds: tuple[int, int]
) -> dict[str, np.ndarray]:
    for candidate in candidates:
        if isinstance(candidate, Ours):
            candidate.steps(3)  # compile, load, touch memory
    begin, (least, most) = time.monotonic(), rounds

    def enough(done: int) -> bool:
        used = time.monotonic() - begin
        return done >= most or (done >= least and used + used / done > seconds)

    return alternate(candidates, steps, enough)


def _tell_steps(
    size: int,
    candidates: list[Candidate],
    times: dict[str, np.ndarray],
    speed: float,
    peak: float,
    record: Record,
    say: Say,
) -> None:
    reference, base = candidates[0].name, times[candidates[0].name]
    say(f"\nthrow, {size}x{size} vertices, ms per step; median of {len(base)} rounds, spread of the ratios")
    say(f"  {'':20}{'wall':>9}{'least':>9}{'CPU':>9}{'speed against ' + reference + ', wall':>32}{'CPU':>20}")
    for name, taken in times.items():
        (wall, cpu), least = np.median(taken, axis=0), taken[:, 0].min()
        text = f"  {name:20}{wall:9.2f}{least:9.2f}{cpu:9.2f}"
        if name != reference:
            for k, (kind, width) in enumerate((("wall", 32), ("CPU", 20))):
                ratio = Ratio.of(base[:, k] / taken[:, k])
                record.ratios[f"{size}x{size} {name}, speed against {reference} ({kind})"] = ratio
                text += f"{ratio!s:>{width}}"
        say(text)
    if "native" in times and "student" in times:
        ratio = Ratio.of(times["native"][:, 1] / times["student"][:, 1])
        record.ratios[f"{size}x{size} student, speed against native (CPU)"] = ratio
    mine = next(candidate for candidate in candidates if isinstance(candidate, Ours))
    moved = bytes_moved(mine.model)
    text = f"  at best: {moved / 1e6:.1f} MB of assembly, {1e3 * moved / speed:.2f} ms"
    if flops := factor_flops(mine.model):
        count, threads = flops
        factor = 1e3 * count / peak / threads
        parts = f" with {threads} threads" if threads > 1 else ""
        least = times[mine.name][:, 0].min()
        text += f"; {count / 1e6:.0f} Mflop of factorisation, {factor:.2f} ms{parts}"
        text += f"; together {100 * (1e3 * moved / speed + factor) / least:.0f} % of the least step"
    say(text)


def _tell_everyday(folder: Path, record: Record, say: Say) -> None:
    say("\nWhat a person waits for [ms]")
    waits = list(everyday.pictures(folder))
    names = [(f"{quality} picture, 1280x720", taken, yards) for quality, taken, yards in waits]
    checked = everyday.check()
    if checked is not None:
        names.append((f"muslin check {everyday.checked()}, warm", *checked))
    for name, taken, yards in names:
        wall, cpu = np.median(taken, axis=0)
        say(f"  {name:28} {wall:8.1f} wall (least {taken[:, 0].min():.1f}), {cpu:8.1f} CPU")
        record.ratios[f"{name}, speed against the yardstick (CPU)"] = Ratio.of(yards / taken[:, 1])
    if checked is None:
        say("  muslin check: not measured, which needs a checkout of Muslin.")
