"""A creature to wobble: a bear of jelly, made of balls and capsules that flow into each other."""

from __future__ import annotations

import functools

import numpy as np

from muslin.mesh.filling import fill, skin
from muslin.mesh.surface import Mesh
from muslin.mesh.tets import TetMesh

#: Its right half, and what lies in the middle: from, to, radius [m]; y is up, and it looks along z.
PARTS = (
    ((0.0, 0.30, 0.0), (0.0, 0.52, 0.0), 0.21),  # trunk
    ((0.0, 0.82, 0.02), (0.0, 0.83, 0.02), 0.185),  # head
    ((0.0, 0.78, 0.15), (0.0, 0.78, 0.20), 0.075),  # muzzle
    ((0.13, 0.985, 0.0), (0.13, 0.99, 0.0), 0.07),  # ear
    ((0.17, 0.56, 0.06), (0.27, 0.44, 0.20), 0.075),  # arm
    ((0.12, 0.20, 0.04), (0.155, 0.075, 0.08), 0.115),  # leg
    ((0.155, 0.075, 0.08), (0.165, 0.075, 0.17), 0.095),  # foot
    ((0.0, 0.24, -0.20), (0.0, 0.25, -0.22), 0.07),  # tail
)
#: How far parts flow into each other [m].
BLEND = 0.06

LOW, HIGH = (-0.4, -0.1, -0.35), (0.4, 1.15, 0.38)


def distance(X: np.ndarray) -> np.ndarray:
    """About how far points (n, 3) are from the creature's surface, negative inside, (n,) [m]."""
    mirrored = np.column_stack([np.abs(X[:, 0]), X[:, 1:]])
    found = np.full(len(X), 10.0)
    for a, b, radius in PARTS:
        start, way = np.asarray(a), np.asarray(b) - np.asarray(a)
        share = np.clip((mirrored - start) @ way / (way @ way), 0.0, 1.0)
        here = np.linalg.norm(mirrored - start - share[:, None] * way, axis=1) - radius
        mixed = np.maximum(BLEND - np.abs(found - here), 0.0) / BLEND
        found = np.minimum(found, here) - mixed * mixed * BLEND / 4
    return np.maximum(found, -0.02 - X[:, 1])  # it stands on flat feet


@functools.lru_cache(maxsize=4)
def creature(spacing: float = 0.1) -> TetMesh:
    """The creature, 1.06 m tall, of tetrahedra."""
    return fill(distance, LOW, HIGH, spacing, "creature")


@functools.lru_cache(maxsize=4)
def creature_skin(spacing: float = 0.018) -> Mesh:
    """Its surface, finer."""
    return skin(distance, LOW, HIGH, spacing, "creature's skin")
