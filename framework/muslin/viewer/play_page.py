"""A `Play` in a browser: corners to pull, forces and principal directions as arrows, and every number beside."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.base.templates import filled
from muslin.render.materials import srgb_bytes
from muslin.viewer.play import POSES, Play, begin
from muslin.viewer.serving import FPS, Served, show

#: Whose arrows and numbers have which colour.
COLOURS = {"yours": "#c04a35", "framework": "#2f6fb0"}
REST, DIRECTIONS, MODE = "#8d949e", "#2a8c5a", "#8a4fbf"

HELP = (
    "Drag a corner; drag beside the cell to turn the view. Grey: undeformed. Green: principal directions, as long as "
    "their stretches. Arrows: forces; yours and Muslin's, where they differ. Hold the mouse over a number to see it in "
    "full, over a control to see what it is for."
)

#: Label of a control -> what it is for, shown where the mouse is held over it.
LABELS = {
    "Deform it": "Puts the corners where F is simple: at rest, turned, stretched, sheared, or pressed together.",
    "Wrong case": "A public case that one of your functions gets wrong: the cell as it is there.",
    "Gap of s0, s1: 10^": (
        "Two principal stretches that differ by ten to this power; at the far left by nothing. Formulas that divide by "
        "their difference fail on the way there."
    ),
    "Show mode": (
        "A mode is an eigenvector of the energy's Hessian: a way in which all corners move together, shown as violet "
        "arrows. They count as in the list of modes below; those with a negative number are what projection takes out."
    ),
}
DEFORM, WRONG, APART, MODES = LABELS

#: Entry of a list that chooses nothing.
NONE = "none"


def play(
    what: str | None = None,
    functions: Path | str | None = None,
    case: str | None = None,
    *,
    port: int = 8080,
    open_page: bool = True,
    say: Callable[[str], None] = print,
    running: Callable[[], bool] = lambda: True,
    **material: float,
) -> None:
    """Show one triangle or tetrahedron in the browser, to pull at, until Ctrl-C.

    Parameters
    ----------
    what, functions, case
        See `muslin.viewer.play.begin`.
    port, open_page, say, running
        See `muslin.viewer.serving.show`.
    **material
        mu, lam [Pa].
    """
    if functions is not None:
        say(
            "Compiling your functions, and looking which public cases they get wrong: up to half a minute ..."
        )
    made = begin(what, functions, case, **material)
    show(PlayPage(made, port), "One cell to pull at", open_page, say, running)


class PlayPage(Served):
    """The page of a play."""

    def __init__(self, made: Play, port: int = 8080):
        super().__init__(port)
        self.play = made
        self.mode = 0
        self._drawn: Any = None
        self._cases = {f"{task}, case {number}": (task, number) for task, number in made.failing()}
        self._set_the_scene()
        self._add_the_panel()

    def loop(self, running: Callable[[], bool] = lambda: True) -> None:
        """Take commands, and send what they changed."""
        while running():
            self.obey(until=time.perf_counter() + 1 / FPS)
            self.send()

    # The scene -----------------------------------------------------------------------------------------------

    def _set_the_scene(self) -> None:
        scene, cell = self.server.scene, self.play.cell
        scene.set_up_direction("+y")
        scene.world_axes.visible = False
        scene.configure_environment_map("warehouse", environment_intensity=0.6)
        camera = self.server.initial_camera
        camera.position, camera.look_at = (1.2, 0.7, 2.5), (0.3, 0.0, -0.1)  # left of the panel
        k = len(cell.X)
        self.faces = np.array([[0, 1, 2]] if k == 3 else [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
        self.edges = np.array([(i, j) for i in range(k) for j in range(i)])
        self.sheet = scene.add_mesh_simple(
            "/cell", *self._surface(), color=(224, 170, 150), side="double", opacity=0.55, cast_shadow=False
        )
        self.outline = self._lines("/outline", "#4a2a22", 2.5)
        self.rest = self._lines("/rest", REST, 1.5)
        self.directions = self._lines("/directions", DIRECTIONS, 4.0)
        self.arrows = {whose: self._arrow(f"/forces/{whose}", colour) for whose, colour in COLOURS.items()}
        self.moving = self._arrow("/mode", MODE)
        self.corners = []
        for i in range(k):
            ball = scene.add_icosphere(
                f"/corner{i}", radius=0.035, color=(45, 45, 50), position=self._place(i)
            )
            ball.on_drag("left")(self._dragging(i))
            self.corners.append(ball)

    def _lines(self, name: str, colour: str, width: float) -> Any:
        return self.server.scene.add_line_segments(
            name,
            np.zeros((1, 2, 3), np.float32),
            srgb_bytes(colour),
            thickness=width,
            thickness_units="screen",
        )

    def _arrow(self, name: str, colour: str) -> Any:
        return self.server.scene.add_arrows(
            name, _arrows(np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]])), srgb_bytes(colour),
            shaft_radius=0.009, head_radius=0.024, head_length=0.06, visible=False,
        )  # fmt: skip

    def _dragging(self, corner: int) -> Any:
        held: dict[str, np.ndarray] = {}

        async def dragged(event: Any) -> None:
            start, now, phase = np.asarray(event.start_position), np.asarray(event.end_position), event.phase

            def move() -> None:
                if phase == "start" or "x" not in held:
                    held["x"] = self._shown(self.play.x[corner]) - start
                self.play.drag(corner, self._real(held["x"] + now))
                if phase == "end":
                    held.clear()

            self.commands.put(move)

        return dragged

    def _shown(self, x: np.ndarray) -> np.ndarray:
        """Positions as shown: a cell of a reference case lies anywhere and has any size."""
        return np.asarray((x - self.play.cell.X.mean(axis=0)) / self._size())

    def _real(self, shown: np.ndarray) -> np.ndarray:
        return np.asarray(shown * self._size() + self.play.cell.X.mean(axis=0))

    def _size(self) -> float:
        edges = self.play.cell.X[1:] - self.play.cell.X[0]
        return float(np.linalg.norm(edges, axis=1).max())

    def _place(self, corner: int) -> tuple[float, ...]:
        return tuple(self._shown(self.play.x[corner]).tolist())

    def _surface(self) -> tuple[np.ndarray, np.ndarray]:
        return self._shown(self.play.x).astype(np.float32), self.faces.astype(np.uint32)

    # The panel -----------------------------------------------------------------------------------------------

    def _add_the_panel(self) -> None:
        gui = self.server.gui
        gui.configure_theme(
            show_logo=False, show_share_button=False, brand_color=(192, 74, 53), control_width="large"
        )
        gui.add_markdown(HELP)
        self._chosen(gui.add_dropdown(DEFORM, [NONE, *POSES], hint=LABELS[DEFORM]), self._pose)
        if self._cases:
            self._chosen(gui.add_dropdown(WRONG, [NONE, *self._cases], hint=LABELS[WRONG]), self._case)
        slider = gui.add_slider(APART, min=-9.0, max=-0.5, step=0.5, initial_value=-0.5, hint=LABELS[APART])
        self._chosen(slider, lambda power: self.play.nearly_equal(0.0 if power == -9.0 else 10.0**power))
        modes = [NONE, *(str(k + 1) for k in range(self.play.x.size))]
        self._chosen(gui.add_dropdown(MODES, modes, hint=LABELS[MODES]), self._choose_mode)
        self.trouble = gui.add_markdown("", visible=False)
        self.numbers = gui.add_html("")

    def _chosen(self, control: Any, do: Callable[[Any], None]) -> None:
        async def asked(event: Any) -> None:
            if event.client is not None:  # not our own update
                value = event.target.value
                self.commands.put(lambda: self._try(do, value))

        control.on_update(asked)

    def _try(self, do: Callable[[Any], None], value: Any) -> None:
        try:
            do(value)
            said = ""
        except MuslinError as error:
            said = str(error)
        self.trouble.content, self.trouble.visible = said, bool(said)

    def _pose(self, name: str) -> None:
        if name != NONE:
            self.play.pose(name)

    def _case(self, name: str) -> None:
        if name != NONE:
            self.play.case(*self._cases[name])

    def _choose_mode(self, name: str) -> None:
        self.mode = 0 if name == NONE else int(name)
        self._drawn = None

    # What is sent --------------------------------------------------------------------------------------------

    def send(self) -> None:
        """Send what has changed."""
        play = self.play
        if self._drawn is play.x:
            return
        self._drawn = play.x
        x, X = self._shown(play.x), self._shown(play.cell.X)
        with self.server.atomic():
            self.sheet.vertices = x.astype(np.float32)
            self.outline.points, self.rest.points = _pairs(x, self.edges), _pairs(X, self.edges)
            for i, ball in enumerate(self.corners):
                ball.position = self._place(i)
            middle = x.mean(axis=0)
            along = play.cell.directions(play.x) / 4
            self.directions.points = np.stack([middle - along, middle + along], axis=1).astype(np.float32)
            self._show_forces(x)
            self._show_mode(x)
        rows = [row for row in play.rows if row.yours is not None or row.framework is not None or row.trouble]
        modes = {whose: values for whose, (values, _) in play.modes.items()}
        self.numbers.content = filled(
            "viewer/play_numbers", rows=rows, modes=modes, colours=COLOURS, trouble=play.trouble,
            has_yours=play.functions is not None, table=_table,
        )  # fmt: skip

    def _show_forces(self, x: np.ndarray) -> None:
        there = {whose: f for whose, f in self.play.forces.items() if np.isfinite(f).all()}
        if "yours" in there and not any(row.apart for row in self.play.rows if row.symbol == "f"):
            del there["framework"]  # it would lie in the other
        longest = max((float(np.linalg.norm(f, axis=1).max()) for f in there.values()), default=0.0)
        for whose, arrow in self.arrows.items():
            arrow.visible = whose in there and longest > 0
            if arrow.visible:
                seen = np.linalg.norm(there[whose], axis=1) > 1e-3 * longest
                arrow.points = _arrows(x, 0.4 * there[whose] / longest, seen)

    def _show_mode(self, x: np.ndarray) -> None:
        there = self.play.modes.get("yours") or self.play.modes.get("framework")
        self.moving.visible = bool(self.mode and there)
        if self.mode and there:
            self.moving.points = _arrows(x, 0.35 * there[1][:, self.mode - 1].reshape(-1, 3))


def _table(value: np.ndarray, columns: int = 0, scale: float = 0.0) -> list[list[tuple[str, str]]]:
    """Rows of a number, a vector (in one row, or in rows of `columns`) or a matrix: each number in full and short.

    What is next to nothing beside the largest of them, and beside `scale`, is rounding.
    """
    value = np.asarray(value)
    rows = value if value.ndim == 2 else value.reshape(-1, columns or value.size)
    size = max(float(np.abs(value).max(initial=0.0)), scale)
    return [[(repr(float(v)), f"{0.0 if abs(v) < ROUNDING * size else v:.4g}") for v in row] for row in rows]


#: Numbers below this share of the largest beside them, or of their scale, are shown as 0: they are rounding.
ROUNDING = 1e-13


def _pairs(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return x[edges].astype(np.float32)


def _arrows(tails: np.ndarray, ways: np.ndarray, seen: np.ndarray | None = None) -> np.ndarray:
    """Arrows from tails along ways (k, 3): (k, 2, 3); those not `seen` have next to no length."""
    ways = ways if seen is None else np.where(seen[:, None], ways, 1e-6)
    return np.stack([tails, tails + ways], axis=1).astype(np.float32)
