"""The command that measures: bench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.base import paths
from muslin.cli.app import app
from muslin.cli.console import say


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="Without the largest cloth, fewer rounds.")] = False,
    against: Annotated[
        Path | None,
        typer.Option(help="A recorded benchmark: name every ratio that regressed by more than 20 %."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the ratios to this file.")] = None,
    read: Annotated[Path | None, typer.Option(help="Compare this record instead of measuring.")] = None,
    tiny: Annotated[bool, typer.Option("--tiny", hidden=True)] = False,
) -> None:
    """Measure steps, pictures and checks, beside C++ and the best this machine can do, in under three minutes."""
    from muslin.bench import bench as benchmark
    from muslin.bench import record as records

    recorded = records.Record.load(against) if against else None  # complain before measuring
    if read:
        now = records.Record.load(read)
    else:
        plan = benchmark.TINY if tiny else benchmark.QUICK if quick else benchmark.FULL
        now = benchmark.measure(plan, say)
    if recorded and not read and (doubtful := records.compare(now, recorded)[0]):
        say("\nWhat seems to have regressed is measured once more, for a disturbance does not come twice.")
        now = now.or_better(benchmark.measure(benchmark.plan_of((one.name for one in doubtful), plan), say))
    if out:
        now.save(out)
        say(f"Ratios in {paths.shown(out)}.")
    if recorded is None:
        return
    regressions, left_out = records.compare(now, recorded)
    for name in left_out:
        say(f"not compared: {name}")
    for regression in regressions:
        say(f"REGRESSED {regression}")
    compared = len(recorded.ratios) - len(left_out)
    say(f"{len(regressions)} of {compared} ratios regressed by more than 20 %.")
    if recorded.kind != now.kind:
        say(
            f"The record is of another kind of processor ({recorded.kind or 'not said'}) than this one ({now.kind}), "
            "where what is measured against other programs differs by itself: to know whether the code got slower, "
            "write a record of the earlier commit here (muslin bench --out FILE) and compare with that."
        )
    if regressions or not compared:
        raise typer.Exit(1)
