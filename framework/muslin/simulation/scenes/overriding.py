"""Parameters set by name: read, held against each other, and refused in a sentence where they make no sense."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError, choices
from muslin.physics.bending import require_model
from muslin.physics.colliders import CONTACT
from muslin.physics.material import PLANES
from muslin.physics.selfcontact import SELF_COLLISION
from muslin.simulation.scenes.scene import Scene
from muslin.simulation.scenes.values import converted


def override(scene: Scene, /, **values: Any) -> Scene:
    """Copy of a scene with some parameters changed; text is converted to the parameter's type.

    Raises
    ------
    MuslinError
        If a parameter is unknown or a value cannot be read.
    """
    known = scene.parameters()
    changes: dict[str, Any] = {}
    for name, value in values.items():
        if name not in known:
            raise MuslinError(f"The scene {scene.name!r} has no parameter {name!r}.", _meant(name, known))
        changes[name] = converted(name, value, _kind(scene, name))
        if name in scene.FOREIGN and changes[name] != known[name]:
            raise MuslinError(
                f"{name} is for cloth; the scene {scene.name!r} is of a {scene.WORD} and has none.",
                f"What it has: muslin scenes {scene.name}",
            )
    E_nu, mu_lam = ({n for n in pair if changes.get(n) is not None} for pair in (("E", "nu"), ("mu", "lam")))
    if E_nu and not mu_lam:  # the pair given last counts
        changes |= {"mu": None, "lam": None}
    elif mu_lam and not E_nu:
        changes |= {"E": None, "nu": None}
    if changes.get("self_collision") == "exact":
        changes = {**EXACT, **changes}
    if changes.get("adaptive") and "diagonals" in known:
        changes = {**ADAPTIVE, **changes}
    changed = dataclasses.replace(scene, **changes)
    if (changed.mu is None) != (changed.lam is None):
        raise MuslinError(f"The scene {scene.name!r} has only one of mu and lam.", "Give both, or E and nu.")
    if E_nu and mu_lam:
        _require_one_material(changed)
    for name, low in LOWEST.items():
        if not getattr(changed, name) > low:
            wanted = "positive" if low == 0 else f"at least {low + 1}"
            raise MuslinError(f"{name} = {getattr(changed, name)} must be {wanted}.")
    if changed.scale != "fit" and not converted("scale", changed.scale, "float") > 0:
        raise MuslinError(f"scale = {changed.scale} must be positive.", "Write a factor, or fit.")
    if changed.plane not in PLANES:
        raise MuslinError(f"plane = {changed.plane!r} is not understood.", choices(changed.plane, PLANES))
    if changed.damping < 0:
        raise MuslinError(
            f"damping = {changed.damping} must not be negative.", "In seconds, for example 0.001."
        )
    require_model(changed.bending, changed.bending_stiffness)
    if changed.camera not in ("fit", "follow"):
        raise MuslinError(f"camera = {changed.camera!r} is not understood.", "Write fit or follow.")
    if changed.contact not in CONTACT:
        raise MuslinError(
            f"contact = {changed.contact!r} is not understood.", f"Write {' or '.join(CONTACT)}."
        )
    if changed.self_collision not in SELF_COLLISION:
        raise MuslinError(
            f"self_collision = {changed.self_collision!r} is not understood.",
            f"Write {', '.join(SELF_COLLISION[:-1])} or {SELF_COLLISION[-1]}.",
        )
    for name, wanted in (EXACT if changed.self_collision == "exact" else {}).items():
        if getattr(changed, name).replace("_", "-") != wanted:
            raise MuslinError(
                f"self_collision = exact needs {name} = {wanted}, not {getattr(changed, name)}.",
                f"Set {name}={wanted} or leave it out, or use self_collision=fast.",
            )
    for name, example in (
        ("friction", "0.3"), ("look_ahead", "0.04"), ("drag", "1.2"), ("drag_stiffness", "1000"),
    ):  # fmt: skip
        if not getattr(changed, name) >= 0:
            raise MuslinError(
                f"{name} = {getattr(changed, name)} must not be negative.",
                f"For example {example}; 0 is none.",
            )
    if changed.stretch_limit and not changed.stretch_limit > 1:
        raise MuslinError(
            f"stretch_limit = {changed.stretch_limit} must be above 1, or 0 for none.", "For example 1.01."
        )
    if not any(changed.view[k] for k in (0, 2)):
        raise MuslinError("view must not point straight up or down.", "For example: view=0.4,0.35,1")
    return changed


def _require_one_material(scene: Scene) -> None:
    """Refuse E and nu beside a mu and lam that are not theirs."""
    theirs = () if None in (scene.E, scene.nu, scene.mu, scene.lam) else scene.lame
    if not theirs or not np.allclose(theirs, dataclasses.replace(scene, mu=None, lam=None).lame, 1e-6, 0.0):
        raise MuslinError(
            "E and nu, and mu and lam, were given, and they are not the same material.",
            "Give one pair or the other.",
        )


#: What self-collision in every step goes with, and brings along.
EXACT = {"integrator": "backward-euler", "contact": "solve"}

#: What an adaptive mesh begins with: refined, it folds as well as a grid that is as fine (zigzag ones do not).
ADAPTIVE = {"diagonals": "alternating"}

#: What parameters must be above.
LOWEST = {
    "dt": 0.0,
    "steps": -1,
    "frame_every": 0,
    "fps": 0,
    "resolution": 1,
    "sphere_radius": 0.0,
    "tolerance": 0.0,
    "self_gap": 0.0,
    "levels": 0,
    "budget": 2,
    "adapt_every": 0,
    "refine_angle": 0.0,
    "flip_angle": 0.0,
}


def _meant(name: str, known: Iterable[str]) -> str:
    """What to set instead of a name that there is not: what is spelt like it, or means it in words."""
    from muslin.simulation.scenes.meanings import MEANINGS

    words = {key: meaning.text for rows in MEANINGS.values() for key, meaning in rows.items() if key in known}
    for key, text in words.items():
        if len(name) > 4 and re.search(rf"\b{re.escape(name)}", text, re.IGNORECASE):
            return f"Did you mean {key}? It is: {text.replace('`', '')}."
    return choices(name, sorted(known))


def _kind(scene: Scene, name: str) -> str:
    kind = next(f.type for f in dataclasses.fields(scene) if f.name == name)
    return kind if isinstance(kind, str) else kind.__name__  # a subclass may annotate with types or with text
