"""Steps that end where a body does not cross itself, though they did not know of it when they were solved.

A step is solved as if there were no other part of the body in the way. What would meet is then kept apart: with the
system A = M + dt^2 K of the step and its goal g, positions y are sought for which

    1/2 (y - g)^T A (y - g)    is least where    J y >= d,

a row for each pair that meets on the way, with the half space that it may end in (`muslin.physics.nearness`). These are
the step's own equations with contacts in them: y - g = A^-1 J^T lambda, where impulses lambda >= 0 keep apart what
touches and nothing else, so that momentum is kept and nothing is held that could slide or fall. The way there is looked
at again, and what is met now is added; it is gone as far as nothing is met (continuous collision detection), so that
the last word is not the linear system's. What cannot be gone is lost.
"""

from __future__ import annotations

import numpy as np

from muslin.physics.nearness import Near
from muslin.physics.selfcontact import KEPT, PUSH, Way
from muslin.simulation.model import Model, State
from muslin.solve import nonnegative

#: How often the way is looked at in a step at most.
ROUNDS = 8

#: Products with A^-1 in a round at most.
ITERATIONS = 30

#: What contacts give way, as a share of what a vertex of A alone does: pairs next to each other say the same twice.
COMPLIANCE = 0.01


def uncrossed(model: Model, state: State, following: State, dt: float, before: float) -> State:
    """The state that a step from one to the following really ends with; `before` is the energy there was [J].

    Its velocity is that of the way really gone. Where it is known what is put in (contacts in the system), what is lost
    of the way must not add to the energy, either: what moves relative to the whole is slowed down by as much.
    """
    contact = model.self_contact
    assert contact is not None
    push = contact.push(state.x)
    goal = following.x if push is None else following.x + push
    way = contact.way(state.x, goal)
    if way.is_free():
        if push is None:
            return following
        reached, v = goal, following.v
    else:
        reached = _Apart(model, state, dt, following.x).reached(way)
        v = following.v + (reached - following.x) / dt
    after = State(
        reached, v, following.time, following.contacts, following.pressed, following.work, following.before
    )
    if model.contact == "solve":
        model.body.update(reached)
        excess = model.energy(after) - before - (following.work - state.work)
        if excess > 0:
            after.v = _slower(model, v, excess)
    return after


class _Apart:
    """The way of a step that would cross the body with itself."""

    def __init__(self, model: Model, state: State, dt: float, goal: np.ndarray):
        assert model.self_contact is not None
        self.contact, self.model, self.goal, self.x = model.self_contact, model, goal, state.x
        body = model.body
        body.update(state.x)
        model.assemble(dt)
        if model.contact == "solve" and (touching := model.touching(state, dt)):
            model.add(touching, touching.presses, None)
        self._loose = np.repeat(1.0 / model.diagonal(dt).max(axis=1), 3)
        self._pairs: Near | None = None
        self._impulses: np.ndarray = np.zeros(0)
        model.system.solve(np.zeros_like(state.x))  # factorises

    def reached(self, way: Way) -> np.ndarray:
        """Where it may end, (n, 3)."""
        contact, here, aim = self.contact, self.x, self.goal
        for _ in range(ROUNDS):
            aim = self._aim(here, way.meets())
            way = contact.way(here, aim)
            if way.is_free():
                return aim
            share = way.reach()
            drift = contact.drift(aim - here)
            here = here + drift + share * (aim - here - drift)
            way = contact.way(here, aim)
        return here

    def _aim(self, here: np.ndarray, met: Near) -> np.ndarray:
        """The goal, but for what would meet, (n, 3)."""
        n = len(here)
        if self._pairs is None or not len(self._pairs):
            pairs, start = met, np.zeros(len(met))
        else:
            pairs = self._pairs.joined(met)
            start = np.concatenate([self._impulses, np.zeros(len(pairs) - len(self._impulses))])
        jacobian = pairs.jacobian(n)
        now = jacobian @ here.ravel()
        gap = self.contact.gap
        wanted = np.minimum(np.maximum(now, 0.0) + PUSH * gap, KEPT * gap)
        ahead = jacobian @ self.goal.ravel() - wanted
        loose = jacobian.multiply(jacobian) @ self._loose
        root = 1 / np.sqrt(loose)

        def part(y: np.ndarray) -> np.ndarray:
            return self._again((root * y) @ jacobian)

        def times(y: np.ndarray) -> np.ndarray:
            return root * (jacobian @ part(y)) + COMPLIANCE * y

        enough = PUSH / 2 * gap * root
        y = nonnegative.minimise(times, root * ahead, start / root, enough, ITERATIONS)
        kept = y > 0
        self._pairs = Near(pairs.key[kept], pairs.corners[kept], pairs.weights[kept], pairs.normals[kept])
        self._impulses = (root * y)[kept]
        return self.goal + part(y).reshape(-1, 3) if kept.any() else self.goal

    def _again(self, b: np.ndarray) -> np.ndarray:
        """A^-1 b."""
        return self.model.system.again(b.reshape(-1, 3)).ravel()


def _slower(model: Model, v: np.ndarray, energy: float) -> np.ndarray:
    """Velocities (n, 3) with so much less energy [J], or with what moves as one, and the same momentum."""
    mean = np.zeros(3) if len(model.pinned) else model.lumped @ v / model.lumped.sum()
    moving = model.body.kinetic_energy(v - mean)
    share = np.sqrt(max(1 - energy / moving, 0.0)) if moving > 0 else 0.0
    slower = mean + share * (v - mean)
    slower[model.pinned] = v[model.pinned]
    return slower
