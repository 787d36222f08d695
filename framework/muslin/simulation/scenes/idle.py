"""Parameters that a scene does not use as it is: who sets one is told, and why."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

import numpy as np

from muslin.mesh import TetMesh
from muslin.simulation.scenes.scene import Scene, as_it_is, lying, sphere_and_floor

ADAPTING = ("levels", "budget", "adapt_every", "look_ahead", "refine_angle", "refine_stretch", "flip_angle")
SPHERE = ("sphere_center", "sphere_radius", "sphere_velocity")
PULL = ("drag_to", "drag_stiffness", "drag_until")


def why(scene: Scene, name: str) -> str:
    """Why a parameter has no effect in a scene as it is; empty where it has, or where that is not known."""
    solid = scene.MESH is TetMesh
    return (
        (_of_solids if solid else _of_cloth)(scene, name) or _of_start(scene, name) or _of_others(scene, name)
    )


def remarks(scene: Scene, names: Iterable[str]) -> tuple[str, ...]:
    """One sentence for each of these parameters that has no effect in a scene; that it is 0 or off needs none."""
    found = ((name, why(scene, name)) for name in names if np.any(getattr(scene, name)))
    return tuple(f"{name} has no effect in {scene.name!r}: {reason}." for name, reason in found if reason)


def _of_solids(scene: Scene, name: str) -> str:
    if name == "resolution" and scene.mesh not in ("bar", "ball"):
        return "its mesh is not made, but read" if scene.mesh != "creature" else "the creature has one mesh"
    if name in ("length", "thickness") and scene.mesh != "bar":
        return "its mesh is no bar"
    return ""


def _of_cloth(scene: Scene, name: str) -> str:
    if name in ("resolution", "diagonals") and scene.mesh != "grid":
        return f"its mesh is no grid but {scene.mesh}"
    if name == "bending_stiffness" and scene.bending == "off":
        return "bending is off"
    if name == "self_gap" and scene.self_collision == "off":
        return "self_collision is off"
    if name == "plane" and scene.mu is not None:
        return "it is about E and nu, and the scene has mu and lam"
    return ""


#: What the starts that are not of one scene read of `start_at`, `tilt` and `sag`.
READ: Mapping[Callable[..., object], tuple[str, ...]] = MappingProxyType(
    {as_it_is: (), lying: ("start_at", "tilt")}
)


def _of_start(scene: Scene, name: str) -> str:
    if name not in ("start_at", "tilt", "sag"):
        return ""
    read = READ.get(scene.start)
    if read is None:
        read = getattr(scene.start, "reads", None)
    if read is not None and name not in read:
        return "it does not start so"
    return "there is no sphere" if name == "sag" and not scene.sphere else ""


def _of_others(scene: Scene, name: str) -> str:
    if name in ADAPTING and not scene.adaptive:
        return "adaptive is off"
    if name == "wind" and not scene.drag:
        return "drag is 0, and with it the air's force; set drag=1.2"
    if name in PULL and scene.drag_vertex < 0 and getattr(scene, "drag_point", "none") == "none":
        return "drag_vertex is -1: nothing is pulled at"
    if name == "floor" and scene.floor and scene.ground is None:
        return "ground says no height"
    if name in (*SPHERE, "sphere") and scene.colliders is not sphere_and_floor:
        return "what it meets is its own"
    if name in SPHERE and not scene.sphere:
        return "sphere is off"
    if name == "friction" and scene.self_collision == "off":
        if scene.contact == "filter":
            return "contact is filter, which has none; set contact=solve"
        return "" if scene.colliders(scene, 0.0) else "there is nothing to touch"
    return ""
