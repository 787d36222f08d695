"""Medit's meshes as text: sections of rows, a keyword and how many before each; the last number of a row is a label."""

from __future__ import annotations

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons
from muslin.mesh.text import Line

#: Sections with elements: keyword -> what they are, and their corners.
_ELEMENTS = {
    "edges": ("line", 2),
    "triangles": ("triangle", 3),
    "quadrilaterals": ("quad", 4),
    "tetrahedra": ("tetra", 4),
    "hexahedra": ("hexahedron", 8),
    "hexaedra": ("hexahedron", 8),
    "prisms": ("wedge", 6),
    "pyramids": ("pyramid", 5),
}


def read_medit(text: str, file: str) -> Polygons:
    """Vertices, faces and tetrahedra of a Medit file; other elements are counted, other sections left out."""
    words = _words(text, file)
    if not words or words[0][0].lower() != "meshversionformatted":
        raise MeshError(
            f"{file} is not a Medit mesh as text: it does not begin with MeshVersionFormatted.",
            "Save it as text (.mesh, not .meshb).",
        )
    found = Polygons(np.zeros((0, 3)), [])
    at, dimension, ids = 0, 3, 0
    while at < len(words):
        keyword = words[at][0].lower()
        at += 1
        if keyword in ("meshversionformatted", "dimension"):
            value = _whole(words, at, file)
            if keyword == "dimension" and value not in (2, 3):
                raise words[at][1].error(f"a mesh of {value} dimensions", "Muslin reads two and three.")
            dimension = value if keyword == "dimension" else dimension
            at += 1
        elif keyword == "vertices":
            count = _whole(words, at, file)
            rows, lines = _rows(words, at + 1, count, dimension + 1, file, "vertex")
            found.points, found.point_lines = rows[:, :dimension], lines
            at += 1 + count * (dimension + 1)
        elif keyword in _ELEMENTS:
            kind, corners = _ELEMENTS[keyword]
            count = _whole(words, at, file)
            rows, lines = _rows(words, at + 1, count, corners + 1, file, kind)
            at += 1 + count * (corners + 1)
            _take(found, kind, rows[:, :corners].astype(np.int64) - 1, lines, ids)
            ids += count if kind in ("triangle", "quad") else 0
        elif keyword == "end":
            break
        else:  # corners, ridges, normals and what else there may be, up to the next keyword
            while at < len(words) and not words[at][0][:1].isalpha():
                at += 1
    found.base = 1
    return found


def _take(found: Polygons, kind: str, corners: np.ndarray, lines: np.ndarray, ids: int) -> None:
    if not len(corners):
        return
    if kind in ("triangle", "quad"):
        found.faces.append((np.arange(ids, ids + len(corners)), corners))
        found.face_lines = lines if found.face_lines is None else np.append(found.face_lines, lines)
        return
    found.ignored[kind] = found.ignored.get(kind, 0) + len(corners)
    found.ignored_points = np.append(found.ignored_points, corners.ravel())
    if kind == "tetra":
        found.tetrahedra, found.tetrahedron_lines = corners, lines


def _words(text: str, file: str) -> list[tuple[str, Line]]:
    lines = (Line(file, number, raw.split("#", 1)[0]) for number, raw in enumerate(text.split("\n"), start=1))
    return [(word, line) for line in lines for word in line.text.split()]


def _whole(words: list[tuple[str, Line]], at: int, file: str) -> int:
    if at >= len(words):
        raise MeshError(
            f"{file} ends where a number should follow.", "The file is truncated: export the mesh again."
        )
    value = words[at][1].integer(words[at][0], f"what follows {words[at - 1][0]}")
    if value < 0:
        raise words[at][1].error(f"{value} of them", "Export the mesh again.")
    return value


def _rows(
    words: list[tuple[str, Line]], at: int, count: int, width: int, file: str, kind: str
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (count, width), and the line each row begins on."""
    part = words[at : at + count * width]
    if len(part) < count * width:
        raise MeshError(
            f"{file} promises {count} rows ({kind}) and ends after {len(part) // width}.",
            "The file is truncated: export the mesh again.",
        )
    values = []
    for word, line in part:
        if word[:1].isalpha() and word.lower() not in ("nan", "inf", "infinity"):
            raise line.error(
                f"{word} where a number of a {kind} should be", "Its count is wrong, or a row is short."
            )
        values += line.floats([word], f"a {kind}'s entries")
    lines = np.array([line.number for _, line in part[::width]], dtype=np.int64)
    return np.array(values).reshape(count, width), lines
