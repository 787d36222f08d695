"""OBJ, OFF and ASCII PLY, line by line.

These three are read here rather than by meshio, for two reasons. A message can name the line. And meshio's
readers misread some lawful files without a word: OBJ's relative indices, OFF's comments and quads.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from muslin.errors import MeshError
from muslin.mesh.polygons import Polygons, by_corners


@dataclass
class _Line:
    """A line of a file, and how to complain about it."""

    file: str
    number: int
    text: str

    def error(self, trouble: str, hint: str = "") -> MeshError:
        shown = self.text.strip()
        shown = ascii(shown if len(shown) <= 60 else shown[:57] + "...")
        return MeshError(f"{self.file}, line {self.number}: {trouble}: {shown}.", hint)

    def floats(self, tokens: list[str], what: str) -> list[float]:
        try:
            return [float(token) for token in tokens]
        except ValueError:
            raise self.error(f"{what} should be numbers", "Mend the line or export the mesh again.") from None

    def integer(self, token: str, what: str) -> int:
        try:
            value = int(token)
        except ValueError:
            raise self.error(
                f"{what} should be a whole number", "Mend the line or export the mesh again."
            ) from None
        if abs(value) >= 2**31:
            raise self.error(f"{what} is out of range", "Mend the line or export the mesh again.")
        return value


def decode(content: bytes, file: str, kind: str) -> str:
    """Text of a file with line ends as newlines; a MeshError for what is not text."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise MeshError(f"{file} is UTF-16 text.", f"Save it as plain (UTF-8) text to read it as {kind}.")
    if b"\0" in content:
        raise MeshError(
            f"{file} is not a text file: it holds binary data.",
            f"Is it really {kind}? Export the mesh again, or give the file its right extension.",
        )
    text = content.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_obj(text: str, file: str) -> Polygons:
    """Vertices and faces of an OBJ file; texture, normals, groups and materials are left out."""
    points: list[list[float]] = []
    point_lines: list[int] = []
    faces: list[list[int]] = []
    face_lines: list[int] = []
    ignored: dict[str, int] = {}
    ignored_points: list[int] = []
    for line in _obj_lines(text, file):
        keyword, *tokens = line.text.split()
        if keyword == "v":
            # x y z, then perhaps a weight or a colour.
            points.append(_coordinates(line, tokens, points))
            point_lines.append(line.number)
        elif keyword == "f":
            if len(tokens) < 3:
                raise line.error(
                    f"a face with {len(tokens)} corner{'s' * (len(tokens) != 1)}",
                    "A face needs at least three.",
                )
            faces.append([_obj_index(line, token, len(points)) for token in tokens])
            face_lines.append(line.number)
        elif keyword in ("l", "p"):
            kind = "line" if keyword == "l" else "point"
            ignored[kind] = ignored.get(kind, 0) + 1
            ignored_points += [_obj_index(line, token, len(points)) for token in tokens]
    if not points:
        raise MeshError(
            f"{file} has no vertices.", "Is it an OBJ file? Its vertices stand on lines that begin with 'v'."
        )
    return Polygons(
        np.array(points),
        by_corners(faces),
        base=1,
        point_lines=np.array(point_lines, dtype=np.int64),
        face_lines=np.array(face_lines, dtype=np.int64),
        ignored=ignored,
        ignored_points=np.array(ignored_points, dtype=np.int64),
    )


def _obj_lines(text: str, file: str) -> Iterator[_Line]:
    """Lines with content; a backslash at the end joins the next line."""
    held, start = "", 0
    for number, raw in enumerate(text.split("\n"), start=1):
        content = raw.split("#", 1)[0].rstrip()
        start = start or number
        if content.endswith("\\"):
            held += content[:-1] + " "
            continue
        if (held + content).strip():
            yield _Line(file, start, held + content)
        held, start = "", 0
    if held.strip():
        yield _Line(file, start, held)


def _obj_index(line: _Line, token: str, so_far: int) -> int:
    """Vertex index from 0 of an OBJ corner i, i/t, i//n or i/t/n; negative i counts back from here.

    0, which is no vertex, comes out as -1 and is refused with the other indices out of range.
    """
    i = line.integer(token.split("/", 1)[0], "a vertex index")
    if i >= 0:
        return i - 1
    if -i > so_far:
        raise line.error(
            f"index {i} counts back from here, out of range: only {so_far} vertices come before",
            "Negative indices are relative: -1 is the latest vertex.",
        )
    return so_far + i


def _coordinates(line: _Line, tokens: list[str], before: list[list[float]]) -> list[float]:
    """The first three (or, throughout a file, two) numbers of a vertex line."""
    values = line.floats(tokens, "coordinates")[:3]
    if len(values) < 2:
        raise line.error("a vertex needs three coordinates", "Mend the line or export the mesh again.")
    if before and len(values) != len(before[0]):
        raise line.error(
            f"a vertex with {len(values)} coordinates among vertices with {len(before[0])}",
            "Mend the line or export the mesh again.",
        )
    return values


def read_off(text: str, file: str) -> Polygons:
    """Vertices and faces of an OFF file (also COFF, NOFF, STOFF: what follows x y z is left out)."""
    lines = [
        _Line(file, number, content)
        for number, raw in enumerate(text.split("\n"), start=1)
        if (content := raw.split("#", 1)[0].strip())
    ]
    header = re.fullmatch(r"(?:ST)?C?N?OFF\b(.*)", lines[0].text) if lines else None
    if header is None or "BINARY" in header[1]:
        found = f"its first line is {lines[0].text[:40]!a}" if lines else "it is blank"
        raise MeshError(
            f"{file} is not an OFF file of a surface in space: {found}.",
            "An OFF file begins with the line OFF (as text, not OFF BINARY). Export the mesh again.",
        )
    body = lines[1:]
    if header[1].strip():  # counts behind the keyword
        body.insert(0, _Line(file, lines[0].number, header[1].strip()))
    if not body:
        raise MeshError(f"{file} ends after the OFF header.", "The file is truncated: export the mesh again.")
    counts = [body[0].integer(token, "a count") for token in body[0].text.split()]
    if len(counts) not in (2, 3) or min(counts) < 0:
        raise body[0].error("expected the numbers of vertices, faces and edges", "Export the mesh again.")
    n, m = counts[:2]
    _expect_lines(file, len(body) - 1, [("vertex", n), ("face", m)])
    points: list[list[float]] = []
    for line in body[1 : 1 + n]:
        points.append(_coordinates(line, line.text.split(), points))
    faces = []
    for line in body[1 + n :]:
        faces.append(_counted_face(line, line.text.split())[0])
    return Polygons(
        np.array(points),
        by_corners(faces),
        point_lines=np.array([line.number for line in body[1 : 1 + n]], dtype=np.int64),
        face_lines=np.array([line.number for line in body[1 + n :]], dtype=np.int64),
    )


def _counted_face(line: _Line, tokens: list[str]) -> tuple[list[int], int]:
    """Corners of a face given as count and indices, and how many tokens that took."""
    k = line.integer(tokens[0], "the number of corners") if tokens else 0
    if k < 3:
        raise line.error(f"a face with {k} corner{'s' * (k != 1)}", "A face needs at least three.")
    if len(tokens) < 1 + k:
        raise line.error(
            f"a face of {k} corners with {len(tokens) - 1} indices", "Mend the line or export the mesh again."
        )
    return [line.integer(token, "a vertex index") for token in tokens[1 : 1 + k]], 1 + k


def _expect_lines(file: str, found: int, elements: list[tuple[str, int]]) -> None:
    expected = sum(count for _, count in elements)
    if found != expected:
        promised = " and ".join(f"{count} {name}" for name, count in elements)
        verb, cause = (
            ("ends after", "The file is truncated") if found < expected else ("has", "The counts are wrong")
        )
        raise MeshError(
            f"{file} promises {promised} lines but {verb} {found} of {expected}.",
            f"{cause}: export the mesh again.",
        )


@dataclass
class PlyElement:
    """An element of a PLY header: its properties in order, as (name, type) or (name, (count, type))."""

    name: str
    count: int
    properties: list[tuple[str, str | tuple[str, str]]]


@dataclass
class PlyHeader:
    """A PLY header: the format word, the elements, and where the body starts."""

    format: str
    elements: list[PlyElement]
    lines: int
    size: int

    def element(self, name: str) -> PlyElement:
        """Element of this name, or one of none."""
        return next((e for e in self.elements if e.name == name), PlyElement(name, 0, []))


PLY_SIZES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "float", "int32", "uint32", "float32"), 4),
    **dict.fromkeys(("double", "float64", "int64", "uint64"), 8),
}
_CORNERS = ("vertex_indices", "vertex_index")


def ply_header(content: bytes, file: str) -> PlyHeader:
    """Header of a PLY file, text or binary."""
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", content, re.MULTILINE)
    if not re.match(rb"ply\s", content) or end is None:
        trouble = "has no complete PLY header" if content.startswith(b"ply") else "is not a PLY file"
        raise MeshError(
            f"{file} {trouble}.",
            "A PLY file begins with the line ply and has a line end_header. Export it again.",
        )
    lines = decode(content[: end.end()], file, "PLY").split("\n")[:-1]
    header = PlyHeader("", [], len(lines), end.end())
    for number, text in enumerate(lines, start=1):
        line = _Line(file, number, text)
        match text.split():
            case ["format", word, *_]:
                header.format = word
            case ["element", name, count] if name.isprintable():
                header.elements.append(PlyElement(name, line.integer(count, "a count"), []))
                if header.elements[-1].count < 0:
                    raise line.error("a negative count", "Export the mesh again.")
            case ["property", "list", count, kind, name] if header.elements:
                header.elements[-1].properties.append((name, (count, kind)))
            case ["property", kind, name] if header.elements:
                header.elements[-1].properties.append((name, kind))
            case ["property", *_] | ["element", *_]:
                raise line.error("not understood in a PLY header", "Export the mesh again.")
    if header.format not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise MeshError(
            f"{file} has an unknown PLY format {header.format!a}.", "Export the mesh as ASCII PLY."
        )
    for element, names in (("vertex", ("x",)), ("vertex", ("y",)), ("face", _CORNERS)):
        found = header.element(element)
        if found.count and not any(name in names for name, _ in found.properties):
            raise MeshError(
                f"{file}: its PLY header gives the element {element} no property {names[0]}.",
                "Export the mesh again.",
            )
    return header


def read_ascii_ply(text: str, header: PlyHeader, file: str) -> Polygons:
    """Vertices and faces of an ASCII PLY file; other elements are ignored."""
    body = [
        _Line(file, number, content)
        for number, content in enumerate(text.split("\n")[header.lines :], start=header.lines + 1)
        if content.strip()
    ]
    _expect_lines(file, len(body), [(e.name, e.count) for e in header.elements])
    points: list[list[float]] = []
    faces: list[list[int]] = []
    point_lines, face_lines = [], []
    ignored, start = {}, 0
    for element in header.elements:
        lines = body[start : start + element.count]
        start += element.count
        if element.name == "vertex":
            point_lines = [line.number for line in lines]
            names = [name for name, _ in element.properties]
            columns = [names.index(axis) for axis in "xyz" if axis in names]
            for line in lines:
                values = line.text.split()
                if len(values) < len(names):
                    raise line.error(
                        f"a vertex with {len(values)} of {len(names)} values",
                        "Mend the line or export again.",
                    )
                points.append(line.floats([values[c] for c in columns], "coordinates"))
        elif element.name == "face":
            face_lines = [line.number for line in lines]
            faces = [_ply_face(line, element) for line in lines]
        elif element.count:
            ignored[element.name] = element.count
    return Polygons(
        np.array(points),
        by_corners(faces),
        point_lines=np.array(point_lines, dtype=np.int64),
        face_lines=np.array(face_lines, dtype=np.int64),
        ignored=ignored,
    )


def _ply_face(line: _Line, element: PlyElement) -> list[int]:
    tokens = line.text.split()
    for name, kind in element.properties:
        if name in _CORNERS:
            return _counted_face(line, tokens)[0]
        skip = 1 if isinstance(kind, str) or not tokens else 1 + line.integer(tokens[0], "a count")
        tokens = tokens[skip:]
    raise line.error("a face without corners", "Export the mesh again.")
