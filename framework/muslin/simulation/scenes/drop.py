"""The bear of jelly falls onto a sphere, and from there to the floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.simulation.scenes.solid import FRONT, SolidScene


def lifted(scene: Any, mesh: Any) -> np.ndarray:
    """Start undeformed, moved by `scene.start_at`."""
    return np.asarray(mesh.vertices + np.asarray(scene.start_at))


lifted.reads = ("start_at",)  # type: ignore[attr-defined]

SCENE = SolidScene(
    name="drop",
    title="A bear of jelly falls onto a sphere and the floor",
    mesh="creature",
    size=1.075,
    E=2e5,
    nu=0.4,
    rho=1000.0,
    dt=1 / 240,
    steps=480,
    frame_every=4,
    sphere=True,
    sphere_center=(0.0, 0.2, 0.0),
    sphere_radius=0.3,
    start_at=(0.08, 0.75, 0.03),
    ground=-0.1,
    floor=True,
    view=FRONT,
    still=0.6,
    start=lifted,
)
