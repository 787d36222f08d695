"""Whether cloth gains energy where it touches: python tests/benchmarks/drape_energy.py [SIZE ... | CASE ...]

With sizes (default 32 64 100), `drape` over time steps and floors; with names of `CASES`, or `cases` for all of them,
what is hard to meet. For every run the total energy at the start, the highest later, less work and with it; the kinetic
energy at the end; the deepest vertex at the start, and after half a second (in which what begins inside is taken out);
the processor time.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import muslin
from muslin.physics.colliders import Collider, Sphere
from muslin.simulation import scenes
from muslin.simulation.marching import Run
from muslin.simulation.scenes import Scene

SIZES = (32, 64, 100)
#: Time step [s] and simulated time [s].
TIMES = ((1 / 60, 4.0), (1 / 240, 4.0), (1 / 960, 4.0))
#: Height of the floor [m]: the sphere stands on it, or is above it.
FLOORS = (-0.3, -0.62)


def pinch(gap: float) -> Any:
    """Colliders of a scene: two spheres, one above the other, with a gap between them at the height 0."""

    def colliders(scene: Scene, _: float) -> tuple[Collider, ...]:
        middle = scene.sphere_radius + gap / 2
        return tuple(Sphere((0.0, y, 0.0), scene.sphere_radius) for y in (-middle, middle))

    return colliders


#: Parameters of `drape` (or of another `scene`), and colliders.
CASES: dict[str, dict[str, Any]] = {
    "fall-1m": {"start_at": (0.003, 1.3, 0.005), "steps": 480},
    "fall-10m": {"start_at": (0.003, 10.3, 0.005), "steps": 720},
    "20m/s": {"start_at": (0.003, 0.6, 0.005), "start_velocity": (0, -20, 0), "steps": 240},
    "120m/s": {"start_at": (0.003, 0.6, 0.005), "start_velocity": (0, -120, 0), "steps": 240},
    "small-sphere": {"sphere_radius": 0.01, "start_at": (0.003, 0.05, 0.005), "steps": 240},
    "moving-sphere": {"sphere_velocity": (0.5, 0.5, 0), "floor": False, "steps": 240},
    "inside": {"start_at": (0.003, 0.28, 0.005), "steps": 240},
    "deep-inside": {"start_at": (0.003, 0.1, 0.005), "steps": 240},
    "no-gap": {"start_at": (0.003, 0.0, 0.005), "colliders": pinch(0.0), "steps": 240},
    "overlapping": {"start_at": (0.003, 0.0, 0.005), "colliders": pinch(-0.01), "steps": 240},
    "wind": {"scene": "hang", "wind": (0, 0, -20), "drag": 1.2, "dt": 1 / 60, "steps": 240},
}


def case(name: str, **changed: Any) -> Run:
    """Simulate one of the cases, with other parameters."""
    given = {**CASES[name], **changed}
    colliders = given.pop("colliders", None)
    scene = scenes.get(given.pop("scene", "drape"), **given)
    return muslin.simulate(replace(scene, colliders=colliders) if colliders else scene)


def told(label: str, run: Run, began: float) -> None:
    """Print a line about a run."""
    table = run.energies
    energy = table.total - table.work
    later = table.penetration[table.time > 0.5]
    numbers = f"{energy[0]:9.4f} {energy.max():9.4f} {table.total.max():9.4f}  {table.kinetic[-1]:9.2e}"
    depths = f"{table.penetration[0]:7.1e} {later.max():7.1e}"
    print(f"{label:24} {numbers}  {depths}  {time.process_time() - began:8.1f}", flush=True)


def main(words: list[str]) -> None:
    """Print a line for every run."""
    print("case                        start   highest with work  kinetic   deepest: start, later  time [s]")
    named = list(CASES) if words == ["cases"] else [word for word in words if word in CASES]
    for name in named:
        for size in (32,):
            for dt in {CASES[name].get("dt", 1 / 60), CASES[name].get("dt", 1 / 240)}:
                span = CASES[name]["steps"] * CASES[name].get("dt", 1 / 240)
                began = time.process_time()
                run = case(name, resolution=size, dt=dt, steps=round(span / dt))
                told(f"{name} {size} 1/{round(1 / dt)}", run, began)
    for size in [] if named else [int(word) for word in words] or SIZES:
        for dt, span in TIMES:
            for ground in FLOORS:
                began = time.process_time()
                run = muslin.simulate("drape", resolution=size, dt=dt, steps=round(span / dt), ground=ground)
                told(f"drape {size} 1/{round(1 / dt)} {ground}", run, began)


if __name__ == "__main__":
    main(sys.argv[1:])
