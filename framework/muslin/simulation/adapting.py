"""A cloth whose mesh follows it: refined and coarsened between steps, everything rebuilt on the new mesh.

Before every `adapt_every`-th step vertices that are no longer needed are taken out, and triangles that are too large
are refined by one generation (see `criteria`, and `muslin.mesh.refinement` for how). Positions, velocities, pins and
contacts go over to the new mesh as `muslin.physics.transfer` says. Which step adapts depends on its number alone,
so that a run that was stopped and goes on is the one that was not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from muslin.mesh import Mesh, Refinement
from muslin.mesh.surface import frozen
from muslin.physics.transfer import Exchange, Sheet
from muslin.simulation import carrying
from muslin.simulation.criteria import bound, indicator
from muslin.simulation.integrators import steps
from muslin.simulation.model import Model, State
from muslin.simulation.scenes import Scene

#: A vertex goes where the indicator is below this: without it the triangles are sqrt(3) times as large, and the
#: indicator as much, or 3 times where it was alone to stand out.
COARSER = 0.3

#: Share of the triangles, or vertices, that must ask for a change before there is one; how often a triangle may be
#: refined in one.
FEW, ROUNDS = 0.01, 2


@dataclass(frozen=True)
class _Undeformed:
    """A refinement's undeformed mesh, and where its vertices start, (n, 3) [m]."""

    refined: Refinement
    mesh: Mesh
    start: np.ndarray

    @classmethod
    def of(cls, refined: Refinement, begun: Mesh, X: np.ndarray, start: np.ndarray) -> _Undeformed:
        """Of what a mesh has become, with vertices X."""
        numbers = begun.numbers
        if numbers is not None:
            numbers = np.concatenate([numbers, numbers[-1] + 1 + np.arange(refined.added)])
        mesh = frozen(X, refined.triangles, begun.name, (), numbers, begun.scale)
        return cls(refined, mesh, start)


#: (undeformed mesh, start positions, pinned vertices, density) -> model
Build = Callable[[Mesh, np.ndarray, np.ndarray, float], Model]


class Adapter:
    """The mesh of a run and what follows from it.

    Parameters
    ----------
    scene : Scene
        Says how fine the mesh may become.
    mesh : Mesh
        The mesh one begins with, undeformed.
    start : (n, 3) array
        Where its vertices are at the start [m].
    model : Model
        Made of it.
    build : callable
        Makes another.
    refined : Refinement and log, optional
        Where to go on.

    Attributes
    ----------
    model : Model
        That of the mesh as it is now.
    refined : Refinement
    log : list
        One row per change of the mesh: time [s], vertices, triangles, and by how much it changed the kinetic, elastic
        and gravity energy [J].
    came_from : (n,) int array
        The number each vertex had before the last change; -1 for those that came.
    changed : callable
        Called after each change, before the next step.
    """

    def __init__(
        self,
        scene: Scene,
        mesh: Mesh,
        start: np.ndarray,
        model: Model,
        build: Build,
        refined: tuple[Refinement, list[tuple[float, ...]]] | None = None,
    ):
        self.scene, self._mesh, self._start, self._build = scene, mesh, start, build
        self._pinned = np.zeros(len(mesh.vertices), dtype=bool)
        self._pinned[model.pinned] = True
        self._area = float(mesh.area_and_normal[0].sum())
        self._mass = float(model.body.mass_factor.sum())
        self._first = model
        self.came_from = np.arange(len(mesh.vertices))
        self.changed: Callable[[], None] = lambda: None
        self.model, self.refined = model, Refinement.of(mesh)
        self.log: list[tuple[float, ...]] = []
        self._undeformed = _Undeformed(self.refined, mesh, start)
        self._weighed: tuple[Any, Sheet, float] = None, Sheet(mesh.triangles, np.zeros(0)), 0.0
        self._resumed = refined is not None
        if refined is not None:
            self.refined, self.log = refined
            self._rebuild()

    def begin_again(self) -> None:
        """Back to the mesh one began with."""
        self.model, self.refined, self.log = self._first, Refinement.of(self._mesh), []

    def steps(self, state: State, step: int, last: int | None = None) -> Iterator[State]:
        """As `integrators.steps`, from the state of a step up to the scene's last, adapted before it is given first.

        `model` and `refined` are those of the state that was given last.
        """
        scene, every = self.scene, self.scene.adapt_every
        if step % every == 0 and not (self._resumed and step == 0):
            state = self.adapt(state)
        last = scene.steps if last is None else last
        count = min(every - step % every, last - step)
        states = steps(self.model, state, scene.dt, scene.integrator, count)
        yield next(states)
        while True:
            for state in states:
                step += 1
                yield state
            if step >= last:
                return
            state = self.adapt(state)
            count = min(every, last - step)
            states = steps(self.model, state, scene.dt, scene.integrator, count)
            next(states)

    def adapt(self, state: State) -> State:
        """The state on a mesh that fits it better; `model` and `refined` are then of that mesh.

        Where that is more than a few triangles': what one change of the mesh costs hardly depends on how many do.
        """
        found = self._indicator(state)
        goes, rows = self._superfluous(found), self._wanted(state, found)
        if max(len(goes), len(rows)) <= FEW * len(found):
            return state
        before, self.came_from = self._energies(state), np.arange(len(state.x))
        changed = self._coarsened(state, goes) if len(goes) else state
        for again in range(ROUNDS):
            if again or len(goes):
                rows = self._wanted(changed, self._indicator(changed))
            if not len(rows):
                break
            changed = self._refined(changed, rows)
        if changed is state:
            return state
        hessian_here = self.model.hessian_here
        self._rebuild()
        self.model.hessian_here = hessian_here
        self.model.body.update(changed.x)
        self.model.prepare()  # with the energies all that the next step needs
        self.model.here = changed
        after = self._energies(changed)
        lost = [a - b for a, b in zip(after, before, strict=True)]
        self.log.append((state.time, len(changed.x), len(self.refined.triangles), *lost))
        came = np.full(len(changed.x) - len(self.came_from), -1)
        self.came_from = np.concatenate([self.came_from, came])
        self.changed()
        return changed

    # How ----------------------------------------------------------------------------------------------------

    def _superfluous(self, found: np.ndarray) -> np.ndarray:
        """Vertices that can be taken out and are not needed, by the indicator (m,)."""
        mesh = self.refined
        if not mesh.added:
            return np.zeros(0, dtype=int)
        worst = np.zeros(mesh.vertices)
        np.maximum.at(worst, mesh.triangles.ravel(), np.repeat(found, 3))
        wanted = worst >= COARSER
        if ((mesh.born >= 0) & ~wanted).sum() <= FEW * len(found):
            return np.zeros(0, dtype=int)  # too few, whichever of them can go
        split = mesh.children[:, 0]  # the two of a trisection have one, and go together
        return np.flatnonzero(mesh.removable() & ~wanted & ~np.isin(split, split[wanted]))

    def _wanted(self, state: State, found: np.ndarray) -> np.ndarray:
        """Rows of triangles that are to be refined and may be, by the indicator (m,)."""
        mesh, scene = self.refined, self.scene
        wanted = (found >= 1) & (mesh.generation < 2 * scene.levels)
        if wanted.sum() <= FEW * len(found) or mesh.vertices >= scene.budget:
            return np.zeros(0, dtype=int)
        wanted &= ~bound(mesh, state.x, np.radians(scene.flip_angle))
        rows = np.flatnonzero(wanted)
        return self._within_budget(rows[np.argsort(-found[rows], kind="stable")])

    def _coarsened(self, state: State, goes: np.ndarray) -> State:
        sheet, free, there = self._sheet(), self._free(self.refined), self._rest()
        self.refined, kept = self.refined.coarsen(goes)
        X, start = there.mesh.vertices[kept], there.start[kept]
        self._undeformed = _Undeformed.of(self.refined, self._mesh, X, start)
        after = self._sheet()
        exchange = Exchange(sheet, Sheet(kept[after.triangles], after.masses), len(state.x), free)
        x = exchange.recentred(state.x)
        v = exchange.conserved(state.x, x, state.v, state.v)
        pressed = carrying.coarsened(state.pressed, kept, sheet, after)
        self.came_from = self.came_from[kept]
        return State(x[kept], v[kept], state.time, [], pressed, state.work)

    def _refined(self, state: State, rows: np.ndarray) -> State:
        sheet, there = self._sheet(), self._rest()
        self.refined = self.refined.refine(rows)
        X, start = self.refined.spread(there.mesh.vertices), self.refined.spread(there.start)
        self._undeformed = _Undeformed.of(self.refined, self._mesh, X, start)
        after = self._sheet()
        x, v = self.refined.spread(state.x), self.refined.spread(state.v)
        exchange = Exchange(sheet, after, len(x), self._free(self.refined), _changed(sheet, after))
        moved = exchange.recentred(x)
        v = exchange.conserved(x, moved, v, v)
        pressed = carrying.refined(state.pressed, self.refined, sheet, after)
        return State(moved, v, state.time, [], pressed, state.work)

    def _within_budget(self, rows: np.ndarray) -> np.ndarray:
        """As many of these, the first ones, as the budget of vertices allows."""
        left = self.scene.budget - self.refined.vertices
        low, high = 0, len(rows)
        if high and self.refined.growth(rows) <= left:
            return rows
        while high - low > 1:
            middle = (low + high) // 2
            if self.refined.growth(rows[:middle]) <= left:
                low = middle
            else:
                high = middle
        return rows[:low]

    def _rest(self) -> _Undeformed:
        """The mesh as it is now, undeformed."""
        if self._undeformed.refined is not self.refined:
            X, start = (self.refined.spread(values) for values in (self._mesh.vertices, self._start))
            self._undeformed = _Undeformed.of(self.refined, self._mesh, X, start)
        return self._undeformed

    def _indicator(self, state: State) -> np.ndarray:
        """How much each triangle should be refined, where it is and where it will be if it moves on as it does."""
        scene, rest = self.scene, self._rest().mesh.vertices
        angle, ahead = np.radians(scene.refine_angle), scene.look_ahead
        found = None
        for dt in (0.0, ahead) if ahead else (0.0,):
            x, colliders = state.x + dt * state.v, self.model.colliders(state.time + dt)
            there = indicator(self.refined, rest, x, colliders, angle, scene.refine_stretch)
            found = there if found is None else np.maximum(found, there)
        return np.asarray(found)

    def _sheet(self) -> Sheet:
        if self._weighed[0] is not self.refined:
            area = self._rest().mesh.area_and_normal[0]
            whole = float(area.sum())
            self._weighed = self.refined, Sheet(self.refined.triangles, self._mass / whole * area), whole
        return self._weighed[1]

    def _free(self, mesh: Refinement) -> np.ndarray:
        return ~mesh.all_of(self._pinned)

    def _rebuild(self) -> None:
        """The model of the mesh as it is now; its mass is that of the mesh one began with."""
        rest, rho = self._rest(), self.scene.rho
        self._sheet()
        area = self._weighed[2]
        if abs(area / self._area - 1) > 1e-12:
            rho *= self._area / area
        pinned = np.flatnonzero(self.refined.all_of(self._pinned))
        self.model = self._build(rest.mesh, rest.start, pinned, rho)

    def _energies(self, state: State) -> tuple[float, float, float]:
        """Kinetic, elastic and gravity energy [J]."""
        body = self.model.body
        if self.model.here is not state:
            body.update(state.x)
        return body.kinetic_energy(state.v), body.energy_here(), self.model.potential(state.x)


def _changed(before: Sheet, after: Sheet) -> tuple[np.ndarray, np.ndarray]:
    """Which rows of a mesh, and of what it was refined to, are not the same triangle in both."""
    old = len(before.triangles)
    rows = np.flatnonzero((before.triangles != after.triangles[:old]).any(axis=1))
    return rows, np.concatenate([rows, np.arange(old, len(after.triangles))])
