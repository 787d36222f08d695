"""Contacts that are solved for in steps of second order: implicit midpoint and BDF2.

Where a point arrives at a collider its velocity jumps, and what makes a step of second order is wrong across a jump:
midpoint's velocity at the end, 2 w - v with the mean velocity w, sends back as fast as it came what a contact stopped;
BDF2 goes on from where and how fast things were before. So

- midpoint's w keeps points in front of where a collider is at the end, n . w >= -g / dt. Then what presses loses what
  it has left along n, and what friction holds all it has: v+ is nearest to 2 w - v in the metric of M, which takes
  energy only;
- BDF2 keeps them in front at the end of its own step; but where one arrives, that step is one of backward Euler, and
  the next one, whose past is on the other side of the jump, of midpoint.

Steps of backward Euler are also those that find no end or in which contacts would add to the energy, and those in which
a collider, a pin or the air moves, or something is inside a collider: of them it is known what is put in.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from muslin.base.errors import SimulationError
from muslin.physics.colliders import respond
from muslin.simulation import guarded, newton
from muslin.simulation.incremental import IncrementalPotential
from muslin.simulation.model import Model, State
from muslin.simulation.touching import Pressed, Touching

#: How fast [m/s] a point must come for its velocity to jump.
ARRIVES = 0.01


def step(model: Model, state: State, dt: float, advance: Callable[[], State], smooth: bool = False) -> State:
    """A step among colliders: as `advance` does it, if it may be, or else of backward Euler.

    It may not where a point arrives, if it needs velocities to be `smooth`.
    """
    model.prepare()
    before = model.energy(state)
    near = model.touching(state, dt)
    moves = model.pinned_velocity is not None or model.drag or model.limit is not None
    if not (moves or (near and (near.inside.any() or near.pairs.velocities.any()))):
        with contextlib.suppress(SimulationError):
            following = advance()
            model.body.update(following.x)
            jumps = near is not None and _arrives(near, state, following)
            touches = len(state.pressed) or len(following.pressed)
            gains = touches and guarded.excess(model, state, before, following) > 0
            if not gains and not (smooth and jumps):
                return _going_on(model, state, following, jumps)
    model.body.update(state.x)
    following = guarded.whole(model, state, dt)
    return _going_on(model, state, following, near is not None and _arrives(near, state, following))


def _going_on(model: Model, state: State, following: State, jumps: bool) -> State:
    """A state, with the one before it, if the velocity did not jump between them."""
    following.before = None if jumps else State(state.x, state.v, state.time)
    model.here = following
    return following


def midpoint(model: Model, state: State, dt: float) -> State:
    """A step of implicit midpoint."""
    touching = _touching(model, state, dt, 0.5)
    problem = IncrementalPotential(model, state, dt / 2, touching, whole=True)
    mean = solved = _newtons(problem)
    if touching is None:
        return State(state.x + dt * mean, 2 * mean - state.v, state.time + dt, work=state.work)
    count = len(model.colliders_at(state.time + dt))
    mean = respond(mean, touching.contacts(np.ones(len(touching.pairs), bool), count), model.filter)
    presses = touching.pressing(solved.ravel())
    mass = np.einsum("ck,ck->c", touching.pairs.weights, model.lumped[touching.pairs.corners])
    push, rub = touching.impulses(solved, mean, presses, mass)
    v = _stopped(model, touching, presses, 2 * mean - state.v)
    pressed = _scaled(touching.after(push, rub, mean, mass), 2.0)
    contacts = touching.contacts(push > 0, count)
    return State(state.x + dt * mean, v, state.time + dt, contacts, pressed, state.work)


def bdf2(model: Model, state: State, ahead: State, part: float) -> State:
    """A step of BDF2, of this length from the state that it begins from."""
    touching = _touching(model, replace(ahead, pressed=state.pressed), part, 2 / 3)
    model.body.update(ahead.x)
    problem = IncrementalPotential(model, ahead, part, touching, whole=True)
    v = _newtons(problem)
    ahead = replace(ahead, work=state.work)
    presses = touching.pressing(v.ravel()) if touching else None
    following = guarded.ended(model, ahead, part, touching, v, None, presses)
    following.pressed = _scaled(following.pressed, 3 / 2)
    return following


def _newtons(problem: IncrementalPotential) -> np.ndarray:
    """Velocities (n, 3) that minimise it."""
    v = newton.minimise(problem, problem.start(), problem.model.tolerance, iterations=guarded.WHOLE)
    return v.reshape(-1, 3)


def _touching(model: Model, state: State, dt: float, share: float) -> Touching | None:
    """What may touch; impulses known are those of a step, of which this is a share."""
    touching = model.touching(replace(state, pressed=_scaled(state.pressed, share)), dt)
    if touching:
        touching.reach_out()
    return touching


def _scaled(pressed: Pressed, share: float) -> Pressed:
    return replace(pressed, impulse=share * pressed.impulse)


def _stopped(model: Model, touching: Touching, presses: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The velocities (n, 3) nearest to these, in the metric of M, at which what presses stays on its collider.

    What friction holds stays where it is.
    """
    at_rest = replace(touching.pairs, gaps=np.zeros(len(touching.pairs)))
    held = Touching(at_rest, Pressed(), touching.dt, touching.stiffness)
    sticks = presses & (touching.grip >= touching.stiffness)
    held.grip = sticks * touching.stiffness
    b = (model.body.mass @ v.ravel()).reshape(-1, 3) + held.pull(presses, len(v))
    model.assemble(0.0)
    model.add(held, presses, None)
    return model.system.solve(b, None, None, guess=v)


def _arrives(near: Touching, state: State, following: State) -> bool:
    """Whether a point presses that did not before, and came fast."""
    key, pairs = near.pairs.key, near.pairs
    new = np.isin(key, following.pressed.key) & ~np.isin(key, state.pressed.key)
    speed = -np.einsum("ij,ij->i", pairs.normals, pairs.at(state.v))
    return bool((speed[new] > ARRIVES).any())
