"""What a mesh must satisfy to be cloth, and what is said when it does not.

Every check is vectorised, raises at the first kind of trouble it finds, and says how many there are and
where the first one is. `Places` turns an index into the words for a place: the line of a text file, or the
number of an element.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from muslin.base.errors import MeshError

# A triangle is flat if its height over its longest edge is below this fraction of that edge.
FLATTEST = 1e-6
# Coordinates beyond LARGEST, edges below SMALLEST [m]: their fourth powers still fit a double.
LARGEST = 1e15
SMALLEST = 1e-15


@dataclass(frozen=True)
class Places:
    """Words for where things are.

    Parameters
    ----------
    mesh : str
        The file as a person would write it, or the mesh's name.
    base : int
        What the file calls its first vertex and face: 1 in OBJ, 0 elsewhere.
    vertices, faces : (n,) and (m,) int arrays, optional
        The file's number of each vertex and face, where it differs from the index.
    vertex_lines, face_lines : (n,) and (m,) int arrays, optional
        The line each vertex and face stands on, for text formats.
    file : bool
        Whether the mesh came from a file; hints differ.
    kind : str
        What a cell is called, "triangle" or "tetrahedron"; a face of a file need not be a triangle yet.
    """

    mesh: str
    base: int = 0
    vertices: np.ndarray | None = None
    faces: np.ndarray | None = None
    vertex_lines: np.ndarray | None = None
    face_lines: np.ndarray | None = None
    file: bool = True
    kind: str = "triangle"

    def vertex(self, i: int) -> str:
        """Where vertex i is."""
        return self._place("vertex", i, self.vertices, self.vertex_lines)

    def face(self, i: int) -> str:
        """Where face i is."""
        return self._place(
            "face" if self.file and self.kind == "triangle" else self.kind, i, self.faces, self.face_lines
        )

    def number(self, i: int) -> int:
        """What the file calls vertex i."""
        return (
            int(i if self.vertices is None or not 0 <= i < len(self.vertices) else self.vertices[i])
            + self.base
        )

    def _place(self, kind: str, i: int, numbers: np.ndarray | None, lines: np.ndarray | None) -> str:
        number = int(i if numbers is None else numbers[i]) + self.base
        detail = f"counting from {self.base}" if lines is None else f"line {int(lines[i])}"
        return f"{kind} {number} ({detail})"

    def advice(self, file: str, arrays: str) -> str:
        """The hint that fits where the mesh came from."""
        return file if self.file else arrays


def check_surface(vertices: np.ndarray, triangles: np.ndarray, places: Places) -> None:
    """Refuse what cannot be cloth.

    Parameters
    ----------
    vertices : (n, 3) float64
        Positions [m].
    triangles : (m, 3) integer
    places : Places

    Raises
    ------
    MeshError
        If the mesh is empty; has coordinates that are not finite, indices out of range, triangles that
        repeat a vertex, are flat or occur twice, an edge in more than two triangles, neighbours wound
        against each other, or vertices in no triangle.
    """
    check_coordinates(vertices, places)
    check_faces([(np.arange(len(triangles)), triangles)], len(vertices), places)
    _check_flat(vertices, triangles, places)
    _check_duplicates(triangles, places)
    _check_edges(triangles, len(vertices), places)
    _check_unused(triangles, len(vertices), places)


def check_coordinates(vertices: np.ndarray, places: Places) -> None:
    """Refuse an empty vertex list, and coordinates that are not finite or absurdly large."""
    if len(vertices) == 0:
        raise MeshError(
            f"{places.mesh} has no vertices.",
            places.advice(
                "Is it the right file, and was the export complete?", f"Give it at least one {places.kind}."
            ),
        )
    bad = ~np.isfinite(vertices).all(axis=1)
    refuse(
        bad,
        lambda i: f"{places.vertex(i)} = {_row(vertices[i])}",
        lambda n: (
            f"{places.mesh}: {counted(n, 'vertex has', 'vertices have')} a coordinate that is not finite"
        ),
        "Fix or remove these vertices, and what uses them.",
    )
    refuse(
        (np.abs(vertices) > LARGEST).any(axis=1),
        lambda i: f"{places.vertex(i)} = {_row(vertices[i])}",
        lambda n: f"{places.mesh}: {counted(n, 'vertex is', 'vertices are')} farther out than {LARGEST:g} m",
        "Coordinates are in metres: check the units, and that the numbers were written correctly.",
    )


def check_faces(groups: list[tuple[np.ndarray, np.ndarray]], n: int, places: Places) -> None:
    """Refuse an empty face list, indices out of range and faces that repeat a vertex.

    Parameters
    ----------
    groups : list of ((b,) int, (b, k) int)
        Faces with k corners each, with their indices into `places`.
    n : int
        Number of vertices.
    places : Places
    """
    if sum(len(ids) for ids, _ in groups) == 0:
        raise MeshError(
            f"{places.mesh} has no triangles.",
            places.advice(
                "Cloth is a surface: export the faces too, not only points.", "Give it at least one triangle."
            ),
        )

    def misuse(ids: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, Callable[[int], str]]:
        wrong = (corners < 0) | (corners >= n)

        def describe(row: int) -> str:
            index = int(corners[row][np.argmax(wrong[row])])
            return f"{places.face(ids[row])}, which asks for vertex {places.number(index)}"

        return np.asarray(wrong.any(axis=1)), describe

    span = f"{places.base} to {n - 1 + places.base}"
    _refuse_faces(
        groups,
        misuse,
        lambda k: (
            f"{places.mesh}: {counted(k, 'face uses', 'faces use')} a vertex that does not exist "
            f"(there {'is' if n == 1 else 'are'} {n}: {span})"
        ),
        places.advice(
            f"Vertices count from {places.base} in this format: is the file complete, "
            f"or written counting from {1 - places.base}?",
            "Vertices count from 0.",
        ),
    )

    def repeats(ids: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, Callable[[int], str]]:
        ordered = np.sort(corners, axis=1)

        def describe(row: int) -> str:
            return f"{places.face(ids[row])}, with vertices {listed(corners[row], places)}"

        return (ordered[:, 1:] == ordered[:, :-1]).any(axis=1), describe

    _refuse_faces(
        groups,
        repeats,
        lambda k: (
            f"{places.mesh}: {counted(k, 'face is', 'faces are')} degenerate, using the same vertex twice"
        ),
        places.advice(
            "Remove them (in Blender: Mesh > Clean Up > Degenerate Dissolve).",
            "A triangle needs three different vertices.",
        ),
    )


def _check_flat(vertices: np.ndarray, triangles: np.ndarray, places: Places) -> None:
    corners = vertices[triangles]
    sides = corners[:, [1, 2, 0]] - corners  # (m, 3 sides, 3)
    longest = np.sqrt(np.einsum("msk,msk->ms", sides, sides).max(axis=1))
    normal = np.cross(sides[:, 0], sides[:, 1])
    twice_area = np.sqrt(np.einsum("mk,mk->m", normal, normal))
    flat = (longest < SMALLEST) | (twice_area < FLATTEST * longest**2)
    refuse(
        flat,
        lambda i: (
            f"{places.face(i)}, with vertices {listed(triangles[i], places)}, "
            f"area {twice_area[i] / 2:.3g} m^2 on a longest edge of {longest[i]:.3g} m"
        ),
        lambda n: (
            f"{places.mesh}: {counted(n, 'triangle is', 'triangles are')} degenerate, with (almost) no area"
        ),
        "Merge or move the vertices that lie on a line"
        + places.advice(" (in Blender: Mesh > Clean Up > Degenerate Dissolve, or Merge by Distance).", "."),
    )


def _check_duplicates(triangles: np.ndarray, places: Places) -> None:
    corners = np.sort(triangles, axis=1)
    order = np.lexsort(corners.T)  # stable: of equal triangles the earlier comes first
    ordered = corners[order]
    same = (ordered[1:] == ordered[:-1]).all(axis=1)
    repeat = np.zeros(len(triangles), dtype=bool)
    repeat[order[1:][same]] = True
    first = np.arange(len(triangles))
    first[order[1:][same]] = order[:-1][same]
    refuse(
        repeat,
        lambda i: f"{places.face(i)}, the same as {places.face(first[i])}",
        lambda n: (
            f"{places.mesh}: {counted(n, 'triangle is', 'triangles are')} a duplicate of an earlier one"
        ),
        "Remove the duplicates" + places.advice(" (in Blender: Mesh > Clean Up > Merge by Distance).", "."),
    )


def _check_edges(triangles: np.ndarray, n: int, places: Places) -> None:
    start = triangles.astype(np.int64)
    end = start[:, [1, 2, 0]]
    low, high = np.minimum(start, end).ravel(), np.maximum(start, end).ravel()
    upward = (start < end).ravel()
    key = low * n + high
    order = np.argsort(key, kind="stable")  # half-edge e belongs to triangle e // 3
    first = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
    times = np.diff(np.r_[first, len(key)])

    def edge(e: int) -> str:
        half = order[first[e]]
        return f"the edge from {places.vertex(low[half])} to {places.vertex(high[half])}"

    def faces(e: int) -> str:
        half_edges = order[first[e] : first[e] + times[e]]
        shown = [places.face(h // 3) for h in half_edges[:3]]
        more = ", ..." if len(half_edges) > 3 else ""
        return ", ".join(shown) + more

    refuse(
        times > 2,
        lambda e: f"{edge(e)}, in {times[e]} triangles: {faces(e)}",
        lambda k: (
            f"{places.mesh}: {counted(k, 'edge is', 'edges are')} non-manifold, "
            "shared by more than two triangles"
        ),
        "Cloth has at most two triangles at an edge: split the extra sheets off"
        + places.advice(" (in Blender: Select > All by Trait > Non Manifold).", "."),
    )
    # The edge of two neighbours is walked once up and once down, or one of the two is turned over.
    ups = np.add.reduceat(upward[order].astype(np.int64), first)
    refuse(
        (times == 2) & (ups != 1),
        lambda e: f"{edge(e)}, between {faces(e)}",
        lambda k: (
            f"{places.mesh}: inconsistent winding: at {counted(k, 'edge', 'edges')} "
            f"the two triangles run in the same direction, so their normals oppose each other"
        ),
        "Turn the triangles to one side"
        + places.advice(
            " (in Blender: Mesh > Normals > Recalculate Outside).", ": swap two vertices of each odd one."
        ),
    )


def _check_unused(triangles: np.ndarray, n: int, places: Places) -> None:
    used = np.zeros(n, dtype=bool)
    used[triangles.ravel()] = True
    refuse(
        ~used,
        places.vertex,
        lambda k: (
            f"{places.mesh}: {counted(k, 'vertex is', 'vertices are')} unused: in no triangle, so without mass"
        ),
        "Remove loose vertices" + places.advice(" (in Blender: Mesh > Clean Up > Delete Loose).", "."),
    )


def refuse(bad: np.ndarray, where: Callable[[int], str], what: Callable[[int], str], hint: str) -> None:
    """Raise if any is bad: what(how many), the first of them where(index), and the hint."""
    count = int(np.count_nonzero(bad))
    if count:
        place = where(int(np.argmax(bad)))
        raise MeshError(f"{what(count)}; {'the first is' if count > 1 else 'it is'} {place}.", hint)


def _refuse_faces(
    groups: list[tuple[np.ndarray, np.ndarray]],
    judge: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, Callable[[int], str]]],
    what: Callable[[int], str],
    hint: str,
) -> None:
    """`refuse` over groups of faces; the first is the one with the lowest index."""
    count, first, place = 0, np.inf, ""
    for ids, corners in groups:
        bad, describe = judge(ids, corners)
        if bad.any():
            count += int(np.count_nonzero(bad))
            row = int(np.argmax(bad))
            if ids[row] < first:
                first, place = ids[row], describe(row)
    if count:
        raise MeshError(f"{what(count)}; {'the first is' if count > 1 else 'it is'} {place}.", hint)


def counted(n: int, one: str, many: str) -> str:
    """How many, with the word for one or for many."""
    return f"{n} {one if n == 1 else many}"


def listed(corners: np.ndarray, places: Places) -> str:
    """The file's numbers of a few vertices."""
    shown = ", ".join(str(places.number(int(i))) for i in corners[:6])
    return shown + (", ..." if len(corners) > 6 else "")


def _row(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{v:g}" for v in values) + ")"
