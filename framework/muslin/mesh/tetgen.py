"""TetGen's meshes: vertices in a .node file, tetrahedra in the .ele file of the same name beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons
from muslin.mesh.text import Line, decode, expect_lines


def read_tetgen(content: bytes, file: str, path: Path) -> Polygons:
    """Vertices and tetrahedra of a pair of files, of which one is given."""
    other = _beside(path, ".ele" if path.suffix.lower() == ".node" else ".node")
    names = file, str(Path(file).with_name(other.name))
    texts = decode(content, names[0], "TetGen"), decode(other.read_bytes(), names[1], "TetGen")
    if path.suffix.lower() == ".ele":
        names, texts = names[::-1], texts[::-1]
    points, base, point_lines = _nodes(texts[0], names[0])
    cells, lines = _tetrahedra(texts[1], names[1])
    return Polygons(
        points,
        [],
        base=base,
        point_lines=point_lines,
        ignored={"tetra": len(cells)},
        ignored_points=(cells - base).ravel(),
        tetrahedra=cells - base,
        tetrahedron_lines=lines,
    )


def _beside(path: Path, suffix: str) -> Path:
    there = [p for p in (path.with_suffix(suffix), path.with_suffix(suffix.upper())) if p.is_file()]
    if not there:
        what = "vertices" if suffix == ".node" else "tetrahedra"
        raise MeshError(
            f"{path.name} is half of a TetGen mesh: {path.stem}{suffix}, with its {what}, is not beside it.",
            "Put both files into one folder.",
        )
    return there[0]


def _table(text: str, file: str, what: str) -> tuple[list[int], list[Line]]:
    """The numbers of the first line, and the lines it promises."""
    lines = [
        Line(file, number, content)
        for number, raw in enumerate(text.split("\n"), start=1)
        if (content := raw.split("#", 1)[0].strip())
    ]
    if not lines:
        raise MeshError(f"{file} has no counts.", "Export the mesh again.")
    counts = [lines[0].integer(word, "a count") for word in lines[0].text.split()]
    if not 1 <= len(counts) <= 4 or min(counts) < 0:
        raise lines[0].error("expected counts", "Is it a file of TetGen's?")
    expect_lines(file, len(lines) - 1, [(what, counts[0])])
    return counts, lines[1:]


def _nodes(text: str, file: str) -> tuple[np.ndarray, int, np.ndarray]:
    counts, lines = _table(text, file, "vertex")
    if len(counts) > 1 and counts[1] != 3:
        raise MeshError(f"{file} has {counts[1]} coordinates a vertex.", "A solid needs three.")
    points, base = [], 0
    for k, line in enumerate(lines):
        words = line.text.split()
        number = line.integer(words[0], "the number of a vertex")
        base = number if k == 0 else base
        if base not in (0, 1) or number != base + k:
            raise line.error(
                f"vertex {number} is out of turn", "TetGen numbers vertices one by one from 0 or 1."
            )
        if len(words) < 4:
            raise line.error("a vertex needs three coordinates", "Fix the line or export the mesh again.")
        points.append(line.floats(words[1:4], "coordinates"))
    return np.array(points).reshape(-1, 3), base, np.array([line.number for line in lines], dtype=np.int64)


def _tetrahedra(text: str, file: str) -> tuple[np.ndarray, np.ndarray]:
    counts, lines = _table(text, file, "tetrahedron")
    if len(counts) > 1 and counts[1] != 4:
        raise MeshError(
            f"{file} has {counts[1]} corners a tetrahedron.", "Muslin's are straight: leave TetGen's -o2 out."
        )
    cells = []
    for line in lines:
        words = line.text.split()
        if len(words) < 5:
            raise line.error("a tetrahedron needs four vertices", "Fix the line or export the mesh again.")
        cells.append([line.integer(word, "a vertex's number") for word in words[1:5]])
    return np.array(cells, dtype=np.int64).reshape(-1, 4), np.array(
        [ln.number for ln in lines], dtype=np.int64
    )
