"""Steps that end where a body does not cross itself, though they did not know of it when they were solved.

Where a step leads through something, velocities v are sought that would have been its own, had it known: with

    Phi(v) = 1/2 v^T M v + V(q + dt v)

and its own answer w, they minimise Phi(v) - Phi'(w) v + S(v), which without S is least at w. S has a one-sided spring
for each pair of points that meets on the way (`muslin.physics.nearness`), as there is one for each contact with a
collider (`touching`), and friction where they press (`rubbing`). Springs act between parts of the body, so that
momentum is kept; they push and never pull, so that nothing is held that could slide or fall. The energies V are the
body's own, not a linear system's word: a push must not strain the body more than it has to. Then the way is looked at
again, and what is met now is added.

It is gone as far as nothing is met (continuous collision detection); what cannot be gone is lost.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from muslin.physics.meeting import Pairs
from muslin.physics.nearness import Near, turning
from muslin.physics.selfcontact import KEPT, NEAREST, PUSH, Way
from muslin.simulation import guarded
from muslin.simulation.model import Model, State
from muslin.simulation.rubbing import Rubbing
from muslin.simulation.touching import SHALLOW, Pressed, Touching

#: How often the way is looked at in a step at most, and iterations of Newton's method each time.
ROUNDS, ITERATIONS = 8, 6

#: How much harder the springs are than the body is where they act.
HARDER = 100.0

#: Share of the gap to which what is nearer than `NEAREST` is brought apart: hardly further, it falls back unrubbed.
LIFT = 0.3

#: What opens more slowly [m/s] is as hard for Newton's method as what presses: of points of what lies flat these and
#: those press in turn, and each step would be halved.
ALMOST = 1e-3

#: Share of the gap by which points may go on after Newton's method beyond where they are to end.
DEEPEST = 0.1

#: Share of the slope's promise that one of Newton's steps must keep, and how often it, or a way, is halved at most.
KEEPS, HALVES = 1e-4, 10

#: Share of the energy that is its rounding.
ROUNDING = 1e-12


def uncrossed(model: Model, state: State, following: State, dt: float, before: float) -> State:
    """The state that a step from one to the following really ends with; `before` is the energy there was [J].

    Its velocity is that of the way really gone. Where it is known what is put in (contacts in the system), the energy
    does not rise by what is done here: what moves relative to the whole is slowed down, and if that is not enough, goes
    less far.
    """
    contact = model.self_contact
    assert contact is not None
    way = contact.way(state.x, following.x)
    unheld = way.is_unheld()
    if unheld and not way.is_near:
        return following
    apart = _Apart(model, state, following, dt, way)
    reached = following.x if unheld else apart.reached()
    v = following.v + (reached - following.x) / dt
    after = dataclasses.replace(following, x=reached, v=v, before=None)
    if model.contact == "solve":
        after = _guarded(model, state, after, before)
    return apart.lifted(after)


def _guarded(model: Model, state: State, following: State, before: float) -> State:
    """As far of a step as adds no energy beyond its work, with the body updated to there."""
    most = before + following.work - state.work + ROUNDING * abs(before)
    way, v = following.x - state.x, following.v
    drift, mean = (model.lumped @ u / model.lumped.sum() for u in (way, v))
    for part in 0.5 ** np.arange(HALVES):
        x = state.x + drift + part * (way - drift)
        after = dataclasses.replace(following, x=x, v=mean + part * (v - mean))
        model.body.update(x)
        if (excess := model.energy(after) - most) > 0:
            after.v = _slower(model, after.v, excess)
        if model.energy(after) <= most:
            break
    return after


class _Apart:
    """The way of a step that would cross the body with itself."""

    def __init__(self, model: Model, state: State, following: State, dt: float, way: Way):
        assert model.self_contact is not None
        self._contact, self._model, self._dt = model.self_contact, model, dt
        self._x = state.x
        self._own = (following.x - state.x) / dt
        self._before = state.v.ravel()
        self._met: Near | None = None
        self._rubbing: Rubbing | None = None
        body = model.body
        body.update(state.x)
        model.prepare()
        self._loose = 1.0 / model.diagonal(dt).max(axis=1)
        hard = model.touching(state, dt) if model.contact == "solve" else None
        self._least = self._kept(hard) if hard else np.zeros(0)
        self._colliders = [self._softer(hard, state.pressed)] if hard else []
        self._touching = self._colliders
        body.update(following.x)
        self._slope = self._gradient(self._own)
        self._meet(way)

    def reached(self) -> np.ndarray:
        """Where the way may end, (n, 3)."""
        x, v = self._x, self._own
        for _ in range(ROUNDS):
            v = self._solved(v)
            goal = x + self._dt * v
            way = self._contact.way(x, goal)
            if way.is_free() and not self._sinks(v):
                return goal
            self._meet(way)
        drift = self._contact.drift(goal - x)
        return self._outside(x + drift + way.reach() * (goal - x - drift))

    def _outside(self, x: np.ndarray) -> np.ndarray:
        """Positions (n, 3) with vertices back out of colliders that the whole was taken into, as far as they may go."""
        if not self._colliders:
            return x
        pairs = self._colliders[0].pairs
        ends = self._x[pairs.corners[:, 0]] + self._dt * self._least[:, None] * pairs.normals
        short = np.einsum("ij,ij->i", pairs.normals, ends - x[pairs.corners[:, 0]])
        short[(pairs.weights[:, 0] < 1) | (short < 0)] = 0.0
        back = np.zeros_like(x)
        np.add.at(back, pairs.corners[:, 0], short[:, None] * pairs.normals)
        return x + self._contact.way(x, x + back).reach() * back if back.any() else x

    def lifted(self, after: State) -> State:
        """The state with what is too near moved apart a little, as the body follows; that makes no speed."""
        model, x = self._model, after.x
        apart, gap = self._touching[-1], self._contact.gap
        distance = np.einsum("ij,ij->i", apart.pairs.normals, apart.pairs.at(x))
        near = distance < NEAREST * gap
        wanted = np.where(near, np.minimum(LIFT * gap - distance, PUSH * gap), 0.0)
        model.body.update(x)
        if not wanted.any():
            return after
        self._write([*(t.inside for t in self._touching[:-1]), wanted > 0])
        pull = apart.spread((apart.stiffness * wanted)[:, None] * apart.pairs.normals, len(x))
        lift = model.varying.solve(pull)
        drift = self._contact.drift(lift)
        share = self._contact.way(x, x + lift).reach()
        stored = model.elastic(x) + model.potential(x)
        there = guarded.moved(model, x, drift + share * (lift - drift))
        model.body.update(there)
        work = model.elastic(there) + model.potential(there) - stored
        return dataclasses.replace(after, x=there, work=after.work + work)

    def _meet(self, way: Way) -> None:
        """Add what meets on a way to what touches."""
        met = way.meets()
        self._met = met = met if self._met is None else self._met.joined(met)
        pairs = Pairs(
            met.key,
            met.corners,
            met.weights,
            met.normals,
            np.zeros(len(met)),
            np.zeros((len(met), 3)),
            np.zeros(len(met), bool),
            turning(met.corners, met.weights, self._x, self._contact.gap),
        )
        pairs.gaps[:] = np.einsum("ij,ij->i", met.normals, pairs.at(self._x)) - KEPT * self._contact.gap
        apart = Touching(pairs, Pressed(), self._dt, self._stiffness(pairs))
        self._touching = [*self._colliders, apart]
        if self._model.friction:
            self._rubbing = Rubbing(apart, self._model.friction, self._before)

    def _stiffness(self, pairs: Pairs) -> np.ndarray:
        return HARDER / np.einsum("ck,ck->c", pairs.weights**2, self._loose[pairs.corners])

    def _softer(self, hard: Touching, pressed: Pressed) -> Touching:
        """Contacts with colliders that push at the step's own velocities as they do, but are no harder than others.

        With very hard ones Newton's method would have to halve each step that drives something into a collider.
        """
        pairs = hard.pairs
        soft = Touching(pairs, pressed, self._dt, self._stiffness(pairs), hard.friction)
        along = np.einsum("ij,ij->i", pairs.normals, pairs.at(self._own))
        inwards = np.maximum(self._least - along, 0.0)
        soft.least = np.where(inwards > 0, along + hard.stiffness / soft.stiffness * inwards, self._least)
        return soft

    def _kept(self, hard: Touching) -> np.ndarray:
        """Least normal velocities (c,) of what may touch colliders; what the step takes out of one is to stay there."""
        pairs = hard.pairs
        along = np.einsum("ij,ij->i", pairs.normals, pairs.at(self._own))
        out = np.minimum(along, hard.least - pairs.gaps / self._dt)
        return np.where(hard.inside, np.maximum(hard.least, out), hard.least)

    def _sinks(self, v: np.ndarray) -> bool:
        """Whether something ends further inside a collider than it may; what does is pushed by so much more then."""
        if not self._colliders:
            return False
        soft = self._colliders[0]
        short = self._least - np.einsum("ij,ij->i", soft.pairs.normals, soft.pairs.at(v))
        soft.least = np.maximum(soft.least + short, self._least)
        return bool(self._dt * short.max() > SHALLOW)

    def _place(self, v: np.ndarray) -> np.ndarray:
        return self._x + self._dt * v

    def _value(self, v: np.ndarray) -> float:
        """The function, where the body is updated to now."""
        model, place = self._model, self._place(v)
        model.body.update(place)
        change = (v - self._own).ravel()
        elastic = self._weight * (model.body.energy_here() + model.potential(place))
        return (
            0.5 * float(change @ (model.body.mass @ change))
            + elastic
            - float(self._slope @ change)
            + sum(t.value(v.ravel()) for t in self._touching)
        )

    @property
    def _weight(self) -> float:
        """Damping resists like more of the stiffness."""
        return (self._dt + self._model.damping) / self._dt

    def _gradient(self, v: np.ndarray) -> np.ndarray:
        """Its gradient but for the tilt, where the body is, (3n,)."""
        model = self._model
        forces = model.body.gradient_here() - model.conservative_force(self._place(v))
        r = model.body.mass @ (v - self._own).ravel() + self._weight * self._dt * forces.ravel()
        return r + sum(t.gradient(v.ravel()) for t in self._touching)

    def _write(self, presses: list[np.ndarray]) -> None:
        """Write down the Hessian where the body is, with what presses of the colliders and of the body itself."""
        n = len(self._x)
        self._model.assemble_varying(self._dt)
        self._model.varying.more = sum(
            t.matrix(p, n) for t, p in zip(self._touching, presses, strict=True)
        ).tocsc()

    def _solved(self, v: np.ndarray) -> np.ndarray:
        """Velocities that minimise it, from v."""
        value, enough = self._value(v), DEEPEST * self._contact.gap / self._dt
        for _ in range(ITERATIONS):
            r = self._gradient(v) - self._slope
            presses = [t.pressing(v.ravel(), ALMOST) for t in self._touching]
            self._write(presses)
            step = self._model.varying.solve(-r.reshape(-1, 3))
            slope, length, start = float(r @ step.ravel()), 1.0, v
            v, before, value = start + step, value, self._value(start + step)
            while value > before + KEEPS * length * slope + ROUNDING * abs(before) and length > 0.5**HALVES:
                length /= 2
                v = start + length * step
                value = self._value(v)
            rubs = self._rubbing is not None and self._rubbing.follow(start + step, v, presses[-1])
            if length == 1 and not rubs and max(t.deepest(v.ravel()) for t in self._touching) < enough:
                break
            if self._rubbing:
                value = self._value(v)
        return v


def _slower(model: Model, v: np.ndarray, energy: float) -> np.ndarray:
    """Velocities (n, 3) with so much less energy [J], or with what moves as one, and the same momentum."""
    mean = np.zeros(3) if len(model.pinned) else model.lumped @ v / model.lumped.sum()
    moving = model.body.kinetic_energy(v - mean)
    share = np.sqrt(max(1 - energy / moving, 0.0)) if moving > 0 else 0.0
    slower = mean + share * (v - mean)
    slower[model.pinned] = v[model.pinned]
    return slower
