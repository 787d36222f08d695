"""Steps with contacts in the system, guarded: what colliders at rest do to a body never adds to its energy.

A linearly implicit step is the first of Newton's on the incremental potential, and mostly good enough. Whether it is
shows in the energy: where that would be more after the step than before and what was put in, Newton's method goes on
from there, with a line search, until it is not, at the latest at the step of backward Euler.
"""

from __future__ import annotations

import contextlib

import numpy as np

from muslin.base.errors import SimulationError
from muslin.physics.colliders import respond
from muslin.simulation import by_student, newton
from muslin.simulation.incremental import IncrementalPotential
from muslin.simulation.model import Model, State
from muslin.simulation.touching import LIFTED, Pressed, Touching

#: Share of the kinetic energy by which a step may add to the whole: rounding, and what nobody sees.
ALLOWED = 1e-6

#: Force for each mass [m/s^2] with which penetration is taken back, the time [s] in which the body follows, and how
#: often a way out is halved.
FORCE, EASE, PARTS = 10.0, 0.1, 16

#: Iterations of Newton's method for a step that would add to the energy, and how often what they find is halved.
ITERATIONS, SHORTER = 20, 30

#: How often a step's system is solved again without contacts that would pull.
RELEASES = 4

#: Iterations of Newton's method for a whole step, and how often it is halved where they do not do.
WHOLE, HALVES = 300, 6

#: How often what is in the way of pinned vertices is made to give way in a step at most, and how exactly.
CARRIED, COARSE = 50, 1e-3


def linear(
    model: Model, state: State, dt: float, known: np.ndarray | None, touching: Touching | None = None
) -> np.ndarray:
    """Velocities (n, 3) from one linear system, (M + dt^2 K) v+ = M v + dt f(q), with wind and contacts in it."""
    b = model.impulse(state, model.conservative_force(state.x), dt)
    model.assemble(dt)
    air = model.air(state, dt)
    if air:
        b += air.impulse(np.zeros_like(b))
    if touching:
        b += touching.pull(touching.presses, len(b))
    model.add(touching, touching.presses if touching else None, air)
    return model.system.solve(b, known, model.coupling(known, dt), guess=state.v)


def newtons(model: Model, problem: IncrementalPotential, iterations: int = newton.ITERATIONS) -> np.ndarray:
    """Velocities (n, 3) that minimise the incremental potential, by the student's Newton where there is one."""
    if model.barrier:
        v = _nearing(model, problem)
    elif functions := model.body.roles.calling(by_student.NEEDS["newton"]):
        v = by_student.minimise(functions.newtons_method, problem, problem.start(), model.tolerance)
    else:
        v = newton.minimise(problem, problem.start(), model.tolerance, iterations=iterations)
    return v.reshape(-1, 3)


def _nearing(model: Model, problem: IncrementalPotential) -> np.ndarray:
    """The same where the body must not cross itself: from a place that it can get to without.

    Pinned vertices are carried on as far as nothing is in their way; then what is gives way, and they go on.
    """
    v, start = problem.base(), problem.start()
    goal = start
    for _ in range(CARRIED):
        share = problem.reach(v, goal - v)
        v = goal if share == 1 else v + share * (goal - v)
        carried = np.array_equal(v[~problem.free], start[~problem.free])
        v = newton.minimise(problem, v, model.tolerance if carried else COARSE)
        if carried:
            return v
        goal = np.where(problem.free, v, start)
    raise SimulationError(
        "Pinned vertices are carried into the cloth faster than it can give way.", "Reduce dt."
    )


def whole(model: Model, state: State, dt: float, halved: int = 0) -> State:
    """One step of backward Euler with contacts in the system; in two of half the length where Newton finds no end.

    The body must have been updated to the state.

    Raises
    ------
    SimulationError
        If that is of no avail either.
    """
    try:
        return step(model, state, dt, whole=True)
    except SimulationError:
        if halved == HALVES or model.barrier or model.body.roles.calling(by_student.NEEDS["newton"]):
            raise
    for _ in range(2):
        model.body.update(state.x)
        state = whole(model, state, dt / 2, halved + 1)
    return state


def step(model: Model, state: State, dt: float, whole: bool = False) -> State:
    """One step with contacts in the system; `whole`: of backward Euler from the first, not only where needed."""
    model.prepare()
    before = model.energy(state)
    touching = model.touching(state, dt)
    known = model.known_velocity(state.time, dt)
    lifted = _lift(model, state, dt, touching) if touching and touching.inside.any() else None
    if whole:
        model.body.update(state.x)
        v = newtons(model, IncrementalPotential(model, state, dt, touching, whole=True), WHOLE)
    else:
        v = linear(model, state, dt, known, touching)
        for _ in range(RELEASES):
            if not (touching and touching.release(v.ravel())):
                break
            model.body.update(state.x)
            v = linear(model, state, dt, known, touching)
    unbalanced = None
    if (
        touching and not whole and touching.pairs.velocities.any()
    ):  # colliders do work: what they really push with
        unbalanced = _unbalanced(IncrementalPotential(model, state, dt, touching), v)
    following = ended(model, state, dt, touching, v, lifted, None, unbalanced)
    if not np.isfinite(following.x).all():  # somebody's function: there is nothing to guard any more
        return following
    if excess(model, state, before, following) > 0:
        following = _better(model, state, dt, touching, v, lifted, before)
    model.here = following
    return following


def _better(
    model: Model,
    state: State,
    dt: float,
    touching: Touching | None,
    v: np.ndarray,
    lifted: np.ndarray | None,
    before: float,
) -> State:
    """The same step by more of Newton's iterations, from v, and if those are of no avail, a shorter one."""
    problem = IncrementalPotential(model, state, dt, touching)
    found: list[State] = []

    def landed(v: np.ndarray) -> bool:
        presses = unbalanced = None
        if touching:
            presses = touching.pressing(v)
            unbalanced = _unbalanced(problem, v)
        found.append(ended(model, state, dt, touching, v.reshape(-1, 3), lifted, presses, unbalanced))
        return excess(model, state, before, found[-1]) <= 0

    def enough(v: np.ndarray) -> bool:
        if landed(v) or len(found) >= ITERATIONS:
            return True
        problem.value(v)
        return False

    v = v.ravel()
    with contextlib.suppress(SimulationError):
        v = newton.minimise(problem, v, model.tolerance, enough)
    if touching and touching.pairs.velocities.any() and not landed(v):
        # half of a velocity is no way out where colliders carry the body along
        with contextlib.suppress(SimulationError):
            v = newtons(model, IncrementalPotential(model, state, dt, touching, whole=True), WHOLE).ravel()
    for _ in range(SHORTER):
        if landed(v):
            break
        v = problem.shorter(v)
    return found[-1]


def _unbalanced(problem: IncrementalPotential, v: np.ndarray) -> np.ndarray:
    """Impulses (n, 3) that are left over at velocities v: what a step's system says of them is not all there is."""
    problem.value(v.ravel())
    return problem.gradient()[0].reshape(-1, 3)


def _lift(model: Model, state: State, dt: float, touching: Touching) -> np.ndarray:
    """How far to move vertices (n, 3) to take back penetration, without their velocities knowing [m].

    Springs pull what is inside to the surface, with `FORCE` for each mass, and the body follows as it would within
    `EASE`: what can bend or go along does so, and what would have to stretch stays where it is for now.
    """
    pairs = touching.pairs
    mass = np.einsum("ck,ck->c", pairs.weights, model.lumped[pairs.corners])
    depth = np.where(touching.inside, -pairs.gaps, 1.0)
    springs = Touching(pairs, Pressed(), EASE, EASE**2 * FORCE * mass / depth)
    goal = np.where(
        touching.inside, depth + depth**2 / (EASE**2 * FORCE), 0.0
    )  # where what is free ends at the surface
    model.assemble(EASE)
    model.add(springs, touching.inside, None)
    pull = springs.spread((springs.stiffness * goal)[:, None] * pairs.normals, len(state.x))
    way = model.system.solve(pull)
    farthest = float(np.linalg.norm(way, axis=1).max())
    return way * min(1.0, LIFTED * dt / farthest) if farthest > 0 else way


def moved(model: Model, x: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Where a body that has been updated to x goes along a way, both (n, 3) [m]: as far as that does not strain it.

    What a way out strains the body is stored, and makes speed later: no more of that than `FORCE` would do.
    """
    stored = model.body.energy_here()
    most = FORCE * float(model.lumped @ np.linalg.norm(way, axis=1))
    for part in 0.5 ** np.arange(PARTS):
        there = x + part * way
        model.body.update(there)
        if model.body.energy_here() - stored <= part * most:
            return there
    return x


def ended(
    model: Model,
    state: State,
    dt: float,
    touching: Touching | None,
    solved: np.ndarray,
    lifted: np.ndarray | None,
    presses: np.ndarray | None = None,
    unbalanced: np.ndarray | None = None,
) -> State:
    """The state after a step, filtered, with the body updated to it.

    `presses` if not as expected; `unbalanced`, the impulses (n, 3) left over, where the step was not solved to its end.
    """
    v, contacts, pressed = solved, [], Pressed()
    work = 0.0
    if touching:
        count = len(model.colliders_at(state.time + dt))
        near = np.ones(len(touching.pairs), bool)
        v = respond(solved, touching.contacts(near, count), model.filter)
    if model.limit and (limited := model.limit(state.x, v, dt)) is not v:
        v = respond(limited, touching.contacts(near, count), model.filter) if touching else limited
    v = _free(model, state.x + dt * solved, state.x + dt * v, solved, v)
    if touching:
        presses = touching.presses if presses is None else presses
        mass = np.einsum("ck,ck->c", touching.pairs.weights, model.lumped[touching.pairs.corners])
        push, rub = touching.impulses(solved, v, presses, mass, unbalanced, model.lumped)
        pressed = touching.after(push, rub, v, mass)
        contacts = touching.contacts(push > 0, count)
        work += touching.work(push, rub)
    x = state.x + dt * v
    if not np.isfinite(x).all():
        return State(x, v, state.time + dt)
    if lifted is not None:
        lifted = _free(model, x, x + lifted, np.zeros_like(x), lifted)
        model.body.update(x)
        unlifted = model.body.energy_here() + model.potential(x)
        x = moved(model, x, lifted)
    model.body.update(x)
    model.prepare()
    if lifted is not None:
        work += model.body.energy_here() + model.potential(x) - unlifted
    if air := model.air(state, dt):
        work += air.work(v)
    if model.pinned_velocity is not None and len(model.pinned):
        pulled = model.pulled(state, x, v, dt)
        if air:
            pulled = pulled - air.impulse(v)
        work += float(np.sum(pulled[model.pinned] * v[model.pinned]))
    return State(x, v, state.time + dt, contacts, pressed, state.work + work)


def _free(model: Model, x: np.ndarray, goal: np.ndarray, at_x: np.ndarray, at_goal: np.ndarray) -> np.ndarray:
    """`at_goal`, or so much less of it, towards `at_x`, as the body meets itself on the way from x to a goal."""
    if model.barrier is None or np.array_equal(x, goal):
        return at_goal
    share = model.barrier.reach(x, goal)
    return at_goal if share == 1 else at_x + share * (at_goal - at_x)


def excess(model: Model, state: State, before: float, following: State) -> float:
    """By how much a step has added more to the energy than was put in, and than is allowed [J]."""
    after, kinetic = model.energy(following), model.body.kinetic_energy(following.v)
    return after - before - (following.work - state.work) - ALLOWED * kinetic
