"""What cloth can bump into: spheres, capsules and planes that may move, all answered by one velocity filter.

A sphere or capsule gives, for every vertex, the nearest centre to measure from; detection is then the student's
`sphere_contact`. A plane is a floor, and exact: every vertex near it may come as close as the floor in one
step, which is the same filter relative to a collider that retreats at gap/dt. The response is always the
student's `filter_velocity`, on the velocity relative to the collider.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

#: Tasks behind each part of a contact.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"detection": ("sphere_contact",), "response": ("filter_velocity",)}
)

#: (positions (k, 3), centres (k, 3), radius) -> (hit (k,), normals (k, 3))
Detect = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]
#: (velocities (k, 3), normals (k, 3)) -> filtered velocities (k, 3)
Filter = Callable[[np.ndarray, np.ndarray], np.ndarray]
Vec = tuple[float, float, float]


@dataclass(frozen=True)
class Sphere:
    """Ball with centre [m], radius [m] and velocity [m/s]."""

    center: Vec
    radius: float
    velocity: Vec = (0.0, 0.0, 0.0)

    def nearest(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Point to measure from, and the collider's velocity there, for positions (n, 3): the same for all, (3,)."""
        return np.asarray(self.center), np.asarray(self.velocity)


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
    """Half space below a plane through `point` [m] with a normal [1], at rest."""

    point: Vec
    normal: Vec

    def gap(self, x: np.ndarray) -> np.ndarray:
        """Height of positions (n, 3) above the plane, (n,) [m]."""
        return (x - np.asarray(self.point)) @ self.unit_normal()

    def unit_normal(self) -> np.ndarray:
        """The normal, of length one."""
        return np.asarray(self.normal) / np.linalg.norm(self.normal)


Collider = Sphere | Capsule | Plane

#: How contacts are answered: the velocity is filtered after the system is solved (S10), or they are part of it.
CONTACT = ("filter", "solve")


@dataclass(frozen=True)
class Contacts:
    """Vertices in contact: their numbers (k,), outward normals (k, 3), the collider's velocity there (k, 3).

    With `weights` (k, 3) it is points of triangles that touch, and `vertices` are (k, 3).
    """

    vertices: np.ndarray
    normals: np.ndarray
    velocities: np.ndarray
    weights: np.ndarray | None = None

    def at(self, v: np.ndarray) -> np.ndarray:
        """Velocities (k, 3) of what touches, from those of all vertices (n, 3)."""
        there = v[self.vertices]
        return there if self.weights is None else np.einsum("ck,cki->ci", self.weights, there)


#: How near [m] a vertex must be to a plane to be watched, beside the way the fastest makes in a step.
NEAR = 0.25

#: How fast [m/s] a plane pushes out what began inside it.
PUSH = 1.0


def detect(
    collider: Collider,
    x: np.ndarray,
    v: np.ndarray,
    dt: float,
    contact: Detect | None = None,
    free: np.ndarray | None = None,
) -> Contacts:
    """Vertices of x (n, 3) to filter in a step of dt [s], of those that are `free` (n,).

    `contact`, if it is given, decides about spheres and capsules.
    """
    if isinstance(collider, Plane):
        gap = collider.gap(x)
        close = gap < NEAR + 2 * dt * float(np.abs(v).max())
        near = np.flatnonzero(close if free is None else close & free)
        n = collider.unit_normal()
        back = np.minimum(-gap[near, None] / dt, PUSH)
        return Contacts(near, np.broadcast_to(n, (len(near), 3)), back * n)
    center, _ = collider.nearest(x)
    away = x - center
    close = np.einsum("ij,ij->i", away, away) <= (1.01 * collider.radius) ** 2
    near = np.flatnonzero(close if free is None else close & free)
    if len(near) == 0:
        return Contacts(near, np.zeros((0, 3)), np.zeros((0, 3)))
    there = x.take(near, axis=0)
    center, velocity = collider.nearest(there)
    if contact is not None:
        hit, normal = contact(there, center, collider.radius)
        hit = hit != 0
    else:
        away = there - center
        distance = np.sqrt(np.einsum("ij,ij->i", away, away))
        hit = distance < collider.radius
        if not distance.all():
            away[distance == 0] = (0.0, 1.0, 0.0)
        normal = away / np.where(distance > 0, distance, 1.0)[:, None]
    return Contacts(near[hit], normal[hit], (np.zeros_like(there) + velocity)[hit])


def respond(v: np.ndarray, contacts: list[Contacts], filtered: Filter | None = None) -> np.ndarray:
    """Filter the velocities (n, 3) at the contacts, as `filtered` does if it is given.

    Where a vertex touches several colliders the filters are applied in turn until none undoes another (in a
    narrowing gap there may be no such velocity; then the last word is the last collider's).
    """
    v = v.copy()
    contacts = [contact for contact in contacts if len(contact.vertices)]
    for _ in range(ROUNDS):
        for contact in contacts:
            if contact.weights is None:
                relative = v[contact.vertices] - contact.velocities
                if filtered is not None:
                    relative = filtered(relative, contact.normals)
                else:
                    inward = np.minimum(np.einsum("ij,ij->i", relative, contact.normals), 0.0)
                    relative = relative - inward[:, None] * contact.normals
                v[contact.vertices] = relative + contact.velocities
            else:
                _hold(v, contact)
        if len(contacts) < 2 or min(float(approach(v, contact).min()) for contact in contacts) > -1e-9:
            break
    return v


def _hold(v: np.ndarray, contact: Contacts) -> None:
    """Filter points of triangles, one after the other, by moving the corners as much as each weighs."""
    assert contact.weights is not None
    for row in np.flatnonzero(approach(v, contact) < 0):
        corners, w, n = contact.vertices[row], contact.weights[row], contact.normals[row]
        inward = float((w @ v[corners] - contact.velocities[row]) @ n)
        if inward < 0:
            np.add.at(v, corners, -inward / float(w @ w) * w[:, None] * n)


#: Times round the colliders at most.
ROUNDS = 30


def approach(v: np.ndarray, contact: Contacts) -> np.ndarray:
    """Normal velocity, relative to the collider, of the vertices in contact, (k,) [m/s]."""
    return np.einsum("ij,ij->i", contact.at(v) - contact.velocities, contact.normals)


def depth(collider: Collider, x: np.ndarray) -> float:
    """How deep the deepest of the positions (n, 3) is inside a collider [m]; 0 if none is."""
    if isinstance(collider, Plane):
        return max(0.0, -float(collider.gap(x).min()))
    center, _ = collider.nearest(x)
    away = x - center
    return max(0.0, collider.radius - float(np.einsum("ij,ij->i", away, away).min()) ** 0.5)
