"""What of a surface meets what else of it on straight ways: pairs of points, with a half space of ways for each.

A vertex and a triangle, or two edges, are followed to where they come too near each other. With the normal n there,
their points must end the way at least as far apart along n as is wanted. Candidates are those of `ipctk`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from muslin.physics.meeting import nearest_weights

#: Sine of the angle below which two edges count as parallel, and the share of an edge that belongs to its ends: what
#: meets there is a vertex and a triangle as well.
PARALLEL, END = 1e-3, 1e-6

#: Steps along a way, and the share of the way below which they end.
LOOKS, SHORT = 16, 1e-3

#: Multiple of the wanted distance beyond which a pair does not count, nearest as it comes.
FAR = 2.0


@dataclass(frozen=True)
class Near:
    """Pairs of points of a surface, one row each.

    Attributes
    ----------
    key : (c,) int64
        Of the pair.
    corners, weights : (c, 4)
        Vertices, and their weights in the one point less the other.
    normals : (c, 3)
        From the other to the one.
    """

    key: np.ndarray
    corners: np.ndarray
    weights: np.ndarray
    normals: np.ndarray

    def __len__(self) -> int:
        return len(self.key)

    def joined(self, other: Near) -> Near:
        """These, and those of another that are not among them."""
        new = ~np.isin(other.key, self.key)
        pairs = ((getattr(self, f.name), getattr(other, f.name)[new]) for f in fields(self))
        return Near(*(np.concatenate(pair) for pair in pairs))


def near(candidates: Any, mesh: Any, x: np.ndarray, way: np.ndarray, wanted: float) -> Near:
    """The pairs among ipctk's candidates that come nearer than is wanted on ways from x, (n, 3) each, or almost do."""
    edges, faces = mesh.edges, mesh.faces
    fv = np.array([(c.face_id, c.vertex_id) for c in candidates.fv_candidates], np.int64).reshape(-1, 2)
    ee = np.array([(c.edge0_id, c.edge1_id) for c in candidates.ee_candidates], np.int64).reshape(-1, 2)
    n, count = len(x), len(edges)
    corners = np.concatenate([fv[:, 1:], faces[fv[:, 0]]], axis=1)
    one = _met(fv[:, 0] * n + fv[:, 1], corners, 1, x, way, wanted)
    corners = np.concatenate([edges[ee[:, 0]], edges[ee[:, 1]]], axis=1)
    other = _met(len(faces) * n + ee[:, 0] * count + ee[:, 1], corners, 2, x, way, wanted)
    return Near(*(np.concatenate(pair) for pair in zip(one, other, strict=True)))


def _met(
    key: np.ndarray, corners: np.ndarray, ones: int, x: np.ndarray, way: np.ndarray, wanted: float
) -> tuple[np.ndarray, ...]:
    """Of pairs (c, 4), the first corners of which, so many, are the one's: key, corners, weights, normals.

    By going on as far as is certain to be free.
    """
    at, ways = x[corners], way[corners]
    ways = ways - ways.mean(axis=1, keepdims=True)
    lengths = np.sqrt(np.einsum("cki,cki->ck", ways, ways))
    most = np.maximum(lengths[:, :ones].max(axis=1) + lengths[:, ones:].max(axis=1), 1e-300)
    weights, away, distance = _apart(at, ones)
    close = np.flatnonzero(distance - most < wanted)  # nothing else can come so near
    key, corners, at, ways, most = key[close], corners[close], at[close], ways[close], most[close]
    weights, away, distance = weights[close], away[close], distance[close]
    part, going = np.zeros(len(key)), np.arange(len(key))
    for _ in range(LOOKS):
        free = np.maximum(distance[going] - wanted / 2, 0.0) / most[going]
        further = np.minimum(part[going] + free, 1.0)
        going, further = going[free > SHORT], further[free > SHORT]
        if not len(going):
            break
        part[going] = further
        weights[going], away[going], distance[going] = _apart(
            at[going] + further[:, None, None] * ways[going], ones
        )
        going = going[further < 1]
    kept = distance < FAR * wanted
    if ones == 2:
        kept &= (np.abs(weights) > END).all(axis=1)
    normals = away[kept] / np.maximum(distance[kept], 1e-300)[:, None]
    return key[kept], corners[kept], weights[kept], normals


def _apart(at: np.ndarray, ones: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of pairs with corners at (c, 4, 3): weights of the nearest points, the way between those, and its length."""
    if ones == 1:
        weights = np.concatenate([np.ones((len(at), 1)), -nearest_weights(at[:, 0], at[:, 1:])], axis=1)
    else:
        s, t = _between(at[:, :2], at[:, 2:]).T
        weights = np.stack([1 - s, s, t - 1, -t], axis=1)
    away = np.einsum("ck,cki->ci", weights, at)
    return weights, away, np.sqrt(np.einsum("ci,ci->c", away, away))


def _between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Where two edges (c, 2, 3) are nearest to each other, as shares (c, 2) of them (Ericson 2005, 5.1.9)."""
    u, v, w = one[:, 1] - one[:, 0], other[:, 1] - other[:, 0], one[:, 0] - other[:, 0]
    a, b, e, c, f = (np.einsum("ci,ci->c", p, q) for p, q in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    area = a * e - b * b
    crossed = np.clip((b * f - c * e) / np.maximum(area, 1e-300), 0.0, 1.0)
    s = np.where(area > PARALLEL**2 * a * e, crossed, 0.0)
    t = (b * s + f) / e
    s = np.where(t < 0, np.clip(-c / a, 0.0, 1.0), s)
    s = np.where(t > 1, np.clip((b - c) / a, 0.0, 1.0), s)
    return np.stack([s, np.clip(t, 0.0, 1.0)], axis=1)
