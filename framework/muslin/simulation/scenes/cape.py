"""A cape in motion: its collar rides on the shoulders of a figure of capsules that walks and turns in the wind.

The pattern is a flat sector of a ring; rolled up isometrically into a cone around the neck it starts without
strain. (The lecture opens with a cape.)
"""

from dataclasses import dataclass

import numpy as np

from muslin.mesh import Mesh
from muslin.physics.colliders import Capsule, Collider, Plane
from muslin.simulation.scenes.scene import Scene


@dataclass(frozen=True)
class Cape(Scene):
    """Cape on a walking figure."""

    walk_speed: float = 1.2
    turn_rate: float = 0.9
    turn_period: float = 3.0
    stride: float = 0.35
    spread: float = 0.85


HIP, NECK, HEAD = 0.95, 1.50, 1.66  # heights [m]


def heading(scene: Cape, time: float) -> float:
    """Direction of the figure [rad]; the walk starts smoothly from rest."""
    w = 2 * np.pi / scene.turn_period
    return scene.turn_rate / w * (1 - np.cos(w * time))


def place(scene: Cape, time: float) -> np.ndarray:
    """Point on the ground under the figure [m]: it walks along its heading (integrated by Simpson's rule)."""
    t = np.linspace(0.0, max(time, 0.0), 2 * max(8, int(np.ceil(time * 24))) + 1)
    speed = scene.walk_speed * np.clip(t / 0.6, 0.0, 1.0) ** 2 * (3 - 2 * np.clip(t / 0.6, 0.0, 1.0))
    angle = heading(scene, 0.0) + np.array([heading(scene, s) for s in t])
    weights = np.where(np.arange(len(t)) % 2 == 1, 4.0, 2.0)
    weights[[0, -1]] = 1.0
    step = (t[1] - t[0]) / 3
    return step * np.array([weights @ (speed * np.sin(angle)), 0.0, weights @ (speed * np.cos(angle))])


def pose(scene: Cape, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and translation (3,) of the figure's trunk."""
    angle = heading(scene, time)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    at = place(scene, time)
    bounce = 0.015 * np.sin(2 * step_phase(scene, time)) ** 2
    return turn, at + np.array([0.0, bounce, 0.0])


def step_phase(scene: Cape, time: float) -> float:
    """Phase of the walk [rad]: one stride per 1.3 m, legs and arms opposite."""
    return 2 * np.pi / 1.3 * scene.walk_speed * max(time - 0.3, 0.0)


def joints(scene: Cape, time: float) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Segments (from, to, radius) of the figure: trunk, shoulders, neck, head, arms, legs."""
    turn, at = pose(scene, time)
    swing = scene.stride * np.sin(step_phase(scene, time)) * min(1.0, time / 0.6)
    parts = [
        ((0, HIP, 0), (0, NECK - 0.16, 0), 0.145),
        ((-0.15, NECK - 0.09, 0), (0.15, NECK - 0.09, 0), 0.07),
        ((0, NECK - 0.1, 0), (0, HEAD - 0.05, 0.01), 0.052),
        ((0, HEAD - 0.02, 0.01), (0, HEAD + 0.06, 0.02), 0.095),
    ]
    for side in (-1.0, 1.0):
        leg, arm = side * swing, -0.8 * side * swing
        hip, shoulder = (0.09 * side, HIP, 0), (0.235 * side, NECK - 0.13, 0.03)
        foot = (0.09 * side, HIP - 0.87 * np.cos(leg), 0.87 * np.sin(leg))
        hand = (0.28 * side, shoulder[1] - 0.52 * np.cos(arm), 0.08 + 0.52 * np.sin(arm))
        parts += [(hip, foot, 0.075), (shoulder, hand, 0.05)]
    return [
        (turn @ np.array(a, float) + at, turn @ np.array(b, float) + at, radius) for a, b, radius in parts
    ]


def figure(scene: Cape, time: float) -> tuple[Collider, ...]:
    """The figure as moving capsules; the floor too.

    A velocity is that of the way made in the step that ends now: a step carries what touches a collider along by it,
    and with the tangent of a way that turns would leave it inside.
    """
    now, before = joints(scene, time), joints(scene, time - scene.dt)
    capsules: list[Collider] = [
        Capsule(
            tuple(a.tolist()),
            tuple(b.tolist()),
            radius,
            tuple(((a - before[k][0]) / scene.dt).tolist()),
            tuple(((b - before[k][1]) / scene.dt).tolist()),
        )
        for k, (a, b, radius) in enumerate(now)
    ]
    if scene.floor and scene.ground is not None:
        capsules.append(Plane((0.0, scene.ground, 0.0), (0.0, 1.0, 0.0)))
    return tuple(capsules)


def on_the_shoulders(scene: Cape, mesh: Mesh) -> np.ndarray:
    """Roll the flat pattern isometrically into a cone whose axis is the neck, open at the front."""
    X = mesh.vertices
    radius, angle = np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])
    angle = angle - (angle.min() + angle.max()) / 2
    around = angle / np.sin(scene.spread)  # a sector of this opening closes that far around the cone
    inner = radius.min()
    height = NECK + 0.03 - (radius - inner) * np.cos(scene.spread)
    out = radius * np.sin(scene.spread)
    return np.stack([-out * np.sin(around), height, -out * np.cos(around)], axis=1)


def collar(scene: Cape, start: np.ndarray, time: float) -> np.ndarray:
    """Where the collar (k, 3) is at a time: it rides along with the trunk."""
    turn, at = pose(scene, time)
    _, from_here = pose(scene, 0.0)
    return (start - from_here) @ turn.T + at


on_the_shoulders.reads = ()  # type: ignore[attr-defined]

SCENE = Cape(
    name="cape",
    title="A cape in motion",
    mesh="cape",
    size=1.96,
    pinned="collar",
    mu=5e6,  # a woven cotton: E = 13 MPa and nu = 1/3 in plane stress, 0.4 mm, 0.2 kg/m^2
    lam=5e6,
    rho=500.0,
    h=4e-4,
    bending="quadratic",
    contact="solve",
    friction=0.3,
    steps=960,
    wind=(0.6, 0.0, -0.5),
    drag=1.2,
    camera="follow",
    ground=0.0,
    floor=True,
    view=(-0.75, 0.25, -1.0),
    start=on_the_shoulders,
    colliders=figure,
    carried=collar,
)
