"""Whether an adaptive cloth is nearer to the truth than a uniform one in the same time: error against time.

    python tests/benchmarks/adaptive.py [drape] [cape] [--steps 480] [--pictures FOLDER]

A scene as `muslin demo` has it (contact in the system, friction, bending), adaptive with several budgets and uniform
with several sizes, against a uniform cloth as fine as is feasible, three levels finer than the one adaptive cloth
begins with. Two more cloths as fine say how well the truth is known: one with a vertex more along each side, and an
unstructured one, a second truth of another family. What is as near as they are cannot be told from it. Each run has
its own process and one thread, and its time is the processor's, without what is compiled. The errors, at the end of
the run: the mean distance of the two surfaces (both ways), the part of the two outlines that is not common, and elastic
and bending energy as a share of the truth's.
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

#: Of each scene: parameters, vertices along a side of uniform cloths, of the one adaptive cloth begins with, its levels
#: (a cape's arms are as thin as the triangles of the third), and steps.
SCENES: dict[str, tuple[dict[str, Any], tuple[int, ...], int, int, int]] = {
    "drape": ({"ground": -0.3}, (20, 32, 48, 64), 20, 2, 480),
    "cape": ({}, (11, 17, 26, 40), 11, 3, 240),
}
ADAPTIVE = {"adaptive": "on"}
BUDGETS = (1000, 2000, 4000)


def cloth(scene: str, size: int, family: str) -> dict[str, Any]:
    """What makes a scene's cloth one of about so many vertices along a side: a grid, or unstructured."""
    import muslin
    from muslin.mesh import grid, unstructured

    free = (2 / 3**0.5) ** 0.5  # spacing of equilateral triangles, one vertex in a square of side 1
    if scene == "drape":
        return {"resolution": size} if family == "grid" else {"mesh": unstructured(1.0, 1.0, free / size)}
    from muslin.simulation import scenes

    X = scenes.get("cape").load_mesh().vertices  # a sector of a ring
    radius, angle = np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])
    long = np.ptp(radius) / ((radius.max() + radius.min()) / 2 * np.ptp(angle))
    nx, ny = max(2, round(size * long**0.5)), round(size / long**0.5)
    flat = grid(nx, ny, diagonals="zigzag") if family == "grid" else unstructured(nx - 1.0, ny - 1.0, free)
    s, t = ((side - side.min()) / np.ptp(side) for side in flat.vertices[:, :2].T)
    r, phi = radius.min() + s * np.ptp(radius), angle.min() + t * np.ptp(angle)
    return {
        "mesh": muslin.Mesh.from_arrays(np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1), flat.triangles)
    }


def worker(scene: str, size: int, asked: dict[str, Any], file: str) -> None:
    """One run: what it ended as into a file, and its processor time to standard output."""
    import muslin
    from muslin.simulation.adapting import Adapter

    spent, adapt = [0.0], Adapter.adapt

    def timed(self: Any, state: Any) -> Any:
        began = time.process_time()
        out = adapt(self, state)
        spent[0] += time.process_time() - began
        return out

    Adapter.adapt = timed  # type: ignore[method-assign]
    asked = SCENES[scene][0] | cloth(scene, size, asked.pop("family", "grid")) | asked
    at_once = {"start_at": "0.003,0.302,0.005"} if scene == "drape" else {}
    muslin.simulate(scene, **(asked | at_once | {"steps": 8}))  # compiles
    spent[0], began = 0.0, time.process_time()
    run = muslin.simulate(scene, **asked)
    whole = time.process_time() - began
    body = run.body
    body.update(run.x)
    bent = body.bending.energy() if body.bending else 0.0
    np.savez(file, x=run.x, triangles=body.cells)
    elastic = float(run.energies.elastic[-1])
    found = {"time": whole, "adapting": spent[0], "vertices": len(run.x), "elastic": elastic, "bending": bent}
    print(json.dumps(found))


def measured(scene: str, size: int, asked: dict[str, Any], file: Path) -> dict[str, Any]:
    """The same in a process of its own."""
    alone = {name: "1" for name in ("MUSLIN_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}
    command = [sys.executable, __file__, "--worker", scene, str(size), json.dumps(asked), str(file)]
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
    """Run all, print tables and draw the curves."""
    reading = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    reading.add_argument("scenes", nargs="*", help=f"of {', '.join(SCENES)}; default: all")
    reading.add_argument("--steps", type=int, help="default: each scene's")
    reading.add_argument("--pictures", type=Path, help="where to draw adaptive-SCENE.png")
    reading.add_argument("--folder", type=Path, default=Path("build/adaptive"), help="for what runs end as")
    asked = reading.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    for scene in asked.scenes or SCENES:
        compared(scene, asked.steps or SCENES[scene][4], asked.folder, asked.pictures)


def compared(scene: str, count: int, folder: Path, pictures: Path | None) -> None:
    """One scene: its table, and its curves into a folder of pictures."""
    from muslin.render.picture import write_png
    from muslin.render.plot import line_plot
    from muslin.simulation import scenes

    steps, (_, sizes, begun, levels, _) = {"steps": count}, SCENES[scene]
    finest = 5 * begun  # three levels: the square root of 27
    truth = measured(scene, finest, steps, folder / f"{scene}-truth.npz")
    second = measured(scene, finest, steps | {"family": "unstructured"}, folder / f"{scene}-second.npz")
    view = scenes.get(scene).view
    apart = errors(second, truth, view)
    runs = [("truth, one more", finest + 1, {})]
    runs += [(f"uniform {size}", size, {}) for size in sizes]
    runs += [
        (f"adaptive, {budget}", begun, ADAPTIVE | {"levels": levels, "budget": budget}) for budget in BUDGETS
    ]
    print(f"{scene}, {count} steps, truth: {truth['vertices']} vertices, {truth['time']:.1f} s, ", end="")
    print(f"elastic {truth['elastic']:.4f} J, bending {truth['bending']:.5f} J", flush=True)
    print(
        f"second truth: {second['vertices']} vertices, {second['time']:.1f} s, {1000 * apart['distance']:.2f} mm "
        f"from it, outline {100 * apart['outline']:.1f} %, elastic {second['elastic'] / truth['elastic']:.2f}, "
        f"bending {second['bending'] / truth['bending']:.2f} of its",
        flush=True,
    )
    print(
        f"{'':16s} vertices  time [s]  adapting [%]  distance [mm]  from the second  outline [%]  elastic  bending"
    )
    curves: dict[str, list[tuple[float, float]]] = {}
    for name, size, values in runs:
        file = folder / f"{scene}-{name.replace(', ', '-').replace(' ', '-')}.npz"
        found = measured(scene, size, values | steps, file)
        off, too = errors(found, truth, view), errors(found, second, view)
        print(
            f"{name:16s} {found['vertices']:8d} {found['time']:9.2f} "
            f"{100 * found['adapting'] / (found['time'] - found['adapting']):13.1f} {1000 * off['distance']:14.2f} "
            f"{1000 * too['distance']:16.2f} "
            f"{100 * off['outline']:12.1f} {found['elastic'] / truth['elastic']:8.2f} "
            f"{found['bending'] / truth['bending']:8.2f}",
            flush=True,
        )
        curves.setdefault(name.split()[0].rstrip(","), []).append((found["time"], off["distance"]))
    if pictures:
        (end, known), least = curves.pop("truth")[0], min(t for line in curves.values() for t, _ in line)
        lines = {name: tuple(np.array(sorted(points)).T) for name, points in curves.items()}
        lines["the truth's own"] = np.array([least, end]), np.array([known, known])
        labels = ("processor time", "mean distance", "s", "m")
        title = f"{scene} after {count} steps, against {truth['vertices']} vertices"
        picture = line_plot(lines, title, *labels, log_x=True, log_y=True, markers=True)
        write_png(pictures / f"adaptive-{scene}.png", picture)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        worker(sys.argv[2], int(sys.argv[3]), json.loads(sys.argv[4]), sys.argv[5])
    else:
        main()
