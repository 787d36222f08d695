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
    at = points[vertices]
    along = at[:, np.argmax(np.ptp(at, axis=0))]
    order = np.argsort(along, kind="stable")
    side = np.zeros(graph.shape[0], dtype=np.int8)
    middle = along[order[len(order) // 2]]
    low = along < middle - 1e-9 * (along[order[-1]] - along[order[0]])
    if not low.any():  # many vertices at the same place
        low[order[: len(order) // 2]] = True
    side[vertices], side[vertices[low]] = 1, 2
    touched = graph[vertices[low]].indices
    side[touched[side[touched] == 1]] = 3
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
    nodes: list[np.ndarray] = []
    children: list[list[int]] = []

    def visit(vertices: np.ndarray) -> int:
        below: list[int] = []
        if len(vertices) > leaf:
            one, other, vertices = cut(graph, points, vertices)
            below = [visit(part) for part in (one, other) if len(part)]
        nodes.append(vertices)
        children.append(below)
        return len(nodes) - 1

    visit(vertices)
    return nodes, children


def nested_dissection(graph: sp.csr_matrix, points: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """The vertices in an order of elimination that fills in little."""
    return np.concatenate(dissection(graph, points, vertices)[0])
