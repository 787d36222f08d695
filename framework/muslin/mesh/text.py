"""OBJ and OFF, line by line.

These are read here rather than by meshio, for two reasons. A message can name the line. And meshio's
readers misread some lawful files without a word: OBJ's relative indices, OFF's comments and quads.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons, by_corners


@dataclass
class Line:
    """A line of a file, and how to complain about it."""

    file: str
    number: int
    text: str

    def error(self, trouble: str, hint: str = "") -> MeshError:
        """An error that names the line and shows it."""
        shown = self.text.strip()
        shown = ascii(shown if len(shown) <= 60 else shown[:57] + "...")
        return MeshError(f"{self.file}, line {self.number}: {trouble}: {shown}.", hint)

    def floats(self, tokens: list[str], what: str) -> list[float]:
        """Numbers of tokens."""
        try:
            return [float(token) for token in tokens]
        except ValueError:
            raise self.error(f"{what} should be numbers", "Fix the line or export the mesh again.") from None

    def integer(self, token: str, what: str) -> int:
        """Whole number of a token."""
        try:
            value = int(token)
        except ValueError:
            raise self.error(
                f"{what} should be a whole number", "Fix the line or export the mesh again."
            ) from None
        if abs(value) >= 2**31:
            raise self.error(f"{what} is out of range", "Fix the line or export the mesh again.")
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


def _obj_lines(text: str, file: str) -> Iterator[Line]:
    """Lines with content; a backslash at the end joins the next line."""
    held, start = "", 0
    for number, raw in enumerate(text.split("\n"), start=1):
        content = raw.split("#", 1)[0].rstrip()
        start = start or number
        if content.endswith("\\"):
            held += content[:-1] + " "
            continue
        if (held + content).strip():
            yield Line(file, start, held + content)
        held, start = "", 0
    if held.strip():
        yield Line(file, start, held)


def _obj_index(line: Line, token: str, so_far: int) -> int:
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


def _coordinates(line: Line, tokens: list[str], before: list[list[float]]) -> list[float]:
    """The first three (or, throughout a file, two) numbers of a vertex line."""
    values = line.floats(tokens, "coordinates")[:3]
    if len(values) < 2:
        raise line.error("a vertex needs three coordinates", "Fix the line or export the mesh again.")
    if before and len(values) != len(before[0]):
        raise line.error(
            f"a vertex with {len(values)} coordinates among vertices with {len(before[0])}",
            "Fix the line or export the mesh again.",
        )
    return values


def read_off(text: str, file: str) -> Polygons:
    """Vertices and faces of an OFF file (also COFF, NOFF, STOFF: what follows x y z is left out)."""
    lines = [
        Line(file, number, content)
        for number, raw in enumerate(text.split("\n"), start=1)
        if (content := raw.split("#", 1)[0].strip())
    ]
    header = re.fullmatch(r"(?:ST)?C?N?OFF(?![A-Za-z])(.*)", lines[0].text) if lines else None
    if header is None or "BINARY" in header[1]:
        found = f"its first line is {lines[0].text[:40]!a}" if lines else "it is blank"
        raise MeshError(
            f"{file} is not an OFF file of a surface in space: {found}.",
            "An OFF file begins with the line OFF (as text, not OFF BINARY). Export the mesh again.",
        )
    body = lines[1:]
    if header[1].strip():  # counts behind the keyword
        body.insert(0, Line(file, lines[0].number, header[1].strip()))
    if not body:
        raise MeshError(f"{file} ends after the OFF header.", "The file is truncated: export the mesh again.")
    counts = [body[0].integer(token, "a count") for token in body[0].text.split()]
    if len(counts) not in (2, 3) or min(counts) < 0:
        raise body[0].error("expected the numbers of vertices, faces and edges", "Export the mesh again.")
    n, m = counts[:2]
    expect_lines(file, len(body) - 1, [("vertex", n), ("face", m)])
    points: list[list[float]] = []
    for line in body[1 : 1 + n]:
        points.append(_coordinates(line, line.text.split(), points))
    faces = []
    for line in body[1 + n :]:
        faces.append(counted_face(line, line.text.split()))
    return Polygons(
        np.array(points),
        by_corners(faces),
        point_lines=np.array([line.number for line in body[1 : 1 + n]], dtype=np.int64),
        face_lines=np.array([line.number for line in body[1 + n :]], dtype=np.int64),
    )


def counted_face(line: Line, tokens: list[str], least: int = 3) -> list[int]:
    """Corners of a face given as count and indices."""
    k = line.integer(tokens[0], "the number of corners") if tokens else 0
    if k < least:
        raise line.error(f"a face with {k} corner{'s' * (k != 1)}", "A face needs at least three.")
    if len(tokens) < 1 + k:
        raise line.error(
            f"a face of {k} corners with {len(tokens) - 1} indices", "Fix the line or export the mesh again."
        )
    return [line.integer(token, "a vertex index") for token in tokens[1 : 1 + k]]


def expect_lines(file: str, found: int, elements: list[tuple[str, int]]) -> None:
    """Refuse a file that has not as many lines as its counts (name, count) promise."""
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
