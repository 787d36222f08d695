"""Results that show themselves in a notebook: verdicts, runs, films, a view to turn. Text where there is no browser."""

from __future__ import annotations

import base64
import contextlib
import io
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.templates import filled
from muslin.simulation.runs import RunFolder
from muslin.student import checking
from muslin.student.checking import Report
from muslin.student.workspace import Workspace

if TYPE_CHECKING:
    from muslin.simulation.marching import Run

#: Files that show themselves, and what they are.
DRAWN = {".png": "image/png", ".webp": "image/webp", ".gif": "image/gif", ".mp4": "video/mp4"}

#: Size of pictures in a cell [pixels].
STILL = (640, 360)

#: Most frames in a view to turn: each costs some 12 bytes a vertex in the notebook.
MOST_FRAMES = 60

_COLOURS = {
    checking.GREEN: "#1a7f4b",
    checking.WRONG: "#b3261e",
    checking.TODO: "#8a6d00",
    checking.ERROR: "#b3261e",
}
_MARKS = {
    checking.GREEN: "ok",
    checking.WRONG: "not yet",
    checking.TODO: "to do",
    checking.ERROR: "does not run",
}


@dataclass(frozen=True)
class Verdicts:
    """What the check says of some tasks."""

    workspace: Workspace
    reports: list[Report]

    @property
    def green(self) -> int:
        """How many are right."""
        return sum(report.status == checking.GREEN for report in self.reports)

    def __repr__(self) -> str:
        width = max((len(report.task) for report in self.reports), default=0)
        lines = [line for report in self.reports for line in checking.told(self.workspace, report, width)]
        return "\n".join([*lines, f"{self.green} of {len(self.reports)} agree with the reference data."])

    def _repr_html_(self) -> str:
        told = []
        for report in self.reports:
            rows = []
            if report.status in (checking.WRONG, checking.ERROR):
                rows = [
                    ("likely", report.mistake),
                    ("try", report.advice),
                    *(("look", note) for note in report.notes),
                ]
                at = f" --case {report.case}" if report.case is not None else ""
                rows.append(("more", f"%muslin explain {report.task}{at}   or   %muslin hint {report.task}"))
            rows = [row for row in rows if row[1]]
            told.append(
                {
                    "task": report.task,
                    "status": report.status,
                    "lines": report.message.split("\n"),
                    "rows": rows,
                }
            )
        return filled("notebook/verdicts", reports=told, green=self.green, colours=_COLOURS, marks=_MARKS)


@dataclass(frozen=True)
class Drawn:
    """A picture or film on disk."""

    path: Path

    def __repr__(self) -> str:
        return paths.shown(self.path)

    def _repr_html_(self) -> str:
        template = "video" if self.path.suffix == ".mp4" else "picture"
        return filled(f"notebook/{template}", source=_data(self.path.read_bytes(), DRAWN[self.path.suffix]))


@dataclass(frozen=True)
class Page:
    """A page of its own inside a cell."""

    page: str
    title: str
    height: int = 480

    def __repr__(self) -> str:
        return f"({self.title}: shown where there is a browser)"

    def _repr_html_(self) -> str:
        return filled("notebook/page", page=self.page, title=self.title, height=self.height)


def run_html(run: Run) -> str:
    """A run in a cell: what it was, where its energy is, how it ended."""
    last = run.energies[-1]
    rows = [
        (f"{name} [J]", f"{last[kind]:.4g}")
        for name, kind in run.scene.energy_names.items()
        if name != "total"
    ]
    rows.append(("in contact", f"{last['contacts']} vertices"))
    if run.folder is not None:
        rows.append(("written to", paths.shown(run.folder)))
    pictures = [_data(_png(picture), DRAWN[".png"]) for picture in _pictures(run)]
    return filled(
        "notebook/run", title=run.scene.title, time=f"{last['time']:.2f}", steps=last["step"], vertices=len(run.x),
        rows=rows, pictures=pictures,
    )  # fmt: skip


def film(
    run: Run | Path | str, quality: str = "draft", size: tuple[int, int] = (960, 540), **options: Any
) -> Drawn:
    """Film a run that was written to disk, to be shown in a cell.

    Parameters
    ----------
    run : Run or path
    quality, size, **options
        As for `muslin.present.pictures.render_run`.

    Raises
    ------
    MuslinError
        If the run was not written to disk: give `muslin.simulate` an `out`.
    """
    from muslin.present import pictures as show

    folder = _written(run)
    written = show.render_run(folder, film="mp4", quality=quality, size=size, **options)
    return Drawn(written[-1])


def view(run: Run | Path | str, height: int = 480) -> Page:
    """A run as a film to turn and zoom, in a cell; it needs no server and stays in the saved notebook.

    Parameters
    ----------
    run : Run or path
        One that was written to disk.
    height : int
        [pixels]

    Raises
    ------
    MuslinError
        If the run was not written to disk, or viser is not installed.
    """
    from muslin.present.pictures import Show
    from muslin.viewer import browser

    viser = browser.require()
    show = Show(RunFolder(_written(run)))
    count = len(show.times)
    frames = np.unique(np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(int))
    surfaces, times = [show.surfaces(int(k)) for k in frames], show.times[frames]
    with contextlib.redirect_stdout(io.StringIO()):  # it tells where it listens; nobody is to go there
        return Page(_recorded(viser, surfaces, times, show.camera(0)), "The run, to turn and zoom", height)


def _recorded(viser: Any, surfaces: list[list[Any]], times: np.ndarray, camera: Any) -> str:
    """The surfaces of frames, the cloth first, as a page that plays them."""
    from muslin.render.materials import srgb_bytes
    from muslin.viewer import scenery

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        scene = server.scene
        scene.set_up_direction("+y")
        scene.configure_default_lights(enabled=True, cast_shadow=True)
        server.initial_camera.position, server.initial_camera.look_at = camera.eye, camera.target
        cloth, *others = surfaces[0]
        things = [scene.add_mesh_simple(
            "/cloth", np.asarray(cloth.vertices, np.float32), np.asarray(cloth.triangles, np.uint32),
            color=srgb_bytes(scenery.CLOTH_COLOUR), side="double",
        )]  # fmt: skip
        for number, body in enumerate(others):
            things.append(scene.add_mesh_simple(
                f"/body{number}", np.asarray(body.vertices, np.float32), np.asarray(body.triangles, np.uint32),
                color=srgb_bytes(scenery.BODY_COLOUR),
            ))  # fmt: skip
        serializer = server.get_scene_serializer()
        for k in range(1, len(surfaces)):
            serializer.insert_sleep(float(times[k] - times[k - 1]))
            for thing, before, after in zip(things, surfaces[k - 1], surfaces[k], strict=True):
                if not np.array_equal(before.vertices, after.vertices):
                    thing.vertices = np.asarray(after.vertices, np.float32)
        serializer.insert_sleep(0.5)
        return serializer.as_html()
    finally:
        server.stop()


def _written(run: Run | Path | str) -> Path:
    folder = run if isinstance(run, (Path, str)) else run.folder
    if folder is None:
        raise MuslinError(
            "The run was not written to disk.", 'Simulate with out="runs/...", then film or view it.'
        )
    return Path(folder)


def _pictures(run: Run) -> Iterator[np.ndarray]:
    """A draft of how it ended, or of the scene's best moment where that was written; the energies and the momenta."""
    from muslin import render
    from muslin.present.pictures import BACK, Show
    from muslin.render import stage

    if run.folder is not None:
        show = Show(RunFolder(run.folder), size=STILL, quality="draft")
        still = run.scene.still
        yield show.still(len(show.times) - 1 if still is None else int(np.argmin(np.abs(show.times - still))))
    else:
        material = replace(render.CLOTH, back=BACK)
        cloth = render.Surface(run.x, run.mesh.triangles, material, stage.pattern(run.mesh.vertices))
        yield render.draw([cloth], render.fit_camera(run.x, run.scene.view, STILL), STILL, "draft")
    if len(run.energies) > 1:
        energies = {name: run.energies[column] for name, column in run.scene.energy_names.items()}
        yield render.plot_energies(energies, run.energies["time"], title="Energy", size=STILL)
        table = {name: run.energies[name] for name in run.energies.dtype.names}
        yield from render.plot_momenta(table, run.energies["time"], size=STILL)


def _png(picture: np.ndarray) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG")
    return stream.getvalue()


def _data(content: bytes, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
