"""Integrators to compare with Euler's implicit ones: implicit midpoint and BDF2, of second order, and symplectic Euler.

Both of second order are a step of backward Euler of another length from another state, so that the same Newton solves
them. With B(q, v; h) the velocity w for which M (w - v) = h f(q + h w):

- implicit midpoint: w = B(q, v; dt/2) is the mean velocity; q+ = q + dt w, v+ = 2 w - v. It keeps what is quadratic in
  (q, v): angular momentum; energy nearly;
- BDF2: with q* = (4 q - q_before)/3 and v* alike, v+ = B(q*, v*; 2/3 dt), q+ = q* + 2/3 dt v+. It damps what is fast.
  Its first step is one of implicit midpoint;
- symplectic Euler: v+ = v + dt M^-1 f(q), q+ = q + dt v+. Stable for dt < 2 / omega only, omega being the fastest
  oscillation's: for cloth, thousands of steps a second.

Contacts of the filter are detected at q; both the velocity and the way are filtered. Those that are solved for are the
matter of `muslin.simulation.arriving`.
"""

from __future__ import annotations

import numpy as np

from muslin.base.errors import MuslinError
from muslin.physics.colliders import respond
from muslin.simulation import arriving, newton
from muslin.simulation.model import Model, State

#: Share of the model's tolerance: what is kept is kept only as well as the system is solved.
CLOSER = 1e-5


def implicit_midpoint(model: Model, state: State, dt: float) -> State:
    """One step of the implicit midpoint rule.

    Raises
    ------
    SimulationError
        If Newton does not converge.
    """
    if _solves(model, state):
        return arriving.step(model, state, dt, lambda: arriving.midpoint(model, state, dt))
    mean = _backward(model, state, dt / 2, _carried(model, state, dt))
    return _finish(model, state, 2 * mean - state.v, mean, dt)


def bdf2(model: Model, state: State, dt: float) -> State:
    """One step of the backward differentiation formula of second order.

    Raises
    ------
    SimulationError
        If Newton does not converge.
    """
    if state.before is None:
        return implicit_midpoint(model, state, dt)
    before, part = state.before, 2 * dt / 3
    x, v = (4 * state.x - before.x) / 3, (4 * state.v - before.v) / 3
    ahead = State(x, v, state.time + dt - part)
    if _solves(model, state):
        return arriving.step(model, state, dt, lambda: arriving.bdf2(model, state, ahead, part), smooth=True)
    held = (state.x + dt * _carried(model, state, dt) - x) / part
    v = _backward(model, ahead, part, held)
    return _finish(model, state, v, (x + part * v - state.x) / dt, dt)


def symplectic_euler(model: Model, state: State, dt: float) -> State:
    """One step of symplectic Euler.  The body must have been updated to `state.x`."""
    _require_filter(model, state)
    force = model.conservative_force(state.x) + model.wind_force(state.x, state.v)
    damper = model.damper(state.x)
    if damper is not None:
        force -= (damper @ state.v.ravel()).reshape(-1, 3)
    b = model.impulse(state, force, dt)
    model.assemble(0.0)  # M alone
    known = model.known_velocity(state.time, dt)
    v = model.system.solve(b, known, model.coupling(known, 0.0), guess=state.v)
    return _finish(model, state, v, v, dt)


def _carried(model: Model, state: State, dt: float) -> np.ndarray:
    """Velocities (n, 3) that carry the pinned vertices through the step; zero elsewhere."""
    known = model.known_velocity(state.time, dt)
    return np.zeros_like(state.x) if known is None else known


def _backward(model: Model, state: State, dt: float, held: np.ndarray) -> np.ndarray:
    """B(state; dt), (n, 3), where the pinned vertices move as they are `held`."""
    from muslin.simulation.incremental import IncrementalPotential

    step, pinned = IncrementalPotential(model, state, dt), model.system.pinned
    start = np.where(pinned[:, None], held, state.v).ravel()
    v = newton.minimise(step, start, CLOSER * model.tolerance)
    # once more, from where the energy no longer shows the way: what is left over turns the body
    r, _ = step.gradient()
    step.assemble(True)
    better = v + step.solve(-r)
    step.value(better)
    return (better if step.size(step.gradient()[0]) < step.size(r) else v).reshape(-1, 3)


def _finish(model: Model, state: State, v: np.ndarray, mean: np.ndarray, dt: float) -> State:
    """The state after a step with this velocity at its end and this mean one, both filtered."""
    pinned = model.system.pinned
    v = np.where(pinned[:, None], mean, v)
    contacts = model.contacts(state, dt)
    mean = respond(filtered := mean, contacts, model.filter)
    if model.limit and (limited := model.limit(state.x, mean, dt)) is not mean:
        mean = respond(limited, contacts, model.filter)
        v = v + mean - filtered
    v = respond(v, contacts, model.filter)
    before = State(state.x, state.v, state.time)
    return State(state.x + dt * mean, v, state.time + dt, contacts, before=before)


def _solves(model: Model, state: State) -> bool:
    """Whether contacts are part of the system."""
    return model.contact == "solve" and bool(model.colliders_at(state.time))


def _require_filter(model: Model, state: State) -> None:
    if _solves(model, state):
        raise MuslinError(
            "contact = 'solve' goes with implicit integrators only: a step of symplectic Euler solves no system.",
            "Set contact=filter, or another integrator.",
        )
