"""Scenes: what is simulated, one small file each; every parameter can be overridden by name.

`get(name, **overrides)` returns a `Scene`; `SCENES` lists the names. To add one, write a file with a `SCENE` in
this folder and name it in `CLOTHS` or `SOLIDS`.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from muslin.base.errors import MuslinError, choices
from muslin.simulation.scenes.scene import Scene, override

CLOTHS = ("course", "throw", "drape", "hang", "freefall", "cape")
SOLIDS = ("beam", "jelly", "twist", "drop", "wobble")
SCENES = CLOTHS + SOLIDS

__all__ = ["CLOTHS", "SCENES", "SOLIDS", "Scene", "get", "override"]


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
