"""Scenes: what is simulated, one small file each; every parameter can be overridden by name.

`get(name, **overrides)` returns a `Scene`; `SCENES` lists the names. To add one, write a file with a `SCENE` in
this folder and name it in `CLOTHS` or `SOLIDS`.
"""

from __future__ import annotations

import dataclasses
import re
from importlib import import_module
from typing import Any

from muslin.base.errors import MuslinError, choices
from muslin.simulation.scenes.overriding import override
from muslin.simulation.scenes.scene import Scene

CLOTHS = ("course", "throw", "drape", "hang", "freefall", "cape")
SOLIDS = ("beam", "jelly", "twist", "drop", "wobble")
SCENES = CLOTHS + SOLIDS

__all__ = ["CLOTHS", "SCENES", "SOLIDS", "Scene", "get", "override", "rebuilt", "recorded"]


def get(name: str, /, **overrides: Any) -> Scene:
    """Scene by name, with some parameters changed.

    Raises
    ------
    MuslinError
        If there is no such scene, no such parameter, or a value makes no sense; the message lists what there is.
    """
    if not isinstance(name, str) or name not in SCENES:
        raise MuslinError(f"There is no scene {name!r}.", choices(name, SCENES))
    scene: Scene = import_module(f"muslin.simulation.scenes.{name}").SCENE
    return override(scene, **overrides)


def recorded(scene: Scene) -> dict[str, Any]:
    """What a run says of its scene: name, parameters, and of one that is not Muslin's what else rebuilds it.

    Raises
    ------
    MuslinError
        If it cannot be rebuilt: it starts, meets or carries by functions that no scene of Muslin has.
    """
    said: dict[str, Any] = {"scene": scene.name, "parameters": scene.parameters()}
    if scene.name in SCENES and rebuilt(said) == scene:
        return said
    for name in SCENES:
        if all(getattr(get(name), f) == getattr(scene, f) for f in _CODE) and type(get(name)) is type(scene):
            own = {**said, "own": {"like": name, "title": scene.title, "size": scene.size}}
            if rebuilt(own) == scene:
                return own
    raise MuslinError(
        f"The scene {scene.name!r} has functions or parameters of its own, so a run of it could not be read back.",
        "Take start, colliders and carried from a scene of Muslin's, add yours to muslin/simulation/scenes "
        "(docs/recipes/scene.md), or simulate without out=.",
    )


def rebuilt(said: dict[str, Any]) -> Scene:
    """The scene that `recorded` told of.

    Raises
    ------
    MuslinError
        If there is no such scene, or no such parameter.
    """
    parameters = dict(said["parameters"])
    if parameters.get("mu") is not None and parameters.get("lam") is not None and "own" not in said:
        parameters |= {"E": None, "nu": None}  # older runs name both pairs; this one counted
    if "own" not in said:
        return get(said["scene"], **parameters)
    own = said["own"]
    if not NAME.fullmatch(said["scene"]):
        raise MuslinError(
            f"A run cannot be named {said['scene']!r}: its pictures are named like its scene.",
            "Letters, digits, - and _ will do.",
        )
    scene = dataclasses.replace(get(own["like"]), name=said["scene"], title=own["title"], size=own["size"])
    return override(scene, **parameters)


#: What a scene of one's own may be called: files are named like it.
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")

#: What a scene does by code, which a run cannot write down.
_CODE = ("start", "colliders", "carried")
