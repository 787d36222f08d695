"""How much of its outline a draped cloth shares with the same cloth on another mesh.

    python tests/benchmarks/silhouettes.py [--time 0.65] [--set key=value ...]

`drape` at its still, seen as its pictures see it, on grids of 64x64 and 128x128 vertices and on an unstructured mesh of
triangles as large as the coarse grid's: the area that both outlines cover, of the area that either does.
"""

from __future__ import annotations

import argparse

import numpy as np
from PIL import Image, ImageDraw

import muslin
from muslin.mesh import Mesh, unstructured
from muslin.simulation import scenes

#: Pixels along each side of a picture, and how wide that is [m].
SIZE, WIDTH = 1000, 1.6


def outline(x: np.ndarray, triangles: np.ndarray, view: tuple[float, float, float]) -> np.ndarray:
    """Which pixels a cloth covers, seen from far away, (SIZE, SIZE) bool."""
    towards = np.asarray(view) / np.linalg.norm(view)
    right = np.cross([0.0, 1.0, 0.0], towards)
    right /= np.linalg.norm(right)
    seen = x @ np.stack([right, np.cross(towards, right)], axis=1) * SIZE / WIDTH + SIZE / 2
    picture = Image.new("1", (SIZE, SIZE))
    draw = ImageDraw.Draw(picture)
    for corners in seen[triangles]:
        draw.polygon([*map(tuple, corners.tolist())], fill=1)
    return np.asarray(picture)


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """Area covered by both, of that covered by either."""
    return float((a & b).sum() / (a | b).sum())


def main() -> None:
    """Simulate on each mesh, and print the overlaps with the first."""
    reading = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    reading.add_argument("--time", type=float, default=0.65)
    reading.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    asked = reading.parse_args()
    scene = scenes.get("drape", **dict(word.split("=", 1) for word in asked.set))
    spacing = 1 / 63
    meshes: dict[str, Mesh | None] = {
        "64x64": None,
        "unstructured, 1/63 m": unstructured(1, 1, spacing),
        "128x128": None,
    }
    first = None
    for name, mesh in meshes.items():
        size = int(name.split("x")[0]) if mesh is None else 0
        changed = scenes.override(scene, **({"resolution": size} if size else {}))
        run = muslin.simulate(changed, mesh=mesh, steps=round(asked.time / scene.dt))
        seen = outline(run.x, run.mesh.triangles, scene.view)
        first = seen if first is None else first
        print(f"{name:22s} {overlap(first, seen):.3f}   energy {run.energies.total[-1]:.3f} J", flush=True)


if __name__ == "__main__":
    main()
