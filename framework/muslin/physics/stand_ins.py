"""The tasks behind every part of a simulation of cloth, in one table: what those say that call them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from muslin.physics import cloth, colliders, skinning
from muslin.physics.cloth import STRAIN_ENERGY
from muslin.physics.roles import unusable

__all__ = ["NEEDS", "STRAIN_ENERGY", "unusable"]

#: Tasks behind each part of a simulation: part -> names. `hessian` is the closed road.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType({**cloth.NEEDS, **colliders.NEEDS, **skinning.NEEDS})
