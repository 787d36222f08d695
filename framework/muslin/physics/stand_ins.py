"""The tasks behind every part of a simulation, in one table for each body: what those say that call them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from muslin.physics import cloth, colliders, skinning, solid
from muslin.physics.cloth import STRAIN_ENERGY
from muslin.physics.roles import unusable

__all__ = ["NEEDS", "STRAIN_ENERGY", "needs", "unusable"]

#: Tasks behind each part of a simulation: part -> names. `hessian` is the closed road.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType({**cloth.NEEDS, **colliders.NEEDS, **skinning.NEEDS})


def needs(tasks: Iterable[str]) -> Mapping[str, tuple[str, ...]]:
    """Tasks behind each part of a simulation with an assignment's tasks: of the body whose tasks those are."""
    there = set(tasks)
    bodies: tuple[Mapping[str, tuple[str, ...]], ...] = (cloth.NEEDS, solid.NEEDS)
    known = [sum(there.issuperset(names) for names in body.values()) for body in bodies]  # whole parts
    body = bodies[known.index(max(known))]
    parts = {**body, **colliders.NEEDS, **skinning.NEEDS}
    return {part: names for part, names in parts.items() if there.issuperset(names)}
