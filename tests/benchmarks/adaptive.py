"""Whether an adaptive cloth is nearer to the truth than a uniform one in the same time: error against time of `drape`.

    python tests/benchmarks/adaptive.py [--truth 100] [--steps 240] [--picture FILE.png]

`drape` as `muslin demo` has it (contact in the system, friction, bending), adaptive with several budgets and uniform
with several sizes, against a uniform cloth as fine as is feasible. Each run has its own process and one thread, and
its time is the processor's, without what is compiled. The errors, at the end of the run: the mean distance of the two
surfaces (both ways), the part of the two outlines that is not common, and elastic energy as a share of the truth's.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

#: As `muslin demo` has it.
SCENE = {
    "integrator": "linearly-implicit", "contact": "solve", "friction": 0.3, "ground": -0.3, "bending": "quadratic",
}  # fmt: skip
BASE = {"adaptive": "on", "resolution": 20, "levels": 2, "adapt_every": 4}
RUNS: dict[str, dict[str, Any]] = {
    **{f"uniform {size}": {"resolution": size} for size in (20, 32, 48, 64)},
    **{f"adaptive, {budget}": BASE | {"budget": budget} for budget in (1000, 2000, 4000)},
}


def worker(asked: dict[str, Any], file: str) -> None:
    """One run: what it ended as into a file, and its processor time to standard output."""
    import muslin

    muslin.simulate("drape", **(SCENE | asked | {"steps": 8, "start_at": "0.003,0.302,0.005"}))  # compiles
    began = time.process_time()
    run = muslin.simulate("drape", **(SCENE | asked))
    spent = time.process_time() - began
    body = run.body
    body.update(run.x)
    bent = body.bending.energy() if body.bending else 0.0
    np.savez(file, x=run.x, triangles=body.cells)
    elastic = float(run.energies.elastic[-1])
    print(json.dumps({"time": spent, "vertices": len(run.x), "elastic": elastic, "bending": bent}))


def measured(asked: dict[str, Any], file: Path) -> dict[str, Any]:
    """The same in a process of its own."""
    alone = {name: "1" for name in ("MUSLIN_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}
    command = [sys.executable, __file__, "--worker", json.dumps(asked), str(file)]
    done = subprocess.run(command, env=os.environ | alone, stdout=subprocess.PIPE, text=True, check=True)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    with np.load(file) as saved:
        return found | {"x": saved["x"], "triangles": saved["triangles"]}


def points(x: np.ndarray, triangles: np.ndarray, count: int = 40_000) -> np.ndarray:
    """Points all over a surface, as many everywhere, whatever its triangles, (count, 3)."""
    a, b, c = x[triangles].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    draw = np.random.default_rng(0)
    which = draw.choice(len(triangles), count, p=area / area.sum())
    u, v = draw.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return np.asarray(a[which] + u * (b - a)[which] + v * (c - a)[which])


def errors(
    found: dict[str, Any], truth: dict[str, Any], view: tuple[float, float, float]
) -> dict[str, float]:
    """How far a run is from the truth."""
    from silhouettes import outline, overlap

    surfaces = [(run["x"], run["triangles"]) for run in (found, truth)]
    ways = [
        cKDTree(points(*there, 400_000)).query(points(*here))[0].mean()
        for here, there in (surfaces, surfaces[::-1])
    ]
    seen = [outline(run["x"], run["triangles"], view) for run in (found, truth)]
    return {"distance": float(np.mean(ways)), "outline": 1 - overlap(*seen)}


def main() -> None:
    """Run all, print a table and draw the curves."""
    from muslin.render.picture import write_png
    from muslin.render.plot import line_plot
    from muslin.simulation import scenes

    reading = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    reading.add_argument("--truth", type=int, default=100, help="vertices along each side")
    reading.add_argument("--steps", type=int, default=240)
    reading.add_argument("--picture", type=Path)
    reading.add_argument("--folder", type=Path, default=Path("build/adaptive"), help="for what runs end as")
    asked = reading.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    steps = {"steps": asked.steps}
    truth = measured({"resolution": asked.truth} | steps, asked.folder / "truth.npz")
    print(
        f"truth: {truth['vertices']} vertices, {truth['time']:.1f} s, elastic {truth['elastic']:.4f} J",
        flush=True,
    )
    print(f"{'':16s} vertices  time [s]  distance [mm]  outline [%]  elastic [of the truth's]  bending [J]")
    curves: dict[str, list[tuple[float, float]]] = {}
    for name, values in RUNS.items():
        found = measured(values | steps, asked.folder / f"{name.replace(', ', '-').replace(' ', '-')}.npz")
        off = errors(found, truth, scenes.get("drape").view)
        print(
            f"{name:16s} {found['vertices']:8d} {found['time']:9.2f} {1000 * off['distance']:14.2f} "
            f"{100 * off['outline']:12.1f} {found['elastic'] / truth['elastic']:25.2f} {found['bending']:12.5f}",
            flush=True,
        )
        curves.setdefault(name.split()[0].rstrip(","), []).append((found["time"], off["distance"]))
    if asked.picture:
        lines = {name: tuple(np.array(sorted(points)).T) for name, points in curves.items()}
        labels = ("processor time", "mean distance", "s", "m")
        title = f"drape after {asked.steps} steps, against {asked.truth} x {asked.truth}"
        write_png(asked.picture, line_plot(lines, title, *labels, log_x=True, log_y=True, markers=True))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        worker(json.loads(sys.argv[2]), sys.argv[3])
    else:
        main()
