"""What a change of an adaptive cloth's mesh costs, in turns within one run, beside a model for a mesh that stays.

    python tests/benchmarks/remeshing.py [--rounds 20] [--share 0.02]

A `drape` whose sheet is half refined (20 x 20 vertices, two levels: some 5,000 triangles) has a share of its triangles
refined. Processor time, medians: of the choice of triangles, of mesh and transfer, of the model of the new mesh, and of
the same model made with the care for one that many steps are taken with.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from muslin.simulation import scenes
from muslin.simulation.simulating import adapter_for, build


def spent(work: Callable[[], Any]) -> float:
    """Processor time [ms]."""
    began = time.process_time()
    work()
    return 1000 * (time.process_time() - began)


def main() -> None:
    """Measure, and print a table."""
    reading = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    reading.add_argument("--rounds", type=int, default=20)
    reading.add_argument("--share", type=float, default=0.02, help="of the triangles, that are refined")
    asked = reading.parse_args()
    scene = scenes.get("drape", resolution=20, adaptive=True, levels=2)
    mesh = scene.load_mesh()
    model, state = build(scene, mesh=mesh)
    adapter = adapter_for(scene, None, None, "closed", mesh, (), model, state.x)
    assert adapter is not None
    refined = adapter.refined
    for _ in range(4):
        centre = refined.spread(mesh.vertices)[refined.triangles].mean(axis=1)
        refined = refined.refine(np.flatnonzero((centre[:, 0] < 0.25) & (refined.generation < 4)))
    adapter.refined = refined
    state = replace(state, x=refined.spread(state.x), v=refined.spread(state.v))
    adapter._rebuild()
    few = np.random.default_rng(0).permutation(np.flatnonzero(refined.generation < 4))
    few = few[: max(1, round(asked.share * len(refined.triangles)))]
    stays = replace(scene, adaptive=False)

    def lasting() -> Any:
        start, pinned = adapter.refined.spread(adapter._start), adapter.model.pinned
        return build(stays, None, None, "closed", adapter.model.body.mesh, (), start, pinned)

    parts: dict[str, Callable[[], Any]] = {
        "which triangles": lambda: adapter._wanted(state, adapter._indicator(state)),
        "mesh and transfer": lambda: adapter._refined(state, few),
        "model": adapter._rebuild,
        "model, as for a mesh that stays": lasting,
    }
    found: dict[str, list[float]] = {}
    for _ in range(asked.rounds + 2):
        adapter.refined = refined
        for name, work in parts.items():
            found.setdefault(name, []).append(spent(work))
    changed = len(adapter.refined.triangles) - len(refined.triangles)
    print(f"{len(refined.triangles)} triangles, {len(few)} refined: {changed} more")
    for name, times in found.items():
        print(f"{name:34s} {np.median(times[2:]):6.1f} ms")
    ratios = np.divide(found["model"], found["model, as for a mesh that stays"])[2:]
    print(f"model / as for a mesh that stays: {np.median(ratios):.2f}")


if __name__ == "__main__":
    main()
