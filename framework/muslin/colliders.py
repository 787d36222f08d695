"""What cloth can bump into: spheres, capsules and planes that may move, all answered by one velocity filter.

A collider gives, for every vertex, the nearest centre to measure from; detection is then the student's
`sphere_contact` (or a plane's side) and the response the student's `filter_velocity`, on the velocity relative
to the collider.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.tasks import Functions

Vec = tuple[float, float, float]


@dataclass(frozen=True)
class Sphere:
    """Ball with centre [m], radius [m] and velocity [m/s]."""

    center: Vec
    radius: float
    velocity: Vec = (0.0, 0.0, 0.0)

    def nearest(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Point to measure from, and the collider's velocity there, for each of (n, 3) positions."""
        return np.broadcast_to(self.center, x.shape), np.broadcast_to(self.velocity, x.shape)


@dataclass(frozen=True)
class Capsule:
    """Segment from a to b [m] with a radius [m]; its ends move with their own velocities [m/s]."""

    a: Vec
    b: Vec
    radius: float
    velocity_a: Vec = (0.0, 0.0, 0.0)
    velocity_b: Vec = (0.0, 0.0, 0.0)

    def nearest(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nearest point of the segment, and its velocity, for each of (n, 3) positions."""
        a, ab = np.asarray(self.a), np.subtract(self.b, self.a)
        t = np.clip((x - a) @ ab / max(float(ab @ ab), 1e-300), 0.0, 1.0)[:, None]
        va, vb = np.asarray(self.velocity_a), np.asarray(self.velocity_b)
        return a + t * ab, va + t * (vb - va)


@dataclass(frozen=True)
class Plane:
    """Half space below a plane through `point` [m] with unit normal `normal`, moving with a velocity [m/s]."""

    point: Vec
    normal: Vec
    velocity: Vec = (0.0, 0.0, 0.0)


Collider = Sphere | Capsule | Plane


@dataclass(frozen=True)
class Contacts:
    """Vertices in contact: their numbers (k,), outward normals (k, 3), the collider's velocity there (k, 3)."""

    vertices: np.ndarray
    normals: np.ndarray
    velocities: np.ndarray


def detect(collider: Collider, x: np.ndarray, functions: Functions | None = None) -> Contacts:
    """Vertices of x (n, 3) inside a collider, by the student's `sphere_contact` where functions are given."""
    if isinstance(collider, Plane):
        n = np.asarray(collider.normal) / np.linalg.norm(collider.normal)
        inside = np.flatnonzero((x - np.asarray(collider.point)) @ n < 0)
        normals = np.broadcast_to(n, (len(inside), 3))
        return Contacts(inside, normals, np.broadcast_to(collider.velocity, normals.shape))
    center, velocity = collider.nearest(x)
    near = np.flatnonzero(np.abs(x - center).max(axis=1) <= 1.01 * collider.radius)
    if functions is not None:
        from muslin.batch import evaluate

        hit, normal = evaluate(functions.sphere_contact, x=x[near], c=center[near], r=collider.radius)
    else:
        away = x[near] - center[near]
        distance = np.linalg.norm(away, axis=1)
        hit = distance < collider.radius
        normal = np.where(distance[:, None] > 0, away / np.maximum(distance, 1e-300)[:, None], (0.0, 1.0, 0.0))
    inside = near[hit != 0]
    return Contacts(inside, normal[hit != 0], velocity[inside])


def respond(v: np.ndarray, contacts: list[Contacts], functions: Functions | None = None) -> np.ndarray:
    """Filter the velocities (n, 3) at the contacts.

    Where a vertex touches several colliders the filters are applied in turn, a few times round, since one can
    undo another.
    """
    v = v.copy()
    touched = np.concatenate([c.vertices for c in contacts]) if contacts else np.empty(0, int)
    rounds = 1 if len(np.unique(touched)) == len(touched) else 4
    for _ in range(rounds):
        for contact in contacts:
            if len(contact.vertices):
                relative = v[contact.vertices] - contact.velocities
                v[contact.vertices] = _filter(relative, contact.normals, functions) + contact.velocities
    return v


def _filter(v: np.ndarray, n: np.ndarray, functions: Functions | None) -> np.ndarray:
    if functions is not None:
        from muslin.batch import evaluate

        return evaluate(functions.filter_velocity, v=v, n=n)
    approach = np.minimum(np.einsum("ij,ij->i", v, n), 0.0)
    return v - approach[:, None] * n
