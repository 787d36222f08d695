"""A cloth does not pass through itself: no step ends where two of its triangles cross, if it began where none did.

Between two positions of a surface every vertex may go as far as a plane between it and what it would meet, and along
that plane as it likes. The planes, and the pairs that need one, are those of `ipctk` (Li et al. 2020; the rule: "Divide
and Truncate", 2026), an optional package. What is cut off the way is lost: surfaces meet without a bounce.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.base import optional

#: How a scene may answer contact of a cloth with itself.
SELF_COLLISION = ("off", "fast", "exact")

#: A step's way is taken in pieces of at most this share of a usual edge, relative to the cloth's own motion ...
PIECE = 0.1

#: Share of a gap that a step may close, and another to bring apart what is too near: together less than all of it.
NEARER = 0.45

#: Share of the gap that must be left for a way to be gone as it is.
NEAREST = 0.25

#: Share of the gap by which a step moves things apart.
PUSH = 0.125

#: ... of at most so many. What is left then waits for the next step.
PIECES = 32


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
        edges = self._mesh.edges
        self._edge = float(np.median(np.linalg.norm(X[edges[:, 0]] - X[edges[:, 1]], axis=1)))
        self._measured: np.ndarray | None = None
        self._free: np.ndarray = np.zeros(len(X))
        self._region = ipctk.ogc.TrustRegion(self.gap)
        self._masses, self._narrow = masses, ipctk.AdditiveCCD()
        self._repulsion = ipctk.BarrierPotential(ipctk.CubicBarrier(), self.gap, 1.0)

    def crosses(self, x: np.ndarray) -> bool:
        """Whether a triangle crosses another at positions (n, 3)."""
        return bool(require().has_intersections(self._mesh, np.asfortranarray(x)))

    def reached(self, x: np.ndarray, goal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the way from x to a goal, (n, 3) each [m], may end.

        Returns
        -------
        reached : (n, 3) array
            The goal itself if nothing is met.
        apart : (n, 3) array
            What of the way from x is to bring apart what came too near, and makes no speed.
        """
        drift = (goal - x).mean(axis=0)  # where the whole cloth goes, nothing meets
        way, nothing = goal - drift - x, np.zeros_like(x)
        if self._is_free(x + way) or self._meets_nothing(x, x + way):
            return goal, nothing
        longest = float(np.sqrt((way**2).sum(axis=1).max()))
        count = max(1, int(np.ceil(longest / (PIECE * self._edge))))
        here, apart, met = x, nothing, False
        for k in range(min(count, PIECES)):
            self._measure(here, longest / count)
            push = self._push(here) if k == 0 else nothing
            if push.any() or not self._is_free(here + way / count):
                along, aside = self._allowed(here, way / count), self._allowed(here, push)
                here, apart, met = here + along + aside, apart + aside, True
            else:
                here = here + way / count
        return (here + drift, apart) if met or count > PIECES else (goal, nothing)

    def _meets_nothing(self, x: np.ndarray, goal: np.ndarray) -> bool:
        """Whether everything stays further apart than `NEAREST` on straight ways from x to a goal."""
        ipctk = require()
        ways = np.asfortranarray(x), np.asfortranarray(goal)
        near = NEAREST * self.gap
        return bool(ipctk.is_step_collision_free(self._mesh, *ways, near, narrow_phase_ccd=self._narrow))

    def _measure(self, x: np.ndarray, way: float) -> None:
        """How far everything may go from x by itself, and all pairs that a way so long may bring together."""
        ipctk = require()
        self._region = ipctk.ogc.TrustRegion(self.gap)
        self._region.relaxed_radius_scaling = NEARER
        self._region.trust_region_inflation_radius = 2.2 * way + self.gap  # of two that approach, and a push
        self._region.update(self._mesh, np.asfortranarray(x), ipctk.NormalCollisions())
        radii = np.asarray(self._region.trust_region_radii) - self.gap / 2
        self._measured, self._free = x, np.maximum(radii, 0.0)

    def _allowed(self, x: np.ndarray, way: np.ndarray) -> np.ndarray:
        """What the planes leave of a way; two such ways may be gone one after the other."""
        left = np.asfortranarray(way)
        if way.any():
            self._region.planar_filter_step(self._mesh, np.asfortranarray(x), left)
        return np.ascontiguousarray(left)

    def _push(self, x: np.ndarray) -> np.ndarray:
        """What moves apart what is nearer than the gap, without a change of momentum, (n, 3) [m]."""
        if self._free.all():
            return np.zeros_like(x)
        ipctk = require()
        here, near = np.asfortranarray(x), ipctk.NormalCollisions()
        near.build(self._region.candidates, self._mesh, here, self.gap)
        forces = -self._repulsion.gradient(near, self._mesh, here).reshape(-1, 3)
        size = np.sqrt((forces**2).sum(axis=1, keepdims=True))
        push = PUSH * self.gap * forces / np.maximum(size, self.gap**3)
        return np.asarray(push - self._masses @ push / self._masses.sum())

    def _is_free(self, goal: np.ndarray) -> bool:
        """Whether all are nearer to where distances were measured last than anything could be."""
        if self._measured is None:
            return False
        way = goal - self._measured
        way = way - way.mean(axis=0)
        return bool(((way**2).sum(axis=1) <= self._free**2).all())
