"""A run on disk: plain files in one folder, usable after an interruption at any moment.

==================  =====================================================================================
`run.json`          scene, parameters, versions: enough to repeat the run
`mesh.npz`          simulation mesh: vertices X (n, 3), triangles (m, 3), held (k,)
`display.npz`       display mesh, where there is one: vertices, triangles
`frames/00000.npy`  positions at each frame, (n, 3) float64 [m]; `display/` likewise
`energies.csv`      one row per step: kinetic, elastic, gravity energy [J], contacts
`checkpoint.npz`    last frame's state, to resume from
==================  =====================================================================================
"""

from __future__ import annotations

import csv
import json
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from muslin import __version__, paths, scenes
from muslin.errors import MuslinError
from muslin.integrators import State
from muslin.mesh import Mesh
from muslin.scenes import Scene

#: Columns of the energy log: what, unit.
COLUMNS = {
    "step": "1",
    "time": "s",
    "kinetic": "J",
    "elastic": "J",
    "gravity": "J",
    "contacts": "1",
    "approach": "m/s",  # smallest n^T v of a vertex in contact, after the filter
    "penetration": "m",  # deepest vertex
}


def as_table(rows: Sequence[Sequence[float]]) -> np.recarray:
    """Energy log as a table: `table["kinetic"]` or `table.kinetic`, one row per step."""
    kinds = [(name, np.int64 if name in ("step", "contacts") else np.float64) for name in COLUMNS]
    return np.array([tuple(row) for row in rows], dtype=kinds).view(np.recarray)


class Writer:
    """Writes a run, frame by frame; everything is on disk when `frame` returns.

    Raises
    ------
    MuslinError
        If the folder holds something that is not a run, or cannot be written.
    """

    def __init__(self, folder: Path | str, description: dict[str, Any], resume: bool = False):
        self.folder = Path(folder)
        self.rows: list[tuple[float, ...]] = []
        self._log: TextIO | None = None
        try:
            if not resume:
                _clear(self.folder)
                (self.folder / "frames").mkdir(parents=True)
                _write_json(self.folder / "run.json", {"schema": 1, "muslin": __version__, **description})
        except OSError as error:
            raise MuslinError(f"Cannot write to {paths.shown(folder)}: {error.strerror}.") from None

    def meshes(self, mesh: Mesh, held: np.ndarray, display: Mesh | None) -> None:
        """Save what does not move."""
        np.savez(self.folder / "mesh.npz", X=mesh.vertices, triangles=mesh.triangles, held=held)
        if display is not None:
            (self.folder / "display").mkdir(exist_ok=True)
            np.savez(self.folder / "display.npz", X=display.vertices, triangles=display.triangles)

    def row(self, values: Sequence[float]) -> None:
        """Append a row to the energy log."""
        self.rows.append(tuple(values))

    def frame(self, number: int, step: int, state: State, display: np.ndarray | None = None) -> None:
        """Save a frame, the energy log so far, and a checkpoint."""
        _save(self.folder / "frames" / f"{number:05d}.npy", state.x)
        if display is not None:
            _save(self.folder / "display" / f"{number:05d}.npy", display)
        self._flush()
        partial = self.folder / "checkpoint.partial.npz"
        np.savez(partial, x=state.x, v=state.v, time=state.time, step=step, frame=number)
        os.replace(partial, self.folder / "checkpoint.npz")

    def _flush(self) -> None:
        fresh = self._log is None
        if self._log is None:
            self._log = (self.folder / "energies.csv").open("w", newline="", encoding="utf-8")
        writer = csv.writer(self._log)
        if fresh:
            writer.writerow(COLUMNS)
            self._written = 0
        for row in self.rows[self._written :]:
            writer.writerow(
                [
                    int(v) if name in ("step", "contacts") else repr(float(v))
                    for name, v in zip(COLUMNS, row, strict=True)
                ]
            )
        self._written = len(self.rows)
        self._log.flush()

    def close(self) -> None:
        """Write what is left of the energy log."""
        self._flush()
        assert self._log is not None
        self._log.close()
        self._log = None


class RunFolder:
    """A run, read back. Frames are loaded one at a time.

    Raises
    ------
    MuslinError
        If the folder is not a run, or has no frame yet.
    """

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        try:
            self.description: dict[str, Any] = json.loads(
                (self.folder / "run.json").read_text(encoding="utf-8")
            )
            mesh = np.load(self.folder / "mesh.npz")
        except (OSError, ValueError):
            raise MuslinError(
                f"{paths.shown(folder)} is not a run.",
                "A run is a folder written by: muslin simulate SCENE --out DIR",
            ) from None
        self.X, self.triangles, self.held = mesh["X"], mesh["triangles"], mesh["held"]
        self._frames = sorted((self.folder / "frames").glob("[0-9]*.npy"))
        self.rest, self.shown_triangles = self.X, self.triangles
        if (self.folder / "display.npz").is_file():
            display = np.load(self.folder / "display.npz")
            self.rest, self.shown_triangles = display["X"], display["triangles"]
            self._frames = sorted((self.folder / "display").glob("[0-9]*.npy"))
        if not self._frames:
            raise MuslinError(f"The run {paths.shown(folder)} has no frames yet.")

    @property
    def scene(self) -> Scene:
        """The scene as it was simulated."""
        return scenes.get(self.description["scene"], **self.description["parameters"])

    @property
    def times(self) -> np.ndarray:
        """Time of each frame, (k,) [s]."""
        scene = self.scene
        numbers = np.array([int(path.stem) for path in self._frames])
        return np.minimum(numbers * scene.frame_every, scene.steps) * scene.dt

    @property
    def frames(self) -> Sequence[np.ndarray]:
        """Positions (n, 3) of what is shown (the display mesh where there is one), frame by frame."""
        return _Lazy(self._frames)

    @property
    def simulated(self) -> Sequence[np.ndarray]:
        """Positions of the simulation mesh, frame by frame."""
        return _Lazy(sorted((self.folder / "frames").glob("[0-9]*.npy")))

    @property
    def energies(self) -> np.recarray:
        """The energy log."""
        with open(self.folder / "energies.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))[1:]
        return as_table([[float(v) for v in row] for row in rows if len(row) == len(COLUMNS)])

    def checkpoint(self) -> tuple[State, int, int]:
        """Last state saved, its step, and its frame.

        Raises
        ------
        MuslinError
            If there is none.
        """
        try:
            saved = np.load(self.folder / "checkpoint.npz")
        except (OSError, ValueError):
            raise MuslinError(f"{paths.shown(self.folder)} has no checkpoint to resume from.") from None
        return State(saved["x"], saved["v"], float(saved["time"])), int(saved["step"]), int(saved["frame"])


class _Lazy(Sequence[np.ndarray]):
    def __init__(self, files: list[Path]):
        self._files = files

    def __len__(self) -> int:
        return len(self._files)

    def __getitem__(self, k: Any) -> Any:
        return [np.load(f) for f in self._files[k]] if isinstance(k, slice) else np.load(self._files[k])

    def __iter__(self) -> Iterator[np.ndarray]:
        return (np.load(f) for f in self._files)


def _clear(folder: Path) -> None:
    """Remove an earlier run, but nothing that is not one."""
    if folder.is_dir() and any(folder.iterdir()):
        if not (folder / "run.json").is_file():
            raise MuslinError(
                f"{paths.shown(folder)} is not empty and not a run.", "Choose another --out folder."
            )
        for name in ("frames", "display"):
            shutil.rmtree(folder / name, ignore_errors=True)
        for name in ("run.json", "mesh.npz", "display.npz", "energies.csv", "checkpoint.npz"):
            (folder / name).unlink(missing_ok=True)
    elif folder.exists() and not folder.is_dir():
        raise MuslinError(f"{paths.shown(folder)} is a file.", "Choose another --out folder.")


def _save(path: Path, array: np.ndarray) -> None:
    partial = path.with_suffix(".partial")
    with open(partial, "wb") as file:
        np.save(file, array)
    os.replace(partial, path)


def _write_json(path: Path, value: dict[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
