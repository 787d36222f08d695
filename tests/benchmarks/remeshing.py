"""What a change of an adaptive cloth's mesh costs, in turns within one run, beside a model for a mesh that stays.

    python tests/benchmarks/remeshing.py [--rounds 20] [--share 0.02] [--parts]

A `drape` whose sheet is half refined (20 x 20 vertices, two levels: some 5,000 triangles) has a share of its triangles
refined. Processor time, medians: of the choice of triangles, of mesh and transfer, of the model of the new mesh, and of
the same model made with the care for one that many steps are taken with. `--parts`: where the model's time goes.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
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


#: Parts of making a model: what computes them, in which modules it is called by that name.
PARTS = {
    "hinges: geometry, and their equations": (
        "muslin.physics.bending:Hinges.of", "muslin.physics.hinge_weights:_equations",
    ),
    "hinges: the fit of their weights": ("muslin.physics.bending:weights",),
    "hinges: elements, and their place in the matrix": (
        "muslin.physics.elements.bending:Bending.__init__", "muslin.physics.elements.bending:Bending.factors",
    ),
    "pattern": (
        "muslin.physics.elements.layout:Incidence.of", "muslin.physics.elements.pattern:Pattern.__init__",
        "muslin.physics.elements.pattern:Pattern.blocks",
    ),
    "triangles: areas, masses, elements": (
        "muslin.physics.cloth:Cloth._elements", "muslin.physics.cloth:Cloth._masses", "muslin.mesh:area_and_normal",
    ),
    "order of elimination": ("muslin.solve.domains:_minimum_degree", "muslin.solve.ordering:cut"),
    "matrix in that order": ("muslin.solve.domains:_Triangle.__init__",),
    "symbolic factorisation": ("muslin.solve.cholmod:Domain.__init__", "muslin.solve.cholmod:Domain.corner"),
    "the rest of the system": ("muslin.solve.solvers:System.__init__",),
    "assembly lists": ("muslin.physics.elements.pattern:Assembly.__init__",),
}  # fmt: skip


class Clock:
    """Time spent in parts, without what is spent in parts inside them."""

    def __init__(self) -> None:
        self.spent = dict.fromkeys(PARTS, 0.0)
        self._inside = [0.0]
        for part, places in PARTS.items():
            for place in places:
                module, _, name = place.partition(":")
                *owners, last = name.split(".")
                owner = importlib.import_module(module)
                for each in owners:
                    owner = getattr(owner, each)
                own = inspect.getattr_static(owner, last)
                work = self._timed(part, getattr(own, "__func__", own))
                setattr(owner, last, classmethod(work) if isinstance(own, classmethod) else work)

    def _timed(self, part: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*given: Any, **named: Any) -> Any:
            self._inside.append(0.0)
            began = time.process_time()
            try:
                return work(*given, **named)
            finally:
                whole = time.process_time() - began
                self.spent[part] += whole - self._inside.pop()
                self._inside[-1] += whole

        return timed


def main() -> None:
    """Measure, and print a table."""
    reading = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    reading.add_argument("--rounds", type=int, default=20)
    reading.add_argument("--share", type=float, default=0.02, help="of the triangles, that are refined")
    reading.add_argument("--parts", action="store_true", help="where the time of the model goes")
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
    if asked.parts:
        clock, rounds = Clock(), range(asked.rounds)
        whole = sum(spent(adapter._rebuild) for _ in rounds) / asked.rounds
        for name, seconds in clock.spent.items():
            print(f"  {name:48s} {1000 * seconds / asked.rounds:6.2f} ms")
        print(f"  {'all':48s} {whole:6.2f} ms")
    print(f"model / as for a mesh that stays: {np.median(ratios):.2f}")


if __name__ == "__main__":
    main()
