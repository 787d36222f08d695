"""Steps that end where a body does not cross itself, though they did not know of it when they were solved.

What stands in its own way is cut off (`muslin.physics.selfcontact`). That alone would stretch triangles of which one
vertex is stopped, and the next goes on; so the rest of the body follows what was held back, as in a step, and only what
is then still in the way is cut off without more ado.
"""

from __future__ import annotations

import numpy as np

from muslin.simulation.model import Model, State
from muslin.simulation.touching import HARDER

#: Share of its gap by which what is cut off a way counts.
CUT = 0.01


def uncrossed(model: Model, state: State, following: State, dt: float, before: float) -> State:
    """The state that a step from one to the following really ends with; `before` is the energy there was [J].

    Its velocity is that of the way really gone. Where it is known what is put in (contacts in the system), what was cut
    off must not add to the energy, either: what moves relative to the whole is slowed down by as much.
    """
    contact = model.self_contact
    assert contact is not None
    reached, apart = contact.reached(state.x, following.x)
    if reached is following.x:
        return following
    cut = reached - apart - following.x
    held = (np.abs(cut) > CUT * contact.gap).any(axis=1) & ~model.system.pinned
    if held.any():
        goal = following.x + _followed(model, state, dt, cut, np.flatnonzero(held))
        reached, apart = contact.reached(state.x, goal)
    v = following.v + (reached - apart - following.x) / dt
    after = State(
        reached, v, following.time, following.contacts, following.pressed, following.work, following.before
    )
    if model.contact == "solve":
        model.body.update(reached)
        excess = model.energy(after) - before - (following.work - state.work)
        if excess > 0:
            after.v = _slower(model, v, excess)
    return after


def _followed(model: Model, state: State, dt: float, cut: np.ndarray, held: np.ndarray) -> np.ndarray:
    """How the whole body moves where `cut` (n, 3) holds some vertices back, and colliders do, (n, 3) [m]."""
    body = model.body
    body.update(state.x)
    model.assemble(dt)
    if model.contact == "solve" and (touching := model.touching(state, dt)):
        model.add(touching, touching.presses, None)
    matrix = body.mass_data + dt**2 * body.stiffness_here(model.project)
    hold = HARDER * float(matrix[body.pattern.diagonal].max())
    model.add_to_diagonal(held, np.tile(hold * np.eye(3), (len(held), 1, 1)))
    pull = np.zeros_like(cut)
    pull[held] = hold * cut[held]
    return model.system.solve(pull)


def _slower(model: Model, v: np.ndarray, energy: float) -> np.ndarray:
    """Velocities (n, 3) with so much less energy [J], or with what moves as one, and the same momentum."""
    mean = np.zeros(3) if len(model.pinned) else model.lumped @ v / model.lumped.sum()
    moving = model.body.kinetic_energy(v - mean)
    share = np.sqrt(max(1 - energy / moving, 0.0)) if moving > 0 else 0.0
    slower = mean + share * (v - mean)
    slower[model.pinned] = v[model.pinned]
    return slower
