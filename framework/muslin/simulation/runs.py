"""A run on disk: plain files in one folder, usable after an interruption at any moment.

==================  =====================================================================================
`run.json`          scene, parameters, version: enough to repeat the run
`mesh.npz`          simulation mesh: vertices X (n, 3), triangles (m, 3), pinned (k,); numbers (n,) of the
                    vertices in their file, where some of that were left out; cells (m, 4) of a solid,
                    whose triangles are its surface
`display.npz`       display mesh, where there is one: vertices, triangles
`frames/000000.npy` positions at a frame, named by its step, (n, 3) float64 [m]; `display/` likewise
`meshes/000000.npz` of an adaptive cloth: X and triangles from this frame on, until the next such file
`adapting.csv`      of an adaptive cloth: one row per change of the mesh, and what it did to the energies
`energies.csv`      one row per step: kinetic, elastic, gravity energy [J], contacts, momentum; see `COLUMNS`
`checkpoint.npz`    last frame's state, to resume from
==================  =====================================================================================
"""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import itertools
import json
import os
import shutil
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from muslin import __version__
from muslin.base import engine, paths
from muslin.base.errors import MuslinError
from muslin.base.writing import write
from muslin.mesh import Mesh, Refinement, TetMesh
from muslin.mesh.tets import frozen_solid
from muslin.physics.body import Body
from muslin.simulation import changing, scenes
from muslin.simulation.model import State
from muslin.simulation.scenes import Scene
from muslin.simulation.touching import Pressed

if TYPE_CHECKING:
    from muslin.simulation.adapting import Adapter

#: Columns of the energy log: what, unit.
COLUMNS = {
    "step": "1",
    "time": "s",
    "kinetic": "J",
    "elastic": "J",
    "gravity": "J",  # and of the drag spring, while the mouse pulls
    "total": "J",
    "contacts": "1",
    "approach": "m/s",  # smallest n^T v of a vertex in contact, after the filter
    "penetration": "m",  # deepest vertex
    "px": "kg m/s",  # linear momentum
    "py": "kg m/s",
    "pz": "kg m/s",
    "lx": "kg m^2/s",  # angular momentum about the centre of mass
    "ly": "kg m^2/s",
    "lz": "kg m^2/s",
    "work": "J",  # that moving colliders, moving pins and the wind have done since the start, where it is known
}

#: Columns of runs written before momentum and work were logged: what they lack reads as nan.
OLDER = tuple(COLUMNS)[:9]


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

    def __init__(self, folder: Path | str, description: dict[str, Any]):
        self.folder = Path(folder)
        self.rows: list[tuple[float, ...]] = []
        self._log: TextIO | None = None
        with _writing(self.folder):
            _clear(self.folder)
            (self.folder / "frames").mkdir(parents=True)
            _write_json(
                self.folder / "run.json",
                {
                    "schema": 1,
                    "muslin": __version__,
                    "engine": f"{engine.chosen().name} {engine.version()}",
                    **description,
                },
            )

    @classmethod
    def resumed(cls, run: RunFolder, step: int, steps: int) -> Writer:
        """Go on writing a run from its checkpoint at `step`, now up to `steps`: what lies beyond is removed."""
        writer = cls.__new__(cls)
        writer.folder, writer._log = run.folder, None
        writer.rows = [tuple(row) for row in run.energies if row["step"] <= step]
        every = run.scene.frame_every
        with _writing(run.folder):
            description = run.description
            description["parameters"]["steps"] = steps
            _write_json(run.folder / "run.json", description)
            kinds = ("frames/*.npy", "display/*.npy", "meshes/*.npz")
            for frame in itertools.chain(*map(run.folder.glob, kinds)):
                if int(frame.stem) > step or (int(frame.stem) % every and steps > step):
                    frame.unlink()
        return writer

    def meshes(self, body: Body, pinned: np.ndarray, display: Mesh | None) -> None:
        """Save what does not move."""
        mesh = body.mesh
        with _writing(self.folder):
            fixed = {"X": mesh.vertices, "triangles": mesh.triangles, "pinned": pinned}
            if body.pattern.corners == 4:
                fixed["cells"] = body.cells
            if mesh.numbers is not None:
                fixed["numbers"] = mesh.numbers
            np.savez(self.folder / "mesh.npz", allow_pickle=False, **fixed)
            if display is not None:
                (self.folder / "display").mkdir(exist_ok=True)
                np.savez(self.folder / "display.npz", X=display.vertices, triangles=display.triangles)

    def row(self, values: Sequence[float]) -> None:
        """Append a row to the energy log."""
        self.rows.append(tuple(values))

    def frame(
        self, step: int, state: State, display: np.ndarray | None = None, adapter: Adapter | None = None
    ) -> None:
        """Save the energy log so far, a frame, and a checkpoint: in this order, each says that the last is there."""
        refined: dict[str, Any] = {}
        with _writing(self.folder):
            self._flush()
            if adapter is not None:
                refined = changing.save(self.folder, step, adapter)
            _save(self.folder / "frames" / f"{step:06d}.npy", state.x)
            if display is not None:
                _save(self.folder / "display" / f"{step:06d}.npy", display)
            partial = self.folder / "checkpoint.partial.npz"
            before: dict[str, Any] = (
                {} if state.before is None else {"x_before": state.before.x, "v_before": state.before.v}
            )
            here: dict[str, Any] = {
                "x": state.x,
                "v": state.v,
                "time": state.time,
                "step": step,
                "work": state.work,
                **{f"pressed_{name}": value for name, value in vars(state.pressed).items()},
            }
            np.savez(partial, **here, **before, **refined)
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
        with _writing(self.folder):
            self._flush()
            assert self._log is not None
            self._log.close()
            self._log = None


class RunFolder:
    """A run, read back. Frames are loaded one at a time.

    Raises
    ------
    MuslinError
        If the folder is not a run, has no frame yet, or lacks one that was written.
    """

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
        if not (self.folder / "run.json").is_file():
            raise MuslinError(
                f"{paths.shown(folder)} is not a run.",
                "A run is a folder written by: muslin simulate SCENE --out DIR",
            )
        with _reading(self.folder / "run.json") as path:
            self.description: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            self.scene: Scene = scenes.rebuilt(self.description)
        with _reading(self.folder / "mesh.npz") as path, np.load(path) as mesh:
            self.X, self.triangles = mesh["X"], mesh["triangles"]
            self.pinned = mesh["pinned" if "pinned" in mesh else "held"]  # so in older runs
            self.numbers, self.cells = mesh.get("numbers"), mesh.get("cells")
        self.rest, self.shown_triangles = self.X, self.triangles
        if (self.folder / "display.npz").is_file():
            with _reading(self.folder / "display.npz") as path, np.load(path) as display:
                self.rest, self.shown_triangles = display["X"], display["triangles"]
        if not self.look_again():
            raise MuslinError(f"The run {paths.shown(folder)} has no frames yet.")
        for kind in {"frames", self._shown}:
            self._all_there(kind)

    @property
    def solid(self) -> TetMesh | None:
        """The undeformed solid, where it is one that was simulated."""
        return None if self.cells is None else frozen_solid(self.X, self.cells, self.scene.name)

    @property
    def _shown(self) -> str:
        return "display" if (self.folder / "display.npz").is_file() else "frames"

    def _files(self, kind: str) -> list[Path]:
        return sorted((self.folder / kind).glob("[0-9]*.npy"))

    def _all_there(self, kind: str) -> None:
        """Refuse a run that lacks a frame up to its last one, or up to the one its checkpoint was written after."""
        saved = []
        with contextlib.suppress(MuslinError):  # a run can be shown without one
            saved = [self.checkpoint()[1]]  # asked first: a run may be being written
        there = {int(path.stem) for path in self._files(kind)}
        written = set(range(0, max([*there, *saved], default=0) + 1, self.scene.frame_every))
        if self.scene.steps in saved:  # the last one, which is written whatever its number
            written.add(self.scene.steps)
        if missing := sorted(written - there):
            lost = paths.shown(self.folder / kind / f"{missing[0]:06d}.npy")
            more = f", and {len(missing) - 1} more" if len(missing) > 1 else ""
            raise MuslinError(f"The frame {lost} is missing{more}.", "Simulate the run again.")

    def look_again(self) -> int:
        """Take in the frames of a run that is still being written; returns how many there are."""
        self._frames = self._files(self._shown)
        return len(self._frames)

    @property
    def times(self) -> np.ndarray:
        """Time of each frame, (k,) [s]."""
        return np.array([int(path.stem) for path in self._frames]) * self.scene.dt

    @property
    def frames(self) -> Sequence[np.ndarray]:
        """Positions (n, 3) of what is shown (the display mesh where there is one), frame by frame."""
        return _Lazy(self._frames, None if self.changes else self.rest.shape)

    @property
    def changes(self) -> bool:
        """Whether what is shown has another mesh in each frame."""
        return self.scene.adaptive and self._shown == "frames"

    def mesh_of(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """What is shown in frame k: undeformed vertices (n, 3) and triangles (m, 3)."""
        if not self.changes:
            return self.rest, self.shown_triangles
        with _reading(self.folder / "meshes"):
            found = changing.at(self.folder, int(self._frames[k].stem))
            if found is None:
                raise ValueError("no mesh")
            return found

    def refined(self) -> tuple[Refinement, list[tuple[float, ...]]]:
        """The refinement an adaptive cloth goes on from, and the log of its changes."""
        with _reading(self.folder / "checkpoint.npz") as path:
            return changing.load(path)

    @property
    def simulated(self) -> Sequence[np.ndarray]:
        """Positions of the simulation mesh, frame by frame."""
        return _Lazy(self._files("frames"), None if self.scene.adaptive else self.X.shape)

    @property
    def energies(self) -> np.recarray:
        """The energy log, with a row for each step up to the last frame at least."""
        with _reading(self.folder / "energies.csv") as path:
            whole, _, _ = path.read_bytes().decode().rpartition("\n")  # a line may be being written
            head, *rows = csv.reader(whole.splitlines()) if whole else [[]]
            if head not in (list(COLUMNS), list(OLDER)):
                raise ValueError("not the columns of an energy log")
            lacking = [float("nan")] * (len(COLUMNS) - len(head))
            table = as_table([[float(v) for v in row] + lacking for row in rows])
            if len(table) <= int(self._frames[-1].stem) or (table.step != np.arange(len(table))).any():
                raise ValueError("a step has no row")
            return table

    def checkpoint(self) -> tuple[State, int]:
        """Last state saved, and its step."""
        with _reading(self.folder / "checkpoint.npz") as path, np.load(path) as saved:
            state = State(saved["x"], saved["v"], float(saved["time"]))
            fits = state.x.shape == state.v.shape == self.X.shape or self.scene.adaptive
            if not fits:
                raise ValueError("of another mesh")
            if "work" in saved:  # in older runs there is neither
                state.work = float(saved["work"])
                names = [field.name for field in dataclasses.fields(Pressed)]
                state.pressed = Pressed(**{name: saved[f"pressed_{name}"] for name in names})
            if "x_before" in saved:
                state.before = State(saved["x_before"], saved["v_before"])
            return state, int(saved["step"])


class _Lazy(Sequence[np.ndarray]):
    def __init__(self, files: list[Path], shape: tuple[int, ...] | None):
        self._files, self._shape = files, shape

    def __len__(self) -> int:
        return len(self._files)

    def __getitem__(self, k: Any) -> Any:
        return [*map(self._frame, self._files[k])] if isinstance(k, slice) else self._frame(self._files[k])

    def __iter__(self) -> Iterator[np.ndarray]:
        return map(self._frame, self._files)

    def _frame(self, path: Path) -> np.ndarray:
        with _reading(path):
            x: np.ndarray = np.load(path, allow_pickle=False)
            if x.shape != (self._shape or x.shape) or x.dtype.kind != "f":
                raise ValueError("not the positions of this mesh")
            return x


@contextlib.contextmanager
def _reading(path: Path) -> Iterator[Path]:
    """Turn what can go wrong when a run's file is read into one message."""
    try:
        yield path
    except (OSError, ValueError, EOFError, KeyError, TypeError, csv.Error, zipfile.BadZipFile) as error:
        raise MuslinError(
            f"{paths.shown(path)} is missing or damaged ({type(error).__name__}).", "Simulate the run again."
        ) from None


@contextlib.contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Turn a full disk or a folder that refuses into one message."""
    try:
        yield
    except OSError as error:
        raise MuslinError(
            f"Cannot write to {paths.shown(folder)}: {error.strerror or error}.",
            "Name another place with --out.",
        ) from None


def _clear(folder: Path) -> None:
    """Remove an earlier run, but nothing that is not one."""
    if folder.is_dir() and any(folder.iterdir()):
        if not (folder / "run.json").is_file():
            raise MuslinError(
                f"{paths.shown(folder)} is not empty and not a run.", "Choose another --out folder."
            )
        with contextlib.suppress(OSError, ValueError, KeyError):  # pictures of the earlier run
            name = json.loads((folder / "run.json").read_text(encoding="utf-8"))["scene"]
            ours = (f"{name}.*", f"{name}-energies.png") if scenes.NAME.fullmatch(str(name)) else ()
            for picture in itertools.chain(*map(folder.glob, ours)):
                picture.unlink()
        for name in ("frames", "display", "meshes"):
            shutil.rmtree(folder / name, ignore_errors=True)
        for name in ("run.json", "mesh.npz", "display.npz", "energies.csv", "adapting.csv", "checkpoint.npz"):
            (folder / name).unlink(missing_ok=True)
    elif folder.exists() and not folder.is_dir():
        raise MuslinError(f"{paths.shown(folder)} is a file.", "Choose another --out folder.")


def _save(path: Path, array: np.ndarray) -> None:
    partial = path.with_suffix(".partial")
    with open(partial, "wb") as file:
        np.save(file, array)
    os.replace(partial, path)


def _write_json(path: Path, value: dict[str, Any]) -> None:
    write(path, f"{json.dumps(value, indent=1)}\n".encode())
