"""What a person waits for: a picture of a simulation, the check of one function."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from muslin.base import paths
from muslin.bench.roofline import yardstick
from muslin.present.pictures import Show
from muslin.simulation.runs import RunFolder
from muslin.simulation.simulating import simulate
from muslin.tasks import assignment


def checked() -> str:
    """The task that is checked: two thirds down the table, typical in size."""
    every = list(assignment().tasks)
    return every[2 * len(every) // 3]


def pictures(
    folder: Path, steps: int = 160, size: tuple[int, int] = (1280, 720)
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """(quality, (frames, 2) wall and CPU time of a picture, (frames,) the yardstick beside each [ms]): `drape`."""
    simulate("drape", steps=steps, frame_every=max(1, steps // 8), out=folder / "drape")
    for quality in ("draft", "good"):
        show = Show(RunFolder(folder / "drape"), size=size, quality=quality)
        frames = range(len(show.times))
        show.picture(frames[-1])
        taken, yards = [], []
        for k in frames:
            yards.append(yardstick())
            wall, cpu = time.perf_counter(), time.process_time()
            show.picture(k)
            taken.append((time.perf_counter() - wall, time.process_time() - cpu))
        yield quality, 1e3 * np.array(taken), np.array(yards)


def check(times: int = 5) -> tuple[np.ndarray, np.ndarray] | None:
    """(times, 2) wall and CPU time of `muslin check` of one task, warm, and the yardstick beside each [ms].

    None outside a checkout.
    """
    if not paths.in_repository():
        return None
    command = [
        sys.executable,
        "-m",
        "muslin.cli",
        "check",
        checked(),
        "--functions",
        str(paths.solution("cloth")),
    ]
    taken, yards = [], []
    for k in range(times + 1):
        yard = yardstick()
        wall, cpu = time.perf_counter(), _children()
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if done.returncode:
            return None
        if k:  # the first may compile
            taken.append((time.perf_counter() - wall, _children() - cpu))
            yards.append(yard)
    return 1e3 * np.array(taken), np.array(yards)


def _children() -> float:
    spent = os.times()
    return spent.children_user + spent.children_system
