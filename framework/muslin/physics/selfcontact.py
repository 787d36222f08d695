"""A cloth does not pass through itself: no step ends where two of its triangles cross, if it began where none did.

Here is the geometry: whether things meet on a way, what it is that meets, and how far a way may be gone. Candidates and
continuous collision detection are those of `ipctk` (Li et al. 2020), an optional package. What follows from it is said
in `muslin.simulation.uncrossing`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.base import optional
from muslin.physics.nearness import Beside, Near, near

#: How a scene may answer contact of a cloth with itself.
SELF_COLLISION = ("off", "fast", "exact")

#: Shares of the gap: what must be left for a way to be gone as it is, and what things that meet are to keep.
NEAREST, KEPT = 0.25, 0.5

#: Share of the least distance that a way may close where there is less than that, and that it may close unheld.
NEARER, UNHELD = 0.5, 0.1

#: Share of the gap below which that is all but nothing, a smaller one: distances must not come down to rounding.
LEAST, CLOSER = 0.02, 0.1

#: Share of the gap by which a step moves things apart.
PUSH = 0.125


def require() -> Any:
    """The ipctk module.

    Raises
    ------
    MuslinError
        If it is not installed; names the extra that brings it.
    """
    return optional.require("ipctk", "Self-collision", "contact", ", or use --set self_collision=off.")


def surface(X: np.ndarray, triangles: np.ndarray) -> Any:
    """Undeformed positions (n, 3) and triangles (m, 3) as ipctk's mesh."""
    ipctk = require()
    ipctk.set_num_threads(1)  # the same sums in the same order
    ipctk.set_logger_level(ipctk.LoggerLevel.error)
    faces = np.asfortranarray(triangles, dtype=np.int32)
    return ipctk.CollisionMesh(np.asfortranarray(X), ipctk.edges(faces), faces)


class SelfContact:
    """A surface that must not cross itself.

    Parameters
    ----------
    X : (n, 3) array
        Undeformed positions [m].
    triangles : (m, 3) int array
    masses : (n,) array
        [kg]
    gap : float
        What touches keeps between a quarter and all of this distance [m].
    """

    def __init__(self, X: np.ndarray, triangles: np.ndarray, masses: np.ndarray, gap: float):
        ipctk = require()
        self._mesh, self.gap = surface(X, triangles), float(gap)
        self._masses, self._beside = masses, Beside(triangles, len(X))
        self.narrow = ipctk.AdditiveCCD(conservative_rescaling=0.99)

    def crosses(self, x: np.ndarray) -> bool:
        """Whether a triangle crosses another at positions (n, 3)."""
        return bool(require().has_intersections(self._mesh, np.asfortranarray(x)))

    def drift(self, way: np.ndarray) -> np.ndarray:
        """Where ways (n, 3) take the whole surface, (3,): on that nothing is met."""
        return np.asarray(self._masses @ way / self._masses.sum())

    def way(self, x: np.ndarray, goal: np.ndarray) -> Way:
        """The straight way from x to a goal, (n, 3) each, but for where that takes the whole."""
        return Way(self, x, goal - self.drift(goal - x))


class Way:
    """What a surface may meet on a straight way."""

    def __init__(self, contact: SelfContact, x: np.ndarray, goal: np.ndarray):
        self._contact, self._x, self._goal = contact, x, goal
        self._ends = np.asfortranarray(x), np.asfortranarray(goal)
        self._candidates = require().Candidates()
        self._candidates.build(contact._mesh, *self._ends, contact.gap / 2)
        close = require().NormalCollisions()
        close.build(self._candidates, contact._mesh, self._ends[0], contact.gap)
        now = float(np.sqrt(close.compute_minimum_distance(contact._mesh, self._ends[0])))
        #: whether something is too near at its beginning
        self.is_near = now < NEAREST * contact.gap
        self._unheld = min(NEAREST * contact.gap, (1 - UNHELD) * now)
        floor = min(LEAST * contact.gap, (1 - CLOSER) * now)
        self._least = min(NEAREST * contact.gap, max((1 - NEARER) * now, floor))

    def is_unheld(self) -> bool:
        """Whether nothing need push: everything stays further apart than `NEAREST` on it, or about as far as it is."""
        return self._stays(self._unheld)

    def is_free(self) -> bool:
        """Whether it may be gone: everything stays further apart than `NEAREST` on it, or comes less than `NEARER`."""
        return self._stays(self._least)

    def _stays(self, least: float) -> bool:
        mesh, narrow = self._contact._mesh, self._contact.narrow
        return bool(self._candidates.is_step_collision_free(mesh, *self._ends, least, narrow))

    def reach(self) -> float:
        """Share of it, at most 1, that may be gone."""
        mesh, narrow = self._contact._mesh, self._contact.narrow
        return float(self._candidates.compute_collision_free_stepsize(mesh, *self._ends, self._least, narrow))

    def meets(self) -> Near:
        """What comes near on it."""
        contact = self._contact
        way, wanted = self._goal - self._x, KEPT * contact.gap
        return near(self._candidates, contact._mesh, contact._beside, self._x, way, wanted)
