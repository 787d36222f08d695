"""Which vertices are pinned: rules for `pinned`, on the undeformed positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from muslin.base.errors import MuslinError, choices
from muslin.simulation.scenes.values import converted


def _none(X: np.ndarray, size: float) -> np.ndarray:
    return np.empty(0, dtype=int)


def _highest_row(X: np.ndarray, size: float) -> np.ndarray:
    return np.flatnonzero(X[:, 1] > X[:, 1].max() - 1e-6 * size)


def _corners(X: np.ndarray, size: float) -> np.ndarray:
    """The two upper corners: extreme in x among the highest row."""
    row = _highest_row(X, size)
    return np.unique(row[[int(np.argmin(X[row, 0])), int(np.argmax(X[row, 0]))]])


def _collar(X: np.ndarray, size: float) -> np.ndarray:
    """The inner arc of a cape pattern: the vertices nearest its centre, the origin."""
    radius = np.linalg.norm(X, axis=1)
    return np.flatnonzero(radius < radius.min() + 1e-6 * size)


#: Rules for `pinned`, on the undeformed positions.
PINS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "none": _none,
    "highest-row": _highest_row,
    "corners": _corners,
    "collar": _collar,
}

#: Sides of a body: the axis, and which end of it. `lowest:3` are the vertices within 3 [m] of the lowest.
SIDES = {
    "lowest": (1, -1),
    "highest": (1, 1),
    "left": (0, -1),
    "right": (0, 1),
    "back": (2, -1),
    "front": (2, 1),
}


def near_sides(rule: str, X: np.ndarray, size: float) -> np.ndarray:
    """Vertices within some distance of sides: `lowest:3`, or several: `left:0.01,right:0.01`."""
    pinned = np.zeros(len(X), dtype=bool)
    for part in rule.replace(",", " ").split():
        side, _, reach = part.partition(":")
        if side not in SIDES:
            raise MuslinError(f"pinned = {rule!r} is not understood.", choices(side, SIDES))
        axis, end = SIDES[side]
        along = end * X[:, axis]
        pinned |= along >= along.max() - converted("pinned", reach or "0", "float") - 1e-9 * size
    return np.flatnonzero(pinned)
