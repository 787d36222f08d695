"""Orders of elimination for sparse matrices of meshes: nested dissection by coordinates.

Cutting a sheet of n vertices by lines through its middle, again and again, and eliminating the cuts last leaves
O(n log n) numbers in the factor, and two halves that know nothing of each other until the first cut.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

#: Pieces of at most this many vertices are not cut again.
LEAF = 12

#: Free vertices from which on two threads factorise the two halves of a cloth.
HALVES = 700


def pseudo_points(graph: sp.csr_matrix) -> np.ndarray:
    """Coordinates (n, 3) for a graph that has none: distances, in edges, from three vertices far apart."""
    n = graph.shape[0]
    weight = sp.csr_matrix((np.ones(len(graph.indices)), graph.indices, graph.indptr), shape=graph.shape)
    points, source = np.zeros((n, 3)), 0
    for k in range(3):
        reached = sp.csgraph.dijkstra(weight, indices=source, unweighted=True)
        points[:, k] = np.where(np.isfinite(reached), reached, n)
        source = int(np.argmax(points[:, : k + 1].min(axis=1)))
    return points


def cut(graph: sp.csr_matrix, points: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, ...]:
    """Cut a set of vertices in two across its longest extent: (one side, other side, separator)."""
    at = np.ascontiguousarray(points.take(vertices, axis=0).T)
    along = at[np.argmax(np.ptp(at, axis=1))]
    half = len(along) // 2
    side = np.zeros(graph.shape[0], dtype=np.int8)
    middle = np.partition(along, half)[half]
    low = along < middle - 1e-9 * (along.max() - along.min())
    if not low.any():  # many vertices at the same place
        low[np.argsort(along, kind="stable")[:half]] = True
    side[vertices], side[vertices[low]] = 1, 2
    touched = graph.indices[np.repeat(side == 2, np.diff(graph.indptr))]
    side[touched[side.take(touched) == 1]] = 3
    return vertices[low], vertices[side[vertices] == 1], vertices[side[vertices] == 3]


def dissection(
    graph: sp.csr_matrix, points: np.ndarray, vertices: np.ndarray, leaf: int = LEAF
) -> tuple[list[np.ndarray], list[list[int]]]:
    """Cut a set of vertices in two, and those again, until pieces are small.

    Parameters
    ----------
    graph : CSR matrix
    points : (n, 3) array
    vertices : int array
    leaf : int
        Pieces of at most this many vertices are not cut again.

    Returns
    -------
    nodes : list of int arrays
        The vertices of each separator and of each piece that was not cut, those below a separator before it.
    children : list of lists
        The nodes below each node: the pieces that its separator divides.
    """
    pieces, parents, at = _pieces(graph, points, vertices, leaf)
    below: list[list[int]] = [[] for _ in range(len(parents))]
    for piece, parent in enumerate(parents[1:], 1):
        below[parent].append(piece)
    nodes: list[np.ndarray] = []
    children: list[list[int]] = []

    def visit(piece: int) -> int:
        under = [visit(part) for part in below[piece]]
        nodes.append(pieces[at[piece] : at[piece + 1]])
        children.append(under)
        return len(nodes) - 1

    visit(0)
    return nodes, children


def _pieces(
    graph: sp.csr_matrix, points: np.ndarray, vertices: np.ndarray, leaf: int
) -> tuple[np.ndarray, list[int], np.ndarray]:
    """All cuts of a dissection, those of one depth at once: as `cut` makes them one by one.

    Returns
    -------
    vertices : int array
        Piece by piece: those of its separator, or all where it was not cut.
    parents : list
        Of each piece the one it was cut from, before it; -1 for the first.
    at : int array
        Where each piece begins, and the end.
    """
    n = graph.shape[0]
    row, col = np.repeat(np.arange(n), np.diff(graph.indptr)), graph.indices
    last = np.full(n, -1)  # the smallest piece so far that a vertex is in
    last[vertices] = 0
    parents, begun = [-1], 0
    active: np.ndarray = np.asarray(vertices)
    piece: np.ndarray = np.zeros(len(vertices), dtype=np.int64)
    while True:
        count = np.bincount(piece - begun, minlength=len(parents) - begun)
        large = count > leaf
        kept = large[piece - begun]
        if not kept.any():
            break
        active, piece = active[kept], piece[kept]
        which = np.cumsum(large) - 1  # pieces that are cut, numbered among themselves
        group, count = which[piece - begun], count[large]
        first = np.cumsum(count) - count
        where = points[active]
        extent = np.maximum.reduceat(where, first) - np.minimum.reduceat(where, first)
        along = where[np.arange(len(active)), np.argmax(extent, axis=1)[group]]
        order = np.lexsort((along, group))
        ranked = along[order]
        middle, span = ranked[first + count // 2], ranked[first + count - 1] - ranked[first]
        low = along < (middle - 1e-9 * span)[group]
        none = ~np.logical_or.reduceat(low, first)  # many vertices at the same place
        half = none[group] & (np.arange(len(active)) - first[group] < (count // 2)[group])
        low[order[half]] = True
        of = np.full(n, -1)
        of[active] = 2 * group + low
        touching = (of[row] >= 0) & (of[row] ^ of[col] == 1)
        between = touching & (of[row] & 1 == 1)
        separator = np.zeros(n, dtype=bool)
        separator[col[between]] = True
        left = ~separator[active]
        inside = (of[row] >= 0) & (of[row] == of[col])
        row, col = row[inside], col[inside]
        active, side = active[left], (2 * group + ~low)[left]  # the lower side first
        there, side = np.unique(side, return_inverse=True)
        order = np.argsort(side, kind="stable")
        parent = np.flatnonzero(large) + begun
        begun = len(parents)
        parents += parent[there // 2].tolist()
        active, piece = active[order], begun + side.ravel()[order]
        last[active] = piece
    order = np.argsort(last[vertices], kind="stable")
    at = np.concatenate([[0], np.cumsum(np.bincount(last[vertices], minlength=len(parents)))])
    return vertices[order], parents, at


def nested_dissection(graph: sp.csr_matrix, points: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """The vertices in an order of elimination that fills in little."""
    return np.concatenate(dissection(graph, points, vertices)[0])
