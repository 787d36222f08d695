"""PLY, as text and binary: any elements and properties, in any order.

Only the header says what a PLY file holds, so this reader follows it: vertices, faces and triangle strips are
taken, whatever else there is (colours, texture coordinates, edges, materials) is stepped over. meshio knows
one order and few properties, and names no line.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons, by_corners, strip_triangles
from muslin.mesh.refusals import EXPORT_AGAIN, damaged
from muslin.mesh.text import Line, counted_face, decode, expect_lines

#: Name of a type in a PLY header -> numpy's.
TYPES = {
    **{name: "i1" for name in ("char", "int8")},
    **{name: "u1" for name in ("uchar", "uint8")},
    **{name: "i2" for name in ("short", "int16")},
    **{name: "u2" for name in ("ushort", "uint16")},
    **{name: "i4" for name in ("int", "int32")},
    **{name: "u4" for name in ("uint", "uint32")},
    **{name: "f4" for name in ("float", "float32")},
    **{name: "f8" for name in ("double", "float64")},
    "int64": "i8",
    "uint64": "u8",
}
_STRUCT = {
    "i1": "b",
    "u1": "B",
    "i2": "h",
    "u2": "H",
    "i4": "i",
    "u4": "I",
    "i8": "q",
    "u8": "Q",
    "f4": "f",
    "f8": "d",
}
_CORNERS = ("vertex_indices", "vertex_index")
_STRIPS = "tristrips"
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class Element:
    """An element of a PLY header: its properties in order, as (name, type) or (name, (count, type))."""

    name: str
    count: int
    properties: list[tuple[str, str | tuple[str, str]]]

    def where(self, *names: str) -> int:
        """Position of the first property of one of these names, or -1."""
        return next((i for i, (name, _) in enumerate(self.properties) if name in names), -1)


@dataclass
class Header:
    """A PLY header: the format word, the elements, and where the body starts, in lines and in bytes."""

    format: str
    elements: list[Element]
    lines: int
    size: int


#: Values of a property of all rows, grouped by length k: which rows (b,), and their values (b, k).
_Groups = list[tuple[np.ndarray, np.ndarray]]
#: Types of a property: numpy's for the count (None where it is no list), and for the values.
_Part = tuple[np.dtype | None, np.dtype]


def read_ply(content: bytes, file: str) -> Polygons:
    """Vertices, faces and triangle strips of a PLY file; other elements are left out."""
    header = read_header(content, file)
    if header.format == "ascii":
        return _read_text(decode(content, file, "PLY"), header, file)
    return _read_binary(content, header, file)


def read_header(content: bytes, file: str) -> Header:
    """Header of a PLY file, text or binary."""
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", content, re.MULTILINE)
    if not re.match(rb"ply\s", content) or end is None:
        trouble = "has no complete PLY header" if content.startswith(b"ply") else "is not a PLY file"
        raise MeshError(
            f"{file} {trouble}.",
            "A PLY file begins with the line ply and has a line end_header. Export it again.",
        )
    lines = decode(content[: end.end()], file, "PLY").split("\n")[:-1]
    header = Header("", [], len(lines), end.end())
    for number, text in enumerate(lines, start=1):
        line = Line(file, number, text)
        match text.split():
            case ["format", word, *_]:
                header.format = word
            case ["element", name, count] if name.isprintable():
                header.elements.append(Element(name, line.integer(count, "a count"), []))
                if header.elements[-1].count < 0:
                    raise line.error("a negative count", "Export the mesh again.")
            case ["property", "list", count, kind, name] if header.elements:
                _require_type(line, count, kind)
                header.elements[-1].properties.append((name, (count, kind)))
            case ["property", kind, name] if header.elements:
                _require_type(line, kind)
                header.elements[-1].properties.append((name, kind))
            case ["property", *_] | ["element", *_]:
                raise line.error("not understood in a PLY header", "Export the mesh again.")
    if header.format not in _FORMATS:
        raise MeshError(
            f"{file} has an unknown PLY format {header.format!a}.", "Export the mesh as ASCII PLY."
        )
    needs = {"vertex": (("x",), ("y",)), "face": (_CORNERS,), _STRIPS: (_CORNERS,)}
    for element in header.elements:
        for names in needs.get(element.name, ()) if element.count else ():
            if element.where(*names) < 0:
                raise MeshError(
                    f"{file}: its PLY header gives the element {element.name} no property {names[0]}.",
                    "Export the mesh again.",
                )
        lists = [name for name, kind in element.properties if name in "xyz" and not isinstance(kind, str)]
        if element.name == "vertex" and lists:
            raise damaged(file, "PLY", f"its coordinate {lists[0]} is a list")
    return header


def _require_type(line: Line, *kinds: str) -> None:
    for kind in kinds:
        if kind not in TYPES:
            raise line.error(f"{kind[:20]!a} is no type of PLY", "Export the mesh again.")


def _read_text(text: str, header: Header, file: str) -> Polygons:
    body = [
        Line(file, number, content)
        for number, content in enumerate(text.split("\n")[header.lines :], start=header.lines + 1)
        if content.strip()
    ]
    expect_lines(file, len(body), [(e.name, e.count) for e in header.elements])
    points: list[list[float]] = []
    faces: list[list[int]] = []
    point_lines: list[int] = []
    face_lines: list[int] = []
    ignored: dict[str, int] = {}
    start = 0
    for element in header.elements:
        lines = body[start : start + element.count]
        start += element.count
        if element.name == "vertex":
            point_lines += [line.number for line in lines]
            points += [_text_point(line, element) for line in lines]
        elif element.name == "face":
            face_lines += [line.number for line in lines]
            faces += [_text_corners(line, element) for line in lines]
        elif element.name == _STRIPS:
            for line in lines:
                made = strip_triangles(np.array(_text_corners(line, element, least=0)))
                faces += made.tolist()
                face_lines += [line.number] * len(made)
        elif element.count:
            ignored[element.name] = ignored.get(element.name, 0) + element.count
    return Polygons(
        np.array(points),
        by_corners(faces),
        point_lines=np.array(point_lines, dtype=np.int64),
        face_lines=np.array(face_lines, dtype=np.int64),
        ignored=ignored,
    )


def _text_point(line: Line, element: Element) -> list[float]:
    tokens, found = line.text.split(), dict[str, str]()
    for name, kind in element.properties:
        if not tokens:
            raise line.error(
                f"a vertex with {len(line.text.split())} of {len(element.properties)} values",
                "Fix the line or export again.",
            )
        if isinstance(kind, str):
            found[name], tokens = tokens[0], tokens[1:]
        else:
            tokens = tokens[1 + line.integer(tokens[0], "a count") :]
    return line.floats([found[axis] for axis in "xyz" if axis in found], "coordinates")


def _text_corners(line: Line, element: Element, least: int = 3) -> list[int]:
    tokens = line.text.split()
    for name, kind in element.properties:
        if name in _CORNERS:
            return counted_face(line, tokens, least)
        skip = 1 if isinstance(kind, str) or not tokens else 1 + line.integer(tokens[0], "a count")
        tokens = tokens[skip:]
    raise line.error("a face without corners", "Export the mesh again.")


def _read_binary(content: bytes, header: Header, file: str) -> Polygons:
    position = header.size
    points: np.ndarray = np.zeros((0, 3))
    faces: _Groups = []
    ignored: dict[str, int] = {}
    made = 0  # faces so far
    for element in header.elements:
        columns, position = _columns(content, position, element, _FORMATS[header.format], file)
        if not element.count:
            continue
        if element.name == "vertex":
            chosen = [columns[i] for i in map(element.where, "xyz") if i >= 0]
            points = np.concatenate([column[0][1] for column in chosen], axis=1, dtype=np.float64)
        elif element.name in ("face", _STRIPS):
            groups = columns[element.where(*_CORNERS)]
            if any(corners.dtype.kind not in "iu" for _, corners in groups):
                raise damaged(file, "PLY", f"corners of a {element.name} that are not whole numbers")
            if element.name == "face":
                short = [int(rows[0]) for rows, corners in groups if corners.shape[1] < 3]
                if short:
                    raise damaged(file, "PLY", f"face {min(short)} has fewer than three corners")
                faces += [(made + rows, corners.astype(np.int64)) for rows, corners in groups]
                made += element.count
            else:
                for _, strips in groups:
                    triangles = np.concatenate([strip_triangles(strip) for strip in strips])
                    faces.append((made + np.arange(len(triangles)), triangles))
                    made += len(triangles)
        else:
            ignored[element.name] = ignored.get(element.name, 0) + element.count
    return Polygons(points, [group for group in faces if len(group[0])], ignored=ignored)


def _columns(
    content: bytes, position: int, element: Element, order: str, file: str
) -> tuple[list[_Groups], int]:
    """Properties of an element whose rows start at a byte, and where they end."""
    parts: list[_Part] = [
        (None, np.dtype(order + TYPES[kind]))
        if isinstance(kind, str)
        else (np.dtype(order + TYPES[kind[0]]), np.dtype(order + TYPES[kind[1]]))
        for _, kind in element.properties
    ]
    least = sum(kind.itemsize if count is None else count.itemsize for count, kind in parts)
    _require(position + least * element.count, content, element, file)
    if element.count == 0 or not parts:
        return [], position
    return _alike_rows(content, position, element.count, parts) or _any_rows(
        content, position, element, parts, file
    )


def _require(needed: int, content: bytes, element: Element, file: str) -> None:
    if needed > len(content):
        raise MeshError(
            f"{file} is truncated: its {element.count} elements {element.name} need at least {needed} bytes, "
            f"and it has {len(content)}.",
            EXPORT_AGAIN,
        )


def _alike_rows(
    content: bytes, position: int, count: int, parts: list[_Part]
) -> tuple[list[_Groups], int] | None:
    """`_columns` where the lists of all rows are as long as those of the first, at once; or None."""
    fields: list[tuple[str, np.dtype, int]] = []
    at = position
    for k, (counter, kind) in enumerate(parts):
        length = 1
        if counter is not None:
            if at + counter.itemsize > len(content):
                return None
            length = int(np.frombuffer(content, counter, 1, at)[0]) if counter.kind != "f" else -1
            if length < 0:
                return None
            fields.append((f"count {k}", counter, 1))
            at += counter.itemsize
        fields.append((f"value {k}", kind, length))
        at += length * kind.itemsize
        if at > len(content):
            return None
    row = np.dtype([(name, kind, (length,)) for name, kind, length in fields])
    if position + row.itemsize * count > len(content):
        return None
    rows = np.frombuffer(content, row, count, position)
    for k, (counter, _) in enumerate(parts):
        if counter is not None and (rows[f"count {k}"] != rows[f"value {k}"].shape[1]).any():
            return None
    every = np.arange(count)
    return [[(every, rows[f"value {k}"])] for k in range(len(parts))], position + row.itemsize * count


def _any_rows(
    content: bytes, position: int, element: Element, parts: list[_Part], file: str
) -> tuple[list[_Groups], int]:
    """`_columns` row by row."""
    readers = [
        (
            None
            if counter is None
            else struct.Struct(counter.str[0].replace("|", "<") + _STRUCT[counter.str[1:]]),
            kind,
        )
        for counter, kind in parts
    ]
    starts = np.zeros((len(parts), element.count), dtype=np.int64)
    counts = np.ones((len(parts), element.count), dtype=np.int64)
    for row in range(element.count):
        for k, (counter, kind) in enumerate(readers):
            length = 1
            if counter is not None:
                _require(position + counter.size, content, element, file)
                length = counter.unpack_from(content, position)[0]
                if not 0 <= length <= len(content) or length != int(length):
                    raise damaged(file, "PLY", f"{element.name} {row} has a list of {length} values")
                length = int(length)
                position += counter.size
                counts[k, row] = length
            starts[k, row] = position
            position += length * kind.itemsize
        _require(position, content, element, file)
    raw = np.frombuffer(content, np.uint8)
    columns = []
    for k, (_, kind) in enumerate(parts):
        groups = []
        for length in np.unique(counts[k]):
            rows = np.flatnonzero(counts[k] == length)
            at = starts[k, rows, None] + np.arange(length * kind.itemsize)
            groups.append((rows, np.ascontiguousarray(raw[at]).view(kind).reshape(len(rows), length)))
        columns.append(groups)
    return columns, position
