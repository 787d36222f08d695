"""A run filmed while it is simulated.

Both need Taichi, and two of its kernels cannot run side by side in one process: the pictures are drawn by a
process of their own, which reads the frames from the run's folder as they are written. It is a plain child
that speaks JSON lines, so that no caller needs a `__main__` guard, and it cannot outlive its parent: when its
input ends, so does the film.

    parent                                     child
      the order ─────────────────────────────►   draws the scene's start, compiling what it needs
                 ◄─────────── first (or error)
      ready: the first frame is written ─────►   draws frames as they appear
                 ◄─────────── frame 1, 2, ...
      ended: no more frames will come ───────►   draws the rest
                 ◄─────────── written
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.child import Child, python
from muslin.base.errors import MuslinError
from muslin.physics.skinning import bind
from muslin.simulation import scenes
from muslin.simulation.scenes import Scene

Point = tuple[float, float, float]


class Filming:
    """Films a run while it is simulated, to be used in a `with` statement around the simulation.

        with Filming(scene, folder, base, around=corners) as filming:
            simulate(scene, out=folder, on_step=filming.on_step)
            written = filming.finish()

    Leaving the block without `finish`, by an error or by Ctrl-C, closes the film with the frames it has.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    folder : path
        Where the run is being written.
    base : path
        Path of the film and the still without their endings.
    around : (k, 3) points
        What the camera must see [m]: where the cloth will go.
    quality : {"draft", "good", "best"}
    size : (width, height)
    every : int
        Film only every so many frames, at as many fewer frames per second.
    on_first : callable, optional
        Called, by another thread, with the path of the first picture; the still replaces it in the end.

    Raises
    ------
    MuslinError
        From `on_step` and `finish`, if filming fails.
    """

    def __init__(
        self,
        scene: Scene,
        folder: Path,
        base: Path,
        *,
        around: Sequence[Point],
        quality: str = "good",
        size: tuple[int, int] = (1280, 720),
        every: int = 1,
        on_first: Callable[[Path], Any] | None = None,
    ):
        self._order = {
            "scene": scene.name, "parameters": scene.parameters(), "folder": str(Path(folder).resolve()),
            "base": str(Path(base).resolve()), "around": np.asarray(around).tolist(),
            "quality": quality, "size": tuple(size), "every": every,
        }  # fmt: skip
        self._on_first = on_first
        self._child: Child | None = None
        self._said: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._ready = False
        self.written: list[Path] = []

    def __enter__(self) -> Filming:
        environment = os.environ | {
            "OPENBLAS_NUM_THREADS": "1"
        }  # nothing here needs it, and its threads spin
        with contextlib.suppress(OSError, ValueError):  # no child: the film is made afterwards
            self._child = Child(python("muslin.present.film:work"), environment)
            threading.Thread(target=self._listen, args=(self._child,), daemon=True).start()
        self._tell(self._order)
        return self

    def __exit__(self, *_: Any) -> None:
        if self._child is not None:
            self._child.said_all()
            self._child.wait(30)
            self._child.close()
            self._child = None

    def on_step(self, step: int, steps: int) -> None:
        """Tell that a step has been taken; the run's first frame is written before the first one."""
        if not self._ready:
            self._ready = True
            self._tell("ready")
        while not self._said.empty():
            self._hear(self._said.get())

    def finish(self, on_frame: Callable[[int, int], Any] | None = None) -> list[Path]:
        """Draw what is left to draw; returns the files written.

        Parameters
        ----------
        on_frame : callable, optional
            Called as (frame, frames).
        """
        if not self._ready:
            self._tell("ready")
        self._tell("ended")
        while self._child is not None and not self.written:
            message = self._said.get()
            if on_frame and "frame" in message and "frames" in message:
                on_frame(message["frame"], message["frames"])
            self._hear(message)
        if not self.written:  # there is no child, or it died without a word
            self.written = _film(self._order, lambda: "ended", lambda **_: None)
        return self.written

    def _hear(self, message: dict[str, Any]) -> None:
        if "error" in message:
            raise MuslinError(message["error"], message["hint"])
        if "written" in message:
            self.written = [Path(path) for path in message["written"]]
        if "gone" in message:
            self._child = None

    def _tell(self, message: Any) -> None:
        if self._child is not None:  # should it have died, `_listen` says so
            self._child.say(json.dumps(message).encode() + b"\n")

    def _listen(self, child: Child) -> None:
        with contextlib.suppress(ValueError):
            while line := child.line():
                message = json.loads(line)
                if "first" in message and self._on_first:  # at once: the simulation may not have begun
                    self._on_first(Path(message["first"]))
                self._said.put(message)
        self._said.put({"gone": True})


def work() -> None:
    """The child: take an order from standard input, and film."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # Taichi prints to descriptor 1

    def tell(**message: Any) -> None:
        replies.write(json.dumps(message) + "\n")
        replies.flush()

    order = json.loads(sys.stdin.readline())
    heard = ["waiting"]

    def listen() -> None:
        for line in sys.stdin:
            heard.append(json.loads(line))
        heard.append("stopped" if heard[-1] != "ended" else "ended")

    threading.Thread(target=listen, daemon=True).start()
    try:
        _film(order, lambda: heard[-1], tell)
    except MuslinError as error:
        tell(error=error.message, hint=error.hint)
    except BrokenPipeError:  # nobody listens any more
        pass


@dataclass
class _Opening:
    """A run that has not begun, with the scene's start as its only frame."""

    scene: Scene
    X: np.ndarray
    triangles: np.ndarray
    frames: list[np.ndarray]
    times: np.ndarray
    cells: np.ndarray | None = None
    pinned: np.ndarray = field(default_factory=lambda: np.empty(0, np.int32))

    @property
    def rest(self) -> np.ndarray:
        """As a run's."""
        return self.X

    def mesh_of(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """As a run's."""
        return self.X, self.triangles


def _opening(scene: Scene) -> _Opening:
    mesh = scene.load_mesh()
    start, shown, cells = scene.start(scene, mesh), scene.skin(mesh), getattr(mesh, "cells", None)
    if shown is None:
        held = scene.pinned_vertices(mesh)
        return _Opening(scene, mesh.vertices, mesh.triangles, [start], np.zeros(1), cells, held)
    there = bind(shown, mesh).carry(start)
    return _Opening(scene, shown.vertices, shown.triangles, [there], np.zeros(1), cells)


def _film(order: dict[str, Any], heard: Callable[[], str], tell: Callable[..., Any]) -> list[Path]:
    """Film the frames of a run as they appear; returns the files written.

    Parameters
    ----------
    order : dict
        What `Filming` was asked for.
    heard : callable
        The last word from the simulation: waiting, ready, ended, or stopped.
    tell : callable
        Takes messages as keywords.
    """
    from muslin import render
    from muslin.present.naming import beside
    from muslin.present.pictures import Show, energy_plot
    from muslin.simulation.runs import RunFolder

    base, every = Path(order["base"]), order["every"]
    scene = scenes.get(order["scene"], **order["parameters"])

    def show_of(run: Any) -> Show:
        return Show(run, order["size"], order["quality"], around=np.asarray(order["around"]))

    still = render.write_png(beside(base, ".png"), show_of(_opening(scene)).picture(0))
    tell(first=str(still))
    while heard() == "waiting":
        time.sleep(0.01)
    if heard() == "stopped":
        return []
    run = RunFolder(order["folder"])
    show = show_of(run)
    target, best = beside(base, ".mp4"), (np.inf, 0)
    picture = None
    with render.Movie(target, show.size, max(1, scene.fps // every)) as movie:
        k = 0
        while True:
            if heard() == "stopped":
                return []
            ended = heard() == "ended"  # asked before looking: what is not there then will never come
            if k >= run.look_again():
                if ended:
                    break
                time.sleep(0.01)
                continue
            image = show.picture(k)
            movie.add(image)
            off = -k if scene.still is None else abs(run.times[k] - scene.still)
            if (off, k) < best:
                best, picture = (off, k), image
            tell(frame=k // every + 1, frames=1 + (len(run.times) - 1) // every)
            k += every
    assert picture is not None  # a run has frames
    written = [render.write_png(still, picture), *energy_plot(run, base), target]
    tell(written=[str(path) for path in written])
    return written
