"""Coulomb's friction between points of a body that press on each other, in the energies that a step minimises.

With what presses, lambda [N s], and the speed y at which a point slides there is mu lambda s(y) in them (Li et al.
2020), where s(y) = y^2/e - y^3/(3 e^2) below the speed e at which it holds, and y - e/3 from there on: s' grows from 0
to 1. Lambda, and the plane in which it slides, are those of the step without friction.

Newton's method sees the paraboloid about 0 that touches this at y and lies above it everywhere else: c/2 |t u|^2 with
c = mu lambda s'(y) / y. So a step of it never adds to the function, wherever points begin to hold or to slide.
"""

from __future__ import annotations

import numpy as np

from muslin.physics.barrier import HOLDS
from muslin.simulation.touching import Touching

#: Share of friction by which it may still change from one of Newton's steps to the next.
UNLIKE = 0.01


def steepness(speed: np.ndarray) -> np.ndarray:
    """s'(y) / y for speeds y, (c,) [s/m]."""
    return np.where(speed < HOLDS, (2 - speed / HOLDS) / HOLDS, 1 / np.maximum(speed, HOLDS))


def slowed(speed: np.ndarray, most: np.ndarray) -> np.ndarray:
    """The speeds y, (c,), with y + most s'(y) = speed: of what friction slows down by so much at most [m/s]."""
    b = 1 + 2 * most / HOLDS
    root = np.sqrt(np.maximum(b**2 - 4 * most / HOLDS**2 * speed, 0.0))
    return np.where(speed - most > HOLDS, speed - most, 2 * speed / (b + root))


class Rubbing:
    """Friction of pairs, made anew after each of Newton's steps.

    Parameters
    ----------
    touching : Touching
        Its `grip` is written.
    friction : float
        mu.
    before : (3n,) array
        Velocities before the step [m/s].
    """

    def __init__(self, touching: Touching, friction: float, before: np.ndarray):
        self._touching, self._friction, self._before = touching, friction, before
        self._most: np.ndarray | None = None
        self._free: np.ndarray | None = None

    def follow(self, solved: np.ndarray, v: np.ndarray, presses: np.ndarray) -> bool:
        """Let pairs rub as at velocities v; whether that is much unlike what rubbed in the step that led there.

        That was to the velocities `solved` for, with what presses (c,) bool; both (n, 3). After the first of them, in
        which nothing rubs, points slide as before; after the second it is known how much what rubbed slowed them down.
        """
        touching = self._touching
        slides, grip = touching.slides(v.ravel()), touching.grip
        about = slides
        if self._most is None:
            self._most = self._friction * touching.pushes(solved.ravel(), presses)
            self._free, about = slides, touching.slides(self._before)
        elif self._free is not None:
            more = self._most / np.maximum(grip * slides, 1e-300)
            about = np.where(self._free > slides, slowed(self._free, (self._free - slides) * more), slides)
            self._free = None
        touching.grip = self._most * steepness(about)
        return bool(np.abs(touching.grip - grip) @ slides > UNLIKE * self._most.sum())
