"""What presses against what, carried from one mesh of a cloth to another, so that friction knows it in the next step.

An impulse over the lumped mass of its vertex is a pressure, up to a factor: it is a field on the cloth, and goes over
as positions do. A new vertex presses where all its parents do, with the mean of their pressures; each impulse is then
what the vertex's new mass makes of it, and those of one collider are scaled so that their sum stays. What a triangle
pressed with (on colliders smaller than triangles) stays with triangles that stay.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from muslin.mesh import Refinement
from muslin.physics.meeting import STRIDE
from muslin.physics.transfer import Sheet
from muslin.simulation.touching import Pressed

Field = Callable[[np.ndarray], np.ndarray]


def refined(pressed: Pressed, mesh: Refinement, before: Sheet, after: Sheet) -> Pressed:
    """What presses on a mesh that was refined."""
    n = int(before.triangles.max()) + 1
    return _carried(pressed, mesh.spread, mesh.all_of, before, after, np.arange(n))


def coarsened(pressed: Pressed, kept: np.ndarray, before: Sheet, after: Sheet) -> Pressed:
    """What presses on a mesh of which these vertices were kept."""
    number = np.full(int(before.triangles.max()) + 1, -1)
    number[kept] = np.arange(len(kept))
    return _carried(pressed, lambda v: v[kept], lambda v: v[kept], before, after, number)


def _carried(
    pressed: Pressed, spread: Field, all_of: Field, before: Sheet, after: Sheet, number: np.ndarray
) -> Pressed:
    if not len(pressed):
        return pressed
    n = len(number)
    mass = np.bincount(before.triangles.ravel(), np.repeat(before.masses / 3, 3), n)
    parts = []
    group, which = np.divmod(pressed.key, STRIDE)
    for number_of in np.unique(group):
        rows = np.flatnonzero(group == number_of)
        at = which[rows]
        impulse, slide, speed = pressed.impulse[rows], pressed.slide[rows], pressed.speed[rows]
        if number_of % 2:
            there = _same(number[before.triangles], after.triangles)[at]
            stays = there >= 0
            there, impulse, slide, speed = there[stays], impulse[stays], slide[stays], speed[stays]
        else:
            presses = np.zeros(n, dtype=bool)
            presses[at] = True
            there = np.flatnonzero(all_of(presses))
            field = np.zeros((n, 5))
            field[at, 0], field[at, 1], field[at, 2:] = impulse / mass[at], speed, slide
            found, total = spread(field)[there], impulse.sum()
            now = np.bincount(after.triangles.ravel(), np.repeat(after.masses / 3, 3))[there]
            impulse, speed, slide = found[:, 0] * now, found[:, 1], found[:, 2:]
            impulse *= total / max(impulse.sum(), 1e-300)
        order = np.argsort(there)
        parts.append((number_of * STRIDE + there[order], impulse[order], slide[order], speed[order]))
    key, impulse, slide, speed = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Pressed(key.astype(np.int64), impulse, slide, speed)


def _same(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Row that each of these triangles has among the others, whichever corner comes first; -1 if none."""
    n = 1 + int(after.max())

    def keys(triangles: np.ndarray) -> np.ndarray:
        a, b, c = np.sort(triangles.astype(np.int64), axis=1).T
        return np.where(a < 0, -1, (a * n + b) * n + c)

    mine, theirs = keys(before), keys(after)
    order = np.argsort(theirs)
    at = order[np.minimum(np.searchsorted(theirs[order], mine), len(order) - 1)]
    return np.where(theirs[at] == mine, at, -1)
