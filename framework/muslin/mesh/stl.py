"""STL, as text and binary: triangles whose corners are welded where they are exactly equal.

Read here rather than by meshio, which stops at capitals, at a facet without a normal and at a byte behind
the last triangle.
"""

from __future__ import annotations

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons
from muslin.mesh.refusals import EXPORT_AGAIN
from muslin.mesh.text import Line, decode

_HEAD = 84  # bytes: 80 of comment, 4 of the number of triangles
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])  # 50 bytes
_FRAME = {"outer", "loop", "endloop"}  # words that only frame the vertices


def read_stl(content: bytes, file: str) -> Polygons:
    """Triangles of an STL file, text or binary."""
    promised = int.from_bytes(content[80:_HEAD], "little")
    needed = _HEAD + _FACET.itemsize * promised
    exact = len(content) >= _HEAD and len(content) == needed
    if exact or b"\0" in content:  # a binary file may begin with the word solid, too
        corners, notices = _binary(content, file, promised, needed)
    else:
        corners, notices = _text(decode(content, file, "STL"), file), ()
    if len(corners) == 0:
        return Polygons(np.zeros((0, 3)), [], notices=notices)
    points, triangles = weld(corners)
    welded = f"{file}: STL has no shared vertices: {3 * len(corners)} corners welded into {len(points)}."
    return Polygons(points, [(np.arange(len(triangles)), triangles)], notices=(*notices, welded))


def weld(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and triangles (m, 3) of corners (m, 3, 3); points in the order of their first use."""
    flat = corners.reshape(-1, 3) + 0.0  # -0 is 0
    _, first, inverse = np.unique(flat, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return flat[first[order]], rank[inverse.ravel()].reshape(-1, 3)


def _binary(content: bytes, file: str, promised: int, needed: int) -> tuple[np.ndarray, tuple[str, ...]]:
    spare = len(content) - needed
    # Room for more whole triangles than promised: the count is wrong, and nobody knows which are meant.
    if len(content) < _HEAD or spare < 0 or (spare and spare % _FACET.itemsize == 0):
        raise MeshError(
            f"{file} is a damaged binary STL file: it promises {promised} triangles, which take "
            f"{needed} bytes, and has {len(content)}.",
            EXPORT_AGAIN,
        )
    facets = np.frombuffer(content, _FACET, promised, _HEAD)
    notices = (
        (f"{file}: {spare} byte{'s' * (spare != 1)} behind the last triangle left out.",) if spare else ()
    )
    return facets["corners"].astype(np.float64), notices


def _text(text: str, file: str) -> np.ndarray:
    """Corners (m, 3, 3) of an STL text, in one solid or several; normals are left out."""
    if not text.lstrip()[:5].lower() == "solid":
        raise MeshError(
            f"{file} is not an STL file.", "Is it the right file? ASCII STL begins with the word solid."
        )
    corners: list[list[float]] = []
    open_solid, start = False, 0
    for number, raw in enumerate(text.lower().split("\n"), start=1):
        words = raw.split()
        if not words:
            continue
        if words[0] in ("solid", "endsolid") or words[:2] == ["end", "solid"]:
            open_solid = words[0] == "solid"  # what follows is a name
            continue
        at = 0
        while at < len(words):
            word = words[at]
            at += 1
            if word == "end" and at < len(words):  # some write "end facet"
                word, at = word + words[at], at + 1
            if word == "vertex":
                line = Line(file, number, raw)
                if len(words) < at + 3:
                    raise line.error("a vertex needs three coordinates", "Fix the line or export again.")
                corners.append(line.floats(words[at : at + 3], "coordinates"))
                at += 3
            elif word in ("facet", "endfacet"):
                there = len(corners) - start
                if there != (3 if word == "endfacet" else 0):
                    raise Line(file, number, raw).error(
                        f"the end of a facet with {there} vertices, not three"
                        if word == "endfacet"
                        else "a facet before the one before it has ended",
                        EXPORT_AGAIN,
                    )
                start = len(corners)
            elif word == "normal":
                while at < len(words) and words[at] not in ("outer", "vertex"):
                    at += 1
            elif word == "color":  # some programs' own
                break
            elif word not in _FRAME:
                raise Line(file, number, raw).error("not understood in an STL file", EXPORT_AGAIN)
    if open_solid or start != len(corners):
        raise MeshError(f"{file} is truncated: it has no endsolid.", EXPORT_AGAIN)
    return np.array(corners).reshape(-1, 3, 3)
