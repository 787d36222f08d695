"""A session's face in a browser: one loop takes commands, steps and sends, so that a hand waits for a step at most."""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.base.templates import filled
from muslin.export.animation import unit_normals
from muslin.render import stage
from muslin.render.materials import STRAIN_STOPS, srgb_bytes
from muslin.viewer import scenery
from muslin.viewer.actions import ACTIONS, Action
from muslin.viewer.serving import FPS, Served, require, show
from muslin.viewer.session import Session

__all__ = ["Face", "glb", "require", "run"]


def run(
    session: Session,
    port: int = 8080,
    open_page: bool = True,
    say: Callable[[str], None] = print,
    running: Callable[[], bool] = lambda: True,
) -> None:
    """Serve a session until Ctrl-C.

    Parameters
    ----------
    session : Session
    port : int
        Of the page; the next free one is taken.
    open_page : bool
        Open the page in this machine's browser.
    say : callable
        Told the address.
    running : callable
        Asked before every frame; False ends it.
    """
    show(Face(session, port), session.scene.title, open_page, say, running)


class Face(Served):
    """The page: what is sent to it, and what comes back."""

    def __init__(self, session: Session, port: int = 8080):
        super().__init__(port)
        self.session = session
        self._sent: dict[str, Any] = {}
        self._offset = np.zeros(3)
        self._resets = session.camera_resets
        self._said = 0.0
        self._set_the_scene()
        self._add_the_panel()

    def loop(self, running: Callable[[], bool] = lambda: True) -> None:
        """Take commands, step, send; until somebody sees the page, and while nobody does, time stands still."""
        last = time.perf_counter()
        while running():
            self.obey(until=last + 1 / FPS)
            now = time.perf_counter()
            if self.server.get_clients():
                if self.looked_at():
                    self.session.advance(now - last)
                self.show()
            last = now

    # The scene -----------------------------------------------------------------------------------------------

    def _set_the_scene(self) -> None:
        session, scene = self.session, self.server.scene
        scene.set_up_direction("+y")
        scene.world_axes.visible = False
        start = scenery.camera(session)
        camera = self.server.initial_camera
        camera.position, camera.look_at = start.eye, start.target
        camera.fov, camera.near = float(np.radians(start.fov)), start.near
        self._camera = start
        x, triangles = session.x.astype(np.float32), session.triangles
        scene.configure_environment_map("warehouse", environment_intensity=0.55)
        if session.scene.ground is not None:
            height = stage.ground_height(session.scene.ground)
            scene.add_grid(
                "/ground", plane="xz", position=(0.0, height, 0.0), infinite_grid=True,
                cell_size=0.1, section_size=0.5, cell_thickness=0.5, section_thickness=0.8, fade_distance=12.0,
                cell_color=(226, 227, 230), section_color=(204, 206, 211), shadow_opacity=0.25,
            )  # fmt: skip
        colour = srgb_bytes(scenery.CLOTH_COLOUR)
        self.cloth = scene.add_mesh_simple("/cloth", x, triangles, color=colour, side="double")
        self.strained = scene.add_glb("/strained", self._glb(), visible=False)
        colour = srgb_bytes(scenery.LINE_COLOUR)
        self.lines = scene.add_mesh_simple(
            "/lines", x, triangles, color=colour, wireframe=True, visible=False, cast_shadow=False, receive_shadow=False
        )  # fmt: skip
        colour = srgb_bytes(scenery.BODY_COLOUR)
        self.bodies = scene.add_mesh_simple("/bodies", *_some_mesh(*scenery.bodies(session)), color=colour)
        colour = srgb_bytes(scenery.HAND_COLOUR)
        self.hand = scene.add_line_segments(
            "/hand", np.zeros((1, 2, 3), np.float32), colour, thickness=3, thickness_units="screen", visible=False
        )  # fmt: skip
        size = 0.012 * float(np.ptp(session.start.x, axis=0).max())
        self.finger = scene.add_icosphere("/finger", radius=size, color=colour, visible=False)
        # What has strain colours is sent whole at every step, and would be lost from under the mouse: the hand always
        # takes the plain cloth, which is transparent meanwhile.
        self.cloth.on_drag("left")(self._dragged)

    async def _dragged(self, event: Any) -> None:
        # a coroutine: those are called in order
        start, now, phase = np.asarray(event.start_position), np.asarray(event.end_position), event.phase
        self.commands.put(lambda: self._drag(phase, start, now))

    def _drag(self, phase: str, start: np.ndarray, now: np.ndarray) -> None:
        session = self.session
        if phase == "start":
            session.grab(session.nearest(start))
        if session.pull is None:
            return
        if phase == "start":
            self._offset = session.pull[0] - start
        if phase == "end":
            session.release()
        else:
            session.drag_to(now + self._offset)

    # The panel -----------------------------------------------------------------------------------------------

    def _add_the_panel(self) -> None:
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(192, 74, 53))
        self.clock = gui.add_markdown("")
        self.trouble = gui.add_markdown("", visible=False)
        self.switches: dict[str, Any] = {}
        for action in ACTIONS:
            label = f"{action.name} ({action.key})"
            gui.add_command(
                label, hotkey=action.key if len(action.key) > 1 else action.key.upper()
            ).on_trigger(self._doing(action))
            if action.switch:
                switch = gui.add_checkbox(label, getattr(self.session, action.switch))
                switch.on_update(self._switching(action))
                self.switches[action.switch] = switch
            else:
                gui.add_button(label).on_click(self._doing(action))
        self.legend = gui.add_html("", visible=False)
        gui.add_markdown("Drag the cloth to pull it; drag beside it to turn the view; wheel: nearer.")
        if credits := self.session.credits():
            gui.add_markdown("\n\n".join(_plain(line) for line in credits))

    def _doing(self, action: Action) -> Any:
        async def asked(event: Any) -> None:
            self.commands.put(lambda: action.do(self.session))

        return asked

    def _switching(self, action: Action) -> Any:
        async def asked(event: Any) -> None:
            if event.client is not None:  # not our own update
                value = bool(event.target.value)
                self.commands.put(lambda: setattr(self.session, action.switch, value))

        return asked

    # What is sent --------------------------------------------------------------------------------------------

    def show(self) -> None:
        """Send what has changed."""
        session = self.session
        with self.server.atomic():
            if self._new("x", (session.steps, session.strain, session.wireframe, id(session.state))):
                if session.strain:
                    self.strained.glb_data = self._glb()
                self._place(self.cloth)
                if session.wireframe:
                    self._place(self.lines)
            if self._new("strain", session.strain):
                self.cloth.opacity = 0.0 if session.strain else None
            self._visible(self.strained, session.strain)
            self._visible(self.lines, session.wireframe)
            self._show_bodies()
            self._show_hand()
        self._visible(self.legend, session.strain)
        if self._new("legend", self._reach):
            ends = (1 - self._reach, 1, 1 + self._reach)
            self.legend.content = filled("viewer/legend", stops=STRAIN_STOPS, ends=ends)
        for name, switch in self.switches.items():
            if switch.value != getattr(session, name):
                switch.value = getattr(session, name)
        if self._resets != session.camera_resets:
            self._resets = session.camera_resets
            for client in self.server.get_clients().values():
                with client.atomic():
                    client.camera.position, client.camera.look_at = self._camera.eye, self._camera.target
        self._show_words()

    def _place(self, mesh: Any) -> None:
        """A mesh of the cloth where that is now, with the triangles that it has now."""
        session = self.session
        x, faces = session.x.astype(np.float32), session.triangles
        if len(mesh.faces) == len(faces) and np.array_equal(mesh.faces, faces):
            mesh.vertices = x
        elif len(x) >= len(mesh.vertices):  # at no time a triangle without its vertices
            mesh.vertices, mesh.faces = x, faces.astype(np.uint32)
        else:
            mesh.faces, mesh.vertices = faces.astype(np.uint32), x

    def _show_bodies(self) -> None:
        session = self.session
        there = session.colliders(session.state.time)
        self._visible(self.bodies, session.sphere)
        if session.sphere and self._new("bodies", (there, tuple(session.origin))):
            vertices, triangles = _some_mesh(*scenery.bodies(session))
            if len(self.bodies.faces) != len(triangles):
                self.bodies.faces = triangles
            self.bodies.vertices = vertices

    def _show_hand(self) -> None:
        pull = self.session.pull
        self._visible(self.hand, pull is not None)
        self._visible(self.finger, pull is not None)
        if pull is not None:
            self.hand.points = pull[None].astype(np.float32)
            self.finger.position = tuple(pull[0].tolist())

    def _show_words(self) -> None:
        session, now = self.session, time.perf_counter()
        if self._new("trouble", session.message):
            self.trouble.content = f"**{_plain(session.message)}**"
            self.trouble.visible = bool(session.message)
        if now - self._said > 0.25 or self._sent.get("playing") != session.playing:
            self._said = now
            self._sent["playing"] = session.playing
            words = f"**{session.clock()}**\n\n{session.contacts} vertices touch a body"
            if self._new("clock", words):
                self.clock.content = words

    def _glb(self) -> bytes:
        values, self._reach = scenery.strain(self.session)
        return glb(self.session.x, self.session.triangles, scenery.strain_light(values, self._reach))

    def _visible(self, thing: Any, wanted: bool) -> None:
        if thing.visible != wanted:
            thing.visible = wanted

    def _new(self, name: str, value: Any) -> bool:
        """Whether this is another value than the last one of that name."""
        if name in self._sent and self._sent[name] == value:
            return False
        self._sent[name] = value
        return True


def _some_mesh(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh for viser, which wants at least one triangle."""
    if len(triangles) == 0:
        return np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32)
    return vertices.astype(np.float32), triangles.astype(np.uint32)


def _plain(text: str) -> str:
    """Text that Markdown leaves alone."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]<>()#+-!|~$" else c for c in text)


def glb(vertices: np.ndarray, triangles: np.ndarray, colours: np.ndarray) -> bytes:
    """A mesh with a colour for each vertex as binary glTF 2.0, which is what viser takes such a mesh in.

    Parameters
    ----------
    vertices : (n, 3) array [m]
    triangles : (m, 3) int array
    colours : (n, 3) array
        Linear light.
    """
    arrays = [
        vertices.astype("<f4"),
        unit_normals(vertices, triangles).astype("<f4"),
        colours.astype("<f4"),
        triangles.astype("<u4").reshape(-1, 1),
    ]
    kinds = ["VEC3", "VEC3", "VEC3", "SCALAR"]
    data = b"".join(a.tobytes() for a in arrays)
    starts = np.cumsum([0, *(a.nbytes for a in arrays)]).tolist()
    accessors: list[dict[str, Any]] = [
        {"bufferView": k, "componentType": 5126 if k < 3 else 5125, "count": len(a), "type": kinds[k]}
        for k, a in enumerate(arrays)
    ]
    accessors[0] |= {"min": arrays[0].min(axis=0).tolist(), "max": arrays[0].max(axis=0).tolist()}
    head = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": starts[k], "byteLength": a.nbytes} for k, a in enumerate(arrays)
        ],
        "accessors": accessors,
        "materials": [
            {"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9}}
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2},
                        "indices": 3,
                        "material": 0,
                    }
                ]
            }
        ],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    parts = (
        struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(parts)) + parts
