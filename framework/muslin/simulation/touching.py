"""Contact and friction in the system that a step solves, pair by pair (`muslin.physics.meeting`).

To the function of the velocities v that a step minimises each pair adds

    k/2 min(0, n . (u - u_c) + g/dt)^2    and    c/2 |t (u - u_c)|^2,    c = mu lambda / s

with the velocity u of the point that touches, the collider's u_c there, the gap g, the normal n, t = 1 - n n^T and a
stiffness k so large that next to nothing is left for the filter afterwards. So a vertex may go as far as the surface
and no further. Friction is Coulomb's: its impulse mu lambda is known from the normal one of the step before; s is the
speed at which the point will slide, extrapolated, so that the impulse c s is mu lambda; where it will not slide, c is
k, and the point holds until that needs more than mu lambda. Both terms are convex, and the second takes energy only.

What is already inside is not pushed out with a velocity: it is moved out, without its velocity knowing (`guarded`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from muslin.physics.colliders import Contacts
from muslin.physics.meeting import Pairs
from muslin.solve import nonnegative

#: How much harder a contact is than the hardest vertex of the body in this step.
HARDER = 1e6

#: Depths [m] that are no more than the rounding of a turning collider's way: they are left with the velocity.
SHALLOW = 1e-5

#: Of the search for what pairs push with that have vertices in common: how exact it is, how much each gives way, and
#: its steps at most.
EXACT, COMPLIANCE, ROUNDS = 1e-3, 1e-6, 100

#: Share of what pushes from which on it matters that others pull.
PULLED = 0.1

#: How fast [m/s] penetration is taken back at most.
LIFTED = 1.0


def _none(*shape: int) -> np.ndarray:
    return np.zeros((0, *shape))


@dataclass(frozen=True)
class Pressed:
    """Pairs that pressed in a step, by `key` (c,), ascending.

    Attributes
    ----------
    impulse : (c,)
        Along the normal [N s].
    slide : (c, 3)
        Velocity relative to the collider in its tangent plane [m/s].
    speed : (c,)
        At which it will slide in the next step, where there is friction; 0: it holds [m/s].
    """

    key: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    impulse: np.ndarray = field(default_factory=_none)
    slide: np.ndarray = field(default_factory=lambda: _none(3))
    speed: np.ndarray = field(default_factory=_none)

    def __len__(self) -> int:
        return len(self.key)


class Touching:
    """What contact and friction add to a step.

    Parameters
    ----------
    pairs : Pairs
    pressed : Pressed
        Of the step before.
    dt : float
        [s]
    stiffness : float or (c,) array
        k [kg].
    friction : float
        mu.
    """

    def __init__(
        self,
        pairs: Pairs,
        pressed: Pressed,
        dt: float,
        stiffness: float | np.ndarray,
        friction: float = 0.0,
    ):
        count = len(pairs)
        self.pairs, self.dt, self.friction = pairs, dt, friction
        self.stiffness = np.broadcast_to(stiffness, count)
        along = np.einsum("ij,ij->i", pairs.normals, pairs.velocities)
        self.inside = pairs.gaps < -SHALLOW
        #: least normal velocity of each pair's point, (c,) [m/s]
        self.least = along - np.where(self.inside, 0.0, pairs.gaps) / dt
        where = np.searchsorted(pressed.key, pairs.key)
        where = np.minimum(where, max(len(pressed) - 1, 0))
        known = pressed.key[where] == pairs.key if len(pressed) else np.zeros(count, bool)
        #: which are expected to press
        self.presses = pairs.hit | known | self.inside
        self.known = np.flatnonzero(known)
        self._slid = np.zeros((count, 3))
        self.grip = np.zeros(count)  # c
        self._lag = np.zeros(count)
        if friction and len(self.known):
            before = where[self.known]
            self._slid[self.known] = pressed.slide[before]
            self._lag[self.known] = pressed.impulse[before]
            speed = np.maximum(pressed.speed[before], 1e-300)
            self.grip[self.known] = np.minimum(
                friction * pressed.impulse[before] / speed, self.stiffness[self.known]
            )
        self.rubs = bool(self.grip.any())

    def reach_out(self) -> None:
        """Let what is inside end outside, too: where a step begins that is not where things are."""
        self.least = self.least - np.where(self.inside, self.pairs.gaps, 0.0) / self.dt
        self.inside = np.zeros(len(self.pairs), bool)

    def slides(self, v: np.ndarray) -> np.ndarray:
        """How fast points slide at velocities (3n,), (c,) [m/s]."""
        return np.asarray(np.linalg.norm(self._along(v)[2], axis=1))

    def _along(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Velocity of the points relative to the colliders, how much of it is inwards of the least, and across."""
        u = self.pairs.at(v.reshape(-1, 3))
        inwards = np.einsum("ij,ij->i", self.pairs.normals, u) - self.least
        relative = u - self.pairs.velocities
        if self.pairs.turns is not None:
            relative = np.einsum("ckij,ckj->ci", self.pairs.turns, v.reshape(-1, 3)[self.pairs.corners])
        across = relative - np.einsum("ij,ij->i", self.pairs.normals, relative)[:, None] * self.pairs.normals
        return u, inwards, across

    def value(self, v: np.ndarray) -> float:
        """What is added to the function, for velocities (3n,) [J]."""
        _, inwards, across = self._along(v)
        phi = float(np.sum(self.stiffness / 2 * np.minimum(inwards, 0.0) ** 2))
        return phi + float(self.grip @ np.einsum("ij,ij->i", across, across)) / 2

    def gradient(self, v: np.ndarray) -> np.ndarray:
        """Its gradient, like v [N s]."""
        _, inwards, across = self._along(v)
        push, rub = self.stiffness * np.minimum(inwards, 0.0), self.grip[:, None] * across
        if self.pairs.turns is None:
            return self.spread(push[:, None] * self.pairs.normals + rub, v.size // 3).ravel()
        turned = np.einsum("ckij,ci->ckj", self.pairs.turns, rub)
        return (
            self.spread(push[:, None] * self.pairs.normals, v.size // 3) + self._summed(turned, v)
        ).ravel()

    def rounding(self, v: np.ndarray) -> np.ndarray:
        """Rounding error of the gradient, like v [N s]: a contact is so hard that the velocity's own shows."""
        u, inwards, _ = self._along(v)
        size = np.where(inwards < 0, self.stiffness, 0.0) * (np.linalg.norm(u, axis=1) + np.abs(self.least))
        rows = 4 * np.finfo(float).eps * size[:, None] * np.abs(self.pairs.normals)
        return self.spread(rows, v.size // 3).ravel()

    def spread(self, rows: np.ndarray, n: int) -> np.ndarray:
        """Sum one row (c, 3) for each point into (n, 3), as much to each corner as it weighs."""
        out = np.zeros((n, 3))
        for k in range(self.pairs.corners.shape[1]):
            corner, part = self.pairs.corners[:, k], self.pairs.weights[:, k, None] * rows
            for a in range(3):
                out[:, a] += np.bincount(corner, part[:, a], n)
        return out

    def _summed(self, rows: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Sum a row for each corner, (c, k, 3), into (n, 3)."""
        corners, flat = self.pairs.corners.ravel(), rows.reshape(-1, 3)
        return np.stack([np.bincount(corners, flat[:, a], v.size // 3) for a in range(3)], axis=1)

    def push(self, v: np.ndarray, presses: np.ndarray) -> np.ndarray:
        """What these pairs add to the gradient, like v, whether or not they press at v."""
        push = np.where(presses, self.stiffness * self._along(v)[1], 0.0)
        return self.spread(push[:, None] * self.pairs.normals, v.size // 3).ravel()

    def pushes(self, v: np.ndarray, presses: np.ndarray) -> np.ndarray:
        """How hard these pairs push at velocities (3n,) that were solved for with them, (c,) [N s].

        What pulls does not, and others push so much less: of too many pairs that hold a surface, some do.
        """
        push = np.where(presses, -self.stiffness * self._along(v)[1], 0.0)
        pushing = np.maximum(push, 0.0)
        return np.asarray(pushing * max(push.sum(), 0.0) / max(pushing.sum(), 1e-300))

    def pressing(self, v: np.ndarray, almost: float = 0.0) -> np.ndarray:
        """Which pairs press at velocities (3n,), or almost, by so much [m/s], (c,) bool."""
        return self._along(v)[1] < almost

    def release(self, v: np.ndarray) -> bool:
        """Expect those no longer to press that pull at velocities (3n,), if that is a large part of what pushes.

        Only where points of triangles are among them. Two of these and a corner may contradict each other by little,
        and where both hold fast a third corner far off has to make up for it, with that little over its small weight.
        """
        if self.pairs.corners.shape[1] == 1:
            return False
        push = np.where(self.presses, -self.stiffness * self._along(v)[1], 0.0)
        if -push[push < 0].sum() <= PULLED * push[push > 0].sum():
            return False
        self.presses = self.presses & (push >= 0)
        return True

    def deepest(self, v: np.ndarray) -> float:
        """How fast the point that goes inwards fastest does so, beyond what it may [m/s]."""
        return -float(self._along(v)[1].min(initial=0.0))

    def blocks(self, presses: np.ndarray) -> np.ndarray:
        """Hessian of what each pair adds, in its point, (c, 3, 3) [kg], where these press."""
        n = self.pairs.normals
        normal = np.where(presses, self.stiffness, 0.0)
        blocks = (normal - self.grip)[:, None, None] * n[:, :, None] * n[:, None, :]
        blocks[:, [0, 1, 2], [0, 1, 2]] += self.grip[:, None]
        return blocks

    def matrix(self, presses: np.ndarray, n: int) -> sp.csc_matrix:
        """Hessian of what all pairs add, (3n, 3n) [kg], where these press."""
        which = np.flatnonzero(presses | (self.grip > 0))
        corners, weights, turns = self.pairs.corners[which], self.pairs.weights[which], self.pairs.turns
        rows = (weights[:, :, None] * weights[:, None, :])[:, :, :, None, None]
        if turns is None:
            values = rows * self.blocks(presses)[which][:, None, None]
        else:
            along = self.pairs.normals[which, :, None] * self.pairs.normals[which, None, :]
            held = np.where(presses, self.stiffness, 0.0)[which, None, None] * along
            rubbed = self.grip[which, None, None] * (np.eye(3) - along)
            turned = np.einsum("cab,clbj->claj", rubbed, turns[which])
            values = rows * held[:, None, None] + np.einsum("ckai,claj->cklij", turns[which], turned)
        unknown = 3 * corners[:, :, None] + np.arange(3)
        row = np.broadcast_to(unknown[:, :, None, :, None], values.shape)
        col = np.broadcast_to(unknown[:, None, :, None, :], values.shape)
        return sp.csc_matrix((values.ravel(), (row.ravel(), col.ravel())), shape=(3 * n, 3 * n))

    def pull(self, presses: np.ndarray, n: int) -> np.ndarray:
        """Right-hand side (n, 3) of a system to which `blocks` were added [N s]."""
        normals, velocities = self.pairs.normals, self.pairs.velocities
        rows = np.where(presses, self.stiffness * self.least, 0.0)[:, None] * normals
        if self.rubs:
            across = velocities - np.einsum("ij,ij->i", normals, velocities)[:, None] * normals
            rows = rows + self.grip[:, None] * across
        return self.spread(rows, n)

    def contacts(self, which: np.ndarray, colliders: int) -> list[Contacts]:
        """Those of some pairs, for the filter and the log."""
        return self.pairs.contacts(self.least, which, colliders)

    def impulses(
        self,
        solved: np.ndarray,
        v: np.ndarray,
        presses: np.ndarray,
        mass: np.ndarray,
        unbalanced: np.ndarray | None = None,
        lumped: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Normal impulses (c,) and those of friction (c, 3) [N s]: of the system solved, and of the filter after it.

        `unbalanced` is the gradient (n, 3) that is left where the system was not solved to its end [N s]: what a pair
        would push with there, nothing holds against, and it did not. `lumped` are the masses (n,) of the vertices.
        """
        _, inwards, across = self._along(solved)
        filtered = np.einsum("ij,ij->i", self.pairs.normals, self.pairs.at(v - solved))
        rub = -self.grip[:, None] * across
        push = np.where(presses, -self.stiffness * inwards, 0.0)
        if unbalanced is not None and self.pairs.corners.shape[1] == 1:
            held = np.einsum("ij,ij->i", self.pairs.normals, self.pairs.at(unbalanced))
            push = np.where(presses, np.maximum(push + held, 0.0) + mass * np.maximum(filtered, 0.0), 0.0)
        elif unbalanced is not None:
            assert lumped is not None
            got = unbalanced - self.gradient(solved.ravel()).reshape(-1, 3) + lumped[:, None] * (v - solved)
            push, rub = self._shared(got, presses, rub)
        caught = ~presses & (inwards < 0)
        push[caught] = (mass * filtered)[caught]
        return push, rub

    def _shared(self, got: np.ndarray, presses: np.ndarray, rub: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of pairs that press, normal impulses (c,) and those of friction (c, 3), by what vertices got (n, 3) [N s].

        None pulls, none rubs with more than its point got, and together they come nearest to all of it. Points of
        triangles have vertices in common, and what one of them pushes with on a long lever another takes back: taken
        one by one they could be any size.
        """
        n, own = self.pairs.normals, np.einsum("ck,ck->c", self.pairs.weights, self.pairs.weights)
        across = self.pairs.at(got) / own[:, None]
        across -= np.einsum("ij,ij->i", n, across)[:, None] * n
        size = np.maximum(np.linalg.norm(rub, axis=1), 1e-300)
        rub = rub * np.minimum(np.linalg.norm(across, axis=1) / size, 1.0)[:, None]
        got = got - self.spread(rub, len(got))
        which, push = np.flatnonzero(presses), np.zeros(len(presses))
        if not len(which):
            return push, rub
        corners, weights = self.pairs.corners[which], self.pairs.weights[which]
        rows = np.repeat(np.arange(len(which)), 3 * weights.shape[1])
        columns = 3 * corners[:, :, None] + np.arange(3)
        entries = weights[:, :, None] * n[which][:, None, :]
        J = sp.csr_matrix((entries.ravel(), (rows, columns.ravel())), shape=(len(which), got.size))
        root = 1 / np.sqrt(own[which])

        def times(y: np.ndarray) -> np.ndarray:
            return np.asarray(root * (J @ ((root * y) @ J)) + COMPLIANCE * y)

        b = -root * (J @ got.ravel())
        enough = np.full(len(which), EXACT * float(np.abs(b).max()))
        push[which] = root * nonnegative.minimise(times, b, np.zeros(len(which)), enough, ROUNDS)
        return push, rub

    def work(self, push: np.ndarray, rub: np.ndarray) -> float:
        """What moving colliders do, by these impulses [J]."""
        return float(np.sum((push[:, None] * self.pairs.normals + rub) * self.pairs.velocities))

    def after(self, push: np.ndarray, rub: np.ndarray, v: np.ndarray, mass: np.ndarray) -> Pressed:
        """What pressed, by its impulses, at the velocities (n, 3) that a step ended with; `mass` (c,) of the points."""
        which = np.flatnonzero(push > 0)
        _, _, across = self._along(v)
        slide, push = across[which], push[which]
        speed = np.zeros(len(which))
        if self.friction:
            now = np.linalg.norm(slide, axis=1)
            held = self.grip[which] >= self.stiffness[which]
            needed = np.linalg.norm(rub[which], axis=1)
            slips = (needed - self.friction * push) / mass[which]
            before = np.linalg.norm(self._slid[which], axis=1)
            turned = np.einsum("ij,ij->i", slide, self._slid[which]) < 0
            slid = self._lag[which] > 0
            going = np.where(slid & ~held, np.where(turned, 0.0, 2 * now - before), now)
            speed = np.maximum(np.where(held, slips, going), 0.0)
        return Pressed(self.pairs.key[which], push, slide, speed)
