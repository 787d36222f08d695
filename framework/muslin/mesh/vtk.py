"""Legacy VTK files: the geometry of grids and surfaces, as text and binary, in the layouts before and since 5.1.

A file is a title, DATASET with its type, points and cells, and then attributes (POINT_DATA, CELL_DATA). The
cloth is in the first part, so the reader stops where attributes begin; meshio reads all, and refuses a
file for an attribute it does not know (normals, texture coordinates, strings), and every POLYDATA.

https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons
from muslin.mesh.vtkcells import POLYGON, QUAD, STRIP, from_cells

TYPES = {
    "bit": "u1", "unsigned_char": "u1", "char": "i1", "unsigned_short": "u2", "short": "i2",
    "unsigned_int": "u4", "int": "i4", "unsigned_long": "u8", "long": "i8", "float": "f4", "double": "f8",
    "vtkidtype": "i4", "vtktypeint64": "i8", "vtktypeuint64": "u8", "vtktypeint32": "i4", "vtktypeuint32": "u4",
}  # fmt: skip
MOST = 20_000_000  # points of a structured grid

# Cells of a POLYDATA, and what they are in vtkCellType.h.
_SURFACE = {"vertices": 2, "lines": 4, "polygons": POLYGON, "triangle_strips": STRIP}
_ATTRIBUTES = ("point_data", "cell_data")


class _Cursor:
    """A place in a file of lines with numbers, as text or binary, between them."""

    def __init__(self, content: bytes):
        self.content = content
        self.position = 0
        self.binary = False

    def raw_line(self) -> str | None:
        """The next line as it is, or None at the end."""
        if self.position >= len(self.content):
            return None
        end = self.content.find(b"\n", self.position)
        end = len(self.content) if end < 0 else end
        line = self.content[self.position : end]
        self.position = end + 1
        return line.decode("latin-1").rstrip("\r")

    def words(self) -> list[str]:
        """The words of the next line that has any; none at the end."""
        while (line := self.raw_line()) is not None:
            if words := line.split():
                return words
        return []

    def peek(self) -> str:
        """The first word of the next line that has any, in small letters."""
        here = self.position
        words = self.words()
        self.position = here
        return words[0].lower() if words else ""

    def numbers(self, count: int, kind: str) -> np.ndarray:
        """The next `count` numbers of a type."""
        if kind.lower() not in TYPES:
            raise ValueError(f"{kind} is no type of numbers")
        if count < 0:
            raise ValueError(f"{count} numbers")
        dtype = np.dtype(">" + TYPES[kind.lower()])
        if self.binary:
            size = -(-count // 8) if kind.lower() == "bit" else count * dtype.itemsize
            if self.position + size > len(self.content):
                raise ValueError(
                    f"{size} bytes of numbers promised, {len(self.content) - self.position} there"
                )
            found = np.frombuffer(self.content, np.uint8, size, self.position)
            self.position += size
            return found if kind.lower() == "bit" else found.view(dtype)
        words: list[str] = []
        while len(words) < count:
            line = self.raw_line()
            if line is None:
                raise ValueError(f"{count} numbers promised, {len(words)} there")
            words += line.split()
        if len(words) > count:
            raise ValueError(f"more than the {count} numbers promised")
        return np.array(words, dtype=np.float64 if dtype.kind == "f" else np.int64)

    def skip_strings(self, count: int) -> None:
        """Step over strings: a line each, or each behind its length."""
        for _ in range(count):
            if not self.binary:
                if self.raw_line() is None:
                    raise ValueError(f"{count} strings promised, fewer there")
                continue
            # The two upper bits of the first byte say how many bytes hold the length.
            head = self.content[self.position : self.position + 1]
            if not head:
                raise ValueError(f"{count} strings promised, fewer there")
            width = {3: 1, 2: 2, 1: 4, 0: 8}[head[0] >> 6]
            length = int.from_bytes(self.content[self.position : self.position + width], "big")
            self.position += width + (length & ((1 << (8 * width - 2)) - 1))


def read_vtk(content: bytes, file: str) -> Polygons:
    """Polygons of a legacy VTK file.

    Raises
    ------
    MeshError
        For what Muslin does not read, or must not.
    ValueError
        For what breaks the rules of the format.
    """
    cursor = _Cursor(content)
    if not (cursor.raw_line() or "").lower().startswith("# vtk datafile version"):
        raise ValueError("its first line is not # vtk DataFile Version ...")
    cursor.raw_line()  # the title
    form = " ".join(cursor.words()).upper()
    if form not in ("ASCII", "BINARY"):
        raise ValueError(f"it is neither ASCII nor BINARY but {form[:30]!a}")
    cursor.binary = form == "BINARY"
    found = _sections(cursor, file)
    kind = found["dataset"]
    if kind in ("polydata", "unstructured_grid"):
        return _of_cells(found, file)
    return _structured(found, file)


def _sections(cursor: _Cursor, file: str) -> dict[str, Any]:
    """Everything before the attributes, by keyword."""
    found: dict[str, Any] = {"dataset": "", "cells": []}
    while words := cursor.words():
        keyword = words[0].lower()
        if keyword in _ATTRIBUTES:
            break
        match [keyword, *words[1:]]:
            case ["dataset", kind]:
                found["dataset"] = kind.lower()
            case ["metadata"]:
                while (cursor.raw_line() or "").strip():
                    pass
            case ["field", _, count]:
                for _ in range(int(count)):
                    _skip_array(cursor)
            case ["points", count, kind]:
                found["points"] = cursor.numbers(3 * int(count), kind).astype(np.float64).reshape(-1, 3)
            case ["vertices" | "lines" | "polygons" | "triangle_strips" | "cells", *counts]:
                found["cells"].append((keyword, *_cells(cursor, counts)))
            case ["cell_types", count]:
                found["types"] = cursor.numbers(int(count), "int")
            case ["dimensions", *numbers]:
                found["dimensions"] = [int(n) for n in numbers]
                if len(numbers) != 3 or min(found["dimensions"]) < 1:
                    raise ValueError(f"DIMENSIONS {' '.join(numbers)}")
                if math.prod(found["dimensions"]) > MOST:
                    raise MeshError(
                        f"{file} is a structured grid of more than {MOST:,} points.", "Save a coarser one."
                    )
            case ["origin" | "spacing" | "aspect_ratio", x, y, z]:
                found["origin" if keyword == "origin" else "spacing"] = [float(x), float(y), float(z)]
            case ["x_coordinates" | "y_coordinates" | "z_coordinates", count, kind]:
                found[keyword[0]] = cursor.numbers(int(count), kind).astype(np.float64)
            case _:
                raise ValueError(f"{' '.join(words)[:40]!a} is no section of VTK")
    if not found["dataset"]:
        raise ValueError("it has no DATASET")
    return found


def _skip_array(cursor: _Cursor) -> None:
    """Step over an array of a FIELD: its name, components, tuples and type, and then its values."""
    if cursor.peek() == "metadata":
        cursor.words()
        while (cursor.raw_line() or "").strip():
            pass
    words = cursor.words()
    if words and words[0].lower() == "null_array":
        return
    if len(words) != 4:
        raise ValueError(f"{' '.join(words)[:40]!a} is no array of a FIELD")
    count = int(words[1]) * int(words[2])
    if words[3].lower() in ("string", "utf8_string", "unicode_string"):
        cursor.skip_strings(count)
    else:
        cursor.numbers(count, words[3])


def _cells(cursor: _Cursor, counts: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Offsets and connectivity of a list of cells."""
    if len(counts) != 2:
        raise ValueError("a list of cells without its two counts")
    count, size = int(counts[0]), int(counts[1])
    if cursor.peek() == "offsets":  # since 5.1
        offsets = cursor.numbers(count, _type_behind(cursor, "offsets")).astype(np.int64)
        connectivity = cursor.numbers(size, _type_behind(cursor, "connectivity")).astype(np.int64)
        return (offsets if count else np.zeros(1, dtype=np.int64)), connectivity
    # Before: each cell's corners behind their number.
    flat = cursor.numbers(size, "int").astype(np.int64)
    values: list[int] = np.ravel(flat).tolist()
    starts: list[int] = []
    at = 0
    for cell in range(count):
        if at >= size or values[at] < 0:
            raise ValueError(f"{count} cells promised, {cell} there")
        starts.append(at)
        at += 1 + values[at]
    if at != size:
        raise ValueError(f"{count} cells take {at} numbers, and {size} are promised")
    begins = np.array(starts, dtype=np.int64) - np.arange(len(starts))
    return np.append(begins, size - count), np.delete(flat, starts)


def _type_behind(cursor: _Cursor, keyword: str) -> str:
    words = cursor.words()
    if len(words) != 2 or words[0].lower() != keyword:
        raise ValueError(f"no {keyword.upper()} where they should be")
    return words[1]


def _of_cells(found: dict[str, Any], file: str) -> Polygons:
    if "points" not in found:
        raise ValueError("it has no POINTS")
    grid = found["dataset"] == "unstructured_grid"
    if grid and not (found["cells"] and "types" in found):
        raise ValueError(f"it has no {'CELL_TYPES' if found['cells'] else 'CELLS'}")
    types = [np.zeros(0, dtype=np.int64)]
    offsets, connectivity = [np.zeros(1, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    total = 0
    for keyword, starts, corners in found["cells"]:
        if grid != (keyword == "cells"):
            raise ValueError(f"{keyword.upper()} in a {found['dataset'].upper()}")
        if starts[0] != 0 or (np.diff(starts) < 0).any() or starts[-1] != len(corners):
            raise ValueError(f"the offsets of {keyword.upper()} do not fit its {len(corners)} corners")
        types.append(found["types"] if grid else np.full(len(starts) - 1, _SURFACE[keyword]))
        connectivity.append(corners)
        offsets.append(starts[1:] + total)
        total += len(corners)
    return from_cells(
        found["points"], np.concatenate(types), np.concatenate(offsets), np.concatenate(connectivity), file
    )


def _structured(found: dict[str, Any], file: str) -> Polygons:
    """Quads of a grid that is two points thick nowhere: a sheet."""
    kind = found["dataset"]
    if kind not in ("structured_points", "structured_grid", "rectilinear_grid"):
        raise MeshError(
            f"{file} holds a {kind.upper()[:40]!a}, which is no mesh Muslin reads.",
            "Save a surface (POLYDATA) or an UNSTRUCTURED_GRID of triangles.",
        )
    sizes = found.get("dimensions")
    if sizes is None:
        raise ValueError("it has no DIMENSIONS")
    points = found.get("points")
    if kind != "structured_grid":
        if kind == "structured_points":
            origin, spacing = found.get("origin", [0.0] * 3), found.get("spacing", [1.0] * 3)
            axes = [o + s * np.arange(n) for o, s, n in zip(origin, spacing, sizes, strict=True)]
        else:
            axes = [found.get(axis, np.zeros(0)) for axis in "xyz"]
        # The first axis runs fastest.
        points = np.stack([a.ravel(order="F") for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    if points is None or len(points) != math.prod(sizes):
        raise ValueError(f"{math.prod(sizes)} points promised, {0 if points is None else len(points)} there")
    long = [n for n in sizes if n > 1]
    if len(long) != 2:
        ignored = {"hexahedron" if len(long) == 3 else "line": math.prod(n - 1 for n in long)} if long else {}
        return Polygons(points, [], ignored=ignored)
    number = np.arange(len(points)).reshape(long[1], long[0])
    corners = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)
    quads = corners.reshape(-1, 4)
    return from_cells(points, np.full(len(quads), QUAD), 4 * np.arange(len(quads) + 1), quads.ravel(), file)
