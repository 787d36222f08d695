"""Where a body may meet colliders during a step: pairs of a collider and a vertex, with a half space for each.

A vertex may end a step anywhere in the half space n . (x - c) >= r that touches the collider, where that is then, at
the point nearest to the vertex: a convex collider lies wholly behind it, so that nothing that stays in front is inside.
What moves so far that it could pass through is followed along its way to where it would hit.

Where a sphere or capsule is thin against a triangle, the triangle's nearest point is watched as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from muslin.physics.colliders import Capsule, Collider, Contacts, Detect, Plane, Sphere

#: Share of a radius that a vertex may go in a step, relative to a collider, before its way is followed.
FAST = 0.1

#: How near [m] beside the way it makes in a step a vertex is watched, as a share of the collider's radius; to a plane.
MARGIN, NEAR = 0.1, 0.01

#: Longest edge, as a share of a collider's radius, from which on a triangle is watched and not only its corners.
THIN = 1.0

#: Points looked at along a way.
LOOKS = 24


@dataclass(frozen=True)
class Pairs:
    """What may touch in a step, one row each.

    Attributes
    ----------
    key : (c,) int64
        The collider's number, and the vertex's or, beyond all vertices, the triangle's; ascending.
    corners, weights : (c, k)
        The point of the body: vertices, k = 1, or three of each triangle, and their weights.
    normals : (c, 3)
        Out of the collider.
    gaps : (c,)
        From the point, as if the collider had already gone where it goes, to the plane it must stay in front of [m].
    velocities : (c, 3)
        Of the collider there [m/s].
    hit : (c,) bool
        Whether it will touch if it goes on as it does.
    turns : (c, k, 3, 3), optional
        Of pairs of parts of a body: what takes velocities of corners to how the points slide (`nearness.turning`).
    """

    key: np.ndarray
    corners: np.ndarray
    weights: np.ndarray
    normals: np.ndarray
    gaps: np.ndarray
    velocities: np.ndarray
    hit: np.ndarray
    turns: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.key)

    def at(self, v: np.ndarray) -> np.ndarray:
        """Velocities (c, 3) of the points, from those of the vertices (n, 3)."""
        if self.corners.shape[1] == 1:
            return v[self.corners[:, 0]]
        return np.einsum("ck,cki->ci", self.weights, v[self.corners])

    def contacts(self, least: np.ndarray, which: np.ndarray, colliders: int) -> list[Contacts]:
        """Some of them, with their least normal velocities (c,) in the collider's, collider by collider."""
        along = np.einsum("ij,ij->i", self.velocities, self.normals)
        velocities = self.velocities + (least - along)[:, None] * self.normals
        ends = np.searchsorted(self.key, np.arange(colliders + 1) * 2 * STRIDE)
        found = []
        for a, b in itertools.pairwise(ends):
            own = a + np.flatnonzero(which[a:b])
            found.append(
                Contacts(self.corners[own, 0], self.normals[own], velocities[own])
                if self.corners.shape[1] == 1
                else Contacts(self.corners[own], self.normals[own], velocities[own], self.weights[own])
            )
        return found


#: More than there are vertices or triangles.
STRIDE = 1 << 31


def meet(
    colliders: Sequence[Collider],
    x: np.ndarray,
    v: np.ndarray,
    dt: float,
    free: np.ndarray | None = None,
    detect: Detect | None = None,
    triangles: np.ndarray | None = None,
    longest: np.ndarray | None = None,
) -> Pairs:
    """Pairs of the vertices x (n, 3), moving with v, and colliders where they are at the end of a step of dt [s].

    Parameters
    ----------
    free : (n,) bool, optional
        Vertices that can be touched.
    detect : callable, optional
        Decides, instead of the framework's own geometry, which vertices would end the step inside a sphere or capsule,
        and which way is out there.
    triangles : (t, 3), optional
        The surface, and the length of each triangle's longest edge, (t,) [m].
    """
    parts = []
    moved = dt * v
    for number, collider in enumerate(colliders):
        key = np.int64(2 * number * STRIDE)
        if isinstance(collider, Plane):
            parts.append(_plane(collider, key, x, moved, free))
            continue
        parts.append(_round(collider, key, x, moved, dt, free, detect))
        if triangles is not None and longest is not None:
            large = np.flatnonzero(longest > THIN * collider.radius)
            if len(large):
                own = key + STRIDE + large
                parts.append(_triangles(collider, own, x, moved, dt, free, triangles[large]))
    return _joined(parts)


def _joined(parts: list[Pairs]) -> Pairs:
    if len(parts) == 1:
        return parts[0]
    wide = max((part.corners.shape[1] for part in parts), default=1)
    rows = []
    for part in parts:
        if part.corners.shape[1] < wide:
            padding = ((0, 0), (0, wide - 1))
            corners, weights = np.pad(part.corners, padding, "edge"), np.pad(part.weights, padding)
            part = Pairs(part.key, corners, weights, part.normals, part.gaps, part.velocities, part.hit)
        rows.append(part)
    if not rows:
        none = np.zeros(0, np.int64)
        flat = np.zeros((0, 3))
        return Pairs(none, none[:, None], np.zeros((0, 1)), flat, np.zeros(0), flat, none.astype(bool))
    names = ("key", "corners", "weights", "normals", "gaps", "velocities", "hit")
    return Pairs(*(np.concatenate([getattr(row, name) for row in rows]) for name in names))


def _of_vertices(
    key: np.int64, near: np.ndarray, n: np.ndarray, gap: np.ndarray, velocity: np.ndarray, hit: np.ndarray
) -> Pairs:
    corners = near[:, None].astype(np.int64)
    return Pairs(key + near, corners, np.ones((len(near), 1)), n, gap, velocity, hit)


def _plane(plane: Plane, key: np.int64, x: np.ndarray, moved: np.ndarray, free: np.ndarray | None) -> Pairs:
    gap, n = plane.gap(x), plane.unit_normal()
    down = moved @ n
    close = gap + 2 * min(float(down.min()), 0.0) < NEAR
    near = np.flatnonzero(close if free is None else close & free)
    gap = gap[near]
    normals = np.tile(n, (len(near), 1))
    return _of_vertices(key, near, normals, gap, np.zeros((len(near), 3)), gap + down[near] < 0)


def _round(
    collider: Sphere | Capsule,
    key: np.int64,
    x: np.ndarray,
    moved: np.ndarray,
    dt: float,
    free: np.ndarray | None,
    detect: Detect | None,
) -> Pairs:
    """Of vertices with a sphere or capsule."""
    radius = collider.radius
    center, _ = collider.nearest(x)
    away = x - center
    own = dt * _fastest(collider)
    farthest = float(np.sqrt(np.einsum("ij,ij->i", moved, moved).max())) if len(x) else 0.0
    reach = (1 + MARGIN) * radius + 2 * farthest + own
    close = np.einsum("ij,ij->i", away, away) < reach**2
    near = np.flatnonzero(close if free is None else close & free)
    if len(near) == 0:
        none = np.zeros((0, 3))
        return _of_vertices(key, near, none, np.zeros(0), none, near > 0)
    moved = moved[near]
    _, velocity = collider.nearest(x[near])
    velocity = np.zeros((len(near), 3)) + velocity
    start = x[near] + dt * velocity  # as if it had been carried along
    moved = moved - dt * velocity
    normal, gap, hit = _half_spaces(collider, start, moved)
    if detect is not None:
        hit, normal, gap = _detected(collider, start, moved, detect, hit, normal, gap)
    return _of_vertices(key, near, normal, gap, velocity, hit)


def _detected(
    collider: Sphere | Capsule,
    start: np.ndarray,
    moved: np.ndarray,
    detect: Detect,
    hit: np.ndarray,
    normal: np.ndarray,
    gap: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same by somebody's `sphere_contact`: asked whether the end of a way is inside, and what the normal is.

    What passes through in one step is outside at both ends; that stays with the geometry of its way.
    """
    there = start + moved
    center, _ = collider.nearest(there)
    away = there - center
    passes = hit & (np.einsum("ij,ij->i", away, away) > collider.radius**2)
    inside = np.array(detect(there, np.zeros_like(there) + center, collider.radius)[0] != 0)
    center, _ = collider.nearest(start)
    away = start - center
    all_around = 2 * float(np.sqrt(np.einsum("ij,ij->i", away, away).max())) + collider.radius
    slow = np.einsum("ij,ij->i", moved, moved) <= (FAST * collider.radius) ** 2
    own = detect(start, np.zeros_like(start) + center, all_around)[1]
    normal = np.where(slow[:, None], own, normal)
    gap = np.where(slow, np.einsum("ij,ij->i", normal, away) - collider.radius, gap)
    return inside | passes, normal, gap


def _fastest(collider: Sphere | Capsule) -> float:
    if isinstance(collider, Sphere):
        return float(np.linalg.norm(collider.velocity))
    return max(float(np.linalg.norm(collider.velocity_a)), float(np.linalg.norm(collider.velocity_b)))


def _half_spaces(
    collider: Sphere | Capsule, start: np.ndarray, moved: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals, gaps, and whether a way touches, for points that go from `start` by `moved`, both (k, 3)."""
    radius = collider.radius
    point = start
    fast = np.einsum("ij,ij->i", moved, moved) > (FAST * radius) ** 2
    if fast.any():
        point = start.copy()
        point[fast] = _met(collider, start[fast], moved[fast])
    center, _ = collider.nearest(point)
    away = point - center
    distance = np.sqrt(np.einsum("ij,ij->i", away, away))
    if not distance.all():
        away = np.where(distance[:, None] > 0, away, (0.0, 1.0, 0.0))
        distance = np.where(distance > 0, distance, 1.0)
    normal = away / distance[:, None]
    gap = np.einsum("ij,ij->i", normal, start - center) - radius
    return normal, gap, gap + np.einsum("ij,ij->i", normal, moved) < 0


def _met(collider: Sphere | Capsule, start: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Where ways first touch a collider, or come nearest to it, (k, 3).

    By going on as far as is certain to be free; what did not arrive stays where it is, in front of the collider.
    """
    length = np.maximum(np.sqrt(np.einsum("ij,ij->i", moved, moved)), 1e-300)
    part: np.ndarray = np.zeros(len(start))
    nearest: np.ndarray = np.full(len(start), np.inf)
    best: np.ndarray = np.zeros(len(start))
    for _ in range(LOOKS):
        point = start + part[:, None] * moved
        center, _ = collider.nearest(point)
        away = point - center
        free = np.sqrt(np.einsum("ij,ij->i", away, away)) - collider.radius
        closer = free < nearest
        nearest, best = np.where(closer, free, nearest), np.where(closer, part, best)
        part = np.minimum(part + np.maximum(free, 0.0) / length, 1.0)
    return start + best[:, None] * moved


def _triangles(
    collider: Sphere | Capsule,
    key: np.ndarray,
    x: np.ndarray,
    moved: np.ndarray,
    dt: float,
    free: np.ndarray | None,
    triangles: np.ndarray,
) -> Pairs:
    """Of triangles with a sphere or capsule: their points nearest to its middle, where those are not corners."""
    corners, way = x[triangles], moved[triangles].mean(axis=1)
    middle = corners.mean(axis=1)
    size = np.sqrt(np.einsum("tki,tki->tk", corners - middle[:, None], corners - middle[:, None]).max(axis=1))
    center, velocity = collider.nearest(middle)
    far = np.sqrt(np.einsum("ij,ij->i", way, way)) + dt * _fastest(collider)
    close = np.linalg.norm(middle - center, axis=1) < (1 + MARGIN) * collider.radius + size + 2 * far
    near = np.flatnonzero(close if free is None else close & free[triangles].all(axis=1))
    corners, way, middle = corners[near], way[near], middle[near]
    velocity = np.zeros((len(near), 3)) + collider.nearest(middle)[1]
    carried, relative = corners + dt * velocity[:, None], way - dt * velocity
    point = middle + dt * velocity
    if len(near):  # in the middle of a triangle's way past the collider, where that is fast
        there = _met(collider, point, relative)
        shift = (there - point)[:, None]
        for _ in range(4):  # between two convex sets: nearest points, in turn
            weights = nearest_weights(_middle(collider, point), carried + shift)
            point = np.einsum("tk,tki->ti", weights, carried + shift)
    else:
        weights = np.zeros((0, 3))
    start = np.einsum("tk,tki->ti", weights, carried)
    center = _middle(collider, point)
    away = point - center
    distance = np.sqrt(np.einsum("ij,ij->i", away, away))
    inside = (weights > 1e-9).sum(axis=1) > 1  # not a corner: those are met by themselves
    kept = np.flatnonzero(inside & (distance > 0))
    normal = away[kept] / distance[kept, None]
    gap = np.einsum("ij,ij->i", normal, start[kept] - center[kept]) - collider.radius
    going = np.einsum("tk,tki->ti", weights[kept], moved[triangles[near[kept]]]) - dt * velocity[kept]
    hit = gap + np.einsum("ij,ij->i", normal, going) < 0
    picked = triangles[near[kept]].astype(np.int64)
    return Pairs(key[near[kept]], picked, weights[kept], normal, gap, velocity[kept], hit)


def _middle(collider: Sphere | Capsule, points: np.ndarray) -> np.ndarray:
    """Where to measure from, for each of (k, 3) points."""
    return np.broadcast_to(collider.nearest(points)[0], points.shape)


def nearest_weights(p: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (t, 3) of the points of triangles (t, 3, 3) nearest to points (t, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    e, f, d = b - a, c - a, p - a
    ee, ef, ff = (np.einsum("ij,ij->i", s, t) for s, t in ((e, e), (e, f), (f, f)))
    de, df = np.einsum("ij,ij->i", d, e), np.einsum("ij,ij->i", d, f)
    area = np.maximum(ee * ff - ef * ef, 1e-300)
    s, t = (ff * de - ef * df) / area, (ee * df - ef * de) / area
    best = np.stack([1 - s - t, s, t], axis=1)
    outside = best.min(axis=1) < 0
    if not outside.any():
        return best
    least = np.full(len(p), np.inf)
    edges = np.zeros_like(best)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        along = corners[:, j] - corners[:, i]
        part = np.einsum("ij,ij->i", p - corners[:, i], along) / np.maximum(
            np.einsum("ij,ij->i", along, along), 1e-300
        )
        part = np.clip(part, 0.0, 1.0)
        away = p - corners[:, i] - part[:, None] * along
        distance = np.einsum("ij,ij->i", away, away)
        row = np.zeros_like(best)
        row[:, i], row[:, j] = 1 - part, part
        edges = np.where((distance < least)[:, None], row, edges)
        least = np.minimum(distance, least)
    return np.where(outside[:, None], edges, best)
