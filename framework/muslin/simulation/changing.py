"""The meshes of an adaptive cloth on disk: a file for each frame whose mesh is not that of the frame before."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from muslin.mesh import Refinement

if TYPE_CHECKING:
    from muslin.simulation.adapting import Adapter

#: What a refinement is made of, in a checkpoint.
PARTS = ("triangles", "generation", "parents", "children", "born", "across")

#: Columns of `adapting.csv`: when, how large the mesh is then, and by how much the energies changed [J].
COLUMNS = ("time", "vertices", "triangles", "kinetic", "elastic", "gravity")


def save(folder: Path, step: int, adapter: Adapter) -> dict[str, np.ndarray]:
    """Write a frame's mesh, if it is another than the last, and the log; returns what a checkpoint needs."""
    place = folder / "meshes"
    place.mkdir(exist_ok=True)
    mesh, body = adapter.refined, adapter.model.body
    there = sorted(place.glob("[0-9]*.npz"))
    if not there or not np.array_equal(_read(there[-1])[1], mesh.triangles):
        np.savez(place / f"{step:06d}.npz", allow_pickle=False, X=body.X, triangles=mesh.triangles)
    with (folder / "adapting.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(
            [repr(value) if isinstance(value, float) else value for value in row] for row in adapter.log
        )
    refined = {f"refined_{name}": np.asarray(getattr(mesh, name)) for name in PARTS}
    return refined | {"refined_log": np.array(adapter.log, dtype=float).reshape(-1, len(COLUMNS))}


def load(checkpoint: Path) -> tuple[Refinement, list[tuple[float, ...]]]:
    """The refinement of a checkpoint, and the log up to it."""
    with np.load(checkpoint) as saved:
        refined = Refinement(**{name: saved[f"refined_{name}"] for name in PARTS})
        rows = saved["refined_log"].tolist()
    return refined, [(row[0], int(row[1]), int(row[2]), *row[3:]) for row in rows]


def at(folder: Path, frame: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Undeformed vertices and triangles of the frame of a step; None where the mesh never changes."""
    there = [file for file in sorted((folder / "meshes").glob("[0-9]*.npz")) if int(file.stem) <= frame]
    return _read(there[-1]) if there else None


def _read(file: Path) -> tuple[np.ndarray, np.ndarray]:
    with np.load(file) as mesh:
        return mesh["X"], mesh["triangles"]
