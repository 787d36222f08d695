"""A bar is wound up by its ends and let go."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from muslin.simulation.scenes.scene import Vec
from muslin.simulation.scenes.solid import SolidScene


@dataclass(frozen=True)
class Twist(SolidScene):
    """A bar that starts twisted about its long axis, its left end held."""

    turns: float = 1.0


def wound(scene: Any, mesh: Any) -> np.ndarray:
    """Start twisted: every section is turned by its share of `turns`."""
    X = mesh.vertices
    low, high = X[:, 0].min(), X[:, 0].max()
    angle = 2 * np.pi * scene.turns * (X[:, 0] - low) / (high - low)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([X[:, 0], c * X[:, 1] - s * X[:, 2], s * X[:, 1] + c * X[:, 2]], axis=1)


wound.reads = ()  # type: ignore[attr-defined]

_NOWHERE: Vec = (0.0, 0.0, 0.0)

SCENE = Twist(
    name="twist",
    title="A bar, wound up and let go",
    mesh="bar",
    resolution=5,
    length=1.2,
    thickness=0.24,
    size=1.2,
    pinned="left:0",
    E=1e5,
    nu=0.4,
    gravity=_NOWHERE,
    dt=1 / 240,
    steps=240,
    frame_every=4,
    view=(0.35, 0.25, 1.0),
    still=0.0,
    start=wound,
)
