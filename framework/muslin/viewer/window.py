"""A session's face in a window of its own: Taichi GGUI.  It draws with Vulkan; everything is computed on the CPU."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base import runtime
from muslin.render.materials import srgb, srgb_bytes
from muslin.viewer import scenery
from muslin.viewer.actions import ACTIONS
from muslin.viewer.session import Session

SIZE = (1280, 720)

#: Radians that the camera turns for a drag across the whole window.
TURN = 4.0


def run(session: Session, say: Callable[[str], None] = print) -> None:
    """Show a session until its window is closed, or Ctrl-C."""
    panels = Path(
        "imgui.ini"
    ).absolute()  # Taichi keeps its panels' places where one stands: that is not ours
    kept = panels.exists()
    face = Face(session)
    say(f"{session.scene.title}: drag the cloth to pull it, drag beside it to turn the view, Escape closes.")
    last = time.perf_counter()
    try:
        while face.window.running and not face.closed:
            now = time.perf_counter()
            face.listen()
            session.advance(now - last)
            last = now
            face.draw()
            face.window.show()
    except KeyboardInterrupt:
        say("Closed.")
    finally:
        face.window.destroy()
        if not kept:
            panels.unlink(missing_ok=True)


class Face:
    """The window: what is drawn in it, and what comes back.

    Parameters
    ----------
    session : Session
    size : (width, height)
        [pixels]
    shown : bool
        On the screen; off-screen otherwise.
    """

    def __init__(self, session: Session, size: tuple[int, int] = SIZE, shown: bool = True):
        self.ti = ti = runtime.start()
        self.session, self.size, self.closed = session, size, False
        self.window = ti.ui.Window("Muslin", size, vsync=True, show_window=shown)
        self.canvas, self.scene, self.lens = self.window.get_canvas(), self.window.get_scene(), ti.ui.Camera()
        self.home = scenery.Orbit(scenery.camera(session, size))
        self.orbit, self._resets = self.home, session.camera_resets
        self._cursor: tuple[float, float] | None = None
        self._turning = ""
        self._fields: dict[str, Any] = {}
        self._triangles = session.triangles
        self.cloth = self._mesh("cloth", session.x, session.triangles)
        floor = scenery.ground(session)
        self.floor = None if floor is None else self._mesh("ground", *floor)

    # What people do ------------------------------------------------------------------------------------------

    def listen(self) -> None:
        """Take keys and mouse since the last frame."""
        ti, window = self.ti, self.window
        keys = {ti.ui.SPACE if a.key == "space" else a.key: a for a in ACTIONS}
        while window.get_event():
            pressed = window.event.type == ti.ui.PRESS
            key = window.event.key
            if pressed and key == ti.ui.ESCAPE:
                self.closed = True
            elif pressed and key in keys:
                keys[key].do(self.session)
            elif key in (ti.ui.LMB, ti.ui.RMB):
                self._button("left" if key == ti.ui.LMB else "right", pressed)
        self.point(window.get_cursor_pos())

    def _button(self, which: str, pressed: bool) -> None:
        if not pressed:
            self.session.release()
            self._turning = ""
            return
        vertex = None
        if which == "left":
            across, upward = self.window.get_cursor_pos()
            vertex = self.session.pick(self.orbit.camera.eye, self._ray(across, upward))
        if vertex is None:
            self._turning = "nearer" if which == "right" else "turn"
        else:
            self.session.grab(vertex)

    def point(self, cursor: tuple[float, float]) -> None:
        """The mouse is at a place in the window, 0 to 1 from the lower left corner."""
        before, self._cursor = self._cursor or cursor, cursor
        right, up = cursor[0] - before[0], cursor[1] - before[1]
        if self.session.grabbed is not None:
            camera = self.orbit.camera
            self.session.drag_along(camera.eye, self._ray(*cursor), np.subtract(camera.target, camera.eye))
        elif self._turning == "turn":
            self.orbit = self.orbit.turned(TURN * right, -TURN / 2 * up)
        elif self._turning == "nearer":
            self.orbit = self.orbit.nearer(float(np.exp(-3 * up)))

    def _ray(self, across: float, upward: float) -> np.ndarray:
        return self.orbit.ray(across, upward, self.size[0] / self.size[1])

    # What is drawn -------------------------------------------------------------------------------------------

    def draw(self) -> None:
        """Draw a frame; the caller shows it, or reads it."""
        session, scene = self.session, self.scene
        if self._resets != session.camera_resets:
            self._resets, self.orbit = session.camera_resets, self.home
        camera = self.orbit.camera
        self.lens.position(*camera.eye)
        self.lens.lookat(*camera.target)
        self.lens.up(*camera.up)
        self.lens.fov(camera.fov)
        self.lens.z_near(camera.near)
        scene.set_camera(self.lens)
        scene.ambient_light((0.45, 0.45, 0.45))
        away = np.asarray(camera.target) + 4 * (np.asarray(session.scene.view) * (1, 0, 1) + (0.8, 2.5, 0.0))
        scene.point_light(pos=tuple(away.tolist()), color=(0.65, 0.65, 0.65))
        self._draw_cloth()
        if self.floor is not None:
            scene.mesh(*self.floor, color=_shade(scenery.GROUND_COLOUR), two_sided=True)
        if session.sphere:
            there = session.colliders(session.state.time)
            if self._fields.get("there") != (there, tuple(session.origin)):
                self._fields["there"] = (there, tuple(session.origin))
                self.bodies = self._mesh("bodies", *scenery.bodies(session))
            scene.mesh(*self.bodies, color=_shade(scenery.BODY_COLOUR))
        if (pull := session.pull) is not None:
            ends = self._filled("hand", pull)
            scene.lines(ends, width=2.0, color=_shade(scenery.HAND_COLOUR))
            scene.particles(ends, radius=0.01, color=_shade(scenery.HAND_COLOUR))
        self.canvas.set_background_color((1.0, 1.0, 1.0))
        self.canvas.scene(scene)
        self._draw_panel()

    def _draw_cloth(self) -> None:
        session, reach = self.session, None
        if session.triangles is not self._triangles:  # the mesh has been adapted
            self._triangles = session.triangles
            self.cloth = self._mesh("cloth", session.x, session.triangles)
        vertices = self._filled("cloth", session.x)
        if session.strain:
            values, reach = scenery.strain(session)
            colours = self._filled("colours", srgb(scenery.strain_light(values, reach)))
            self.scene.mesh(vertices, self.cloth[1], two_sided=True, per_vertex_color=colours)
        else:
            self.scene.mesh(vertices, self.cloth[1], color=_shade(scenery.CLOTH_COLOUR), two_sided=True)
        if session.wireframe:
            self.scene.mesh(vertices, self.cloth[1], color=_shade(scenery.LINE_COLOUR), show_wireframe=True)
        self._reach = reach

    def _draw_panel(self) -> None:
        session, gui = self.session, self.window.get_gui()
        with gui.sub_window("Muslin", 0.01, 0.02, 0.26, 0.5):
            gui.text(session.clock())
            gui.text(f"{session.contacts} vertices touch a body")
            if self._reach is not None:
                gui.text(f"stretch: blue {1 - self._reach:g}, red {1 + self._reach:g}")
            for line in _wrapped(session.message):
                gui.text(line, color=(0.9, 0.3, 0.2))
            for action in ACTIONS:
                label = f"{action.name} ({action.key})"
                if action.switch:
                    setattr(session, action.switch, gui.checkbox(label, getattr(session, action.switch)))
                elif gui.button(label):
                    action.do(session)
            for line in session.credits():
                for part in _wrapped(line):
                    gui.text(part)

    def _mesh(self, name: str, vertices: np.ndarray, triangles: np.ndarray) -> tuple[Any, Any]:
        indices = self.ti.field(self.ti.i32, shape=triangles.size)
        indices.from_numpy(triangles.astype(np.int32).ravel())
        return self._filled(name, vertices), indices

    def _filled(self, name: str, values: np.ndarray) -> Any:
        """A field of that name with these vectors in it."""
        field = self._fields.get(name)
        if field is None or field.shape != (len(values),):
            field = self._fields[name] = self.ti.Vector.field(3, self.ti.f32, shape=len(values))
        field.from_numpy(np.ascontiguousarray(values, np.float32))
        return field


def _shade(colour: str) -> tuple[float, float, float]:
    r, g, b = srgb_bytes(colour)
    return (r / 255, g / 255, b / 255)


def _wrapped(text: str, width: int = 44) -> list[str]:
    import textwrap

    return textwrap.wrap(text, width)
