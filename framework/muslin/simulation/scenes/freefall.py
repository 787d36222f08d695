"""Free fall is free: a curled, stretched cloth and the same cloth at rest fall side by side.

Nothing but gravity acts, so the centre of mass of each must fall exactly as a stone integrated with the same
steps would, and the cloth at rest must stay at rest in its own frame.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.mesh import Mesh
from muslin.simulation.scenes.scene import Scene


@dataclass(frozen=True)
class FreeFall(Scene):
    """Free fall; `cloths` chooses which of the two fall."""

    cloths: str = "both"

    def scaled(self, mesh: Any) -> Any:
        """A mesh at the scene's `scale`, twice where both cloths fall."""
        mesh = super().scaled(mesh)
        if self.cloths not in ("both", "curled", "rest"):
            raise MuslinError(f"cloths = {self.cloths!r} is not understood.", "Write both, curled or rest.")
        if self.cloths != "both":
            return mesh
        aside = np.array([1.3 * np.ptp(mesh.vertices[:, 0]), 0.0, 0.0])
        vertices = np.concatenate([mesh.vertices - aside / 2, mesh.vertices + aside / 2])
        triangles = np.concatenate([mesh.triangles, mesh.triangles + len(mesh.vertices)])
        both = Mesh.from_arrays(vertices, triangles, name=mesh.name)
        numbers = mesh.numbers
        if numbers is not None:  # the second cloth's go on where the first's end
            numbers = np.concatenate([numbers, numbers + numbers[-1] + 1])
        return replace(both, notices=mesh.notices, numbers=numbers, scale=mesh.scale)


def curled(scene: FreeFall, mesh: Mesh) -> np.ndarray:
    """Roll the first cloth up around the y axis and stretch it along; leave the second as it is."""
    x = mesh.vertices.copy()
    n = {"both": len(x) // 2, "curled": len(x), "rest": 0}[scene.cloths]
    if n:
        first = x[:n]
        middle = (first.min(axis=0) + first.max(axis=0)) / 2
        along, up, across = (first - middle).T
        radius = 0.25 * np.ptp(along)
        x[:n] = middle + np.stack(
            [radius * np.sin(along / radius), 1.2 * up, radius * (1 - np.cos(along / radius)) + across],
            axis=1,
        )
    return x


curled.reads = ()  # type: ignore[attr-defined]

SCENE = FreeFall(
    name="freefall",
    title="A curled cloth and a cloth at rest in free fall",
    mesh="course-square",
    E=1e5,
    nu=0.4,
    plane="strain",
    dt=1 / 240,
    steps=120,
    frame_every=4,
    fps=30,
    view=(0.3, 0.2, 1.0),
    start=curled,
)
