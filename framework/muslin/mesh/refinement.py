"""Reversible sqrt(3) refinement of a triangle mesh, here and there, and its coarsening (Kobbelt 2000).

A triangle has a generation g, 0 in the mesh one begins with; g // 2 counts levels, and each level has three times the
triangles. An even generation is complete, an odd one is on its way:

* **Split.** A triangle (a, b, c) of even generation g gets a vertex P at its barycentre, and becomes (P, a, b),
  (P, b, c) and (P, c, a) of generation g + 1. The edge opposite P is the *base*; what lies across it is the *mate*.
* **Flip.** Where the mates (P, A, B) and (Q, B, A) are of the same odd generation g + 1, their base AB is exchanged for
  PQ at once: (P, A, Q) and (Q, B, P), of generation g + 2. So the mate of an odd triangle is always one generation
  below it.
* **Boundary.** A base on the boundary has no mate, and waits for none: its triangle (P, A, B) is complete, of
  generation g + 2, and of an odd level. When *that* is split its boundary edge is trisected instead, at
  A' = (A + A + B) / 3 and B' = (B + B + A) / 3: (A', P, A) and (B', B, P) with the bases PA and BP, of one generation
  more, and (A', B', P), complete, of two. So after two levels every edge is cut in three, the boundary's like those
  inside, and angles do not get worse from level to level.
* **Where only some triangles are wanted.** To refine a triangle of odd generation is to split its mate, which flips
  their base. Before a triangle of generation g is split, neighbours of generation g - 1 (odd ones) are refined,
  so that neighbours are never more than one generation apart.
* **Coarsening** takes a vertex out again: it undoes the flips around it, and then its split. It can go as soon as no
  triangle around it, or across from there, depends on it: see `Refinement.removable`. A, B of a trisection go together.

Which triangles there are depends on which splits have been made and not been undone, and on nothing else. Numbers
follow the operations: what is new stands at the end, in the order of its parents; a parent's row becomes its first
child and is the parent's again when the split is undone; what goes leaves no hole, and the others keep their order.
So refining and undoing all of it, in whichever order, gives the same rows with the same corners in the same places.
Every new vertex is the mean of three that were there (twice the same one, on the boundary): see `Refinement.spread`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.surface import Mesh

#: The half-edge of a row's corner k runs from that corner to the next. An odd triangle's base, and of a pair that was
#: flipped the edge between the two:
BASE, BETWEEN = 1, 2


@dataclass(frozen=True, eq=False)
class Refinement:
    """A mesh that can be refined and coarsened; every operation gives another one and leaves this as it is.

    Attributes
    ----------
    triangles : (m, 3) int32
    generation : (m,) int32
        Of each triangle.
    parents : (n, 3) int32
        The vertices each vertex is the mean of, all before it; -1 for those of the mesh one began with.
    children : (n, 3) int32
        Rows of the three triangles that came of the split that made a vertex; -1 likewise.
    born : (n,) int32
        Generation of the triangle that was split; -1 likewise.
    across : (m, 3) int32
        Half-edge 3 row + corner on the other side of each half-edge; -1 on the boundary.
    """

    triangles: np.ndarray
    generation: np.ndarray
    parents: np.ndarray
    children: np.ndarray
    born: np.ndarray
    across: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh) -> Refinement:
        """A mesh (checked, as meshes are) that nothing has been done to."""
        n, triangles = len(mesh.vertices), np.array(mesh.triangles, dtype=np.int32)
        none = np.full((n, 3), -1, dtype=np.int32)
        generation = np.zeros(len(triangles), dtype=np.int32)
        return cls(triangles, generation, none, none.copy(), none[:, 0].copy(), opposite(triangles, n))

    @property
    def vertices(self) -> int:
        """How many vertices there are."""
        return len(self.born)

    @property
    def added(self) -> int:
        """How many of them refinement added: they come last."""
        return int((self.born >= 0).sum())

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Values (k, ...) of the first k vertices, and of the others the means of their parents, (n, ...).

        Like every mean here it is (a + b + c) / 3, in this order: the same bits whenever it is computed.
        """
        none = np.zeros((self.vertices, *values.shape[1:]), np.float32)[len(values) :]
        out = np.concatenate([values, none])  # whole numbers become doubles
        for of_one_age in self._ages(len(values)):
            a, b, c = self.parents[of_one_age].T
            out[of_one_age] = (out[a] + out[b] + out[c]) / 3
        return out

    def all_of(self, values: np.ndarray) -> np.ndarray:
        """Truth values (k,) of the first k vertices, and of the others whether all their parents' are true, (n,)."""
        out = np.concatenate([values, np.zeros(self.vertices, dtype=bool)[len(values) :]])
        for of_one_age in self._ages(len(values)) if values.any() else ():
            out[of_one_age] = out[self.parents[of_one_age]].all(axis=1)
        return out

    def _ages(self, known: int) -> list[np.ndarray]:
        """Vertices from number `known` on, those with one `born` together: their parents' is smaller."""
        if not (least := self.vertices - self.added) <= known <= self.vertices:
            raise MeshError(f"There are {known} values for {least} to {self.vertices} vertices.")
        later = np.arange(known, self.vertices)
        ages = self.born[later]
        return [later[ages == age] for age in np.unique(ages)]

    # Refining -----------------------------------------------------------------------------------------------

    def required(self, rows: Any) -> np.ndarray:
        """Rows of all triangles that have to be split to refine these by one generation, ascending.

        Raises
        ------
        MeshError
            If there are no such triangles.
        """
        wanted = self._asked(rows, len(self.triangles), "triangle")
        generation, neighbours = self.generation, self.across // 3
        need = np.zeros(len(generation), dtype=bool)
        while len(wanted):
            odd = generation[wanted] % 2 == 1
            wanted[odd] = neighbours[wanted[odd], BASE]
            fresh = np.unique(wanted[~need[wanted]])
            need[fresh] = True
            around = neighbours[fresh]
            behind = (self.across[fresh] >= 0) & (generation[around] < generation[fresh, None])
            wanted = around[behind]
        return np.flatnonzero(need)

    def refine(self, rows: Any) -> Refinement:
        """Refine triangles by one generation, and first whatever has to be.

        Parameters
        ----------
        rows : int array
            Rows of the triangles.

        Raises
        ------
        MeshError
            If there are no such triangles.
        """
        need, refined = self.required(rows), self
        for g in np.unique(self.generation[need]):
            refined = refined._split(need[self.generation[need] == g], int(g))
        return refined

    def growth(self, rows: Any) -> int:
        """How many vertices `refine` adds."""
        need = self.required(rows)
        return len(need) + int(self._trisected(need).sum())

    def _trisected(self, rows: np.ndarray) -> np.ndarray:
        """Whether a split of these (complete) triangles trisects their boundary edge."""
        return (self.generation[rows] // 2 % 2 == 1) & (self.across[rows] < 0).any(axis=1)

    def _split(self, rows: np.ndarray, g: int) -> Refinement:
        """Split triangles of one even generation, whose neighbours are no coarser, and flip what is to be."""
        n, m, count = self.vertices, len(self.triangles), len(rows)
        cut = self._trisected(rows)
        first = n + np.arange(count) + np.cumsum(cut) - cut
        second = first + cut
        a, b, c = self.triangles[rows].T
        parents = np.empty((count + int(cut.sum()), 3), dtype=np.int32)
        parents[first - n] = np.where(cut[:, None], np.stack([b, b, c], axis=1), self.triangles[rows])
        parents[second[cut] - n] = np.stack([c, c, b], axis=1)[cut]
        one, two = m + 2 * np.arange(count), m + 2 * np.arange(count) + 1
        children = np.stack([rows, one, two], axis=1).astype(np.int32)
        P, Q, trisection = first, second, cut[:, None]
        triangles = np.concatenate([self.triangles, np.empty((2 * count, 3), dtype=np.int32)])
        triangles[rows] = np.stack([P, a, b], axis=1)
        triangles[one] = np.where(trisection, np.stack([P, Q, a], axis=1), np.stack([P, b, c], axis=1))
        triangles[two] = np.where(trisection, np.stack([Q, c, a], axis=1), np.stack([P, c, a], axis=1))
        generation = np.concatenate([self.generation, np.zeros(2 * count, dtype=np.int32)])
        complete = np.where(trisection, [False, True, False], self.across[rows] < 0)
        generation[children] = g + 1 + complete
        owner = np.repeat(np.arange(count), 1 + cut)
        refined = replace(
            self,
            triangles=triangles,
            generation=generation,
            parents=np.concatenate([self.parents, parents]),
            children=np.concatenate([self.children, children[owner]]),
            born=np.concatenate([self.born, np.full(len(parents), g, dtype=np.int32)]),
            across=_across_again(self.across, triangles, children.ravel(), n + len(parents)),
        )
        return refined._flip(children.ravel(), g + 1)

    def _flip(self, rows: np.ndarray, odd: int) -> Refinement:
        """Flip the bases between these triangles and mates of the same odd generation."""
        rows = rows[self.generation[rows] == odd]
        mates = self.across[rows, BASE] // 3
        met = self.generation[mates] == odd
        rows, mates = rows[met], mates[met]
        if not len(rows):
            return self
        triangles, generation = self.triangles.copy(), self.generation.copy()
        triangles[rows, 2] = self.triangles[mates, 0]
        triangles[mates, 2] = self.triangles[rows, 0]
        generation[rows] = generation[mates] = odd + 1
        across = _across_again(self.across, triangles, np.concatenate([rows, mates]), self.vertices)
        return replace(self, triangles=triangles, generation=generation, across=across)

    # Coarsening ---------------------------------------------------------------------------------------------

    def _flipped(self, vertices: np.ndarray) -> np.ndarray:
        """Which children (k, 3) of the splits that made these vertices have been flipped, if none was split again."""
        children, g = self.children[vertices], self.born[vertices, None]
        level, trisection = g // 2 % 2, self._of_trisections(vertices)[:, None]
        outer = (level == 0) & (self.across[children, BASE] < 0)
        middle = trisection & (np.arange(3) == 1)
        return (self.generation[children] == g + 2) & ~outer & ~middle

    def _of_trisections(self, vertices: np.ndarray) -> np.ndarray:
        return self.parents[vertices, 0] == self.parents[vertices, 1]

    def removable(self) -> np.ndarray:
        """Whether each vertex can be taken out now, (n,): the triangles of its split are there, none of them split
        again, and undoing their flips leaves no neighbours two generations apart.
        """
        made = np.flatnonzero(self.born >= 0)
        children, g = self.children[made], self.born[made, None]
        there = (self.generation[children] > g) & (self.generation[children] <= g + 2)
        own = np.where(self._of_trisections(made)[:, None], 1, 0)  # its three begin with A', A', B'
        corner = self.triangles[children, 0]
        there &= (corner == made[:, None]) | ((own == 1) & (self.children[corner, 1] == children[:, 1:2]))
        flipped = self._flipped(made)
        partners = self.across[children, BETWEEN] // 3
        whole = self.generation[partners] == g + 2
        fine = np.where(self.across >= 0, self.generation[self.across // 3], 0)
        whole &= (fine[children, 1] <= g + 2) & (fine[partners, 0] <= g + 2)
        out = np.zeros(self.vertices, dtype=bool)
        out[made] = (there & (whole | ~flipped)).all(axis=1)
        return out

    def coarsen(self, vertices: Any) -> tuple[Refinement, np.ndarray]:
        """Take vertices out; the two of a trisection go together, whichever of them is named.

        Parameters
        ----------
        vertices : int array
            All of them `removable`.

        Returns
        -------
        coarser : Refinement
        kept : (k,) int array
            The vertices that are left, by the numbers they had.

        Raises
        ------
        MeshError
            If there is no such vertex, or it cannot be taken out.
        """
        chosen = self._asked(vertices, self.vertices, "vertex")
        if len(original := chosen[self.born[chosen] < 0]):
            raise MeshError(
                f"Vertex {original[0]} was not added by refinement, and cannot be taken out.",
                "Only vertices with born >= 0 can.",
            )
        if len(bound := chosen[~self.removable()[chosen]]):
            raise MeshError(
                f"Vertex {bound[0]} cannot be taken out yet: triangles around it have been refined further.",
                "Take those vertices out first; `removable` says which can go.",
            )
        _, once = np.unique(self.children[chosen, 0], return_index=True)
        made = chosen[once]
        children, g = self.children[made], self.born[made]
        triangles, generation = self.triangles.copy(), self.generation.copy()
        rows = children[self._flipped(made)]
        partners = self.across[rows, BETWEEN] // 3
        triangles[rows, 2] = self.triangles[partners, 1]
        triangles[partners, 2] = self.triangles[rows, 1]
        generation[rows] = generation[partners] = generation[rows] - 1
        r, s, t = children.T
        second = np.where(self._of_trisections(made), triangles[r, 2], triangles[s, 1])
        triangles[r] = np.stack([triangles[r, 1], second, triangles[t, 1]], axis=1)
        generation[r] = g
        gone = np.zeros(self.vertices, dtype=bool)
        gone[self.triangles[r, 0]] = gone[self.triangles[t, 0]] = True
        return _without(self, triangles, generation, gone, np.concatenate([s, t])), np.flatnonzero(~gone)

    def _asked(self, numbers: Any, count: int, what: str) -> np.ndarray:
        """Numbers of triangles or vertices there are, or a message."""
        asked = np.atleast_1d(np.asarray(numbers))
        asked = asked.astype(np.int64) if asked.size == 0 else asked
        if asked.dtype.kind not in "iu" or asked.ndim != 1:
            raise MeshError(
                f"Which {what} is meant is not understood: {asked.dtype} of shape {asked.shape}.",
                "Give whole numbers in one row.",
            )
        if len(outside := asked[(asked < 0) | (asked >= count)]):
            raise MeshError(f"There is no {what} {outside[0]}.", f"They are numbered from 0 to {count - 1}.")
        return asked.astype(np.int64)


def _without(
    mesh: Refinement, triangles: np.ndarray, generation: np.ndarray, gone: np.ndarray, rows: np.ndarray
) -> Refinement:
    """The refinement without some vertices and rows; the others move up."""
    left = np.ones(len(triangles), dtype=bool)
    left[rows] = False
    vertex = np.append(np.cumsum(~gone) - 1, -1).astype(np.int32)  # -1 stays -1
    row = np.append(np.cumsum(left) - 1, -1).astype(np.int32)
    triangles = vertex[triangles[left]]
    return Refinement(
        triangles,
        generation[left],
        vertex[mesh.parents[~gone]],
        row[mesh.children[~gone]],
        mesh.born[~gone],
        opposite(triangles, int((~gone).sum())),
    )


def opposite(triangles: np.ndarray, n: int) -> np.ndarray:
    """Half-edge (3 row + corner) across each half-edge, (m, 3); -1 on the boundary.

    Parameters
    ----------
    triangles : (m, 3) int
    n : int
        Number of vertices.
    """
    start = triangles.ravel().astype(np.int64)
    end = triangles[:, [1, 2, 0]].ravel().astype(np.int64)
    key = np.minimum(start, end) * n + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    one, two = order[:-1], order[1:]
    pairs = (key[one] == key[two]) & (start[one] == end[two])
    across = np.full(len(key), -1, dtype=np.int32)
    across[one[pairs]], across[two[pairs]] = two[pairs], one[pairs]
    return across.reshape(-1, 3)


def _across_again(across: np.ndarray, triangles: np.ndarray, changed: np.ndarray, n: int) -> np.ndarray:
    """`opposite` of triangles of which only some rows are not, or otherwise, among those that `across` is of."""
    out = np.concatenate([across, np.full((len(triangles) - len(across), 3), -1, dtype=np.int32)])
    around = across[changed[changed < len(across)]]
    out[changed] = -1
    near = np.zeros(len(triangles), dtype=bool)
    near[changed] = near[around[around >= 0] // 3] = True
    rows = np.flatnonzero(near).astype(np.int32)
    own = opposite(triangles[rows], n)  # -1: between one that stays and one that is not near
    out[rows] = np.where(own >= 0, 3 * rows[own // 3] + own % 3, out[rows])
    return out


def violations(mesh: Refinement, euler: int | None = None) -> list[str]:
    """What is wrong with a refinement: nothing, whatever was done to it.

    Parameters
    ----------
    mesh : Refinement
    euler : int, optional
        The Euler characteristic (V - E + F) it should have.
    """
    T, g, n, m = mesh.triangles, mesh.generation, mesh.vertices, len(mesh.triangles)
    start, end = T.ravel().astype(np.int64), T[:, [1, 2, 0]].ravel().astype(np.int64)
    directed = np.sort(start * n + end)
    undirected = np.sort(np.minimum(start, end) * n + np.maximum(start, end))
    edges = 1 + int((np.diff(undirected) != 0).sum())
    inside = mesh.across >= 0
    apart = np.abs(g[:, None] - g[mesh.across // 3]) * inside
    odd = np.flatnonzero(g % 2)
    made = mesh.born >= 0
    numbers = np.arange(n)[made]
    wrong = {
        "a triangle uses a vertex twice or one that is not there": (start == end).any() or T.max() >= n,
        "an edge is in two triangles in the same direction": (np.diff(directed) == 0).any(),
        "a vertex is in no triangle": len(np.unique(T)) != n,
        "the triangles across edges are others": not np.array_equal(mesh.across, opposite(T, n)),
        "neighbours are more than one generation apart": (apart > 1).any(),
        "an odd triangle has no mate": (mesh.across[odd, BASE] < 0).any(),
        "an odd triangle's mate is not one generation below": (
            g[mesh.across[odd, BASE] // 3] != g[odd] - 1
        ).any(),
        "a parent comes after its child": (mesh.parents[made] >= numbers[:, None]).any(),
        "the first vertices are not the mesh's": bool(np.diff(made.astype(int)).min(initial=0) < 0),
        "a split's rows are not there": (mesh.children[made] < 0).any() or (mesh.children >= m).any(),
    }
    found = [what for what, is_so in wrong.items() if is_so]
    if euler is not None and n - edges + m != euler:
        found.append(f"the Euler characteristic is {n - edges + m}, not {euler}")
    return found


def euler(mesh: Mesh) -> int:
    """Euler characteristic V - E + F of a mesh."""
    from muslin.mesh.surface import edges

    return len(mesh.vertices) - len(edges(mesh.triangles)) + len(mesh.triangles)
