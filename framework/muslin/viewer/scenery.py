"""What a session looks like, as plain arrays: colours, bodies, ground, where the camera stands and turns to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from muslin import render
from muslin.physics.colliders import Capsule, Plane, Sphere
from muslin.present.strain import solid_strain, vertex_strain
from muslin.render import stage
from muslin.render.materials import strain_position, strain_table
from muslin.viewer.session import Session

CLOTH_COLOUR = "#c04a35"
BODY_COLOUR = "#9ca7b3"
GROUND_COLOUR = "#dcdde0"
LINE_COLOUR = "#3a1d17"
HAND_COLOUR = "#f2b134"

#: Ends of the strain map, as a distance from 1: the smallest that holds nearly all of the cloth is taken.
REACHES = (0.02, 0.05, 0.1, 0.2, 0.5, 0.95)


def strain(session: Session) -> tuple[np.ndarray, float]:
    """Principal stretch furthest from 1 at each vertex, (n,) [1], and the reach of a map that shows it."""
    body, x = session.model.body, session.state.x
    of_cells = solid_strain if body.cells.shape[1] == 4 else vertex_strain
    values = of_cells(body.X, x, body.cells)
    most = float(np.quantile(np.abs(values - 1), 0.98))
    return values, next((reach for reach in REACHES if reach >= most), REACHES[-1])


def strain_light(values: np.ndarray, reach: float) -> np.ndarray:
    """Strain colours as linear light, (n, 3) float32: blue below 1, white at 1, red above."""
    table = strain_table(256)
    return table[np.rint(strain_position(values, 1 - reach, 1 + reach) * 255).astype(int)]


def bodies(session: Session) -> tuple[np.ndarray, np.ndarray]:
    """Everything the cloth can bump into but the floor, as one mesh: vertices (k, 3) as shown, triangles (l, 3)."""
    vertices: list[np.ndarray] = [np.zeros((0, 3))]
    triangles: list[np.ndarray] = [np.zeros((0, 3), dtype=np.int64)]
    count, body = 0, session.model.body
    longest = stage.longest_edge(body.X, body.surface)
    for collider in session.colliders(session.state.time):
        if isinstance(collider, Plane):
            continue
        assert isinstance(collider, (Sphere, Capsule))
        fineness = {"rings": 10} if isinstance(collider, Capsule) else {}
        radius = stage.drawn_radius(collider, session.scene.contact, longest)
        surface = stage.collider_surface(collider, radius, **fineness)
        vertices.append(np.asarray(surface.vertices))
        triangles.append(np.asarray(surface.triangles) + count)
        count += len(vertices[-1])
    return np.concatenate(vertices) - session.origin, np.concatenate(triangles)


def ground(session: Session) -> tuple[np.ndarray, np.ndarray] | None:
    """The ground as a disc: vertices (k, 3), triangles (l, 3); None where the scene has none."""
    if session.scene.ground is None:
        return None
    middle = session.start.x.mean(axis=0)
    angle = np.linspace(0, 2 * np.pi, 97)[:-1]
    rim = np.stack([np.cos(angle), np.zeros(96), np.sin(angle)], axis=1) * 2.5 * _size(session)
    centre = np.array([middle[0], stage.ground_height(session.scene.ground), middle[2]])
    k = np.arange(96)
    return np.concatenate([[centre], centre + rim]), np.stack(
        [np.zeros_like(k), 1 + (k + 1) % 96, 1 + k], axis=1
    )


def camera(session: Session, size: tuple[int, int] = (1280, 720)) -> render.Camera:
    """The camera to begin with: it sees the cloth, what it falls onto and where it will hang."""
    x = session.start.x
    points = [
        x,
        *(
            stage.collider_corners(c)
            for c in session.scene.colliders(session.scene, 0.0)
            if not isinstance(c, Plane)
        ),
    ]
    if session.scene.ground is not None:
        points.append(np.where([False, True, False], session.scene.ground, x))
    elif len(session.model.pinned):
        points.append(x[session.model.pinned].mean(axis=0) - [[0.0, 0.9 * _size(session), 0.0]])
    return render.fit_camera(np.concatenate(points), session.scene.view, size, margin=0.3)  # beside the panel


def _size(session: Session) -> float:
    return float(np.ptp(session.start.x, axis=0).max())


@dataclass(frozen=True)
class Orbit:
    """A camera that is turned around its target by dragging, for a face without one of its own."""

    camera: render.Camera

    def turned(self, right: float, up: float) -> Orbit:
        """Turned by angles [rad] about the vertical and the horizontal, never over the top."""
        camera = self.camera
        arm = np.subtract(camera.eye, camera.target)
        length = float(np.linalg.norm(arm))
        azimuth = np.arctan2(arm[0], arm[2]) - right
        elevation = np.clip(np.arcsin(arm[1] / length) + up, -1.5, 1.5)
        level = np.cos(elevation)
        arm = length * np.array([level * np.sin(azimuth), np.sin(elevation), level * np.cos(azimuth)])
        return self._at(np.asarray(camera.target) + arm)

    def nearer(self, factor: float) -> Orbit:
        """At another distance from the target: `factor` times as far."""
        arm = np.subtract(self.camera.eye, self.camera.target)
        length = float(np.linalg.norm(arm))
        return self._at(np.asarray(self.camera.target) + arm * np.clip(factor * length, 0.05, 500) / length)

    def ray(self, across: float, upward: float, aspect: float) -> np.ndarray:
        """Direction of the ray through a place in the picture (0 to 1 from the lower left corner), (3,)."""
        right, above, forward = self.camera.axes()
        half = np.tan(np.radians(self.camera.fov) / 2)
        return forward + half * ((2 * across - 1) * aspect * right + (2 * upward - 1) * above)

    def _at(self, eye: np.ndarray) -> Orbit:
        x, y, z = eye.tolist()
        return Orbit(replace(self.camera, eye=(x, y, z), up=(0.0, 1.0, 0.0)))
