"""Cholesky factorisation by dense fronts, in the order of a nested dissection (Duff and Reid 1983; Liu 1990).

Every node of the dissection, a separator or a leaf, becomes a front: its vertices are eliminated together, as dense
block columns, and what that takes away from later fronts is taken from them at once. The two halves of a cloth are
factorised on two threads. What they take from the fronts they have in common is gathered in a joint of each half
first: neither waits for the other, and the sums are the same with one thread or two.

Kernels of our own (`muslin.solve.fronts`): nothing to install, and no licence to think of.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import astuple, dataclass

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.physics.elements.layout import Layout, pointers
from muslin.solve import ordering
from muslin.solve.superlu import Indefinite, pivoted

#: Largest piece of a cloth that is a front of its own, uncut [vertices].
FRONT = 5


@dataclass
class Plan:
    """What the kernel needs to know of a pattern. A position is that of a vertex in the right-hand side.

    fronts : (fronts + joints + 1, 7) table
        Columns as in `muslin.solve.fronts`: the fronts in postorder, then the joints, then an end.
    segments : (segments, 4) table
        Columns as there: the parts of borders that are pivots of one and the same front, their owner.
    order : (fronts,)
        The fronts of each task, in postorder, then those that join the tasks.
    tasks, joints : pointers
        Of each task (and the rest) into `order`; of each task into `fronts`.
    rows
        Positions of all borders.
    places
        Where the rows of a segment, and those below it, are in the panel of its owner.
    target : (blocks,)
        Where in the factor each block of the matrix goes.
    """

    fronts: np.ndarray
    segments: np.ndarray
    order: np.ndarray
    tasks: np.ndarray
    joints: np.ndarray
    rows: np.ndarray
    places: np.ndarray
    target: np.ndarray

    @property
    def positions(self) -> int:
        """Length of the right-hand side, in vertices: those of the joints included."""
        return int(self.fronts[-1, 3])

    @property
    def columns(self) -> int:
        """Columns of all blocks of the factor."""
        return int(self.fronts[-1, 2])

    @property
    def flops(self) -> float:
        """Additions and multiplications of a factorisation."""
        k, b = self.fronts[: len(self.order), :2].astype(float).T
        return float(np.sum(27 * k * (k * k / 3 + k * b + b * b)))

    def arguments(self) -> list[np.ndarray]:
        """The arrays as the kernel takes them: flat, and never empty."""
        flat = (array.ravel().astype(np.int32) for array in astuple(self))
        return [array if array.size else np.zeros(1, np.int32) for array in flat]


def plan(
    graph: sp.csr_matrix, sizes: list[int], children: list[list[int]], halves: bool
) -> tuple[Plan, np.ndarray, np.ndarray]:
    """Plan the factorisation of all matrices of a pattern.

    Parameters
    ----------
    graph : (n, n) CSR matrix
        The pattern of the blocks in the order of elimination, sorted, the diagonal included.
    sizes, children : lists
        Of each node of the dissection: its number of vertices, and the nodes below it (`ordering.dissection`).
    halves : bool
        Whether the two halves are to be tasks of their own.

    Returns
    -------
    plan : Plan
    row, col : int arrays
        The blocks on and below the diagonal, in the order in which the kernel takes them.
    """
    n, count = graph.shape[0], len(sizes)
    borders = _borders(graph, np.concatenate([[0], np.cumsum(sizes)]), children)
    tasks = _halves(children) if halves else [range(count)]
    outside = [borders[task[-1]].copy() for task in tasks if len(tasks) > 1]  # what a joint stands for
    first = np.concatenate([[0], np.cumsum([*sizes, *map(len, outside)])])
    for task, joint, positions in zip(tasks, outside, first[count:], strict=False):
        for k in task:
            inner = np.searchsorted(borders[k], first[task[-1] + 1])
            borders[k][inner:] = positions + np.searchsorted(joint, borders[k][inner:])
    panels = _Panels(first, [*borders, *outside], count)

    row = np.repeat(np.arange(n), np.diff(graph.indptr))
    kept = graph.indices >= row  # a row above the diagonal is a column below it
    col, row = row[kept], graph.indices[kept].astype(np.int64)
    position = row.copy()
    for task, joint, positions in zip(tasks, outside, first[count:], strict=False):
        begin, end = first[task[0]], first[task[-1] + 1]
        beyond = (begin <= col) & (col < end) & (row >= end)
        position[beyond] = positions + np.searchsorted(joint, row[beyond])
    segments, places = panels.segments()
    fronts = np.zeros((len(panels.size) + 1, 7), np.int64)
    fronts[:-1, 0], fronts[:count, 1] = panels.size, panels.border[:count]
    fronts[:, 2], fronts[:, 3], fronts[:, 4] = panels.start, first, panels.rows_at
    fronts[:, 5] = pointers(panels.owner[col], len(panels.size))
    fronts[:, 6] = pointers(segments[:, 0], len(panels.size))
    rest = sorted(set(range(count)).difference(*tasks))
    parts = [*tasks, rest]
    made = Plan(
        fronts,
        segments[:, 1:],
        np.concatenate([np.array(part, int) for part in parts]),
        np.cumsum([0, *map(len, parts)]),
        count + (np.arange(len(tasks) + 1) if outside else np.zeros(len(tasks) + 1, int)),
        panels.rows,
        places,
        panels.at(panels.owner[col], position, col),
    )
    return made, row, col


def _borders(graph: sp.csr_matrix, first: np.ndarray, children: list[list[int]]) -> list[np.ndarray]:
    """The later vertices that each front touches, by itself or through its children."""
    borders: list[np.ndarray] = []
    for k, below in enumerate(children):
        own = graph.indices[graph.indptr[first[k]] : graph.indptr[first[k + 1]]]
        touched = np.unique(np.concatenate([own, *(borders[child] for child in below)]))
        borders.append(touched[np.searchsorted(touched, first[k + 1]) :].astype(np.int64))
    return borders


def _halves(children: list[list[int]]) -> list[range]:
    """The two subtrees below the first node that has two, or all in one."""
    node = len(children) - 1
    while len(children[node]) == 1:
        node = children[node][0]
    if len(children[node]) == 2:
        one, other = children[node]
        return [range(one + 1), range(one + 1, other + 1)]
    return [range(len(children))]


class _Panels:
    """Where things are in the panels of fronts and joints.

    first : pointers
        The pivots of each, as positions.
    borders : list of arrays
        Positions of the border of each, sorted. Those of a joint are what it stands for, not rows of its panel.
    count : int
        How many are fronts.
    """

    def __init__(self, first: np.ndarray, borders: list[np.ndarray], count: int):
        self.first, self.size = first, np.diff(first)
        self.border = np.array([len(border) for border in borders])
        below = np.where(np.arange(len(borders)) < count, self.border, 0)
        self.start = np.concatenate([[0], np.cumsum(3 * self.size * (self.size + below))])
        self.rows = np.concatenate(borders).astype(np.int64)
        self.rows_at = np.concatenate([[0], np.cumsum(self.border)])
        self.owner = np.repeat(np.arange(len(borders)), self.size)  # whose pivot a position is
        self._whose = np.repeat(np.arange(len(borders)), self.border)  # whose border a row is in
        self._key = self._whose * first[-1] + self.rows

    def place(self, front: np.ndarray, position: np.ndarray) -> np.ndarray:
        """In which row of blocks of a front's panel a position is."""
        found = np.searchsorted(self._key, front * self.first[-1] + position) - self.rows_at[front]
        inner = position < self.first[front + 1]
        return np.where(inner, position - self.first[front], self.size[front] + found)

    def at(self, front: np.ndarray, position: np.ndarray, pivot: np.ndarray) -> np.ndarray:
        """Where in the factor a block of a front's panel begins."""
        cell = self.place(front, position) * self.size[front] + pivot - self.first[front]
        return self.start[front] + 3 * cell

    def segments(self) -> tuple[np.ndarray, np.ndarray]:
        """The table of segments, its first column the front whose border they are part of, and their places."""
        owner, whose = self.owner[self.rows], self._whose
        begin = np.flatnonzero((np.diff(whose, prepend=-1) != 0) | (np.diff(owner, prepend=-1) != 0))
        front = whose[begin]
        last = self.rows_at[front + 1]  # its places reach to the end of the border
        end = np.minimum(np.append(begin[1:], len(whose)), last)
        at = np.concatenate([[0], np.cumsum(last - begin)])
        rows = np.repeat(begin - at[:-1], last - begin) + np.arange(at[-1])
        places = self.place(np.repeat(owner[begin], last - begin), self.rows[rows])
        start = self.rows_at[front]
        return np.stack([front, owner[begin], begin - start, end - start, at[:-1]], axis=1), places


class Multifrontal:
    """Cholesky factorisation by dense fronts, in kernels of our own."""

    only_definite = False

    def __init__(self, graph: sp.csr_matrix, points: np.ndarray, definite: bool, tolerance: float):
        from muslin.base.launch import Launch
        from muslin.solve.fronts import factorisation

        n = graph.shape[0]
        nodes, children = ordering.dissection(graph, points, np.arange(n), FRONT)
        order = np.concatenate(nodes)
        permuted = graph[order][:, order].tocsr()
        permuted.sort_indices()
        self.plan, row, col = plan(permuted, [len(node) for node in nodes], children, n >= ordering.HALVES)
        self._order, self._place = order, np.argsort(order)
        start = 12 * np.arange(len(row), dtype=np.int32)
        self.layout = Layout(order[col], order[row], start, np.full(len(row), 4, np.int32), 12 * len(row))
        self.data = np.zeros(self.layout.size)
        self._y, self._bad = np.zeros(3 * self.plan.positions), np.zeros(1, np.int32)
        self._b = self._y[: 3 * n].reshape(n, 3)
        factor = np.zeros((self.plan.columns, 4))
        with runtime.shared_out(opt_level=1):  # without its own passes, four numbers are stored one by one
            kernel = factorisation(len(self.plan.tasks) == 3)
            arrays = (self.data.reshape(-1, 4), factor, self._y, self._bad)
            self._launch = Launch(kernel, *self.plan.arguments(), *arrays)
            self._launch()  # compiles
        self._factor = factor

    def solve(self, b: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Factorise and solve; by pivoted LU if the matrix is not positive definite."""
        np.take(b, self._order, axis=0, out=self._b, mode="clip")
        self._bad[0] = 0
        self._launch()
        if self._bad[0]:
            if self.only_definite:
                raise Indefinite
            return pivoted(self._full()).solve(b.ravel()).reshape(-1, 3)
        return self._b.take(self._place, axis=0)

    def again(self, b: np.ndarray) -> np.ndarray:
        """Solve with the factors that there are."""
        if self._bad[0]:
            return self.solve(b, b)
        np.take(b, self._order, axis=0, out=self._b, mode="clip")
        self._solve()
        return self._b.take(self._place, axis=0)

    @functools.cached_property
    def _solve(self) -> Callable[[], None]:
        from muslin.base.launch import Launch
        from muslin.solve.fronts import solution

        fronts, _, order, tasks, joints, rows, *_ = self.plan.arguments()
        with runtime.shared_out(opt_level=1):
            launch = Launch(
                solution(len(self.plan.tasks) == 3), fronts, order, tasks, joints, rows, self._factor, self._y
            )
            kept = self._y.copy()
            launch()  # compiles
            self._y[:] = kept
        return launch

    def _full(self) -> sp.csc_matrix:
        """The whole matrix, in the order of the vertices."""
        blocks, row, col = self.data.reshape(-1, 3, 4)[:, :, :3], self.layout.row, self.layout.col
        off = row != col
        blocks = np.concatenate([blocks, blocks[off].transpose(0, 2, 1)])
        row, col = np.append(row, col[off]), np.append(col, row[off])
        order = np.lexsort((col, row))
        indptr = pointers(row, len(self._order))
        return sp.bsr_matrix((blocks[order], col[order], indptr)).tocsc()
