"""What of a surface meets what else of it on straight ways: pairs of points, with a half space of ways for each.

A vertex and a triangle, or two edges, are followed to where they come too near each other, or else nearest. With the
normal n there, their points must end the way at least as far apart along n as is wanted. Where what is beside the
triangle, or the vertex, is nearer, it is that what may meet: what slides over an edge of a surface does not bump into
it. Candidates are those of `ipctk`.
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

#: Sine of the angle at which another point of the surface counts as nearer to a vertex, and that at which another point
#: than the vertex does: where sheets lie on each other all their vertices count, though one is the nearest. Share of a
#: triangle below which a weight is none.
NEARER, NEARER_ONE, NONE = 1e-6, 0.35, 1e-9


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


def turning(corners: np.ndarray, weights: np.ndarray, x: np.ndarray, longest: float) -> np.ndarray:
    """Matrices (c, 4, 3, 3) that take velocities of corners to how the one point moves relative to the other.

    Relative to the four as they turn: u = sum_k w_k v_k - omega x d, with the way d from the other to the one at
    positions x, no longer than is said, and the corners' angular velocity, omega = I^-1 sum_k r_k x v_k. A motion of
    all as one makes no u, so that what acts by its transpose turns nothing: it has neither force nor moment.
    """
    at = x[corners]
    d = np.einsum("ck,cki->ci", weights, at)
    d = d * np.minimum(longest / np.maximum(np.linalg.norm(d, axis=1), 1e-300), 1.0)[:, None]
    r = at - at.mean(axis=1, keepdims=True)
    squares = np.einsum("cki,cki->c", r, r)
    inertia = squares[:, None, None] * ((1 + np.finfo(float).eps) * np.eye(3)) - np.einsum(
        "cki,ckj->cij", r, r
    )
    lever = _cross(d) @ np.linalg.inv(inertia)
    return weights[:, :, None, None] * np.eye(3) + lever[:, None] @ _cross(r)


def _cross(a: np.ndarray) -> np.ndarray:
    """The matrices (..., 3, 3) of b -> a x b."""
    out = np.zeros((*a.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., j, i], out[..., i, j] = a[..., k], -a[..., k]
    return out


class Beside:
    """What of a surface with triangles (m, 3) on n vertices is beside what.

    Attributes
    ----------
    across : (m, 3)
        The vertex beyond the edge that a triangle's corner is not on; -1: there is none.
    around : (n, most)
        The vertices that a vertex has edges to; -1: there are no more.
    """

    def __init__(self, triangles: np.ndarray, n: int):
        tips = triangles.ravel()
        edges = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        order = np.lexsort(edges.T)
        first = np.flatnonzero((edges[order][1:] == edges[order][:-1]).all(axis=1))
        one, other = order[first], order[first + 1]
        across: np.ndarray = np.full(len(tips), -1)
        across[one], across[other] = tips[other], tips[one]
        self.across = across.reshape(-1, 3)
        both = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)
        count = np.bincount(both[:, 0], minlength=n)
        self.around: np.ndarray = np.full((n, int(count.max(initial=0))), -1)
        place = np.arange(len(both)) - np.repeat(np.cumsum(count) - count, count)
        self.around[both[:, 0], place] = both[:, 1]


def near(candidates: Any, mesh: Any, beside: Beside, x: np.ndarray, way: np.ndarray, wanted: float) -> Near:
    """The pairs among ipctk's candidates that come nearer than is wanted on ways from x, (n, 3) each, or almost do."""
    edges, faces = mesh.edges, mesh.faces
    fv = np.array([(c.face_id, c.vertex_id) for c in candidates.fv_candidates], np.int64).reshape(-1, 2)
    ee = np.array([(c.edge0_id, c.edge1_id) for c in candidates.ee_candidates], np.int64).reshape(-1, 2)
    n, count = len(x), len(edges)
    corners = np.concatenate([fv[:, 1:], faces[fv[:, 0]]], axis=1)
    one = _met(fv[:, 0] * n + fv[:, 1], corners, 1, x, way, wanted)
    one = one.which(~_passed(one, beside, x, way))
    corners = np.concatenate([edges[ee[:, 0]], edges[ee[:, 1]]], axis=1)
    other = _met(len(faces) * n + ee[:, 0] * count + ee[:, 1], corners, 2, x, way, wanted)
    return one.near.joined(other.near)


@dataclass(frozen=True)
class _Met:
    """Pairs, and the share (c,) of their ways at which they are so near."""

    near: Near
    part: np.ndarray

    def which(self, kept: np.ndarray) -> _Met:
        near = Near(*(getattr(self.near, f.name)[kept] for f in fields(Near)))
        return _Met(near, self.part[kept])


def _passed(met: _Met, beside: Beside, x: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Which vertices and triangles, (c,) bool, are no place to meet: what is beside the one or the other is nearer."""
    near, part = met.near, met.part[:, None, None]
    corners = x[near.corners] + part * way[near.corners]
    point = -np.einsum("ck,cki->ci", near.weights[:, 1:], corners[:, 1:])

    def nearer(
        which: np.ndarray, others: np.ndarray, here: np.ndarray, sign: float, angle: float
    ) -> np.ndarray:
        """Whether on the way from here to one of the others (w, k) it is nearer to the opposite point."""
        ahead = x[others] + part[which] * way[others] - here[which, None]
        along = sign * np.einsum("cki,ci->ck", ahead, near.normals[which])
        return np.asarray(((along > angle * np.linalg.norm(ahead, axis=2)) & (others >= 0)).any(axis=1))

    every = np.arange(len(near))
    found = nearer(every, beside.around[near.corners[:, 0]], corners[:, 0], -1, NEARER_ONE)
    none = np.abs(near.weights[:, 1:]) < NONE
    edge = np.flatnonzero(none.sum(axis=1) == 1)
    across = beside.across[near.key[edge] // len(x), np.argmax(none[edge], axis=1)]
    found[edge] |= nearer(edge, across[:, None], point, 1, NEARER)
    corner = np.flatnonzero(none.sum(axis=1) == 2)
    at = near.corners[corner, 1 + np.argmin(none[corner], axis=1)]
    found[corner] |= nearer(corner, beside.around[at], point, 1, NEARER)
    return found


def _met(
    key: np.ndarray, corners: np.ndarray, ones: int, x: np.ndarray, way: np.ndarray, wanted: float
) -> _Met:
    """Of pairs (c, 4), the first corners of which, so many, are the one's, those that meet.

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
    here, further = distance.copy(), part.copy()
    for _ in range(LOOKS):
        free = np.maximum(here[going] - wanted / 2, 0.0) / most[going]
        going, free = going[free > SHORT], free[free > SHORT]
        if not len(going):
            break
        further[going] = np.minimum(further[going] + free, 1.0)
        found = _apart(at[going] + further[going, None, None] * ways[going], ones)
        here[going] = found[2]
        better = found[2] < (1 - NEARER) * distance[going]
        there = going[better]
        weights[there], away[there], distance[there] = (f[better] for f in found)
        part[there] = further[there]
        going = going[further[going] < 1]
    kept = distance < FAR * wanted
    if ones == 2:
        kept &= (np.abs(weights) > END).all(axis=1)
    normals = away / np.maximum(distance, 1e-300)[:, None]
    return _Met(Near(key, corners, weights, normals), part).which(kept)


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
