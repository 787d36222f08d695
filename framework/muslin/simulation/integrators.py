"""Time integration: an integrator moves the `State` of a `Model` on by dt.

Linearly implicit Euler is one Newton step of backward Euler, from the current velocity::

    (M + dt^2 K) v+ = M v + dt f(q),    q+ = q + dt v+,    K = d2V/dq2 (projected)

Both detect contacts at q and filter v+ at them (S10). With `contact="solve"` they know of them when they solve:
(M + dt^2 K) v+ = M v + dt f(q) + sum_i lambda_i n_i, with impulses lambda_i that keep vertices in contact from moving
inwards (see `touching`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np

from muslin.base.blas import one_thread
from muslin.base.errors import Inverted, MuslinError, SimulationError, choices
from muslin.physics.colliders import Contacts, respond
from muslin.simulation import by_student, guarded, second_order
from muslin.simulation.incremental import IncrementalPotential
from muslin.simulation.model import Model, Spring, State
from muslin.simulation.uncrossing import uncrossed

__all__ = [
    "INTEGRATORS",
    "Exploded",
    "Model",
    "Spring",
    "State",
    "backward_euler",
    "integrator",
    "linearly_implicit_euler",
    "steps",
]


def linearly_implicit_euler(model: Model, state: State, dt: float) -> State:
    """One step of linearly implicit Euler.  The body must have been updated to `state.x`."""
    if model.contact == "solve":
        return guarded.step(model, state, dt)
    contacts = model.contacts(state, dt)
    model.prepare()
    known = model.known_velocity(state.time, dt)
    return _finish(model, state, guarded.linear(model, state, dt, known), contacts, dt)


def backward_euler(model: Model, state: State, dt: float) -> State:
    """One step of backward Euler, by Newton's method with a backtracking line search.

    It ends as `muslin.simulation.newton.minimise` says, with `model.tolerance`. Where contacts are part of the system
    and Newton's method does not end, two steps of half the length are taken, and so on.

    Raises
    ------
    SimulationError
        If Newton does not converge.
    """
    if model.contact == "solve":
        return guarded.whole(model, state, dt)
    contacts = model.contacts(state, dt)
    v = guarded.newtons(model, IncrementalPotential(model, state, dt))
    return _finish(model, state, v, contacts, dt)


def _finish(model: Model, state: State, v: np.ndarray, contacts: list[Contacts], dt: float) -> State:
    v = respond(v, contacts, model.filter)
    if model.limit and (limited := model.limit(state.x, v, dt)) is not v:
        v = respond(limited, contacts, model.filter)
    return State(state.x + dt * v, v, state.time + dt, contacts)


INTEGRATORS: dict[str, Callable[[Model, State, float], State]] = {
    "linearly-implicit": linearly_implicit_euler,
    "backward-euler": backward_euler,
    "midpoint": second_order.implicit_midpoint,
    "bdf2": second_order.bdf2,
    "symplectic-euler": second_order.symplectic_euler,
}


def integrator(name: str) -> Callable[[Model, State, float], State]:
    """Integrator by name.

    Raises
    ------
    MuslinError
        If there is none of that name.
    """
    name = name.replace("_", "-")
    if name not in INTEGRATORS:
        raise MuslinError(f"There is no integrator {name!r}.", choices(name, INTEGRATORS))
    return INTEGRATORS[name]


def by_integrator(model: Model, name: str) -> frozenset[str]:
    """Tasks whose functions an integrator itself calls, and the drag spring's."""
    parts = ["newton"] if integrator(name) is backward_euler else []
    parts += ["spring"] if model.spring is not None else []
    return frozenset().union(*(model.body.roles.called(by_student.NEEDS[part]) for part in parts))


#: Positions beyond this [m] mean that a body has exploded.
EXPLODED = 1e8


class Exploded(SimulationError):
    """A step after which positions are no longer numbers, or absurdly large; `how` says which."""

    def __init__(self, how: str):
        self.how = how
        super().__init__(
            f"The cloth exploded: {how}.",
            "Often the sign of a force or a wrong Hessian (muslin check), or too large a dt.",
        )


def steps(model: Model, state: State, dt: float, name: str, count: int | None = None) -> Iterator[State]:
    """A state and then those after 1, 2, ... steps; the body has been updated to each when it is given.

    What belongs to the model alone (its spring, its colliders) may be exchanged between two of them.

    Parameters
    ----------
    model : Model
    state : State
        Where to begin.
    dt : float
        [s]
    name : str
        Of an integrator.
    count : int, optional
        Number of steps; default without end.

    Raises
    ------
    MuslinError
        If there is no such integrator.
    Exploded
        Instead of a state that makes no sense.
    """
    advance = integrator(name)
    model.hessian_here = advance in (linearly_implicit_euler, second_order.symplectic_euler)
    if model.here is not state:
        model.body.update(state.x)
        model.here = state
    yield state
    for step in itertools.count(1) if count is None else range(1, count + 1):
        if model.pull is not None:
            model.spring = model.pull(state.time)
        before = model.energy(state) if model.self_contact is not None else 0.0
        model.here = None
        with one_thread():
            try:
                following = advance(model, state, dt)
            except Inverted as error:
                raise Inverted(error.message, _upright(advance)) from None
        _require_sound(following)
        if model.self_contact is not None:
            following = uncrossed(model, state, following, dt, before)
        if model.here is not following:
            model.body.update(following.x)
            model.here = following
        state = following
        if step != count:
            model.prepare()  # the energies that somebody may ask for between, and what the next step needs
        yield state


def _upright(advance: Callable[[Model, State, float], State]) -> str:
    """What to do where a step has inverted something."""
    if advance is linearly_implicit_euler or advance is second_order.symplectic_euler:
        return "Reduce dt, or take backward Euler, whose line search refuses such steps: integrator=backward-euler."
    return (
        "Its line search refuses such steps if force, Hessian and energy agree: muslin check. Else reduce dt."
    )


def _require_sound(state: State) -> None:
    if not (np.abs(state.x) < EXPLODED).all() or not np.isfinite(state.v).all():
        far = float(np.nan_to_num(np.abs(state.x), nan=np.inf).max())
        raise Exploded(
            f"it is {far:.0e} m wide" if np.isfinite(far) else "its positions are not numbers any more"
        )
