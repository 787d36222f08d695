"""A cloth that never crosses itself: a potential that grows without bound where two of its primitives come near.

Incremental potential contact (Li et al. 2020, and 2021 for cloth). Between all vertices, edges and triangles that do
not share a vertex and are nearer than a gap there is a barrier; ways are gone only as far as nothing is met on them;
and where surfaces slide on each other, Coulomb's friction takes energy. Pairs, distances, barrier, friction and ways
are those of `ipctk`, an optional package.

The stiffness of the barrier does not change during a run: one that adapts would put energy in. Over its gap the barrier
of a vertex is about as stiff as the sheet is around it, so that neither makes the other's system hard to solve.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from muslin.physics.selfcontact import require, surface

#: Speed [m/s] of one surface on the other below which friction holds: it grows to Coulomb's up to there.
HOLDS = 1e-3

#: Share of a gap that a way leaves where it would be closed.
LEFT = 0.2


class Barrier:
    """What keeps a surface from crossing itself.

    Parameters
    ----------
    X : (n, 3) array
        Undeformed positions [m].
    triangles : (m, 3) int array
    stretching : float
        How hard the surface is to stretch [N/m].
    gap : float
        Distance at which the barrier begins [m].
    friction : float
        Coulomb's coefficient; 0: none.
    """

    def __init__(self, X: np.ndarray, triangles: np.ndarray, stretching: float, gap: float, friction: float):
        ipctk = require()
        self._mesh, self.gap, self.friction = surface(X, triangles), gap, friction
        #: of the barrier [Pa]
        self.stiffness = stretching * gap / float(np.median(self._mesh.vertex_areas))
        self._potential = ipctk.BarrierPotential(gap, self.stiffness, True)
        self._rubbing = ipctk.FrictionPotential(HOLDS)
        self._narrow = ipctk.AdditiveCCD(conservative_rescaling=1 - LEFT)
        self._candidates: Any = None
        self._way: tuple[np.ndarray, np.ndarray] | None = None
        self._at: np.ndarray | None = None
        self._near: Any = None

    def crosses(self, x: np.ndarray) -> bool:
        """Whether a triangle crosses another at positions (n, 3)."""
        return bool(require().has_intersections(self._mesh, np.asfortranarray(x)))

    def energy(self, x: np.ndarray) -> float:
        """Of the barrier at positions (n, 3) [J]."""
        return float(self._potential(*self._here(x)))

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Of the energy, (n, 3) [N]."""
        return np.asarray(self._potential.gradient(*self._here(x))).reshape(-1, 3)

    def hessian(self, x: np.ndarray, project: bool) -> sp.csc_matrix:
        """Of the energy, (3n, 3n) [N/m]; `project`: made positive semi-definite, pair by pair."""
        return self._potential.hessian(*self._here(x), _projection(project))

    def rubbing(self, x: np.ndarray) -> Rubbing | None:
        """Friction in a step from positions (n, 3); None if nothing rubs."""
        if not self.friction:
            return None
        near, here = self._pairs(), np.asfortranarray(x)
        near.build(self._mesh, here, self.gap)  # as a run that is resumed here finds them, in the same order
        return (
            Rubbing(near, self._mesh, here, self._potential, self._rubbing, self.friction)
            if len(near)
            else None
        )

    def reach(self, x: np.ndarray, goal: np.ndarray) -> float:
        """Share of the straight way from x to a goal, (n, 3) each, that may be gone: 1, or up to where things meet."""
        begin, end = np.asfortranarray(x), np.asfortranarray(goal)
        candidates = require().Candidates()
        candidates.build(self._mesh, begin, end, self.gap)
        self._candidates, self._way = candidates, (x, goal)
        return float(candidates.compute_collision_free_stepsize(self._mesh, begin, end, 0.0, self._narrow))

    def _here(self, x: np.ndarray) -> tuple[Any, Any, np.ndarray]:
        """What is near at positions (n, 3), as ipctk wants it."""
        if self._at is None or not np.array_equal(x, self._at):
            near, here = self._pairs(), np.asfortranarray(x)
            if self._on_the_way(x):
                near.build(self._candidates, self._mesh, here, self.gap)
            else:
                near.build(self._mesh, here, self.gap)
            self._near, self._at = near, np.array(x, order="F")
        assert self._at is not None
        return self._near, self._mesh, self._at

    @staticmethod
    def _pairs() -> Any:
        pairs = require().NormalCollisions()
        pairs.use_area_weighting = True
        return pairs

    def _on_the_way(self, x: np.ndarray) -> bool:
        """Whether positions are in the boxes that the last way was watched in."""
        if self._way is None:
            return False
        low, high = np.minimum(*self._way), np.maximum(*self._way)
        return bool(((low <= x) & (x <= high)).all())


class Rubbing:
    """Friction of a surface with itself: a convex function of its velocities (n, 3) that only takes energy.

    Where surfaces touch, how they lie there and how hard they press is that of the positions at which it was made.
    """

    def __init__(self, near: Any, mesh: Any, x: np.ndarray, barrier: Any, potential: Any, friction: float):
        self._pairs = require().TangentialCollisions()
        self._pairs.build(mesh, x, near, barrier, friction)
        self._mesh, self._potential = mesh, potential

    def value(self, v: np.ndarray) -> float:
        """[W]"""
        return float(self._potential(self._pairs, self._mesh, np.asfortranarray(v)))

    def gradient(self, v: np.ndarray) -> np.ndarray:
        """Minus the force, (n, 3) [N]."""
        gradient = self._potential.gradient(self._pairs, self._mesh, np.asfortranarray(v))
        return np.asarray(gradient).reshape(-1, 3)

    def hessian(self, v: np.ndarray, project: bool) -> sp.csc_matrix:
        """(3n, 3n) [N s/m]"""
        return self._potential.hessian(self._pairs, self._mesh, np.asfortranarray(v), _projection(project))


def _projection(project: bool) -> Any:
    methods = require().PSDProjectionMethod
    return methods.CLAMP if project else methods.NONE
